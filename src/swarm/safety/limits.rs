//! The limits that robots have to keep.

use super::deadlock::Patience;

/// The limits that the filter enforces on every member.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Highest speed \[m/s\]; default none (infinite). It also bounds how far a member may have strayed
    /// from an old pose: without it old poses are taken for present ones.
    pub speed: f64,
    /// Highest acceleration \[m/s^2\]; default none (infinite). It takes velocities to hold it.
    pub acceleration: f64,
    /// Whether members take time to brake, and do so by themselves to stand still at a target, as double
    /// integrators under a position controller do; default no. With an acceleration limit they are sent to where
    /// they come to rest after the next step.
    pub brakes: bool,
    /// Whether members are at their targets after a period, however far; default no. Successive targets
    /// of members whose poses are late then keep the speed limit among themselves.
    pub arrives: bool,
    /// Standard deviation of each coordinate of a pose \[m\]; default 0. Everything is kept farther away by
    /// three deviations of each member that it concerns.
    pub deviation: f64,
    /// Whether members are kept apart from each other at all; default yes. Without it the clearance is
    /// that from obstacles.
    pub keeps_apart: bool,
    /// Free space kept between the rims of two members, and of a member and an obstacle \[m\];
    /// default 0.
    pub clearance: f64,
    /// Polygon that every member's disc stays inside \[m, world frame\], vertices in order, either way
    /// round, convex or not; default none.
    pub geofence: Option<Vec<[f64; 2]>>,
    /// Conditions for a blocked member's detour; default after 3 ticks.
    pub patience: Patience,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            speed: f64::INFINITY,
            acceleration: f64::INFINITY,
            brakes: false,
            arrives: false,
            deviation: 0.0,
            keeps_apart: true,
            clearance: 0.0,
            geofence: None,
            patience: Patience::default(),
        }
    }
}

/// Error building a filter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SafetyError {
    /// A limit is out of its range.
    #[error("limit `{name}` = {value}: give a number {range}, or leave it out for {default}")]
    Limit {
        /// Which limit.
        name: &'static str,
        /// The given value, in the limit's unit.
        value: f64,
        /// The range, in words.
        range: &'static str,
        /// The default, in words.
        default: &'static str,
    },
    /// A member's radius is negative or not finite.
    #[error("radius of member {member} = {radius} m: give a number from 0 up")]
    Radius {
        /// Number of the member.
        member: usize,
        /// The given value \[m\].
        radius: f64,
    },
    /// A polygon of one or two corners, or none.
    #[error("{place} has {count} corners: give at least 3")]
    Corners {
        /// Which shape.
        place: Place,
        /// Corners that it has.
        count: usize,
    },
    /// A shape has a number that is not finite, or too large to compute with.
    #[error("{place} has a number that is not finite or beyond 1e100 m: give finite coordinates in metres")]
    NotFinite {
        /// Which shape.
        place: Place,
    },
    /// A polygon's corners lie on one line, to rounding.
    #[error("{place} has no area: give corners that do not lie on one line")]
    NoArea {
        /// Which shape.
        place: Place,
    },
    /// Two edges of a polygon cross or touch that are no neighbours.
    #[error("{place}: edges {first} and {second} (from 0) cross: give corners in order around the shape")]
    Crossing {
        /// Which shape.
        place: Place,
        /// Number of one edge, from 0.
        first: usize,
        /// Number of the other edge, from 0.
        second: usize,
    },
    /// So many edges run side by side that to compare each with those beside it would take minutes.
    #[error(
        "{place}: too many of its {count} edges run side by side to be checked for crossings: give fewer corners"
    )]
    TooDense {
        /// Which shape.
        place: Place,
        /// Number of edges.
        count: usize,
    },
    /// A disc has no size.
    #[error("{place} has radius {radius} m: give a positive number")]
    Disc {
        /// Which shape.
        place: Place,
        /// The given value \[m\].
        radius: f64,
    },
}

/// The shape that an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The polygon that all members stay inside.
    Geofence,
    /// By its index in the list of obstacles.
    Obstacle(usize),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Geofence => write!(f, "the geofence"),
            Place::Obstacle(index) => write!(f, "obstacle {index} (from 0)"),
        }
    }
}

impl Limits {
    /// Refuses limits that are negative or not numbers.
    pub(super) fn check(&self) -> Result<(), SafetyError> {
        let positive = [("speed", self.speed), ("acceleration", self.acceleration)];
        for (name, value) in positive {
            if value.is_nan() || value <= 0.0 {
                return Err(SafetyError::Limit { name, value, range: "above 0", default: "no limit" });
            }
        }
        for (name, value) in [("clearance", self.clearance), ("deviation", self.deviation)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(SafetyError::Limit { name, value, range: "from 0 up", default: "0" });
            }
        }
        Ok(())
    }

    /// The widening of a member's distances for its noise \[m\].
    pub(in crate::swarm) fn margin(&self) -> f64 {
        3.0 * self.deviation
    }
}
