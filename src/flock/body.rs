//! A body: the sites of a lattice inside a shape, numbered, with the frame around them.

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

/// More lattice sites than this are refused before memory is asked for.
pub const MOST_SITES: u64 = 1 << 28;

/// More neighbour entries than this are refused before memory is asked for: 4 GiB.
pub const MOST_ENTRIES: u64 = 1 << 30;

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
        let offsets = neighbourhood.offsets(&lattice)?;
        let mut shell = offsets.clone();
        if frame.is_some() {
            // The corners of a rectangle touch no edge particle, yet the paper numbers them.
            let corners = lattice.cell_corners();
            shell.iter_mut().for_each(|offsets| offsets.extend(&corners));
        }
        let margin = if frame.is_some() { reach(&shell) } else { [0, 0] };
        let mut map = SiteMap::cut(&lattice, cut, margin)?;
        if frame.is_some() {
            map.mark_frame(&lattice, &shell);
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
        let frame = frame.map(|rule| Frame::build(rule, &lattice, &sites, &is_frame, |site| map.index(site)));
        Ok((Self { lattice, sites, reference, is_frame, frame, numbering: None, outline: None }, neighbours))
    }

    /// Particles that lie on no lattice. Of one they keep the `spacing` \[length\]; their sites are a row, in
    /// their order.
    pub fn of_places(places: Vectors, spacing: f64) -> Self {
        Self {
            lattice: Lattice::new(LatticeKind::Square { spacing }, [0.0; 2], 0.0),
            sites: (0..places.len() as i32).map(|i| [i, 0]).collect(),
            is_frame: vec![false; places.len()],
            reference: Arc::new(places),
            frame: None,
            numbering: None,
            outline: None,
        }
    }

    /// The id of a particle in files and messages.
    pub fn id(&self, particle: usize) -> usize {
        self.numbering.as_ref().map_or(particle + 1, |numbering| numbering.id(particle) as usize)
    }

    /// The ids of the two ends of a bond, the lower first.
    pub fn ids(&self, pair: [u32; 2]) -> [usize; 2] {
        let [a, b] = pair.map(|particle| self.id(particle as usize));
        [a.min(b), a.max(b)]
    }

    /// The particle that the user calls so.
    pub fn particle(&self, id: usize) -> Option<usize> {
        match &self.numbering {
            Some(numbering) => numbering.particle(id),
            None => id.checked_sub(1).filter(|&particle| particle < self.count()),
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

    /// Number of particles, those of the frame included.
    pub fn count(&self) -> usize {
        self.sites.len()
    }

    /// Indices of the particles that are no frame.
    pub fn body_particles(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.count()).filter(|&i| !self.is_frame[i])
    }

    /// Bounds of the body without its frame \[length\].
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
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

    fn cut(lattice: &Lattice, cut: &Cut, margin: Site) -> Result<Self, BodyError> {
        let (low, high) = window(lattice, cut)?;
        let wider = |site: Site, by: i32| [site[0] + by * margin[0], site[1] + by * margin[1]];
        let window = Window::new(wider(low, -1), wider(high, 1));
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
        if map.cells.contains(&BODY) {
            return Ok(map);
        }
        let (low, high) = match cut {
            Cut::Shape(shape) => shape.bounds(),
            Cut::Count { .. } => ([0.0; 2], [0.0; 2]),
        };
        Err(BodyError::Empty {
            spacing: lattice.spacing(),
            width: high[0] - low[0],
            height: high[1] - low[1],
        })
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
            let too_large = BodyError::TooLarge { limit: MOST_SITES };
            let across = u64::from(columns_per_site(lattice)) * u64::from(*columns);
            if across.saturating_mul(u64::from(*rows)) > MOST_SITES {
                return Err(too_large);
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
            let cells = (highs[0] - lows[0] + 1.0) * (highs[1] - lows[1] + 1.0);
            let in_range = lows.iter().chain(&highs).all(|v| v.abs() < 1e9);
            if !(in_range && cells <= MOST_SITES as f64) {
                return Err(BodyError::TooLarge { limit: MOST_SITES });
            }
            Ok((lows.map(|v| v as i32), highs.map(|v| v as i32)))
        }
    }
}
