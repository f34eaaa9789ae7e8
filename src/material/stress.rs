//! Strain, stress and strain energy of a body, cell by cell and around each particle.
//!
//! Under small rotations a cell's strain is its mean strain in the axes of the plane. Corotated, the cell is first
//! turned back by the rotation of its mean deformation gradient, as the rule does, so that a body turned by any angle is
//! not strained; strain and stress are then those in the axes of the reference configuration.

use std::ops::Range;

use nalgebra::DVector;
use rayon::prelude::*;

use super::cells::{Cells, Incidence};
use super::dilatation;
use super::elastic::{Elastic, von_mises};
use super::place::Around;
use super::stiffness::{ShapeError, mean_gradients, mean_strain};
use crate::flock::rules::Rotation;
use crate::flock::vectors::Vectors;
use crate::geometry::lists::distinct;
use crate::geometry::point::area;

/// The state of a cell, or of the cells around a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StressState {
    /// Mean strain (xx, yy, engineering xy) \[1\].
    pub strain: [f64; 3],
    /// xx, yy, xy \[force / length^2\].
    pub components: [f64; 3],
    /// zz, across the sheet: zero in plane stress \[force / length^2\].
    pub across: f64,
    /// \[force / length^2\]
    pub von_mises: f64,
}

impl StressState {
    /// Of a stress (xx, yy, xy) \[force / length^2\].
    pub fn of_stress(stress: [f64; 3], elastic: &Elastic) -> Self {
        Self::of(elastic.strain(stress), elastic)
    }

    fn of(strain: [f64; 3], elastic: &Elastic) -> Self {
        let (components, across) = (elastic.stress(strain), elastic.stress_across(strain));
        Self { strain, components, across, von_mises: von_mises(components, across) }
    }

    /// The principal strain largest in size \[1\].
    pub fn largest_strain(&self) -> f64 {
        let [xx, yy, xy] = self.strain;
        (0.5 * (xx + yy)).abs() + f64::hypot(0.5 * (xx - yy), 0.5 * xy)
    }
}

/// Stress in each cell, at its centre on a quadrilateral, under these displacements \[length\], shape \[cells\].
pub fn of_cells(
    cells: &Cells,
    elastic: &Elastic,
    displacement: &Vectors,
    rotation: Rotation,
) -> Vec<StressState> {
    let strains = strains(cells, displacement, rotation);
    let strains = dilatation::averaged(cells, elastic, strains, displacement.len());
    let of_cell = |(cell, strain)| StressState::of(strain, cells.material_of(cell, elastic));
    strains.into_par_iter().enumerate().map(of_cell).collect()
}

fn strains(cells: &Cells, displacement: &Vectors, rotation: Rotation) -> Vec<[f64; 3]> {
    let of_cell = |cell: usize| {
        let local = local(cells, cell, displacement, rotation);
        mean_strain(cells.shape(cell), |k| local[k])
    };
    (0..cells.count()).into_par_iter().map(of_cell).collect()
}

/// Means of the stress of the cells around particles, each weighted by its area. That smooths peaks, at free edges most of
/// all. Where materials meet, stress jumps, and each side has its own.
pub struct AroundParticles<'a> {
    cells: &'a Cells,
    elastic: &'a Elastic,
    of_cells: &'a [StressState],
    particles: usize,
    incidence: Incidence,
    areas: Vec<f64>,
}

impl<'a> AroundParticles<'a> {
    /// Around each of so many particles, of the stress of each cell, shape \[cells\]; cells whose strain is no number count for
    /// nothing. `elastic` is the material outside inclusions.
    pub fn new(
        cells: &'a Cells,
        elastic: &'a Elastic,
        of_cells: &'a [StressState],
        particles: usize,
    ) -> Self {
        let (incidence, areas) = (cells.incidence(particles), cells.shapes.iter().map(area).collect());
        Self { cells, elastic, of_cells, particles, incidence, areas }
    }

    /// The mean on the side where von Mises stress is larger; `None` for a particle in no cell that counts.
    pub fn larger(&self, particle: usize) -> Option<StressState> {
        if self.cells.inclusions.is_empty() {
            return self.within(particle, 0);
        }
        let regions = distinct(self.regions_around(particle).map(|region| region as usize));
        let sides = regions.into_iter().filter_map(|region| self.within(particle, region as u32));
        sides.reduce(|known, side| if side.von_mises > known.von_mises { side } else { known })
    }

    /// The mean over the particle's cells of one region.
    pub fn within(&self, particle: usize, region: u32) -> Option<StressState> {
        let (mut sum, mut whole) = ([0.0; 3], 0.0);
        let of_region = |&&cell: &&u32| self.cells.region_of(cell as usize) == region;
        for &cell in self.incidence.of(particle).iter().filter(of_region) {
            let strain = self.of_cells[cell as usize].strain;
            if strain.iter().all(|component| !component.is_nan()) {
                let weight = self.areas[self.cells.kind[cell as usize] as usize];
                sum.iter_mut().zip(strain).for_each(|(sum, strain)| *sum += weight * strain);
                whole += weight;
            }
        }
        let elastic = self.cells.material_of_region(region, self.elastic);
        (whole > 0.0).then(|| StressState::of(sum.map(|component| component / whole), elastic))
    }

    /// [`AroundParticles::larger`] of all particles, shape \[particles\].
    pub fn all_larger(&self) -> Vec<Option<StressState>> {
        (0..self.particles).into_par_iter().map(|particle| self.larger(particle)).collect()
    }

    /// The von Mises stress of the same, NaN where there is none.
    pub fn von_mises(&self) -> Vec<f64> {
        let of = |particle| self.larger(particle).map_or(f64::NAN, |stress| stress.von_mises);
        (0..self.particles).into_par_iter().map(of).collect()
    }

    /// At a place, from what its particles have; at those where materials meet on the side of the region that it is in, or, where
    /// that is not known, of its cell. A place that is itself where they meet, as is known or as the cells have it, has the side of the larger
    /// von Mises stress, as its particles have.
    pub fn at_place(
        &self,
        around: &Around,
        (region, is_known_to_be_between): (Option<u32>, bool),
        of_particles: &[Option<StressState>],
    ) -> Option<StressState> {
        let of_cell = self.cells.region_of(around.cell);
        let region = region.unwrap_or(of_cell);
        let mut standing = around.standing().map(|(particle, _)| particle);
        let first = standing.next()?;
        let rest: Vec<usize> = standing.collect();
        let on_all = |cell: u32| rest.iter().all(|&other| self.incidence.of(other).contains(&cell));
        let mut shared = self.incidence.of(first).iter().filter(|&&cell| on_all(cell));
        let is_between = shared.any(|&cell| self.cells.region_of(cell as usize) != of_cell);
        // Cells have chords for arcs: a place may be on the other side of one.
        let is_between = is_known_to_be_between || is_between && region == of_cell;
        let of = |particle: usize| {
            let is_within = is_between || self.regions_around(particle).all(|other| other == region);
            let found = if is_within { of_particles[particle] } else { self.within(particle, region) }?;
            let ([a, b, c], [xx, yy, xy]) = (found.strain, found.components);
            Some([a, b, c, xx, yy, xy, found.across])
        };
        let [a, b, c, xx, yy, xy, across] = around.mean(of)?;
        let components = [xx, yy, xy];
        Some(StressState { strain: [a, b, c], components, across, von_mises: von_mises(components, across) })
    }

    fn regions_around(&self, particle: usize) -> impl Iterator<Item = u32> {
        self.incidence.of(particle).iter().map(|&cell| self.cells.region_of(cell as usize))
    }
}

/// Strain energy of the cells \[force length\] under displacements \[length\] of their corners.
///
/// # Errors
/// A cell that has no stiffness; those of lattices all have one.
pub fn strain_energy(
    cells: &Cells,
    elastic: &Elastic,
    displacement: &Vectors,
    rotation: Rotation,
) -> Result<f64, ShapeError> {
    strain_energy_over(cells, elastic, (displacement, rotation), &Over::all(cells, displacement.len()))
}

/// Adds up what cells or particles have, each with its number.
type Sum<'a> = &'a dyn Fn(&mut dyn Iterator<Item = (usize, f64)>) -> f64;

/// The things that an energy is summed over: cells, or particles around which dilatations are averaged.
pub struct Over<'a> {
    /// Those of the cells.
    pub cells: Vec<Range<usize>>,
    /// Those of the particles.
    pub particles: Range<usize>,
    /// Adds up what cells have, each with its number, in their order.
    pub sum_of_cells: Sum<'a>,
    /// The same of particles.
    pub sum: Sum<'a>,
}

impl Over<'_> {
    /// All of a body of so many particles.
    pub fn all(cells: &Cells, particles: usize) -> Self {
        let sum: Sum<'static> = &|all| all.map(|(_, of)| of).sum();
        Self {
            cells: std::iter::once(0..cells.count()).collect(),
            particles: 0..particles,
            sum_of_cells: sum,
            sum,
        }
    }
}

/// As [`strain_energy`], summed over these cells.
///
/// # Errors
/// As [`strain_energy`].
pub fn strain_energy_over(
    cells: &Cells,
    elastic: &Elastic,
    (displacement, rotation): (&Vectors, Rotation),
    over: &Over<'_>,
) -> Result<f64, ShapeError> {
    let rest = Vectors::zeros(displacement.len());
    energy_over(cells, elastic, ([displacement, &rest], rotation), over)
}

/// Strain energy of the cells \[force length\] under the difference of two displacements \[length\] of their corners, each
/// taken in axes that turn with its own cells where the rotation is such.
///
/// # Errors
/// As [`strain_energy`].
pub fn energy_between(
    cells: &Cells,
    elastic: &Elastic,
    displacements: [&Vectors; 2],
    rotation: Rotation,
) -> Result<f64, ShapeError> {
    let over = Over::all(cells, displacements[0].len());
    energy_over(cells, elastic, (displacements, rotation), &over)
}

fn energy_over(
    cells: &Cells,
    elastic: &Elastic,
    (displacements, rotation): ([&Vectors; 2], Rotation),
    over: &Over<'_>,
) -> Result<f64, ShapeError> {
    let kinds = 0..cells.shapes.len();
    let elements: Result<Vec<_>, _> = kinds.map(|kind| cells.element(kind, elastic)).collect();
    let elements = elements?;
    let of_cell = |cell: usize| {
        let [a, b] = displacements.map(|u| local(cells, cell, u, rotation).into_iter().flatten());
        let u = DVector::from_vec(a.zip(b).map(|(a, b)| a - b).collect());
        0.5 * u.dot(&(&elements[cells.kind[cell] as usize] * &u))
    };
    let own =
        (over.sum_of_cells)(&mut over.cells.iter().cloned().flatten().map(|cell| (cell, of_cell(cell))));
    if !cells.average_dilatations(elastic) {
        return Ok(own);
    }
    let [mut apart, other] = displacements.map(|u| strains(cells, u, rotation));
    apart.iter_mut().zip(other).for_each(|(a, b)| *a = std::array::from_fn(|k| a[k] - b[k]));
    Ok(own + dilatation::energy(cells, elastic, &apart, (displacements[0].len(), over)))
}

/// How far each of some cells is turned \[rad\], shape \[cells\].
pub fn turns<'a>(
    cells: &'a Cells,
    of: impl IntoIterator<Item = usize> + 'a,
    displacement: &'a Vectors,
) -> impl Iterator<Item = f64> + 'a {
    of.into_iter().map(move |cell| turn(cells.shape(cell), &relative(cells, cell, displacement)))
}

/// Displacement of a cell's corners in the axes that turn with the cell, less that of the first \[length\].
fn local(cells: &Cells, cell: usize, displacement: &Vectors, rotation: Rotation) -> Vec<[f64; 2]> {
    let shape = cells.shape(cell);
    let mut local = relative(cells, cell, displacement);
    if rotation == Rotation::Corotated {
        let (sin, cos) = turn(shape, &local).sin_cos();
        for (moved, [x, y]) in local.iter_mut().zip(shape) {
            let [u, v] = [x + moved[0], y + moved[1]];
            *moved = [cos * u + sin * v - x, cos * v - sin * u - y];
        }
    }
    local
}

/// Displacement of a cell's corners less that of the first \[length\]: a translation must not cost digits.
fn relative(cells: &Cells, cell: usize, displacement: &Vectors) -> Vec<[f64; 2]> {
    let corners = cells.of(cell);
    let first = displacement.get(corners[0] as usize);
    let relative = |&i: &u32| {
        let u = displacement.get(i as usize);
        [u[0] - first[0], u[1] - first[1]]
    };
    corners.iter().map(relative).collect()
}

/// The rotation of the mean deformation gradient \[rad\].
fn turn(shape: &[[f64; 2]], displacement: &[[f64; 2]]) -> f64 {
    let (mut skew, mut trace) = (0.0, 2.0);
    for ([gx, gy], [u, v]) in mean_gradients(shape).into_iter().zip(displacement) {
        skew += gx * v - gy * u;
        trace += gx * u + gy * v;
    }
    skew.atan2(trace)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::{Body, Cut};
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::material::cells::neighbourhood;
    use crate::material::elastic::{Constants, Plane};

    fn sheet(kind: LatticeKind) -> (Body, Cells, Elastic) {
        let lattice = Lattice::new(kind, [3.0, 1.0], 0.3);
        let near = neighbourhood(&lattice);
        let (body, _) =
            Body::build(lattice, &Cut::Count { columns: 5, rows: 6 }, &near, None).expect("builds");
        let cells = Cells::of_body(&body);
        let constants = Constants::Isotropic { young: 1000.0, poisson: 0.3, plane: Plane::Stress };
        (body, cells, Elastic::new(constants, 0.5).expect("admissible"))
    }

    /// Uniaxial tension of 2 along x, then a turn by `angle`.
    fn pulled(body: &Body, angle: f64) -> Vectors {
        let (sin, cos) = angle.sin_cos();
        let place = |[x, y]: [f64; 2]| {
            let [a, b] = [x * (1.0 + 2e-3), y * (1.0 - 0.6e-3)];
            [cos * a - sin * b - x, sin * a + cos * b - y]
        };
        body.reference.iter().map(place).collect()
    }

    #[test]
    fn uniaxial_tension_has_its_stress_in_every_cell_and_particle_of_every_lattice() {
        for kind in LatticeKind::SAMPLES {
            let (body, cells, elastic) = sheet(kind);
            for (angle, rotation) in [(0.0, Rotation::Small), (2.0, Rotation::Corotated)] {
                let u = pulled(&body, angle);
                let found = of_cells(&cells, &elastic, &u, rotation);
                let around = AroundParticles::new(&cells, &elastic, &found, body.count()).all_larger();
                for stress in found.iter().chain(around.iter().flatten()) {
                    let [xx, yy, xy] = stress.components;
                    assert!(
                        (xx - 2.0).abs() < 1e-11 && yy.abs() < 1e-11 && xy.abs() < 1e-11,
                        "{kind:?} {stress:?}"
                    );
                    assert!((stress.von_mises - 2.0).abs() < 1e-11, "{kind:?} {stress:?}");
                }
                let covered: f64 = (0..cells.count()).map(|cell| area(cells.shape(cell))).sum();
                let expected = 0.5 * 2.0 * 2e-3 * 0.5 * covered;
                let energy = strain_energy(&cells, &elastic, &u, rotation).expect("cells");
                assert!((energy / expected - 1.0).abs() < 1e-11, "{kind:?}: {energy}, expected {expected}");
                assert!(turns(&cells, 0..cells.count(), &u).all(|turn| (turn - angle).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn a_particle_has_the_mean_of_its_cells_by_area() {
        let mut cells = Cells::of_kinds(vec![
            vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]],
        ]);
        cells.push(&[0, 1, 4, 3], 0);
        cells.push(&[1, 2, 5, 4], 1);
        let (_, _, elastic) = sheet(LatticeKind::SAMPLES[0]);
        let stretched: Vectors = [0.0, 1e-3, 1e-3, 0.0, 1e-3, 1e-3].into_iter().map(|u| [u, 0.0]).collect();
        let found = of_cells(&cells, &elastic, &stretched, Rotation::Small);
        let around = AroundParticles::new(&cells, &elastic, &found, 7).all_larger();
        let xx = |i: usize| around[i].expect("in a cell").strain[0];
        assert!((xx(0) - 1e-3).abs() < 1e-15 && (xx(1) - 0.25e-3).abs() < 1e-15 && xx(5).abs() < 1e-15);
        assert_eq!(around[6], None);
    }
}
