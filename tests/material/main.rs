//! The material rule on whole bodies.

mod beam;
mod cantilever;
mod patch;
mod refusals;
mod support;
