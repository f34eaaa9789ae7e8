//! What every transport promises, kept by each of them: over shared memory and over ROS 2.
//!
//! [`promises`] are written once against the two ends of a transport; each transport's file calls them and adds what
//! it alone can break. Processes that are killed are this test program, started again with a task ([`child`]).

#![cfg(feature = "cli")]

mod child;
#[path = "../common/folders.rs"]
mod folders;
mod killed;
mod leftovers;
mod positions;
mod program;
mod promises;
mod python;
mod ros2;
#[path = "../common/running.rs"]
mod running;
#[path = "../common/scenes.rs"]
mod scenes;
mod shm;
#[path = "../common/signals.rs"]
mod signals;
mod support;
#[path = "../common/swarms.rs"]
mod swarms;
#[path = "../common/waits.rs"]
mod waits;
