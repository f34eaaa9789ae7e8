//! Poses of messages as the loop takes them.

use crate::messages::builtin_interfaces::Time;
use crate::messages::geometry_msgs;
use crate::messages::std_msgs::Header;
use crate::swarm::watch::Pose;

/// A pose with its stamp; one that bears none was measured when it arrived.
pub fn pose(header: &Header, pose: &geometry_msgs::Pose, arrival: f64, frame_id: &str) -> Pose {
    let stamped = header.stamp.seconds();
    Pose {
        position: [pose.position.x, pose.position.y],
        yaw: pose.orientation.yaw().unwrap_or(f64::NAN),
        stamp: if stamped == 0.0 { arrival } else { stamped },
        frame_is_right: is_frame(&header.frame_id, frame_id),
    }
}

/// How a simulated robot says its pose, in the right frame or in another.
pub fn said(pose: &Pose, frame_id: &str) -> (Header, geometry_msgs::Pose) {
    let frame_id = if pose.frame_is_right { frame_id } else { "elsewhere" };
    let header = Header { stamp: Time::from_seconds(pose.stamp), frame_id: frame_id.into() };
    (header, geometry_msgs::Pose::planar(pose.position, pose.yaw))
}

/// Whether a header speaks of this frame; older tools and files write a slash before it.
pub fn is_frame(said: &str, meant: &str) -> bool {
    let [said, meant] = [said, meant].map(|name| name.strip_prefix('/').unwrap_or(name));
    said == meant
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slash_before_a_frame_says_nothing_on_either_side() {
        for said in ["map", "/map"] {
            assert!(is_frame(said, "map") && is_frame(said, "/map"), "{said}");
            assert!(!is_frame(said, "/odom") && !is_frame(said, "//map"), "{said}");
        }
    }
}
