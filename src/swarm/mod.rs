//! The swarm host: the flocking rule moves robots, safely.
//!
//! [`formation`] is who flies and where the rule sends them; [`control`] is the tick that turns poses into safe
//! targets, by [`watch`] (which poses are believed), [`resilience`] (which neighbours are) and [`safety`] (what is
//! safe). [`flight`] closes the loop with simulated [`robots`] behind [`channel`]s; room `ros` closes it with
//! real ones.

pub mod channel;
pub mod control;
pub mod flight;
pub mod formation;
pub mod robots;
pub mod safety;
pub mod watch;
