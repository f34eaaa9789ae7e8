//! Loads and leaders' motions part by part, as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Puts loads on part by part and keeps what the body does meanwhile: `load.csv` has reactions, displacements,
/// strain energy and the largest von Mises stress of each part, `load.png` the load over the displacement. It
/// needs a material. With `[equilibrium]` give `increments` or `schedule`; figures and VTK files then count
/// increments. In a scene that is stepped give `ramp`, `every` or both.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawLoadSteps {
    /// So many equal parts of the loads and of the leaders' way, each solved to equilibrium. Leaders are where their motions have
    /// them after that part of the steps until the last of them arrives, or of `stop.steps` where one never does.
    #[schemars(range(min = 1, max = 1000000))]
    pub increments: Option<usize>,
    /// Parts of the loads and of the leaders' way, from 0 to 1, in the order in which they are solved to
    /// equilibrium: one lower than that before it unloads [1].
    #[schemars(length(min = 1))]
    pub schedule: Option<Vec<f64>>,
    /// Loads grow with the steps of a sweep, instead of acting from the first one on.
    pub ramp: Option<RawRamp>,
    /// Steps of a sweep from one row of `load.csv` to the next; unless given, what leaves about a hundred rows [step].
    #[schemars(range(min = 1))]
    pub every: Option<usize>,
}

/// Loads that grow in even parts and then stay.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawRamp {
    /// Steps until the loads are all there [step].
    #[schemars(range(min = 1))]
    pub steps: usize,
}
