//! Thresholds found by running the body: it is disturbed, released, and either grows or comes back.

use serde::Serialize;

use super::subject::{Parameter, Subject};
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::solve::spectrum::scatter;

/// How far runs go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Most steps of one run.
    pub most_steps: usize,
    /// Most steps times particles of one run: large bodies get fewer steps.
    pub most_moves: usize,
    /// Runs and spectra over the whole range of each parameter, for the figure.
    pub samples: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Self { most_steps: 40_000, most_moves: 20_000_000, samples: 25 }
    }
}

impl Effort {
    /// Enough to see that the study works.
    pub fn quick() -> Self {
        Self { most_steps: 10_000, most_moves: 3_000_000, samples: 9 }
    }

    /// Most steps of one run of so many particles.
    pub fn steps(&self, particles: usize) -> usize {
        self.most_steps.min(self.most_moves / particles.max(1)).max(8 * LOOK)
    }
}

/// The growth of a disturbance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Growth {
    /// Value of the parameter.
    pub value: f64,
    /// Factor by which the followers' displacements, from where they are undisturbed, grew per step over the last part of the run \[1\].
    pub per_step: f64,
    /// Steps of the run.
    pub steps: usize,
    /// Whether the factor had come to rest: one mode was left.
    pub settled: bool,
}

/// The value at which growth begins.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Middle of the last bracket.
    pub value: f64,
    /// Half of the last bracket.
    pub within: f64,
    /// Whether the runs at both ends of the last bracket had settled; where they had not, the body is too
    /// slow for so few steps.
    pub settled: bool,
    /// Every run on the way.
    pub runs: Vec<Growth>,
}

/// Displacements that have grown or shrunk by this are not followed further: the rest would be infinite, or
/// rounding of the positions.
const FAR: f64 = 1e9;

/// Steps between two checks whether the factor has settled: even, since a lattice whose sites are
/// two-coloured may swap them at every step.
const LOOK: usize = 64;

/// Disturbs the body with this value of the parameter, lets go and watches.
pub fn growth(subject: &Subject, parameter: Parameter, value: f64, most_steps: usize) -> Growth {
    let subject = subject.with(parameter, value);
    let mut engine = subject.engine();
    let follows = |i: usize| engine.roles()[i] == Role::Follower;
    let spacing = subject.spacing();
    let push = |k: usize| if follows(k / 2) { 0.25 * spacing * scatter(k as u64) } else { 0.0 };
    let disturbed: Vectors = (0..subject.particles()).map(|i| [push(2 * i), push(2 * i + 1)]).collect();
    engine.place_at_rest(0, &disturbed);
    // A body of which the reference is not a state of rest goes where it comes to rest, disturbed or not.
    let mut undisturbed = Some(subject.engine()).filter(|_| {
        let mut engine = subject.engine();
        engine.advance();
        *engine.present() != *engine.body().reference
    });
    let mut sizes = vec![size(engine.present(), &engine.body().reference, spacing)];
    let mut settled = false;
    while sizes.len() <= most_steps && !settled {
        engine.advance();
        let still = undisturbed.as_mut().map_or(&*engine.body().reference, |undisturbed| {
            undisturbed.advance();
            undisturbed.present()
        });
        let now = size(engine.present(), still, spacing);
        sizes.push(now);
        let gone = !(now < FAR * sizes[0] && now > sizes[0] / FAR);
        // A mode that grows may begin small: what shrinks must have shrunk, or have had the time.
        let decided = now < 1e-3 * sizes[0] || now > 1e3 * sizes[0] || 4 * sizes.len() > most_steps;
        settled = gone || decided && sizes.len() % LOOK == 1 && is_settled(&sizes);
    }
    let steps = sizes.len() - 1;
    Growth { value, per_step: factor(&sizes, steps, part(steps)), steps, settled }
}

/// Root of the mean square displacement from other places over the spacing.
fn size(present: &Vectors, reference: &Vectors, spacing: f64) -> f64 {
    let apart = |(p, r): ([f64; 2], [f64; 2])| {
        let [x, y] = [(p[0] - r[0]) / spacing, (p[1] - r[1]) / spacing];
        x * x + y * y
    };
    (present.iter().zip(reference.iter()).map(apart).sum::<f64>() / present.len() as f64).sqrt()
}

/// The last part of a run, an even number of steps where there are two.
fn part(steps: usize) -> usize {
    (steps / 4).next_multiple_of(2).min(steps).max(1)
}

/// Mean factor per step over the `steps` before the one numbered `end`.
fn factor(sizes: &[f64], end: usize, steps: usize) -> f64 {
    let (before, after) = (sizes[end - steps], sizes[end]);
    if before == 0.0 || after == 0.0 {
        return 0.0;
    }
    ((after.ln() - before.ln()) / steps as f64).exp()
}

/// Whether the factor of the last part of the run is that of the part before it, as far from 1 as it is.
fn is_settled(sizes: &[f64]) -> bool {
    let end = sizes.len() - 1;
    if end < 4 * LOOK {
        return false;
    }
    let part = part(end);
    let [last, before] = [factor(sizes, end, part), factor(sizes, end - part, part)];
    (last - before).abs() <= 0.02 * (last - 1.0).abs()
}

/// Two values between which `f` first is positive, with what it is there, in strides that double from `inside` on; `None`
/// where it is positive there already, or still is not after thousands of strides.
pub(super) fn bracket(
    mut f: impl FnMut(f64) -> f64,
    (inside, toward): (f64, f64),
) -> Option<[(f64, f64); 2]> {
    let (mut low, mut stride) = ((inside, f(inside)), toward);
    if low.1 > 0.0 {
        return None;
    }
    while stride.abs() <= 4096.0 * toward.abs() {
        let next = low.0 + stride;
        let next = (next, f(next));
        if next.1 > 0.0 {
            return Some([low, next]);
        }
        (low, stride) = (next, 2.0 * stride);
    }
    None
}

/// The value at which growth begins, to `within`, between one at which the body comes back and one beyond it. `from` is
/// the first value, and the direction to look in with the first stride; `None` where nothing grows for thousands of
/// strides. `progress` is called with each value before its run.
pub fn find(
    subject: &Subject,
    parameter: Parameter,
    from: (f64, f64),
    (within, most_steps): (f64, usize),
    progress: &mut dyn FnMut(f64),
) -> Option<Found> {
    let mut runs = Vec::new();
    let mut excess = |value: f64| {
        progress(value);
        let run = growth(subject, parameter, value, most_steps);
        runs.push(run);
        run.per_step - 1.0
    };
    let [mut low, mut high] = bracket(&mut excess, from)?.map(|(value, _)| value);
    while (high - low).abs() > 2.0 * within {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high {
            break;
        }
        *if excess(middle) > 0.0 { &mut high } else { &mut low } = middle;
    }
    let settled = [low, high].iter().all(|end| runs.iter().any(|run| run.value == *end && run.settled));
    Some(Found { value: 0.5 * (low + high), within: 0.5 * (high - low).abs(), settled, runs })
}
