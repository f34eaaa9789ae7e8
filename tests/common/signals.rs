//! Signals, as a user sends them.

use std::process::Command;

/// Sends a signal by its name, such as `INT`.
pub fn signal(name: &str, process: u32) {
    let sent = Command::new("kill").args(["-s", name, &process.to_string()]).status().expect("kill runs");
    assert!(sent.success(), "{name} cannot be sent to process {process}");
}
