//! Actions as written: what is done to a body while it is stepped.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Something that is done to the body at the beginning of a step.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawAction {
    /// First step at which it holds [step].
    #[schemars(range(min = 1))]
    pub at: usize,
    /// The change.
    pub what: RawActionKind,
}

/// Kinds of actions.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawActionKind {
    /// Changes what the particles follow by: keys of `rule`, `update`, `material`, `loads` and `fracture`. Particles
    /// and neighbours stay.
    Set {
        /// As on the command line: `rule.feedback.factor=0.1`.
        #[schemars(length(min = 1))]
        keys: Vec<String>,
    },
    /// Breaks every bond that crosses a line where the body stands then.
    Cut {
        /// One end [length].
        from: [f64; 2],
        /// The other end [length].
        to: [f64; 2],
    },
}
