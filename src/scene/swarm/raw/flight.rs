//! Simulated flights as written: the robots' model, their faults, and the bounds on the results.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The simulation of `flockform swarm` and `flockform robots`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawFlight {
    /// [s]; a scene flies for as many periods as it has steps unless this is given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub duration: Option<f64>,
    /// Same seed, same flight.
    pub seed: u64,
    /// The model of every robot; at its target after a period unless given.
    pub model: RawModel,
    /// Standard deviation of each coordinate of a pose [m]. Robots keep three of it farther away from everything, each.
    #[schemars(range(min = 0))]
    pub noise: f64,
    /// Delay of poses [period].
    #[schemars(range(max = 1000))]
    pub delay: u32,
    /// Most that is added to the delay at random [period]. Poses keep their order: one that takes long holds back those behind it.
    #[schemars(range(max = 1000))]
    pub jitter: u32,
    /// Part of the poses that is lost [1].
    #[schemars(range(min = 0, max = 1))]
    pub loss: f64,
    /// Part of the poses that arrives twice [1].
    #[schemars(range(min = 0, max = 1))]
    pub duplicates: f64,
    /// Initial places of robots that do not start at their places in the formation.
    pub start: Vec<RawStart>,
    /// Faults of single robots.
    pub faults: Vec<RawFault>,
    /// Commands from outside on the way, by ascending period; `flockform robots` does none of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 200000))]
    pub commands: Vec<RawCommand>,
    /// Bounds on the results.
    pub bounds: RawBounds,
    /// Every so many periods the robots' places are kept for tables and figures [period].
    #[schemars(range(min = 1))]
    pub record_every: usize,
}

impl Default for RawFlight {
    fn default() -> Self {
        Self {
            duration: None,
            seed: 0,
            model: RawModel::default(),
            noise: 0.0,
            delay: 0,
            jitter: 0,
            loss: 0.0,
            duplicates: 0.0,
            start: Vec::new(),
            faults: Vec::new(),
            commands: Vec::new(),
            bounds: RawBounds::default(),
            record_every: 1,
        }
    }
}

/// The model of a robot; its limits are those of `[limits]`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawModel {
    /// Is at its target after a period.
    #[default]
    Ideal,
    /// Goes straight to its target with at most the speed limit.
    Integrator,
    /// Drives and turns: needs a speed limit.
    Unicycle {
        /// Fastest turn [degree/s].
        #[schemars(extend("exclusiveMinimum" = 0))]
        turn_rate: f64,
    },
    /// Speeds up, and brakes to stand still at its target: needs a speed and an acceleration limit.
    DoubleIntegrator,
}

/// The initial place of a robot.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawStart {
    /// Name of the robot.
    pub robot: String,
    /// Where it starts [m].
    pub place: [f64; 2],
}

/// A fault of a robot.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawFault {
    /// Name of the robot.
    pub robot: String,
    /// From this time on [s].
    #[schemars(range(min = 0))]
    pub at: f64,
    /// Until this time [s]; for good unless given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub until: Option<f64>,
    /// The kind of the fault.
    pub what: RawFaultKind,
}

/// Kinds of faults.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawFaultKind {
    /// Moves on but sends no poses.
    Silent,
    /// Stands still and sends no poses.
    Dead,
    /// Stands still and sends its poses.
    Stuck,
    /// Sends its position with this offset.
    Offset {
        /// How far off [m].
        by: [f64; 2],
    },
    /// Sends the same position again and again.
    Frozen,
    /// Sends random positions within this distance of its own.
    Random {
        /// Largest distance from its own place [m].
        #[schemars(extend("exclusiveMinimum" = 0))]
        within: f64,
    },
    /// Sends positions that are not numbers.
    NotANumber,
    /// Sends poses in another frame.
    WrongFrame,
}

/// Something that is done from outside before a period.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawCommand {
    /// Periods flown before [period].
    pub after: u64,
    /// The change.
    pub what: RawCommandKind,
}

/// Kinds of commands.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawCommandKind {
    /// Sends a leader to a place, whatever its program is.
    Lead {
        /// Name of the robot.
        robot: String,
        /// Where it goes [m].
        to: [f64; 2],
    },
    /// Moves an obstacle, at once.
    MoveObstacle {
        /// Number among `obstacles`, from 0.
        obstacle: usize,
        /// From its place in the file [m].
        by: [f64; 2],
    },
    /// Changes what becomes of poses on their way.
    Channel {
        /// As `flight.noise` [m].
        #[schemars(range(min = 0))]
        noise: f64,
        /// As `flight.delay` [period].
        #[schemars(range(max = 1000))]
        delay: u32,
        /// As `flight.loss` [1].
        #[schemars(range(min = 0, max = 1))]
        loss: f64,
    },
}

/// Bounds on the results; a flight that breaks one of these ends with exit code 1. Errors are those of the robots
/// without a fault at the time.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawBounds {
    /// Largest distance of a robot from where the leaders' affine motion has its place, ever [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub affine_error: Option<f64>,
    /// The same at the end, or the distance from where the rule comes to rest if there is no affine motion [m]. A flight
    /// that ends before the leaders' programs does not keep it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub final_error: Option<f64>,
    /// Smallest free space between two rims, or a rim and an obstacle, ever [m].
    #[schemars(range(min = 0))]
    pub clearance: Option<f64>,
    /// Time after which the formation stays within `settled_within` of its shape, counted from the end of the
    /// leaders' programs [s], before which no flight keeps it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub settling_time: Option<f64>,
    /// Distance from its shape up to which the formation counts as settled [m].
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub settled_within: f64,
    /// Largest distance from the continuum run of the same scene, ever [m].
    #[schemars(range(min = 0))]
    pub continuum_error: Option<f64>,
}

impl Default for RawBounds {
    fn default() -> Self {
        Self {
            affine_error: None,
            final_error: None,
            clearance: None,
            settling_time: None,
            settled_within: 0.01,
            continuum_error: None,
        }
    }
}
