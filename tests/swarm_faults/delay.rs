//! Delay: of the neighbours alone it does no harm, of the own state it needs a smaller step.

use std::collections::VecDeque;
use std::f64::consts::PI;

use flockform::flock::neighbourhood::Neighbourhood;
use flockform::flock::vectors::Vectors;

use super::support::{barycentre, error, followers, square, stretched};

/// Keeps the last positions; the oldest comes `delay` steps late.
struct Line {
    past: VecDeque<Vectors>,
}

impl Line {
    fn new(start: &Vectors, delay: usize) -> Self {
        Self { past: vec![start.clone(); delay + 1].into() }
    }

    fn late(&self) -> &Vectors {
        &self.past[0]
    }

    fn push(&mut self, present: &Vectors) {
        self.past.pop_front();
        self.past.push_back(present.clone());
    }
}

#[test]
fn neighbours_seen_twenty_steps_late_lead_to_the_same_place() {
    let (reference, neighbours) = square(Neighbourhood::First { keep: None });
    let flock = barycentre(&reference, neighbours);
    let (start, image) = stretched(&reference);
    for (delay, steps) in [(0, 600), (20, 600 * 21)] {
        let mut line = Line::new(&start, delay);
        let mut present = start.clone();
        for _ in 0..steps {
            followers().for_each(|j| present.set(j, flock.target(j, line.late())));
            line.push(&present);
        }
        assert!(error(&present, &image) < 1e-12 * 20.0, "{} at delay {delay}", error(&present, &image));
    }
}

/// Errors of `x' = x - e L x(k - d)`, own state and neighbours' as late, in the middle and at the end of
/// `steps`; `share` of the largest stable `e`.
fn growth(delay: usize, share: f64, steps: usize) -> (f64, f64) {
    let (reference, neighbours) = square(Neighbourhood::First { keep: None });
    let flock = barycentre(&reference, neighbours);
    let (start, image) = stretched(&reference);
    // L = I - W over the eight by eight followers.
    let largest = 1.0 + (PI / 9.0).cos();
    let gain = share * 2.0 * (PI / (2.0 * (2 * delay + 1) as f64)).sin() / largest;
    let mut line = Line::new(&start, delay);
    let mut present = start;
    // The error swings: the most of it over the last quarter before.
    let (mut middle, mut end) = (0.0f64, 0.0f64);
    for step in 0..steps {
        for j in followers() {
            let (here, seen) = (present.get(j), line.late().get(j));
            let target = flock.target(j, line.late());
            present.set(j, [0, 1].map(|k| here[k] + gain * (target[k] - seen[k])));
        }
        line.push(&present);
        match 4 * step / steps {
            1 => middle = middle.max(error(&present, &image)),
            3 => end = end.max(error(&present, &image)),
            _ => {}
        }
    }
    (middle, end)
}

#[test]
fn the_own_state_may_be_late_up_to_the_gain_that_theory_gives() {
    for (delay, steps) in [(0, 3000), (1, 3000), (2, 3000), (5, 6000), (10, 12_000)] {
        let (middle, end) = growth(delay, 0.99, steps);
        assert!(end < 0.5 * middle, "just below, delay {delay}: {middle} then {end}");
        let (middle, end) = growth(delay, 1.01, steps);
        assert!(end > 2.0 * middle, "just above, delay {delay}: {middle} then {end}");
    }
}
