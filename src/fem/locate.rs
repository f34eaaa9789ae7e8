//! Which cell holds a point, and where in it: the boxes of cells, then a bounded Newton's method on the isoparametric map.

use super::element::{CENTRE, Shape, clamped, contains};
use super::mesh::Mesh;
use crate::geometry::box_tree::BoxTree;
use crate::geometry::point::{bounds, distance};

/// Newton steps at most; a point of the cell is reached in fewer than ten.
const STEPS: usize = 20;
/// How far outside the reference cell a point may be found and still count as in it [-].
const SLACK: f64 = 1e-8;

/// A search structure over the cells of one mesh.
pub(crate) struct Locator<'m> {
    mesh: &'m Mesh,
    boxes: BoxTree,
}

impl<'m> Locator<'m> {
    pub fn new(mesh: &'m Mesh) -> Locator<'m> {
        let of_cell = |cell: usize| {
            let (low, high) = bounds(mesh.positions(cell));
            // A curved side may bulge beyond its nodes by less than an eighth of the cell.
            let margin = (0.125 + 4.0 * SLACK) * (high[0] - low[0]).max(high[1] - low[1]);
            (low.map(|v| v - margin), high.map(|v| v + margin))
        };
        Locator { mesh, boxes: BoxTree::new((0..mesh.cell_count()).map(of_cell)) }
    }

    /// The cells that hold `p` \[m\], or are no further than `reach` \[m\] from it, with reference coordinates that continue them to
    /// it: the nearest first, of those equally near the lowest-numbered one.
    pub fn near(&self, p: [f64; 2], reach: f64) -> Vec<(usize, [f64; 2])> {
        let near = self.boxes.overlapping(p.map(|v| v - reach), p.map(|v| v + reach)).filter_map(|cell| {
            let place = invert(self.mesh, cell, p)?;
            if contains(place, SLACK) {
                return Some((0.0, cell, place));
            }
            let within = Shape::at(clamped(place)).interpolate(&self.mesh.positions(cell));
            let apart = distance(p, within);
            (reach > 0.0 && apart <= reach).then_some((apart, cell, place))
        });
        let mut near: Vec<_> = near.collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.into_iter().map(|(_, cell, place)| (cell, place)).collect()
    }
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
        let locator = Locator::new(&mesh);
        for k in 1..400 {
            let (r, t) = (1.02 + 0.94 * (k as f64 * 0.618).fract(), 0.01 + 1.18 * (k as f64 * 0.414).fract());
            let p = [r * t.cos(), r * t.sin()];
            let (cell, place) = locator.near(p, 0.0).first().copied().unwrap_or_else(|| panic!("{p:?}"));
            let q = Shape::at(place).interpolate(&mesh.positions(cell));
            assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-12, "{p:?} {q:?}");
        }
        for p in [[0.0, 0.0], [0.9, 0.1], [5.0, 5.0], [-1.0, 0.5], [f64::NAN, 0.0], [f64::INFINITY, 1.0]] {
            assert!(locator.near(p, 0.0).is_empty(), "{p:?}");
        }
    }
}
