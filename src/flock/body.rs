//! A body: the sites of a lattice inside a shape, numbered, with the frame around them.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::frame::{Frame, FrameRule};
use super::lattice::{Lattice, LatticeKind, Site};
use super::neighbourhood::{Neighbourhood, NeighbourhoodError, Neighbours};
use super::numbering::Numbering;
use super::vectors::Vectors;
use super::window::Window;
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::locate::RowLocator;
use crate::geometry::outline::Place;
use crate::geometry::shape::Shape;

/// The sites that are cut from the lattice.
#[derive(Clone, Debug, PartialEq)]
pub enum Cut {
    /// A rectangle by count: `columns` sites in a row, `rows` rows, from site (0, 0).
    Count {
        /// Sites in a row of the lattice.
        columns: u32,
        /// Rows of the lattice.
        rows: u32,
    },
    /// The sites inside a shape.
    Shape(Shape),
}

/// Why no body can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// No site of the lattice lies inside the shape.
    #[error(
        "the shape holds no lattice site: the lattice's spacing is {spacing}, the shape measures {width} by {height}"
    )]
    Empty {
        /// The lattice's spacing \[length\].
        spacing: f64,
        /// Extent of the shape's bounds along x \[length\].
        width: f64,
        /// Extent of the shape's bounds along y \[length\].
        height: f64,
    },
    /// No cell of the lattice has all of its corners inside the shape.
    #[error("the body has no cell of the lattice, so there is no material")]
    NoCell,
    /// The bounds hold more sites than a body may have.
    #[error("the body would have more than {limit} lattice sites in its bounds")]
    TooLarge {
        /// Most sites that the bounds may hold.
        limit: u64,
    },
    /// Some particles cannot feel each other through any chain of neighbours.
    #[error(
        "the body falls into {parts} parts that are no neighbours of each other: particle {first} and particle {second} are not connected"
    )]
    Disconnected {
        /// Number of connected parts.
        parts: usize,
        /// Id of a particle in one part.
        first: usize,
        /// Id of a particle in another part.
        second: usize,
    },
    /// A particle of a cloud sees no other.
    #[error("particle {id} at ({}, {}) has no neighbour within {radius}", .place[0], .place[1])]
    Alone {
        /// Id of the particle.
        id: usize,
        /// Where it stands in the reference configuration \[length\].
        place: [f64; 2],
        /// Radius of its neighbourhood \[length\].
        radius: f64,
    },
    /// The neighbourhoods of a cloud are too wide to be listed.
    #[error("within {radius} the particles have about {about} neighbours in all, at most {limit} are kept")]
    TooManyNeighbours {
        /// Radius of the neighbourhoods \[length\].
        radius: f64,
        /// Neighbours of all particles together, estimated from a sample.
        about: u64,
        /// Most neighbours that are listed.
        limit: u64,
    },
    /// The neighbourhoods of a lattice are too wide to be listed.
    #[error("the particles have about {about} neighbours in all, at most {limit} are kept")]
    ManyNeighbours {
        /// Neighbours of all particles together, an upper bound.
        about: u64,
        /// Most neighbours that are listed.
        limit: u64,
    },
    /// The neighbourhood cannot be laid on the lattice.
    #[error(transparent)]
    Neighbourhood(#[from] NeighbourhoodError),
}

/// Particles in the paper's numbering: column by column, from the bottom, the frame included.
/// Indices count from 0 here and ids from 1 in files and messages; particles given as points have the ids and, in
/// files, the order that they were given with.
#[derive(Clone, Debug)]
pub struct Body {
    /// The lattice that the sites belong to; of particles given as points its spacing alone has a meaning.
    pub lattice: Lattice,
    /// Column and row of each particle, shape \[count\].
    pub sites: Vec<Site>,
    /// Reference positions \[length\], shape \[count\]; shared with the flock.
    pub reference: Arc<Vectors>,
    /// Whether the particle belongs to the frame, shape \[count\].
    pub is_frame: Vec<bool>,
    /// The shell around the body; none where no frame was asked for.
    pub frame: Option<Frame>,
    /// The user's ids of particles that were given as points; they lie on no lattice.
    pub numbering: Option<Arc<Numbering>>,
    /// Which particles stand on the outline of the shape that the body was fitted to; of a body of whole cells,
    /// which keeps no outline, nothing.
    pub outline: Option<Arc<OutlineParticles>>,
    /// The place of these particles in the whole body, where they are not all of it.
    pub part: Option<Part>,
}

/// Particles in some columns of a body, by their place in the whole one, in which particles along an outline are counted with
/// their columns here. Around those that [`Part::owned`] names stand
/// others, of which those in [`Part::exact`] have the number, the neighbours and the frame that they have in the whole body; the
/// outermost ones are there for these to be found.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Index of the first particle in the whole body.
    pub first: usize,
    /// Particles of the whole body, the frame's included.
    pub total: usize,
    /// The particles that belong to this part.
    pub owned: Range<usize>,
    /// Those that are as in the whole body, the owned ones among them.
    pub exact: Range<usize>,
    /// Of the whole body.
    pub whole: Extent,
    /// Of a body with an outline that cuts cells.
    pub along: Option<Arc<AlongOutline>>,
}

/// The particles of a part that stand along an outline and at no site of the lattice: the whole body has them after all others.
#[derive(Clone, Debug, PartialEq)]
pub struct AlongOutline {
    /// Particles of the whole body that stand at sites.
    regular: usize,
    /// The index in the whole body of the first of these that stands here.
    first: usize,
    /// Their index here, and in the whole body, ascending.
    here: Vec<[usize; 2]>,
    /// How many others stand before each of them.
    before: Vec<usize>,
    by_index: HashMap<usize, usize>,
    /// The number of each cut cell among those of the whole body, in the order of the cells.
    cut: Vec<usize>,
}

impl AlongOutline {
    /// `here` are their indices here and their numbers among all such, ascending, and `cut` the numbers of the cut cells; of a
    /// body of so many `regular` particles, of which the `first` one that stands here is known.
    pub fn new(
        (regular, first): (usize, usize),
        here: impl IntoIterator<Item = [usize; 2]>,
        cut: Vec<usize>,
    ) -> Self {
        let here: Vec<_> = here.into_iter().map(|[here, number]| [here, regular + number]).collect();
        let before = here.iter().enumerate().map(|(k, [here, _])| here - k).collect();
        let by_index = here.iter().map(|&[here, index]| (index, here)).collect();
        Self { regular, first, here, before, by_index, cut }
    }

    fn index(&self, particle: usize) -> usize {
        match self.here.binary_search_by_key(&particle, |of| of[0]) {
            Ok(k) => self.here[k][1],
            Err(k) => self.first + particle - k,
        }
    }

    fn here(&self, index: usize) -> Option<usize> {
        if index >= self.regular {
            return self.by_index.get(&index).copied();
        }
        let regular = index.checked_sub(self.first)?;
        Some(regular + self.before.partition_point(|&before| before <= regular))
    }
}

/// The size of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Bounds without the frame \[length\]; the lower above the higher where there is no particle.
    pub bounds: ([f64; 2], [f64; 2]),
    /// Lowest column and row of a particle, the frame's included.
    pub lowest: Site,
    /// Most neighbours of a particle.
    pub neighbours: usize,
}

impl Extent {
    /// Of nothing.
    pub const NONE: Self =
        Self { bounds: ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), lowest: [i32::MAX; 2], neighbours: 0 };

    /// Of both.
    pub fn or(self, other: Self) -> Self {
        let both = |of: fn(f64, f64) -> f64, a: [f64; 2], b: [f64; 2]| [of(a[0], b[0]), of(a[1], b[1])];
        let ((low, high), (other_low, other_high)) = (self.bounds, other.bounds);
        Self {
            bounds: (both(f64::min, low, other_low), both(f64::max, high, other_high)),
            lowest: [self.lowest[0].min(other.lowest[0]), self.lowest[1].min(other.lowest[1])],
            neighbours: self.neighbours.max(other.neighbours),
        }
    }
}

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

/// The particles of a body that was fitted to an outline.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineParticles {
    /// How many particles stand at sites of the lattice: the first ones. The others stand along the outline, in its
    /// order, and have [`Body::ALONG_OUTLINE`] for a column.
    pub regular: usize,
    /// Where each particle is on the outline, shape \[count\]; `None` for those inside.
    pub places: Vec<Option<Place>>,
}

/// More lattice sites than this are refused before memory is asked for, where they are to stand in one process.
pub(crate) const MOST_SITES: u64 = 1 << 28;

/// Columns and rows beyond this one are refused, or sums of two would leave the integers.
const FARTHEST_SITE: u64 = 1_000_000_000;

/// More neighbour entries than this are refused before memory is asked for: 4 GiB.
pub(crate) const MOST_ENTRIES: u64 = 1 << 30;

impl Body {
    /// Column of the particles that stand along the outline and at no site: beyond all columns of the lattice.
    pub const ALONG_OUTLINE: i32 = 1 << 30;

    /// Cuts the body, adds the frame where a rule for it is given, and lists each particle's neighbours.
    pub fn build(
        lattice: Lattice,
        cut: &Cut,
        neighbourhood: &Neighbourhood,
        frame: Option<FrameRule>,
    ) -> Result<(Self, Neighbours), BodyError> {
        Outlay { lattice: &lattice, cut, neighbourhood, frame, cells: Vec::new() }.lay_out(None)
    }
}

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
        let neighbours = Neighbours::from_lists(sites.iter().zip(&is_frame).map(|(&site, &is_frame)| {
            let offsets: &[Site] = if is_frame { &[] } else { &offsets[lattice.sublattice(site)] };
            offsets.iter().filter_map(move |offset| map.index([site[0] + offset[0], site[1] + offset[1]]))
        }));
        let frame = frame.map(|rule| Frame::build(rule, lattice, &sites, &is_frame, |site| map.index(site)));
        let lattice = lattice.clone();
        let body =
            Body { lattice, sites, reference, is_frame, frame, numbering: None, outline: None, part: None };
        Ok((body, neighbours))
    }
}

impl Body {
    /// Particles that lie on no lattice. Of one they keep the `spacing` \[length\]; their sites are a row, in
    /// their order.
    pub(crate) fn of_places(places: Vectors, spacing: f64) -> Self {
        Self {
            lattice: Lattice::new(LatticeKind::Square { spacing }, [0.0; 2], 0.0),
            sites: (0..places.len() as i32).map(|i| [i, 0]).collect(),
            is_frame: vec![false; places.len()],
            reference: Arc::new(places),
            frame: None,
            numbering: None,
            outline: None,
            part: None,
        }
    }

    /// The id of a particle in files and messages.
    pub fn id(&self, particle: usize) -> usize {
        self.id_of(self.index(particle))
    }

    /// The id of the particle with this index in the whole body.
    pub(crate) fn id_of(&self, index: usize) -> usize {
        self.numbering.as_ref().map_or(index + 1, |numbering| numbering.id(index) as usize)
    }

    /// The index in the whole body of the particle that the user calls so.
    pub fn index_of(&self, id: usize) -> Option<usize> {
        match &self.part {
            Some(part) => id.checked_sub(1).filter(|&index| index < part.total),
            None => self.particle(id),
        }
    }

    /// The index of a particle in the whole body.
    pub fn index(&self, particle: usize) -> usize {
        match self.along_outline() {
            Some(along) => along.index(particle),
            None => self.first() + particle,
        }
    }

    /// The particle with this index in the whole body, if it is here as in that.
    pub fn exact_particle(&self, index: usize) -> Option<usize> {
        self.here(index).filter(|particle| self.exact().contains(particle))
    }

    fn here(&self, index: usize) -> Option<usize> {
        match self.along_outline() {
            Some(along) => along.here(index),
            None => index.checked_sub(self.first()),
        }
    }

    fn along_outline(&self) -> Option<&AlongOutline> {
        self.part.as_ref()?.along.as_deref()
    }

    /// Whether any part of the body has such particles, or cells, as come after all others in the whole.
    pub fn has_some_after_all(&self) -> bool {
        self.along_outline().is_some()
    }

    /// The index in the whole body of a particle of a part that comes there after those of all parts.
    pub fn index_after_all(&self, particle: usize) -> Option<usize> {
        self.along_outline().filter(|_| self.sites[particle][0] == Self::ALONG_OUTLINE)?;
        Some(self.index(particle))
    }

    /// The same of a cell: its number among those that an outline has cut; `whole` is how many others come before them here.
    pub fn cell_after_all(&self, cell: usize, whole: usize) -> Option<usize> {
        self.along_outline()?.cut.get(cell.checked_sub(whole)?).copied()
    }

    /// The index in the whole body of the first particle from here on that does not come after those of all parts.
    pub fn index_from(&self, particle: usize) -> usize {
        match self.along_outline() {
            Some(along) => along.first + particle - along.here.partition_point(|of| of[0] < particle),
            None => self.first() + particle,
        }
    }

    /// The particles that belong to this part, in the order of the whole body.
    pub fn owned_in_order(&self) -> Vec<usize> {
        let mut owned: Vec<usize> = self.owned().collect();
        if self.along_outline().is_some() {
            owned.sort_by_key(|&i| self.index(i));
        }
        owned
    }

    /// The place of the first particle that stands here among all of the whole body, those along an outline counted with their
    /// columns.
    pub fn first(&self) -> usize {
        self.part.as_ref().map_or(0, |part| part.first)
    }

    /// Particles of the whole body, those of the frame included.
    pub fn total(&self) -> usize {
        self.part.as_ref().map_or(self.count(), |part| part.total)
    }

    /// The particles that belong to this part of the body; all of a whole one.
    pub fn owned(&self) -> Range<usize> {
        self.part.as_ref().map_or(0..self.count(), |part| part.owned.clone())
    }

    /// The particles that see here what they see in the whole body: all but those that are there for others to have
    /// neighbours.
    pub fn exact(&self) -> Range<usize> {
        self.part.as_ref().map_or(0..self.count(), |part| part.exact.clone())
    }

    /// The ids of the two ends of a bond, given by their indices in the whole body, the lower first.
    pub fn ids(&self, pair: [u32; 2]) -> [usize; 2] {
        let [a, b] = pair.map(|index| self.id_of(index as usize));
        [a.min(b), a.max(b)]
    }

    /// The particle that the user calls so, if it stands here.
    pub fn particle(&self, id: usize) -> Option<usize> {
        match &self.numbering {
            Some(numbering) => numbering.particle(id),
            None => self.here(id.checked_sub(1)?).filter(|&particle| particle < self.count()),
        }
    }

    /// The particle in a row of the user's list, which is the order in which files and messages have them.
    pub fn in_row(&self, row: usize) -> usize {
        self.numbering.as_ref().map_or(row, |numbering| numbering.in_row(row))
    }

    /// All particles in the order in which files and messages have them.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = usize> + Clone + '_ {
        (0..self.count()).map(|row| self.in_row(row))
    }

    /// Number of particles that stand here, those of the frame included.
    pub fn count(&self) -> usize {
        self.sites.len()
    }

    /// Indices of the particles that are no frame.
    pub(crate) fn body_particles(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.count()).filter(|&i| !self.is_frame[i])
    }

    /// Bounds of the whole body without its frame \[length\].
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        if let Some(part) = &self.part {
            return part.whole.bounds;
        }
        self.reference.bounds(self.body_particles()).unwrap_or(([0.0; 2], [0.0; 2]))
    }

    /// The measure of how far along the longer side of the body's bounds a place lies, from 0 to 1.
    pub fn along(&self) -> impl Fn([f64; 2]) -> f64 + use<> {
        let (low, high) = self.bounds();
        let long = usize::from(high[1] - low[1] > high[0] - low[0]);
        let length = high[long] - low[long];
        move |place| if length > 0.0 { (place[long] - low[long]) / length } else { 0.0 }
    }

    /// Refuses a body some of whose particles cannot feel each other through any chain of
    /// neighbours.
    pub fn require_connected(&self, neighbours: &Neighbours) -> Result<(), BodyError> {
        let labels = self.components(neighbours);
        let first = self.body_particles().next().unwrap_or(0);
        match self.body_particles().find(|&i| labels[i] != labels[first]) {
            None => Ok(()),
            Some(second) => {
                let mut parts: Vec<u32> = self.body_particles().map(|i| labels[i]).collect();
                parts.sort_unstable();
                parts.dedup();
                let [first, second] = [first, second].map(|i| self.id(i));
                Err(BodyError::Disconnected { parts: parts.len(), first, second })
            }
        }
    }

    /// Label of the connected part each particle belongs to, neighbour relations taken both ways and
    /// the frame left out, shape \[count\].
    pub fn components(&self, neighbours: &Neighbours) -> Vec<u32> {
        let mut parts = DisjointSets::new(self.count());
        for i in 0..self.count() {
            let within = neighbours.of(i).iter().filter(|&&k| !self.is_frame[k as usize]);
            within.for_each(|&k| parts.join(i as u32, k));
        }
        parts.labels()
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
        let (mut sites, mut is_frame) = (Vec::new(), Vec::new());
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
            let (low, high) = shape.bounds();
            let corners = [low, [high[0], low[1]], high, [low[0], high[1]]]
                .map(|corner| lattice.grid_coordinates(corner));
            let extreme = |k: usize, pick: fn(f64, f64) -> f64, start: f64| {
                corners.iter().map(|corner| corner[k]).fold(start, pick)
            };
            let lows = [0, 1].map(|k| extreme(k, f64::min, f64::INFINITY).floor() - 1.0);
            let highs = [0, 1].map(|k| extreme(k, f64::max, f64::NEG_INFINITY).ceil() + 1.0);
            let in_range = lows.iter().chain(&highs).all(|v| v.abs() <= FARTHEST_SITE as f64);
            if !in_range {
                return Err(BodyError::TooLarge { limit: MOST_SITES });
            }
            Ok((lows.map(|v| v as i32), highs.map(|v| v as i32)))
        }
    }
}
