//! The messages of a formation's loop: made from its [`Control`](crate::swarm::control::Control), and applied to it.
//!
//! A live node and a recording of a simulated flight publish the same: both take it from here.

pub mod diagnostics;
pub mod leaders;
pub mod markers;
pub mod pose;
pub mod ranges;
pub mod state;

/// Name of a formation's node unless `__node` says otherwise.
pub const NAME: &str = "flockform";
