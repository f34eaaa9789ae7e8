//! Safety as written: limits, obstacles, conditions on poses, tolerance of faulty neighbours.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Bounds on the published targets; a quantity without a bound is not limited.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawLimits {
    /// It bounds how far a robot is from its last pose: without it no clearance is kept where poses are late or lost [m/s].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub speed: Option<f64>,
    /// Robots of the model double-integrator keep it always. The others put clearance, speed and fence first: where one comes
    /// upon another, or upon an obstacle, too fast, or stops to turn, it is exceeded, and the report of a flight says how
    /// often [m/s^2].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub acceleration: Option<f64>,
    /// Free space kept between the rims of two robots, and of a robot and an obstacle [m]. Without it
    /// robots are not kept apart.
    #[schemars(range(min = 0))]
    pub clearance: Option<f64>,
    /// Polygon that the robots stay inside, corners in order [m].
    #[schemars(length(min = 3))]
    pub geofence: Option<Vec<[f64; 2]>>,
}

/// Something solid.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawObstacle {
    /// A polygon, convex or not.
    Polygon {
        /// Corners in order, either way round; the last joins the first [m].
        #[schemars(length(min = 3))]
        vertices: Vec<[f64; 2]>,
    },
    /// A full disc.
    Disc {
        /// Place of its middle [m].
        centre: [f64; 2],
        /// From its middle to its rim [m].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
}

/// Conditions on poses. A robot whose pose grows old first counts at its last place. Then it
/// is no longer used as a neighbour and gets no new target. Later it has to send several good poses to go on.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawPoses {
    /// Age up to which a pose is fresh [s]; three periods unless given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub fresh: Option<f64>,
    /// Age up to which a pose is held [s].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub age_limit: f64,
    /// Age from which a robot is stopped [s].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stop_after: f64,
    /// Poses farther from the formation's middle than this are rejected [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// No robot moves faster than this: a pose that implies more, by over half a metre of noise, is rejected
    /// [m/s]; the speed limit unless given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub jump_speed: Option<f64>,
    /// Consecutive poses that agree, after which a robot's new place is accepted [1].
    #[schemars(range(min = 1))]
    pub recover: usize,
}

impl Default for RawPoses {
    fn default() -> Self {
        Self { fresh: None, age_limit: 0.5, stop_after: 2.0, range: 1e4, jump_speed: None, recover: 5 }
    }
}

/// Distances that robots measure of each other, by radio or sight. A robot whose poses are contradicted by more others than
/// may lie is not believed. Needs a speed limit, or `poses.jump_speed`: robots move between a range and a pose.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawRanges {
    /// Simulated robots measure all that are no farther than this [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reach: f64,
    /// Standard deviation of the ranges that simulated robots measure [m].
    #[schemars(range(min = 0))]
    pub noise: f64,
    /// Difference between a range and the poses of the two that is no contradiction, besides the ways that they go in the
    /// meantime [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Most robots that lie, about their places or about ranges [1]: one more has to contradict a pose.
    pub max_faulty: usize,
}

impl Default for RawRanges {
    fn default() -> Self {
        Self { reach: 10.0, noise: 0.0, tolerance: 0.5, max_faulty: 1 }
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
