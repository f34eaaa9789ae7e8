//! The continuum host: a scene is planned, stepped, watched.
//!
//! [`plan::Plan`] lays the scene out as arrays and index lists and says what it makes the program
//! model; [`engine::Engine`] steps them; [`run::run`] is the loop around it; a recorder, a progress
//! bar or an interrupt observes the body through a closure that it calls.
//! [`engine::state`] takes an engine out on its way and puts it back, for checkpoints.
//! [`layout`] is the body before any particle moves; [`equilibrium`] goes straight to rest instead of stepping.

mod active_share;
pub mod bulk_response;
mod damping;
pub mod deviation;
pub mod engine;
pub mod equilibrium;
pub mod forces;
pub mod free_edge;
pub mod layout;
pub mod mechanics;
pub mod movement;
pub mod path;
pub mod places;
pub mod plan;
pub mod record;
pub mod report;
pub mod run;
pub(crate) mod serde_impls;
mod weights;
