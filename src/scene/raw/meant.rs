//! Choices as written become those of the core that have the same names.

use super::*;
use crate::flock::condition::Quantity;
use crate::flock::fracture::Ghosts;
use crate::flock::motion::Interpolation;
use crate::flock::region::Side;
use crate::flock::role::Role;
use crate::flock::rules::{Axis, FeedbackReference, Rotation};
use crate::material::elastic::Plane;
use crate::solve::equilibrium::Precision;
use crate::sweep::Order;

macro_rules! meant {
    ($($raw:ident => $meant:ident: $($choice:ident),+;)+) => {$(
        impl From<$raw> for $meant {
            fn from(raw: $raw) -> Self {
                match raw {
                    $($raw::$choice => Self::$choice,)+
                }
            }
        }
    )+};
}

meant! {
    RawAxis => Axis: X, Y;
    RawFeedbackReference => FeedbackReference: Initial, Previous;
    RawGhosts => Ghosts: Lattice, Mirrored, None;
    RawInterpolation => Interpolation: Linear, Smooth, Hold;
    RawOrder => Order: Synchronous, Sequential;
    RawPlane => Plane: Stress, Strain;
    RawPrecision => Precision: F64, F32;
    RawQuantity => Quantity: X, Y, Displacement, Pe1, Pe2;
    RawRole => Role: Follower, Leader, Clamped, Ghost;
    RawRotation => Rotation: Small, Corotated;
    RawSide => Side: Left, Right, Bottom, Top;
}
