//! Swarms to test with.

use std::ops::ControlFlow;

use flockform::scene::SceneError;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::{FlightReport, Record, fly};

pub fn parse(text: &str) -> Result<Swarm, SceneError> {
    Swarm::parse("test", "test.toml", text, &[], None)
}

pub fn flown(swarm: &Swarm) -> (Record, FlightReport) {
    fly(swarm, &mut |_, _| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"))
}
