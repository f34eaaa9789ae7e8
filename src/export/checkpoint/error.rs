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
    /// The file does not begin as a checkpoint does.
    #[error("{} is no checkpoint of flockform\n  help: give the folder of a run; remove the file to start again", .path.display())]
    NotOne {
        /// Path of the checkpoint.
        path: PathBuf,
    },
    /// The file ends before its payload does.
    #[error(
        "{} is truncated: it has {found} bytes of {needed}\n  help: restore it from a copy, or remove it and start the run again",
        .path.display()
    )]
    Truncated {
        /// Path of the checkpoint.
        path: PathBuf,
        /// Its size \[byte\].
        found: u64,
        /// The size that its header asks for \[byte\].
        needed: u64,
    },
    /// The payload is not what was written.
    #[error(
        "{} is corrupted: {what}\n  help: restore it from a copy, or remove it and start the run again",
        .path.display()
    )]
    Corrupted {
        /// Path of the checkpoint.
        path: PathBuf,
        /// The fault in it.
        what: String,
    },
    /// Another version of the layout or of the program wrote the file.
    #[error(
        "{} is of {found}, this is {known}: the same bits cannot be promised\n  help: resume with the program that wrote it, or remove it and start the run again",
        .path.display()
    )]
    Version {
        /// Path of the checkpoint.
        path: PathBuf,
        /// The version that wrote it.
        found: String,
        /// The version that reads it.
        known: String,
    },
    /// The checkpoint is of another scene, or files that the scene names have changed.
    #[error(
        "{} belongs to another scene: {what}\n  help: resume with the scene that was run, or start this one with another --out",
        .path.display()
    )]
    Foreign {
        /// The file or its folder.
        path: PathBuf,
        /// The difference.
        what: String,
    },
}
