//! Targets as messages.

use crate::messages::geometry_msgs::{Pose, PoseStamped};
use crate::messages::std_msgs::Header;
use crate::swarm::control::Control;
use crate::swarm::transport::{Target, target_of};

/// A target as a message.
pub fn message(target: &Target, header: Header) -> PoseStamped {
    PoseStamped { header, pose: Pose::planar(target.position, target.yaw) }
}

/// Where a member is sent, as a message; `None` while it is sent nowhere.
pub fn of_member(control: &Control, member: usize, header: Header) -> Option<PoseStamped> {
    target_of(control, member).map(|target| message(&target, header))
}
