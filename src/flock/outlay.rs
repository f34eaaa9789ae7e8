//! How a body is laid out: which sites of a lattice are in its shape, column by column, and the frame around them.

use std::ops::Range;
use std::sync::Arc;

use super::body::{Body, BodyError, Cut};
use super::frame::{Frame, FrameRule};
use super::lattice::{Lattice, Site};
use super::neighbourhood::{Neighbourhood, Neighbours};
use super::part::Extent;
use super::vectors::Vectors;
use super::window::Window;
use crate::geometry::locate::RowLocator;

/// The parts of a scene's body that its particles are laid out from.
#[derive(Clone, Debug)]
pub struct Outlay<'a> {
    /// The lattice that the sites belong to.
    pub lattice: &'a Lattice,
    /// The sites that are cut from it.
    pub cut: &'a Cut,
    /// Which others a particle sees.
    pub neighbourhood: &'a Neighbourhood,
    /// How a frame follows the body, if there is one.
    pub frame: Option<FrameRule>,
    /// Corners of the cells that belong to a site, from there: sites at the corner of none are left out. Empty where all stand.
    pub cells: Vec<Vec<Site>>,
}

/// The particles of some columns, counted.
#[derive(Clone, Debug, PartialEq)]
pub struct Census {
    /// Particles of each column, the frame's included, shape \[columns\].
    pub counts: Vec<u64>,
    /// How far they reach.
    pub extent: Extent,
}

/// More lattice sites than this are refused before memory is asked for, where they are to stand in one process.
pub(crate) const MOST_SITES: u64 = 1 << 28;

/// Columns and rows beyond this one are refused, or sums of two would leave the integers.
const FARTHEST_SITE: u64 = 1_000_000_000;

/// More neighbour entries than this are refused before memory is asked for: 4 GiB.
pub(crate) const MOST_ENTRIES: u64 = 1 << 30;

impl Outlay<'_> {
    /// The columns that the body may have, its frame's included: the first one, and the one after the last.
    ///
    /// # Errors
    /// A neighbourhood that the lattice does not have, and bounds beyond the integers.
    pub fn columns(&self) -> Result<Range<i32>, BodyError> {
        let (low, high) = window(self.lattice, self.cut)?;
        let margin = self.margin(&self.shell(&self.neighbourhood.offsets(self.lattice)?))[0];
        Ok(low[0] - margin..high[0] + margin + 1)
    }

    /// Grid columns to the farthest site that decides on a particle: a neighbour, or a particle that a frame point is for.
    ///
    /// # Errors
    /// A neighbourhood that the lattice does not have.
    pub fn reach(&self) -> Result<i32, BodyError> {
        Ok(reach(&self.shell(&self.neighbourhood.offsets(self.lattice)?))[0].max(1))
    }

    /// Counts the particles of some columns of the body.
    ///
    /// # Errors
    /// As [`Outlay::columns`], and more columns than can be looked at together.
    pub fn count(&self, columns: Range<i32>) -> Result<Census, BodyError> {
        let offsets = self.neighbourhood.offsets(self.lattice)?;
        let far = self.reach()? + cell_width(&self.cells);
        let map = self.map(&self.shell(&offsets), Some(columns.start - far..columns.end + far))?;
        let mut census = Census { counts: vec![0; columns.len()], extent: Extent::NONE };
        for cell in (0..map.cells.len()).filter(|&cell| map.cells[cell] != NOTHING) {
            let site = map.window.site(cell);
            if !columns.contains(&site[0]) {
                continue;
            }
            census.counts[(site[0] - columns.start) as usize] += 1;
            let mut extent = Extent { lowest: site, ..Extent::NONE };
            if map.cells[cell] == BODY {
                let place = self.lattice.position(site);
                let there = |o: &&Site| map.is_marked([site[0] + o[0], site[1] + o[1]]);
                let neighbours = offsets[self.lattice.sublattice(site)].iter().filter(there).count();
                extent = Extent { bounds: (place, place), lowest: site, neighbours };
            }
            census.extent = census.extent.or(extent);
        }
        Ok(census)
    }

    /// Everything that a frame is laid around.
    fn shell(&self, offsets: &[Vec<Site>]) -> Vec<Vec<Site>> {
        let mut shell = offsets.to_vec();
        if self.frame.is_some() {
            // The corners of a rectangle touch no edge particle, yet the paper numbers them.
            let corners = self.lattice.cell_corners();
            shell.iter_mut().for_each(|offsets| offsets.extend(&corners));
        }
        shell
    }

    fn margin(&self, shell: &[Vec<Site>]) -> Site {
        if self.frame.is_some() { reach(shell) } else { [0, 0] }
    }

    fn map(&self, shell: &[Vec<Site>], columns: Option<Range<i32>>) -> Result<SiteMap, BodyError> {
        let mut map = SiteMap::cut(self.lattice, self.cut, self.margin(shell), columns)?;
        if !self.cells.is_empty() {
            map.leave_out_loose(self.lattice, &self.cells);
        }
        if self.frame.is_some() {
            map.mark_frame(self.lattice, shell);
        }
        Ok(map)
    }

    /// The error for a body without a particle.
    pub fn empty(&self) -> BodyError {
        if !self.cells.is_empty() {
            return BodyError::NoCell;
        }
        let (low, high) = match self.cut {
            Cut::Shape(shape) => shape.bounds(),
            Cut::Count { .. } => ([0.0; 2], [0.0; 2]),
        };
        BodyError::Empty {
            spacing: self.lattice.spacing(),
            width: high[0] - low[0],
            height: high[1] - low[1],
        }
    }

    /// Lays out the whole body, or what of it stands in some columns, with the neighbours that stand there too.
    ///
    /// # Errors
    /// A whole body without a site, too many sites or neighbours, and a neighbourhood that the lattice does not have.
    pub fn lay_out(&self, columns: Option<Range<i32>>) -> Result<(Body, Neighbours), BodyError> {
        let Self { lattice, neighbourhood, frame, .. } = *self;
        let offsets = neighbourhood.offsets(lattice)?;
        let is_whole = columns.is_none();
        let mut map = self.map(&self.shell(&offsets), columns)?;
        if is_whole && !map.cells.contains(&BODY) {
            return Err(self.empty());
        }
        let (sites, is_frame) = map.number();
        let reference: Arc<Vectors> = Arc::new(sites.iter().map(|&site| lattice.position(site)).collect());
        let most = offsets.iter().map(Vec::len).max().unwrap_or(0).min(sites.len());
        let about = sites.len() as u64 * most as u64;
        if about > MOST_ENTRIES {
            return Err(BodyError::ManyNeighbours { about, limit: MOST_ENTRIES });
        }
        let map = &map;
        let lists = sites.iter().zip(&is_frame).map(|(&site, &is_frame)| {
            let offsets: &[Site] = if is_frame { &[] } else { &offsets[lattice.sublattice(site)] };
            offsets.iter().filter_map(move |offset| map.index([site[0] + offset[0], site[1] + offset[1]]))
        });
        let entries = lists.clone().map(Iterator::count).sum();
        let neighbours = Neighbours::from_lists_of(entries, lists);
        let frame = frame.map(|rule| Frame::build(rule, lattice, &sites, &is_frame, |site| map.index(site)));
        let lattice = lattice.clone();
        let body =
            Body { lattice, sites, reference, is_frame, frame, numbering: None, outline: None, part: None };
        Ok((body, neighbours))
    }
}

/// Grid columns that the widest of these cells is wide, at least; 0 of none.
pub(crate) fn cell_width(cells: &[Vec<Site>]) -> i32 {
    let columns = cells.iter().flatten().map(|corner| corner[0]);
    columns.clone().max().unwrap_or(0) - columns.min().unwrap_or(0)
}

/// Farthest column and row any offset reaches.
fn reach(shell: &[Vec<Site>]) -> Site {
    shell.iter().flatten().fold([0, 0], |far, o| [far[0].max(o[0].abs()), far[1].max(o[1].abs())])
}

const NOTHING: u32 = u32::MAX;
const BODY: u32 = u32::MAX - 1;
const FRAME: u32 = u32::MAX - 2;

/// A window of the integer grid: what stands at each pair of integers, then its particle's index.
struct SiteMap {
    window: Window,
    cells: Vec<u32>,
}

impl SiteMap {
    /// Marks the sites of a row that are particles of the body.
    fn mark_row(&mut self, row: i32, is_in: impl Fn(Site) -> bool) {
        for column in self.window.low[0]..self.window.low[0] + self.window.columns as i32 {
            if is_in([column, row])
                && let Some(cell) = self.window.number([column, row])
            {
                self.cells[cell] = BODY;
            }
        }
    }

    /// Of the whole body, or of some columns.
    fn cut(
        lattice: &Lattice,
        cut: &Cut,
        margin: Site,
        columns: Option<Range<i32>>,
    ) -> Result<Self, BodyError> {
        let (low, high) = window(lattice, cut)?;
        let wider = |site: Site, by: i32| [site[0] + by * margin[0], site[1] + by * margin[1]];
        let (mut from, mut to) = (wider(low, -1), wider(high, 1));
        if let Some(columns) = columns {
            from[0] = from[0].max(columns.start);
            to[0] = to[0].min(columns.end - 1).max(from[0] - 1);
        }
        let window = Window::new(from, to);
        if window.count() > MOST_SITES {
            return Err(BodyError::TooLarge { limit: MOST_SITES });
        }
        let mut map = Self { window, cells: vec![NOTHING; window.count() as usize] };
        let tolerance = 1e-9 * lattice.spacing();
        match cut {
            Cut::Count { columns, rows } => {
                let steps = columns_per_site(lattice);
                let within = |value: i32, most: u32| value >= 0 && i64::from(value) < i64::from(most);
                for row in low[1]..=high[1] {
                    map.mark_row(row, |site| {
                        lattice.is_site(site) && within(site[0], steps * columns) && within(site[1], *rows)
                    });
                }
            }
            Cut::Shape(shape) => {
                let locator = RowLocator::new(shape, lattice.vector([1, 0]));
                for row in low[1]..=high[1] {
                    let of_shape = locator.row(lattice.position([low[0], row]), tolerance);
                    map.mark_row(row, |site| {
                        lattice.is_site(site) && of_shape.contains(lattice.position(site), tolerance)
                    });
                }
            }
        }
        Ok(map)
    }

    /// Takes out the sites that are at the corner of no whole cell: they stick out of a curved edge, and carry nothing.
    fn leave_out_loose(&mut self, lattice: &Lattice, cells: &[Vec<Site>]) {
        let mut is_corner = vec![false; self.cells.len()];
        let mut corners = Vec::new();
        for [i, j] in (0..self.cells.len()).map(|cell| self.window.site(cell)) {
            if !lattice.is_site([i, j]) || lattice.sublattice([i, j]) != 0 {
                continue;
            }
            for cell in cells {
                let there = |corner: &Site| self.window.number([i + corner[0], j + corner[1]]);
                let is_in = |number: &usize| self.cells[*number] == BODY;
                corners.clear();
                corners.extend(cell.iter().map_while(|corner| there(corner).filter(is_in)));
                if corners.len() == cell.len() {
                    corners.iter().for_each(|&corner| is_corner[corner] = true);
                }
            }
        }
        let loose = self.cells.iter_mut().zip(is_corner).filter(|(_, is_corner)| !is_corner);
        loose.for_each(|(cell, _)| *cell = NOTHING);
    }

    /// Marks every site that a body particle reaches and that is no body particle.
    fn mark_frame(&mut self, lattice: &Lattice, shell: &[Vec<Site>]) {
        for cell in (0..self.cells.len()).filter(|&cell| self.cells[cell] == BODY).collect::<Vec<_>>() {
            let site = self.window.site(cell);
            for offset in &shell[lattice.sublattice(site)] {
                let there = [site[0] + offset[0], site[1] + offset[1]];
                if let Some(cell) = self.window.number(there)
                    && self.cells[cell] == NOTHING
                    && lattice.is_site(there)
                {
                    self.cells[cell] = FRAME;
                }
            }
        }
    }

    /// Numbers what was marked, column by column from the bottom.
    fn number(&mut self) -> (Vec<Site>, Vec<bool>) {
        let count = self.cells.iter().filter(|&&mark| mark != NOTHING).count();
        let (mut sites, mut is_frame) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for cell in 0..self.cells.len() {
            let mark = self.cells[cell];
            if mark != NOTHING {
                self.cells[cell] = sites.len() as u32;
                sites.push(self.window.site(cell));
                is_frame.push(mark == FRAME);
            }
        }
        (sites, is_frame)
    }

    fn is_marked(&self, site: Site) -> bool {
        self.window.number(site).is_some_and(|cell| self.cells[cell] != NOTHING)
    }

    fn index(&self, site: Site) -> Option<u32> {
        self.window.number(site).map(|cell| self.cells[cell]).filter(|&index| index != NOTHING)
    }
}

/// Grid columns from one site of a row to the next.
fn columns_per_site(lattice: &Lattice) -> u32 {
    if lattice.is_site([1, 0]) { 1 } else { 2 }
}

/// Lowest and highest integer pair whose position can lie in the cut.
fn window(lattice: &Lattice, cut: &Cut) -> Result<(Site, Site), BodyError> {
    match cut {
        Cut::Count { columns, rows } => {
            let across = u64::from(columns_per_site(lattice)) * u64::from(*columns);
            if across.max(u64::from(*rows)) > FARTHEST_SITE {
                return Err(BodyError::TooLarge { limit: MOST_SITES });
            }
            Ok(([0, 0], [across.saturating_sub(1) as i32, rows.saturating_sub(1) as i32]))
        }
        Cut::Shape(shape) => {
            let (low, high) = lattice.grid_bounds(shape.bounds());
            let (lows, highs) = (low.map(|v| v.floor() - 1.0), high.map(|v| v.ceil() + 1.0));
            let in_range = lows.iter().chain(&highs).all(|v| v.abs() <= FARTHEST_SITE as f64);
            if !in_range {
                return Err(BodyError::TooLarge { limit: MOST_SITES });
            }
            Ok((lows.map(|v| v as i32), highs.map(|v| v as i32)))
        }
    }
}
