//! The swarm host: the flocking rule moves robots, safely.

pub mod robots;
