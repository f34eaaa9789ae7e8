//! Errors of making films.

use std::io;
use std::path::{Path, PathBuf};

/// Why there is no film.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// An ending that names no format.
    #[error(
        "{} does not say what film it is to be\n  help: end the name with .gif, .mp4 or .webm", .0.display()
    )]
    Ending(PathBuf),
    /// A file that stands where the film belongs.
    #[error("{} exists: give --force to replace it, or --film another name", .0.display())]
    Taken(PathBuf),
    /// A file that would be replaced, but is no film.
    #[error("{} is no film of this kind: --force leaves it alone; give --film another name", .0.display())]
    NotAFilm(PathBuf),
    /// A folder that does not exist.
    #[error("there is no folder {} for the film\n  help: make it, or give --film another place", .0.display())]
    NoFolder(PathBuf),
    /// Another program makes the same film.
    #[error("{} is being made by another flockform that still runs: give --film another name", .0.display())]
    Busy(PathBuf),
    /// No program that makes videos.
    #[error(
        "{} takes the program `ffmpeg`: {reason}\n  help: install ffmpeg, or end the name of the film with .gif",
        .path.display()
    )]
    NoEncoder {
        /// The film.
        path: PathBuf,
        /// The fault in it.
        reason: String,
    },
    /// A quantity that the subject does not have.
    #[error("--film-colour {colour}: {reason}\n  help: choose {choices}")]
    Colour {
        /// The quantity asked for.
        colour: &'static str,
        /// Reason for the refusal.
        reason: &'static str,
        /// The others.
        choices: &'static str,
    },
    /// A frame that cannot be drawn.
    #[error("frame {frame} of the film cannot be drawn: {reason}")]
    Frame {
        /// Its number, from 0.
        frame: usize,
        /// The error of the renderer.
        reason: String,
    },
    /// The program that makes videos failed.
    #[error("ffmpeg made no film of {}: {said}", .path.display())]
    Encoder {
        /// The film.
        path: PathBuf,
        /// The error of the program.
        said: String,
    },
    /// The system refuses the file.
    #[error("cannot {action} {}: {source}", .path.display())]
    Io {
        /// The attempt, as a verb.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
}

impl FilmError {
    /// For `map_err`: what was tried, and on which path.
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }
}
