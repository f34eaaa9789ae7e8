//! Predicted thresholds: where the spectral radius of the sweep passes 1.
//!
//! Of a sweep without memory whose eigenvalues `mu` (undamped, without feedback) are real and between
//! `low` and `high`, the eigenvalues with damping `w` and feedback `fd` are `1 - w + w (1 + fd) mu`, and the
//! thresholds are formulas ([`closed_form`]). Frames that lag give the sweep a memory; the thresholds are
//! then roots of `rho(A) = 1`, `A` being the sweep itself with the parameter in it. All are found as roots,
//! and those that have a formula are held against it.

use serde::Serialize;

use super::bisection::bracket;
use super::subject::{Parameter, Subject};
use crate::flock::rules::FeedbackReference;
use crate::solve::spectrum::Ends;
use crate::sweep::Order;

named! {
    /// Which end of the stable range.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Side {
        /// Where the range begins.
        Lower => "lower",
        /// Where the range ends.
        Upper => "upper",
    }
}

/// A value of a parameter beyond which the body grows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Predicted {
    /// The value of the parameter.
    pub value: f64,
    /// By formula, where the sweep has no memory and a real spectrum.
    pub closed_form: Option<f64>,
    /// Whether every spectral radius on the way was known to its tolerance.
    pub converged: bool,
}

/// A point of the curve that the radius makes over a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Radius {
    /// The value of the parameter.
    pub value: f64,
    /// Spectral radius of the sweep with it \[1\].
    pub radius: f64,
}

/// The start of the search, its direction and its first stride: for feedback the factor at which a target
/// is the initial position itself, where nothing can grow.
pub fn start(subject: &Subject, parameter: Parameter, side: Side) -> (f64, f64) {
    let toward = if side == Side::Upper { 1.0 } else { -1.0 };
    match (parameter, subject.feedback_reference()) {
        (Parameter::Feedback, FeedbackReference::Initial) => (-1.0, toward),
        // Over-relaxation: stable between standing still and overshooting.
        (Parameter::Feedback, FeedbackReference::Previous) => (-0.75, toward),
        (Parameter::Damping, _) => (0.125, toward),
    }
}

/// The value at which the spectral radius passes 1, from the stable range outwards; `None` where it passes nowhere, or there is no such range.
/// `progress` is called with each value before its radius is computed.
pub fn predict(
    subject: &Subject,
    parameter: Parameter,
    side: Side,
    progress: &mut dyn FnMut(f64),
) -> Option<Predicted> {
    let mut converged = true;
    let mut excess = |value: f64| {
        progress(value);
        let found = subject.with(parameter, value).sweep().radius_from_one();
        converged &= found.converged;
        // Bounded: a sequential sweep can grow by 1e20 a step, and false position would creep away from there.
        let excess = found.radius - 1.0;
        excess / (1.0 + excess.abs())
    };
    let [low, high] = bracket(&mut excess, start(subject, parameter, side))?;
    let value = crossing(&mut excess, low, high);
    Some(Predicted { value, closed_form: closed_form(subject, parameter, side), converged })
}

/// The root between two places of opposite sign, by false position with halving (the Illinois method).
fn crossing(f: &mut dyn FnMut(f64) -> f64, low: (f64, f64), high: (f64, f64)) -> f64 {
    let ((mut a, mut fa), (mut b, mut fb)) = (low, high);
    let mut last = 0;
    for _ in 0..100 {
        let mut c = (a * fb - b * fa) / (fb - fa);
        let mut fc = f(c);
        if fc.is_nan() {
            // No radius is known there.
            c = 0.5 * (a + b);
            fc = f(c);
        }
        if fc.is_nan() {
            return c;
        }
        if fc.abs() <= 1e-11 || (b - a).abs() <= 1e-12 * a.abs().max(b.abs()).max(1.0) {
            return c;
        }
        if fc < 0.0 {
            (a, fa) = (c, fc);
            fb *= if last < 0 { 0.5 } else { 1.0 };
            last = -1;
        } else {
            (b, fb) = (c, fc);
            fa *= if last > 0 { 0.5 } else { 1.0 };
            last = 1;
        }
    }
    0.5 * (a + b)
}

/// The threshold by formula; `None` where the sweep has a memory (a frame that lags), an order, or
/// eigenvalues that are not real.
pub fn closed_form(subject: &Subject, parameter: Parameter, side: Side) -> Option<f64> {
    if subject.has_memory() || subject.order() == Order::Sequential {
        return None;
    }
    let bare = subject.with(Parameter::Feedback, 0.0).with(Parameter::Damping, 1.0);
    let ends = bare.sweep().ends();
    if !(ends.are_real && ends.converged) {
        return None;
    }
    let initial = subject.feedback_reference() == FeedbackReference::Initial;
    let (fd, damping) = (subject.present(Parameter::Feedback), subject.present(Parameter::Damping));
    let stretched = |parameter: f64, mu: f64| (1.0 + parameter) * mu;
    match (parameter, side, initial) {
        (Parameter::Damping, Side::Upper, true) => {
            let (a, b) = (stretched(fd, ends.lowest), stretched(fd, ends.highest));
            (a.max(b) < 1.0).then(|| 2.0 / (1.0 - a.min(b)))
        }
        (Parameter::Damping, Side::Upper, false) => {
            (ends.highest < 1.0 && fd > -1.0).then(|| 2.0 / (1.0 - ends.lowest) / (1.0 + fd))
        }
        (Parameter::Feedback, Side::Upper, false) => {
            (ends.highest < 1.0).then(|| 2.0 / (1.0 - ends.lowest) / damping - 1.0)
        }
        (Parameter::Feedback, Side::Lower, false) => (ends.highest < 1.0).then_some(-1.0),
        (Parameter::Feedback, side, true) => {
            let stretch = stable_stretch(&ends, damping, side)?;
            Some(stretch - 1.0)
        }
        (Parameter::Damping, Side::Lower, _) => None,
    }
}

/// The largest `|s|` on this side with `-1 < 1 - w + w s mu < 1` for all `mu`.
fn stable_stretch(ends: &Ends, damping: f64, side: Side) -> Option<f64> {
    let under = 2.0 / damping - 1.0;
    let sign = if side == Side::Upper { 1.0 } else { -1.0 };
    let (least, most) =
        if side == Side::Upper { (ends.lowest, ends.highest) } else { (-ends.highest, -ends.lowest) };
    let bounds = [(most > 0.0).then(|| 1.0 / most), (least < 0.0).then(|| under / -least)];
    bounds.into_iter().flatten().reduce(f64::min).map(|stretch| sign * stretch)
}

/// The radius over a range of the parameter.
pub fn curve(subject: &Subject, parameter: Parameter, [low, high]: [f64; 2], points: usize) -> Vec<Radius> {
    let at = |k: usize| {
        let value = low + (high - low) * k as f64 / (points.max(2) - 1) as f64;
        Radius { value, radius: subject.with(parameter, value).sweep().radius_from_one().radius }
    };
    (0..points).map(at).collect()
}
