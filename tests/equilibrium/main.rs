//! Equilibrium: every solver finds the same one.

mod agreement;
mod support;
