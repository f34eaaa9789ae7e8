//! Checks the poses that arrive: which are accepted, and whether a member is received at all.
//!
//! The newest good pose of a member is held while it is young enough, which leaves the fixed point of the
//! rule where it is however many poses are lost in between; a member that is not heard for longer drops
//! out. No clock is read here: `now` \[s\] is passed in, in the time of the stamps. No pose that is not
//! finite is ever returned.

mod limits;
mod placing;
mod ranges;
mod rejection;
mod track;

pub use limits::WatchLimits;
use ranges::Measured;
pub use ranges::{Range, RangeLimits};
pub use rejection::{Counts, Rejection};
pub(super) use track::MOST_SENT;
pub use track::{Gains, Track};

use crate::flock::rounding::at_most;

/// A pose as it comes in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// \[m, world frame\]
    pub position: [f64; 2],
    /// Heading from the x axis \[rad\].
    pub yaw: f64,
    /// Time of the measurement \[s\].
    pub stamp: f64,
    /// Whether it is in the swarm's frame, as its receiver determined.
    pub frame_is_right: bool,
}

named! {
    /// The state of a member's poses.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Health {
        /// No pose accepted yet, or the clock has been set back.
        #[default]
        Waiting => "waiting",
        /// Young enough to count as the present pose.
        Fresh => "fresh",
        /// The last pose still stands in for the present one.
        Held => "held",
        /// Too old to be used: the member counts as no other member's neighbour, and its own target stays.
        Degraded => "degraded",
        /// Silent for so long that it must prove itself before it goes on.
        Stopped => "stopped",
    }
}

impl Health {
    /// The number in messages and in shared memory.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Whether there is a position to use.
    pub fn is_usable(self) -> bool {
        matches!(self, Health::Fresh | Health::Held)
    }
}

/// The poses accepted from every member, and its health.
#[derive(Clone, Debug)]
pub struct Watch {
    limits: WatchLimits,
    members: Vec<Member>,
    /// The latest ranges of each member, by ascending observer.
    ranges: Vec<Vec<Measured>>,
    /// Latest time seen \[s\].
    clock: Option<f64>,
}

/// Weight of a late pose against one that is accepted \[1\]: one in five may be late for ever.
const LATE: u32 = 4;

/// Weight of late poses that is worth a warning \[1\]: as many as 25 at once.
const OFTEN: u32 = 25 * LATE;

#[derive(Clone, Copy, Debug, Default)]
struct Member {
    health: Health,
    /// Newest pose believed.
    accepted: Option<Pose>,
    /// Where it was last known to be \[m\]: by a pose that was believed or by ranges. It outlasts the pose, since the member
    /// has not left the world.
    place: Option<[f64; 2]>,
    is_doubted: bool,
    /// Newest pose of a run that is consistent in itself and not yet believed, and how many are in it.
    candidate: Option<(Pose, u32)>,
    /// Late poses of the last while, by [`LATE`], less the others \[1\].
    late: u32,
    /// Shortest time between two stamps of late, which is the member's own period \[s\].
    shortest: Option<f64>,
    counts: Counts,
}

impl Watch {
    /// All members waiting.
    pub fn new(members: usize, limits: WatchLimits) -> Self {
        let (members, ranges) = (vec![Member::default(); members], vec![Vec::new(); members]);
        Self { limits, members, ranges, clock: None }
    }

    /// The conditions that poses have to meet.
    pub fn limits(&self) -> &WatchLimits {
        &self.limits
    }

    /// Takes in a pose of `member` that arrives at `now` \[s\]. A rejected pose changes nothing but its
    /// count and, where it jumps or follows a stop, the run that makes the next ones believed.
    ///
    /// Panics if there is no such member.
    pub fn receive(&mut self, member: usize, pose: Pose, now: f64) -> Result<(), Rejection> {
        self.follow_clock(now);
        let sound = self.limits.admit(&pose, now).and_then(|()| self.weigh_by_ranges(member, &pose));
        let watched = &mut self.members[member];
        let verdict = sound.and_then(|()| watched.weigh(&pose, now, &self.limits));
        match &verdict {
            Ok(()) => watched.accept(pose, now, &self.limits),
            Err(rejection) => watched.counts.count(rejection),
        }
        verdict
    }

    /// Updates the health of all at `now` \[s\]: call it once in every period, before anything is read.
    pub fn look(&mut self, now: f64) {
        self.follow_clock(now);
        for member in &mut self.members {
            member.health = self.limits.health(member.age(now));
        }
        self.place_doubted(now);
    }

    /// As of the last look, or the last pose accepted since.
    pub fn health(&self, member: usize) -> Health {
        self.members[member].health
    }

    /// The position to use \[m, world frame\]; `None` unless fresh or held.
    pub fn position(&self, member: usize) -> Option<[f64; 2]> {
        self.pose(member).map(|pose| pose.position)
    }

    /// The pose to use; `None` unless fresh or held.
    pub fn pose(&self, member: usize) -> Option<Pose> {
        let member = &self.members[member];
        member.accepted.filter(|_| member.health.is_usable())
    }

    /// Where the member was last known to be \[m, world frame\], however long ago: to keep clear of, not to follow. Once
    /// known it is never lost.
    pub fn place(&self, member: usize) -> Option<[f64; 2]> {
        self.members[member].place
    }

    /// Age of the newest pose believed \[s\]; zero where its sender's clock runs ahead.
    pub fn age(&self, member: usize, now: f64) -> Option<f64> {
        self.members[member].age(now)
    }

    /// Whether ranges have contradicted a pose of the member and confirmed none since.
    pub fn is_doubted(&self, member: usize) -> bool {
        self.members[member].is_doubted
    }

    /// How many of a member's poses were believed, and why the others were not.
    pub fn counts(&self, member: usize) -> &Counts {
        &self.members[member].counts
    }

    /// Forgets every pose when the clock is set back or not finite: stamps of another time cannot be compared
    /// with this one.
    fn follow_clock(&mut self, now: f64) {
        let set_back = self.clock.is_some_and(|clock| now < clock - self.limits.skew);
        if set_back || !now.is_finite() {
            self.members.iter_mut().for_each(Member::forget);
            self.ranges.iter_mut().for_each(Vec::clear);
            self.clock = None;
        }
        if now.is_finite() {
            self.clock = Some(self.clock.map_or(now, |clock| clock.max(now)));
        }
    }
}

impl Member {
    /// Forgets every pose, and not that the member is somewhere, nor that it is doubted.
    fn forget(&mut self) {
        (self.health, self.accepted, self.candidate) = (Health::Waiting, None, None);
    }

    fn age(&self, now: f64) -> Option<f64> {
        self.accepted.map(|pose| (now - pose.stamp).max(0.0))
    }

    /// Whether a pose that is good in itself is believed after those before it.
    fn weigh(&mut self, pose: &Pose, now: f64, limits: &WatchLimits) -> Result<(), Rejection> {
        let Some(last) = self.accepted else { return Ok(()) };
        if pose.stamp <= last.stamp {
            return Err(self.reject_late(pose, &last, now, limits));
        }
        let (far, allowed) = limits.jump(&last, pose);
        let stopped = limits.health(self.age(now)) == Health::Stopped;
        if !stopped && far <= allowed {
            return Ok(());
        }
        let seen = self.run_with(pose, now, limits)?;
        let recover = limits.recover;
        match (seen >= recover, stopped) {
            (true, _) => Ok(()),
            (false, true) => Err(Rejection::Recovering { seen, recover }),
            (false, false) => Err(Rejection::Jump { distance: far, allowed, seen, recover }),
        }
    }

    /// Why a pose that is not newer than the last is rejected.
    fn reject_late(&mut self, pose: &Pose, last: &Pose, now: f64, limits: &WatchLimits) -> Rejection {
        let behind = last.stamp - pose.stamp;
        let (distance, allowed) = limits.jump(pose, last);
        // Those that bear no stamp have that of their arrival, which several may share.
        if (behind > 0.0 || pose.stamp < now) && distance > allowed {
            return Rejection::TwoAtOnce { distance, behind };
        }
        // A network that brings a pose twice has no part in it.
        if behind > 0.0 {
            self.late = (self.late + LATE).min(2 * OFTEN);
        }
        if self.late < OFTEN { Rejection::NotNewer { behind } } else { Rejection::OftenLate { behind } }
    }

    /// Adds a pose to the run of those not yet believed, or begins a new one with it; how many are in it.
    fn run_with(&mut self, pose: &Pose, now: f64, limits: &WatchLimits) -> Result<u32, Rejection> {
        let seen = match self.candidate {
            Some((before, seen)) if at_most(now - before.stamp, limits.age_limit) => {
                if pose.stamp <= before.stamp {
                    return Err(Rejection::NotNewer { behind: before.stamp - pose.stamp });
                }
                let (far, allowed) = limits.jump(&before, pose);
                if far <= allowed { seen.saturating_add(1) } else { 1 }
            }
            _ => 1,
        };
        self.candidate = Some((*pose, seen));
        Ok(seen)
    }

    fn accept(&mut self, pose: Pose, now: f64, limits: &WatchLimits) {
        if let (Some(last), Some(period)) = (self.accepted, limits.period) {
            /// Growth of the shortest gap with every pose: a member that sends less often from now on is taken for what it is.
            const GROWTH: f64 = 1.002;
            let gap = pose.stamp - last.stamp;
            let own = self.shortest.map_or(gap, |shortest| shortest.min(gap));
            // The cast saturates: a period of zero or a NaN harms nothing but the count.
            self.counts.lost += (gap / own.max(period) - 1.0).round() as u64;
            self.shortest = Some(GROWTH * own);
        }
        self.counts.accepted += 1;
        self.late = self.late.saturating_sub(1);
        (self.accepted, self.place) = (Some(pose), Some(pose.position));
        (self.candidate, self.is_doubted) = (None, false);
        self.health = limits.health(self.age(now));
    }
}

#[cfg(test)]
mod tests;
