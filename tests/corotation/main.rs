//! The corotated material: elastica, balance of forces and moments, symmetry, energy.

mod back;
mod balance;
mod elastica;
mod snapping;
mod support;
#[path = "../common/tractions.rs"]
mod tractions;
