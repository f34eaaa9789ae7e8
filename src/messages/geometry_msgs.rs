//! `geometry_msgs`: points, poses, velocities and transforms.
//!
//! Lengths \[m\], velocities \[m/s\] and \[rad/s\]; right-handed frames, x forward, y left, z up
//! (REP 103). Covariances are 6 x 6, row by row, over x, y, z and the rotations about x, y, z.

use serde::{Deserialize, Serialize};
use serde_big_array::BigArray;

use super::messages;
use super::std_msgs::Header;

messages! { "geometry_msgs";
    #[derive(Copy)] Point { x: f64, y: f64, z: f64 }
    #[derive(Copy)] Vector3 { x: f64, y: f64, z: f64 }
    #[derive(Copy)] Pose { position: Point, orientation: Quaternion }
    PoseStamped { header: Header, pose: Pose }
    PoseWithCovarianceStamped { header: Header, pose: PoseWithCovariance }
    PoseArray { header: Header, poses: Vec<Pose> }
    #[derive(Copy)] Twist { linear: Vector3, angular: Vector3 }
    TwistStamped { header: Header, twist: Twist }
    #[derive(Copy)] Transform { translation: Vector3, rotation: Quaternion }

    TransformStamped {
        header: Header,
        /// The frame whose pose in `header.frame_id` this is.
        child_frame_id: String,
        transform: Transform,
    }
}

/// An orientation; `Default` is none, (0, 0, 0, 1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub w: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    pub pose: Pose,
    #[serde(with = "BigArray")]
    pub covariance: [f64; 36],
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    pub twist: Twist,
    #[serde(with = "BigArray")]
    pub covariance: [f64; 36],
}

messages!("geometry_msgs": Quaternion, PoseWithCovariance, TwistWithCovariance);

impl Default for Quaternion {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

impl Default for PoseWithCovariance {
    fn default() -> Self {
        Pose::default().into()
    }
}

impl From<Pose> for PoseWithCovariance {
    fn from(pose: Pose) -> Self {
        Self { pose, covariance: [0.0; 36] }
    }
}

impl Default for TwistWithCovariance {
    fn default() -> Self {
        Self { twist: Twist::default(), covariance: [0.0; 36] }
    }
}

impl Quaternion {
    /// The rotation about z by `yaw` \[rad\], counter-clockwise seen from above.
    pub(crate) fn from_yaw(yaw: f64) -> Self {
        let (z, w) = (yaw / 2.0).sin_cos();
        Self { x: 0.0, y: 0.0, z, w }
    }

    /// The heading in the plane \[rad\], from -pi to pi: where x points, seen from above. The quaternion
    /// need not have unit length; one that is zero or not finite has no heading.
    pub fn yaw(self) -> Option<f64> {
        let Self { x, y, z, w } = self;
        let yaw = f64::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z);
        let length = x * x + y * y + z * z + w * w;
        (length > 0.0 && length.is_finite()).then_some(yaw)
    }
}

impl Pose {
    /// A place in the plane \[m\] and a heading \[rad\].
    pub fn planar([x, y]: [f64; 2], yaw: f64) -> Self {
        Self { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(yaw) }
    }

    /// The entry of an array for a robot of which it says nothing.
    pub fn nowhere() -> Self {
        Self::planar([f64::NAN; 2], f64::NAN)
    }

    /// Whether it is such an entry: no place and no heading. A robot that measures nonsense has a heading at least.
    pub fn is_nowhere(&self) -> bool {
        self.position.x.is_nan() && self.position.y.is_nan() && self.orientation.yaw().is_none()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    #[test]
    fn a_yaw_survives_the_way_there_and_back() {
        for yaw in [0.0, 0.3, -0.3, FRAC_PI_2, -FRAC_PI_2, 3.1, -3.1] {
            let back = Quaternion::from_yaw(yaw).yaw().expect("a unit quaternion");
            assert!((back - yaw).abs() < 1e-15, "{yaw} came back as {back}");
        }
        assert!((Quaternion::from_yaw(1.5 * PI).yaw().expect("unit") + FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn a_quarter_turn_to_the_left_is_positive_and_its_length_does_not_matter() {
        let quarter = Quaternion { x: 0.0, y: 0.0, z: 3.0, w: 3.0 };
        assert!((quarter.yaw().expect("finite") - FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_orientation_has_no_heading() {
        let zero = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 };
        assert_eq!(zero.yaw(), None);
        assert_eq!(Quaternion { w: f64::NAN, ..zero }.yaw(), None);
        assert_eq!(Quaternion { z: f64::INFINITY, ..zero }.yaw(), None);
    }
}
