//! `flockform node --transport shm`: the control loop over shared memory.
//!
//! The loop that ROS 2 has too: it ticks at a steady rate and sleeps between, woken by poses so that their queues stay
//! short.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::link::Controller;
use super::payload::{Command, Formation, Member};
use super::{Capacity, Domain, Peer, Reader, ShmError, Writer, folders, room_for_swarm, wait};
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawCommands;
use crate::swarm::control::Control;
use crate::swarm::control::scope::NodeScope;
use crate::swarm::control::state::{FormationState, MemberState};
use crate::swarm::pace::{Due, Pace, system_time};
use crate::swarm::plan::cautions;
use crate::swarm::transport::complaints::Complaints;
use crate::swarm::transport::silence::Silence;
use crate::swarm::transport::{listen, serve};

/// Leaf of the service that carries commands to the node.
pub const COMMANDS: &str = "commands";
/// Leaf of the service that carries the state of the formation.
pub const STATE: &str = "state";
/// Leaf of the service that carries the state of every member.
pub const MEMBERS: &str = "members";

/// Between two states \[s\].
const STATE_PERIOD: f64 = 0.1;
/// Between two looks for peers that died \[s\].
const CLEANING_PERIOD: f64 = 1.0;

/// A formation's node.
pub struct FormationNode {
    pace: Pace,
    control: Control,
    part: NodeScope,
    end: Controller,
    commands: Reader<Command>,
    /// The commands that are obeyed.
    orders: RawCommands,
    state: Writer<Formation>,
    members: Writer<Member>,
    complaints: Complaints,
    silence: Silence,
    unsent: u64,
    elapsed: f64,
    // Dropped after all that was made from it.
    peer: Peer,
}

impl FormationNode {
    /// Takes part in the domain: for all members, or for one, which hears those that [`NodeScope`] says.
    ///
    /// # Errors
    /// Errors of the swarm file or of shared memory.
    pub fn open(swarm: &Swarm, domain: &Domain, member: Option<&str>) -> Result<Self, ShmError> {
        let mut control = Control::new(swarm)?;
        let part = NodeScope::take(swarm, &mut control, member)?;
        cautions::of_real_robots(&control, &part).for_each(|caution| tracing::warn!("{caution}"));
        folders::require_room(room_for_swarm(control.formation().count()))?;
        let peer = domain.join("flockform_node")?;
        let (space, capacity) = (&swarm.name, &Capacity::SWARM);
        Ok(Self {
            pace: Pace::new(1.0 / control.period()),
            end: Controller::open(&peer, space, &control, &part)?,
            orders: swarm.raw.node.commands,
            commands: Reader::open(&peer, space, COMMANDS, capacity)?,
            state: Writer::open(&peer, space, STATE, capacity, 1)?,
            members: Writer::open(&peer, space, MEMBERS, capacity, control.formation().count())?,
            complaints: Complaints::default(),
            silence: Silence::default(),
            unsent: 0,
            elapsed: 0.0,
            part,
            control,
            peer,
        })
    }

    /// The loop as it stands.
    pub fn control(&self) -> &Control {
        &self.control
    }

    /// Ticks until `stop` is set.
    ///
    /// # Errors
    /// As [`wait::keep`].
    pub fn run(&mut self, stop: &AtomicBool) -> Result<(), ShmError> {
        let mut bells = self.end.bells();
        bells.push(self.commands.bell());
        wait::keep(&bells, stop, &mut |arrived| {
            if arrived {
                self.obey();
                listen(&mut self.control, &mut self.end, &mut self.complaints, system_time());
            }
            loop {
                match self.pace.due() {
                    Due::In(rest) => return Duration::from_secs_f64(rest),
                    Due::Now { .. } => self.tick(),
                }
            }
        })
    }

    /// One period: what arrived, the tick, what is sent.
    pub fn tick(&mut self) {
        let begun = Instant::now();
        let now = system_time();
        self.obey();
        let sent = serve(&mut self.control, &self.part, &mut self.end, &mut self.complaints, now);
        self.note(sent);
        let Self { silence, control, part, end, .. } = self;
        silence.look(control, &part.heard, &|_| end.poses().to_owned());
        self.elapsed = begun.elapsed().as_secs_f64();
        if self.every(STATE_PERIOD) {
            let sent = self.report(now);
            self.note(sent);
        }
        if self.every(CLEANING_PERIOD) {
            self.peer.clean_up();
            self.end.warn_of_others();
        }
    }

    /// Whether what is due so often \[s\] is due in this tick.
    fn every(&self, period: f64) -> bool {
        let ticks = (period / self.control.period()).round().max(1.0) as u64;
        self.control.ticks().is_multiple_of(ticks)
    }

    fn obey(&mut self) {
        for slice in self.commands.arrived() {
            for command in slice.iter() {
                match command.kind {
                    Command::EMERGENCY_STOP if self.orders.may_stop() => self.control.emergency_stop(),
                    Command::RESUME if self.orders.may_do_all() => {
                        self.control.resume();
                    }
                    other => {
                        let text = format_args!(
                            "{}: command {other} is none, or not allowed",
                            self.commands.service()
                        );
                        self.complaints.warn("command", 0, system_time(), &text);
                    }
                }
            }
        }
    }

    fn note(&mut self, sent: Result<(), ShmError>) {
        if let Err(error) = sent {
            if self.unsent == 0 {
                tracing::warn!("{error} (only the first is reported)");
            }
            self.unsent += 1;
        }
    }

    fn report(&mut self, now: f64) -> Result<(), ShmError> {
        let state = FormationState::of(&self.control);
        let nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let formation = Formation {
            mode: state.mode.number().into(),
            members: state.members.len() as u32,
            formation_error: nan(state.formation_error),
            clearance: state.clearance,
            pe1_sum: state.pe1_sum,
            strain_max: state.strain_max,
            elapsed: self.elapsed,
        };
        self.state.send(now, state.tick, 1, |_| formation)?;
        let names = &self.control.formation().names;
        let members = &state.members;
        self.members.send(now, state.tick, members.len(), |k| wire(k, &names[k], &members[k]))
    }
}

fn wire(number: usize, name: &str, member: &MemberState) -> Member {
    let point = |place: Option<[f64; 2]>| place.unwrap_or([f64::NAN; 2]);
    let nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    Member {
        member: number as u32,
        role: u32::from(!member.leads),
        health: member.health.number().into(),
        flags: member.flags,
        position: point(member.position),
        target: point(member.target),
        settled: point(member.settled),
        displacement: point(member.displacement),
        pe1: member.pe1,
        strain: member.strain.unwrap_or([f64::NAN; 3]),
        rotation: nan(member.rotation),
        age: nan(member.age),
        clearance: member.clearance,
        to_settled: nan(member.to_settled()),
        name: Member::name_of(name),
    }
}
