//! scratch
pub mod beam;
