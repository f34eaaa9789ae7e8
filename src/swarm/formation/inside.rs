//! Members inside a body: how much each corner of the cell around a place has a share in it.

use crate::flock::vectors::Vectors;
use crate::geometry::point::{cross, dot, minus};
use crate::material::cells::Cells;

/// Shares of the corners of the cell that holds `place` \[length\]; `None` outside the body.
///
/// Mean value coordinates (M. S. Floater, *Mean value coordinates*, 2003): they sum to one, reproduce the place,
/// and so carry any affine motion over exactly, in triangles, rectangles and hexagons alike.
pub fn shares(cells: &Cells, reference: &Vectors, place: [f64; 2]) -> Option<Vec<(u32, f64)>> {
    cells.iter().find_map(|corners| {
        let at: Vec<[f64; 2]> = corners.iter().map(|&i| reference.get(i as usize)).collect();
        let weights = mean_value(&at, place)?;
        Some(corners.iter().copied().zip(weights).filter(|&(_, share)| share != 0.0).collect())
    })
}

/// The place that has these shares.
pub fn place(shares: &[(u32, f64)], present: &Vectors) -> [f64; 2] {
    shares.iter().fold([0.0; 2], |[a, b], &(i, share)| {
        let [x, y] = present.get(i as usize);
        [a + share * x, b + share * y]
    })
}

/// Coordinates of a place with respect to the corners (counter-clockwise) of a convex polygon; `None` outside it.
fn mean_value(corners: &[[f64; 2]], place: [f64; 2]) -> Option<Vec<f64>> {
    let count = corners.len();
    let rays: Vec<[f64; 2]> = corners.iter().map(|&corner| minus(corner, place)).collect();
    let lengths: Vec<f64> = rays.iter().map(|r| f64::hypot(r[0], r[1])).collect();
    let size = lengths.iter().copied().fold(0.0, f64::max);
    let tolerance = 1e-9 * size;
    let only = |k: usize, share: f64, next: f64| {
        let mut all = vec![0.0; count];
        all[k] = share;
        all[(k + 1) % count] += next;
        all
    };
    if let Some(k) = (0..count).find(|&k| lengths[k] <= tolerance) {
        return Some(only(k, 1.0, 0.0));
    }
    let mut half_tangents = Vec::with_capacity(count);
    for k in 0..count {
        let (a, b) = (rays[k], rays[(k + 1) % count]);
        let (cross, dot) = (cross(a, b), dot(a, b));
        let along = lengths[k] * lengths[(k + 1) % count];
        if cross < -tolerance * size {
            return None;
        }
        if cross <= tolerance * size {
            // On the line of a side: on the side itself, or outside.
            let whole = lengths[k] + lengths[(k + 1) % count];
            return (dot < 0.0).then(|| only(k, lengths[(k + 1) % count] / whole, lengths[k] / whole));
        }
        half_tangents.push((along - dot) / cross);
    }
    let raw: Vec<f64> = (0..count)
        .map(|k| (half_tangents[(k + count - 1) % count] + half_tangents[k]) / lengths[k])
        .collect();
    let sum: f64 = raw.iter().sum();
    Some(raw.iter().map(|weight| weight / sum).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEXAGON: [[f64; 2]; 6] =
        [[1.0, 0.0], [0.5, 0.9], [-0.5, 0.9], [-1.0, 0.0], [-0.5, -0.9], [0.5, -0.9]];

    #[test]
    fn shares_sum_to_one_and_reproduce_the_place() {
        for place in [[0.0, 0.0], [0.3, -0.2], [-0.9, 0.05], [0.5, 0.9], [0.0, 0.9], [0.75, 0.45]] {
            let shares = mean_value(&HEXAGON, place).unwrap_or_else(|| panic!("{place:?} is inside"));
            let [x, y] =
                shares.iter().zip(HEXAGON).fold([0.0; 2], |[a, b], (w, c)| [a + w * c[0], b + w * c[1]]);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!((x - place[0]).abs() < 1e-9 && (y - place[1]).abs() < 1e-9, "{place:?}: {x} {y}");
            assert!(shares.iter().all(|&share| share >= 0.0));
        }
    }

    #[test]
    fn places_outside_have_no_shares() {
        for place in [[1.2, 0.0], [0.0, 1.0], [2.0, 0.9], [0.9, 0.9]] {
            assert_eq!(mean_value(&HEXAGON, place), None, "{place:?}");
        }
    }
}
