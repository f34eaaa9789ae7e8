//! GIF: one palette for all frames, of each frame only the pixels that change.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use gif::{DisposalMethod, EncodingError, Frame, Repeat};

use super::super::error::ExportError;
use super::error::FilmError;
use super::palette::Palette;
use super::{Encoder, Picture};

/// Frames from whose pixels the palette is chosen.
const SAMPLES: usize = 5;

pub struct GifEncoder {
    path: PathBuf,
    encoder: gif::Encoder<BufWriter<File>>,
    palette: Palette,
    /// Numbers of the colours of the frame before.
    before: Vec<u8>,
}

impl GifEncoder {
    /// For `count` frames.
    pub fn create(
        path: &Path,
        count: usize,
        paint: &dyn Fn(usize) -> Result<Picture, FilmError>,
    ) -> Result<Self, FilmError> {
        let last = count.saturating_sub(1);
        let mut samples: Vec<usize> = (0..SAMPLES).map(|n| n * last / (SAMPLES - 1)).collect();
        samples.dedup();
        let samples: Vec<Picture> = samples.into_iter().map(paint).collect::<Result<_, _>>()?;
        let palette = Palette::of(&samples);
        let [width, height] = samples[0].size.map(side);
        let begin = || -> Result<_, EncodingError> {
            let file = BufWriter::new(File::create(path)?);
            let mut encoder = gif::Encoder::new(file, width, height, &palette.bytes())?;
            encoder.set_repeat(Repeat::Infinite)?;
            Ok(encoder)
        };
        let encoder = begin().map_err(|error| failed(path, error))?;
        Ok(Self { path: path.to_owned(), encoder, palette, before: Vec::new() })
    }
}

impl Encoder for GifEncoder {
    fn add(&mut self, picture: &Picture, time: u16) -> Result<(), FilmError> {
        let numbers = self.palette.numbers(picture);
        let width = picture.size[0] as usize;
        let [corner, size] = match self.before.is_empty() {
            true => [[0, 0], picture.size.map(|side| side as usize)],
            false => changed(&self.before, &numbers, width),
        };
        let mut buffer = Vec::with_capacity(size[0] * size[1]);
        for row in corner[1]..corner[1] + size[1] {
            let pixels = row * width + corner[0]..row * width + corner[0] + size[0];
            let same = |n: usize| self.before.get(n) == Some(&numbers[n]);
            buffer.extend(pixels.map(|n| if same(n) { Palette::SAME } else { numbers[n] }));
        }
        self.before = numbers;
        let frame = Frame {
            delay: time,
            dispose: DisposalMethod::Keep,
            transparent: Some(Palette::SAME),
            left: side(corner[0] as u32),
            top: side(corner[1] as u32),
            width: side(size[0] as u32),
            height: side(size[1] as u32),
            buffer: buffer.into(),
            ..Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(|error| failed(&self.path, error))
    }

    fn finish(self: Box<Self>) -> Result<(), FilmError> {
        let path = self.path;
        let mut file = self.encoder.into_inner().map_err(|error| failed(&path, error))?;
        let written = file.flush().and_then(|()| file.get_ref().sync_all());
        written.map_err(|error| failed(&path, error.into()))
    }
}

/// Corner and size of the part in which two pictures differ; one pixel where they do not.
fn changed(before: &[u8], now: &[u8], width: usize) -> [[usize; 2]; 2] {
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for (n, _) in before.iter().zip(now).enumerate().filter(|(_, (before, now))| before != now) {
        let at = [n % width, n / width];
        low = [0, 1].map(|k| at[k].min(low[k]));
        high = [0, 1].map(|k| at[k].max(high[k]));
    }
    if low[0] == usize::MAX { [[0; 2], [1; 2]] } else { [low, [0, 1].map(|k| high[k] - low[k] + 1)] }
}

/// A sheet of a figure has some thousand pixels at most.
fn side(pixels: u32) -> u16 {
    u16::try_from(pixels).unwrap_or(u16::MAX)
}

fn failed(path: &Path, error: EncodingError) -> FilmError {
    let source = match error {
        EncodingError::Io(source) => source,
        other => io::Error::other(other.to_string()),
    };
    ExportError::io("write", path)(source).into()
}
