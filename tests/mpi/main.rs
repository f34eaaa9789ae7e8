//! The program under `mpirun`: the files of a run are those of a run alone, whatever happens on the way.
//!
//! Needs the launcher of the MPI that the program is built with, and a build with the feature `mpi`. The launcher is `mpirun`, or
//! what the variable `FLOCKFORM_MPIRUN` names.

#![cfg(all(feature = "cli", feature = "mpi"))]

#[path = "../common/command.rs"]
mod command;
#[path = "../common/folders.rs"]
mod folders;
#[path = "../common/json.rs"]
mod json;
#[path = "../common/process.rs"]
mod process;
#[path = "../common/running.rs"]
#[allow(dead_code, reason = "a launcher is not asked to end")]
mod running;
#[path = "../common/signals.rs"]
mod signals;
#[path = "../common/waits.rs"]
mod waits;

mod faults;
mod parts;
mod refusals;
mod runs;
mod support;
