//! Velocities towards the targets, for robots that are driven so.

use crate::messages::builtin_interfaces::Time;
use crate::messages::geometry_msgs::{Twist, TwistStamped, Vector3};
use crate::messages::std_msgs::Header;
use crate::ros::edge::{EdgeError, Node, Publisher, Quality};
use crate::scene::swarm::raw::{RawModel, RawSwarm, RawVelocityType};
use crate::swarm::control::Control;
use crate::swarm::steering::{Steering, Velocity};

/// Velocities of one member, in its own axes (REP 103: x ahead, y to the left).
pub struct Drive {
    topic: Topic,
    steering: Steering,
}

enum Topic {
    Plain(Publisher<Twist>),
    /// With the frame that the member carries.
    Stamped(Publisher<TwistStamped>, String),
}

impl Drive {
    /// Of a member that carries the frame `frame_id`.
    pub fn open(
        node: &Node,
        topic: &str,
        kind: RawVelocityType,
        raw: &RawSwarm,
        frame_id: String,
    ) -> Result<Self, EdgeError> {
        let quality = Quality::reliable(1);
        Ok(Self {
            topic: match kind {
                RawVelocityType::Twist => Topic::Plain(node.publisher(topic, quality)?),
                RawVelocityType::TwistStamped => Topic::Stamped(node.publisher(topic, quality)?, frame_id),
            },
            steering: Steering::new(match raw.flight.model {
                RawModel::Unicycle { turn_rate } => Some(turn_rate.to_radians()),
                _ => None,
            }),
        })
    }

    /// Publishes the velocity towards the target at `now` \[s\], zero for a member without one.
    pub fn publish(
        &mut self,
        control: &Control,
        member: usize,
        target: Option<[f64; 2]>,
        now: f64,
    ) -> Result<(), EdgeError> {
        let Velocity { ahead, left, turn } = self.steering.next(control, member, target);
        let twist = Twist {
            linear: Vector3 { x: ahead, y: left, z: 0.0 },
            angular: Vector3 { x: 0.0, y: 0.0, z: turn },
        };
        match &self.topic {
            Topic::Plain(topic) => topic.publish(&twist),
            Topic::Stamped(topic, frame_id) => {
                let header = Header { stamp: Time::from_seconds(now), frame_id: frame_id.clone() };
                topic.publish(&TwistStamped { header, twist })
            }
        }
    }
}
