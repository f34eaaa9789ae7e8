//! The edge and the formation's node on loopback: two participants of ours in one process, and ros2-client as the foreign peer.
//!
//! The tests share the participants and take turns: DDS discovery is slow on a busy computer, and each
//! participant costs sockets and threads. Every wait is bounded.

#![cfg(feature = "ros")]

mod commands;
#[cfg(feature = "record")]
mod configuration;
mod formation;
mod graph;
mod interfaces;
mod lifecycle;
mod parameters;
mod robots;
mod services;
mod support;
#[path = "../common/swarms.rs"]
mod swarms;
mod topics;
#[path = "../common/waits.rs"]
mod waits;
