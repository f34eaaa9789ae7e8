//! A uniform grid of cells for neighbour queries among points that move.

use super::points::Points;

/// Points sorted into square cells by counting; its buffers are kept between fills.
#[derive(Clone, Debug, Default)]
pub struct CellGrid {
    low: [f64; 2],
    cell: f64,
    columns: usize,
    rows: usize,
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl CellGrid {
    /// Sorts the points marked in `included` into cells at least `radius` wide \[length\].
    /// Points that are not finite are left out: nobody has them as a neighbour.
    pub fn fill(&mut self, points: &Points, included: &[bool], radius: f64) {
        let usable = |i: &usize| included[*i] && points.x[*i].is_finite() && points.y[*i].is_finite();
        let Some((low, high)) = points.bounds((0..points.len()).filter(usable)) else {
            (self.columns, self.rows) = (0, 0);
            return;
        };
        let count = (0..points.len()).filter(usable).count();
        self.low = low;
        // A few far points must not ask for more cells than there are points to put in them.
        let extent = [high[0] - low[0], high[1] - low[1]];
        let widest = extent[0].max(extent[1]);
        let most_per_axis = (2.0 * (count as f64).sqrt()).clamp(1.0, 4096.0);
        self.cell = radius.max(widest / most_per_axis);
        self.columns = (extent[0] / self.cell) as usize + 1;
        self.rows = (extent[1] / self.cell) as usize + 1;

        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        for i in (0..points.len()).filter(usable) {
            let cell = self.cell_of(points.get(i));
            self.starts[cell] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        self.members.clear();
        self.members.resize(count, 0);
        // From the back, counting each cell's end down to its start: members stay in index order.
        for i in (0..points.len()).rev().filter(usable) {
            let cell = self.cell_of(points.get(i));
            self.starts[cell] -= 1;
            self.members[self.starts[cell] as usize] = i as u32;
        }
    }

    /// Appends to `found` every other point within `radius` of `particle`, walking the cells that the
    /// radius touches; a radius near that of the last [`CellGrid::fill`] is the cheapest.
    pub fn within(&self, points: &Points, particle: usize, radius: f64, found: &mut Vec<u32>) {
        let [x, y] = points.get(particle);
        if self.columns == 0 || !(x.is_finite() && y.is_finite()) {
            return;
        }
        for c in self.cells_within(x - self.low[0], radius, self.columns) {
            for r in self.cells_within(y - self.low[1], radius, self.rows) {
                for &other in self.cell_members(c * self.rows + r) {
                    let (dx, dy) = (points.x[other as usize] - x, points.y[other as usize] - y);
                    if other as usize != particle && dx.hypot(dy) <= radius {
                        found.push(other);
                    }
                }
            }
        }
    }

    fn cells_within(&self, offset: f64, radius: f64, cells: usize) -> std::ops::Range<usize> {
        // One cell more on either side than the division says, for it rounds.
        let first = ((offset - radius) / self.cell) as usize;
        let last = ((offset + radius) / self.cell) as usize;
        first.saturating_sub(1).min(cells - 1)..last.saturating_add(2).min(cells)
    }

    fn cell_members(&self, cell: usize) -> &[u32] {
        &self.members[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    fn cell_of(&self, [x, y]: [f64; 2]) -> usize {
        let axis = |value: f64, low: f64, cells: usize| (((value - low) / self.cell) as usize).min(cells - 1);
        axis(x, self.low[0], self.columns) * self.rows + axis(y, self.low[1], self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_finds_what_a_scan_finds() {
        let points: Points = (0..200)
            .map(|i| {
                let t = f64::from(i);
                [(t * 0.7).sin() * 3.0 + 1e-3 * t, (t * 1.3).cos() * 2.0]
            })
            .chain([[1e9, 0.0], [f64::NAN, 0.0], [-4.0, f64::INFINITY]])
            .collect();
        let included = vec![true; points.len()];
        let mut grid = CellGrid::default();
        grid.fill(&points, &included, 0.8);
        for i in 0..points.len() {
            let mut found = Vec::new();
            grid.within(&points, i, 0.8, &mut found);
            found.sort_unstable();
            let scanned: Vec<u32> = (0..points.len())
                .filter(|&k| {
                    let (dx, dy) = (points.x[k] - points.x[i], points.y[k] - points.y[i]);
                    k != i && dx.hypot(dy) <= 0.8
                })
                .map(|k| k as u32)
                .collect();
            assert_eq!(found, scanned, "around point {i}");
        }
    }
}
