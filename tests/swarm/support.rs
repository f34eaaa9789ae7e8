//! Swarms to test with.

use std::ops::ControlFlow;

use flockform::scene::SceneError;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::{Flight, FlightReport, Record, fly};

use crate::swarms::load_swarm;

pub fn parse(text: &str) -> Result<Swarm, SceneError> {
    Swarm::parse("test", "test.toml", text, &[], None)
}

pub fn flown(swarm: &Swarm) -> (Record, FlightReport) {
    fly(swarm, &mut |_, _| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"))
}

/// The square of the bundled file, flown with a fault from 2 s on; robot_13 is its middle.
pub fn with_fault(what: &str, more: &[&str]) -> Flight {
    let fault = format!("flight.faults=[{{ robot = \"robot_13\", at = 2.0, what = {what} }}]");
    // A robot that stands where others have to pass is an obstacle; here it is the formation that matters.
    let limits = "limits={ speed = 1.0 }";
    let mut overrides = vec!["control.sweeps=1", limits, fault.as_str()];
    overrides.extend(more);
    Flight::new(&load_swarm("square", &overrides)).unwrap_or_else(|error| panic!("{error}"))
}

pub const MIDDLE: usize = 12;

pub fn fly_on(flight: &mut Flight, periods: usize) {
    (0..periods).for_each(|_| flight.step());
}

/// Flies on for as long as the bundled file does, by when the formation is at rest.
pub fn fly_to_end(flight: &mut Flight) {
    let end = load_swarm("square", &[]).raw.flight.duration.expect("a duration");
    while flight.fleet().time() < end {
        flight.step();
    }
}
