//! The program itself, a place to run it in, and what it wrote.

pub use crate::command::{command, flockform, text};
pub use crate::folders::{files, names_in, temporary};
pub use crate::json::{json, json_in};
pub use crate::signals::signal;
pub use crate::waits::within;
