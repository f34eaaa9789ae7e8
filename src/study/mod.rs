//! Studies: many runs of a scene, held against one another or against a truth.
//!
//! * `compare` (feature `fem`): rule and finite elements on the same body, and their differences.
//! * `trade` (feature `fem`): what accuracy costs: many settings of a scene against its reference.
//! * [`design`]: the runs of a parameter sweep: grids, samples, shards.
//! * [`stability`]: when a body grows instead of coming to rest, predicted and measured; extreme input.

#[cfg(feature = "fem")]
pub mod compare;
pub mod design;
pub mod stability;
#[cfg(feature = "fem")]
pub mod trade;

use crate::scene::{Scene, SceneError};

/// Loads the scene with these overrides, after those that the user gave.
pub type Load<'a> = &'a dyn Fn(&[String]) -> Result<Scene, SceneError>;
