//! How fast the sweeps are, beside what the machine can do.
//!
//! A number of updates per second says little without the machine it was taken on, so every
//! benchmark measures the machine's limit in the same run and reports its own share of it:
//!
//! * [`machine`]: the memory bandwidth of the triad `a = b + s c`.
//! * [`sweep`]: particle updates per second of the plain rule, beside the roofline that bandwidth
//!   draws.
//! * `swarm` (feature `swarm`): robots served per millisecond: neighbour query, rule, safety filter, the whole tick;
//!   with feature `ros` the time from a pose to its target over loopback.
//! * `transport` (feature `shm`): what carrying poses costs: shared memory, sockets, DDS.
//! * [`scale`]: the same body and the same part of a body on more and more ranks, and what a model makes of thousands.
//! * [`equilibrium`]: seconds to equilibrium, beside a factorisation of the same system.

use std::fmt;

pub mod equilibrium;
mod grid;
pub mod machine;
pub mod scale;
#[cfg(feature = "swarm")]
pub mod swarm;
pub mod sweep;
#[cfg(feature = "shm")]
pub mod transport;

/// The last line of a table of figures from a quick run: small sizes and few repetitions, to see that it runs.
fn quick_note(quick: bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if quick {
        writeln!(f, "A quick run: it shows that the benchmark works, its times mean little.")?;
    }
    Ok(())
}
