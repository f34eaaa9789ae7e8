//! Bodies and materials, shared by the tests of the comparison.

use std::ops::ControlFlow;

use flockform::fem::Effort;
use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::vectors::Vectors;
use flockform::material::cells::{Cells, neighbourhood};
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::scene::{Scene, SceneError};
use flockform::study::compare::run::{Compared, compare};

pub use crate::samples::{KINDS, fibres, of_whole_cells};
use crate::scenes::load;

pub fn sheet(young: f64, poisson: f64, plane: Plane) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane }, 0.5).expect("admissible")
}

/// A body without particles that are in no cell.
pub fn build(lattice: Lattice, columns: u32, rows: u32) -> (Body, Cells) {
    let (body, _, cells) = of_whole_cells(&lattice, &Cut::Count { columns, rows }, &neighbourhood(&lattice));
    (body, cells)
}

/// A turned and shifted body of every lattice.
pub fn sample(kind: LatticeKind) -> (Body, Cells) {
    build(Lattice::new(kind, [3.0, -2.0], 0.3), 7, 7)
}

pub fn largest_difference(a: &Vectors, b: &Vectors) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max)
}

/// What the rule of a scene makes of its body.
pub fn compare_scene(scene: &Scene) -> Result<Compared, SceneError> {
    compare(scene, &Effort::default(), &mut |_, _| ControlFlow::Continue(()))
}

/// The same of a bundled scene with changes.
pub fn compared(name: &str, overrides: &[&str]) -> Compared {
    compare_scene(&load(name, overrides)).unwrap_or_else(|e| panic!("{e}"))
}
