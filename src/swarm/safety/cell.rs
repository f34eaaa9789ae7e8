//! A member's cell: the intersection of half-planes in which it may move, and the point of it that is
//! nearest to where the member wants to go.
//!
//! Everything is relative to the member's own place, so that a half-plane whose offset is not
//! negative contains the member, and a cell of such half-planes is never empty.

use crate::geometry::point::{dot, minus};

/// The points `x` with `normal . x <= offset` \[m\], relative to the member.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfPlane {
    /// Unit vector that points out of the half-plane.
    pub normal: [f64; 2],
    /// Distance of the member from the border \[m\]; negative if the member stands outside.
    pub offset: f64,
}

/// An intersection of half-planes.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    pub planes: Vec<HalfPlane>,
}

/// Rounding that is no violation, in units of the lengths involved \[1\].
const ROUNDING: f64 = 1e-13;

/// Shares of the way back into its cell that a member outside it tries to make in one step.
const SHARES: [f64; 6] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.0];

impl Cell {
    /// Whether the member stands outside by more than rounding.
    pub fn is_left(&self) -> bool {
        self.planes.iter().any(|plane| plane.offset < 0.0)
    }

    /// Whether no point within `reach` \[m\] of the member is in it.
    pub fn is_empty(&self, reach: f64) -> bool {
        self.is_left() && self.projection([0.0; 2], reach, 1.0).is_none()
    }

    /// How far outside the half-plane that it is farthest from a point is \[m\]; negative inside.
    pub fn excess(&self, point: [f64; 2]) -> f64 {
        let beyond = |plane: &HalfPlane| dot(plane.normal, point) - plane.offset;
        self.planes.iter().map(beyond).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The point of the cell within `reach` \[m\] of the member that is nearest to `wanted` \[m\], and the way
    /// to it free: a step along the straight line from the member to the point, of any length, comes no
    /// nearer to anything than allowed.
    ///
    /// Where the member stands outside (negative offsets) and the cell is empty, it is brought back as
    /// large a share of the way as leaves a cell, and at least moves no further out. Never fails: where
    /// there is nowhere to go the member stays.
    pub fn nearest(&self, wanted: [f64; 2], reach: f64) -> [f64; 2] {
        let shares = if self.is_left() { &SHARES[..] } else { &SHARES[..1] };
        let found = shares.iter().find_map(|&share| self.projection(wanted, reach, share));
        let point = found.unwrap_or_default();
        // Cut where it leaves a half-plane, whatever rounding did before.
        let share = self.share(point);
        [share * point[0], share * point[1]]
    }

    /// Projection of `wanted` onto the cell whose negative offsets count only this share, and onto the
    /// disc of radius `reach`; `None` if that is empty. Half-plane after half-plane: where one is violated
    /// the optimum lies on its border (Seidel, "Small-dimensional linear programming and convex hulls
    /// made easy", 1991).
    fn projection(&self, wanted: [f64; 2], reach: f64, share: f64) -> Option<[f64; 2]> {
        let mut point = shortened(wanted, reach);
        for (k, plane) in self.planes.iter().enumerate() {
            if dot(plane.normal, point) > plane.shared(reach, share) {
                point = self.on_border(k, wanted, reach, share)?;
            }
        }
        Some(point)
    }

    /// The point nearest to `wanted` on the border of half-plane `k` and in all before it.
    fn on_border(&self, k: usize, wanted: [f64; 2], reach: f64, share: f64) -> Option<[f64; 2]> {
        let HalfPlane { normal, .. } = self.planes[k];
        let offset = self.planes[k].shared(reach, share);
        let along = [-normal[1], normal[0]];
        let foot = [offset * normal[0], offset * normal[1]];
        let half_chord = (reach * reach - offset * offset).max(0.0).sqrt();
        let (mut low, mut high) = (-half_chord, half_chord);
        for plane in &self.planes[..k] {
            let slope = dot(plane.normal, along);
            let other = plane.shared(reach, share);
            let room = other - dot(plane.normal, foot);
            if slope.abs() <= ROUNDING {
                // Parallel: either all of the border is inside or none of it.
                if room < -ROUNDING * (offset.abs() + other.abs()) {
                    return None;
                }
            } else if slope > 0.0 {
                high = high.min(room / slope);
            } else {
                low = low.max(room / slope);
            }
        }
        if low > high + ROUNDING * (low.abs() + high.abs()) {
            return None;
        }
        // `low` may exceed `high` by rounding: then either will do.
        let at = dot(wanted, along).max(low).min(high);
        Some([foot[0] + at * along[0], foot[1] + at * along[1]])
    }

    /// The share of the straight way to `point` \[m\] that leads no further out of any half-plane \[1\].
    pub fn share(&self, point: [f64; 2]) -> f64 {
        let length = length(point);
        let mut share = 1.0_f64;
        for plane in &self.planes {
            let (forward, allowed) = (dot(plane.normal, point), plane.offset.max(0.0));
            if forward > allowed + ROUNDING * (length + allowed) {
                share = share.min(allowed / forward);
            }
        }
        share
    }
}

impl HalfPlane {
    /// The offset, of which only a share counts where it is negative, and no more than is in reach.
    fn shared(&self, reach: f64, share: f64) -> f64 {
        if self.offset < 0.0 { share * self.offset.max(-reach) } else { self.offset }
    }
}

/// As `hypot`, without the call where the squares are in range.
pub fn length(way: [f64; 2]) -> f64 {
    let square = dot(way, way);
    if (1e-200..1e200).contains(&square) { square.sqrt() } else { way[0].hypot(way[1]) }
}

/// The way, or as much of it as is `most` \[m\] long.
pub fn shortened(way: [f64; 2], most: f64) -> [f64; 2] {
    let length = length(way);
    if length <= most {
        return way;
    }
    let share = most / length;
    [share * way[0], share * way[1]]
}

/// The point of a segment that is nearest to a place.
pub(in crate::swarm) fn foot([a, b]: [[f64; 2]; 2], place: [f64; 2]) -> [f64; 2] {
    let (along, way) = (minus(b, a), minus(place, a));
    let square = dot(along, along);
    let share = if square > 0.0 { (dot(along, way) / square).clamp(0.0, 1.0) } else { 0.0 };
    [a[0] + share * along[0], a[1] + share * along[1]]
}

/// The points of two segments that are nearest to each other, of the first and of the second. Of segments that
/// cross one end and the point of the other nearest to it: they have no distance that could be kept.
pub fn nearest(first: [[f64; 2]; 2], second: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    // In a plane, where segments do not cross, one of the four ends is nearest.
    let ways = [
        [first[0], foot(second, first[0])],
        [foot(first, second[0]), second[0]],
        [first[1], foot(second, first[1])],
        [foot(first, second[1]), second[1]],
    ];
    let apart = |[a, b]: &[[f64; 2]; 2]| dot(minus(*b, *a), minus(*b, *a));
    ways.into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(ways[0])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::geometry::point::distance;
    use proptest::prelude::*;

    fn cell(planes: &[(f64, f64)]) -> Cell {
        let planes = planes.iter();
        Cell {
            planes: planes
                .map(|&(angle, offset)| HalfPlane { normal: [angle.cos(), angle.sin()], offset })
                .collect(),
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn the_projection_lies_in_the_cell_and_no_point_of_the_cell_is_nearer(
            planes in prop::collection::vec((0.0..6.3, 0.0..1.0), 0..12),
            wanted in prop::array::uniform2(-3.0..3.0),
            reach in 0.1..4.0,
            scale in prop::sample::select(vec![1e-9, 1e-3, 1.0, 1e6]),
            samples in prop::collection::vec(prop::array::uniform2(-1.0..1.0), 200),
        ) {
            let planes: Vec<_> = planes.iter().map(|(angle, offset)| (*angle, scale * offset)).collect();
            let (cell, reach) = (cell(&planes), scale * reach);
            let wanted = [scale * wanted[0], scale * wanted[1]];
            let found = cell.nearest(wanted, reach);
            prop_assert!(cell.excess(found) <= 1e-12 * scale && length(found) <= reach * (1.0 + 1e-12));
            for [x, y] in samples {
                // Near the point that was found, where a better one would have to be, and anywhere.
                for size in [1e-6, 1e-2, 1.0] {
                    let other = [found[0] + scale * size * x, found[1] + scale * size * y];
                    if cell.excess(other) <= 0.0 && length(other) <= reach {
                        let gain = distance(wanted, found) - distance(wanted, other);
                        prop_assert!(gain <= 1e-9 * scale, "{other:?} beats {found:?} by {gain}");
                    }
                }
            }
        }

        #[test]
        fn a_member_outside_moves_no_further_out(
            planes in prop::collection::vec((0.0..6.3, -1.0..1.0), 1..8),
            wanted in prop::array::uniform2(-3.0..3.0),
            reach in 0.1..4.0,
        ) {
            let cell = cell(&planes);
            let found = cell.nearest(wanted, reach);
            prop_assert!(length(found) <= reach * (1.0 + 1e-12));
            for plane in &cell.planes {
                let forward = dot(plane.normal, found);
                prop_assert!(forward <= plane.offset.max(0.0) + 1e-12, "{plane:?}: {forward}");
            }
        }
    }

    #[test]
    fn degenerate_cells_leave_the_member_where_it_is_or_on_its_line() {
        let (east, north, west, south) = (0.0, FRAC_PI_2, PI, 3.0 * FRAC_PI_2);
        let point = cell(&[(east, 0.0), (north, 0.0), (west, 0.0), (south, 0.0)]);
        assert!(length(point.nearest([2.0, 1.0], 9.0)) < 1e-12);
        let line = cell(&[(east, 0.0), (west, 0.0), (east, 0.0)]);
        assert!(distance(line.nearest([2.0, 1.0], 9.0), [0.0, 1.0]) < 1e-12);
        let needle = cell(&[(1e-9, 0.0), (west, 0.0)]);
        assert!(needle.nearest([2.0, 1.0], 9.0)[0].abs() < 1e-8);
    }

    #[test]
    fn a_member_outside_two_half_planes_comes_back_into_both_or_stays_between() {
        let corner = cell(&[(0.0, -0.5), (FRAC_PI_2, -0.25)]);
        assert!(distance(corner.nearest([3.0, 3.0], 9.0), [-0.5, -0.25]) < 1e-12);
        let trap = cell(&[(0.0, -0.5), (PI, -0.25)]);
        assert!(trap.nearest([3.0, 0.0], 9.0)[0].abs() < 1e-12);
        let far = cell(&[(0.0, -0.5)]);
        assert!(distance(far.nearest([3.0, 0.0], 0.125), [-0.125, 0.0]) < 1e-9, "as far as in reach");
    }

    #[test]
    fn without_planes_the_wanted_point_comes_back_to_the_bit() {
        assert_eq!(cell(&[]).nearest([0.1, -0.3], f64::INFINITY), [0.1, -0.3]);
    }
}
