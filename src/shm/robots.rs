//! `flockform robots --transport shm`: the simulated robots of a swarm file over shared memory.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use super::link::Robots;
use super::{Domain, Peer, ShmError, folders, room_for_swarm, wait};
use crate::scene::swarm::Swarm;
use crate::swarm::control::Control;
use crate::swarm::flight::Fleet;
use crate::swarm::pace::{Due, Pace, system_time};
use crate::swarm::plan::cautions;
use crate::swarm::transport::{RobotsEnd, aim, catch_up, fly};

/// The robots, and the end they speak through.
pub struct SimulatedRobots {
    fleet: Fleet,
    pace: Pace,
    goals: Vec<Option<[f64; 2]>>,
    end: Robots,
    // Dropped after all that was made from it.
    peer: Peer,
}

/// Periods between two looks for peers that died.
const CLEANING: u64 = 50;

impl SimulatedRobots {
    /// # Errors
    /// Errors of the swarm file or of shared memory.
    pub fn open(swarm: &Swarm, domain: &Domain) -> Result<Self, ShmError> {
        let control = Control::new(swarm)?;
        let formation = control.formation();
        cautions::of_simulated_robots(&swarm.raw).inspect(|caution| tracing::warn!("{caution}"));
        folders::require_room(room_for_swarm(formation.count()))?;
        let peer = domain.join("flockform_robots")?;
        let end = Robots::open(&peer, &swarm.name, formation.count())?;
        Ok(Self {
            fleet: Fleet::new(swarm, formation)?,
            pace: Pace::new(1.0 / control.period()),
            goals: vec![None; formation.count()],
            end: if swarm.raw.ranges.is_some() {
                end.with_ranges(&peer, &swarm.name, formation.count())?
            } else {
                end
            },
            peer,
        })
    }

    /// The robots as they are.
    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    /// Flies until `stop` is set.
    ///
    /// # Errors
    /// As [`wait::keep`].
    pub fn run(&mut self, stop: &AtomicBool) -> Result<(), ShmError> {
        let bell = self.end.bell();
        wait::keep(&[bell], stop, &mut |arrived| {
            if arrived {
                let Self { goals, end, .. } = self;
                end.targets(&mut |member, place| aim(goals, member, place));
            }
            loop {
                match self.pace.due() {
                    Due::In(rest) => return Duration::from_secs_f64(rest),
                    Due::Now { missed } => {
                        catch_up(&mut self.fleet, &self.goals, missed);
                        self.tick();
                    }
                }
            }
        })
    }

    /// One period: targets in, poses out.
    pub fn tick(&mut self) {
        let Self { fleet, goals, end, pace, .. } = self;
        // Until when they have flown, however late the tick is.
        if let Err(error) = fly(fleet, goals, end, |_| system_time() - pace.lateness()) {
            tracing::debug!("{error}");
        }
        if self.fleet.period().is_multiple_of(CLEANING) {
            self.peer.clean_up();
            self.end.warn_of_others();
        }
    }
}
