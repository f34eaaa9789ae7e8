//! Declared bounds that are broken in the period just flown, and by which robots.

use super::measure::Record;
use super::moment::Extreme;
use super::{Flight, Sample};
use crate::flock::vectors::Vectors;
use crate::scene::swarm::Swarm;

/// A declared bound that does not hold now.
#[derive(Clone, Debug, PartialEq)]
pub struct Alarm {
    /// Name of the bound.
    pub bound: &'static str,
    /// As declared \[m\].
    pub declared: f64,
    /// As it is \[m\].
    pub found: f64,
    /// Robots that break it, by number.
    pub robots: Vec<usize>,
}

impl Alarm {
    /// The bounds that the period just flown breaks; `before` is where the robots were as it began.
    pub fn now(swarm: &Swarm, flight: &Flight, before: &Vectors) -> Vec<Self> {
        let mut record = Record::new(swarm, flight);
        let Sample { affine_error, clearance, continuum_error, .. } = record.take(flight, before);
        let bounds = &swarm.raw.flight.bounds;
        let [affine, _, continuum] = record.farthest.last().copied().unwrap_or_default();
        let above = |bound, declared: Option<f64>, found: Option<f64>, by: Option<Extreme>| {
            let (declared, found) = (declared?, found?);
            (found > declared).then(|| Alarm { bound, declared, found, robots: robots(by) })
        };
        let too_close = bounds.clearance.filter(|&declared| clearance < declared).map(|declared| Alarm {
            bound: "clearance",
            declared,
            found: clearance,
            robots: robots(record.closest),
        });
        let alarms = [
            above("affine_error", bounds.affine_error, affine_error, affine),
            above("continuum_error", bounds.continuum_error, continuum_error, continuum),
            too_close,
        ];
        alarms.into_iter().flatten().collect()
    }
}

fn robots(by: Option<Extreme>) -> Vec<usize> {
    by.map_or_else(Vec::new, |by| [Some(by.member), by.other].into_iter().flatten().collect())
}
