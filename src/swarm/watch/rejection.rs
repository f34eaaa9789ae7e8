//! The reasons for rejecting a pose, and how often each occurred.

/// The reason for rejecting a pose. It does not name the member, which the receiver knows.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Rejection {
    #[error("the {what} of a pose is not finite: its sender has lost itself, or sends uninitialised fields")]
    NotFinite { what: &'static str },
    #[error("a pose is in another frame: publish it in the swarm's, or name that one in the swarm file")]
    WrongFrame,
    #[error(
        "a pose lies {distance:.3} m from the centre, at most {range:.3} m is allowed: check its frame and \
         units, or raise the range"
    )]
    OutOfRange { distance: f64, range: f64 },
    #[error(
        "a pose is stamped {ahead:.3} s ahead of the clock, at most {skew:.3} s is allowed: synchronise the \
         clocks"
    )]
    FromTheFuture { ahead: f64, skew: f64 },
    #[error(
        "a pose is {age:.3} s old on arrival, at most {age_limit:.3} s is allowed: synchronise the clocks, \
         or look for what delays it"
    )]
    TooOld { age: f64, age_limit: f64 },
    /// Ordinary on an unreliable network: counted, worth no warning.
    #[error("a pose is stamped {behind:.3} s before the newest one, or is that one again")]
    NotNewer { behind: f64 },
    #[error(
        "a pose lies {distance:.3} m from the last one, at most {allowed:.3} m is allowed in the time between: \
         {seen} of the {recover} in a row that would make it believed"
    )]
    Jump { distance: f64, allowed: f64, seen: u32, recover: u32 },
    /// A good pose of a member that was stopped.
    #[error("a pose of a stopped member: {seen} of the {recover} good ones in a row that it needs to go on")]
    Recovering { seen: u32, recover: u32 },
}

/// Counts of a member's accepted and rejected poses since the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub accepted: u64,
    /// Gaps between accepted stamps, in periods: what was lost or came too late. Zero where
    /// [`super::WatchLimits::period`] is not known.
    pub lost: u64,
    pub not_finite: u64,
    pub wrong_frame: u64,
    pub out_of_range: u64,
    pub from_the_future: u64,
    pub too_old: u64,
    pub not_newer: u64,
    pub jumps: u64,
    pub recovering: u64,
}

impl Counts {
    /// Poses that were not used, for whatever reason.
    pub fn rejected(&self) -> u64 {
        self.not_finite
            + self.wrong_frame
            + self.out_of_range
            + self.from_the_future
            + self.too_old
            + self.not_newer
            + self.jumps
            + self.recovering
    }

    pub(super) fn count(&mut self, rejection: &Rejection) {
        let counter = match rejection {
            Rejection::NotFinite { .. } => &mut self.not_finite,
            Rejection::WrongFrame => &mut self.wrong_frame,
            Rejection::OutOfRange { .. } => &mut self.out_of_range,
            Rejection::FromTheFuture { .. } => &mut self.from_the_future,
            Rejection::TooOld { .. } => &mut self.too_old,
            Rejection::NotNewer { .. } => &mut self.not_newer,
            Rejection::Jump { .. } => &mut self.jumps,
            Rejection::Recovering { .. } => &mut self.recovering,
        };
        *counter += 1;
    }
}
