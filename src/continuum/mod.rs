//! The continuum host: a scene is planned, stepped, watched.
//!
//! [`plan::Plan`] lays the scene out as arrays and index lists and says what it makes the program
//! model; an [`Engine`](crate::engine::Engine) steps them; [`run::run`] is the loop around it.
//! [`layout`] is the body before any particle moves, [`parts`] that of ranks each of which has a part of it;
//! [`equilibrium`] goes straight to rest instead of stepping.

mod active_share;
mod among;
pub mod builder;
pub mod bulk_response;
pub(crate) mod cuts;
mod damping;
pub mod deviation;
pub mod digest;
pub(crate) mod doubts;
mod edge_stress;
pub mod equilibrium;
mod extrapolation;
pub(crate) mod late;
pub mod layout;
pub mod looks;
pub mod mechanics;
pub mod memory;
pub mod parts;
mod pieces;
pub mod places;
pub mod plan;
pub mod record;
pub mod report;
pub mod run;
pub mod shares;
mod weights;
