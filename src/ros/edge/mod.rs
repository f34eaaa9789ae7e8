//! The wire: participant, nodes, topics, services, parameters, lifecycle and clock of ROS 2, without ROS 2.
//!
//! Everything here is polled. A node's loop is one thread that takes what arrived once per tick and
//! publishes; no call below waits for the network. RustDDS (through ros2-client) does the protocol on its
//! own threads; one more thread of ours tracks discovery, one writes the outgoing messages.
//!
//! * [`participant`]: an [`Edge`] is one DDS participant; [`Node`]s of one process share it.
//! * [`topic`]: publishers and subscriptions; [`quality`]: what they promise each other.
//! * [`service`]: services that answer peers on Fast DDS and on Cyclone DDS alike.
//! * [`parameters`], [`lifecycle`]: what ROS 2 expects of a node, as pure cores and their services.
//! * [`loggers`]: the level of the log; [`rosout`]: its lines; [`descriptions`]: what messages are made of.
//! * [`pulse`]: whether the middleware still lives.
//! * [`clock`]: system time or the simulator's.
//!
//! Times are seconds since the Unix epoch as `f64`.

pub mod clock;
pub mod descriptions;
mod door;
mod farewell;
mod graph;
pub mod lifecycle;
pub mod loggers;
pub mod loopback;
pub mod names;
mod nudge;
mod outbox;
mod packet;
pub mod parameters;
pub mod participant;
mod payload;
mod places;
pub mod pulse;
pub mod quality;
#[cfg(any(test, feature = "security"))]
#[cfg_attr(not(feature = "security"), allow(dead_code, reason = "its test alone is built"))]
mod queue;
pub mod rosout;
pub mod service;
mod threads;
pub mod topic;
mod whole;

use crate::messages::names::NameError;

pub use participant::{Edge, Node, Options};
pub use quality::Quality;
pub use service::{RequestId, Service};
pub use topic::{Publisher, Stamps, Subscription};

/// Why something at the edge could not be made or sent.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EdgeError {
    #[error(
        "domain {domain} is out of range: ROS_DOMAIN_ID is 0 to 232 (0 to 101 keeps clear of the ports the \
         system hands out)"
    )]
    Domain { domain: u16 },
    #[error(
        "no DDS participant on domain {domain}: {reason}; is another process holding every port of the \
         domain? try another ROS_DOMAIN_ID"
    )]
    Participant { domain: u16, reason: String },
    #[error(
        "the enclave {place} does not admit to domain {domain}: {reason}\n  help: see whether its permissions and \
         governance name this domain, are valid today and signed by the key of permissions_ca.cert.pem, and whether \
         they allow ros_discovery_info"
    )]
    Enclave { domain: u16, place: String, reason: String },
    #[error("{0}")]
    Name(#[from] NameError),
    #[error("no endpoint on {topic}: {reason}")]
    Endpoint { topic: String, reason: String },
    #[error(
        "the permissions of this process do not allow {topic}: {reason}\n  help: allow it in the enclave's \
         permissions.xml, below publish where it is written and below subscribe where it is read, and sign that anew"
    )]
    Forbidden { topic: String, reason: String },
    #[error(
        "topic {topic} has two uses: {kind} of this node, and commands to it\n  help: give the commands a topic of their own"
    )]
    OwnCommands { topic: String, kind: &'static str },
    #[error("not sent on {topic}: {reason}")]
    Send { topic: String, reason: String },
}
