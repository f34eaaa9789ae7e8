//! Bundled scenes with overrides.

#![allow(dead_code, reason = "each test program uses the part that it needs")]

use flockform::continuum::plan::Plan;
use flockform::scene::{Scene, SceneError, bundled};

/// The bundled scene of this name with overrides, or its refusal.
pub fn try_load(name: &str, overrides: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    bundled(name).expect("bundled").load(&overrides)
}

/// The bundled scene of this name with overrides, which must be valid.
pub fn load(name: &str, overrides: &[&str]) -> Scene {
    try_load(name, overrides).unwrap_or_else(|error| panic!("{name} {overrides:?}: {error}"))
}

/// The plan of a scene, which must be valid.
pub fn planned(scene: &Scene) -> Plan {
    Plan::new(scene).unwrap_or_else(|error| panic!("{error}"))
}
