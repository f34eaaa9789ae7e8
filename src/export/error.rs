//! Errors of writing outputs.

use std::io;
use std::path::{Path, PathBuf};

#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error("{} is not empty: give --force to replace it, or another --out", .0.display())]
    NotEmpty(PathBuf),
    #[error(
        "{} does not look like an output of flockform, which has a summary.json or a compare.json: --force leaves it alone; give another --out",
        .0.display()
    )]
    NotOurs(PathBuf),
    #[error("{} is no folder: give another --out", .0.display())]
    NotAFolder(PathBuf),
    #[error("{:?} does not name a folder that could be made: give --out a name", .0.display().to_string())]
    Unnamed(PathBuf),
    #[error(
        "{} holds a run that was not finished: continue it with `flockform run --resume {}`, discard it with --force, or give another --out",
        .0.display(), .0.display()
    )]
    Unfinished(PathBuf),
    #[error("{} is being written by another flockform that still runs: wait for it, or give another --out", .0.display())]
    Busy(PathBuf),
    #[error("{} is missing, which the checkpoint beside it needs: start the run again", .0.display())]
    MissingFrame(PathBuf),
    #[error("cannot {action} {}: {source}", .path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    #[error("the figure {} cannot be rendered: {reason}", .path.display())]
    Figure { path: PathBuf, reason: String },
    /// The outputs are whole but stand under their temporary name.
    #[error("the outputs are complete and kept in {}, but cannot be moved to their place: {source}", .kept.display())]
    NotMoved { kept: PathBuf, source: Box<ExportError> },
}

impl ExportError {
    /// For `map_err`: what was tried, and on which path.
    pub(super) fn io<E: Into<io::Error>>(action: &'static str, path: &Path) -> impl FnOnce(E) -> Self {
        move |error| Self::Io { action, path: path.to_owned(), source: error.into() }
    }
}

/// Writes a whole file.
pub(super) fn write_file(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), ExportError> {
    std::fs::write(path, contents).map_err(ExportError::io("write", path))
}
