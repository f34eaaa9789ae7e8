//! JSON that the program wrote.

#![allow(dead_code, reason = "each test program uses the part that it needs")]

use std::path::Path;

use serde_json::Value;

/// The value that a text holds.
pub fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}:\n{text}"))
}

/// The value that a file holds.
pub fn json_in(path: &Path) -> Value {
    json(&std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}
