//! The rate of convergence on Timoshenko's cantilever.
//!
//! Exact solution: S. P. Timoshenko and J. N. Goodier, *Theory of Elasticity*, art. 21, in the form of
//! C. E. Augarde and A. J. Deeks, Finite Elements in Analysis and Design 44, 2008.

use flockform::flock::body::Cut;
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::vectors::Vectors;
use flockform::geometry::shape::Shape;

use crate::support::*;
use crate::tractions;

/// Relative L2 error of a Timoshenko cantilever of length 8 and depth 2 with `rows` cells over its
/// depth, its root led by the exact solution, its end loaded by the parabolic shear of that solution.
fn cantilever_error(rows: u32, spacings: impl Fn(f64) -> LatticeKind) -> f64 {
    let (young, poisson, length, depth, load) = (1000.0, 0.3, 8.0, 2.0, 1.0);
    let inertia = depth * depth * depth / 12.0;
    let exact = |[x, y]: [f64; 2]| {
        let p = load / (6.0 * young * inertia);
        let u = -p * y * ((6.0 * length - 3.0 * x) * x + (2.0 + poisson) * (y * y - depth * depth / 4.0));
        let bending = 3.0 * poisson * y * y * (length - x) + (3.0 * length - x) * x * x;
        [u, p * (bending + (4.0 + 5.0 * poisson) * depth * depth * x / 4.0)]
    };
    let h = depth / f64::from(rows);
    let kind = spacings(h);
    let width = if let LatticeKind::Rectangular { a, .. } = kind { a } else { h };
    let cut = Cut::Shape(Shape::Rectangle { min: [0.0, -1.0], max: [length, 1.0] });
    let (body, neighbours, cells) = build(Lattice::new(kind, [0.0, -1.0], 0.0), &cut);
    assert_eq!(body.count(), (rows as usize + 1) * ((length / width).round() as usize + 1));
    let weights =
        MaterialWeights::assemble(&cells, &body, neighbours, &sheet(young, poisson)).expect("assembles");
    let x = |i: u32| body.reference.x[i as usize];
    let sides = cells.boundary_sides(&cells.incidence(body.count()));
    let shear = |i: u32| {
        let y = body.reference.y[i as usize];
        [0.0, load / (2.0 * inertia) * (depth * depth / 4.0 - y * y)]
    };
    let end = sides.into_iter().filter(|&[a, b]| x(a) > length - 1e-9 && x(b) > length - 1e-9);
    let forces = tractions::forces(&body.reference, end.map(|side| (side, side.map(shear))));
    let truth: Vectors = body.reference.iter().map(exact).collect();
    let leads: Vec<bool> = (0..body.count() as u32).map(|i| x(i) < 1e-9).collect();
    let found = equilibrium(&weights, &leads, &forces, &truth);
    relative_l2(&found, &truth, |_| true)
}

#[test]
fn a_cantilever_converges_with_the_square_of_the_spacing() {
    for spacings in
        [|h: f64| LatticeKind::Square { spacing: h }, |h: f64| LatticeKind::Rectangular { a: 2.0 * h, b: h }]
    {
        let errors = [4, 8, 16].map(|rows| cantilever_error(rows, spacings));
        for pair in errors.windows(2) {
            let rate = (pair[0] / pair[1]).log2();
            assert!((1.85..2.15).contains(&rate), "{errors:?}");
        }
    }
}
