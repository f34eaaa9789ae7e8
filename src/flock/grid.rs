//! A uniform grid of cells for neighbour queries among points that move.

mod candidates;

use std::ops::Range;

use super::vectors::Vectors;
use candidates::{Candidates, Slots};

/// Points sorted into square cells by counting; its buffers are kept between fills.
///
/// The points' coordinates are kept in the order of the cells, row after row, so that a query reads
/// one stretch of memory for each row of cells that it touches.
#[derive(Clone, Debug, Default)]
pub struct CellGrid {
    low: [f64; 2],
    cell: f64,
    /// Cells per length.
    scale: f64,
    columns: usize,
    rows: usize,
    /// Cell of each point that was included, in order of index.
    cells: Vec<u32>,
    /// Where each cell begins in the three that follow, shape \[cells + 1\].
    starts: Vec<u32>,
    slots: Slots,
    around: Candidates,
    /// Each point's neighbours, unsorted, in order of cells; and where each point's begin, and how many.
    lists: Vec<u32>,
    found: Vec<(u32, u32)>,
    /// Where each point's list ends as it is written.
    ends: Vec<u32>,
    lengths: Vec<u32>,
}

/// Cells are this much wider than the radius, so that rounding hides no neighbour in the next but one.
const MARGIN: f64 = 1.0 + 1e-9;

/// Cells are at least this wide \[length\], so that as many to a length is a number.
const NARROWEST: f64 = 1e-300;

impl CellGrid {
    /// Sorts the points marked in `included` into cells at least `radius` wide \[length\].
    /// Points that are not finite are left out: they are neighbours of none.
    pub fn fill(&mut self, points: &Vectors, included: &[bool], radius: f64) {
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
        self.cell = (MARGIN * radius).max(widest / most_per_axis).max(NARROWEST);
        self.scale = 1.0 / self.cell;
        self.columns = (extent[0] * self.scale) as usize + 1;
        self.rows = (extent[1] * self.scale) as usize + 1;
        self.sort(points, (0..points.len()).filter(usable));
    }

    fn sort(&mut self, points: &Vectors, usable: impl Iterator<Item = usize> + Clone) {
        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        self.cells.clear();
        for i in usable.clone() {
            let cell = self.axis_cell(points.y[i], 1) * self.columns + self.axis_cell(points.x[i], 0);
            self.cells.push(cell as u32);
            self.starts[cell] += 1;
        }
        let count = self.cells.len();
        let mut begin = 0;
        for start in &mut self.starts {
            begin += std::mem::replace(start, begin);
        }
        self.slots.resize(count);
        for (i, &cell) in usable.zip(&self.cells) {
            let place = &mut self.starts[cell as usize];
            let at = *place as usize;
            *place += 1;
            self.slots.set(at, i as u32, points.get(i));
        }
        // Each cell's start has been counted up to its end, the start of the next.
        self.starts.copy_within(..self.columns * self.rows, 1);
        self.starts[0] = 0;
    }

    /// Appends to `found` every other point within `radius` of `particle`, in order of index. A radius up
    /// to that of the last [`CellGrid::fill`] looks into nine cells, a larger one into more.
    pub fn within(&self, points: &Vectors, particle: usize, radius: f64, found: &mut Vec<u32>) {
        let begin = found.len();
        self.each_within(points, particle, radius, |member| found.push(member));
        // Index order, so that no sum depends on how the cells were walked.
        found[begin..].sort_unstable();
    }

    /// Shows the same points, in the order of the cells.
    pub(crate) fn each_within(
        &self,
        points: &Vectors,
        particle: usize,
        radius: f64,
        mut see: impl FnMut(u32),
    ) {
        let here = points.get(particle);
        if self.columns == 0 || !(here[0].is_finite() && here[1].is_finite()) {
            return;
        }
        let columns = self.cells_within(here[0], radius, 0);
        for row in self.cells_within(here[1], radius, 1) {
            let near = self.slots.near(self.run(row, &columns), here, radius);
            near.filter(|&member| member as usize != particle).for_each(&mut see);
        }
    }

    /// Replaces the lists by those of every point within the radius of the last [`CellGrid::fill`] of
    /// each of `count` points, in order of index: what [`CellGrid::within`] finds, a cell at a time.
    /// A point that was not included has no neighbours.
    pub(crate) fn all_within(
        &mut self,
        count: usize,
        radius: f64,
        starts: &mut Vec<u32>,
        index: &mut Vec<u32>,
    ) {
        self.found.clear();
        self.found.resize(count, (0, 0));
        let total = self.look_around(radius);
        let mut end = 0;
        starts.clear();
        starts.push(0);
        starts.extend(self.found.iter().map(|&(_, found)| {
            end += found;
            end
        }));
        self.ends.clear();
        self.ends.extend_from_slice(&starts[..count]);
        index.resize(total, 0);
        // Neighbourhood is mutual: handing each point to its neighbours, in order of index, sorts every list.
        for (particle, &(begin, found)) in self.found.iter().enumerate() {
            for &other in &self.lists[begin as usize..][..found as usize] {
                let end = &mut self.ends[other as usize];
                index[*end as usize] = particle as u32;
                *end += 1;
            }
        }
    }

    /// Writes each point's neighbours into `lists`, unsorted, cell after cell; returns how many.
    fn look_around(&mut self, radius: f64) -> usize {
        let mut around = std::mem::take(&mut self.around);
        let mut lists = std::mem::take(&mut self.lists);
        let mut found = std::mem::take(&mut self.found);
        let mut lengths = std::mem::take(&mut self.lengths);
        let mut end = 0;
        for row in 0..self.rows {
            for column in 0..self.columns {
                let own = self.run(row, &(column..column + 1));
                if own.is_empty() {
                    continue;
                }
                let (runs, first) = self.runs_around(row, column);
                around.gather(&self.slots, &runs);
                let room = end + own.len() * around.room();
                if lists.len() < room {
                    lists.resize(2 * room, 0);
                }
                around.list_near(first..first + own.len(), radius, &mut lists[end..], &mut lengths);
                for (&member, &length) in self.slots.members[own].iter().zip(&lengths) {
                    found[member as usize] = (end as u32, length);
                    end += length as usize;
                }
            }
        }
        (self.around, self.lists, self.found, self.lengths) = (around, lists, found, lengths);
        end
    }

    /// The slots of a cell and of those around it, row after row, and how many come before its own.
    fn runs_around(&self, row: usize, column: usize) -> ([Range<usize>; 3], usize) {
        let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
        let below = if row > 0 { self.run(row - 1, &columns) } else { 0..0 };
        let above = if row + 1 < self.rows { self.run(row + 1, &columns) } else { 0..0 };
        let before = below.len() + self.run(row, &(columns.start..column)).len();
        ([below, self.run(row, &columns), above], before)
    }

    /// The slots of some cells of a row.
    fn run(&self, row: usize, columns: &Range<usize>) -> Range<usize> {
        let first = row * self.columns;
        self.starts[first + columns.start] as usize..self.starts[first + columns.end] as usize
    }

    fn axis_cell(&self, value: f64, axis: usize) -> usize {
        let cells = [self.columns, self.rows][axis];
        (((value - self.low[axis]) * self.scale) as usize).min(cells - 1)
    }

    /// Cells of an axis in which points within `radius` of a coordinate lie.
    fn cells_within(&self, value: f64, radius: f64, axis: usize) -> Range<usize> {
        let cells = [self.columns, self.rows][axis];
        // As the cells are at least as wide as the radius they were made for, that is one.
        let width = if MARGIN * radius <= self.cell { 1 } else { (MARGIN * radius / self.cell) as usize + 1 };
        let cell = self.axis_cell(value, axis);
        cell.saturating_sub(width)..cell.saturating_add(width + 1).min(cells)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(points: &Vectors, i: usize, radius: f64) -> Vec<u32> {
        (0..points.len())
            .filter(|&k| {
                let (dx, dy) = (points.x[k] - points.x[i], points.y[k] - points.y[i]);
                k != i && dx.hypot(dy) <= radius
            })
            .map(|k| k as u32)
            .collect()
    }

    fn scans(points: &Vectors, radius: f64) -> Vec<Vec<u32>> {
        (0..points.len()).map(|i| scan(points, i, radius)).collect()
    }

    fn all(grid: &mut CellGrid, points: &Vectors, radius: f64) -> Vec<Vec<u32>> {
        let (mut starts, mut index) = (vec![3], vec![9; 5]);
        grid.all_within(points.len(), radius, &mut starts, &mut index);
        starts.windows(2).map(|pair| index[pair[0] as usize..pair[1] as usize].to_vec()).collect()
    }

    fn wave() -> Vectors {
        (0..200)
            .map(|i| {
                let t = f64::from(i);
                [(t * 0.7).sin() * 3.0 + 1e-3 * t, (t * 1.3).cos() * 2.0]
            })
            .collect()
    }

    #[test]
    fn the_grid_finds_what_a_scan_finds() {
        let odd = [[1e9, 0.0], [f64::NAN, 0.0], [-4.0, f64::INFINITY]];
        let points: Vectors = wave().iter().chain(odd).collect();
        let included = vec![true; points.len()];
        let mut grid = CellGrid::default();
        grid.fill(&points, &included, 0.8);
        for radius in [0.8, 0.1, 5.0] {
            for i in 0..points.len() {
                let mut found = vec![7];
                grid.within(&points, i, radius, &mut found);
                assert_eq!(found[1..], scan(&points, i, radius), "around point {i}");
            }
        }
        assert_eq!(all(&mut grid, &points, 0.8), scans(&points, 0.8));
    }

    #[test]
    fn a_radius_that_is_hit_exactly_and_one_beyond_squares_find_what_a_scan_finds() {
        let lattice: Vectors = (0..400).map(|i| [0.1 * f64::from(i % 20), 0.1 * f64::from(i / 20)]).collect();
        for (unit, radius) in [(1.0, 0.1), (1.0, 0.5), (1e150, 1.01e149), (1e-150, 2.0e-151)] {
            let points: Vectors = lattice.iter().map(|[x, y]| [unit * x, unit * y]).collect();
            let mut grid = CellGrid::default();
            grid.fill(&points, &[true; 400], radius);
            for i in 0..400 {
                let mut found = Vec::new();
                grid.within(&points, i, radius, &mut found);
                assert_eq!(found, scan(&points, i, radius), "around point {i} of {unit}");
            }
            assert_eq!(all(&mut grid, &points, radius), scans(&points, radius), "{unit}");
        }
    }
}
