//! Declared bounds that are broken now, and by which robots.

use super::Flight;
use super::measure::{Record, farthest};
use super::moment::Extreme;
use super::report::rounding_of;
use crate::flock::rounding::at_most;
use crate::flock::vectors::Vectors;
use crate::scene::swarm::Swarm;
use crate::swarm::control::Control;
use crate::swarm::formation::Formation;

/// A declared bound that does not hold now.
#[derive(Clone, Debug, PartialEq)]
pub struct Alarm {
    /// Name of the bound.
    pub bound: &'static str,
    /// As declared \[m\].
    pub declared: f64,
    /// As it is \[m\].
    pub found: f64,
    /// Robots that break it, by number: the one that is farthest off, or all that are too close, the closest first.
    pub robots: Vec<usize>,
}

impl Alarm {
    /// The bounds that the period just flown breaks; `before` is where the robots were as it began.
    pub fn now(swarm: &Swarm, flight: &Flight, before: &Vectors) -> Vec<Self> {
        let mut record = Record::new(swarm, flight);
        let sample = record.take(flight, before);
        let [affine, _, continuum] = record.farthest.last().copied().unwrap_or_default();
        let formation = flight.control().formation();
        broken((swarm, formation), affine, continuum, sample.clearance, &record.clearances)
    }

    /// The bounds that robots break by their last poses. A robot without a usable pose breaks none, and no continuum
    /// run goes beside such a swarm.
    pub fn of_poses(swarm: &Swarm, control: &Control) -> Vec<Self> {
        let (formation, time) = (control.formation(), control.program_time());
        let present = control.last_places();
        let is_usable = |m: usize| control.health(m).is_usable();
        let affine = formation.affine(time);
        let affine = affine
            .and_then(|map| farthest(&present, time, &|m| map.apply(formation.places.get(m)), is_usable));
        let mut around = Vec::new();
        control.clearance(&mut around);
        let of_usable =
            around.iter().enumerate().map(|(m, &gap)| if is_usable(m) { gap } else { f64::INFINITY });
        let around: Vec<f64> = of_usable.collect();
        let clearance = around.iter().copied().fold(f64::INFINITY, f64::min);
        broken((swarm, formation), affine, None, clearance, &around)
    }
}

fn broken(
    (swarm, formation): (&Swarm, &Formation),
    affine: Option<Extreme>,
    continuum: Option<Extreme>,
    clearance: f64,
    around: &[f64],
) -> Vec<Alarm> {
    let bounds = &swarm.raw.flight.bounds;
    let above = |bound, declared: Option<f64>, by: Option<Extreme>| {
        let (declared, found) = (declared?, by?.value);
        let robots = by.iter().map(|by| by.member).collect();
        (!at_most(found, declared)).then_some(Alarm { bound, declared, found, robots })
    };
    let rounding = rounding_of(formation);
    let too_close = bounds.clearance.filter(|&declared| clearance < declared - rounding).map(|declared| {
        Alarm { bound: "clearance", declared, found: clearance, robots: below(around, declared - rounding) }
    });
    let alarms = [
        above("affine_error", bounds.affine_error, affine),
        above("continuum_error", bounds.continuum_error, continuum),
        too_close,
    ];
    alarms.into_iter().flatten().collect()
}

/// Robots around which there is less room, those with the least first.
fn below(around: &[f64], declared: f64) -> Vec<usize> {
    let mut robots: Vec<usize> = (0..around.len()).filter(|&m| around[m] < declared).collect();
    robots.sort_by(|&a, &b| around[a].total_cmp(&around[b]));
    robots
}
