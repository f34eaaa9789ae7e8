//! A part of a body: which of its particles it has, and their numbers in the whole one.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::body::Body;
use super::lattice::Site;

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

impl Body {
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

    /// The same wherever it is here.
    pub(super) fn here(&self, index: usize) -> Option<usize> {
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
}
