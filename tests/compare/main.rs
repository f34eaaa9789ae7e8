//! Rule and truth on the same body.

#![cfg(feature = "fem")]

mod beam;
mod measured;
#[cfg(feature = "export")]
mod outputs;
mod refusals;
mod support;
mod table;
mod truth;
