//! Bodies and materials, shared by the tests of the comparison.

use std::ops::ControlFlow;

use flockform::fem::Effort;
use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::vectors::Vectors;
use flockform::material::cells::{Cells, neighbourhood, without_loose_sites};
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::study::compare::run::{Compared, compare};

use crate::scenes::load;

pub const KINDS: [LatticeKind; 6] = [
    LatticeKind::Square { spacing: 1.0 },
    LatticeKind::Rectangular { a: 1.0, b: 1.5 },
    LatticeKind::CentredRectangular { a: 1.0, b: 1.4 },
    LatticeKind::Hexagonal { spacing: 1.0 },
    LatticeKind::Oblique { a: 1.0, b: 1.2, angle: 1.2 },
    LatticeKind::Honeycomb { spacing: 1.0 },
];

pub fn sheet(young: f64, poisson: f64, plane: Plane) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane }, 0.5).expect("admissible")
}

pub fn fibres() -> Elastic {
    let constants = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 };
    Elastic::new(constants, 0.7).expect("admissible")
}

/// A body without particles that are in no cell.
pub fn build(lattice: Lattice, columns: u32, rows: u32) -> (Body, Cells) {
    let near = neighbourhood(&lattice);
    let (body, neighbours) =
        Body::build(lattice, &Cut::Count { columns, rows }, &near, None).expect("builds");
    let (body, _, cells) = without_loose_sites(&body, &neighbours);
    (body, cells)
}

/// A turned and shifted body of every lattice.
pub fn sample(kind: LatticeKind) -> (Body, Cells) {
    build(Lattice::new(kind, [3.0, -2.0], 0.3), 7, 7)
}

pub fn largest_difference(a: &Vectors, b: &Vectors) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max)
}

/// What the rule of a bundled scene makes of its body, with changes.
pub fn compared(name: &str, overrides: &[&str]) -> Compared {
    let scene = load(name, overrides);
    compare(&scene, &Effort::default(), &mut |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|e| panic!("{e}"))
}
