//! Equilibrium: every solver finds the same one, multigrid as fast on large bodies as on small ones.

#![cfg(feature = "bench")]

mod agreement;
mod growth;
mod refusals;
mod reports;
mod support;
