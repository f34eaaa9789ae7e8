//! A body or a swarm under the reader's hands: the engine in this process, the view in a browser on the same computer.
//!
//! A [`session::Session`] steps a body ([`body`]) or flies a swarm ([`swarm`]), does what viewers ask ([`command`]) and
//! keeps it (`history`), so that it can be undone, and saved as a file that replays it to the bit. [`conductor`] runs it
//! at the speed that is asked for and shows each viewer the latest state ([`state`]); [`server`] lets viewers in and sends
//! them the page of a report with live data.
//!
//! A [`monitor::Monitor`] in its place shows a swarm that another loop flies, as `flockform node --live` does.
//!
//! A viewer shows the token of the address; what it sends is bounded in size and number, and checked as the file is.

pub mod body;
pub mod command;
pub mod conductor;
mod history;
pub mod monitor;
mod request;
pub mod server;
pub mod session;
pub mod state;
pub mod swarm;
mod viewer;
