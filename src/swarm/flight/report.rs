//! The results of a flight, and whether its declared bounds held.

use serde::Serialize;

use super::moment::Extreme;
use super::{AccelerationReport, Flight, Moment, Record, Sample};
use crate::flock::role::Role;
use crate::flock::rounding::{ROUNDING, at_most};
use crate::scene::swarm::Swarm;
use crate::swarm::formation::{Formation, first_few};

/// Distances in \[m\], times in \[s\].
#[derive(Clone, Debug, Serialize)]
pub struct FlightReport {
    /// Short name of the swarm.
    pub name: String,
    /// Its title, as the file gives it.
    pub title: String,
    /// Number of members.
    pub robots: usize,
    /// Members that lead at the end.
    pub leaders: usize,
    /// Members that lead at the start: a scene may change the roles on its way.
    pub leaders_at_start: usize,
    /// Name of the robots' model.
    pub model: &'static str,
    /// Time flown.
    pub seconds: f64,
    /// Periods flown.
    pub periods: u64,
    /// Largest \[m\], and at the end, where the leaders' motion is still affine then; absent where it never is.
    pub affine_error: Option<(f64, Option<f64>)>,
    /// The same from where the rule comes to rest; absent where it has no single place of rest.
    pub formation_error: Option<(f64, Option<f64>)>,
    /// When the leaders' programs ended or, of a flight that was shorter, would have; absent where they never do, and where a scene
    /// leads that was not over.
    pub programs_end: Option<f64>,
    /// Whether the flight lasted until then. Before, there is neither a settling time nor an end to be at.
    pub programs_ended: bool,
    /// Robots of which no pose was ever believed; programs do not begin while a leader is among them.
    pub never_heard: Vec<String>,
    /// Robots that had a fault, while which errors leave them out.
    pub faulty: Vec<String>,
    /// Whether the leaders' programs began.
    pub programs_began: bool,
    /// Time after which the formation stayed within `settled_within` of its shape, counted from the end of the
    /// leaders' programs; absent where it never was, or where they did not end.
    pub settling_time: Option<f64>,
    /// Distance from its shape up to which the formation counts as settled.
    pub settled_within: f64,
    /// Smallest ever; absent for a single robot without obstacles.
    pub clearance: Option<f64>,
    /// The robots that came that close, when and where.
    pub closest: Option<Moment>,
    /// How far the limit of acceleration was kept; absent where there is none, or no robot was ever without a fault.
    pub acceleration: Option<AccelerationReport>,
    /// Largest distance from the continuum run of the same scene; absent where there is none.
    pub continuum_error: Option<f64>,
    /// Largest sum of PE1, and at the end \[m^2\].
    pub pe1: [f64; 2],
    /// Largest strain, and at the end \[1\]; absent where no member has neighbours in two directions.
    pub strain: Option<[f64; 2]>,
    /// Mean and longest way of a robot.
    pub way: [f64; 2],
    /// Most robots that were lost at one time.
    pub most_lost: usize,
    /// Every declared bound, and whether it held.
    pub bounds: Vec<Verdict>,
    /// In the order of the members.
    pub per_robot: Vec<RobotReport>,
}

/// The results of one robot.
#[derive(Clone, Debug, Serialize)]
pub struct RobotReport {
    /// Name of the robot.
    pub name: String,
    /// Name of its role at the end.
    pub role: &'static str,
    /// At the end \[m\].
    pub x: f64,
    /// At the end \[m\].
    pub y: f64,
    /// Length of its way.
    pub way: f64,
    /// Smallest free space around it ever; absent for a single robot without obstacles.
    pub clearance: Option<f64>,
    /// Poses that were believed.
    pub accepted: u64,
    /// Poses that were rejected, for whatever reason.
    pub rejected: u64,
    /// Name of its pose's state at the end.
    pub health: &'static str,
}

/// Whether a declared bound held.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Key of the bound.
    pub bound: &'static str,
    /// The bound as the file gives it.
    pub declared: f64,
    /// Absent where there was nothing to measure, which is no success.
    pub found: Option<f64>,
    /// Whether what was found keeps the bound.
    pub holds: bool,
    /// The robots that decided it, when and where; absent where there was nothing to measure.
    pub worst: Option<Moment>,
}

impl Verdict {
    /// A broken bound in words: what broke it, when and where.
    pub fn complaint(&self) -> Option<String> {
        if self.holds {
            return None;
        }
        let found = self.found.map_or("not measured".into(), |found| format!("{found:.4e}"));
        let worst = self.worst.as_ref().map_or(String::new(), |moment| format!(": {moment}"));
        Some(format!("{} declared {}, found {found}{worst}", self.bound, self.declared))
    }
}

impl FlightReport {
    /// Whether the robots have a place at the end, by the leaders' motion or the rule, that they are off by so much.
    fn is_known_at_the_end(&self) -> bool {
        [self.affine_error, self.formation_error].into_iter().flatten().any(|(_, end)| end.is_some())
    }

    /// What was measured, under its names; `number` writes lengths and times.
    pub fn facts(&self, number: impl Fn(f64) -> String) -> Vec<(&'static str, String)> {
        let pair = |(largest, last): (f64, Option<f64>)| match last {
            Some(last) => format!("largest {} m, at the end {} m", number(largest), number(last)),
            None => format!("largest {} m while it was known, which it is not at the end", number(largest)),
        };
        let within = number(self.settled_within);
        let settled = match (self.settling_time, self.programs_end) {
            (Some(time), _) => format!("{} s to within {within} m", number(time)),
            (None, _) if !self.programs_began => {
                "not measured: the leaders' programs never began, as not all leaders were heard".to_owned()
            }
            (None, _) if self.affine_error.is_none() && self.formation_error.is_none() => {
                "not measured: the robots have no place by the leaders' motion, and none of rest is known"
                    .to_owned()
            }
            (None, _) if !self.is_known_at_the_end() => {
                "not measured: where the robots belong is not known at the end, as where a leader is lost"
                    .to_owned()
            }
            (None, _) if self.programs_ended => format!("never within {within} m"),
            (None, Some(end)) => {
                format!(
                    "not measured: the flight ends before the leaders' programs, which end at {} s",
                    number(end)
                )
            }
            (None, None) => "not measured: the leaders' programs go on to the end of the flight".to_owned(),
        };
        let clearance = self.clearance.map(|clearance| {
            let closest = self.closest.as_ref().map_or(String::new(), |moment| format!(": {moment}"));
            format!("{} m{closest}", number(clearance))
        });
        let way = format!("mean {} m, longest {} m", number(self.way[0]), number(self.way[1]));
        let from_continuum = self.continuum_error.map(|error| format!("largest {} m", number(error)));
        let facts = [
            ("From the leaders' affine motion", self.affine_error.map(pair)),
            ("From where the rule comes to rest", self.formation_error.map(pair)),
            ("From the continuum run", from_continuum),
            ("Settling time", Some(settled)),
            ("Smallest clearance", clearance),
            ("Largest acceleration", self.acceleration.as_ref().map(|one| one.words(&number))),
            ("Way", Some(way)),
            ("Robots lost", (self.most_lost > 0).then(|| format!("{} at one time", self.most_lost))),
            ("With a fault", first_few(self.faulty.iter().map(|name| format!("`{name}`")))),
            (
                "Errors and settling time",
                (!self.faulty.is_empty()).then(|| "of the robots without a fault at the time".to_owned()),
            ),
            ("Never heard", first_few(self.never_heard.iter().map(|name| format!("`{name}`")))),
        ];
        facts.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }

    /// The results of a flight that has ended.
    pub fn new(swarm: &Swarm, flight: &Flight, record: &Record) -> Self {
        let formation = flight.control().formation();
        let samples = &record.samples;
        let leaders = (0..formation.count()).filter(|&m| formation.leads(m)).count();
        let bounds = &swarm.raw.flight.bounds;
        let programs_ended = record.programs_ended.map(|[_, by_flight]| by_flight);
        let waited = match flight.control().has_begun() {
            true => flight.fleet().time() - flight.control().program_time(),
            false => 0.0,
        };
        let to_come = finite(waited + formation.programs_end()).filter(|_| formation.is_led_here());
        let names = |is: &dyn Fn(usize) -> bool| -> Vec<String> {
            (0..formation.count()).filter(|&m| is(m)).map(|m| formation.names[m].clone()).collect()
        };
        let faulty = names(&|m| flight.fleet().had_fault(m));
        let never_heard = names(&|m| flight.control().position(m).is_none());
        let mut report = Self {
            name: swarm.name.clone(),
            title: swarm.raw.title.clone(),
            robots: formation.count(),
            leaders,
            leaders_at_start: record.leaders,
            model: flight.fleet().model().name(),
            seconds: flight.fleet().time(),
            periods: flight.fleet().period(),
            affine_error: largest_and_end(samples, |s| s.affine_error),
            formation_error: largest_and_end(samples, |s| s.formation_error),
            programs_end: programs_ended.or(to_come),
            programs_ended: programs_ended.is_some(),
            programs_began: flight.control().has_begun(),
            settling_time: programs_ended.and_then(|end| settling_time(samples, end, bounds.settled_within)),
            settled_within: bounds.settled_within,
            closest: record.closest.map(|closest| closest.named(&formation.names)),
            clearance: finite(samples.iter().map(|s| s.clearance).fold(f64::INFINITY, f64::min)),
            acceleration: record.accelerations.as_ref().and_then(|one| one.report(&formation.names)),
            continuum_error: largest_and_last(samples, |s| s.continuum_error).map(|[largest, _]| largest),
            pe1: largest_and_last(samples, |s| Some(s.pe1)).unwrap_or_default(),
            strain: largest_and_last(samples, |s| s.strain),
            way: [
                record.ways.iter().sum::<f64>() / record.ways.len().max(1) as f64,
                record.ways.iter().copied().fold(0.0, f64::max),
            ],
            most_lost: samples.iter().map(|s| s.lost).max().unwrap_or(0).max(never_heard.len()),
            faulty,
            never_heard,
            bounds: Vec::new(),
            per_robot: (0..formation.count()).map(|m| robot(flight, record, m)).collect(),
        };
        let is_lost = |m: usize| flight.fleet().is_sound(m) && !flight.control().health(m).is_usable();
        let any_lost = (0..formation.count()).any(is_lost);
        report.bounds = verdicts(swarm, &report, record, formation, any_lost);
        report
    }

    /// Whether every declared bound held.
    pub fn holds(&self) -> bool {
        self.bounds.iter().all(|verdict| verdict.holds)
    }
}

fn robot(flight: &Flight, record: &Record, m: usize) -> RobotReport {
    let control = flight.control();
    let counts = control.watch().counts(m);
    let [x, y] = flight.fleet().robots()[m].position;
    let role = if control.formation().leads(m) { Role::Leader } else { Role::Follower };
    RobotReport {
        name: control.formation().names[m].clone(),
        role: role.name(),
        x,
        y,
        way: record.ways[m],
        clearance: finite(record.clearances[m]),
        accepted: counts.accepted,
        rejected: counts.rejected(),
        health: control.health(m).name(),
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn largest_and_last(samples: &[Sample], of: impl Fn(&Sample) -> Option<f64>) -> Option<[f64; 2]> {
    let last = samples.iter().rev().find_map(&of)?;
    Some([samples.iter().filter_map(&of).fold(0.0, f64::max), last])
}

/// The largest, and that at the very end where there is one there.
fn largest_and_end(samples: &[Sample], of: impl Fn(&Sample) -> Option<f64>) -> Option<(f64, Option<f64>)> {
    let [largest, _] = largest_and_last(samples, &of)?;
    Some((largest, samples.last().and_then(of)))
}

/// From the end of the programs to the first time after which the shape holds for good.
fn settling_time(samples: &[Sample], programs_end: f64, within: f64) -> Option<f64> {
    let error = |s: &Sample| s.affine_error.or(s.formation_error);
    let last_off = samples.iter().rposition(|s| error(s).is_none_or(|error| !at_most(error, within)));
    let settled = last_off.map_or(0, |k| k + 1);
    samples.get(settled).map(|sample| (sample.time - programs_end).max(0.0))
}

/// The part of a clearance that rounding alone may take where the filter keeps it exactly \[m\]: the farther the robots are from
/// the origin of their coordinates, the more.
pub(super) fn rounding_of(formation: &Formation) -> f64 {
    let places = &formation.places;
    let far = places.x.iter().chain(&places.y).fold(0.0, |far: f64, at| far.max(at.abs()));
    (8.0 * f64::EPSILON * far).max(ROUNDING)
}

fn verdicts(
    swarm: &Swarm,
    report: &FlightReport,
    record: &Record,
    formation: &Formation,
    any_lost: bool,
) -> Vec<Verdict> {
    let bounds = &swarm.raw.flight.bounds;
    let (names, rounding) = (&formation.names, rounding_of(formation));
    let named = |extreme: Option<Extreme>| extreme.map(|extreme| extreme.named(names));
    let kept = |bound, declared: Option<f64>, found: Option<f64>, worst: Option<Extreme>| {
        declared.map(|declared| Verdict {
            bound,
            declared,
            found,
            holds: found.is_some_and(|found| at_most(found, declared)),
            worst: named(worst),
        })
    };
    let [affine, rest, continuum] = [0, 1, 2];
    let (by_motion, by_rule) =
        (report.affine_error.and_then(|(_, end)| end), report.formation_error.and_then(|(_, end)| end));
    // A robot that is lost to the end has not flown to its place, wherever that is by now.
    let is_final = report.programs_ended && !any_lost;
    let last = by_motion.or(by_rule).filter(|_| is_final);
    let farthest = |which: usize| record.farthest.iter().filter_map(move |all| all[which]);
    let largest = |which| farthest(which).max_by(|a, b| a.value.total_cmp(&b.value));
    // By the leaders' motion while it is affine, as the errors are.
    let mut by_shape = record.farthest.iter().map(|all| all[affine].or(all[rest]));
    let at_end = by_shape.clone().next_back().flatten();
    // The robot that kept the formation from being settled.
    let unsettled =
        by_shape.rfind(|one| one.is_some_and(|one| !at_most(one.value, bounds.settled_within))).flatten();
    let [unsettled, at_end] =
        [unsettled, at_end].map(|one| one.filter(|_| report.programs_ended && report.is_known_at_the_end()));
    let all = [
        kept("affine_error", bounds.affine_error, report.affine_error.map(|(most, _)| most), largest(affine)),
        kept("final_error", bounds.final_error, last, at_end),
        kept("settling_time", bounds.settling_time, report.settling_time, unsettled),
        kept("continuum_error", bounds.continuum_error, report.continuum_error, largest(continuum)),
        bounds.clearance.map(|declared| Verdict {
            bound: "clearance",
            declared,
            found: report.clearance,
            holds: report.clearance.is_some_and(|found| found >= declared - rounding),
            worst: named(record.closest),
        }),
    ];
    all.into_iter().flatten().collect()
}
