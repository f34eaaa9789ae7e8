//! Loads to the forces on particles, consistently: the forces do the same work as the load in every
//! displacement that the cells can have.

use super::cells::Cells;
use crate::flock::vectors::Vectors;

/// A traction on one side of the boundary, linear from end to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traction {
    /// Particles at the ends of the side, either way round.
    pub side: [u32; 2],
    /// At either end \[force / length\]: stress times the thickness of the sheet.
    pub at_ends: [[f64; 2]; 2],
}

/// Everything that pushes on a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loads {
    /// Loads on sides of the boundary; several on one side add up.
    pub tractions: Vec<Traction>,
    /// Forces on particles \[force\]; several on one particle add up.
    pub forces: Vec<(u32, [f64; 2])>,
    /// On every cell alike \[force / length^2\]: weight per volume times the thickness of the sheet.
    pub body: [f64; 2],
}

/// Why a load cannot be put on a body. Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LoadError {
    /// A force acts on a particle that the body does not have, or that belongs to no cell.
    #[error("a force acts on particle {particle}, but {reason}")]
    NoParticle {
        /// Id of the particle.
        particle: usize,
        /// The obstacle to the force.
        reason: &'static str,
    },
    /// A traction acts on what bounds no cell, or two.
    #[error(
        "a traction needs a side of the body's boundary, but particles {} and {} bound {}",
        .ends[0], .ends[1], if *.inside { "a side between two cells" } else { "no side of any cell" }
    )]
    NotBoundary {
        /// Ids of the particles at its ends.
        ends: [usize; 2],
        /// Whether two cells meet there.
        inside: bool,
    },
    /// A force is not finite, or they add up beyond the range of a double.
    #[error("a load must be finite")]
    NotFinite,
}

impl Traction {
    /// The same traction all along the side \[force / length\].
    pub fn uniform(side: [u32; 2], traction: [f64; 2]) -> Self {
        Self { side, at_ends: [traction; 2] }
    }
}

impl Loads {
    /// The force on each particle \[force\], shape \[count\].
    pub fn on_particles(&self, cells: &Cells, reference: &Vectors) -> Result<Vectors, LoadError> {
        let incidence = cells.incidence(reference.len());
        let mut forces = Vectors::zeros(reference.len());
        let mut add = |particle: u32, force: [f64; 2]| {
            forces.x[particle as usize] += force[0];
            forces.y[particle as usize] += force[1];
        };
        if self.body != [0.0; 2] {
            let shares: Vec<Vec<f64>> = (0..cells.shapes.len()).map(|kind| cells.load_shares(kind)).collect();
            for (cell, &kind) in cells.iter().zip(&cells.kind) {
                for (&particle, share) in cell.iter().zip(&shares[kind as usize]) {
                    add(particle, self.body.map(|b| b * share));
                }
            }
        }
        for &Traction { side: [a, b], at_ends: [at_a, at_b] } in &self.tractions {
            let ends = [a as usize + 1, b as usize + 1];
            let known = ends.iter().all(|&id| id <= reference.len());
            let owners = if known { owners(cells, &incidence, [a, b]) } else { 0 };
            if owners != 1 {
                return Err(LoadError::NotBoundary { ends, inside: owners > 1 });
            }
            let length =
                crate::flock::vectors::distance(reference.get(a as usize), reference.get(b as usize));
            add(a, [0, 1].map(|k| length * (2.0 * at_a[k] + at_b[k]) / 6.0));
            add(b, [0, 1].map(|k| length * (at_a[k] + 2.0 * at_b[k]) / 6.0));
        }
        for &(particle, force) in &self.forces {
            let id = particle as usize + 1;
            if id > reference.len() {
                return Err(LoadError::NoParticle { particle: id, reason: "the body has no such particle" });
            }
            if incidence.of(particle as usize).is_empty() {
                return Err(LoadError::NoParticle { particle: id, reason: "it belongs to no cell" });
            }
            add(particle, force);
        }
        let finite = forces.iter().flatten().all(f64::is_finite);
        if finite { Ok(forces) } else { Err(LoadError::NotFinite) }
    }
}

/// How many cells have this side, either way round.
fn owners(cells: &Cells, incidence: &super::cells::Incidence, [a, b]: [u32; 2]) -> usize {
    let ways = [[a, b], [b, a]];
    ways.into_iter().filter(|&way| cells.across(incidence, way).is_some()).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::{Body, Cut};
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::material::cells::neighbourhood;

    fn body(kind: LatticeKind) -> (Body, Cells) {
        let lattice = Lattice::new(kind, [2.0, 1.0], 0.0);
        let near = neighbourhood(&lattice);
        let (body, _) =
            Body::build(lattice, &Cut::Count { columns: 5, rows: 6 }, &near, None).expect("builds");
        let cells = Cells::of_body(&body);
        (body, cells)
    }

    fn total(forces: &Vectors) -> [f64; 2] {
        [forces.x.iter().sum(), forces.y.iter().sum()]
    }

    #[test]
    fn a_body_force_adds_up_to_force_per_area_times_area() {
        for kind in [
            LatticeKind::Rectangular { a: 2.0, b: 0.5 },
            LatticeKind::Hexagonal { spacing: 1.0 },
            LatticeKind::Honeycomb { spacing: 1.0 },
        ] {
            let (body, cells) = body(kind);
            let area: f64 = (0..cells.count()).map(|c| super::super::stiffness::area(cells.shape(c))).sum();
            let loads = Loads { body: [0.0, -3.0], ..Loads::default() };
            let forces = loads.on_particles(&cells, &body.reference).expect("fits");
            assert!((total(&forces)[1] + 3.0 * area).abs() < 1e-12 * area && total(&forces)[0] == 0.0);
        }
    }

    #[test]
    fn a_uniform_pressure_all_around_has_no_resultant_and_no_moment() {
        let (body, cells) = body(LatticeKind::Honeycomb { spacing: 1.0 });
        let sides = cells.boundary_sides(&cells.incidence(body.count()));
        let pressed = |&[a, b]: &[u32; 2]| {
            let (p, q) = (body.reference.get(a as usize), body.reference.get(b as usize));
            // Inward: the body is to the left of the side, which is one unit long.
            Traction::uniform([a, b], [p[1] - q[1], q[0] - p[0]])
        };
        let loads = Loads { tractions: sides.iter().map(pressed).collect(), ..Loads::default() };
        let forces = loads.on_particles(&cells, &body.reference).expect("fits");
        assert!(forces.iter().any(|[x, _]| x.abs() > 0.1));
        let moment: f64 =
            forces.iter().zip(body.reference.iter()).map(|(f, p)| p[0] * f[1] - p[1] * f[0]).sum();
        assert!(total(&forces).iter().all(|t| t.abs() < 1e-12) && moment.abs() < 1e-11);
    }

    #[test]
    fn a_traction_that_grows_along_its_side_gives_two_thirds_to_the_far_end() {
        let (body, cells) = body(LatticeKind::Square { spacing: 2.0 });
        let traction = Traction { side: [1, 0], at_ends: [[9.0, 0.0], [0.0, 0.0]] };
        let loads = Loads { tractions: vec![traction], ..Loads::default() };
        let forces = loads.on_particles(&cells, &body.reference).expect("fits");
        assert_eq!((forces.x[1], forces.x[0]), (6.0, 3.0));
    }

    #[test]
    fn loads_on_what_is_not_there_are_refused() {
        let (body, cells) = body(LatticeKind::Square { spacing: 1.0 });
        let refused = |loads: Loads| loads.on_particles(&cells, &body.reference).expect_err("refused");
        let push = |side: [u32; 2]| Loads {
            tractions: vec![Traction::uniform(side, [1.0, 0.0])],
            ..Loads::default()
        };
        assert_eq!(refused(push([7, 8])), LoadError::NotBoundary { ends: [8, 9], inside: true });
        assert_eq!(refused(push([0, 7])), LoadError::NotBoundary { ends: [1, 8], inside: false });
        assert_eq!(refused(push([0, 99])), LoadError::NotBoundary { ends: [1, 100], inside: false });
        let point =
            |particle: u32, force: f64| Loads { forces: vec![(particle, [force, 0.0])], ..Loads::default() };
        assert!(matches!(refused(point(30, 1.0)), LoadError::NoParticle { particle: 31, .. }));
        assert_eq!(refused(point(0, f64::NAN)), LoadError::NotFinite);
    }
}
