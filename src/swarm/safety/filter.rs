//! The filter: one pass over the members, each with a cell of its own.

use super::cell::{Cell, length};
use super::deadlock::Detour;
use super::limits::{Limits, Place, SafetyError};
use super::obstacles::Obstacles;
use super::step::TOUCHING;
use super::ways::Ways;
use crate::flock::grid::CellGrid;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::{minus, plus};

/// The reasons for changing a target, and other events of a tick, as bits that may be combined; those of the message `flockform_msgs/MemberState`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u32);

impl Flags {
    /// The target was further than the speed limit reaches in a period.
    pub const SPEED_LIMITED: u32 = 1;
    /// The change of velocity was too large, or braking needs the room.
    pub const ACCELERATION_LIMITED: u32 = 2;
    /// The way was cut or bent by the geofence.
    pub const GEOFENCED: u32 = 4;
    /// The same by another member.
    pub const SEPARATED: u32 = 8;
    /// The same by an obstacle.
    pub const OBSTRUCTED: u32 = 16;
    /// The member keeps to the right to get around what blocks it.
    pub const RESOLVING_DEADLOCK: u32 = 32;
    /// A neighbour's pose was not usable.
    pub const NEIGHBOUR_LOST: u32 = 64;
    /// Straying neighbours were left out.
    pub const TRIMMED: u32 = 128;
    /// A pose was rejected since the last tick.
    pub const POSE_REJECTED: u32 = 256;
    /// The member stays without a target: its pose is not known, or the wanted target is not finite. No bit of the
    /// message.
    pub const HELD: u32 = 1 << 16;

    /// Whether this flag is set.
    pub fn has(self, flag: u32) -> bool {
        self.0 & flag != 0
    }
}

/// The members' states known at a tick; shapes \[count\].
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Last known places \[m, world frame\]; not finite for a member that was never seen.
    pub present: &'a Vectors,
    /// Whether a member gets a target. The others are avoided where they were last seen.
    pub known: &'a [bool],
    /// Ages of the poses \[s\]; one that is not a number is any age.
    pub ages: &'a [f64],
    /// Present velocities \[m/s\]; without them, and of a member whose velocity is not finite, no acceleration is limited. Of members that brake
    /// ([`Limits::brakes`]) places and velocities are to be estimates of the present ones.
    pub velocity: Option<&'a Vectors>,
    /// What members may do otherwise; without it nothing is known of that.
    pub strays: Option<&'a [Stray]>,
}

/// What a member that brakes may do otherwise than it is seen to; where one may be that does not, and is seen late.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stray {
    /// Error bound of the way on which it comes to rest, because its velocity is not known exactly \[m\].
    pub error: f64,
    /// Places where it may be, or come to rest, if it has not done what it was sent to \[m\]. One that does not brake is
    /// between them; where there are none it is anywhere within the speed limit.
    pub places: Vec<[f64; 2]>,
}

/// The safety filter of a swarm. A tick allocates no memory once the buffers have grown.
#[derive(Clone)]
pub struct Filter {
    pub(super) limits: Limits,
    /// The highest speed that any member may go at \[m/s\]: a limit that is lowered here is not lowered by the other nodes that move
    /// members, nor for the time before.
    fastest: f64,
    /// Speed limits of before \[m/s\], each with the time since which another has held \[s\], the last one at the end.
    earlier: Vec<(f64, f64)>,
    pub(super) radii: Vec<f64>,
    pub(super) largest_radius: f64,
    pub(super) obstacles: Obstacles,
    pub(super) fence: Obstacles,
    pub(super) detours: Vec<Detour>,
    /// Targets of the last tick, and where members were a period before they are to be there \[m\]; not finite before there were any.
    pub(super) sent: Vectors,
    pub(super) sent_before: Vectors,
    pub(super) crowd: Crowd,
    pub(super) cell: Cell,
}

/// The members within reach at this tick.
#[derive(Clone, Default)]
pub(super) struct Crowd {
    grid: CellGrid,
    /// Pairs of members within `listed` \[m\] of each other.
    neighbours: Neighbours,
    listed: f64,
    seen: Vec<bool>,
    /// Largest drift of a member from its pose \[m\].
    drift: f64,
    /// Whether members take time to brake.
    pub(super) brakes: bool,
    /// All places that each may take until it is at rest.
    pub(super) ways: Vec<Ways>,
    /// Largest distance of such a place from its member \[m\].
    longest: f64,
    /// Members near the current one, in order of index.
    pub(super) found: Vec<u32>,
}

/// The places of a member's [`Stray`].
pub(super) fn places<'a>(seen: &Seen<'a>, member: usize) -> &'a [[f64; 2]] {
    seen.strays.map_or(&[], |strays| &strays[member].places)
}

/// Swarms below this many members are scanned: a grid costs more.
const GRID_FROM: usize = 64;

impl Filter {
    /// A filter for as many members as there are `radii` \[m\].
    ///
    /// # Errors
    /// A limit or a radius that is negative or not a number, a geofence that is no polygon.
    pub fn new(limits: Limits, radii: Vec<f64>, obstacles: Obstacles) -> Result<Self, SafetyError> {
        limits.check()?;
        let wrong = radii.iter().position(|radius| !(radius.is_finite() && *radius >= 0.0));
        if let Some(member) = wrong {
            let fault = format!(" = {} m: give a number from 0 up", radii[member]);
            return Err(Place::Radius(member).refused(fault));
        }
        let fence = limits.geofence.as_deref().map(Obstacles::fence).transpose()?.unwrap_or_default();
        Ok(Self {
            largest_radius: radii.iter().copied().fold(0.0, f64::max),
            detours: vec![Detour::default(); radii.len()],
            sent: vec![[f64::NAN; 2]; radii.len()].into_iter().collect(),
            sent_before: vec![[f64::NAN; 2]; radii.len()].into_iter().collect(),
            fastest: limits.speed,
            earlier: Vec::new(),
            limits,
            radii,
            obstacles,
            fence,
            crowd: Crowd::default(),
            cell: Cell::default(),
        })
    }

    /// The limits that are enforced.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Changes the limits from the next tick on; detours go on.
    ///
    /// # Errors
    /// As [`Filter::new`]; the old limits then stay.
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), SafetyError> {
        limits.check()?;
        self.fence = limits.geofence.as_deref().map(Obstacles::fence).transpose()?.unwrap_or_default();
        self.fastest = self.fastest.max(limits.speed);
        // One that was replaced before it held for a tick has let nothing go on.
        let is_in_use = self.earlier.last().is_none_or(|&(_, since)| since > 0.0);
        if limits.speed != self.limits.speed && is_in_use {
            self.earlier.push((self.limits.speed, 0.0));
        }
        self.limits = limits;
        Ok(())
    }

    /// The highest speed that any member may go at \[m/s\].
    pub(super) fn fastest(&self) -> f64 {
        // Where the file has no limit that of this node is the best guess.
        if self.fastest.is_finite() { self.fastest } else { self.limits.speed }
    }

    /// The longest way of a member in a period \[m\], with that of the time since its pose.
    pub(super) fn longest_step(&self, period: f64, ahead: f64) -> f64 {
        self.limits.speed * period + self.longest_way(ahead)
    }

    /// The longest way that targets may have gone in the last `time` \[s\], within the limits of then \[m\].
    fn longest_way(&self, time: f64) -> f64 {
        let (mut way, mut after, mut speed) = (0.0, 0.0, self.limits.speed);
        for &(before, since) in self.earlier.iter().rev().take_while(|(_, since)| *since < time) {
            way += if since > after { speed * (since - after) } else { 0.0 };
            (after, speed) = (since, before);
        }
        way + if time > after { speed * (time - after) } else { 0.0 }
    }

    /// Whether a member is seen where it may be on the way to its last target, or as far from there as noise may have it \[m\].
    pub(super) fn is_on_its_way(&self, seen: &Seen, period: f64, member: usize) -> bool {
        let way = self.longest_way(period + seen.ages[member].max(0.0));
        distance(seen.present.get(member), self.sent.get(member))
            <= way * (1.0 + TOUCHING) + 4.0 * self.limits.margin()
    }

    /// The speed that the members themselves keep to \[m/s\]: a lower limit of this node brings their targets nearer.
    pub(in crate::swarm) fn own_speed(&self) -> f64 {
        self.fastest
    }

    /// Forgets the targets of the ticks before: others may move the members.
    pub(crate) fn forget(&mut self) {
        for member in 0..self.radii.len() {
            self.sent.set(member, [f64::NAN; 2]);
            self.sent_before.set(member, [f64::NAN; 2]);
        }
    }

    /// Keeps the velocities between the last targets where the period becomes so many times as long.
    pub(crate) fn stretch_period(&mut self, ratio: f64) {
        for member in 0..self.radii.len() {
            let [last, before] = [&self.sent, &self.sent_before].map(|sent| sent.get(member));
            self.sent_before.set(member, [0, 1].map(|k| last[k] + ratio * (before[k] - last[k])));
        }
    }

    /// Obstacles that members are kept away from.
    pub fn obstacles(&self) -> &Obstacles {
        &self.obstacles
    }

    /// Keeps members away from these from the next tick on.
    pub(crate) fn set_obstacles(&mut self, obstacles: Obstacles) {
        self.obstacles = obstacles;
    }

    /// Safe targets \[m, world frame\] for the wanted ones over the next `period` \[s\], with the reasons for
    /// each change. The members are to go straight to their targets, at any pace; the speed is
    /// `|safe - present| / period` unless they brake ([`Limits::brakes`]).
    ///
    /// # Panics
    /// If the slices are not as long as there are members, or the period is not finite and above 0.
    pub fn apply(
        &mut self,
        seen: &Seen,
        wanted: &Vectors,
        period: f64,
        safe: &mut Vectors,
        flags: &mut [Flags],
    ) {
        let count = self.radii.len();
        let lengths = [seen.present.len(), seen.known.len(), seen.ages.len(), wanted.len(), flags.len()];
        assert_eq!(lengths, [count; 5], "one of everything for each member");
        assert!(period.is_finite() && period > 0.0, "a period of {period} s");
        self.meet(seen, wanted, period);
        safe.clone_from(seen.present);
        for (member, flags) in flags.iter_mut().enumerate() {
            let ([from, target], changed) = self.target(seen, wanted.get(member), period, member);
            let last = self.sent.get(member);
            // One that brakes and is sent nowhere may be anywhere when it is heard again; others stand where they were sent.
            let [before, sent] = match (seen.known[member], self.crowd.brakes) {
                (true, _) => {
                    // From a late pose it is sent on for as long as that is old, too.
                    let share =
                        if from == last { 1.0 } else { period / (period + seen.ages[member].max(0.0)) };
                    [plus(target, minus(from, target).map(|d| share * d)), target]
                }
                (false, true) => [[f64::NAN; 2]; 2],
                (false, false) => [last; 2],
            };
            self.sent_before.set(member, before);
            self.sent.set(member, sent);
            safe.set(member, target);
            *flags = changed;
        }
        // Of what is older than all poses nothing is on its way any more.
        let oldest = seen.ages.iter().copied().fold(0.0, f64::max) + period;
        self.earlier.iter_mut().for_each(|(_, since)| *since += period);
        self.earlier.retain(|&(_, since)| since <= oldest + period);
    }

    /// Time for which a member has gone on to its targets since its pose, if they are known \[s\]: by so much farther from
    /// the pose its target may be.
    pub(super) fn ahead(&self, seen: &Seen, member: usize) -> f64 {
        let goes_on = !self.crowd.brakes && !places(seen, member).is_empty();
        if goes_on && seen.known[member] { seen.ages[member].max(0.0) } else { 0.0 }
    }

    /// Whether a member's pose does not say where it is: noisy, or of a time at which it need not have come to its last target yet,
    /// which it was given a period ago. Two such poses have none, one or two targets between them, as it happens.
    pub(super) fn is_inexact(&self, seen: &Seen, period: f64, member: usize) -> bool {
        seen.ages[member] > TOUCHING * period || self.limits.deviation > 0.0
    }

    /// Sorts the members for the queries to come.
    fn meet(&mut self, seen: &Seen, wanted: &Vectors, period: f64) {
        let count = self.radii.len();
        let drift = (0..count).map(|member| self.drift(seen, member)).fold(0.0, f64::max);
        let crowd = &mut self.crowd;
        crowd.drift = drift;
        crowd.seen.clear();
        crowd.seen.extend(seen.present.iter().map(|[x, y]| x.is_finite() && y.is_finite()));
        crowd.longest = 0.0;
        self.crowd.brakes = self.brakes(seen);
        self.crowd.ways.resize_with(count, Ways::default);
        for member in 0..count {
            let (here, places) = (seen.present.get(member), places(seen, member));
            let rest = match places.last() {
                _ if self.crowd.brakes => self.resting_place(seen, period, member),
                Some(&last) => last,
                None => here,
            };
            self.crowd.ways[member].take(here, rest, places);
            self.crowd.longest = self.crowd.longest.max(self.crowd.ways[member].extent);
        }
        if count < GRID_FROM {
            return;
        }
        // As wide as most queries: a member with a way much longer than the mean queries the grid itself.
        let oldest = (0..count).map(|member| self.ahead(seen, member)).fold(0.0, f64::max);
        let step = self.longest_step(period, oldest);
        let ways =
            seen.present.iter().zip(wanted.iter()).map(|(here, there)| distance(here, there).min(step));
        let (mut sum, mut finite, mut longest) = (0.0, 0.0, 0.0_f64);
        for way in ways.filter(|way| way.is_finite()) {
            (sum, finite, longest) = (sum + way, finite + 1.0, longest.max(way));
        }
        let reach = if finite > 0.0 { longest.min(1.5 * sum / finite) } else { 0.0 };
        let radius = 2.0 * (self.largest_radius + self.limits.margin()) + self.limits.clearance;
        let crowd = &mut self.crowd;
        let radius = radius + 2.0 * (reach + crowd.longest) + 8.0 * drift;
        crowd.listed = (radius * (1.0 + TOUCHING)).clamp(f64::MIN_POSITIVE, f64::MAX);
        crowd.neighbours.rebuild_within(&mut crowd.grid, seen.present, &crowd.seen, crowd.listed);
    }

    /// Finds all members that matter to one that moves no further than `reach` \[m\].
    pub(super) fn find(&mut self, seen: &Seen, reach: f64, member: usize) {
        let drift = self.drift(seen, member) + self.crowd.drift;
        let radius = self.radii[member] + self.largest_radius + self.limits.clearance;
        let radius = radius + 2.0 * (reach + self.limits.margin() + self.crowd.longest) + 4.0 * drift;
        let Crowd { grid, neighbours, listed, seen: ever_seen, found, .. } = &mut self.crowd;
        found.clear();
        if !self.limits.keeps_apart {
            return;
        }
        if self.radii.len() < GRID_FROM {
            let here = seen.present.get(member);
            for (other, there) in seen.present.iter().enumerate() {
                if other != member && ever_seen[other] && length(minus(there, here)) <= radius {
                    found.push(other as u32);
                }
            }
        } else if radius <= *listed {
            found.extend_from_slice(neighbours.of(member));
        } else {
            grid.within(seen.present, member, radius, found);
        }
    }

    /// Largest distance of a member from its pose \[m\] by its age.
    pub(super) fn drift(&self, seen: &Seen, member: usize) -> f64 {
        let (age, fastest) = (seen.ages[member], self.fastest());
        match fastest.is_finite() {
            true if age.is_nan() => f64::INFINITY,
            true => fastest * age.max(0.0),
            false => 0.0,
        }
    }

    /// Whether a member of this radius \[m\] may stand at a place.
    pub(crate) fn is_fenced_in(&self, place: [f64; 2], radius: f64) -> bool {
        self.fence.is_empty() || self.fence.distance(place) >= radius
    }

    /// Free space between each member's rim and the nearest rim of another member or border of an
    /// obstacle \[m\], negative where they overlap; infinite for a member without a pose and for one
    /// that has nothing around it. For reports: it takes the square of the number of members.
    pub fn clearance(&self, present: &Vectors, nearest: &mut Vec<f64>) {
        nearest.clear();
        nearest.extend(present.iter().zip(&self.radii).map(|(place, radius)| {
            let finite = place.iter().all(|value| value.is_finite());
            if finite { self.obstacles.distance(place) - radius } else { f64::INFINITY }
        }));
        for a in 0..present.len() {
            for b in a + 1..present.len() {
                let gap = distance(present.get(a), present.get(b)) - self.radii[a] - self.radii[b];
                // A place that is not finite gives NaN or infinity, which `min` leaves out.
                nearest[a] = nearest[a].min(gap);
                nearest[b] = nearest[b].min(gap);
            }
        }
    }
}
