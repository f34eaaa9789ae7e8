//! A body: the sites of a lattice inside a shape, numbered, with the frame around them.

use std::sync::Arc;

use super::frame::{Frame, FrameRule};
use super::lattice::{Lattice, LatticeKind, Site};
use super::neighbourhood::{Neighbourhood, NeighbourhoodError, Neighbours};
use super::numbering::Numbering;
use super::outlay::Outlay;
use super::part::Part;
use super::vectors::Vectors;
use crate::geometry::disjoint_sets::DisjointSets;
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

/// The particles of a body that was fitted to an outline.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineParticles {
    /// How many particles stand at sites of the lattice: the first ones. The others stand along the outline, in its
    /// order, and have [`Body::ALONG_OUTLINE`] for a column.
    pub regular: usize,
    /// Where each particle is on the outline, shape \[count\]; `None` for those inside.
    pub places: Vec<Option<Place>>,
}

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
