//! Records of a run: whole configurations at some steps, a few particles at every step, and the response to a load
//! that changes.

use serde::{Deserialize, Serialize};

use super::mechanics::Mechanics;
use crate::engine::Engine;
pub use crate::engine::probes::ProbeSeries;
use crate::engine::serde_impls;
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;

/// A whole configuration at one step; arrays of shape \[count\].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Snapshot {
    /// Steps or increments taken so far.
    pub step: usize,
    /// Present positions \[length, world frame\].
    #[serde(with = "serde_impls::points")]
    pub positions: Vectors,
    /// Role of each particle at this step.
    #[serde(with = "serde_impls::roles")]
    pub roles: Vec<Role>,
    /// First pseudo-energy \[length^2\]; in a part of a body NaN for particles of others.
    pub pe1: Vec<f64>,
    /// Second pseudo-energy \[length\]; likewise.
    pub pe2: Vec<f64>,
    /// Index pairs, in the whole body, of the bonds broken so far.
    pub broken: Vec<[u32; 2]>,
}

impl Snapshot {
    /// The configuration in which the engine is now.
    pub fn of(engine: &Engine) -> Self {
        let (count, owned) = (engine.present().len(), engine.body().owned());
        let of = |energy: fn(&Engine, usize) -> f64| {
            (0..count).map(|i| if owned.contains(&i) { energy(engine, i) } else { f64::NAN }).collect()
        };
        Self {
            step: engine.step(),
            positions: engine.present().clone(),
            roles: engine.roles().to_vec(),
            pe1: of(Engine::pe1),
            pe2: of(Engine::pe2),
            broken: engine.breaks().iter().map(|b| b.pair).collect(),
        }
    }
}

/// A body with a material under part of its load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadStep {
    /// Steps or increments taken.
    pub step: usize,
    /// Part of the scene's loads that is on the body \[1\].
    pub factor: f64,
    /// Forces, energy and stress at the last of these steps.
    pub mechanics: Mechanics,
}

impl LoadStep {
    /// `None` without a material.
    pub fn of(engine: &Engine) -> Option<Self> {
        let mechanics = Mechanics::of(engine)?;
        Some(Self { step: engine.step(), factor: engine.load_factor(), mechanics })
    }
}
