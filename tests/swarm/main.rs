//! Swarm files, formations and flights.

#![cfg(all(feature = "export", feature = "swarm"))]

mod alone;
mod bridge;
mod detours;
mod faults;
mod files;
mod flights;
#[path = "../common/folders.rs"]
mod folders;
mod late;
mod liars;
mod ranges;
#[path = "../common/scenes.rs"]
mod scenes;
mod support;
#[path = "../common/swarms.rs"]
mod swarms;
