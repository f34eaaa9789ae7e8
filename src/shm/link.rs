//! The ends of a [`transport`](crate::swarm::transport) over shared memory.

use super::payload::{Leader, Pose as Wire, Range as WireRange, Target as WireTarget};
use super::wait::Bell;
use super::{Capacity, Peer, Reader, ShmError, Writer};
use crate::swarm::control::Control;
use crate::swarm::control::scope::NodeScope;
use crate::swarm::pace::system_time;
use crate::swarm::transport::complaints::Complaints;
use crate::swarm::transport::{ControllerEnd, Received, RobotsEnd, Target};
use crate::swarm::watch::{Pose, Range};

/// Leaf of the service that carries poses to the loop.
pub const POSES: &str = "poses";
/// Leaf of the service that carries ranges to the loop, of swarms that have them.
pub const RANGES: &str = "ranges";
/// Leaf of the service that carries the places of leaders moved from outside to the loop.
pub(crate) const LEADERS: &str = "leaders";
/// Leaf of the service that carries targets to the robots.
pub(crate) const TARGETS: &str = "targets";

/// The loop's end.
pub struct Controller {
    poses: Reader<Wire>,
    ranges: Option<Reader<WireRange>>,
    leaders: Reader<Leader>,
    targets: Writer<WireTarget>,
    /// Members whose poses and places are taken.
    hears: Vec<bool>,
    serves: Vec<bool>,
    tick: u64,
    refused: u64,
    /// Of robots that the swarm does not have.
    complaints: Complaints,
}

impl Controller {
    /// Of a loop's part in the formation that its peers call `space`.
    ///
    /// # Errors
    /// As [`Reader::open`] and [`Writer::open`].
    pub fn open(peer: &Peer, space: &str, control: &Control, part: &NodeScope) -> Result<Self, ShmError> {
        let count = control.formation().count();
        let has_ranges = control.watch().limits().ranges.is_some();
        let among = |members: &[usize]| {
            let mut all = vec![false; count];
            members.iter().for_each(|&member| all[member] = true);
            all
        };
        let alone = part.mine.first().copied().filter(|_| part.mine.len() < count);
        Ok(Self {
            poses: Reader::open(peer, space, POSES, &Capacity::SWARM)?,
            ranges: has_ranges.then(|| Reader::open(peer, space, RANGES, &for_ranges(count))).transpose()?,
            leaders: Reader::open(peer, space, LEADERS, &Capacity::SWARM)?,
            targets: Writer::open_for(peer, space, TARGETS, &Capacity::SWARM, part.mine.len(), alone)?,
            hears: among(&part.heard),
            serves: among(&part.mine),
            tick: 0,
            refused: 0,
            complaints: Complaints::default(),
        })
    }

    /// Name of the service that carries poses.
    pub(crate) fn poses(&self) -> &str {
        self.poses.service()
    }

    /// Warns when another node comes that moves the same robots.
    pub(crate) fn warn_of_others(&mut self) {
        self.targets.warn_of_others("another node moves the same robots");
    }

    /// The bell that rings when poses or places of leaders arrive.
    pub(crate) fn bells(&self) -> Vec<Bell> {
        let ranges = self.ranges.iter().map(Reader::bell);
        [self.poses.bell(), self.leaders.bell()].into_iter().chain(ranges).collect()
    }
}

impl ControllerEnd for Controller {
    type Error = ShmError;

    fn receive(&mut self, now: f64, take: &mut dyn FnMut(Received)) {
        let Self { poses, ranges, leaders, hears, serves, refused, complaints, .. } = self;
        let count = hears.len();
        let mut refuse = |service: &str, what: &str, member: usize| {
            *refused += 1;
            let text = format_args!(
                "{service}: {what} is of robot {member}, and the swarm has {count}, from 0: it is of another swarm file of this name"
            );
            // One line for all of them.
            complaints.warn("no such robot", count, system_time(), &text);
        };
        if let Some(ranges) = ranges {
            for slice in ranges.arrived() {
                for wire in slice.iter() {
                    let [observer, of] = [wire.observer, wire.of].map(|member| member as usize);
                    if observer.max(of) >= count {
                        refuse(ranges.service(), "a range", observer.max(of));
                    } else if hears[observer] && hears[of] {
                        let stamp = if wire.stamp == 0.0 { now } else { wire.stamp };
                        take(Received::Range(Range { observer, of, distance: wire.distance, stamp }));
                    }
                }
            }
        }
        for slice in poses.arrived() {
            for wire in slice.iter() {
                let member = wire.member as usize;
                if member >= count {
                    refuse(poses.service(), "a pose", member);
                } else if hears[member] {
                    take(Received::Pose(member, pose(wire, now)));
                }
            }
        }
        for slice in leaders.arrived() {
            for leader in slice.iter() {
                let member = leader.member as usize;
                if member >= count {
                    refuse(leaders.service(), "the place of a leader", member);
                } else if serves[member] {
                    take(Received::Leader(member, leader.position));
                }
            }
        }
    }

    fn send(&mut self, now: f64, targets: &[Target]) -> Result<(), ShmError> {
        self.tick += 1;
        if targets.is_empty() {
            return Ok(());
        }
        self.targets.send(now, self.tick, targets.len(), |k| {
            let Target { member, position, yaw } = targets[k];
            WireTarget { member: member as u32, reserved: 0, position, yaw }
        })
    }

    fn refused(&self) -> u64 {
        let ranges = self.ranges.as_ref().map_or(0, Reader::refused);
        self.refused + ranges + self.poses.refused() + self.leaders.refused()
    }
}

/// Ranges a robot in a slice; where robots measure more others, a period takes several slices.
const OTHERS: usize = 32;
/// Ranges that wait for a reader at most \[1\]: 24 MiB.
const WAITING: usize = 1 << 20;

/// Two periods wait for a late loop in which each of `count` robots measures all others, up to [`WAITING`]: where some of a
/// period are lost, they are those of the same observers each time.
fn for_ranges(count: usize) -> Capacity {
    let two_periods = 2 * count.saturating_sub(1).div_ceil(OTHERS);
    let most = WAITING / (count * OTHERS).max(1);
    Capacity { queue: two_periods.min(most).max(Capacity::SWARM.queue), ..Capacity::SWARM }
}

/// The robots' end: of all of them, or of one.
pub struct Robots {
    poses: Writer<Wire>,
    ranges: Option<Writer<WireRange>>,
    targets: Reader<WireTarget>,
    count: usize,
    /// Ranges that wait for the loop at most \[1\].
    waiting: usize,
    period: u64,
    /// Of more ranges than wait for the loop.
    complaints: Complaints,
}

impl Robots {
    /// Of `count` robots of the formation that its peers call `space`.
    ///
    /// # Errors
    /// As [`Reader::open`] and [`Writer::open`].
    pub fn open(peer: &Peer, space: &str, count: usize) -> Result<Self, ShmError> {
        Ok(Self {
            poses: Writer::open(peer, space, POSES, &Capacity::SWARM, count)?,
            ranges: None,
            targets: Reader::open(peer, space, TARGETS, &Capacity::SWARM)?,
            count,
            waiting: 0,
            period: 0,
            complaints: Complaints::default(),
        })
    }

    /// The same, with rangefinders, in a formation of so many robots.
    ///
    /// # Errors
    /// As [`Writer::open`].
    pub fn with_ranges(mut self, peer: &Peer, space: &str, formation: usize) -> Result<Self, ShmError> {
        let (at_once, capacity) = (self.count * OTHERS, for_ranges(formation));
        self.ranges = Some(Writer::open(peer, space, RANGES, &capacity, at_once)?);
        self.waiting = at_once * capacity.queue;
        Ok(self)
    }

    /// The bell that rings when targets arrive.
    pub fn bell(&self) -> Bell {
        self.targets.bell()
    }

    /// Warns when others come that send poses of the same robots.
    pub(crate) fn warn_of_others(&mut self) {
        self.poses.warn_of_others("others send poses of the same robots");
    }
}

impl RobotsEnd for Robots {
    type Error = ShmError;

    fn send(&mut self, now: f64, poses: &[(usize, Pose)]) -> Result<(), ShmError> {
        self.period += 1;
        // Delays and duplicates may make more poses than robots.
        for some in poses.chunks(self.count.max(1)) {
            self.poses.send(now, self.period, some.len(), |k| wire(&some[k]))?;
        }
        Ok(())
    }

    fn send_ranges(&mut self, now: f64, ranges: &[Range]) -> Result<(), ShmError> {
        let Some(writer) = &mut self.ranges else {
            let reason = "these robots were opened without ranges".to_owned();
            return Err(ShmError::Send { service: RANGES.to_owned(), reason });
        };
        let at_once = (self.count * OTHERS).max(1);
        let waiting = self.waiting;
        if ranges.len() > waiting {
            let text = format_args!(
                "{}: {} ranges in a period, and {waiting} wait for a node at most: others are lost; give `ranges.reach` less",
                writer.service(),
                ranges.len()
            );
            self.complaints.warn("ranges", 0, system_time(), &text);
        }
        for some in ranges.chunks(at_once) {
            writer.send(now, self.period, some.len(), |k| {
                let Range { observer, of, distance, stamp } = some[k];
                WireRange { observer: observer as u32, of: of as u32, distance, stamp }
            })?;
        }
        Ok(())
    }

    fn targets(&mut self, go: &mut dyn FnMut(usize, [f64; 2])) {
        for slice in self.targets.arrived() {
            slice.iter().for_each(|target| go(target.member as usize, target.position));
        }
    }
}

/// A pose with its stamp; one that bears none was measured when it arrived.
fn pose(wire: &Wire, now: f64) -> Pose {
    Pose {
        position: wire.position,
        yaw: wire.yaw,
        stamp: if wire.stamp == 0.0 { now } else { wire.stamp },
        frame_is_right: wire.frame == 0,
    }
}

fn wire((member, pose): &(usize, Pose)) -> Wire {
    Wire {
        member: *member as u32,
        frame: u32::from(!pose.frame_is_right),
        position: pose.position,
        yaw: pose.yaw,
        stamp: pose.stamp,
    }
}
