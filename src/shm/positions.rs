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
    /// left out and counted. Where ranks have a part of the body each, all of them call this, and the first one alone has something to
    /// show it by: it receives the particles of the others where there is a reader.
    pub fn show(shown: Option<&mut Self>, engine: &Engine) {
        let (present, roles, body) = (engine.present(), engine.roles(), engine.body());
        let seen = |i: usize| Particle {
            id: body.id(i) as u32,
            role: roles[i].number().into(),
            position: [present.x[i], present.y[i]],
        };
        let mut shown = shown.filter(|shown| shown.is_read(engine.step()));
        if !engine.any_of_parts(shown.is_some()) {
            return;
        }
        if let (None, Some(shown)) = (engine.parted(), &mut shown) {
            // Straight into shared memory.
            return shown.send(engine, present.len(), |row| seen(body.in_row(row)));
        }
        let all = engine.of_all(|i| {
            let Particle { id, role, position: [x, y] } = seen(i);
            [u64::from(id), u64::from(role), x.to_bits(), y.to_bits()]
        });
        let of_words = |[id, role, x, y]: [u64; 4]| {
            let position = [x, y].map(f64::from_bits);
            Particle { id: id as u32, role: role as u32, position }
        };
        if let Some(shown) = shown {
            shown.send(engine, all.len(), |row| of_words(all[row]));
        }
    }

    /// Whether there is a reader.
    fn is_read(&self, step: usize) -> bool {
        if step.is_multiple_of(CLEANING) {
            self.peer.clean_up();
        }
        self.writer.readers() > 0
    }

    fn send(&mut self, engine: &Engine, count: usize, particle: impl FnMut(usize) -> Particle) {
        if let Err(error) = self.writer.send(system_time(), engine.step() as u64, count, particle) {
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
