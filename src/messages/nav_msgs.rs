//! `nav_msgs`: odometry.

use super::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use super::messages;
use super::std_msgs::Header;

messages! { "nav_msgs";
    /// Where a robot is, in `header.frame_id`, and how it moves, in `child_frame_id`.
    Odometry { header: Header, child_frame_id: String, pose: PoseWithCovariance, twist: TwistWithCovariance }
}
