//! A running body for other processes to read: its positions after every step.
//!
//! The positions are written once, from the engine into a slice of shared memory, and read there. A step is
//! published to the readers of that moment; without readers it costs the read of a counter.

use super::payload::Particle;
use super::{Capacity, Domain, Peer, Reader, ShmError, Writer, folders};
use crate::engine::Engine;
use crate::swarm::pace::system_time;

/// Leaf of the service that carries the positions of a body.
pub(crate) const POSITIONS: &str = "positions";

/// Steps between two looks for readers that died.
const CLEANING: usize = 1000;

/// Publishes a body's positions.
pub struct Positions {
    writer: Writer<Particle>,
    unsent: u64,
    // Dropped after all that was made from it.
    peer: Peer,
}

impl Positions {
    /// As `flockform/NAME/positions`, of a body of so many particles.
    ///
    /// # Errors
    /// An invalid name, a name in use, or insufficient memory.
    pub fn open(domain: &Domain, name: &str, particles: usize) -> Result<Self, ShmError> {
        // Its services, and slices for one reader: held, waiting and being filled.
        folders::require_room((256 << 10) + (4 * particles * size_of::<Particle>()) as u64)?;
        let peer = domain.join("flockform_run")?;
        let writer = Writer::open(&peer, name, POSITIONS, &Capacity::BODY, particles)?;
        Ok(Self { writer, unsent: 0, peer })
    }

    /// Shows the body as it is. Never waits, and never fails: what readers that hold too much leave no room for is
    /// left out and counted.
    pub fn show(&mut self, engine: &Engine) {
        let step = engine.step();
        if step.is_multiple_of(CLEANING) {
            self.peer.clean_up();
        }
        if self.writer.readers() == 0 {
            return;
        }
        let (present, roles, body) = (engine.present(), engine.roles(), engine.body());
        let particle = |row: usize| {
            let i = body.in_row(row);
            Particle {
                id: body.id(i) as u32,
                role: roles[i].number().into(),
                position: [present.x[i], present.y[i]],
            }
        };
        if let Err(error) = self.writer.send(system_time(), step as u64, present.len(), particle) {
            if self.unsent == 0 {
                tracing::debug!("{error} (only the first is reported)");
            }
            self.unsent += 1;
        }
    }

    /// Steps that could not be shown \[1\].
    pub fn unsent(&self) -> u64 {
        self.unsent
    }
}

/// Reads a body's positions as they are published.
///
/// # Errors
/// As [`Reader::open`].
pub fn read(peer: &Peer, name: &str) -> Result<Reader<Particle>, ShmError> {
    Reader::open(peer, name, POSITIONS, &Capacity::BODY)
}
