//! The neighbours whose positions a particle sees (the paper's Choice 2).

use std::f64::consts::PI;
use std::ops::Range;

use super::grid::CellGrid;
use super::lattice::{Lattice, Site, ring};
use super::vectors::Vectors;

/// How the neighbours of a particle are chosen.
#[derive(Clone, Debug, PartialEq)]
pub enum Neighbourhood {
    /// The first `nc`, `nc` being the lattice's coordination number; `keep` reduces them, dropping
    /// from the end of the order of [`Lattice::offsets_within`].
    First {
        /// How many are kept; all where there is none.
        keep: Option<usize>,
    },
    /// All sites within `radius` primitive cells each way: 8 for radius 1, 24 for radius 2.
    Chebyshev {
        /// Primitive cells each way.
        radius: i32,
    },
    /// The first neighbours and theirs (the paper's second gradient).
    Second,
    /// The first neighbours and the sites behind them, twice as far in the same directions.
    Collinear,
    /// The sites at these offsets, in columns and rows.
    Offsets(Vec<Site>),
    /// The sites within this distance in the reference configuration \[length\].
    Within {
        /// Greatest distance in the reference configuration \[length\].
        radius: f64,
    },
    /// The particles within this distance now \[length\]: the paper's liquid and gas.
    Dynamic {
        /// Greatest present distance \[length\].
        radius: f64,
    },
}

/// Why a neighbourhood cannot be laid on a lattice.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NeighbourhoodError {
    /// More neighbours are to be kept than there are.
    #[error("the {lattice} lattice has {coordination} first neighbours, {keep} cannot be kept")]
    TooMany {
        /// Name of the lattice.
        lattice: &'static str,
        /// First neighbours that it has.
        coordination: usize,
        /// Neighbours that were asked for.
        keep: usize,
    },
    /// An offset that leads to no site of the lattice.
    #[error("offset [{}, {}] leads from a {lattice} site to a place that is no site", .offset[0], .offset[1])]
    NoSite {
        /// Name of the lattice.
        lattice: &'static str,
        /// The offset, in columns and rows.
        offset: Site,
    },
    /// A Chebyshev neighbourhood on a honeycomb.
    #[error("a honeycomb has no Chebyshev ring: its sites are no translations of each other")]
    RingOnHoneycomb,
    /// A collinear neighbourhood on a lattice that does not go on straight behind its first neighbours.
    #[error("on a {lattice} lattice no site lies twice as far in the direction of a first neighbour")]
    NothingBehind {
        /// Name of the lattice.
        lattice: &'static str,
    },
    /// A radius that reaches no other site.
    #[error("no site lies within {radius} of another: the nearest is {spacing} away")]
    TooSmall {
        /// The radius \[length\].
        radius: f64,
        /// Distance of the nearest site \[length\].
        spacing: f64,
    },
    /// A radius that reaches too many sites.
    #[error("a particle would see about {about:.3e} others, at most {limit} are listed")]
    TooLarge {
        /// Sites within it, estimated from the area of a cell.
        about: f64,
        /// Most sites that are listed.
        limit: u32,
    },
}

/// Neighbours of a particle above which nothing is listed: a radius of 600 spacings.
const MOST_OFFSETS: u32 = 1 << 20;

impl Neighbourhood {
    /// Neighbours that a particle far inside the body would have, before any is looked for; 0 where they are few.
    fn about(&self, lattice: &Lattice) -> f64 {
        match self {
            Neighbourhood::Within { radius } => PI * radius * radius / lattice.cell_area(),
            _ => 0.0,
        }
    }

    /// Offsets to the neighbours of a site, for each sublattice, in summation order; empty for
    /// [`Neighbourhood::Dynamic`], whose neighbours are no function of the lattice.
    ///
    /// # Errors
    /// A neighbourhood that the lattice has not, or one so wide that it would take minutes to list.
    pub fn offsets(&self, lattice: &Lattice) -> Result<Vec<Vec<Site>>, NeighbourhoodError> {
        let about = self.about(lattice);
        if about > f64::from(MOST_OFFSETS) {
            return Err(NeighbourhoodError::TooLarge { about, limit: MOST_OFFSETS });
        }
        (0..lattice.sublattices()).map(|sublattice| self.offsets_of(lattice, sublattice)).collect()
    }

    fn offsets_of(&self, lattice: &Lattice, sublattice: usize) -> Result<Vec<Site>, NeighbourhoodError> {
        let first = || lattice.first_neighbours(sublattice);
        let mut offsets = match self {
            Neighbourhood::First { keep: None } => first(),
            Neighbourhood::First { keep: Some(keep) } => {
                let mut offsets = first();
                if *keep > offsets.len() {
                    return Err(NeighbourhoodError::TooMany {
                        lattice: lattice.name(),
                        coordination: offsets.len(),
                        keep: *keep,
                    });
                }
                offsets.truncate(*keep);
                offsets
            }
            Neighbourhood::Chebyshev { .. } if lattice.sublattices() > 1 => {
                return Err(NeighbourhoodError::RingOnHoneycomb);
            }
            Neighbourhood::Chebyshev { radius } => ring(&lattice.primitive(), *radius),
            Neighbourhood::Second => neighbours_of_neighbours(lattice, sublattice),
            Neighbourhood::Collinear => straight(lattice, sublattice)?,
            Neighbourhood::Offsets(offsets) => {
                let base = lattice.site_of_sublattice(sublattice);
                if let Some(&offset) =
                    offsets.iter().find(|o| !lattice.is_site([base[0] + o[0], base[1] + o[1]]))
                {
                    return Err(NeighbourhoodError::NoSite { lattice: lattice.name(), offset });
                }
                // The user's order is kept: it is the order of summation.
                return Ok(offsets.clone());
            }
            Neighbourhood::Within { radius } => {
                let offsets = lattice.offsets_within(sublattice, *radius);
                if offsets.is_empty() {
                    return Err(NeighbourhoodError::TooSmall { radius: *radius, spacing: lattice.spacing() });
                }
                offsets
            }
            Neighbourhood::Dynamic { .. } => Vec::new(),
        };
        lattice.sort_nearest_first(&mut offsets);
        Ok(offsets)
    }
}

fn straight(lattice: &Lattice, sublattice: usize) -> Result<Vec<Site>, NeighbourhoodError> {
    let base = lattice.site_of_sublattice(sublattice);
    let first = lattice.first_neighbours(sublattice);
    let behind: Vec<Site> = first.iter().map(|&[i, j]| [2 * i, 2 * j]).collect();
    if behind.iter().any(|[i, j]| !lattice.is_site([base[0] + i, base[1] + j])) {
        return Err(NeighbourhoodError::NothingBehind { lattice: lattice.name() });
    }
    Ok([first, behind].concat())
}

fn neighbours_of_neighbours(lattice: &Lattice, sublattice: usize) -> Vec<Site> {
    let base = lattice.site_of_sublattice(sublattice);
    let first = lattice.first_neighbours(sublattice);
    let mut offsets = first.clone();
    for near in first {
        let there = lattice.sublattice([base[0] + near[0], base[1] + near[1]]);
        offsets
            .extend(lattice.first_neighbours(there).iter().map(|far| [near[0] + far[0], near[1] + far[1]]));
    }
    offsets.sort_unstable();
    offsets.dedup();
    offsets.retain(|&offset| offset != [0, 0]);
    offsets
}

/// Neighbour lists in compressed rows: particle `j` sees `index[starts[j]..starts[j + 1]]`, in
/// summation order. Shapes: `starts` \[count + 1\], `index` \[bonds\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Neighbours {
    /// Where the bonds of each particle begin; the last entry is the number of bonds.
    pub starts: Vec<u32>,
    /// The particle that each bond leads to.
    pub index: Vec<u32>,
}

impl Neighbours {
    /// One list for each particle, in the order of the particles.
    pub fn from_lists(lists: impl IntoIterator<Item = impl IntoIterator<Item = u32>>) -> Self {
        Self::from_lists_of(0, lists)
    }

    /// The same with room for so many entries: a list that grows takes twice as much at its last step.
    pub(crate) fn from_lists_of(
        entries: usize,
        lists: impl IntoIterator<Item = impl IntoIterator<Item = u32>>,
    ) -> Self {
        let lists = lists.into_iter();
        let mut starts = Vec::with_capacity(1 + lists.size_hint().0);
        starts.push(0);
        let mut neighbours = Self { starts, index: Vec::with_capacity(entries) };
        for list in lists {
            neighbours.index.extend(list);
            neighbours.starts.push(neighbours.index.len() as u32);
        }
        neighbours
    }

    /// Number of particles that have a list, even an empty one.
    pub fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Where the bonds of `particle` lie in `index` and in every array parallel to it.
    pub fn bonds(&self, particle: usize) -> Range<usize> {
        self.starts[particle] as usize..self.starts[particle + 1] as usize
    }

    /// The particles that `particle` sees, in summation order.
    #[inline]
    pub fn of(&self, particle: usize) -> &[u32] {
        &self.index[self.bonds(particle)]
    }

    /// The stretch of the numbering that holds these particles and all that they see.
    pub(crate) fn seen_from(&self, particles: Range<usize>) -> Range<usize> {
        let bonds = self.starts[particles.start] as usize..self.starts[particles.end] as usize;
        let seen = |(start, end): (usize, usize), &k: &u32| (start.min(k as usize), end.max(k as usize + 1));
        let (start, end) = self.index[bonds].iter().fold((particles.start, particles.end), seen);
        start..end
    }

    /// Rebuilds the lists as those of the `members` within `radius` now, in order of index.
    /// Reuses the buffers: no allocation once they have grown.
    pub(crate) fn rebuild_within(
        &mut self,
        grid: &mut CellGrid,
        present: &Vectors,
        members: &[bool],
        radius: f64,
    ) {
        // As `Lattice::offsets_within` takes those that are off by rounding.
        let radius = radius * (1.0 + 1e-9);
        grid.fill(present, members, radius);
        grid.all_within(members.len(), radius, &mut self.starts, &mut self.index);
    }
}

#[cfg(test)]
mod tests {
    use super::super::lattice::LatticeKind;
    use super::*;

    fn count(kind: LatticeKind, neighbourhood: Neighbourhood) -> Vec<usize> {
        let lattice = Lattice::new(kind, [0.0, 0.0], 0.0);
        neighbourhood.offsets(&lattice).expect("fits").iter().map(Vec::len).collect()
    }

    #[test]
    fn the_counts_are_those_of_the_paper() {
        let square = LatticeKind::Square { spacing: 1.0 };
        let hexagonal = LatticeKind::Hexagonal { spacing: 1.0 };
        let honeycomb = LatticeKind::Honeycomb { spacing: 1.0 };
        assert_eq!(count(square, Neighbourhood::First { keep: None }), [4]);
        assert_eq!(count(square, Neighbourhood::Second), [12]);
        assert_eq!(count(square, Neighbourhood::Collinear), [8]);
        assert_eq!(count(hexagonal, Neighbourhood::Collinear), [12]);
        assert_eq!(count(square, Neighbourhood::Chebyshev { radius: 1 }), [8]);
        assert_eq!(count(square, Neighbourhood::Chebyshev { radius: 2 }), [24]);
        assert_eq!(count(hexagonal, Neighbourhood::Second), [18]);
        assert_eq!(count(hexagonal, Neighbourhood::First { keep: Some(5) }), [5]);
        assert_eq!(count(honeycomb, Neighbourhood::Second), [9, 9]);
        assert_eq!(count(square, Neighbourhood::Within { radius: 1.5 }), [8]);
    }

    #[test]
    fn what_does_not_fit_the_lattice_is_refused() {
        let honeycomb = Lattice::new(LatticeKind::Honeycomb { spacing: 1.0 }, [0.0, 0.0], 0.0);
        let refused = |n: Neighbourhood| n.offsets(&honeycomb).expect_err("refused");
        assert_eq!(refused(Neighbourhood::Chebyshev { radius: 1 }), NeighbourhoodError::RingOnHoneycomb);
        assert!(matches!(refused(Neighbourhood::Collinear), NeighbourhoodError::NothingBehind { .. }));
        assert!(matches!(
            refused(Neighbourhood::First { keep: Some(4) }),
            NeighbourhoodError::TooMany { .. }
        ));
        assert!(matches!(refused(Neighbourhood::Offsets(vec![[1, 0]])), NeighbourhoodError::NoSite { .. }));
        assert!(matches!(
            refused(Neighbourhood::Within { radius: 0.5 }),
            NeighbourhoodError::TooSmall { .. }
        ));
    }
}
