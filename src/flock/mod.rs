//! The core: particles, lattices, neighbourhoods and the flocking rule.
//!
//! Pure computation: no input or output, no clock, no threads of its own, no other room of this
//! crate. A [`body::Body`] is cut from a lattice or given as points; a [`law::Flock`] says which sees which
//! through which rule; its `target` is the function that moves particles and robots alike.
//!
//! Source: R. dell'Erba, "Flocking rules governing swarm robot as tool to describe continuum
//! deformation", 2021, doi 10.1007/978-3-030-53755-5_14 ("the paper" throughout).

pub mod action;
pub mod block;
pub mod body;
pub mod cells_around;
pub mod cloud;
pub mod condition;
pub mod fracture;
pub mod frame;
pub mod grid;
pub mod halo;
pub mod lanes;
pub mod lattice;
pub mod law;
pub mod manoeuvre;
pub mod motion;
pub mod neighbourhood;
pub mod numbering;
pub mod outlay;
pub mod part;
pub mod pseudo_energy;
pub mod real;
pub mod region;
pub mod role;
pub mod rounding;
pub mod rules;
pub(crate) mod splitmix;
pub mod strain;
pub mod vectors;
pub mod window;
