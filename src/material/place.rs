//! Values at any place of a body, from those of its particles.

use super::cells::Cells;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::lists::sides;
use crate::geometry::piece::Piece;
use crate::geometry::point::{Point, dot, minus};
use crate::geometry::shape::is_in_polygon;

/// The particles around a place, and shares with which they stand for it: linear fields are met exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct Around {
    /// The cell that it is in: the first of several.
    pub cell: usize,
    /// Indices of the particles.
    pub particles: Vec<u32>,
    /// They add up to 1.
    pub shares: Vec<f64>,
}

impl Around {
    /// Of the point nearest to a place \[length\] of some of the cells, and how far it is \[length\]; `None` of no cells.
    pub fn nearest(
        place: Point,
        (cells, among): (&Cells, impl Iterator<Item = usize>),
        reference: &Vectors,
    ) -> Option<(Self, f64)> {
        let corners = |cell: &[u32]| cell.iter().map(|&i| reference.get(i as usize)).collect::<Vec<Point>>();
        let near = among.map(|cell| {
            let at = nearest(&corners(cells.of(cell)), place);
            (cell, at, distance(at, place))
        });
        let (cell, at, apart) = near.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let particles = cells.of(cell).to_vec();
        let shares = shares(&corners(&particles), at);
        Some((Self { cell, particles, shares }, apart))
    }

    /// The particles that stand for the place, with their shares: two of them on a side of the cell, one at a corner.
    pub fn standing(&self) -> impl Iterator<Item = (usize, f64)> {
        let all = self.particles.iter().zip(&self.shares).filter(|(_, share)| **share != 0.0);
        all.map(|(&particle, &share)| (particle as usize, share))
    }

    /// The mean of what the particles have, by their shares, shape \[components\]; those that have nothing are left out.
    pub fn mean<const N: usize>(&self, has: impl Fn(usize) -> Option<[f64; N]>) -> Option<[f64; N]> {
        let (mut sum, mut whole) = ([0.0; N], 0.0);
        for (particle, share) in self.standing() {
            if let Some(values) = has(particle) {
                whole += share;
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += share * value);
            }
        }
        (whole != 0.0).then(|| sum.map(|sum| sum / whole))
    }
}

/// The point of a polygon nearest to a place: itself inside.
fn nearest(corners: &[Point], place: Point) -> Point {
    if is_in_polygon(corners, place) {
        return place;
    }
    let on_side = |[a, b]: [Point; 2]| {
        let side = Piece::edge(a, b);
        side.point(side.nearest(place))
    };
    sides(corners)
        .map(on_side)
        .min_by(|a, b| distance(*a, place).total_cmp(&distance(*b, place)))
        .unwrap_or(place)
}

/// Mean value coordinates: K. Hormann and M. S. Floater, ACM Trans. Graph. 25 (2006) 1424-1441, for any polygon.
fn shares(corners: &[Point], place: Point) -> Vec<f64> {
    let count = corners.len();
    let to: Vec<Point> = corners.iter().map(|&corner| minus(corner, place)).collect();
    let far: Vec<f64> = to.iter().map(|v| v[0].hypot(v[1])).collect();
    let size = far.iter().copied().fold(0.0, f64::max);
    if let Some(k) = (0..count).find(|&k| far[k] <= 1e-12 * size) {
        return (0..count).map(|i| f64::from(i == k)).collect();
    }
    let mut half_tangents = vec![0.0; count];
    for k in 0..count {
        let next = (k + 1) % count;
        let (across, along) = (to[k][0] * to[next][1] - to[k][1] * to[next][0], dot(to[k], to[next]));
        if across.abs() > 1e-12 * size * size {
            half_tangents[k] = (far[k] * far[next] - along) / across;
        } else if along < 0.0 {
            // On the side between both.
            let mut on_side = vec![0.0; count];
            let length = far[k] + far[next];
            (on_side[k], on_side[next]) = (far[next] / length, far[k] / length);
            return on_side;
        }
    }
    let weights: Vec<f64> =
        (0..count).map(|k| (half_tangents[(k + count - 1) % count] + half_tangents[k]) / far[k]).collect();
    let whole: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / whole).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_fields_are_met_inside_on_sides_at_corners_and_in_notched_polygons() {
        let notched = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 1.0], [0.0, 3.0]];
        for place in [[1.0, 0.5], [3.3, 1.9], [2.0, 0.0], [4.0, 1.0], [2.0, 1.0], [2.0, 0.999], [3.0, 2.0]] {
            let shares = shares(&notched, place);
            let mean = |k: usize| shares.iter().zip(&notched).map(|(share, p)| share * p[k]).sum::<f64>();
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!((0..2).all(|k| (mean(k) - place[k]).abs() < 1e-12), "{place:?}: {shares:?}");
            assert_eq!(nearest(&notched, place), place);
        }
        assert_eq!(nearest(&notched, [2.0, 3.0]), [3.0, 2.0]);
        assert_eq!(nearest(&notched, [5.0, -1.0]), [4.0, 0.0]);
    }
}
