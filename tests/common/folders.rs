//! Temporary folders, and the files in a folder.

#![allow(dead_code, reason = "each test program uses the part that it needs")]

use std::path::{Path, PathBuf};

/// An empty folder that is removed with the value.
pub fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Names of the entries of a folder, sorted, hidden ones included.
pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("readable");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Everything below a folder but the folders themselves, hidden files included, links not followed; nothing where
/// there is no folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    entries
        .flat_map(|entry| {
            let entry = entry.expect("readable");
            if entry.file_type().expect("known").is_dir() { files(&entry.path()) } else { vec![entry.path()] }
        })
        .collect()
}
