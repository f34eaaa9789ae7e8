//! Recordings and frames as other tools read them, and flights replayed from them.
//!
//! Those that need Python 3.10 or newer are ignored unless asked for:
//!
//! ```text
//! python3 -m venv venv && venv/bin/pip install mcap mcap-ros2-support rosbags meshio pyvista
//! FLOCKFORM_PYTHON=venv/bin/python cargo test --test recording -- --ignored
//! ```

#![cfg(feature = "cli")]

#[path = "../common/command.rs"]
mod command;
#[path = "../common/folders.rs"]
mod folders;
#[path = "../common/json.rs"]
mod json;
mod program;
mod read_back;
mod replays;
#[path = "../common/signals.rs"]
mod signals;
