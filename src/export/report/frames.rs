//! The frames of an animation, kept during a run of unknown length.
//!
//! Frames are kept at an interval that doubles whenever there are too many: every other one is then let go,
//! so memory is bounded and the kept ones are evenly spaced.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::quantized_channel::QuantizedChannel;

/// Frames that a report keeps at most: about as many as a slider of a page can address.
pub const MOST_FRAMES: usize = 512;
/// Memory for frames \[byte\]; bodies of millions of particles get fewer frames.
const MOST_BYTES: usize = 400 << 20;

/// A quantity that frames hold for every particle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Channel {
    pub name: &'static str,
    /// Of a code, 2 to 24.
    pub bits: u32,
}

/// One moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Number of the step or period.
    pub step: usize,
    /// By channel.
    pub tracks: Vec<QuantizedChannel>,
}

impl Frame {
    /// Lets go of all values.
    pub fn clear(&mut self) {
        self.tracks.iter_mut().for_each(|track| *track = QuantizedChannel::of(&[], track.bits, None));
    }
}

#[derive(Clone, Debug)]
pub struct Frames {
    pub channels: Vec<Channel>,
    pub count: usize,
    pub kept: Vec<Frame>,
    /// A frame of every so many steps is kept.
    pub interval: usize,
    most: usize,
}

/// Bytes of a frame \[byte\].
fn bytes_of(channels: &[Channel], count: usize) -> usize {
    count * channels.iter().map(|channel| QuantizedChannel::bytes(channel.bits)).sum::<usize>()
}

impl Frames {
    /// For `count` particles.
    pub fn new(count: usize, channels: Vec<Channel>) -> Self {
        let most = (MOST_BYTES / bytes_of(&channels, count).max(1)).clamp(4, MOST_FRAMES);
        Self { channels, count, kept: Vec::new(), interval: 1, most }
    }

    /// Frames that are kept of so many steps at their most, and at the end.
    pub fn of_steps(&self, steps: usize) -> [usize; 2] {
        let mut interval = 1;
        while steps / interval >= self.most {
            interval *= 2;
        }
        [self.most.min(steps.saturating_add(1)), steps / interval + 1]
    }

    /// Bytes of one frame \[byte\].
    pub fn bytes_of_one(&self) -> usize {
        bytes_of(&self.channels, self.count)
    }

    /// Whether the frame of this step is to be kept.
    pub fn wants(&self, step: usize) -> bool {
        step.is_multiple_of(self.interval)
    }

    /// The next step after `step` whose frame is to be kept.
    pub fn next(&self, step: usize) -> usize {
        (step / self.interval + 1) * self.interval
    }

    /// Keeps the values of every channel, by its number, shape \[count\], of a step later than those before.
    pub fn keep<'a>(&mut self, step: usize, values: impl FnMut(usize, &Channel) -> Cow<'a, [f64]>) {
        if self.kept.len() >= self.most {
            self.interval *= 2;
            self.thin();
        }
        if self.wants(step) {
            self.push(step, values);
        }
    }

    /// Keeps the last frame, whatever its step.
    pub fn keep_last<'a>(&mut self, step: usize, values: impl FnMut(usize, &Channel) -> Cow<'a, [f64]>) {
        self.kept.retain(|frame| frame.step < step);
        self.push(step, values);
    }

    /// Lets go of all but every `interval`th step.
    fn thin(&mut self) {
        let interval = self.interval;
        self.kept.retain(|frame| frame.step.is_multiple_of(interval));
    }

    /// Lets go of half the frames, the last one excepted.
    pub fn halve(&mut self) {
        self.interval *= 2;
        let last = self.kept.pop();
        self.thin();
        self.kept.extend(last);
    }

    fn push<'a>(&mut self, step: usize, mut values: impl FnMut(usize, &Channel) -> Cow<'a, [f64]>) {
        let before = self.kept.last();
        let track = |(k, channel): (usize, &Channel)| {
            QuantizedChannel::of(&values(k, channel), channel.bits, before.map(|frame| &frame.tracks[k]))
        };
        let tracks = self.channels.iter().enumerate().map(track).collect();
        self.kept.push(Frame { step, tracks });
    }

    /// Whether frames are of these channels: those of another program may not be.
    pub fn are_of_these(&self, frames: &[Frame]) -> bool {
        let bits = || self.channels.iter().map(|channel| channel.bits);
        frames.iter().all(|frame| frame.tracks.iter().map(|track| track.bits).eq(bits()))
    }

    /// Goes on from frames that were kept at an interval before.
    pub fn resume(&mut self, kept: Vec<Frame>, interval: usize) {
        (self.kept, self.interval) = (kept, interval);
    }

    /// Values of a channel in a frame, where it is kept, shape \[count\].
    pub fn values(&self, frame: usize, name: &str) -> Option<Vec<f64>> {
        let channel = self.channels.iter().position(|channel| channel.name == name)?;
        Some(self.kept[frame].tracks[channel].values())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_any_length_leaves_evenly_spaced_frames_and_never_more_than_the_most() {
        for steps in [0, 3, 510, 511, 512, 513, 2_000, 12_345] {
            let mut frames = Frames::new(1, vec![Channel { name: "dx", bits: 16 }]);
            for step in 0..=steps {
                if frames.wants(step) {
                    frames.keep(step, |_, _| vec![step as f64].into());
                }
                assert!(frames.kept.len() <= MOST_FRAMES);
            }
            frames.keep_last(steps, |_, _| vec![steps as f64].into());
            let kept: Vec<usize> = frames.kept.iter().map(|frame| frame.step).collect();
            let (last, even) = kept.split_last().expect("kept");
            assert_eq!(*last, steps);
            assert!(even.iter().enumerate().all(|(k, &step)| step == k * frames.interval), "{kept:?}");
            assert!(kept.len() > MOST_FRAMES / 2 || frames.interval == 1, "{steps}: {}", kept.len());
            let [most, at_end] = frames.of_steps(steps);
            assert!(kept.len().abs_diff(at_end) <= 1 && most >= at_end, "{steps}: {most}, {at_end}");
        }
    }

    #[test]
    fn a_few_frames_are_evenly_spaced_too_and_end_at_the_end() {
        for most in 4..12 {
            let mut frames = Frames::new(1, vec![Channel { name: "dx", bits: 16 }]);
            frames.most = most;
            (0..20).for_each(|step| frames.keep(step, |_, _| vec![step as f64].into()));
            frames.keep_last(20, |_, _| vec![20.0].into());
            let kept: Vec<usize> = frames.kept.iter().map(|frame| frame.step).collect();
            let (last, even) = kept.split_last().expect("kept");
            assert!(*last == 20 && 2 * even.len() >= most && even.len() <= most, "{most}: {kept:?}");
            assert!(
                even.iter().enumerate().all(|(k, &step)| step == k * frames.interval),
                "{most}: {kept:?}"
            );
        }
    }

    #[test]
    fn larger_bodies_get_fewer_frames_instead_of_more_memory() {
        let frames = Frames::new(10_000_000, vec![Channel { name: "dx", bits: 16 }; 2]);
        assert_eq!(frames.most, 10);
    }
}
