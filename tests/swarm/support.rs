//! Swarms to test with.

use std::ops::ControlFlow;

use flockform::scene::SceneError;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::{FlightReport, Record, fly};

pub fn bundled(name: &str, overrides: &[&str]) -> Swarm {
    let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    bundled_swarm(name).expect("bundled").load_swarm(&overrides).unwrap_or_else(|error| panic!("{error}"))
}

pub fn parse(text: &str) -> Result<Swarm, SceneError> {
    Swarm::parse("test", "test.toml", text, &[], None)
}

pub fn flown(swarm: &Swarm) -> (Record, FlightReport) {
    fly(swarm, &mut |_, _| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"))
}
