//! The conditions that a pose has to meet, and the meaning of its age.

use super::{Health, Pose, RangeLimits, Rejection};
use crate::flock::rounding::at_most;
use crate::flock::vectors::distance;

/// The conditions that poses have to meet. Needs `0 < fresh <= age_limit <= stop_after`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WatchLimits {
    /// Up to this age a pose is fresh \[s\], default 0.25.
    pub fresh: f64,
    /// Up to this age it is held, and older ones are rejected on arrival \[s\], default 1.
    pub age_limit: f64,
    /// Beyond this age its member is stopped \[s\], default 3.
    pub stop_after: f64,
    /// Middle of where members may be \[m, world frame\], default the origin.
    pub centre: [f64; 2],
    /// Largest distance from there \[m\], default 10 000.
    pub range: f64,
    /// Most by which a stamp may be ahead of the clock, and by which the clock may be set back without a
    /// fresh start \[s\], default 0.1.
    pub skew: f64,
    /// Speed that no member reaches \[m/s\], default 10. A pose that moves farther in the time between two
    /// stamps has jumped.
    pub jump_speed: f64,
    /// Largest distance of two poses at one time, by noise \[m\], default 0.5.
    pub jump_slack: f64,
    /// So many poses in a row that agree with each other are believed after a jump or a stop \[1\], default
    /// 5; with 1 or 0 the first one is.
    pub recover: u32,
    /// Time between the stamps of a member \[s\], where it is known, to count what is lost; default none.
    pub period: Option<f64>,
    /// Holds poses against ranges, where members measure each other; default none.
    pub ranges: Option<RangeLimits>,
}

impl Default for WatchLimits {
    fn default() -> Self {
        Self {
            fresh: 0.25,
            age_limit: 1.0,
            stop_after: 3.0,
            centre: [0.0; 2],
            range: 10_000.0,
            skew: 0.1,
            jump_speed: 10.0,
            jump_slack: 0.5,
            recover: 5,
            period: None,
            ranges: None,
        }
    }
}

impl WatchLimits {
    /// Whether a pose is good in itself.
    pub(super) fn admit(&self, pose: &Pose, now: f64) -> Result<(), Rejection> {
        let numbers = [
            ("position", pose.position[0]),
            ("position", pose.position[1]),
            ("heading", pose.yaw),
            ("stamp", pose.stamp),
            ("time of arrival", now),
        ];
        if let Some((what, _)) = numbers.into_iter().find(|(_, number)| !number.is_finite()) {
            return Err(Rejection::NotFinite { what });
        }
        if !pose.frame_is_right {
            return Err(Rejection::WrongFrame);
        }
        let away = distance(pose.position, self.centre);
        if !at_most(away, self.range) {
            return Err(Rejection::OutOfRange { distance: away, range: self.range });
        }
        let age = now - pose.stamp;
        if !at_most(-age, self.skew) {
            return Err(Rejection::FromTheFuture { ahead: -age, skew: self.skew });
        }
        if !at_most(age, self.age_limit) {
            return Err(Rejection::TooOld { age, age_limit: self.age_limit });
        }
        Ok(())
    }

    /// The distance of two poses, and the largest allowed \[m\].
    pub(super) fn jump(&self, from: &Pose, to: &Pose) -> (f64, f64) {
        let far = distance(from.position, to.position);
        (far, self.jump_speed * (to.stamp - from.stamp) + self.jump_slack)
    }

    /// Whether a member may have gone from one pose to another that is newer.
    pub(in crate::swarm) fn goes_on(&self, from: &Pose, to: &Pose) -> bool {
        let (far, allowed) = self.jump(from, to);
        to.stamp > from.stamp && far <= allowed
    }

    pub(super) fn health(&self, age: Option<f64>) -> Health {
        match age {
            None => Health::Waiting,
            Some(age) if at_most(age, self.fresh) => Health::Fresh,
            Some(age) if at_most(age, self.age_limit) => Health::Held,
            Some(age) if at_most(age, self.stop_after) => Health::Degraded,
            Some(_) => Health::Stopped,
        }
    }
}
