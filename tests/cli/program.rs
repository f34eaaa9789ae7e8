//! The program itself, and a place to run it in.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub use crate::signals::signal;
pub use crate::waits::within;

pub fn flockform(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flockform"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .output()
        .expect("the program starts")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

pub fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Everything below a folder, hidden files included.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    entries
        .flat_map(|entry| {
            let path = entry.expect("readable").path();
            if path.is_dir() { files(&path) } else { vec![path] }
        })
        .collect()
}
