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

macro_rules! guides {
    ($($name:ident)*) => {$(
        #[doc = include_str!(concat!(stringify!($name), ".md"))]
        pub mod $name {}
    )*};
}

guides! {
    scenes materials accuracy fracture swarms live ros2 security shared_memory python performance ranks files
    theory
}
