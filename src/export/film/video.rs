//! MP4 and WebM: raw frames into the standard input of `ffmpeg`.

use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

use super::super::error::ExportError;
use super::error::FilmError;
use super::{Encoder, FilmFormat, Picture};

const FFMPEG: &str = "ffmpeg";
/// Words of a failing program that are passed on at most \[byte\].
const MOST_WORDS: u64 = 2000;

/// The name of an encoder, and the options that it takes.
pub type Codec = (&'static str, &'static [&'static str]);

/// Encoders of a format, the best first.
fn codecs(format: FilmFormat) -> &'static [Codec] {
    match format {
        FilmFormat::Gif => &[],
        FilmFormat::Mp4 => &[
            ("libx264", &["-crf", "18", "-preset", "medium"]),
            ("libopenh264", &["-b:v", "4M"]),
            ("mpeg4", &["-q:v", "3"]),
        ],
        FilmFormat::WebM => &[
            ("libvpx-vp9", &["-crf", "24", "-b:v", "0", "-row-mt", "1"]),
            ("libvpx", &["-crf", "10", "-b:v", "4M"]),
        ],
    }
}

/// The encoder that the `ffmpeg` of this computer has for a format.
///
/// # Errors
/// There is no such program, or it has none.
pub fn codec(format: FilmFormat, path: &Path) -> Result<Codec, FilmError> {
    let refused = |reason: &str| {
        let help = "install ffmpeg, or end the name of the film with .gif";
        FilmError::Refused(format!("{} takes the program `ffmpeg`: {reason}\n  help: {help}", path.display()))
    };
    let asked = Command::new(FFMPEG).args(["-hide_banner", "-encoders"]).stdin(Stdio::null()).output();
    let asked = asked.map_err(|error| match error.kind() {
        ErrorKind::NotFound => refused("it is not on the PATH"),
        _ => refused(&format!("it cannot be started ({error})")),
    })?;
    let listed = String::from_utf8_lossy(&asked.stdout);
    let has = |name: &str| listed.lines().any(|line| line.split_whitespace().nth(1) == Some(name));
    let wanted = || codecs(format).iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let found = codecs(format).iter().copied().find(|(name, _)| has(name));
    found.ok_or_else(|| refused(&format!("this one has none of {}", wanted())))
}

pub struct VideoEncoder {
    path: PathBuf,
    child: Child,
    frames: Option<ChildStdin>,
    words: Option<JoinHandle<String>>,
    /// Of a frame \[s/100\].
    time: u16,
}

impl VideoEncoder {
    /// For frames of one size, each shown for `time` \[s/100\].
    pub fn start(
        format: FilmFormat,
        (codec, options): Codec,
        path: &Path,
        time: u16,
        [width, height]: [u32; 2],
    ) -> Result<Self, FilmError> {
        let (container, more): (&str, &[&str]) = match format {
            FilmFormat::WebM => ("webm", &[]),
            // The index first, so that a web page can play it while it loads.
            _ => ("mp4", &["-movflags", "+faststart"]),
        };
        let mut command = Command::new(FFMPEG);
        command.args(["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]);
        command.args(["-f", "rawvideo", "-pix_fmt", "rgba", "-video_size", &format!("{width}x{height}")]);
        command.args(["-framerate", &format!("100/{time}"), "-i", "pipe:0", "-an", "-c:v", codec]);
        // Players take colours that are not named to be of one standard or of the other.
        command.args(["-vf", "scale=out_color_matrix=bt709:out_range=tv", "-color_range", "tv"]);
        command.args(["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"]);
        command.args(options).args(["-pix_fmt", "yuv420p"]).args(more).args(["-f", container]);
        // An absolute path, which no option and no protocol begins with.
        command.arg(path).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(ExportError::io("start ffmpeg for", path))?;
        let frames = child.stdin.take();
        // Read meanwhile: a program that says much must not wait for a reader.
        let words = child.stderr.take().map(|said| std::thread::spawn(move || words_of(said)));
        Ok(Self { path: path.to_owned(), child, frames, words, time })
    }

    /// The reason why the program ended.
    fn failure(&mut self) -> FilmError {
        self.frames = None;
        let status = self.child.wait().map_or_else(|error| error.to_string(), |status| status.to_string());
        let said = self.words.take().and_then(|words| words.join().ok()).unwrap_or_default();
        let said = if said.is_empty() { status } else { said };
        FilmError::Encoder { path: self.path.clone(), said }
    }
}

/// The beginning of what a program says, to its end.
fn words_of(mut said: impl Read) -> String {
    let mut words = Vec::new();
    let _ = said.by_ref().take(MOST_WORDS).read_to_end(&mut words);
    let _ = std::io::copy(&mut said, &mut std::io::sink());
    String::from_utf8_lossy(&words).trim().to_owned()
}

impl Encoder for VideoEncoder {
    fn add(&mut self, picture: &Picture, time: u16) -> Result<(), FilmError> {
        // A video has frames of one length: one that stands longer comes several times.
        for _ in 0..time.div_ceil(self.time.max(1)) {
            let Some(frames) = &mut self.frames else { return Err(self.failure()) };
            if frames.write_all(&picture.rgba).is_err() {
                return Err(self.failure());
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), FilmError> {
        self.frames = None;
        match self.child.wait() {
            Ok(status) if status.success() => Ok(()),
            _ => Err(self.failure()),
        }
    }
}

impl Drop for VideoEncoder {
    fn drop(&mut self) {
        self.frames = None;
        // One that was not finished has nothing left to do; of one that ended, this is an error without meaning.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
