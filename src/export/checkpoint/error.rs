//! Why a run cannot be gone on with.

use std::path::PathBuf;

/// Error resuming a run from a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Neither of the two folders has a checkpoint.
    #[error(
        "there is nothing to resume: neither {} nor {} holds a checkpoint\n  help: start the run again; one that ends by itself leaves none, and the first is written after --checkpoint-every",
        .unfinished.display(), .out.display()
    )]
    Nothing {
        /// The folder of an unfinished run.
        unfinished: PathBuf,
        /// The folder of outputs.
        out: PathBuf,
    },
    /// The system refuses to read the checkpoint.
    #[error("{} cannot be read: {source}", .path.display())]
    Unreadable {
        /// Path of the checkpoint.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The file cannot be gone on with: it is damaged, or of something else.
    #[error("{} {what}\n  help: {help}", .path.display())]
    Unfit {
        /// The file or its folder.
        path: PathBuf,
        /// The fault in it.
        what: String,
        /// The way out.
        help: &'static str,
    },
}

/// The way out where a checkpoint is damaged.
pub(super) const RESTORE: &str = "restore it from a copy, or remove it and start the run again";

impl CheckpointError {
    /// A payload that is not what was written.
    pub(super) fn corrupted(path: PathBuf, what: &str) -> Self {
        Self::Unfit { path, what: format!("is corrupted: {what}"), help: RESTORE }
    }

    /// A checkpoint of another scene, or one whose files have changed.
    pub fn foreign(path: PathBuf, what: &str) -> Self {
        let help = "resume with the scene that was run, or start this one with another --out";
        Self::Unfit { path, what: format!("belongs to another scene: {what}"), help }
    }
}
