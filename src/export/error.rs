//! Errors of writing outputs.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{manifest, sweep};

/// Why outputs were not written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A folder with something in it, which may not be replaced.
    #[error("{} is not empty: give --force to replace it, or another --out", .0.display())]
    NotEmpty(PathBuf),
    /// A folder that would be replaced, but holds no list of files that flockform wrote.
    #[error(
        "{} does not look like an output of flockform, which has a {}: --force leaves it alone; give another --out",
        .0.display(), manifest::FILE
    )]
    NotOurs(PathBuf),
    /// A folder of flockform that has other files too.
    #[error(
        "{} holds what flockform did not write: {}\n  help: --force replaces flockform's files only; move the others away, or give another --out",
        .folder.display(), list(.files)
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// The other files in it.
        files: Vec<PathBuf>,
    },
    /// A file where the folder of outputs belongs.
    #[error("{} is no folder: give another --out", .0.display())]
    NotAFolder(PathBuf),
    /// A path that ends in no name.
    #[error("{:?} does not name a folder that could be made: give --out a name", .0.display().to_string())]
    Unnamed(PathBuf),
    /// A name that stands for a run that is not finished.
    #[error("{} would be taken for a run that is not finished: give --out a name that does not end in .unfinished", .0.display())]
    Reserved(PathBuf),
    /// A folder of outputs that the system does not let stand where it is asked for.
    #[error("cannot create {}: {source}\n  help: give --out a name in a folder that can be written to", .out.display())]
    Unmakeable {
        /// Where it is asked for.
        out: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// An unfinished run that would be discarded.
    #[error(
        "{} holds a {command} that was not finished: continue it with `flockform {command} --resume {}`, discard it with --force, or give another --out",
        .0.display(), .0.display(), command = resumed_by(.0)
    )]
    Unfinished(PathBuf),
    /// Something else where an unfinished run would be kept.
    #[error("{} is in the way of what is kept of a run that is broken off: move it away, or give another --out", .0.display())]
    InTheWay(PathBuf),
    /// Another program is writing the same outputs.
    #[error("{} is being written by another flockform that still runs: wait for it, or give another --out", .0.display())]
    Busy(PathBuf),
    /// A file of its own, a film or a recording, that would stand in the folder of outputs, which appears only at the end.
    #[error(
        "{} would stand in {}, which is for the results alone\n  help: give it a place outside, or another --out",
        .file.display(), .out.display()
    )]
    InResults {
        /// The file.
        file: PathBuf,
        /// The folder.
        out: PathBuf,
    },
    /// A checkpoint counts on a frame for ParaView that is not there.
    #[error("{} is missing, which the checkpoint beside it needs: start the run again", .0.display())]
    MissingFrame(PathBuf),
    /// The system refuses a file or a folder.
    #[error("cannot {action} {}: {source}", .path.display())]
    Io {
        /// The attempt, as a verb.
        action: &'static str,
        /// The file or the folder.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// Another rank cannot write its part.
    #[error(
        "rank {rank} cannot write {}\n  help: let --out be a folder that all ranks see, or leave record.vtk_every out",
        .path.display()
    )]
    OnRank {
        /// The rank.
        rank: usize,
        /// The file.
        path: PathBuf,
    },
    /// A run that is not of the sweep that it would be added to.
    #[error("{0}")]
    Sweep(#[from] sweep::SweepError),
    /// A figure's SVG cannot be drawn as PNG.
    #[error("the figure {} cannot be rendered: {reason}", .path.display())]
    Figure {
        /// The figure.
        path: PathBuf,
        /// The error of the renderer.
        reason: String,
    },
    /// The outputs are whole but stand under their temporary name.
    #[error("the outputs are complete and kept in {}, but cannot be moved to their place: {source}", .kept.display())]
    NotMoved {
        /// Where they are.
        kept: PathBuf,
        /// Why they could not be moved.
        source: Box<ExportError>,
    },
}

impl ExportError {
    /// For `map_err`: what was tried, and on which path.
    pub(super) fn io<E: Into<io::Error>>(action: &'static str, path: &Path) -> impl FnOnce(E) -> Self {
        move |error| Self::Io { action, path: path.to_owned(), source: of_the_system(error.into()) }
    }
}

/// The system's own error, which distinguishes a full disk from other causes.
fn of_the_system(error: io::Error) -> io::Error {
    let inner = error.get_ref().and_then(|inner| inner.downcast_ref::<csv::Error>());
    let code = inner.and_then(|inner| match inner.kind() {
        csv::ErrorKind::Io(inner) => inner.raw_os_error(),
        _ => None,
    });
    code.map_or(error, io::Error::from_raw_os_error)
}

/// The command that goes on with what an unfinished folder holds.
fn resumed_by(unfinished: &Path) -> &'static str {
    if unfinished.join(sweep::REQUEST).exists() { "sweep" } else { "run" }
}

fn list(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

/// Writes a whole file, which is a new one.
pub(super) fn write_file(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), ExportError> {
    let write = || manifest::create(path)?.write_all(contents.as_ref());
    write().map_err(ExportError::io("write", path))
}
