//! Package `rosgraph_msgs`.

use serde::{Deserialize, Serialize};

use super::Time;
use crate::ros::edge::Message;

/// `rosgraph_msgs/msg/Clock`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    pub clock: Time,
}

impl Message for Clock {
    const PACKAGE: &str = "rosgraph_msgs";
    const NAME: &str = "Clock";
}
