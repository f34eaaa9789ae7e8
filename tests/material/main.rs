//! The material rule on whole bodies.

mod beam;
mod cantilever;
mod locking;
mod patch;
mod refusals;
mod support;
