//! Bodies and swarms under viewers' hands: what was done is replayed to the bit, and strangers are refused. Flying swarms in
//! the pages of their nodes.
//!
//! The tests in a browser need what those of reports need: see tests/browser/main.rs.

#![cfg(feature = "live")]

mod bodies;
mod browser;
#[cfg(feature = "cli")]
mod commands;
mod designs;
#[path = "../common/folders.rs"]
mod folders;
#[cfg(feature = "cli")]
mod node;
#[cfg(feature = "cli")]
mod pages;
#[cfg(feature = "cli")]
mod recorded;
#[cfg(feature = "cli")]
#[path = "../common/running.rs"]
mod running;
mod served;
#[cfg(feature = "cli")]
#[path = "../common/signals.rs"]
mod signals;
mod strangers;
mod swarms;
#[path = "../common/waits.rs"]
mod waits;
