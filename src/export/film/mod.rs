//! Films: the configurations of a run, or the map of a flight, one after another, as GIF, MP4 or WebM.
//!
//! A film is drawn after the run from the frames that its report's recorder keeps: what a frame shows is the figure
//! of that step, in a window, with a legend and on a scale of colours that are the same from the first frame to the
//! last. Only as many frames as there are threads are in memory at one time.
//!
//! GIF is written by the program itself; for the others frames are piped into `ffmpeg`.

mod error;
#[cfg(feature = "swarm")]
pub mod flight;
mod gif;
mod palette;
mod place;
pub mod run;
mod video;

use std::ops::ControlFlow;
use std::path::PathBuf;

use rayon::prelude::*;

use super::figures::png::{self, Picture};
pub use error::FilmError;
pub use place::{FilmFile, FilmFormat};

/// Frames of a film at most; of more, every second, third, ... is shown.
pub(crate) const MOST_FRAMES: usize = 300;
/// A film lasts about so long \[s\], unless it has too few frames for that or too many.
const LENGTH: f64 = 8.0;
/// Time of a frame \[s/100\], the unit of GIF: 25 to 5 frames a second.
const FRAME_TIME: [f64; 2] = [4.0, 20.0];
/// How much longer the last frame stands \[s/100\].
const LAST: u16 = 150;

named! {
    /// The quantity that colours show.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum FilmColour {
        /// The role of a particle or robot.
        Role => "role",
        /// Length of the displacement from the start.
        Displacement => "displacement",
        /// First pseudo-energy.
        Pe1 => "pe1",
        /// Second pseudo-energy: the length of the last move.
        Pe2 => "pe2",
        /// The principal strain largest in size.
        Strain => "strain",
        /// Von Mises stress.
        VonMises => "von-mises",
        /// Free space around a robot.
        Clearance => "clearance",
        /// Distance of a robot from its place.
        Away => "away",
        /// Speed of a robot.
        Speed => "speed",
        /// Acceleration of a robot.
        Acceleration => "acceleration",
    }
}

impl FilmColour {
    /// Those of particles.
    pub const OF_BODIES: [Self; 6] =
        [Self::Role, Self::Displacement, Self::Pe1, Self::Pe2, Self::Strain, Self::VonMises];

    /// Those of robots.
    pub const OF_SWARMS: [Self; 8] = [
        Self::Role,
        Self::Displacement,
        Self::Clearance,
        Self::Away,
        Self::Speed,
        Self::Acceleration,
        Self::Pe1,
        Self::Strain,
    ];
}

/// Sheets to be drawn one after another; all are of one size.
pub struct Film<'a> {
    count: usize,
    draw: Box<dyn Fn(usize) -> String + Sync + 'a>,
}

/// A film that was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finished {
    /// Its file.
    pub path: PathBuf,
    /// Number of frames.
    pub frames: usize,
    /// Width and height \[pixel\].
    pub size: [u32; 2],
    /// The encoder that made it.
    pub encoder: String,
}

impl Film<'_> {
    /// Paints the frames and writes them. `progress` is called with how many are written, of how many; once it breaks
    /// off there is no film, and `None` is returned.
    ///
    /// # Errors
    /// A frame that cannot be painted, an encoder that fails, a file that cannot be written: nothing is left of it.
    pub fn write(
        &self,
        file: FilmFile,
        progress: &dyn Fn(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<Finished>, FilmError> {
        let zoom = file.zoom();
        let paint = |frame: usize| {
            png::paint(&(self.draw)(frame), zoom).map_err(|reason| FilmError::Frame { frame, reason })
        };
        let time = frame_time(self.count);
        let mut encoder = file.encoder(self.count, time, &paint)?;
        let mut size = [0; 2];
        let frames: Vec<usize> = (0..self.count).collect();
        for some in frames.chunks(rayon::current_num_threads().max(1)) {
            let pictures: Result<Vec<Picture>, FilmError> = some.par_iter().map(|&n| paint(n)).collect();
            for (picture, &n) in pictures?.iter().zip(some) {
                if progress(n, self.count).is_break() {
                    return Ok(None);
                }
                let is_last = n + 1 == self.count;
                encoder.add(picture, if is_last { time + LAST } else { time })?;
                size = picture.size;
            }
        }
        encoder.finish()?;
        let encoder = file.encoder_name();
        let path = file.finish()?;
        Ok(Some(Finished { path, frames: self.count, size, encoder }))
    }
}

/// Writes the frames of a film, all of one size; each stands for a time in \[s/100\].
trait Encoder {
    fn add(&mut self, picture: &Picture, time: u16) -> Result<(), FilmError>;
    fn finish(self: Box<Self>) -> Result<(), FilmError>;
}

fn frame_time(count: usize) -> u16 {
    (100.0 * LENGTH / count.max(1) as f64).round().clamp(FRAME_TIME[0], FRAME_TIME[1]) as u16
}

/// The frames that are shown of `kept` ones: evenly spaced, the first and the last among them.
fn chosen(kept: usize) -> Vec<usize> {
    let every = kept.div_ceil(MOST_FRAMES - 1).max(1);
    let last = kept.saturating_sub(1);
    let mut chosen: Vec<usize> = (0..last).step_by(every).collect();
    chosen.extend((kept > 0).then_some(last));
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_has_no_more_frames_than_the_most_and_ends_with_the_last() {
        for kept in [0, 1, 2, 21, 299, 300, 301, 512, 513, 5_000] {
            let frames = chosen(kept);
            assert!(frames.len() <= MOST_FRAMES, "{kept}: {}", frames.len());
            assert_eq!(frames.first().copied(), (kept > 0).then_some(0));
            assert_eq!(frames.last().copied(), kept.checked_sub(1));
            assert!(frames.windows(2).all(|pair| pair[0] < pair[1]), "{kept}: {frames:?}");
        }
    }

    #[test]
    fn few_frames_are_shown_slowly_and_many_at_25_a_second() {
        assert_eq!([1, 21, 100, 300].map(frame_time), [20, 20, 8, 4]);
    }
}
