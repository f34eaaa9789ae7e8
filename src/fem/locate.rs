//! Which cell holds a point, and where in it: boxes, then a bounded Newton's method on the isoparametric map.

use super::element::{CENTRE, Shape, clamped, contains};
use super::mesh::Mesh;
use crate::geometry::box_tree::BoxTree;
use crate::geometry::point::{Point, bounds, distance};

/// Newton steps at most; a point of the cell is reached in fewer than ten.
const STEPS: usize = 20;
/// How far outside the reference cell a point may be found and still count as in it [-].
const SLACK: f64 = 1e-8;

/// The cells that hold each point, or are no further than `reach` \[m\] from it, with reference coordinates that continue them to it:
/// the nearest first, of those equally near the lowest-numbered one.
pub(crate) fn cells_near(mesh: &Mesh, points: &[Point], reach: f64) -> Vec<Vec<(usize, Point)>> {
    // A mesh has far more cells than there are points asked for: it is these that are put in order.
    let boxes = BoxTree::new(points.iter().map(|p| (p.map(|v| v - reach), p.map(|v| v + reach))));
    let mut near: Vec<Vec<(f64, usize, Point)>> = vec![Vec::new(); points.len()];
    for cell in 0..mesh.cell_count() {
        let (low, high) = bounds(mesh.positions(cell));
        // A curved side may bulge beyond its nodes by less than an eighth of the cell.
        let margin = (0.125 + 4.0 * SLACK) * (high[0] - low[0]).max(high[1] - low[1]);
        for point in boxes.overlapping(low.map(|v| v - margin), high.map(|v| v + margin)) {
            let Some(place) = invert(mesh, cell, points[point]) else { continue };
            let within = || Shape::at(clamped(place)).interpolate(&mesh.positions(cell));
            let holds = contains(place, SLACK);
            let apart = if holds { 0.0 } else { distance(points[point], within()) };
            if holds || (reach > 0.0 && apart <= reach) {
                near[point].push((apart, cell, place));
            }
        }
    }
    let in_order = |mut near: Vec<(f64, usize, Point)>| {
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.into_iter().map(|(_, cell, place)| (cell, place)).collect()
    };
    near.into_iter().map(in_order).collect()
}

/// Reference coordinates of a point \[m\] in a cell, which need not hold it; `None` if there are none nearby.
pub(crate) fn invert(mesh: &Mesh, cell: usize, p: [f64; 2]) -> Option<[f64; 2]> {
    let (at, mut r) = (mesh.positions(cell), CENTRE);
    for _ in 0..STEPS {
        let shape = Shape::at(r);
        let q = shape.interpolate(&at);
        let ([dx, dy], j) = ([p[0] - q[0], p[1] - q[1]], shape.jacobian(&at));
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let step = [(j[1][1] * dx - j[0][1] * dy) / det, (j[0][0] * dy - j[1][0] * dx) / det];
        r = [r[0] + step[0], r[1] + step[1]];
        if !(r[0].abs() < 1e3 && r[1].abs() < 1e3) {
            return None;
        }
        if step[0].abs().max(step[1].abs()) < 0.1 * SLACK {
            return Some(r);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_a_distorted_mesh_is_found_and_maps_back_and_points_outside_are_not() {
        let ring = Mesh::rectangle([7, 5], [0.0, 0.0], [1.0, 1.0]).mapped(|x, y| {
            let (r, t) = (1.0 + x, 1.2 * y);
            [r * t.cos(), r * t.sin()]
        });
        let mesh = ring.unwrap();
        let inside = |k: i32| {
            let k = f64::from(k);
            let (r, t) = (1.02 + 0.94 * (k * 0.618).fract(), 0.01 + 1.18 * (k * 0.414).fract());
            [r * t.cos(), r * t.sin()]
        };
        let points: Vec<Point> = (1..400).map(inside).collect();
        for (p, near) in points.iter().zip(cells_near(&mesh, &points, 0.0)) {
            let &(cell, place) = near.first().unwrap_or_else(|| panic!("{p:?}"));
            let q = Shape::at(place).interpolate(&mesh.positions(cell));
            assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-12, "{p:?} {q:?}");
        }
        let outside =
            [[0.0, 0.0], [0.9, 0.1], [5.0, 5.0], [-1.0, 0.5], [f64::NAN, 0.0], [f64::INFINITY, 1.0]];
        for (p, near) in outside.iter().zip(cells_near(&mesh, &outside, 0.0)) {
            assert!(near.is_empty(), "{p:?}");
        }
    }
}
