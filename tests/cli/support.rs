//! What all of these need: the program, a place to run it in, what it wrote, and bounded waits.

pub use crate::folders::{files, names_in, temporary};
pub use crate::json::{json, json_in};
pub use crate::program::{command, flockform, text};
pub use crate::signals::signal;
pub use crate::waits::within;
