//! Why there is no equilibrium to be had.

use super::Solver;

/// Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Forces or held displacements are not as many as the particles.
    #[error("{forces} forces and {held} held displacements do not fit a body of {particles} particles")]
    Shapes {
        /// Forces that were given.
        forces: usize,
        /// Held displacements that were given.
        held: usize,
        /// Particles of the operator.
        particles: usize,
    },
    /// A force, a held displacement or a result of the solve is not finite.
    #[error("the {what} of particle {particle} is not finite")]
    NotFinite {
        /// Its name in messages.
        what: &'static str,
        /// Id of the particle.
        particle: usize,
    },
    /// The tolerance does not lie between 0 and 1.
    #[error("the tolerance must lie between 0 and 1, but it is {tolerance}")]
    Tolerance {
        /// The value asked for \[1\].
        tolerance: f64,
    },
    /// The tolerance is finer than single precision.
    #[error(
        "single precision reaches a relative residual of {floor:e} at best, but {tolerance:e} is asked for"
    )]
    SinglePrecision {
        /// The value asked for \[1\].
        tolerance: f64,
        /// Least tolerance that single precision is asked for \[1\].
        floor: f64,
    },
    /// Single precision was asked of a solver that computes in double precision only.
    #[error("{solver} computes in double precision only")]
    DoubleOnly {
        /// Which one was to be used.
        solver: Solver,
    },
    /// Every particle is held.
    #[error("no particle follows: there is nothing to solve for")]
    NothingFollows,
    /// A follower is joined to no held particle by any chain of neighbours.
    #[error("particle {particle} is connected to no held particle: nothing determines where it rests")]
    Adrift {
        /// Id of the follower.
        particle: usize,
    },
    /// A follower's own stiffness cannot be inverted.
    #[error("nothing holds particle {particle} back: its own stiffness is singular or not positive")]
    Loose {
        /// Id of the follower.
        particle: usize,
    },
    /// The solver needs a symmetric operator, and this one is not.
    #[error(
        "{solver} needs neighbours that feel each other alike, but particles {first} and {second} do not; gauss-seidel, jacobi and direct do not ask for it"
    )]
    NotSymmetric {
        /// Which one was to be used.
        solver: Solver,
        /// Id of a particle that is felt by the second otherwise than it feels it.
        first: usize,
        /// Id of the second particle.
        second: usize,
    },
    /// The operator is not positive definite.
    #[error(
        "the body is not stable, or its stiffnesses are further apart than the digits of a double: {solver} found a displacement that costs no energy or gains some (iteration {iteration})"
    )]
    NotPositive {
        /// The solver that noticed.
        solver: Solver,
        /// Iteration in which it did; 0 before the first.
        iteration: usize,
    },
    /// The residual grew to 1e12 times the first, or ceased to be a number.
    #[error("{solver} diverged: the residual had grown to {residual:e} after {iterations} iterations")]
    Diverged {
        /// Which one was to be used.
        solver: Solver,
        /// Iterations made.
        iterations: usize,
        /// Residual after them, relative to the first \[1\].
        residual: f64,
    },
    /// The direct solver's factorisation broke down.
    #[error("the factorisation of {unknowns} unknowns failed: {reason}")]
    Factorisation {
        /// Unknowns of the system.
        unknowns: usize,
        /// The error of the library.
        reason: String,
    },
    /// The request's [`Interrupt`](crate::solve::interrupt::Interrupt) was raised.
    #[error("interrupted")]
    Interrupted,
}
