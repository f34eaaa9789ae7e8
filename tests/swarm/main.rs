//! Swarm files, formations and flights.

mod bridge;
mod faults;
mod files;
mod flights;
mod support;
