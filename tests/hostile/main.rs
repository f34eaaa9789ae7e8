//! What strangers on the network can do to a node, and what is left of it afterwards. All of it on loopback.
//!
//! `cargo test --test hostile` runs what takes seconds; the others take a minute or so each:
//! `cargo test --test hostile -- --ignored --test-threads=1`.

#![cfg(feature = "cli")]

mod commands;
mod disk;
mod environment;
mod liar;
mod log;
mod middleware;
#[path = "../ros_edge/support.rs"]
#[expect(dead_code, reason = "the client of another implementation is all that is needed of it")]
mod peers;
#[path = "../common/process.rs"]
mod process;
#[path = "../common/running.rs"]
mod running;
#[path = "../common/signals.rs"]
mod signals;
#[path = "../common/stranger.rs"]
mod stranger;
mod support;
#[path = "../common/swarms.rs"]
mod swarms;
#[path = "../common/waits.rs"]
mod waits;
