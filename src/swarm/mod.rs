//! The swarm host: the flocking rule moves robots, safely.
//!
//! [`formation`] holds the members and their targets by the rule; [`control`] is the tick that turns poses into safe
//! targets, by [`watch`] (which poses are believed), [`resilience`] (which neighbours are) and [`safety`] (what is
//! safe). [`flight`] closes the loop with simulated [`robots`] behind [`channel`]s; over a [`transport`] it is
//! closed at a steady [`pace`] with real ones, by targets or by the velocities of [`steering`]: over shared memory (room `shm`) or
//! ROS 2 (room `ros`).
//! A [`design`] changes the robots of a formation one by one.

pub mod channel;
pub mod control;
pub mod design;
pub mod flight;
pub mod formation;
pub mod pace;
pub mod plan;
pub mod resilience;
pub mod robots;
pub mod safety;
pub mod steering;
pub mod transport;
pub mod watch;
