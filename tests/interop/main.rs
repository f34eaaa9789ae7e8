//! Real peers: Cyclone DDS from PyPI and Fast DDS from Debian, as other processes on loopback.
//!
//! They need Python 3.10 or newer with that package, and nothing of ROS 2:
//!
//! ```text
//! python3 -m venv venv && venv/bin/pip install cyclonedds
//! FLOCKFORM_PYTHON=venv/bin/python cargo test --test interop -- --ignored --test-threads=1
//! ```
//!
//! `ghosts.rs`, `first_calls.rs` and `large_replies.rs` need g++ and Debian's `libfastrtps-dev`.
//!
//! `edge.rs` puts the edge alone against `peer.py`; the others put `flockform node`, as it is installed, between
//! robots (`robots.py`) and somebody who watches it and calls its services (`watch.py`). Cyclone DDS speaks here
//! as rmw_cyclonedds_cpp does: requests carry its 16 byte header. Its Python package cannot put a request's
//! identity beside the payload, so the enhanced mapping is tested in `ros_edge`, with ros2-client.

#![cfg(feature = "cli")]

mod edge;
mod endpoints;
mod fastdds;
mod faults;
mod first_calls;
mod flight;
mod ghosts;
mod large_replies;
mod load;
mod own_network;
#[path = "../common/running.rs"]
mod running;
mod services;
#[path = "../common/signals.rs"]
mod signals;
mod support;
#[path = "../common/swarms.rs"]
mod swarms;
mod two_hosts;
#[path = "../common/waits.rs"]
mod waits;
mod warnings;
