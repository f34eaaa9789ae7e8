//! Bodies and swarms under viewers' hands: what was done is replayed to the bit, and strangers are refused.
//!
//! The tests in a browser need what those of reports need: see tests/browser/main.rs.

#![cfg(feature = "live")]

mod bodies;
mod browser;
#[path = "../common/folders.rs"]
mod folders;
mod served;
mod strangers;
mod swarms;
