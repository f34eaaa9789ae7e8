//! The outputs of runs and flights: files, the folder that they stand in, films.

#![cfg(feature = "export")]

#[cfg(feature = "cli")]
#[path = "../common/command.rs"]
mod command;
mod files;
#[cfg(feature = "cli")]
mod film;
mod folder;
#[path = "../common/folders.rs"]
mod folders;
#[path = "../common/json.rs"]
mod json;
#[path = "../common/scenes.rs"]
mod scenes;
#[cfg(feature = "cli")]
#[path = "../common/signals.rs"]
mod signals;
