//! Which cell holds a point, and where in it: bins over the bounding box, then Newton's method on the
//! isoparametric map, both bounded.

use super::mesh::Mesh;

/// Newton steps at most; a point of the cell is reached in fewer than ten.
const STEPS: usize = 20;
/// How far outside the reference cell a point may be found and still count as in it [-].
const SLACK: f64 = 1e-8;

/// A search structure over the cells of one mesh.
pub(crate) struct Locator<'m> {
    mesh: &'m Mesh,
    low: [f64; 2],
    width: f64,
    bins: [usize; 2],
    starts: Vec<usize>,
    cells: Vec<u32>,
}

impl<'m> Locator<'m> {
    /// About as many square bins as there are cells.
    pub fn new(mesh: &'m Mesh) -> Locator<'m> {
        let (low, high) = bounds(mesh.x().iter().copied().zip(mesh.y().iter().copied()));
        let size = [high[0] - low[0], high[1] - low[1]];
        // A very slender body gets fewer bins than cells: at most 10 000 along its length.
        let width = (size[0] * size[1] / mesh.cell_count() as f64).sqrt().max(size[0].max(size[1]) / 1e4);
        let bins = size.map(|s| (s / width) as usize + 1);
        let mut locator = Locator { mesh, low, width, bins, starts: Vec::new(), cells: Vec::new() };
        let mut entries = Vec::new();
        for cell in 0..mesh.cell_count() {
            let at = mesh.positions(cell);
            let (a, b) = bounds(at[..mesh.kind().nodes()].iter().map(|p| (p[0], p[1])));
            // A curved side may bulge beyond its nodes by less than an eighth of the cell.
            let margin = 0.125 * (mesh.kind().degree() - 1) as f64 * (b[0] - a[0]).max(b[1] - a[1]);
            let first = locator.bin([a[0] - margin, a[1] - margin]);
            let last = locator.bin([b[0] + margin, b[1] + margin]);
            for j in first[1]..=last[1] {
                entries.extend((first[0]..=last[0]).map(|i| (j * bins[0] + i, cell as u32)));
            }
        }
        entries.sort_unstable();
        locator.starts = (0..=bins[0] * bins[1]).map(|b| entries.partition_point(|e| e.0 < b)).collect();
        locator.cells = entries.into_iter().map(|e| e.1).collect();
        locator
    }

    /// The bin of a point, clamped to the box.
    fn bin(&self, p: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|i| (((p[i] - self.low[i]) / self.width).max(0.0) as usize).min(self.bins[i] - 1))
    }

    /// The lowest-numbered cell that holds `p` \[m\], with the reference coordinates there.
    pub fn find(&self, p: [f64; 2]) -> Option<(usize, [f64; 2])> {
        let [i, j] = self.bin(p);
        let bin = j * self.bins[0] + i;
        let cells = &self.cells[self.starts[bin]..self.starts[bin + 1]];
        cells.iter().find_map(|&cell| {
            let place = invert(self.mesh, cell as usize, p)?;
            self.mesh.kind().contains(place, SLACK).then_some((cell as usize, place))
        })
    }

    /// The cell nearest to a point that is in none, with reference coordinates that continue it to the point; `None`
    /// if it is further away than `reach` \[m\].
    pub fn nearest(&self, p: [f64; 2], reach: f64) -> Option<(usize, [f64; 2])> {
        let kind = self.mesh.kind();
        let (first, last) = (self.bin(p.map(|v| v - reach)), self.bin(p.map(|v| v + reach)));
        let mut best: Option<(f64, usize, [f64; 2])> = None;
        for j in first[1]..=last[1] {
            for bin in (first[0]..=last[0]).map(|i| j * self.bins[0] + i) {
                for &cell in &self.cells[self.starts[bin]..self.starts[bin + 1]] {
                    let Some(place) = invert(self.mesh, cell as usize, p) else { continue };
                    let at = self.mesh.positions(cell as usize);
                    let within = kind.shape(kind.clamped(place)).interpolate(&at[..kind.nodes()]);
                    let apart = (p[0] - within[0]).hypot(p[1] - within[1]);
                    if apart <= reach && best.is_none_or(|(least, ..)| apart < least) {
                        best = Some((apart, cell as usize, place));
                    }
                }
            }
        }
        best.map(|(_, cell, place)| (cell, place))
    }
}

/// Reference coordinates of a point \[m\] in a cell, which need not hold it; `None` if there are none nearby.
pub(crate) fn invert(mesh: &Mesh, cell: usize, p: [f64; 2]) -> Option<[f64; 2]> {
    let kind = mesh.kind();
    let at = mesh.positions(cell);
    let at = &at[..kind.nodes()];
    let mut r = kind.reference_centre();
    for _ in 0..STEPS {
        let shape = kind.shape(r);
        let q = shape.interpolate(at);
        let ([dx, dy], j) = ([p[0] - q[0], p[1] - q[1]], shape.jacobian(at));
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

fn bounds(points: impl Iterator<Item = (f64, f64)>) -> ([f64; 2], [f64; 2]) {
    points.fold(([f64::MAX; 2], [f64::MIN; 2]), |(l, h), (x, y)| {
        ([l[0].min(x), l[1].min(y)], [h[0].max(x), h[1].max(y)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::CellKind;

    #[test]
    fn every_point_of_a_distorted_mesh_is_found_and_maps_back_and_points_outside_are_not() {
        for kind in CellKind::ALL {
            let square = Mesh::rectangle(kind, [7, 5], [0.0, 0.0], [1.0, 1.0]).unwrap();
            let ring = square.mapped(|x, y| {
                let (r, t) = (1.0 + x, 1.2 * y);
                [r * t.cos(), r * t.sin()]
            });
            let mesh = ring.unwrap();
            let locator = Locator::new(&mesh);
            for k in 1..400 {
                let (r, t) =
                    (1.02 + 0.94 * (k as f64 * 0.618).fract(), 0.01 + 1.18 * (k as f64 * 0.414).fract());
                let p = [r * t.cos(), r * t.sin()];
                let (cell, place) = locator.find(p).unwrap_or_else(|| panic!("{kind:?} {p:?}"));
                let q = kind.shape(place).interpolate(&mesh.positions(cell)[..kind.nodes()]);
                assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-12, "{kind:?} {p:?} {q:?}");
            }
            for p in [[0.0, 0.0], [0.9, 0.1], [5.0, 5.0], [-1.0, 0.5], [f64::NAN, 0.0], [f64::INFINITY, 1.0]]
            {
                assert!(locator.find(p).is_none(), "{kind:?} {p:?}");
            }
        }
    }
}
