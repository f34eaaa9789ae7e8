//! Velocities towards the targets, for robots that are driven so.

use crate::messages::geometry_msgs::{Twist, TwistStamped, Vector3};
use crate::messages::std_msgs::Header;
use crate::ros::edge::{EdgeError, Node, Publisher, Quality};
use crate::scene::swarm::raw::{RawModel, RawSwarm, RawVelocityType};
use crate::swarm::control::Control;

/// Velocities of one member, in its own axes (REP 103: x ahead, y to the left).
pub struct Drive {
    topic: Topic,
    /// Highest turn rate of a robot that cannot go sideways \[rad/s\]; none for one that can.
    turn_rate: Option<f64>,
}

enum Topic {
    Plain(Publisher<Twist>),
    Stamped(Publisher<TwistStamped>),
}

impl Drive {
    pub fn open(node: &Node, topic: &str, kind: RawVelocityType, raw: &RawSwarm) -> Result<Self, EdgeError> {
        let quality = Quality::reliable(1);
        Ok(Self {
            topic: match kind {
                RawVelocityType::Twist => Topic::Plain(node.publisher(topic, quality)?),
                RawVelocityType::TwistStamped => Topic::Stamped(node.publisher(topic, quality)?),
            },
            turn_rate: match raw.flight.model {
                RawModel::Unicycle { turn_rate } => Some(turn_rate.to_radians()),
                _ => None,
            },
        })
    }

    /// Publishes the velocity towards the target, zero for a member without one.
    pub fn publish(
        &self,
        control: &Control,
        member: usize,
        target: Option<[f64; 2]>,
        header: Header,
    ) -> Result<(), EdgeError> {
        let twist = match (control.position(member), target, control.yaw(member)) {
            (Some(here), Some(target), Some(yaw)) => {
                let way = [target[0] - here[0], target[1] - here[1]];
                twist(way, yaw, control.period(), control.limits().speed, self.turn_rate)
            }
            _ => Twist::default(),
        };
        match &self.topic {
            Topic::Plain(topic) => topic.publish(&twist),
            Topic::Stamped(topic) => topic.publish(&TwistStamped { header, twist }),
        }
    }
}

/// The velocity that takes a robot along `way` \[m, world frame\] in a period \[s\].
fn twist(way: [f64; 2], yaw: f64, period: f64, speed: f64, turn_rate: Option<f64>) -> Twist {
    let (sin, cos) = yaw.sin_cos();
    let ahead = [cos * way[0] + sin * way[1], cos * way[1] - sin * way[0]].map(|way| way / period);
    let mut twist = Twist::default();
    match turn_rate {
        None => {
            let size = f64::hypot(ahead[0], ahead[1]);
            let scale = if size > speed { speed / size } else { 1.0 };
            twist.linear = Vector3 { x: ahead[0] * scale, y: ahead[1] * scale, z: 0.0 };
        }
        Some(turn_rate) => {
            let error = if way == [0.0; 2] { 0.0 } else { ahead[1].atan2(ahead[0]) };
            twist.angular.z = (error / period).clamp(-turn_rate, turn_rate);
            // No faster than the heading allows: what lies to the side has to be turned to first.
            twist.linear.x = ahead[0].clamp(0.0, speed);
        }
    }
    twist
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn velocities_are_in_the_robot_s_own_axes_and_within_its_limits() {
        let Twist { linear, angular } = twist([0.0, 0.5], FRAC_PI_2, 0.1, 2.0, None);
        assert!((linear.x - 2.0).abs() < 1e-12 && linear.y.abs() < 1e-12 && angular.z == 0.0, "{linear:?}");
        let Twist { linear, .. } = twist([-0.05, 0.0], FRAC_PI_2, 0.1, 2.0, None);
        assert!((linear.y - 0.5).abs() < 1e-12 && linear.x.abs() < 1e-12, "{linear:?}");
    }

    #[test]
    fn a_robot_that_cannot_go_sideways_turns_first() {
        let Twist { linear, angular } = twist([0.0, 0.2], 0.0, 0.1, 2.0, Some(1.5));
        assert_eq!((linear.y, angular.z), (0.0, 1.5));
        assert!(linear.x.abs() < 1e-12);
        let still = twist([0.0; 2], 0.3, 0.1, 2.0, Some(1.5));
        assert_eq!(still, Twist::default());
    }
}
