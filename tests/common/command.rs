//! The program itself, run in a folder.

#![allow(dead_code, reason = "each test program uses the part that it needs")]

use std::path::Path;
use std::process::{Command, Output};

/// The program with arguments, in a folder and away from the log filter of the environment.
pub fn command(arguments: &[&str], folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
    command.args(arguments).current_dir(folder).env_remove("RUST_LOG");
    command
}

/// The same, run to its end.
pub fn flockform(arguments: &[&str], folder: &Path) -> Output {
    command(arguments, folder).output().expect("the program starts")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
