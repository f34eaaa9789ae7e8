//! Which particle stands at a site, without a map: the numbering runs column by column from the bottom,
//! so a column is a few stretches of evenly spaced rows with ascending indices. Particles along an outline come after the others
//! of their column; their rows are their numbers along the outline, in a column of their own.

use std::ops::Range;

use super::outliers::Outliers;
use crate::flock::body::Body;
use crate::flock::lattice::Site;

/// Particles of one column whose rows are evenly spaced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    pub row: i32,
    /// Index of the first particle.
    pub start: u32,
    pub len: u32,
}

impl Segment {
    /// Whether a particle with this number in this row is the next one.
    fn ends_before(&self, row: i32, index: usize, step: i32) -> bool {
        self.row + self.len as i32 * step == row && (self.start + self.len) as usize == index
    }
}

/// The columns of a body as segments.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    /// Number of the first column.
    first: i32,
    /// Rows from one particle of a segment to the next.
    step: i32,
    /// Whether any column has two particles.
    knows_step: bool,
    /// Where the segments of each column begin, shape \[columns + 1\].
    starts: Vec<u32>,
    segments: Vec<Segment>,
    /// Index of the first particle of each column, whether in a segment or not, shape \[columns + 1\].
    begins: Vec<u32>,
    /// Segments of the particles along an outline, each within a column, ascending by index.
    along: Vec<Segment>,
    /// By row along an outline: the particle, and how many follow it in its segment, itself included; none of them where there is no
    /// particle.
    along_at: Vec<(u32, u32)>,
}

/// Column of the particles along an outline.
const OUTLIERS: i32 = Body::ALONG_OUTLINE;

impl Columns {
    /// Segments of the particles for which `counts` holds; `sites` ascend, those of `outliers` in their columns.
    pub fn new(
        sites: impl Iterator<Item = Site> + Clone,
        outliers: &Outliers,
        counts: impl Fn(usize) -> bool,
    ) -> Self {
        let of_column = |(a, b): &(Site, Site)| a[0] == b[0] && a[0] != OUTLIERS;
        let mut steps = sites.clone().zip(sites.clone().skip(1)).filter(of_column);
        // The sites of a column are evenly spaced on every lattice, so that the first few suffice.
        let step = steps.by_ref().take(4096).map(|(a, b)| b[1] - a[1]).min();
        let known = step.is_some();
        let mut columns = Self { step: step.unwrap_or(1).max(1), knows_step: known, ..Self::default() };
        let mut count = 0;
        for (index, site) in sites.enumerate() {
            columns.open(outliers.column(site), index);
            count = index + 1;
            match site[0] {
                _ if !counts(index) => {}
                OUTLIERS => columns.push_along(site[1], index, 1),
                _ => columns.push(site[1], index, 1),
            }
        }
        columns.end(count);
        columns
    }

    /// The same of columns whose particles stand so many rows apart, where none is missing.
    pub fn with_step(step: i32, sites: impl Iterator<Item = Site>) -> Self {
        let mut columns = Self { step, ..Self::default() };
        let mut count = 0;
        for (index, site) in sites.enumerate() {
            columns.open(site[0], index);
            columns.push(site[1], index, 1);
            count = index + 1;
        }
        columns.end(count);
        columns
    }

    /// None yet, the first one of which will have this number; see [`Columns::open_next`] and [`Columns::end`].
    pub fn from_number(first: i32, step: i32) -> Self {
        Self { first, step, ..Self::default() }
    }

    /// Begins the next column, the particle `index` being the next.
    pub fn open_next(&mut self, index: usize) {
        self.begins.push(index as u32);
        self.starts.push(self.segments.len() as u32);
    }

    /// Adds so many particles from this row on to the column that was begun last.
    pub fn push(&mut self, row: i32, index: usize, len: usize) {
        let begun = self.starts.last().map_or(0, |&start| start as usize);
        match self.segments[begun..].last_mut() {
            Some(last) if last.ends_before(row, index, self.step) => last.len += len as u32,
            _ => self.segments.push(Segment { row, start: index as u32, len: len as u32 }),
        }
    }

    /// Adds so many particles along an outline, which have these rows, to the column that was begun last.
    pub fn push_along(&mut self, row: i32, index: usize, len: usize) {
        let begun = self.begins.last().copied().unwrap_or(0);
        match self.along.last_mut().filter(|last| last.start >= begun) {
            Some(last) if last.ends_before(row, index, self.step) => last.len += len as u32,
            _ => self.along.push(Segment { row, start: index as u32, len: len as u32 }),
        }
    }

    /// Ends the last column of so many particles in all.
    pub fn end(&mut self, count: usize) {
        self.open_next(count);
        let rows = self.along.iter().map(|along| along.row + self.step * along.len as i32).max();
        self.along_at = vec![(0, 0); rows.unwrap_or(0) as usize];
        for &Segment { row, start, len } in &self.along {
            let rows = self.along_at[row as usize..].iter_mut().step_by(self.step as usize);
            rows.zip(0..len).for_each(|(at, k)| *at = (start + k, len - k));
        }
    }

    /// The number of the column that a particle is in.
    pub fn column_of(&self, index: usize) -> i32 {
        self.first + self.begins.partition_point(|&begin| begin as usize <= index) as i32 - 1
    }

    /// Begins the columns up to `column`, the particle `index` being the next.
    fn open(&mut self, column: i32, index: usize) {
        if index == 0 {
            self.first = column;
        }
        while self.first + (self.begins.len() as i32) <= column {
            self.begins.push(index as u32);
            self.starts.push(self.segments.len() as u32);
        }
    }

    /// Numbers of the columns.
    pub fn range(&self) -> Range<i32> {
        self.first..self.first + self.begins.len() as i32 - 1
    }

    pub fn step(&self) -> i32 {
        self.step
    }

    /// The same, where a column has particles to tell it by.
    pub fn known_step(&self) -> Option<i32> {
        self.knows_step.then_some(self.step)
    }

    /// Indices of the particles of these columns, as far as there are any.
    pub fn particles(&self, columns: Range<i32>) -> Range<usize> {
        let last = self.begins.len() as i32 - 1;
        let begin = |column: i32| self.begins[(column - self.first).clamp(0, last) as usize] as usize;
        begin(columns.start)..begin(columns.end)
    }

    /// Segments of the sites of a column, from the bottom; none where there is no such column.
    pub fn of(&self, column: i32) -> &[Segment] {
        if !self.range().contains(&column) {
            return &[];
        }
        let c = (column - self.first) as usize;
        &self.segments[self.starts[c] as usize..self.starts[c + 1] as usize]
    }

    /// Segments of the particles along an outline in a column.
    fn along_of(&self, column: i32) -> &[Segment] {
        let particles = self.particles(column..column + 1);
        let begin = |at: usize| self.along.partition_point(|segment| (segment.start as usize) < at);
        &self.along[begin(particles.start)..begin(particles.end)]
    }

    /// Column of the sites, and segment, of every segment of these columns in order.
    pub fn segments(&self, columns: Range<i32>) -> impl Iterator<Item = (i32, Segment)> + Clone + '_ {
        columns.flat_map(move |column| {
            let of_sites = self.of(column).iter().map(move |&segment| (column, segment));
            of_sites.chain(self.along_of(column).iter().map(|&segment| (OUTLIERS, segment)))
        })
    }

    /// The same of all columns.
    pub fn iter(&self) -> impl Iterator<Item = (i32, Segment)> + Clone + '_ {
        self.segments(self.range())
    }

    /// Rows and indices of the particles along an outline that are in segments, ascending by index.
    pub fn along(&self) -> impl Iterator<Item = (i32, usize)> + Clone + '_ {
        self.along.iter().flat_map(move |&Segment { row, start, len }| {
            (0..len).map(move |k| (row + self.step * k as i32, (start + k) as usize))
        })
    }

    /// Columns, and rows, from the first to the last that has a particle.
    pub fn extent(&self) -> [i32; 2] {
        let rows = self.range().filter_map(|column| self.rows_of(column));
        let rows = rows.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        [self.range().len() as i32, rows.map_or(0, |[low, high]| (high - low) / self.step + 1)]
    }

    /// Sites of all particles in segments, ascending by index.
    pub fn sites(&self) -> impl Iterator<Item = Site> + Clone + '_ {
        self.iter().flat_map(move |(column, segment)| {
            (0..segment.len as i32).map(move |k| [column, segment.row + self.step * k])
        })
    }

    /// Lowest and highest row of a column's segments.
    pub fn rows_of(&self, column: i32) -> Option<[i32; 2]> {
        let segments = self.of(column);
        let (low, high) = (segments.first()?, segments.last()?);
        Some([low.row, high.row + self.step * (high.len as i32 - 1)])
    }

    /// The particle at a site, and how many follow it in its segment, itself included.
    pub fn find(&self, [column, row]: Site) -> Option<(usize, usize)> {
        if column == OUTLIERS {
            let (index, room) = *self.along_at.get(row as usize)?;
            return (room > 0).then_some((index as usize, room as usize));
        }
        let segments = self.of(column);
        let after = segments.partition_point(|segment| segment.row <= row);
        let segment = segments[..after].last()?;
        let away = row - segment.row;
        // Setting up asks for every neighbour of every cut cell, and a division takes as long as all the rest.
        let (steps, odd) = if self.step == 1 { (away, 0) } else { (away / self.step, away % self.step) };
        (odd == 0 && steps < segment.len as i32)
            .then(|| ((segment.start as i32 + steps) as usize, (segment.len as i32 - steps) as usize))
    }

    /// The columns, each with the index of its first particle, and the end of the last one.
    pub fn begins(&self) -> impl Iterator<Item = (i32, usize)> + '_ {
        (self.first..).zip(self.begins.iter().map(|&begin| begin as usize))
    }
}

/// Finds what the rows of particles lead to, one particle after the other: those one above the other mostly lead to the same
/// offsets.
#[derive(Default)]
pub struct Finder {
    site: Site,
    /// Sites from this particle to the one before.
    steps: Option<usize>,
    /// What this one was found to lead to, and the one before: offset, particle and how many follow it.
    found: Vec<(Site, usize, usize)>,
    before: Vec<(Site, usize, usize)>,
}

impl Finder {
    /// Goes on to the particle at a site.
    pub fn go(&mut self, columns: &Columns, site: Site) {
        let away = site[1] - self.site[1];
        self.steps = (site[0] == self.site[0] && away > 0 && away % columns.step == 0)
            .then(|| (away / columns.step) as usize);
        self.site = site;
        std::mem::swap(&mut self.found, &mut self.before);
        self.found.clear();
    }

    /// The particle at an offset from it, and how many follow that in its segment, itself included.
    #[inline]
    pub fn find(&mut self, columns: &Columns, offset: Site) -> Option<(usize, usize)> {
        let like_before = self.steps.and_then(|steps| {
            let &(known, first, room) = self.before.get(self.found.len())?;
            (known == offset && room > steps).then(|| (first + steps, room - steps))
        });
        let found =
            like_before.or_else(|| columns.find([self.site[0] + offset[0], self.site[1] + offset[1]]));
        let (first, room) = found.unwrap_or_default();
        self.found.push((offset, first, room));
        found
    }
}

/// A column, the index of its first particle, and what all particles before it cost.
pub type Begin = (i32, usize, u64);

/// Index bounds of groups of whole columns that cost at least `size` but for the last, with the number of the column that
/// each begins with: `[begin of the first, ..., end of the last]`.
pub fn groups(begins: impl Iterator<Item = Begin>, end: Begin, size: u64) -> (Vec<usize>, Vec<i32>) {
    let (mut bounds, mut columns, mut before) = (Vec::new(), Vec::new(), 0);
    for (column, begin, cost) in begins {
        if bounds.is_empty() || (cost - before >= size && cost < end.2) {
            bounds.push(begin);
            columns.push(column);
            before = cost;
        }
    }
    if bounds.is_empty() || end.1 > 0 {
        bounds.push(end.1);
        columns.push(end.0);
    }
    (bounds, columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::{Body, Cut};
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::flock::neighbourhood::Neighbourhood;

    #[test]
    fn every_counted_particle_is_found_at_its_site_and_no_other() {
        for kind in LatticeKind::SAMPLES {
            let lattice = Lattice::new(kind, [0.0; 2], 0.0);
            let cut = Cut::Count { columns: 13, rows: 11 };
            let (body, _) =
                Body::build(lattice, &cut, &Neighbourhood::First { keep: None }, None).expect("fits");
            let counts = |i: usize| i % 7 != 3;
            let columns = Columns::new(body.sites.iter().copied(), &Outliers::default(), counts);
            for i in -2..40 {
                for j in -2..14 {
                    let there = body.sites.binary_search(&[i, j]).ok().filter(|&k| counts(k));
                    assert_eq!(columns.find([i, j]).map(|(index, _)| index), there, "{kind:?} {i} {j}");
                }
            }
            let begins = columns.begins().map(|(column, begin)| (column, begin, begin as u64));
            let (bounds, _) = groups(begins, (13, body.count(), body.count() as u64), 30);
            assert!(bounds.windows(2).all(|w| w[0] < w[1]), "{bounds:?}");
        }
    }
}
