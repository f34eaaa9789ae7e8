//! Leaders as written: their names or places, and their motions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::defaults;
use crate::scene::raw::{RawInterpolation, RawRegion};

/// Robots that lead.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawLeaders {
    /// By name.
    #[serde(default)]
    pub robots: Vec<String>,
    /// By their place in the formation; on a lattice only.
    pub region: Option<RawRegion>,
    /// The motion of these leaders.
    pub program: RawProgram,
}

/// The motion of leaders; times are counted from the first period.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawProgram {
    /// Moved from outside: by topic (`node.leader_topic`) or by the service `set_formation`; holds its place until
    /// then. During a manoeuvre no place is taken by topic.
    External {},
    /// Along displacements from its place in the formation.
    Path {
        /// Places by ascending time.
        #[schemars(length(min = 1))]
        points: Vec<RawWaypoint>,
        /// How the motion goes from one place to the next; straight unless given.
        #[serde(default)]
        interpolation: RawInterpolation,
    },
    /// By a CSV file with the columns `t,dx,dy` (all alike) or `t,name,dx,dy` (each by its own rows; one
    /// file may serve several entries): seconds, and metres from the place in the formation. Straight between the rows; the last
    /// is held.
    File {
        /// Path, relative to the swarm file.
        path: String,
        /// Multiplies every displacement [1].
        #[serde(default = "defaults::one")]
        scale: f64,
    },
    /// With the other leaders, by one of the `manoeuvres`.
    Manoeuvre {
        /// Name of the manoeuvre.
        name: String,
    },
}

/// A leader's place at a time.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawWaypoint {
    /// When it is there [s].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub at: f64,
    /// From the place in the formation [m].
    pub displacement: [f64; 2],
}

/// An affine motion of the formation, leg by leg. Each leg gives the formation's posture at its end, starting
/// from the nominal places; postures are interpolated smoothly.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawManoeuvre {
    /// The name by which a leader's program or the service `set_formation` calls it.
    pub name: String,
    /// The point about which the formation is turned, stretched and sheared [m]; the middle of its places
    /// unless given.
    pub about: Option<[f64; 2]>,
    /// Legs in the order in which they are flown.
    #[schemars(length(min = 1))]
    pub legs: Vec<RawLeg>,
}

/// A leg of a manoeuvre.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawLeg {
    /// Time to get there [s].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub seconds: f64,
    /// Time to stay there [s].
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub hold: f64,
    /// Displacement of the point `about` [m].
    #[serde(default)]
    pub translate: [f64; 2],
    /// Turn, applied after stretch and shear [degree].
    #[serde(default)]
    pub rotate: f64,
    /// Factors along x and y [1].
    #[serde(default = "defaults::ones")]
    pub stretch: [f64; 2],
    /// x moves with y, and y moves with x [1].
    #[serde(default)]
    pub shear: [f64; 2],
}
