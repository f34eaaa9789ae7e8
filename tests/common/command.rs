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

/// What a run says that succeeds.
pub fn done(arguments: &[&str], folder: &Path) -> String {
    let output = flockform(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// The same of one that fails: exit code 1.
pub fn failed(arguments: &[&str], folder: &Path) -> String {
    let output = flockform(arguments, folder);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Expects a refusal: exit code 2 and these words.
pub fn assert_refused(output: &Output, what: &str, words: &[&str]) {
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{what}: {said}");
    for word in words {
        assert!(said.contains(word), "{what} does not say `{word}`:\n{said}");
    }
}

/// Runs and expects a refusal.
pub fn refused_in(arguments: &[&str], folder: &Path, words: &[&str]) {
    assert_refused(&flockform(arguments, folder), &arguments.join(" "), words);
}
