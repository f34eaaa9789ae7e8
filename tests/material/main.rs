//! The material rule on whole bodies.

mod beam;
mod cantilever;
mod locking;
mod patch;
#[path = "../common/reference.rs"]
mod reference;
mod refusals;
#[path = "../common/samples.rs"]
mod samples;
mod support;
#[path = "../common/tractions.rs"]
mod tractions;
