//! Why there is no equilibrium to be had.

use super::Solver;

/// Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    #[error("{forces} forces and {held} held displacements do not fit a body of {particles} particles")]
    Shapes { forces: usize, held: usize, particles: usize },
    #[error("the {what} of particle {particle} is not finite")]
    NotFinite { what: &'static str, particle: usize },
    #[error("the tolerance must lie between 0 and 1, but it is {tolerance}")]
    Tolerance { tolerance: f64 },
    #[error(
        "single precision reaches a relative residual of {floor:e} at best, but {tolerance:e} is asked for"
    )]
    SinglePrecision { tolerance: f64, floor: f64 },
    #[error("{solver} computes in double precision only")]
    DoubleOnly { solver: Solver },
    #[error("no particle follows: there is nothing to solve for")]
    NothingFollows,
    #[error("particle {particle} is connected to no held particle: nothing determines where it rests")]
    Adrift { particle: usize },
    #[error("nothing holds particle {particle} back: its own stiffness is singular or not positive")]
    Loose { particle: usize },
    #[error(
        "{solver} needs neighbours that feel each other alike, but particles {first} and {second} do not; gauss-seidel, jacobi and direct do not ask for it"
    )]
    NotSymmetric { solver: Solver, first: usize, second: usize },
    #[error(
        "the body is not stable, or its stiffnesses are further apart than the digits of a double: {solver} found a displacement that costs no energy or gains some (iteration {iteration})"
    )]
    NotPositive { solver: Solver, iteration: usize },
    #[error("{solver} diverged: the residual had grown to {residual:e} after {iterations} iterations")]
    Diverged { solver: Solver, iterations: usize, residual: f64 },
    #[error("this build has no direct solver: build with the feature `fem`, or take multigrid")]
    NoDirect,
    #[error("the factorisation of {unknowns} unknowns failed: {reason}")]
    Factorisation { unknowns: usize, reason: String },
    #[error("interrupted")]
    Interrupted,
}
