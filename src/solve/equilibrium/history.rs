//! How near an iteration has come, and whether it should go on.

use super::{Request, SolveError, Solver};
use crate::solve::interrupt::Interrupt;

/// Iterations that any solver may take to find its feet.
const PATIENCE: usize = 1000;

/// The residual before the first iteration, which is 1, and after each.
#[derive(Clone, Debug)]
pub(super) struct History {
    pub residuals: Vec<f64>,
    /// The iteration with the least residual.
    best: usize,
    interrupt: Interrupt,
}

impl History {
    pub fn new(request: &Request) -> Self {
        Self { residuals: vec![1.0], best: 0, interrupt: request.interrupt }
    }

    /// Iterations done.
    pub fn iterations(&self) -> usize {
        self.residuals.len() - 1
    }

    pub fn last(&self) -> f64 {
        self.residuals[self.iterations()]
    }

    /// Takes the residual of another iteration; refuses one that has grown beyond all use, and to go on when
    /// interrupted.
    pub fn push(&mut self, solver: Solver, residual: f64) -> Result<(), SolveError> {
        self.push_agreed(solver, residual, self.interrupt.is_raised())
    }

    /// The same where the ranks have agreed on whether one of them is interrupted.
    pub fn push_agreed(
        &mut self,
        solver: Solver,
        residual: f64,
        is_interrupted: bool,
    ) -> Result<(), SolveError> {
        self.residuals.push(residual);
        let iterations = self.iterations();
        if residual < self.residuals[self.best] {
            self.best = iterations;
        }
        if is_interrupted {
            return Err(SolveError::Interrupted);
        }
        let bounded = residual < 1e12;
        if bounded { Ok(()) } else { Err(SolveError::Diverged { solver, iterations, residual }) }
    }

    /// Whether there is something left to do, iterations to do it in, and progress in the latter half of
    /// them: where rounding has the last word there is none.
    pub fn goes_on(&self, request: &Request) -> bool {
        let iterations = self.iterations();
        self.last() > request.tolerance
            && iterations < request.most_iterations
            && iterations <= 2 * self.best + PATIENCE
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn an_iteration_that_makes_no_progress_ends_and_one_that_creeps_goes_on() {
        let request = Request { tolerance: 1e-12, ..Request::default() };
        let mut history = History::new(&request);
        for n in 1..5000 {
            history.push(Solver::Jacobi, 1.0 / f64::from(n + 1)).expect("bounded");
        }
        assert!(history.goes_on(&request));
        for n in 0..7000 {
            history.push(Solver::Jacobi, 1e-3 + f64::from(n % 7)).expect("bounded");
        }
        assert!(!history.goes_on(&request));
        assert!(history.push(Solver::Jacobi, f64::NAN).is_err());
    }

    #[test]
    fn an_interrupt_ends_the_next_iteration() {
        static FLAG: AtomicBool = AtomicBool::new(false);
        let request = Request { interrupt: Interrupt::new(&FLAG), ..Request::default() };
        let mut history = History::new(&request);
        assert_eq!(history.push(Solver::Jacobi, 0.5), Ok(()));
        FLAG.store(true, Ordering::Relaxed);
        assert_eq!(history.push(Solver::Jacobi, 0.25), Err(SolveError::Interrupted));
    }
}
