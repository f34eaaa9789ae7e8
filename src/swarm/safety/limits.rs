//! The limits that robots have to keep.

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
    /// Ticks without progress before a blocked member makes a detour, and with progress before that ends; default 3. At 0
    /// no member makes one.
    pub patience: u32,
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
            patience: 3,
        }
    }
}

/// Error building a filter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}{fault}")]
pub struct SafetyError {
    /// The number or shape that is at fault.
    pub place: Place,
    /// The fault and the remedy, as they follow its name.
    pub fault: String,
}

/// The number or shape that an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Place {
    /// A limit, by its name.
    #[error("limit `{0}`")]
    Limit(&'static str),
    /// The radius of a member, by its number.
    #[error("radius of member {0}")]
    Radius(usize),
    /// The polygon that all members stay inside.
    #[error("the geofence")]
    Geofence,
    /// By its index in the list of obstacles.
    #[error("obstacle {0} (from 0)")]
    Obstacle(usize),
}

impl Place {
    /// Refuses it, for a fault that is worded as it follows its name.
    pub(in crate::swarm) fn refused(self, fault: impl Into<String>) -> SafetyError {
        SafetyError { place: self, fault: fault.into() }
    }
}

impl Limits {
    /// The acceleration that members brake by themselves with \[m/s^2\], where they do.
    pub(crate) fn braking(&self) -> Option<f64> {
        Some(self.acceleration).filter(|acceleration| self.brakes && acceleration.is_finite())
    }

    /// Refuses limits that are negative or not numbers.
    pub(super) fn check(&self) -> Result<(), SafetyError> {
        let refused = |name, value: f64, range: &str| {
            Err(Place::Limit(name).refused(format!(" = {value}: give a number {range}")))
        };
        for (name, value) in [("speed", self.speed), ("acceleration", self.acceleration)] {
            if value.is_nan() || value <= 0.0 {
                return refused(name, value, "above 0, or leave it out for no limit");
            }
        }
        for (name, value) in [("clearance", self.clearance), ("deviation", self.deviation)] {
            if !(value.is_finite() && value >= 0.0) {
                return refused(name, value, "from 0 up, or leave it out for 0");
            }
        }
        Ok(())
    }

    /// The widening of a member's distances for its noise \[m\].
    pub(in crate::swarm) fn margin(&self) -> f64 {
        3.0 * self.deviation
    }
}
