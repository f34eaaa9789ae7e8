//! The program itself, run in a folder.

use std::path::Path;
use std::process::{Command, Output};

pub use crate::signals::signal;

pub fn flockform(arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
    command.args(arguments).current_dir(folder).env_remove("RUST_LOG").output().expect("the program starts")
}

/// Runs and expects this exit code; what was said.
pub fn says(code: i32, arguments: &[&str], folder: &Path) -> String {
    let output = flockform(arguments, folder);
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said.into_owned()
}

pub fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}
