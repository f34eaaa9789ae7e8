//! Whether loads and reactions of a body are in balance, whatever its followers are left with.
//!
//! A tolerance is a part of the force that leaders would need with all followers at zero. Where a slender body needs a thousandth of
//! it, followers may seem at rest and what holds the body is still some percent off; loads and reactions say so.

use super::whole::Whole;
use crate::flock::law::Flock;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::{Point, cross, minus};

/// Part of loads and reactions that need not balance \[1\], and the same over the tolerance of the solve.
const BALANCED: f64 = 1e-7;
const TOLERATED: f64 = 10.0;
/// Roundings of what neighbours pull with that need not balance either \[1\].
const ROUNDINGS: f64 = 16.0;

/// Resultants of the forces on a body from outside, and their sizes added up.
pub(super) struct Outer {
    force: [f64; 2],
    moment: f64,
    /// Of forces \[force\] and moments \[force length\].
    sizes: [f64; 2],
}

impl Outer {
    /// Loads, and reactions of the components that are `held`, of a body of which a particle is at `place`, and is pulled by its
    /// neighbours with `inner`. Displacements are what rounding is a part of.
    pub fn of(
        (flock, whole): (&Flock, &Whole<'_>),
        held: impl Fn(usize) -> [bool; 2],
        load: impl Fn(usize) -> [f64; 2],
        inner: impl Fn(usize) -> [f64; 2],
        place: impl Fn(usize) -> Point,
        displacement: &Vectors,
    ) -> Self {
        let (low, high) = whole.body.bounds();
        let middle = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        let [x, y, moment, forces, moments, pulls] = whole.sum(|i| {
            let (mut outer, held) = (load(i), held(i));
            let is_held = held.contains(&true);
            let pulls = if is_held { flock.pulls_under(i, displacement) } else { 0.0 };
            if is_held {
                let inner = inner(i);
                (0..2).filter(|&axis| held[axis]).for_each(|axis| outer[axis] = -inner[axis]);
            }
            let moment = cross(minus(place(i), middle), outer);
            [outer[0], outer[1], moment, outer[0].hypot(outer[1]), moment.abs(), pulls]
        });
        // Of a body that is only carried about reactions are rounding.
        let rounding = ROUNDINGS * f64::EPSILON * pulls / BALANCED;
        let moments = moments.max(forces * whole.body.lattice.spacing()).max(rounding * distance(low, high));
        Self { force: [x, y], moment, sizes: [forces.max(rounding), moments] }
    }

    /// The part of forces, or of moments, by which they are not in balance \[1\]; not a number without any. Of a body that was `before`
    /// under more than now, the part of that.
    pub fn off(&self, before: Option<&Self>) -> f64 {
        let of = before.map_or(self.sizes, |before| [0, 1].map(|k| self.sizes[k].max(before.sizes[k])));
        (self.force[0].hypot(self.force[1]) / of[0]).max(self.moment.abs() / of[1])
    }
}

/// Whether so much is more than the tolerance of a solve leaves.
pub(super) fn is_too_much(off: f64, tolerance: f64) -> bool {
    off > BALANCED.max(TOLERATED * tolerance)
}
