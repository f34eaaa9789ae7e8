//! **flockform**: one set of flocking rules that makes a body deform or a swarm hold a formation.
//!
//! A body is a set of particles. *Leaders* are moved from outside; each *follower* takes a position
//! computed from its neighbours' positions. That function, neighbours in and target position out,
//! is the flocking rule, and it is written once, in [`flock`].
//!
//! The manual is in [`guide`], which lists its parts.
//!
//! The rooms, in the direction data flows:
//!
//! * [`scene`]: a TOML file becomes a validated [`scene::Scene`]; nothing downstream re-checks it.
//! * [`geometry`]: shapes of the plane and their outlines. It imports no other room.
//! * [`flock`]: the core. Lattices, bodies, neighbourhoods, rules, frames, fracture. Pure.
//! * [`sweep`]: the rule compiled for a body, and its steps: the one room with vectors and the schedule of threads.
//! * [`solve`]: spectra of sweeps, and the solvers for equilibrium.
//! * [`material`]: rule weights from Young's modulus and Poisson's ratio, and what material a rule is.
//! * [`ranks`]: processes that share a body, and the messages between them (over MPI with feature `mpi`).
//! * [`engine`]: one step of a body after the other: leaders, roles, bonds, loads; used by continuum and swarm alike.
//! * [`continuum`]: plans a scene, steps it or goes straight to rest, and hands what happens to an observer.
//! * [`study`]: many runs of a scene: rule against finite elements, accuracy against cost, parameter sweeps, stability and its thresholds.
//! * `export` (feature `export`): CSV, JSON, VTK and figures, one file per format.
//! * `fem` (feature `fem`): finite elements, the reference for the rules; it imports no flock.
//! * `swarm` (feature `swarm`): formations of robots: targets by the same rule, made safe; flights of simulated robots.
//! * `messages` (feature `messages`): what robots and formations publish: structs, encoding, names of topics.
//! * `ros` (feature `ros`): the same over ROS 2: arguments, parameters, lifecycle, the node. With the feature `security`
//!   with keys of an enclave (SROS2).
//! * `shm` (feature `shm`): the same over shared memory, without a copy; a running body published to other processes.
//! * `record` (feature `record`): recordings of flights and runs for Foxglove and `ros2 bag`, and their replay.
//! * `live` (feature `live`): a body or a swarm under the reader's hands: a session, and the page that shows it.
//! * `bench` (feature `bench`): how fast sweeps and solvers are, beside what the machine and others can do.
//! * `python` (feature `python`): the Python package; `pip install ./src/python` builds it (guide [`python`](guide::python)).
//!
//! Features add rooms and never choose: what a room computes is the same whatever is built beside it.
//! Without any, the crate builds for a browser too (`wasm32-unknown-unknown`): on one thread, with bundled scenes or
//! scenes from text, and with every measured time zero, as there is no clock.
//!
//! A body in a few lines; [`Builder`] has more:
//!
//! ```
//! use flockform::{Builder, LatticeKind, Side};
//!
//! let outcome = Builder::new(LatticeKind::Square { spacing: 1.0 })
//!     .grid(40, 20)
//!     .clamp(Side::Left)
//!     .lead(Side::Right, [4.0, 0.0], 40)
//!     .run()?;
//! println!("{} steps, now at {:?}", outcome.engine.step(), outcome.engine.present().get(799));
//! # Ok::<(), flockform::SceneError>(())
//! ```

#[macro_use]
mod named;

pub mod continuum;
pub mod engine;
pub mod flock;
pub mod geometry;
pub mod guide;
pub mod material;
pub mod ranks;
pub mod scene;
pub mod solve;
pub mod study;
pub mod sweep;

#[cfg(feature = "bench")]
pub mod bench;
#[cfg(feature = "export")]
pub mod export;
#[cfg(feature = "fem")]
pub mod fem;
#[cfg(feature = "live")]
pub mod live;
#[allow(
    missing_docs,
    reason = "fields are those of the published interface definitions, which say what they mean"
)]
#[cfg(feature = "messages")]
pub mod messages;
#[cfg(feature = "python")]
mod python;
#[cfg(feature = "record")]
pub mod record;
#[cfg(feature = "ros")]
pub mod ros;
#[cfg(feature = "shm")]
pub mod shm;
#[cfg(feature = "swarm")]
pub mod swarm;

pub use continuum::builder::Builder;
pub use continuum::equilibrium::run_to_equilibrium;
pub use continuum::plan::Plan;
pub use continuum::run::{Outcome, run};
pub use engine::Engine;
pub use flock::lattice::LatticeKind;
pub use flock::region::Side;
pub use scene::{Scene, SceneError};

/// The README's Rust code, compiled and run with the other doctests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
