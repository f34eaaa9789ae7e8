//! The program itself, a place to run it in, and what it wrote.

use std::path::Path;
use std::process::{Child, Stdio};

pub use crate::command::{assert_refused, command, done, failed, flockform, refused_in, text};
pub use crate::folders::{files, names_in, temporary};
pub use crate::json::{json, json_in};
pub use crate::signals::signal;
pub use crate::waits::within;

/// The same in a folder that stays empty.
pub fn refused(arguments: &[&str], words: &[&str]) {
    let folder = temporary();
    refused_in(arguments, folder.path(), words);
    let left = files(folder.path());
    assert!(left.is_empty(), "{arguments:?} left {left:?}");
}

/// A run that goes on beside the test.
pub fn start(arguments: &[&str], folder: &Path) -> Child {
    let mut command = command(arguments, folder);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts")
}

pub fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.as_ref().display()))
}
