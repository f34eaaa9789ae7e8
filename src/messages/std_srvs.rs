//! Package `std_srvs`.

use super::std_msgs::Empty;
use super::{services, structs};

services! { "std_srvs";
    Trigger: Empty => Outcome;
    SetBool: SetBoolRequest => Outcome;
}

structs! {
    /// Whether what was asked for was done.
    Outcome {
        success: bool,
        /// For people.
        message: String,
    }

    /// Request of [`SetBool`].
    #[derive(Copy)] SetBoolRequest { data: bool }
}
