//! A scene file as written: what serde reads and the JSON Schema describes.
//!
//! Lengths are in one unit of the user's choice (`[length]`), the same throughout a scene; times are
//! in steps; angles in degrees. The doc comments here are the documentation of the scene format:
//! `flockform schema` prints them.

// Units stand in brackets as they are: the schema prints these comments, which escapes would spoil.
#![allow(rustdoc::broken_intra_doc_links)]

mod actions;
mod body;
mod load_steps;
mod material;
mod meant;
mod roles;
mod rule;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use actions::*;
pub use body::*;
pub use load_steps::*;
pub use material::*;
pub use roles::*;
pub use rule::*;

/// A continuum scene: a body, its leaders, the rule of its followers, when the run stops and what it records.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawScene {
    /// One line that says what the scene shows.
    pub title: String,
    /// Where the values come from, and why those the paper does not give were chosen.
    #[serde(default)]
    pub notes: String,
    /// Name of the unit of length, for axes and tables.
    #[serde(default = "defaults::unit")]
    #[schemars(length(min = 1))]
    pub unit: String,
    /// Name of the unit of stress, in which Young's modulus and tractions are given, for axes and tables. With
    /// that of length it gives the unit of force: "Pa" and "m" give N, "MPa" and "mm" too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub stress_unit: Option<String>,
    /// The lattice from which the body is cut; a body of points has none.
    pub lattice: Option<RawLattice>,
    /// The body that is cut from the lattice, or given as points.
    pub body: RawBody,
    /// The shell around the body that gives edge particles their full neighbourhood.
    #[serde(default)]
    pub frame: RawFrame,
    /// The first neighbours unless given; for the rule `material` all particles that share a cell of the
    /// lattice.
    pub neighbours: Option<RawNeighbours>,
    /// How a follower's position comes from its neighbours'; the centre of gravity unless given.
    #[serde(default)]
    pub rule: RawRule,
    /// The material of the body; the rule `material` and loads need it.
    pub material: Option<RawMaterial>,
    /// Everything that pushes the body, from the first step on unless `load_steps` says otherwise.
    #[serde(default)]
    pub loads: Vec<RawLoad>,
    /// How targets become positions.
    #[serde(default)]
    pub update: RawUpdate,
    /// Roles of the particles, and from when. Each entry takes its particles at its step, whatever has taken them before; at the
    /// same step the later entry wins, though one with `axis` leaves alone what an earlier one holds altogether, and one with a
    /// condition takes none that a later entry has taken before. Particles that no entry names are followers.
    #[serde(default)]
    pub roles: Vec<RawRoles>,
    /// Bonds break where this is given.
    pub fracture: Option<RawFracture>,
    /// Cuts made before the first step: every bond that crosses one is broken.
    #[serde(default)]
    pub cuts: Vec<RawCut>,
    /// Everything that is done to the body while it is stepped, by ascending step; roles say when particles are led.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub actions: Vec<RawAction>,
    /// When the run ends.
    #[serde(default)]
    pub stop: RawStop,
    /// Finds where the followers come to rest, instead of stepping there.
    pub equilibrium: Option<RawEquilibrium>,
    /// Puts loads on part by part and keeps what the body does meanwhile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_steps: Option<RawLoadSteps>,
    /// The records of the run.
    #[serde(default)]
    pub record: RawRecord,
}

/// How frame points follow the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawFrame {
    /// No frame: edge particles have fewer neighbours.
    #[default]
    None,
    /// A frame point copies the displacement its particle had before the sweep (the paper's delay).
    Lagged,
    /// A frame point copies the displacement its particle has after the sweep.
    Immediate,
    /// A frame point copies the particle opposite across its nearest one, as if the body went on.
    Mirror,
}

/// When bonds break, and what stands in for them.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawFracture {
    /// A bond longer than this breaks: the paper's `df` [length].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub distance: Option<f64>,
    /// A bond longer than this multiple of its reference length breaks [1].
    #[schemars(extend("exclusiveMinimum" = 1))]
    pub stretch: Option<f64>,
    /// The substitute for a lost neighbour; a point at the original lattice offset unless given.
    pub ghosts: RawGhosts,
}

/// The substitute for a lost neighbour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawGhosts {
    /// A point at the original lattice offset: fragments recover the lattice's shape.
    #[default]
    Lattice,
    /// The mirror image of the opposite neighbour; where none lies opposite (nearest neighbours on a honeycomb, points) as
    /// `lattice`.
    Mirrored,
    /// Nothing: the mean runs over those left, and so does the correction of `rule.rest = "balanced"`.
    None,
}

/// A straight cut.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawCut {
    /// One end [length].
    pub from: [f64; 2],
    /// The other end [length].
    pub to: [f64; 2],
}

/// When the run ends.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawStop {
    /// At the latest after this many steps [step].
    #[schemars(range(min = 1))]
    pub steps: usize,
    /// As soon as no particle moves farther in a step than this part of the spacing, every scheduled
    /// motion and role change being over [1].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: Option<f64>,
    /// The run has diverged once a particle is farther from its reference place than this many times
    /// the body's diagonal [1].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub divergence_ratio: f64,
}

impl Default for RawStop {
    fn default() -> Self {
        Self { steps: 1000, tolerance: None, divergence_ratio: 1000.0 }
    }
}

/// The records of the run.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawRecord {
    /// Ids of the particles whose coordinates and pseudo-energies are kept at every step; one that is named twice is kept once.
    #[schemars(inner(range(min = 1)))]
    pub probes: Vec<usize>,
    /// Places of the undeformed body [x, y] at which `run` reports displacement and stress at the end, and `compare`
    /// sets them beside the reference's; needs a material [length].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<[f64; 2]>,
    /// Steps at which the configuration is drawn (the last step always is) [step].
    pub figures: Vec<usize>,
    /// Every so many steps the configuration is written for ParaView; 0 writes none [step].
    pub vtk_every: usize,
}

mod defaults {
    pub fn unit() -> String {
        "length".into()
    }
    pub fn one() -> f64 {
        1.0
    }
    pub fn ones() -> [f64; 2] {
        [1.0, 1.0]
    }
    pub fn one_step() -> usize {
        1
    }
    pub fn iterations() -> usize {
        1_000_000
    }
}
