//! Rule and truth on the same body.

mod beam;
mod measured;
#[cfg(feature = "export")]
mod outputs;
mod refusals;
mod support;
mod table;
mod truth;
