//! The program as a person meets it: what it prints, what it writes, and how it refuses.

#![cfg(feature = "cli")]

mod beginnings;
mod cautions;
mod checkpoint;
#[path = "../common/cloud.rs"]
mod cloud;
#[path = "../common/command.rs"]
mod command;
mod compare;
mod documents;
mod faults;
#[path = "../common/folders.rs"]
mod folders;
mod install;
mod interrupt;
mod journal;
#[path = "../common/json.rs"]
mod json;
mod load_steps;
mod material;
mod measured;
#[cfg(target_os = "linux")]
mod memory;
mod points;
#[cfg(target_os = "linux")]
#[path = "../common/process.rs"]
mod process;
mod program;
#[cfg(not(feature = "mpi"))]
mod ranks;
mod refusals;
mod report;
mod run;
#[path = "../common/signals.rs"]
mod signals;
mod stability;
mod swarm;
mod sweep;
#[path = "../common/waits.rs"]
mod waits;
