//! Recordings: the messages received and sent, as an MCAP file that Foxglove and `ros2 bag play` open, and back.
//!
//! A recording has the topics, types and payloads of the live node (CDR, with the definitions as `ros2msg`
//! schemas, profile `ros2`), whether a node took part in a network, robots were simulated ([`flight`])
//! or a body was swept ([`body`]). One more topic, `~/events`, has the times of the loop's ticks and the commands it took; the
//! swarm file is attached. [`replay`] needs nothing else to repeat the flight and to list where today's targets
//! differ. A metadata record `rosbag2` and the quality of service of each channel let `ros2 bag info` and `ros2 bag play` read the
//! file as one of their own.
//!
//! * [`mod@file`]: the writer. The file has its name when it is whole; until then it is `NAME.part`.

pub mod body;
pub mod file;
pub mod flight;

mod reader;
pub mod replay;
mod rosbag2;
mod shared;
mod topics;

use std::path::PathBuf;

pub use file::{About, Recording};
pub use reader::{Entry, Reader};
pub use shared::Shared;

/// Error writing or reading a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// A recording that cannot be made where it is asked for, or says too little to be replayed, with the remedy.
    #[error("{0}")]
    Refused(String),
    /// Another program has put a file where the recording belongs while it was written.
    #[error("{} was taken meanwhile: the recording is complete and kept in {}", .path.display(), .part.display())]
    Kept {
        /// Where the recording is.
        part: PathBuf,
        /// Where it belongs.
        path: PathBuf,
    },
    /// The system refuses a file.
    #[error("cannot {action} {}: {source}", .path.display())]
    Io {
        /// The attempt, as a verb.
        action: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// A recording could not be written on.
    #[error("the recording ends early, and what there is of it is in {}: {}", .path.display(), reason(source))]
    Write {
        /// The unfinished file.
        path: PathBuf,
        /// The error of the MCAP library.
        source: mcap::McapError,
    },
    /// The file is no MCAP file, or is damaged beyond reading.
    #[error("{} is no MCAP file: {source}\n  help: give a file that --record or `ros2 bag record -s mcap` has written", .path.display())]
    NoMcap {
        /// Path of the file.
        path: PathBuf,
        /// The error of the MCAP library.
        source: mcap::McapError,
    },
    /// The swarm of a recording, with the overrides, is none.
    #[error("{0}")]
    Scene(#[from] crate::scene::SceneError),
    /// A topic or frame has no legal name.
    #[error("{0}")]
    Name(#[from] crate::messages::names::NameError),
}

/// The error of the MCAP library, with that of the system below it.
fn reason(error: &mcap::McapError) -> String {
    match std::error::Error::source(error) {
        Some(source) => format!("{error}: {source}"),
        None => error.to_string(),
    }
}

impl RecordError {
    /// For `map_err`: what was tried, and on which path.
    fn io(action: &'static str, path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Io { action, path, source }
    }
}
