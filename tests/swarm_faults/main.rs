//! What can go wrong between robots, row by row: poses that are wrong, late, lost or lies, and what becomes
//! of the swarm within how many periods.

#![cfg(feature = "swarm")]

mod delay;
mod liars;
mod loss;
mod poses;
mod support;
