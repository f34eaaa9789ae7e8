//! Those that look at a body on its way: recorders, progress, checkpoints, interrupts.

use std::ops::ControlFlow;

use super::Engine;

/// Looks at a body at the steps that it names.
pub trait Observer {
    /// Given a step, the next one that is looked at. The steps in between may be taken several at once, which is
    /// several times as fast for a large body.
    fn next(&mut self, step: usize) -> usize;

    /// Sees the engine before the first step (with an infinite residual), at the steps named by [`Observer::next`] and at
    /// the last one. `residual` is the largest one-step motion over the spacing. Can break the run off.
    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()>;
}

/// Looks after each step.
pub struct EachStep<'a>(pub &'a mut dyn FnMut(&Engine, f64) -> ControlFlow<()>);

impl Observer for EachStep<'_> {
    fn next(&mut self, step: usize) -> usize {
        step + 1
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        (self.0)(engine, residual)
    }
}
