//! How much of the scene's loads is on the body.

use super::Engine;
use crate::flock::vectors::Vectors;

/// The part of the loads that acts, and the whole of them.
#[derive(Clone, Debug)]
pub(super) struct Load {
    /// Steps over which the loads grow, where they do.
    ramp: Option<usize>,
    factor: f64,
    /// Of each equilibrium so far, where the body is put to rest part by part.
    parts: Vec<f64>,
    /// The whole of each load \[force\], shape \[loads\]\[count\].
    each: Vec<Vectors>,
    /// \[force\], shape \[count\]; only where the factor has been another than 1.
    whole: Option<Vectors>,
}

impl Load {
    pub fn new(ramp: Option<usize>, each: Vec<Vectors>) -> Self {
        Self { ramp, factor: 1.0, parts: Vec::new(), each, whole: None }
    }

    pub fn ramp(&self) -> Option<usize> {
        self.ramp
    }

    /// Part of the loads that is on the body at a step, where they grow \[1\].
    fn ramped(&self, step: usize) -> Option<f64> {
        self.ramp.map(|ramp| (step as f64 / ramp as f64).min(1.0))
    }

    /// Whether more of the loads is to come after this step.
    pub fn is_growing(&self, step: usize) -> bool {
        self.ramp.is_some_and(|ramp| step < ramp)
    }
}

impl Engine {
    /// Part of the scene's loads that is on the body now \[1\].
    pub(crate) fn load_factor(&self) -> f64 {
        self.load.factor
    }

    /// The same at a step that has been taken: a body that has not moved yet bears nothing.
    pub(super) fn load_factor_at(&self, step: usize) -> f64 {
        match step {
            _ if step == self.step && self.has_moved() => self.load.factor,
            0 => 0.0,
            _ => self.load.ramped(step).or(self.load.parts.get(step - 1).copied()).unwrap_or(1.0),
        }
    }

    /// All of the scene's loads \[force\], shape \[count\]; `None` without loads.
    pub(crate) fn whole_load(&self) -> Option<&Vectors> {
        self.load.whole.as_ref().or(self.flock.forces.as_ref())
    }

    /// The whole of each of the scene's loads \[force\], shape \[loads\]\[count\].
    pub(crate) fn each_load(&self) -> &[Vectors] {
        &self.load.each
    }

    /// Puts this part of the scene's loads on the body \[1\].
    pub(crate) fn set_load_factor(&mut self, factor: f64) {
        if factor == self.load.factor {
            return;
        }
        self.load.factor = factor;
        if let Some(forces) = &mut self.flock.forces {
            let whole = self.load.whole.get_or_insert_with(|| forces.clone());
            *forces = scaled(whole, factor);
        }
    }

    /// Puts this part of the loads on a body that rests under it after those before \[1\].
    pub(crate) fn set_load_part(&mut self, part: f64) {
        self.load.parts.push(part);
        self.set_load_factor(part);
    }

    /// Brings the loads to what they are at this step, where they grow.
    pub(super) fn follow_ramp(&mut self) {
        if let Some(factor) = self.load.ramped(self.step) {
            self.set_load_factor(factor);
        }
    }
}

/// Every force times `factor`; all of them to the bit at 1.
pub fn scaled(forces: &Vectors, factor: f64) -> Vectors {
    forces.iter().map(|[x, y]| [factor * x, factor * y]).collect()
}
