//! The edge to shared memory: poses in, targets and formation state out, and a running body to read, between
//! processes of one computer without a copy (iceoryx2).
//!
//! Every service is a pair: publish and subscribe of slices, and an event that wakes its subscribers. Publishers write
//! in place in shared memory; subscribers borrow. No process polls, and a slow or dead one delays no other: the
//! oldest slice in a full queue gives way.
//!
//! | service | elements | from |
//! |---|---|---|
//! | `flockform/SWARM/poses` | [`payload::Pose`] | the robots |
//! | `flockform/SWARM/leaders` | [`payload::Leader`] | a process that moves leaders |
//! | `flockform/SWARM/commands` | [`payload::Command`] | a process that may stop the formation |
//! | `flockform/SWARM/targets` | [`payload::Target`] | the node |
//! | `flockform/SWARM/state` | one [`payload::Formation`] | the node |
//! | `flockform/SWARM/members` | [`payload::Member`] | the node |
//! | `flockform/NAME/positions` | [`payload::Particle`] | `flockform run --publish NAME` |
//!
//! `SWARM` is the name of the swarm file without its ending. All carry [`payload::Header`] as user header. Types are
//! distinguished by name, and the name bears a version: another one is refused ([`ShmError::Type`]).
//!
//! * [`domain`]: which processes meet. [`channel`]: a service's two sides. [`wait`]: sleeping until there is something.
//! * [`link`]: the ends of a [`transport`](crate::swarm::transport). [`node`], [`robots`]: the loop and the robots on top.
//! * [`positions`]: a running body.

pub mod channel;
pub mod domain;
mod folders;
pub mod link;
pub mod node;
pub mod payload;
pub mod positions;
pub mod robots;
pub mod wait;

pub use channel::{Capacity, Reader, Writer};
pub use domain::{Domain, Peer};
pub use node::FormationNode;
pub use robots::SimulatedRobots;

use crate::scene::SceneError;
use crate::swarm::control::scope::NodeScopeError;

/// Errors of shared memory.
#[derive(Debug, thiserror::Error)]
pub enum ShmError {
    /// The swarm cannot be laid out or kept safe.
    #[error("{0}")]
    Swarm(#[from] SceneError),
    /// A robot cannot be served alone.
    #[error("{0}")]
    NodeScope(#[from] NodeScopeError),
    /// A name that is none, or a computer that does not give what is needed, with the remedy.
    #[error("{0}")]
    Refused(String),
    /// A service carries another type, or another version of it.
    #[error(
        "{service} carries `{found}`, and this program speaks `{expected}`\n  help: use programs of one version, or keep them apart by {variable}",
        variable = domain::VARIABLE
    )]
    Type {
        /// Name of the service.
        service: String,
        /// The type that it carries.
        found: String,
        /// The type that this program speaks.
        expected: String,
    },
    /// A service cannot be opened or joined.
    #[error("{service}: {reason}\n  help: {help}")]
    Service {
        /// Name of the service.
        service: String,
        /// The error of iceoryx2.
        reason: String,
        /// The remedy.
        help: String,
    },
    /// A slice could not be filled or sent.
    #[error("{service}: not sent: {reason}")]
    Send {
        /// Name of the service.
        service: String,
        /// The error of iceoryx2.
        reason: String,
    },
}

/// Shared memory of one process of a swarm of so many robots \[bytes\]: of what its services and slices may grow to the part
/// that is written, with a margin. Of 9 robots a node has written 260 kB, of 300 robots 390 kB; more readers take more slices.
fn room_for_swarm(robots: usize) -> u64 {
    (512 << 10) + (4 << 10) * robots as u64
}
