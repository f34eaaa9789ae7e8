//! Swarm files, formations and flights.

#![cfg(all(feature = "export", feature = "swarm"))]

mod bridge;
mod faults;
mod files;
mod flights;
mod support;
