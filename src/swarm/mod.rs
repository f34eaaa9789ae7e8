//! The swarm host: the flocking rule moves robots, safely.

pub mod channel;
pub mod resilience;
pub mod robots;
pub mod watch;
pub mod weights;
