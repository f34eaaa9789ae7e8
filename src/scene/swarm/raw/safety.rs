//! What keeps a swarm safe, as written: limits, obstacles, what is believed of poses and of neighbours.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::defaults;

/// Bounds on what is published; what is not given is not limited.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawLimits {
    /// [m/s]
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub speed: Option<f64>,
    /// [m/s^2]
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub acceleration: Option<f64>,
    /// Free space kept between the rims of two robots, and of a robot and an obstacle [m]. Without it
    /// nobody is kept apart.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub clearance: Option<f64>,
    /// Polygon that the robots stay inside, corners in order [m].
    #[serde(default)]
    #[schemars(length(min = 3))]
    pub geofence: Option<Vec<[f64; 2]>>,
}

/// Something solid.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawObstacle {
    Polygon {
        /// Corners in order, either way round; the last joins the first [m].
        #[schemars(length(min = 3))]
        vertices: Vec<[f64; 2]>,
    },
    Disc {
        /// [m]
        centre: [f64; 2],
        /// [m]
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
}

/// Which poses are believed, and for how long. A robot whose pose is too old is first held where it was seen,
/// then nobody looks at it any more and it gets no new target, then it has to show itself anew.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPoses {
    /// Age up to which a pose is fresh [s]; three periods unless given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub fresh: Option<f64>,
    /// Age up to which a pose is held [s].
    #[serde(default = "defaults::age_limit")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub age_limit: f64,
    /// Age from which a robot is stopped [s].
    #[serde(default = "defaults::stop_after")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stop_after: f64,
    /// Farther from the formation's middle than this no pose is believed [m].
    #[serde(default = "defaults::range")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// No robot moves faster than this: a pose that says so, by more than half a metre of noise, is not believed
    /// [m/s]; the speed limit unless given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub jump_speed: Option<f64>,
    /// Consecutive poses that agree, after which a robot is believed at a new place [1].
    #[serde(default = "defaults::recover")]
    #[schemars(range(min = 1))]
    pub recover: usize,
}

impl Default for RawPoses {
    fn default() -> Self {
        Self {
            fresh: None,
            age_limit: defaults::age_limit(),
            stop_after: defaults::stop_after(),
            range: defaults::range(),
            jump_speed: None,
            recover: defaults::recover(),
        }
    }
}

/// W-MSR: each robot leaves the neighbours out that stray farthest from its own displacement.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawResilience {
    /// Number F of faulty neighbours that each robot tolerates [1].
    #[schemars(range(min = 1))]
    pub max_faulty_neighbours: usize,
}
