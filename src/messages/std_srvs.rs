//! Package `std_srvs`.

use serde::{Deserialize, Serialize};

use super::ServiceType;
use super::std_msgs::Empty;

/// `std_srvs/srv/Trigger`.
pub struct Trigger;

/// Whether what was asked for was done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    pub success: bool,
    /// For people.
    pub message: String,
}

impl ServiceType for Trigger {
    const PACKAGE: &str = "std_srvs";
    const NAME: &str = "Trigger";
    type Request = Empty;
    type Response = Outcome;
}

/// `std_srvs/srv/SetBool`.
pub struct SetBool;

/// Request of [`SetBool`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetBoolRequest {
    pub data: bool,
}

impl ServiceType for SetBool {
    const PACKAGE: &str = "std_srvs";
    const NAME: &str = "SetBool";
    type Request = SetBoolRequest;
    type Response = Outcome;
}
