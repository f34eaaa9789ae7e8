//! Signals, as a user sends them.

#![allow(dead_code, reason = "each test program uses the part that it needs")]

use std::process::Command;

/// Sends a signal by its name, such as `INT`.
pub fn signal(name: &str, process: u32) {
    assert!(is_sent(name, process), "{name} cannot be sent to process {process}");
}

/// The same to a process that may have ended.
pub fn is_sent(name: &str, process: u32) -> bool {
    let sent = Command::new("kill").args(["-s", name, &process.to_string()]).status();
    sent.expect("kill runs").success()
}
