//! The reasons for rejecting a pose, and how often each occurred.

/// To millimetres, or, of what may be anything, in few digits.
fn metres(distance: &f64) -> String {
    if *distance < 1e9 { format!("{distance:.3}") } else { format!("{distance:.3e}") }
}

/// The reason for rejecting a pose. It does not name the member, which the receiver knows.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Rejection {
    /// A coordinate, the heading, the stamp or the time of arrival is not finite.
    #[error("the {what} of a pose is not finite: its sender has lost itself, or sends uninitialised fields")]
    NotFinite {
        /// Which of them.
        what: &'static str,
    },
    /// The receiver found that it is in another frame.
    #[error("a pose is in another frame: publish it in the swarm's, or name that one in the swarm file")]
    WrongFrame,
    /// It is farther from the formation's middle than any pose may be.
    #[error(
        "a pose lies {} m from the centre, at most {range:.3} m is allowed: check its frame and \
         units, or raise the range",
        metres(.distance)
    )]
    OutOfRange {
        /// Its distance from there \[m\].
        distance: f64,
        /// Greatest distance that is allowed \[m\].
        range: f64,
    },
    /// Its stamp is ahead of the clock.
    #[error(
        "a pose is stamped {ahead:.3} s ahead of the clock, at most {skew:.3} s is allowed: synchronise the \
         clocks"
    )]
    FromTheFuture {
        /// By how much \[s\].
        ahead: f64,
        /// How much is allowed \[s\].
        skew: f64,
    },
    /// It was measured too long ago.
    #[error(
        "a pose is {age:.3} s old when it is read, at most {age_limit:.3} s is allowed: synchronise the clocks, \
         or look for what delays it or stops this program"
    )]
    TooOld {
        /// How long ago \[s\].
        age: f64,
        /// Greatest age that is allowed \[s\].
        age_limit: f64,
    },
    /// Ordinary on an unreliable network: counted, worth no warning.
    #[error("a pose is stamped {behind:.3} s before the newest one, or is that one again")]
    NotNewer {
        /// How much older than the newest one it is \[s\]; 0 for a copy.
        behind: f64,
    },
    /// The same of so many of late that no network explains it.
    #[error(
        "a pose is stamped {behind:.3} s before the newest one, as many are: two publish the poses of this robot, of which \
         one has to end, or the network delays each by another time"
    )]
    OftenLate {
        /// How much older than the newest one it is \[s\].
        behind: f64,
    },
    /// It is of the same time as the newest one or of one before, and farther from it than a robot goes meanwhile.
    #[error(
        "a pose lies {} m from another, of the same time or {behind:.3} s later: two publish the poses of this robot; end one \
         of them",
        metres(.distance)
    )]
    TwoAtOnce {
        /// Distance from the other \[m\].
        distance: f64,
        /// How much older than the other it is \[s\].
        behind: f64,
    },
    /// It implies a speed that no robot has.
    #[error(
        "a pose lies {} m from the last one, at most {allowed:.3} m is allowed in the time between: \
         {seen} of the {recover} in a row that would make it believed",
        metres(.distance)
    )]
    Jump {
        /// Distance from the last pose believed \[m\].
        distance: f64,
        /// Greatest distance in the time between \[m\].
        allowed: f64,
        /// Poses that agree with it so far, itself included.
        seen: u32,
        /// Poses that have to agree for it to be believed.
        recover: u32,
    },
    /// More members measured it elsewhere than may lie.
    #[error(
        "a pose is contradicted by the ranges of {against} of the {measured} robots that measured this one, at most \
         {max_faulty} may be wrong: look after its localisation"
    )]
    Contradicted {
        /// Members whose ranges disagree with the pose.
        against: usize,
        /// Members that have measured.
        measured: usize,
        /// How many may disagree.
        max_faulty: usize,
    },
    /// Ranges have contradicted the member before, and do not confirm this pose.
    #[error(
        "a pose of a robot that ranges have contradicted, and the ranges of {measured} robots leave it other places: it is \
         believed again where those of enough others leave none"
    )]
    Unconfirmed {
        /// Members that have measured.
        measured: usize,
    },
    /// A good pose of a member that was stopped.
    #[error("a pose of a stopped member: {seen} of the {recover} good ones in a row that it needs to go on")]
    Recovering {
        /// Good poses so far, itself included.
        seen: u32,
        /// Good poses that the member needs.
        recover: u32,
    },
}

impl Rejection {
    /// A short name of the cause; none for poses that are dropped in ordinary operation.
    pub fn cause(&self) -> Option<&'static str> {
        match self {
            Rejection::NotFinite { .. } => Some("not finite"),
            Rejection::WrongFrame => Some("wrong frame"),
            Rejection::OutOfRange { .. } => Some("out of range"),
            Rejection::FromTheFuture { .. } => Some("from the future"),
            Rejection::TooOld { .. } => Some("too old"),
            Rejection::OftenLate { .. } => Some("often late"),
            Rejection::TwoAtOnce { .. } => Some("two at once"),
            Rejection::Jump { .. } => Some("jump"),
            Rejection::Contradicted { .. } => Some("contradicted by ranges"),
            Rejection::Unconfirmed { .. } => Some("not confirmed by ranges"),
            Rejection::NotNewer { .. } | Rejection::Recovering { .. } => None,
        }
    }
}

/// Counts of a member's accepted and rejected poses since the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Poses that were believed.
    pub accepted: u64,
    /// Gaps between accepted stamps, in periods of the member, or the loop's where that is longer: what was lost or came too late. Zero where
    /// [`super::WatchLimits::period`] is not known.
    pub lost: u64,
    /// Rejections as [`Rejection::NotFinite`].
    pub not_finite: u64,
    /// Rejections as [`Rejection::WrongFrame`].
    pub wrong_frame: u64,
    /// Rejections as [`Rejection::OutOfRange`].
    pub out_of_range: u64,
    /// Rejections as [`Rejection::FromTheFuture`].
    pub from_the_future: u64,
    /// Rejections as [`Rejection::TooOld`].
    pub too_old: u64,
    /// Rejections as [`Rejection::NotNewer`], [`Rejection::OftenLate`] and [`Rejection::TwoAtOnce`].
    pub not_newer: u64,
    /// Rejections as [`Rejection::Jump`].
    pub jumps: u64,
    /// Rejections as [`Rejection::Contradicted`].
    pub contradicted: u64,
    /// Rejections as [`Rejection::Unconfirmed`].
    pub unconfirmed: u64,
    /// Rejections as [`Rejection::Recovering`].
    pub recovering: u64,
}

impl Counts {
    /// Poses that came.
    pub fn all(&self) -> u64 {
        self.accepted + self.rejected()
    }

    /// Poses that were not used, for whatever reason.
    pub fn rejected(&self) -> u64 {
        self.not_finite
            + self.wrong_frame
            + self.out_of_range
            + self.from_the_future
            + self.too_old
            + self.not_newer
            + self.jumps
            + self.contradicted
            + self.unconfirmed
            + self.recovering
    }

    pub(super) fn count(&mut self, rejection: &Rejection) {
        let counter = match rejection {
            Rejection::NotFinite { .. } => &mut self.not_finite,
            Rejection::WrongFrame => &mut self.wrong_frame,
            Rejection::OutOfRange { .. } => &mut self.out_of_range,
            Rejection::FromTheFuture { .. } => &mut self.from_the_future,
            Rejection::TooOld { .. } => &mut self.too_old,
            Rejection::NotNewer { .. } | Rejection::OftenLate { .. } | Rejection::TwoAtOnce { .. } => {
                &mut self.not_newer
            }
            Rejection::Jump { .. } => &mut self.jumps,
            Rejection::Contradicted { .. } => &mut self.contradicted,
            Rejection::Unconfirmed { .. } => &mut self.unconfirmed,
            Rejection::Recovering { .. } => &mut self.recovering,
        };
        *counter += 1;
    }
}
