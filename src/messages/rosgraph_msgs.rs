//! `rosgraph_msgs`: simulated time.

use serde::{Deserialize, Serialize};

use super::builtin_interfaces::Time;

/// The message of `/clock`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    pub clock: Time,
}

super::messages!("rosgraph_msgs": Clock);
