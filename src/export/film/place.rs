//! The file of a film: refused before the run where it could not be written, whole or not there afterwards.

use std::fs::{self, File, TryLockError};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::super::error::ExportError;
use super::error::FilmError;
use super::gif::GifEncoder;
use super::video::{self, Codec, VideoEncoder};
use super::{Encoder, Picture};
use crate::export::folder::beside;

/// The kind of film that a name asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmFormat {
    /// Plays anywhere, without sound and in 256 colours; the program writes it itself.
    Gif,
    /// H.264, for slides and phones.
    Mp4,
    /// VP9, for web pages.
    WebM,
}

impl FilmFormat {
    /// The format that a path ends in.
    ///
    /// # Errors
    /// Any other ending.
    pub fn of(path: &Path) -> Result<Self, FilmError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("gif") => Ok(Self::Gif),
            Some("mp4") => Ok(Self::Mp4),
            Some("webm") => Ok(Self::WebM),
            _ => Err(FilmError::Refused(format!(
                "{} does not say what film it is to be\n  help: end the name with .gif, .mp4 or .webm",
                path.display()
            ))),
        }
    }

    /// Whether a file begins as such a film does.
    fn is_begun_by(self, begin: &[u8]) -> bool {
        match self {
            Self::Gif => begin.starts_with(b"GIF8"),
            Self::Mp4 => begin.get(4..8) == Some(b"ftyp"),
            Self::WebM => begin.starts_with(&[0x1a, 0x45, 0xdf, 0xa3]),
        }
    }
}

/// The place of a film to be made. Dropped before it is finished, it leaves nothing behind.
#[derive(Debug)]
pub struct FilmFile {
    path: PathBuf,
    part: PathBuf,
    format: FilmFormat,
    force: bool,
    codec: Option<Codec>,
    /// Holds other programs off.
    _lock: File,
}

impl FilmFile {
    /// A file that can be written, beside its place, as `.NAME.partial`.
    ///
    /// # Errors
    /// An ending that names no film; a file in the place, without `force` or not a film; no folder, or none that can be
    /// written to; a video without `ffmpeg`; another program that makes the same film.
    pub fn create(path: &Path, force: bool) -> Result<Self, FilmError> {
        let format = FilmFormat::of(path)?;
        let path = std::path::absolute(path).map_err(ExportError::io("find", path))?;
        require_free(&path, format, force)?;
        if let Some(folder) = path.parent().filter(|folder| !folder.is_dir()) {
            let help = "make it, or give --film another place";
            let fault = format!("there is no folder {} for the film\n  help: {help}", folder.display());
            return Err(FilmError::Refused(fault));
        }
        let codec = match format {
            FilmFormat::Gif => None,
            _ => Some(video::codec(format, &path)?),
        };
        let part = beside(&path, "partial", 0);
        // What a killed program left there is overwritten, but no folder and no link.
        if part.symlink_metadata().is_ok_and(|found| !found.is_file()) {
            return Err(FilmError::Taken(part));
        }
        let lock = File::options().write(true).create(true).truncate(false).open(&part);
        let lock = lock.map_err(ExportError::io("create", &part))?;
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            let fault = "is being made by another flockform that still runs: give --film another name";
            return Err(FilmError::Refused(format!("{} {fault}", path.display())));
        }
        Ok(Self { path, part, format, force, codec, _lock: lock })
    }

    /// The file under its temporary name.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Pixels for a \[px\] of a figure: a video is shown larger than a GIF.
    pub(super) fn zoom(&self) -> f32 {
        if self.format == FilmFormat::Gif { 1.0 } else { 2.0 }
    }

    /// An encoder for `count` frames of `time` \[s/100\] each.
    pub(super) fn encoder(
        &self,
        count: usize,
        time: u16,
        paint: &dyn Fn(usize) -> Result<Picture, FilmError>,
    ) -> Result<Box<dyn Encoder>, FilmError> {
        match self.codec {
            None => Ok(Box::new(GifEncoder::create(&self.part, count, paint)?)),
            Some(codec) => {
                Ok(Box::new(VideoEncoder::start(self.format, codec, &self.part, time, paint(0)?.size)?))
            }
        }
    }

    pub(super) fn encoder_name(&self) -> String {
        self.codec.map_or_else(|| "GIF, by flockform itself".into(), |(name, _)| format!("{name}, by ffmpeg"))
    }

    /// Gives the film its name.
    pub(super) fn finish(self) -> Result<PathBuf, FilmError> {
        // Asked again: another program may have written there meanwhile.
        require_free(&self.path, self.format, self.force)?;
        fs::rename(&self.part, &self.path)
            .map_err(ExportError::io("rename the finished film to", &self.path))?;
        Ok(self.path.clone())
    }
}

impl Drop for FilmFile {
    fn drop(&mut self) {
        // Of a finished film there is none.
        let _ = fs::remove_file(&self.part);
    }
}

/// Refuses a place that is taken, but for a film of this kind that may be replaced.
fn require_free(path: &Path, format: FilmFormat, force: bool) -> Result<(), FilmError> {
    let Ok(found) = path.symlink_metadata() else { return Ok(()) };
    if !force {
        return Err(FilmError::Taken(path.to_owned()));
    }
    // A link is not followed: what it leads to was not named.
    if !found.is_file() {
        return Err(FilmError::NotAFilm(path.to_owned()));
    }
    let mut begin = Vec::new();
    let read = File::open(path).and_then(|file| file.take(16).read_to_end(&mut begin));
    match read {
        Ok(_) if format.is_begun_by(&begin) => Ok(()),
        _ => Err(FilmError::NotAFilm(path.to_owned())),
    }
}
