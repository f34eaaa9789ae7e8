//! The corotated material: elastica, balance of forces and moments, symmetry, energy.

mod balance;
mod elastica;
mod support;
