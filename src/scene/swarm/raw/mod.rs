//! A swarm file as written, as serde reads it and the JSON Schema describes it.
//!
//! SI throughout: metres, seconds; angles in degrees. The doc comments here are the documentation of the
//! format: `flockform schema --swarm` prints them.

// Units stand in brackets as they are: the schema prints these comments, which escapes would spoil.
#![allow(rustdoc::broken_intra_doc_links)]

mod flight;
mod leaders;
mod node;
mod safety;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scene::raw::{RawBody, RawFrame, RawLattice, RawMaterial, RawNeighbours, RawRule};

pub use flight::*;
pub use leaders::*;
pub use node::*;
pub use safety::*;

/// A swarm: its robots and their formation, the leaders, the followers' rule, and the safety limits.
///
/// The shape is one of: `robots` with a place each; a `lattice` and a `body` cut from it; a continuum
/// `scene` whose particles are the robots, or inside which the robots have their places.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawSwarm {
    /// One line that describes the swarm.
    pub title: String,
    /// Sources of the values.
    #[serde(default)]
    pub notes: String,
    /// Robots one by one.
    #[serde(default)]
    pub robots: Vec<RawRobot>,
    /// Name of the robots that a lattice or a scene gives places: this and a number counted from 1.
    #[serde(default = "defaults::prefix")]
    pub prefix: String,
    /// Radius of the robots that give none of their own [m].
    #[serde(default = "defaults::radius")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
    /// A continuum scene as the formation.
    pub scene: Option<RawBridge>,
    /// The lattice from which the body is cut.
    pub lattice: Option<RawLattice>,
    /// The body whose particles are the robots.
    pub body: Option<RawBody>,
    /// Virtual points around a body that give robots at its edge their full neighbourhood.
    #[serde(default)]
    pub frame: RawFrame,
    /// Neighbours on a lattice; the first neighbours unless given.
    pub neighbours: Option<RawNeighbours>,
    /// Neighbours of robots that are given one by one; the six nearest unless given.
    pub links: Option<RawLinks>,
    /// How a follower's target comes from its neighbours' positions.
    #[serde(default)]
    pub rule: RawRule,
    /// The material of the body; the rule `material` needs it.
    pub material: Option<RawMaterial>,
    /// Leaders and their motions. Robots that no entry names follow.
    #[serde(default)]
    pub leaders: Vec<RawLeaders>,
    /// Motions of all leaders together, by name.
    #[serde(default)]
    pub manoeuvres: Vec<RawManoeuvre>,
    /// Solid things that robots keep away from.
    #[serde(default)]
    pub obstacles: Vec<RawObstacle>,
    /// Bounds on the published targets.
    #[serde(default)]
    pub limits: RawLimits,
    /// Conditions on poses.
    #[serde(default)]
    pub poses: RawPoses,
    /// Ranges that robots measure of each other.
    pub ranges: Option<RawRanges>,
    /// Trims neighbours that stray: tolerance of robots that lie.
    pub resilience: Option<RawResilience>,
    /// The control loop.
    #[serde(default)]
    pub control: RawControl,
    /// The simulation of `flockform swarm` and `flockform robots`.
    #[serde(default)]
    pub flight: RawFlight,
    /// Topics and messages of the node.
    #[serde(default)]
    pub node: RawNode,
}

/// One robot.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawRobot {
    /// A ROS name: letters, digits and underscores, no digit first.
    pub name: String,
    /// Its place in the formation [m].
    pub place: [f64; 2],
    /// Its radius, if not that of all robots [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Option<f64>,
    /// Its neighbours, by name; needs `links.kind = "listed"`.
    #[serde(default)]
    pub neighbours: Vec<String>,
}

/// Neighbours of robots that are given one by one.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawLinks {
    /// The nearest in the formation; of equally near ones, to a ten-thousandth, all.
    Nearest {
        /// Neighbours of each robot [1].
        #[schemars(range(min = 1))]
        count: usize,
    },
    /// All robots with a place within a radius in the formation.
    Within {
        /// Distance up to which robots are neighbours [m].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// The robots that each robot's `neighbours` name.
    Listed {},
    /// All robots within a radius now, found anew every period.
    Present {
        /// Distance up to which robots are neighbours [m].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
}

/// A continuum scene as the formation.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawBridge {
    /// Name of a bundled scene, or path of a scene file relative to this one. One unit of the scene's
    /// length is one metre.
    pub name: String,
    /// Overrides of the scene's keys, as `--set` takes them.
    #[serde(default)]
    pub set: Vec<String>,
    /// `probes.csv` of an earlier run, relative to this file: its steps are flown as targets by the
    /// particles that it holds.
    pub recording: Option<String>,
}

/// The control loop.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawControl {
    /// Time between two targets [s].
    #[schemars(range(min = 0.002, max = 1.0))]
    pub period: f64,
    /// Applications of the rule in a period, fewer once the formation is at rest. With 1
    /// each robot uses its neighbours' poses once, as a robot on its own can; a central node may let the whole
    /// formation come to rest behind its leaders in every period [1].
    #[schemars(range(min = 1, max = 100_000))]
    pub sweeps: usize,
}

impl Default for RawControl {
    fn default() -> Self {
        Self { period: 0.05, sweeps: 1 }
    }
}

pub(super) mod defaults {
    pub fn prefix() -> String {
        "robot_".into()
    }
    pub fn radius() -> f64 {
        0.15
    }
    pub fn ones() -> [f64; 2] {
        [1.0, 1.0]
    }
    pub fn one() -> f64 {
        1.0
    }
}
