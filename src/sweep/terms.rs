//! The terms that complete a mean while it is in the registers: the Poisson term, feedback, damping.
//!
//! The same sums and products as [`Rule::target`](crate::flock::rules::Rule::target), in the same order: the bits are
//! the same.

use super::Update;
use crate::flock::lanes::lanes;
use crate::flock::law::Flock;
use crate::flock::real::Real;
use crate::flock::rules::{Feedback, FeedbackReference, Rule};

/// The terms of a rule, and what of them is known beforehand for a body.
#[derive(Clone, Debug)]
pub struct Compiled {
    rule: Rule,
    damping: f64,
    /// The Poisson term's function of the distance from the axis \[1\], shape \[count\].
    distance: Vec<f64>,
}

/// The terms of a rule for the particles of a body.
#[derive(Clone, Copy, Debug)]
pub struct Terms<'a, T> {
    poisson: Option<Contraction<'a, T>>,
    feedback: Option<Overshoot<'a, T>>,
    damping: Option<T>,
}

/// Eq. 2: `k` \[1\], the axis along which it looks, and by particle the reference coordinate along that axis and the function
/// of the distance from the axis.
#[derive(Clone, Copy, Debug)]
struct Contraction<'a, T> {
    k: T,
    along: usize,
    reference: &'a [T],
    distance: &'a [T],
}

/// Eq. 4: the factor, and the reference places; without them the place before the step.
#[derive(Clone, Copy, Debug)]
struct Overshoot<'a, T> {
    factor: T,
    from: Option<[&'a [T]; 2]>,
}

/// Completes means while they are in the registers.
pub(super) trait Finish<T> {
    /// Of `W` particles from number `at` of a part on.
    fn lanes<const W: usize>(&self, at: usize, target: &mut [T]);

    /// Of all particles of a part, one by one.
    #[inline(always)]
    fn all(&self, target: &mut [T]) {
        (0..target.len()).for_each(|at| self.lanes::<1>(at, &mut target[at..=at]));
    }
}

impl<T> Finish<T> for () {
    #[inline(always)]
    fn lanes<const W: usize>(&self, _: usize, _: &mut [T]) {}
}

impl<T, A: Finish<T>, B: Finish<T>> Finish<T> for (A, B) {
    #[inline(always)]
    fn lanes<const W: usize>(&self, at: usize, target: &mut [T]) {
        self.0.lanes::<W>(at, target);
        self.1.lanes::<W>(at, target);
    }
}

/// The factor of feedback, and where it is from.
pub(super) struct Fed<'a, T>(T, &'a [T]);

impl<T: Real> Finish<T> for Fed<'_, T> {
    #[inline(always)]
    fn lanes<const W: usize>(&self, at: usize, target: &mut [T]) {
        let start: [T; W] = lanes(self.1, at);
        for k in 0..W {
            target[k] += self.0 * (target[k] - start[k]);
        }
    }
}

/// `k` of the Poisson term, the means along its axis, the reference there, and the function of the distance from the axis.
pub(super) struct Contracted<'a, T>(T, [&'a [T]; 3]);

impl<T: Real> Finish<T> for Contracted<'_, T> {
    #[inline(always)]
    fn lanes<const W: usize>(&self, at: usize, target: &mut [T]) {
        let Self(k, [along, reference, distance]) = *self;
        let (along, reference): ([T; W], [T; W]) = (lanes(along, at), lanes(reference, at));
        let distance: [T; W] = lanes(distance, at);
        for lane in 0..W {
            target[lane] += k * (along[lane] - reference[lane]) * distance[lane];
        }
    }
}

/// The factor of damping, and where the particles are.
pub(super) struct Damped<'a, T>(T, &'a [T]);

impl<T: Real> Finish<T> for Damped<'_, T> {
    #[inline(always)]
    fn lanes<const W: usize>(&self, at: usize, target: &mut [T]) {
        let here: [T; W] = lanes(self.1, at);
        for k in 0..W {
            target[k] = here[k] + self.0 * (target[k] - here[k]);
        }
    }
}

impl Compiled {
    pub fn new(update: Update, flock: &Flock) -> Self {
        let Flock { rule, reference, .. } = flock;
        let distance = |poisson: &crate::flock::rules::Poisson| {
            reference.iter().map(|place| poisson.distance_from_axis(place)).collect()
        };
        let distance = rule.poisson.as_ref().map(distance).unwrap_or_default();
        Self { rule: *rule, damping: update.damping, distance }
    }

    /// For the body that they were compiled for.
    pub fn of<'a>(&'a self, flock: &'a Flock) -> Terms<'a, f64> {
        let reference = flock.reference.components();
        let contraction = |poisson: crate::flock::rules::Poisson| {
            let along = poisson.axis as usize;
            Contraction { k: poisson.k, along, reference: reference[along], distance: &self.distance }
        };
        let overshoot = |Feedback { factor, reference: from }| Overshoot {
            factor,
            from: (from == FeedbackReference::Initial).then_some(reference),
        };
        Terms {
            poisson: self.rule.poisson.map(contraction),
            feedback: self.rule.feedback.map(overshoot),
            damping: Some(self.damping).filter(|&damping| damping != 1.0),
        }
    }

    /// Whether targets are nothing but means.
    pub fn is_empty(&self) -> bool {
        self.rule.poisson.is_none() && self.rule.feedback.is_none() && self.damping == 1.0
    }

    /// How many times as far from the reference a particle may be taken as any particle was that it sees, if its mean is
    /// taken `mean` times as far \[1\].
    pub fn gain(&self, mean: f64) -> f64 {
        let slope = self.distance.iter().fold(0.0, |most: f64, distance| most.max(distance.abs()));
        let contracted = mean * (1.0 + self.rule.poisson.map_or(0.0, |poisson| poisson.k.abs() * slope));
        let overshot = match self.rule.feedback {
            None => contracted,
            Some(Feedback { factor, reference: FeedbackReference::Initial }) => {
                (1.0 + factor).abs() * contracted
            }
            Some(Feedback { factor, .. }) => (1.0 + factor).abs() * contracted + factor.abs(),
        };
        match self.damping {
            1.0 => overshot,
            damping => (1.0 - damping).abs() + damping.abs() * overshot,
        }
    }
}

impl<T: Real> Terms<'_, T> {
    #[cfg(any(test, feature = "bench"))]
    pub const NONE: Self = Self { poisson: None, feedback: None, damping: None };

    pub fn is_empty(&self) -> bool {
        self.poisson.is_none() && !self.overshoots()
    }

    /// The axis whose targets the other's are made with, which must be nothing but means then.
    pub(crate) fn couples_along(&self) -> Option<usize> {
        self.poisson.map(|poisson| poisson.along)
    }

    pub(crate) fn is_fed(&self) -> bool {
        self.feedback.is_some()
    }

    pub(crate) fn is_damped(&self) -> bool {
        self.damping.is_some()
    }

    /// Whether there is feedback or damping.
    pub fn overshoots(&self) -> bool {
        self.feedback.is_some() || self.damping.is_some()
    }

    /// Adds the Poisson term to the means of the particles from number `from` on, across its axis; `along` are the means
    /// along it.
    #[inline(always)]
    pub(crate) fn contract(&self, from: usize, along: &[T], target: &mut [T]) {
        if self.poisson.is_some() {
            self.contraction(from, &along[..target.len()]).all(target);
        }
    }

    /// Feedback of the particles from number `from` on along an axis, which are `here` now; without any, a factor of zero.
    #[inline(always)]
    pub(super) fn feedback<'b>(&'b self, axis: usize, from: usize, here: &'b [T]) -> Fed<'b, T> {
        match self.feedback {
            None => Fed(T::default(), here),
            Some(Overshoot { factor, from: None }) => Fed(factor, here),
            Some(Overshoot { factor, from: Some(start) }) => Fed(factor, &start[axis][from..][..here.len()]),
        }
    }

    /// The Poisson term of the particles from number `from` on, whose means along its axis are given.
    #[inline(always)]
    pub(super) fn contraction<'b>(&'b self, from: usize, along: &'b [T]) -> Contracted<'b, T> {
        let of = |all: &'b [T]| &all[from..][..along.len()];
        match &self.poisson {
            None => Contracted(T::default(), [along; 3]),
            Some(Contraction { k, reference, distance, .. }) => {
                Contracted(*k, [along, of(reference), of(distance)])
            }
        }
    }

    /// Damping of particles, which are `here` now.
    #[inline(always)]
    pub(super) fn damping<'b>(&self, here: &'b [T]) -> Damped<'b, T> {
        Damped(self.damping.unwrap_or(T::of(1.0)), here)
    }

    /// Feedback and damping of the particles from number `from` on along an axis, which are `here` now.
    #[inline(always)]
    pub fn overshoot(&self, axis: usize, from: usize, here: &[T], target: &mut [T]) {
        let here = &here[..target.len()];
        if self.is_fed() {
            self.feedback(axis, from, here).all(target);
        }
        if self.is_damped() {
            self.damping(here).all(target);
        }
    }
}
