//! Errors of making films.

use std::path::PathBuf;

use super::super::error::ExportError;

/// Why there is no film.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// A film that cannot be as it is asked for.
    #[error("{0}")]
    Refused(String),
    /// A file that stands where the film belongs.
    #[error("{} exists: give --force to replace it, or --film another name", .0.display())]
    Taken(PathBuf),
    /// A file that would be replaced, but is no film.
    #[error("{} is no film of this kind: --force leaves it alone; give --film another name", .0.display())]
    NotAFilm(PathBuf),
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
    #[error(transparent)]
    File(#[from] ExportError),
}
