//! Targets as messages.

use crate::messages::geometry_msgs::{Pose, PoseStamped};
use crate::messages::std_msgs::Header;
use crate::swarm::transport::Target;

/// A target as a message.
pub fn message(target: &Target, header: Header) -> PoseStamped {
    PoseStamped { header, pose: Pose::planar(target.position, target.yaw) }
}
