//! The program itself, and a place to run it in.

use std::path::Path;

pub use crate::command::{command, flockform};
pub use crate::folders::temporary;
pub use crate::json::json;
pub use crate::signals::signal;

/// Runs and expects this exit code; what was said.
pub fn says(code: i32, arguments: &[&str], folder: &Path) -> String {
    let output = flockform(arguments, folder);
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said.into_owned()
}
