//! Requirements on a message type: a CDR encoding and the name by which peers know it.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A message: a struct whose fields stand in the order of its `.msg` file.
pub trait Message: Serialize + DeserializeOwned + 'static {
    /// Package of the `.msg` file, e.g. `geometry_msgs`.
    const PACKAGE: &str;
    /// Name of the `.msg` file, e.g. `PoseStamped`.
    const NAME: &str;
}

/// A service: the two structs of its `.srv` file.
pub trait ServiceType: 'static {
    /// Package of the `.srv` file, e.g. `std_srvs`.
    const PACKAGE: &str;
    /// Name of the `.srv` file, e.g. `Trigger`.
    const NAME: &str;
    type Request: Serialize + DeserializeOwned + 'static;
    type Response: Serialize + DeserializeOwned + 'static;
}
