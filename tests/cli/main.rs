//! The program as a person meets it: what it prints, what it writes, and how it refuses.

#![cfg(feature = "cli")]

mod beginnings;
mod checkpoint;
mod compare;
mod documents;
mod faults;
mod install;
mod interrupt;
mod material;
mod measured;
mod points;
mod program;
mod report;
mod run;
#[path = "../common/signals.rs"]
mod signals;
mod stability;
mod swarm;
mod sweep;
#[path = "../common/waits.rs"]
mod waits;
