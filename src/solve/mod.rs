//! Spectra of sweeps over the rules, and the solvers for equilibrium.

pub mod affine_weights;
pub(crate) mod arnoldi;
mod balance;
pub mod corotated;
pub mod equilibrium;
pub(crate) mod field;
pub mod interrupt;
pub mod linear;
pub mod operator;
pub(crate) mod order;
pub(crate) mod part;
pub(crate) mod refined;
pub(crate) mod shared;
pub mod spectrum;
pub(crate) mod stopwatch;
mod whole;
