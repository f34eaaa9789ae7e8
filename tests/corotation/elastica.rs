//! Large bending against the elastica, integrated here.

use flockform::flock::lattice::LatticeKind;
use flockform::solve::equilibrium::Solver;
use rayon::prelude::*;

use crate::support::*;

/// Deflection and shortening over the length of an inextensible cantilever under a dead load across it at its end,
/// `a = P L^2 / E I`: the angle obeys `t'' = -a cos t`, `t(0) = 0`, `t'(1) = 0`. Runge and Kutta's fourth-order
/// rule, and bisection on the curvature at the clamp.
fn elastica(a: f64) -> [f64; 2] {
    const STEPS: usize = 2000;
    let shoot = |curvature: f64| {
        let slope = |[t, k, _, _]: [f64; 4]| [k, -a * t.cos(), t.sin(), t.cos()];
        let h = 1.0 / STEPS as f64;
        let ahead = |s: [f64; 4], d: [f64; 4], by: f64| std::array::from_fn(|n| s[n] + by * d[n]);
        (0..STEPS).fold([0.0, curvature, 0.0, 0.0], |s, _| {
            let k1 = slope(s);
            let k2 = slope(ahead(s, k1, h / 2.0));
            let k3 = slope(ahead(s, k2, h / 2.0));
            let k4 = slope(ahead(s, k3, h));
            std::array::from_fn(|n| s[n] + h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]))
        })
    };
    let (mut low, mut high) = (0.0, a);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle)[1] > 0.0 { high = middle } else { low = middle }
    }
    let [_, _, w, x] = shoot(0.5 * (low + high));
    [w, 1.0 - x]
}

#[test]
fn the_elastica_is_that_of_the_tables() {
    // K. E. Bisshopp and D. C. Drucker, Quarterly of Applied Mathematics 3, 1945; digits of K. Mattiasson, 1981.
    for (a, w, u) in [(1.0, 0.30172, 0.05643), (5.0, 0.71379, 0.38763), (10.0, 0.81061, 0.55500)] {
        let found = elastica(a);
        assert!((found[0] - w).abs() < 6e-6 && (found[1] - u).abs() < 6e-6, "{a}: {found:?}");
    }
}

/// Errors of deflection and shortening \[1\] at H/16.
fn errors(kind: LatticeKind, a: f64) -> [f64; 2] {
    let (length, young) = (20.0, 12.0e6);
    // A beam of depth 1 and thickness 1 has I = 1/12.
    let load = a * young / 12.0 / (length * length);
    let beam = Beam::new(kind, length, &sheet(young, 0.0), [0.0, load]);
    let solved = beam.solved_by(Solver::Direct);
    assert!(solved.is_at_rest(), "{:?}", solved.residuals);
    let [u, w] = beam.of_the_end(&solved.displacement);
    let exact = elastica(a);
    [w / length / exact[0] - 1.0, -u / length / exact[1] - 1.0]
}

#[test]
fn a_cantilever_bends_like_the_elastica_on_every_lattice() {
    let cases: Vec<_> = (0..KINDS.len()).flat_map(|kind| [1.0, 10.0].map(|a| (kind, a))).collect();
    // Each takes one thread for seconds.
    let errors: Vec<_> = cases.par_iter().map(|&(kind, a)| errors(KINDS[kind](1.0 / 16.0), a)).collect();
    for ((kind, a), [w, u]) in cases.into_iter().zip(errors) {
        // Triangles are stiffer in bending than quadrilaterals and hexagons.
        let bounds = if kind == 3 { [0.005, 0.01] } else { [0.005, 0.005] };
        println!("{:?} a = {a}: w {:+.2} %, u {:+.2} %", KINDS[kind](1.0), 100.0 * w, 100.0 * u);
        assert!(w.abs() < bounds[0] && u.abs() < bounds[1], "{a}: {w} {u}");
    }
}

#[test]
fn a_beam_so_slender_that_rounding_leaves_more_than_a_thousandth_of_its_load_bends_like_a_shorter_one() {
    let solved = |length: f64| {
        let (young, a) = (12.0, 1e-4);
        let load = a * young / 12.0 / (length * length);
        let beam = Beam::new(KINDS[0](0.5), length, &sheet(young, 0.0), [0.0, load]);
        let solved = beam.solved_by(Solver::Direct);
        assert!(solved.is_at_rest(), "{:?}, known to {:?}", solved.residuals, solved.known_to);
        let [_, w] = beam.of_the_end(&solved.displacement);
        (w / length, solved.residuals.last().copied())
    };
    let ((short, _), (long, residual)) = (solved(400.0), solved(4000.0));
    assert!(residual > Some(1e-3), "{residual:?}");
    assert!((long / short - 1.0).abs() < 1e-4, "{long} {short}");
}
