//! `nav_msgs`: odometry.

use serde::{Deserialize, Serialize};

use super::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use super::std_msgs::Header;

/// Where a robot is, in `header.frame_id`, and how it moves, in `child_frame_id`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    pub header: Header,
    pub child_frame_id: String,
    pub pose: PoseWithCovariance,
    pub twist: TwistWithCovariance,
}

super::messages!("nav_msgs": Odometry);
