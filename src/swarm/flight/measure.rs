//! Measures of a flight, taken from the robots' true places, not from the poses they send. Errors are those of
//! the robots without a fault at the time.

use serde::Serialize;

use super::Flight;
use super::acceleration::Accelerations;
use super::moment::Extreme;
use crate::flock::rounding::ROUNDING;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::minus;
use crate::scene::swarm::Swarm;
use crate::swarm::robots::{Model, Robot};
use crate::swarm::safety::foot;

/// One period of a flight; distances in \[m\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// At the end of the period \[s\].
    pub time: f64,
    /// Largest distance of a robot, leaders included, from its place under the leaders' affine motion.
    pub affine_error: Option<f64>,
    /// Largest distance of a robot from its place: of a follower from where the rule comes to rest behind the leaders as
    /// they are, of a leader from where it is led to.
    pub formation_error: Option<f64>,
    /// Smallest free space between two rims, or a rim and an obstacle, during the period; infinite where there is neither.
    #[serde(serialize_with = "finite")]
    pub clearance: f64,
    /// Largest distance from the continuum run of the same scene.
    pub continuum_error: Option<f64>,
    /// Sum of PE1 over the members \[m^2\].
    pub pe1: f64,
    /// Largest strain of a member's surroundings \[1\]; absent where no member has neighbours in two directions.
    pub strain: Option<f64>,
    /// Members whose pose is too old to be used, from each one's first pose on.
    pub lost: usize,
}

fn finite<S: serde::Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(serializer)
}

/// A flight as it went.
#[derive(Clone, Debug)]
pub struct Record {
    /// Measures of every period.
    pub samples: Vec<Sample>,
    /// Times of `tracks` \[s\].
    pub times: Vec<f64>,
    /// Places at every recorded period \[m\], shape \[recorded, members\].
    pub tracks: Vec<Vectors>,
    /// Length of each robot's way \[m\].
    pub ways: Vec<f64>,
    /// Least free space around each robot \[m\], shape \[members\].
    pub clearances: Vec<f64>,
    /// The closest that a robot came to another, or to an obstacle.
    pub(super) closest: Option<Extreme>,
    /// The robot farthest from its place in each period: by the affine motion, by the rule, by the continuum.
    pub(super) farthest: Vec<[Option<Extreme>; 3]>,
    /// Where there is a limit.
    pub(super) accelerations: Option<Accelerations>,
    /// Members that led at the start.
    pub(super) leaders: usize,
    /// If they are over, when the leaders' programs ended: by their own time and by that of the flight \[s\].
    pub(super) programs_ended: Option<[f64; 2]>,
    every: usize,
    around: Vec<f64>,
}

impl Record {
    /// A record of the start alone.
    pub fn new(swarm: &Swarm, flight: &Flight) -> Self {
        let count = flight.fleet().robots().len();
        let formation = flight.control().formation();
        Self {
            samples: Vec::new(),
            times: vec![0.0],
            tracks: vec![flight.fleet().places()],
            ways: vec![0.0; count],
            clearances: vec![f64::INFINITY; count],
            closest: None,
            farthest: Vec::new(),
            accelerations: swarm.raw.limits.acceleration.map(|limit| Accelerations::new(limit, flight)),
            leaders: (0..count).filter(|&m| formation.leads(m)).count(),
            programs_ended: None,
            every: swarm.raw.flight.record_every,
            around: Vec::new(),
        }
    }

    /// Measures the period just flown; `before` is where the robots were as it began.
    pub fn take(&mut self, flight: &Flight, before: &Vectors) -> Sample {
        let control = flight.control();
        let formation = control.formation();
        let present = flight.fleet().places();
        for (m, way) in self.ways.iter_mut().enumerate() {
            *way += distance(before.get(m), present.get(m));
        }
        if let Some(accelerations) = &mut self.accelerations {
            accelerations.take(flight, control.period());
        }
        let bends = bends(flight, before);
        control.filter().clearance_on_the_way([before, &present], bends.as_ref(), &mut self.around);
        for (least, &now) in self.clearances.iter_mut().zip(&self.around) {
            *least = least.min(now);
        }
        let time = flight.fleet().time();
        self.programs_ended = programs_ended(flight, self.programs_ended);
        let clearance = self.around.iter().copied().fold(f64::INFINITY, f64::min);
        if clearance < self.closest.map_or(f64::INFINITY, |closest| closest.value) {
            // As near as their rims may have come: a bend leads aside by no more than a quarter of it.
            let gap = |a: usize, b: usize| {
                let apart = |places: &Vectors| minus(places.get(a), places.get(b));
                let aside = |m| bends.as_ref().map_or(0.0, |bends| 0.25 * distance(bends.get(m), [0.0; 2]));
                let nearest = distance(foot([apart(before), apart(&present)], [0.0; 2]), [0.0; 2]);
                nearest - formation.radii[a] - formation.radii[b] - aside(a) - aside(b)
            };
            self.closest = Some(closest(&self.around, clearance, gap, &present, time));
        }
        let farthest = |place: &dyn Fn(usize) -> [f64; 2], sound_only: bool| {
            farthest(&present, time, place, |m| !sound_only || flight.fleet().is_sound(m))
        };
        // Before the programs begin there is no place by them.
        let affine = formation.affine(control.program_time()).filter(|_| control.has_begun());
        let affine = affine.map(|map| farthest(&|m| map.apply(formation.places.get(m)), true));
        let led_to = |m: usize| Some(control.wanted(m)).filter(|place| place.iter().all(|x| x.is_finite()));
        let rest = control.settled_at(&present).map(|rest| {
            let place = |m: usize| led_to(m).filter(|_| formation.leads(m)).unwrap_or_else(|| rest.get(m));
            farthest(&place, true)
        });
        let continuum = flight.continuum_places().map(|place| farthest(&place, false));
        let error = |extreme: Option<Option<Extreme>>| extreme.map(|one| one.map_or(0.0, |one| one.value));
        let measures = formation.measures(&present);
        let sample = Sample {
            time,
            affine_error: error(affine),
            formation_error: error(rest),
            clearance,
            continuum_error: error(continuum),
            pe1: measures.pe1.iter().sum(),
            strain: measures.strain.iter().flatten().map(|s| s.largest()).reduce(f64::max),
            lost: (0..formation.count()).filter(|&m| flight.is_lost(m)).count(),
        };
        self.farthest.push([affine.flatten(), rest.flatten(), continuum.flatten()]);
        self.samples.push(sample);
        let period = flight.fleet().period();
        if (period as usize).is_multiple_of(self.every) || period == flight.periods() {
            self.end(flight);
        }
        sample
    }

    /// Keeps the places of now, unless they are kept.
    pub fn end(&mut self, flight: &Flight) {
        let time = flight.fleet().time();
        if self.times.last() != Some(&time) {
            self.times.push(time);
            self.tracks.push(flight.fleet().places());
        }
    }
}

/// When the leaders' programs ended, if they are over; `before` is what was known of it a period before.
fn programs_ended(flight: &Flight, before: Option<[f64; 2]>) -> Option<[f64; 2]> {
    let (control, time) = (flight.control(), flight.fleet().time());
    let (formation, now) = (control.formation(), control.program_time());
    // The last period may end short of them by rounding.
    let is_over = control.has_begun() && formation.programs_are_over(now + 0.5 * control.period());
    let end = formation.programs_end();
    // A scene has steps, not times.
    let by_flight = if formation.is_led_here() { time - now + end } else { time };
    is_over.then(|| before.filter(|&[ended, _]| ended == end).unwrap_or([end, by_flight]))
}

/// The robot farthest from its place, among those that count.
pub(super) fn farthest(
    present: &Vectors,
    time: f64,
    place: &dyn Fn(usize) -> [f64; 2],
    counts: impl Fn(usize) -> bool,
) -> Option<Extreme> {
    let apart = |member: usize| {
        let here = present.get(member);
        let (value, other) = (distance(place(member), here), None);
        Extreme { value, member, other, time, place: here }
    };
    let all = (0..present.len()).filter(|&m| counts(m)).map(apart);
    all.max_by(|a, b| a.value.total_cmp(&b.value).then(b.member.cmp(&a.member)))
}

/// How far robots that change their velocity evenly have gone aside in the period just flown, of which they end with the velocity
/// that they have: `way - v T`; `None` of others, which go straight.
fn bends(flight: &Flight, before: &Vectors) -> Option<Vectors> {
    let fleet = flight.fleet();
    let is_bent = matches!(fleet.model(), Model::DoubleIntegrator(_));
    let period = flight.control().period();
    let bend = |(m, robot): (usize, &Robot)| {
        let from = before.get(m);
        [0, 1].map(|k| robot.position[k] - from[k] - robot.velocity[k] * period)
    };
    is_bent.then(|| fleet.robots().iter().enumerate().map(bend).collect())
}

/// The robots that came that close; one alone that did to an obstacle.
fn closest(
    around: &[f64],
    value: f64,
    gap: impl Fn(usize, usize) -> f64,
    present: &Vectors,
    time: f64,
) -> Extreme {
    let those = |&m: &usize| around[m] == value;
    let member = (0..around.len()).find(those).unwrap_or(0);
    let here = present.get(member);
    // Others may be as close to something else.
    let near = (member + 1..around.len()).filter(those).map(|m| (gap(member, m), m));
    let other = near.filter(|(gap, _)| *gap <= value + ROUNDING).min_by(|a, b| a.0.total_cmp(&b.0));
    let other = other.map(|(_, m)| m);
    let there = other.map_or(here, |m| present.get(m));
    let place = [0, 1].map(|k| 0.5 * (here[k] + there[k]));
    Extreme { value, member, other, time, place }
}
