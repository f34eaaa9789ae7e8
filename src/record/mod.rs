//! Recordings: the messages received and sent, as an MCAP file that Foxglove and `ros2 bag play` open, and back.
//!
//! A recording has the topics, types and payloads of the live node (CDR, with the definitions as `ros2msg`
//! schemas, profile `ros2`), whether a node took part in a network, robots were simulated ([`flight`])
//! or a body was swept ([`body`]). One more topic, `~/events`, has the times of the loop's ticks and the commands it took; the
//! swarm file is attached. [`replay`] needs nothing else to repeat the flight and to list where today's targets
//! differ.
//!
//! * [`mod@file`]: the writer. The file has its name when it is whole; until then it is `NAME.part`.

pub mod body;
pub mod file;
pub mod flight;

mod reader;
pub mod replay;
mod shared;
mod topics;

use std::path::PathBuf;

pub use file::{About, Recording};
pub use reader::{Entry, Reader};
pub use shared::Shared;

/// Error writing or reading a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    #[error("{} exists: remove it, or give the recording another name", .0.display())]
    Taken(PathBuf),
    #[error(
        "{} is no MCAP file: --force replaces recordings only\n  help: move it away, or give the recording another name",
        .0.display()
    )]
    NotOurs(PathBuf),
    #[error("{} was taken meanwhile: the recording is complete and kept in {}", .path.display(), .part.display())]
    Kept { part: PathBuf, path: PathBuf },
    #[error("{} does not name a file that could be made: give it a name that ends in .mcap", .0.display())]
    Unnamed(PathBuf),
    #[error("--record: {what} is not recorded\n  help: leave --record out, or use ROS 2")]
    NotRecorded { what: &'static str },
    #[error("cannot {action} {}: {source}", .path.display())]
    Io { action: &'static str, path: PathBuf, source: std::io::Error },
    #[error("{} cannot be written: {source}", .path.display())]
    Write { path: PathBuf, source: mcap::McapError },
    #[error("{} is no MCAP file: {source}\n  help: give a file that --record or `ros2 bag record -s mcap` has written", .path.display())]
    NoMcap { path: PathBuf, source: mcap::McapError },
    #[error(
        "{} does not say which swarm flew\n  help: name the swarm file with --swarm; only flockform's own recordings of a swarm carry it",
        .0.display()
    )]
    NoSwarm(PathBuf),
    #[error("{}: {what}\n  help: {help}", .path.display())]
    Unusable { path: PathBuf, what: String, help: String },
    #[error("{0}")]
    Scene(#[from] crate::scene::SceneError),
    #[error("{0}")]
    Name(#[from] crate::ros::arguments::NameError),
}

impl RecordError {
    /// For `map_err`: what was tried, and on which path.
    fn io(action: &'static str, path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Io { action, path, source }
    }
}
