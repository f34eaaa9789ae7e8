//! Feedback, the paper's Eq. 4: `x_j = b + fd (b - MT_j)`, `b` being the target so far.
//!
//! With `MT` the initial position the displacement obeys d' = (1 + fd) W d, so the body oscillates or
//! grows as soon as |1 + fd| times the spectral radius of the sweep exceeds 1. With `MT` the
//! previous position it is over-relaxation by the factor 1 + fd.

use super::ParticleState;

/// The position `MT` in Eq. 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedbackReference {
    /// The position in the reference configuration (the paper's `MT(j, t0)`).
    Initial,
    /// The position before this step.
    Previous,
}

/// Eq. 4 with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feedback {
    /// Feedback factor `fd` \[1\].
    pub factor: f64,
    /// The meaning of `MT`.
    pub reference: FeedbackReference,
}

impl Feedback {
    /// Whether it ties each particle to its place in the reference configuration, beside what the mean asks for.
    pub fn ties_to_reference(&self) -> bool {
        self.reference == FeedbackReference::Initial && self.factor != 0.0
    }

    /// The factor by which it enlarges each update, as a damping above 1 would \[1\].
    pub fn over_relaxation(&self) -> f64 {
        if self.reference == FeedbackReference::Previous { 1.0 + self.factor } else { 1.0 }
    }

    /// Moves the target past itself.
    pub fn overshoot(&self, own: &ParticleState, target: &mut [f64; 2]) {
        let from = match self.reference {
            FeedbackReference::Initial => own.reference,
            FeedbackReference::Previous => own.present,
        };
        for k in 0..2 {
            target[k] += self.factor * (target[k] - from[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_references_overshoot_from_different_places() {
        let own = ParticleState { present: [1.0, 0.0], reference: [0.0, 0.0], rest: [0.0; 2], load: None };
        let overshoot = |reference| {
            let mut target = [3.0, 0.0];
            Feedback { factor: 0.5, reference }.overshoot(&own, &mut target);
            target[0]
        };
        assert_eq!(overshoot(FeedbackReference::Initial), 4.5);
        assert_eq!(overshoot(FeedbackReference::Previous), 4.0);
    }
}
