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

/// Swarms for the tests of rooms that fly them.
#[cfg(test)]
pub(crate) mod examples {
    use crate::scene::bundled::bundled_swarm;
    use crate::scene::swarm::Swarm;

    /// The swarm of this text, with overrides.
    pub fn parsed(text: &str, set: &[&str]) -> Swarm {
        Swarm::parse("x", "x.toml", text, &owned(set), None).unwrap_or_else(|error| panic!("{error}"))
    }

    /// A bundled swarm, with overrides.
    pub fn bundled(name: &str, set: &[&str]) -> Swarm {
        let found = bundled_swarm(name).expect("bundled").load_swarm(&owned(set));
        found.unwrap_or_else(|error| panic!("{error}"))
    }

    fn owned(set: &[&str]) -> Vec<String> {
        set.iter().map(|&one| one.to_owned()).collect()
    }
}
