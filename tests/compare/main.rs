//! Rule and truth on the same body.

#![cfg(feature = "fem")]

mod beam;
mod edge;
#[cfg(feature = "export")]
#[path = "../common/folders.rs"]
mod folders;
#[cfg(feature = "export")]
#[path = "../common/json.rs"]
mod json;
mod measured;
#[cfg(feature = "export")]
mod outputs;
#[path = "../common/reference.rs"]
mod reference;
mod refusals;
#[path = "../common/samples.rs"]
mod samples;
#[path = "../common/scenes.rs"]
mod scenes;
mod support;
mod table;
mod truth;
