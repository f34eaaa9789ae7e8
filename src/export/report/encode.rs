//! Frames and arrays as compressed text: differences between frames and between particles, bytes of like
//! significance beside each other, deflate, base64.
//!
//! `web/unpack.js` is the way back. All arithmetic is modulo the range of a code, so whatever is predicted, the
//! code comes back.

use std::io::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use super::frames::{Frame, Frames};
use super::quantized_channel::QuantizedChannel;

/// Frames in one piece: the first is written without the one before, so that pieces are compressed in parallel
/// and a page shows the first while it unpacks the others.
pub const GROUP: usize = 16;

/// The value that a code is a difference from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The previous particle.
    Space = 0,
    /// The same particle in the previous frame.
    Time = 1,
    /// The displacement of the previous particle since the previous frame.
    Both = 2,
}

/// Frames as text.
#[derive(Debug)]
pub struct EncodedFrames {
    /// Mode of every track, shape \[frames * channels\].
    pub modes: Vec<u8>,
    /// Base64 of each group.
    pub groups: Vec<String>,
}

impl EncodedFrames {
    pub fn of(frames: &Frames) -> Self {
        let groups: Vec<(Vec<u8>, String)> = frames.kept.par_chunks(GROUP).map(encode_group).collect();
        let (modes, groups): (Vec<_>, Vec<_>) = groups.into_iter().unzip();
        Self { modes: modes.concat(), groups }
    }

    /// \[byte\]
    pub fn size(&self) -> usize {
        self.groups.iter().map(String::len).sum()
    }
}

fn encode_group(group: &[Frame]) -> (Vec<u8>, String) {
    let channels = group.first().map_or(0, |frame| frame.tracks.len());
    let mut modes = Vec::new();
    let mut packer = Packer::new();
    let (mut codes, mut before, mut deltas) =
        (vec![Vec::new(); channels], vec![Vec::new(); channels], Vec::new());
    for (n, frame) in group.iter().enumerate() {
        std::mem::swap(&mut codes, &mut before);
        for (k, track) in frame.tracks.iter().enumerate() {
            track.read(&mut codes[k]);
            let past = (n > 0).then(|| Past { codes: &before[k], track: &group[n - 1].tracks[k] });
            let mode = cheapest(track, &codes[k], past);
            modes.push(mode as u8);
            deltas.clear();
            deltas.extend(differences(track, &codes[k], past, mode));
            packer.put_planes(deltas.iter().copied(), QuantizedChannel::bytes(track.bits));
        }
    }
    (modes, packer.finish())
}

/// The same channel in the frame before.
#[derive(Clone, Copy)]
struct Past<'a> {
    codes: &'a [u32],
    track: &'a QuantizedChannel,
}

fn cheapest(track: &QuantizedChannel, codes: &[u32], past: Option<Past<'_>>) -> Mode {
    // Tracks in different quanta have no difference.
    let Some(past) = past.filter(|past| past.track.exponent == track.exponent) else { return Mode::Space };
    /// Enough to decide which is cheaper; every so many particles, in runs, since neighbours in the list are compared.
    const RUN: usize = 64;
    const RUNS: usize = 64;
    let every = (codes.len() / RUNS).max(RUN);
    let cost = |mode: Mode| -> u64 {
        let run = |start: usize| {
            let end = (start + RUN).min(codes.len());
            let past = Past { codes: &past.codes[start..end], ..past };
            differences(track, &codes[start..end], Some(past), mode).skip(1)
        };
        let all = (0..codes.len()).step_by(every).flat_map(run);
        all.map(|difference| u64::from(32 - difference.leading_zeros())).sum()
    };
    let modes = [Mode::Time, Mode::Both, Mode::Space];
    modes.into_iter().min_by_key(|&mode| cost(mode)).unwrap_or(Mode::Space)
}

/// Small numbers for small differences of either sign, shape \[count\].
fn differences<'a>(
    track: &QuantizedChannel,
    codes: &'a [u32],
    past: Option<Past<'a>>,
    mode: Mode,
) -> impl Iterator<Item = u32> + 'a {
    let bits = track.bits;
    let mask = (1u32 << bits) - 1;
    let past = past.filter(|_| mode != Mode::Space);
    let shift = past.map_or(0, |past| (past.track.base - track.base) as u32 & mask);
    let mut last = 0u32;
    codes.iter().enumerate().map(move |(i, &code)| {
        let then = past.map_or(0, |past| past.codes[i].wrapping_add(shift));
        let moved = code.wrapping_sub(then) & mask;
        let difference = if mode == Mode::Time { moved } else { moved.wrapping_sub(last) & mask };
        last = moved;
        zigzag(difference, bits)
    })
}

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
fn zigzag(difference: u32, bits: u32) -> u32 {
    let mask = (1u32 << bits) - 1;
    let is_negative = difference >> (bits - 1);
    ((difference << 1) & mask) ^ (mask * is_negative)
}

/// Whole numbers as text: each written as the difference from the one `stride` before.
/// They are gone through once for each byte and never kept, since those of a body take more memory than the body.
pub fn integers(values: impl Iterator<Item = u32> + Clone, stride: usize) -> String {
    let mut before = vec![0; stride];
    let differences = values.enumerate().map(move |(i, value)| {
        let signed = value.wrapping_sub(std::mem::replace(&mut before[i % stride], value)) as i32;
        ((signed << 1) ^ (signed >> 31)) as u32
    });
    let mut packer = Packer::new();
    packer.put_planes(differences, 4);
    packer.finish()
}

/// Numbers as text, to the last bit.
pub fn doubles(values: &[f64]) -> String {
    let mut packer = Packer::new();
    for byte in 0..8 {
        packer.put(values.iter().map(|value| value.to_le_bytes()[byte]));
    }
    packer.finish()
}

/// Level of deflate: mostly zeros compress as well at a lower one, in half the time.
const LEVEL: u32 = 4;

/// Bytes that are deflated at once.
const PIECE: usize = 1 << 16;

/// Deflate into memory, then base64.
struct Packer {
    encoder: ZlibEncoder<Vec<u8>>,
    piece: Vec<u8>,
}

impl Packer {
    fn new() -> Self {
        Self {
            encoder: ZlibEncoder::new(Vec::new(), Compression::new(LEVEL)),
            piece: Vec::with_capacity(PIECE),
        }
    }

    fn put(&mut self, mut bytes: impl Iterator<Item = u8>) {
        loop {
            self.piece.clear();
            self.piece.extend(bytes.by_ref().take(PIECE));
            if self.piece.is_empty() {
                return;
            }
            self.encoder.write_all(&self.piece).expect("memory takes everything");
        }
    }

    /// The lowest bytes of all numbers, then the next ones.
    fn put_planes(&mut self, numbers: impl Iterator<Item = u32> + Clone, bytes: usize) {
        for byte in 0..bytes {
            self.put(numbers.clone().map(|number| (number >> (8 * byte)) as u8));
        }
    }

    fn finish(self) -> String {
        STANDARD.encode(self.encoder.finish().expect("memory takes everything"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::report::frames::Channel;

    /// The decoding of `unpack.js`, for one track.
    fn undo(residuals: &[u32], (bits, base): (u32, i64), past: Past<'_>, mode: Mode) -> Vec<u32> {
        let mask = (1u32 << bits) - 1;
        let shift = (past.track.base - base) as u32 & mask;
        let mut last = 0;
        let code = |(i, &z): (usize, &u32)| {
            let difference = (z >> 1) ^ (mask * (z & 1));
            let moved = if mode == Mode::Time { difference } else { difference.wrapping_add(last) & mask };
            last = moved;
            let then = if mode == Mode::Space { 0 } else { past.codes[i].wrapping_add(shift) };
            moved.wrapping_add(then) & mask
        };
        residuals.iter().enumerate().map(code).collect()
    }

    #[test]
    fn codes_come_back_from_every_mode() {
        for bits in [12, 16, 24] {
            let wave =
                |t: f64| (0..500).map(|i| (0.1 * f64::from(i) + t).sin() + 40.0 * t).collect::<Vec<_>>();
            let mut second = wave(0.3);
            second[7] = f64::NAN;
            let first = QuantizedChannel::of(&wave(0.0), bits, None);
            let second = QuantizedChannel::of(&second, bits, Some(&first));
            let mut codes = [Vec::new(), Vec::new()];
            first.read(&mut codes[0]);
            second.read(&mut codes[1]);
            let past = Past { codes: &codes[0], track: &first };
            for mode in [Mode::Space, Mode::Time, Mode::Both] {
                let deltas: Vec<u32> = differences(&second, &codes[1], Some(past), mode).collect();
                assert_eq!(undo(&deltas, (bits, second.base), past, mode), codes[1], "{bits} {mode:?}");
            }
        }
    }

    #[test]
    fn a_body_at_rest_costs_next_to_nothing() {
        let mut frames = Frames::new(10_000, vec![Channel { name: "dx", bits: 16 }; 2]);
        let noise: Vec<f64> =
            (0..10_000_u32).map(|i| f64::from(i.wrapping_mul(2_654_435_761) >> 8)).collect();
        (0..GROUP).for_each(|step| frames.keep(step, |_, _| (&noise).into()));
        let one = EncodedFrames::of(&{
            let mut one = Frames::new(10_000, frames.channels.clone());
            one.keep(0, |_, _| (&noise).into());
            one
        });
        let all = EncodedFrames::of(&frames);
        assert!(all.size() < one.size() + 2_000, "{} for {}", all.size(), one.size());
    }
}
