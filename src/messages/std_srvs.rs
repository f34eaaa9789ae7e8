//! Package `std_srvs`.

use serde::{Deserialize, Serialize};

use super::service;
use super::std_msgs::Empty;

service!(Trigger, "std_srvs", Empty => Outcome);

/// Whether what was asked for was done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    pub success: bool,
    /// For people.
    pub message: String,
}

service!(SetBool, "std_srvs", SetBoolRequest => Outcome);

/// Request of [`SetBool`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetBoolRequest {
    pub data: bool,
}
