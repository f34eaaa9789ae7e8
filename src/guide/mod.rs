//! The manual: how to use the program and the library, subject by subject.
//!
//! | guide | subject |
//! |---|---|
//! | [`scenes`] | the scene file: lattice, body, neighbours, rule, roles, motions; parameter sweeps; the bundled scenes |
//! | [`materials`] | rules that are a material: loads, outlines, load steps, reactions and stresses |
//! | [`accuracy`] | rules against finite elements, what an accuracy costs, when a body grows |
//! | [`fracture`] | bonds that break, cuts, ghosts |
//! | [`swarms`] | formations of robots: the swarm file, simulated flights, faults, recordings |
//! | [`live`] | bodies and swarms in a browser, dragged, cut and changed by hand, and saved |
//! | [`ros2`] | the ROS 2 node: topics, services, parameters, launch files |
//! | [`security`] | command permissions, failures of robots, peers and the middleware |
//! | [`shared_memory`] | the same loop between processes of one computer |
//! | [`python`] | the Python package: runs, bodies, studies, swarms, errors and threads |
//! | [`performance`] | how fast bodies step and settle, and how to measure it |
//! | [`ranks`] | runs shared by several processes over MPI: starting, what is exchanged, what is refused, faults |
//! | [`files`] | output files of a run, the report, checkpoints, exit codes |
//! | [`theory`] | the paper's terms and equations, what they imply, where the paper leaves a choice |
//!
//! Every TOML example is loaded by the tests, every command line is checked against the program, and the Rust
//! examples are doctests.

#[doc = include_str!("scenes.md")]
pub mod scenes {}

#[doc = include_str!("materials.md")]
pub mod materials {}

#[doc = include_str!("accuracy.md")]
pub mod accuracy {}

#[doc = include_str!("fracture.md")]
pub mod fracture {}

#[doc = include_str!("swarms.md")]
pub mod swarms {}

#[doc = include_str!("live.md")]
pub mod live {}

#[doc = include_str!("ros2.md")]
pub mod ros2 {}

#[doc = include_str!("security.md")]
pub mod security {}

#[doc = include_str!("shared_memory.md")]
pub mod shared_memory {}

#[doc = include_str!("python.md")]
pub mod python {}

#[doc = include_str!("performance.md")]
pub mod performance {}

#[doc = include_str!("ranks.md")]
pub mod ranks {}

#[doc = include_str!("files.md")]
pub mod files {}

#[doc = include_str!("theory.md")]
pub mod theory {}
