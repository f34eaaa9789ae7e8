//! The cost of accuracy: rule, spacing, solver, tolerance and precision of a scene against the truth.
//!
//! A scene is run in many settings. Each is timed from the scene to the followers at rest, and its error is
//! the relative L2 distance of the followers from the same truth, finite elements on the shape, held as the finest of the
//! bodies. The result has the cheapest setting for an error ([`Study::cheapest`]) and the Pareto-optimal
//! settings ([`Study::front`]). [`choose`] goes the other way: from an accuracy to the setting.

mod accuracy;
mod alike;
mod grid;
mod study;

pub use accuracy::{Chosen, choose};
pub use grid::{Grid, RuleChoice, Setting};
pub use study::{Outcome, Point, Study, run};
