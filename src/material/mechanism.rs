//! Whether the cells hold the body together.
//!
//! Cells joined along a side are rigid together. Cells joined at a corner only are hinged there: the
//! particle belongs to both, and nothing resists the turning of one about the other. Parts of a body
//! (cells joined along sides) are therefore treated as rigid bodies pinned to each other at the
//! particles that they share, and the body is refused if that linkage can move other than as a whole.
//! A hinge between parts that are pinned elsewhere too is harmless and passes.

use std::cell::LazyCell;

use nalgebra::{DMatrix, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::cells::{Cells, Incidence};
use crate::flock::vectors::Vectors;
use crate::geometry::Point;
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::lists::distinct;

/// How a body, or what its leaders hold of it, can move without strain. Particles are named by their
/// ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Mechanism {
    /// A particle without a cell around it.
    #[error(
        "a mechanism: particle {particle} belongs to no cell, so nothing holds it to the body; fill or remove its surroundings"
    )]
    NoCell {
        /// Its id.
        particle: usize,
    },
    /// Parts of the body hinge on a particle where nothing else pins them.
    #[error(
        "a mechanism: at particle {particle} cells meet at a corner only, and one side turns about it like a hinge"
    )]
    Hinge {
        /// Id of the particle that turns most.
        particle: usize,
    },
    /// Two parts of the body are joined by no chain of cells.
    #[error("a mechanism: no chain of cells joins particle {first} to particle {second}")]
    Apart {
        /// Id of a particle of one part.
        first: usize,
        /// Id of a particle of another part.
        second: usize,
    },
    /// No particle of a part is held.
    #[error("a mechanism: no leader holds the part of the body to which particle {particle} belongs")]
    Loose {
        /// Id of a particle of the part.
        particle: usize,
    },
    /// A single particle of a part is held.
    #[error(
        "a mechanism: the part of the body to which particle {particle} belongs is held at one particle only and turns about it"
    )]
    Turns {
        /// Id of a particle of the part.
        particle: usize,
    },
    /// Single components of a part's particles are held, which leave it a motion.
    #[error(
        "a mechanism: the part of the body to which particle {particle} belongs can slide or turn along the components that are left free"
    )]
    Slides {
        /// Id of a particle of the part.
        particle: usize,
    },
}

/// Linkages of more parts than this are not analysed: a hinge among them counts as a mechanism.
const MOST_PARTS: usize = 128;

/// Parts of a body and the particles at which they are pinned to each other; particles by their index in the whole body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Linkage {
    /// The first corner of the first cell of each part, shape \[parts\].
    pub corners: Vec<usize>,
    /// In the order of particles.
    pub hinges: Vec<Hinge>,
}

/// A particle in two or more parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hinge {
    /// Its index.
    pub particle: usize,
    /// Where it stands in the reference configuration \[length\].
    pub place: Point,
    /// The parts, ascending.
    pub parts: Vec<usize>,
}

/// The particles of parts that are pinned to each other, and what holds them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hold {
    /// The first of them.
    pub first: usize,
    /// How many are held, if by one component.
    pub held: usize,
    /// How many are held altogether.
    pub whole: usize,
}

impl Hold {
    /// Of no particle.
    pub const NONE: Self = Self { first: usize::MAX, held: 0, whole: 0 };

    /// With one more particle, of which these components are held.
    pub fn with(self, particle: usize, held: [bool; 2]) -> Self {
        Self {
            first: self.first.min(particle),
            held: self.held + usize::from(held != [false; 2]),
            whole: self.whole + usize::from(held == [true; 2]),
        }
    }
}

/// A place \[length\] of a part, and the components that are held there.
pub type HeldPlace = (Point, usize, [bool; 2]);

/// Lower and higher corner of what the body stands in \[length\].
pub type Bounds = (Point, Point);

/// Refuses a body whose cells can move against each other without strain. `members` says which
/// particles should belong to a cell (those that are not frame), shape \[count\].
pub fn require_rigid(
    cells: &Cells,
    incidence: &Incidence,
    reference: &Vectors,
    members: impl Fn(usize) -> bool,
) -> Result<(), Mechanism> {
    let orphan = (0..reference.len()).find(|&i| members(i) && incidence.of(i).is_empty());
    if let Some(i) = orphan {
        return Err(Mechanism::NoCell { particle: i + 1 });
    }
    Linkage::of(cells, incidence, reference).1.require_rigid(bounds_of(reference))
}

/// Refuses a body that the `held` components of its particles (leaders, clamps, rollers) do not keep from moving as a
/// whole or in part, shape \[count\]\[x, y\]: some part of it is not held, or can turn or slide.
pub fn require_held(
    cells: &Cells,
    incidence: &Incidence,
    reference: &Vectors,
    held: &[[bool; 2]],
) -> Result<(), Mechanism> {
    let (part, linkage) = Linkage::of(cells, incidence, reference);
    let part_of = |i: usize| incidence.of(i).first().map(|&cell| part[cell as usize]);
    let groups = linkage.groups();
    let group_of = |i: usize| part_of(i).map(|part| groups[part]);
    let mut holds = vec![Hold::NONE; groups.len()];
    for (i, &held) in held.iter().enumerate() {
        if let Some(group) = group_of(i) {
            holds[group] = holds[group].with(i, held);
        }
    }
    let places = || {
        let held_of = (0..held.len()).filter(|&i| held[i] != [false; 2]);
        let of = |i: usize| incidence.of(i).iter().map(move |&cell| (i, cell));
        held_of.flat_map(of).map(|(i, cell)| (reference.get(i), part[cell as usize], held[i])).collect()
    };
    linkage.require_held(bounds_of(reference), &holds, places)
}

fn bounds_of(reference: &Vectors) -> Bounds {
    reference.bounds(0..reference.len()).unwrap_or_default()
}

/// Rigid motions (two translations, one turn) that what is held of these particles leaves.
fn free_motions(members: &[HeldPlace]) -> usize {
    let centre = members
        .iter()
        .fold([0.0; 2], |[x, y], (p, ..)| [x + p[0] / members.len() as f64, y + p[1] / members.len() as f64]);
    let from = |p: Point| [0, 1].map(|k| p[k] - centre[k]);
    let size = members.iter().map(|&(p, ..)| from(p)[0].hypot(from(p)[1])).fold(f64::MIN_POSITIVE, f64::max);
    let rows = members.iter().flat_map(|&(p, _, held)| {
        let [x, y] = from(p).map(|v| v / size);
        let components = [[1.0, 0.0, -y], [0.0, 1.0, x]].into_iter().zip(held);
        components.filter_map(|(row, held)| held.then_some(row))
    });
    let gram = rows.fold(Matrix3::zeros(), |sum, row| {
        let row = Vector3::from(row);
        sum + row * row.transpose()
    });
    let values = gram.symmetric_eigenvalues();
    let most = values.max();
    values.iter().filter(|value| **value <= 1e-9 * most).count()
}

/// Label of each cell, the same for those that hang together along sides: the lowest of them, shape \[cells\].
pub fn joined_cells(cells: &Cells, incidence: &Incidence) -> Vec<u32> {
    let mut joined = DisjointSets::new(cells.count());
    for cell in 0..cells.count() {
        // The other cell has the side the other way round: one of them looks.
        for side in cells.sides(cell).filter(|[a, b]| a < b) {
            if let Some(other) = cells.across(incidence, side) {
                joined.join(cell as u32, other as u32);
            }
        }
    }
    joined.labels()
}

impl Linkage {
    /// The part of each cell, counted from 0 in the order of first cells, and how the parts are linked.
    fn of(cells: &Cells, incidence: &Incidence, reference: &Vectors) -> (Vec<usize>, Self) {
        let labels = joined_cells(cells, incidence);
        let (mut part, mut corners) = (vec![0; labels.len()], Vec::new());
        for (cell, &label) in labels.iter().enumerate() {
            if label as usize == cell {
                part[cell] = corners.len();
                corners.push(cells.of(cell)[0] as usize);
            } else {
                part[cell] = part[label as usize];
            }
        }
        let hinges = (0..reference.len()).filter(|_| corners.len() > 1).filter_map(|i| {
            Hinge::of((i, reference.get(i)), incidence.of(i).iter().map(|&cell| part[cell as usize]))
        });
        let hinges = hinges.collect();
        (part, Self { corners, hinges })
    }

    fn parts(&self) -> usize {
        self.corners.len()
    }

    /// Label of each part such that parts pinned to each other, however loosely, share it.
    pub fn groups(&self) -> Vec<usize> {
        let mut pinned = DisjointSets::new(self.parts());
        for Hinge { parts, .. } in &self.hinges {
            parts.iter().for_each(|&part| pinned.join(parts[0] as u32, part as u32));
        }
        pinned.numbered().0
    }

    /// Refuses parts that can move against each other.
    pub fn require_rigid(&self, bounds: Bounds) -> Result<(), Mechanism> {
        if self.parts() <= 1 {
            return Ok(());
        }
        self.require_joined()?;
        self.require_no_turning(bounds, &[])
    }

    /// Refuses parts that can move though some of their particles are held: `holds` says how many of each group, shape
    /// \[parts\]; `held` are those, each for the part of every cell around it, in the order of particles, and asked for only
    /// where the counts do not decide.
    pub fn require_held(
        &self,
        bounds: Bounds,
        holds: &[Hold],
        held: impl FnOnce() -> Vec<HeldPlace>,
    ) -> Result<(), Mechanism> {
        let (places, groups) = (LazyCell::new(held), self.groups());
        let members = |group: usize| {
            places.iter().copied().filter(|place| groups[place.1] == group).collect::<Vec<_>>()
        };
        for (group, &Hold { first, held, whole }) in holds.iter().enumerate() {
            if first == usize::MAX {
                continue;
            }
            let particle = first + 1;
            match (held, whole) {
                (0, _) => return Err(Mechanism::Loose { particle }),
                (1, 1) => return Err(Mechanism::Turns { particle }),
                (_, 2..) => {}
                _ if free_motions(&members(group)) > 0 => return Err(Mechanism::Slides { particle }),
                _ => {}
            }
        }
        if self.hinges.is_empty() { Ok(()) } else { self.require_no_turning(bounds, &places) }
    }

    fn require_joined(&self) -> Result<(), Mechanism> {
        let groups = self.groups();
        match (0..self.parts()).find(|&part| groups[part] != groups[0]) {
            None => Ok(()),
            Some(other) => {
                let id = |part: usize| self.corners[part] + 1;
                Err(Mechanism::Apart { first: id(0), second: id(other) })
            }
        }
    }

    /// Looks for motions of the parts that keep every pin together and every held component of a place where it is, other
    /// than a motion of the whole, and names the pin that turns most.
    fn require_no_turning(&self, (low, high): Bounds, held: &[HeldPlace]) -> Result<(), Mechanism> {
        if self.parts() > MOST_PARTS {
            return Err(Mechanism::Hinge { particle: self.hinges[0].particle + 1 });
        }
        let size = (high[0] - low[0]).max(high[1] - low[1]);
        // The velocity of a part at a particle is (tx - turn y, ty + turn x).
        let velocity = |[x, y]: Point, part: usize, sign: f64| {
            let (x, y) = ((x - low[0]) / size - 0.5, (y - low[1]) / size - 0.5);
            [[(3 * part, sign), (3 * part + 2, -y * sign)], [(3 * part + 1, sign), (3 * part + 2, x * sign)]]
        };
        let mut gram = DMatrix::<f64>::zeros(3 * self.parts(), 3 * self.parts());
        let mut constrain = |row: &[(usize, f64)]| {
            for &(a, u) in row {
                row.iter().for_each(|&(b, v)| gram[(a, b)] += u * v);
            }
        };
        for &(place, part, held) in held {
            let rows = velocity(place, part, 1.0).into_iter().zip(held);
            rows.filter(|(_, held)| *held).for_each(|(row, _)| constrain(&row));
        }
        for Hinge { place, parts, .. } in &self.hinges {
            for &part in &parts[1..] {
                let (one, other) = (velocity(*place, parts[0], 1.0), velocity(*place, part, -1.0));
                (0..2).for_each(|axis| constrain(&[one[axis], other[axis]].concat()));
            }
        }
        self.name_turning(gram)
    }

    fn name_turning(&self, gram: DMatrix<f64>) -> Result<(), Mechanism> {
        let eigen = gram.symmetric_eigen();
        let largest = eigen.eigenvalues.amax();
        let mut worst = (1e-6, None);
        for (value, motion) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > 1e-10 * largest {
                continue;
            }
            for Hinge { particle, parts, .. } in &self.hinges {
                for part in parts {
                    let turning = (motion[3 * part + 2] - motion[3 * parts[0] + 2]).abs();
                    if turning > worst.0 {
                        worst = (turning, Some(*particle));
                    }
                }
            }
        }
        worst.1.map_or(Ok(()), |i| Err(Mechanism::Hinge { particle: i + 1 }))
    }
}

impl Hinge {
    /// The particle, if the cells around it are of several parts.
    pub fn of((particle, place): (usize, Point), parts: impl Iterator<Item = usize>) -> Option<Self> {
        let parts = distinct(parts);
        (parts.len() > 1).then_some(Self { particle, place, parts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::lattice::{Lattice, LatticeKind, Site};
    use crate::material::cells::templates;

    /// Unit squares with these lower left corners, and the sites of their particles.
    fn squares(of: &[Site]) -> (Cells, Vectors, Vec<Site>) {
        let corners = |&[i, j]: &Site| [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        let sites = distinct(of.iter().flat_map(corners));
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let mut cells = Cells::of_sites(&lattice, &templates(&lattice), &sites, |_| true);
        // Sites around a hole make a cell in the hole too: keep those asked for.
        let keep: Vec<usize> =
            (0..cells.count()).filter(|&c| of.contains(&sites[cells.of(c)[0] as usize])).collect();
        let all = std::mem::replace(&mut cells, Cells::of_kinds(Vec::new()));
        keep.iter().for_each(|&c| cells.push(all.of(c), all.kind[c]));
        cells.shapes = all.shapes;
        (cells, sites.iter().map(|&site| lattice.position(site)).collect(), sites)
    }

    fn rigid(of: &[Site]) -> Result<(), Mechanism> {
        let (cells, reference, _) = squares(of);
        require_rigid(&cells, &cells.incidence(reference.len()), &reference, |_| true)
    }

    fn held(of: &[Site], leaders: &[Site]) -> Result<(), Mechanism> {
        let (cells, reference, sites) = squares(of);
        let held: Vec<[bool; 2]> = sites.iter().map(|site| [leaders.contains(site); 2]).collect();
        require_held(&cells, &cells.incidence(reference.len()), &reference, &held)
    }

    #[test]
    fn cells_joined_along_sides_are_rigid() {
        assert_eq!(rigid(&[[0, 0], [1, 0], [1, 1]]), Ok(()));
    }

    #[test]
    fn a_hinge_is_named_by_the_particle_at_it() {
        // Sites column by column: (0,0) (0,1) (1,0) (1,1): the shared corner has id 4.
        assert_eq!(rigid(&[[0, 0], [1, 1]]), Err(Mechanism::Hinge { particle: 4 }));
    }

    #[test]
    fn a_corner_contact_in_a_body_that_is_closed_elsewhere_passes() {
        // A ring of cells whose hole touches the outside at one corner.
        let ring = [[0, 0], [1, 0], [2, 0], [0, 1], [2, 1], [0, 2], [1, 2]];
        assert_eq!(rigid(&ring), Ok(()));
        // Three parts pinned to each other in pairs: a triangle.
        let (base, right) = (vec![[0, 0], [1, 0], [2, 0]], vec![[3, 1], [3, 2]]);
        let left = vec![[-1, 1], [-1, 2], [-1, 3], [0, 3], [1, 3], [2, 3]];
        assert_eq!(rigid(&[base.clone(), right, left.clone()].concat()), Ok(()));
        assert!(matches!(rigid(&[base, left].concat()), Err(Mechanism::Hinge { .. })));
    }

    #[test]
    fn four_squares_pinned_in_a_ring_move_and_are_refused() {
        let ring = [[1, 0], [0, 1], [2, 1], [1, 2]];
        assert!(matches!(rigid(&ring), Err(Mechanism::Hinge { .. })));
    }

    #[test]
    fn parts_that_do_not_touch_and_particles_without_a_cell_are_named() {
        assert_eq!(rigid(&[[0, 0], [5, 0]]), Err(Mechanism::Apart { first: 1, second: 5 }));
        let (cells, mut reference, _) = squares(&[[0, 0]]);
        reference.push([9.0, 9.0]);
        let incidence = cells.incidence(5);
        assert_eq!(
            require_rigid(&cells, &incidence, &reference, |_| true),
            Err(Mechanism::NoCell { particle: 5 })
        );
        assert_eq!(require_rigid(&cells, &incidence, &reference, |i| i < 4), Ok(()));
    }

    #[test]
    fn leaders_must_hold_every_part_at_two_particles() {
        let two = [[0, 0], [5, 0]];
        assert_eq!(held(&two, &[[0, 0], [0, 1], [5, 0], [6, 1]]), Ok(()));
        assert_eq!(held(&two, &[[0, 0], [0, 1]]), Err(Mechanism::Loose { particle: 5 }));
        assert_eq!(held(&two, &[[0, 0], [0, 1], [5, 0]]), Err(Mechanism::Turns { particle: 5 }));
    }

    #[test]
    fn leaders_on_both_sides_stop_a_hinge() {
        let hinged = [[0, 0], [1, 1]];
        assert_eq!(held(&hinged, &[[0, 0], [0, 1]]), Err(Mechanism::Hinge { particle: 4 }));
        assert_eq!(held(&hinged, &[[0, 0], [0, 1], [2, 2]]), Ok(()));
        assert_eq!(
            held(&hinged, &[[0, 0], [2, 2]]),
            Err(Mechanism::Hinge { particle: 4 }),
            "three pins on a line"
        );
        assert_eq!(held(&hinged, &[[1, 0], [2, 2]]), Ok(()), "an arch");
    }

    #[test]
    fn rollers_stop_a_hinge_where_it_would_move_across_them() {
        let (cells, reference, sites) = squares(&[[0, 0], [1, 1]]);
        let held = |rollers: &[(Site, [bool; 2])]| {
            let mut held = vec![[false; 2]; sites.len()];
            for (site, axes) in rollers {
                held[sites.iter().position(|own| own == site).unwrap()] = *axes;
            }
            require_held(&cells, &cells.incidence(reference.len()), &reference, &held)
        };
        let base = [([0, 0], [true; 2]), ([0, 1], [true; 2])];
        let with = |site: Site, axes: [bool; 2]| held(&[base[0], base[1], (site, axes)]);
        // The upper square turns about (1, 1): its corner (2, 1) moves up and down, the corner (1, 2) to the sides.
        assert_eq!(with([2, 1], [false, true]), Ok(()));
        assert_eq!(with([1, 2], [true, false]), Ok(()));
        assert_eq!(with([2, 1], [true, false]), Err(Mechanism::Hinge { particle: 4 }));
        assert_eq!(with([1, 2], [false, true]), Err(Mechanism::Hinge { particle: 4 }));
    }
}
