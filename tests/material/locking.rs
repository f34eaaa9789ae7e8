//! Plane strain near nu = 1/2: displacements are as good as at nu = 0.3, on every lattice.

use flockform::flock::body::Cut;
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::rules::Rotation;
use flockform::flock::vectors::Vectors;
use flockform::geometry::outline::Outline;
use flockform::geometry::shape::Shape;
use flockform::material::cells::neighbourhood_of;
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::fit::fit;
use flockform::material::stress::strain_energy;
use flockform::material::weights::WeightsError;

use crate::support::*;
use crate::tractions;

const SPACINGS: [fn(f64) -> LatticeKind; 6] = [
    |h| LatticeKind::Square { spacing: h },
    |h| LatticeKind::Rectangular { a: h, b: 0.8 * h },
    |h| LatticeKind::CentredRectangular { a: h, b: h },
    |h| LatticeKind::Hexagonal { spacing: h },
    |h| LatticeKind::Oblique { a: h, b: h, angle: 70f64.to_radians() },
    |h| LatticeKind::Honeycomb { spacing: h / 3f64.sqrt() },
];

fn slice(poisson: f64) -> Elastic {
    let constants = Constants::Isotropic { young: 1000.0, poisson, plane: Plane::Strain };
    Elastic::new(constants, 1.0).expect("admissible")
}

/// Nearly area-preserving, in axes that are stretched and turned.
fn fibres(poisson_12: f64) -> Elastic {
    let constants = Constants::Orthotropic { young: [1000.0, 250.0], poisson_12, shear: 150.0, angle: 0.4 };
    Elastic::new(constants, 1.0).expect("admissible")
}

/// Resists shear far more than all else.
fn stiff_in_shear() -> Elastic {
    let constants =
        Constants::Orthotropic { young: [1000.0, 1000.0], poisson_12: 0.0, shear: 5e4, angle: 0.0 };
    Elastic::new(constants, 1.0).expect("admissible")
}

/// A displacement in equilibrium, and the stress (xx, yy, xy) that it has.
type Exact<'a> = &'a dyn Fn([f64; 2]) -> ([f64; 2], [f64; 3]);

/// Relative L2 error on a rectangle led by an exact solution along its left side and loaded by it along the others.
fn error(kind: LatticeKind, [min, max]: [[f64; 2]; 2], elastic: &Elastic, exact: Exact) -> f64 {
    let outline = Outline::of_shape(&Shape::Rectangle { min, max }).expect("a rectangle");
    let fitted = fit(&Lattice::new(kind, min, 0.0), &outline).expect("fits");
    let (body, cells) = (fitted.body, fitted.cells);
    let neighbours = cells.neighbours(body.count(), elastic);
    let weights = MaterialWeights::assemble(&cells, &body, neighbours, elastic).expect("assembles");
    let is_led = |i: usize| body.reference.x[i] < min[0] + 1e-9;
    let sides = cells.boundary_sides(&cells.incidence(body.count())).into_iter();
    let free = sides.filter(|side| !side.iter().all(|&i| is_led(i as usize)));
    let pulls = free.map(|side| {
        let [a, b] = side.map(|i| body.reference.get(i as usize));
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let n = [(b[1] - a[1]) / length, (a[0] - b[0]) / length];
        let traction = |p: [f64; 2]| {
            let (_, [xx, yy, xy]) = exact(p);
            [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1]]
        };
        (side, [traction(a), traction(b)])
    });
    let forces = tractions::forces(&body.reference, pulls);
    let truth: Vectors = body.reference.iter().map(|p| exact(p).0).collect();
    let leads: Vec<bool> = (0..body.count()).map(is_led).collect();
    let found = equilibrium(&weights, &leads, &forces, &truth);
    relative_l2(&found, &truth, |_| true)
}

/// A piece of a thick ring under pressure (Lame): `s_r = a - b / r^2`, `s_t = a + b / r^2`.
fn ring(poisson: f64, [x, y]: [f64; 2]) -> ([f64; 2], [f64; 3]) {
    let (a, b, square) = (1.0, 16.0, x * x + y * y);
    let scale = (1.0 + poisson) / 1000.0;
    let outwards = scale * ((1.0 - 2.0 * poisson) * a + b / square);
    let (c, s) = ((x * x - y * y) / square, 2.0 * x * y / square);
    ([outwards * x, outwards * y], [a - b / square * c, a + b / square * c, -b / square * s])
}

/// A slice bent by its end (Timoshenko), of length 8 and depth 2.
fn bent(poisson: f64, [x, y]: [f64; 2]) -> ([f64; 2], [f64; 3]) {
    let (young, nu) = (1000.0 / (1.0 - poisson * poisson), poisson / (1.0 - poisson));
    let (length, depth, load, inertia) = (8.0, 2.0, 1.0, 2.0 / 3.0);
    let p = load / (6.0 * young * inertia);
    let u = -p * y * ((6.0 * length - 3.0 * x) * x + (2.0 + nu) * (y * y - depth * depth / 4.0));
    let bending = 3.0 * nu * y * y * (length - x) + (3.0 * length - x) * x * x;
    let v = p * (bending + (4.0 + 5.0 * nu) * depth * depth * x / 4.0);
    let shear = load / (2.0 * inertia) * (depth * depth / 4.0 - y * y);
    ([u, v], [-load * (length - x) * y / inertia, 0.0, shear])
}

#[test]
fn no_lattice_locks_near_incompressibility() {
    for (name, bounds, exact) in [
        ("ring", [[2.0, -1.0], [6.0, 3.0]], ring as fn(f64, [f64; 2]) -> ([f64; 2], [f64; 3])),
        ("bent", [[0.0, -1.0], [8.0, 1.0]], bent),
    ] {
        for spacings in SPACINGS {
            let kind = spacings(0.25);
            let of = |poisson: f64| error(kind, bounds, &slice(poisson), &|p| exact(poisson, p));
            let errors = [0.3, 0.49, 0.499, 0.4999].map(of);
            println!("{name} {kind:?}: {:.2?} e-3", errors.map(|error| 1e3 * error));
            assert!(errors.iter().all(|error| error / errors[0] < 1.6), "{name} {kind:?}: {errors:?}");
        }
    }
}

/// A strip bent by its ends, of length 8 and depth 2: the stress xx alone, as large as y, in a material of any symmetry
/// (S. G. Lekhnitskii, *Anisotropic Plates*, 1968).
fn bent_sheet(elastic: &Elastic, [x, y]: [f64; 2]) -> ([f64; 2], [f64; 3]) {
    let [along, across, slanted] = elastic.strain([1.0, 0.0, 0.0]);
    let u = along * x * y + 0.5 * slanted * y * y;
    ([u, 0.5 * (across * y * y - along * x * x)], [y, 0.0, 0.0])
}

#[test]
fn no_lattice_locks_where_an_orthotropic_material_resists_one_strain_far_more_than_all_others() {
    for spacings in SPACINGS {
        let of = |elastic: Elastic, h: f64| {
            error(spacings(h), [[0.0, -1.0], [8.0, 1.0]], &elastic, &|p| bent_sheet(&elastic, p))
        };
        let mild = of(fibres(0.6), 0.25);
        let errors = [fibres(1.9), fibres(1.99), fibres(1.9999), stiff_in_shear()].map(|e| of(e, 0.25));
        let finer = of(fibres(1.9999), 0.125);
        println!("{:?}: {:.2?} e-3", spacings(0.25), [mild, errors[2], finer].map(|error| 1e3 * error));
        assert!(errors.iter().all(|&error| error < 0.03), "{:?}: {mild} {errors:?}", spacings(0.25));
        assert!(finer < 0.5 * errors[2], "{:?}: {errors:?} {finer}", spacings(0.25));
    }
}

#[test]
fn an_isotropic_material_written_as_orthotropic_is_the_same() {
    for spacings in SPACINGS {
        for poisson in [-0.9, 0.3, 0.7, 0.98, 0.9998] {
            let shear = 500.0 / (1.0 + poisson);
            let sheets = [
                Constants::Isotropic { young: 1000.0, poisson, plane: Plane::Stress },
                Constants::Orthotropic { young: [1000.0; 2], poisson_12: poisson, shear, angle: 0.7 },
            ];
            let [a, b] = sheets.map(|constants| {
                let elastic = Elastic::new(constants, 1.0).expect("admissible");
                let outline = Outline::of_shape(&Shape::Rectangle { min: [0.0; 2], max: [3.0, 2.0] });
                let fitted = fit(&Lattice::new(spacings(0.4), [0.0; 2], 0.0), &outline.expect("fits"));
                let (body, cells) = fitted.map(|fitted| (fitted.body, fitted.cells)).expect("fits");
                let near = cells.neighbours(body.count(), &elastic);
                MaterialWeights::assemble(&cells, &body, near, &elastic).expect("assembles")
            });
            assert_eq!(a.neighbours, b.neighbours, "{:?} {poisson}", spacings(0.4));
            for i in 0..a.neighbours.count() {
                let scale = a.diagonal(i)[0][0];
                let blocks = a.bonds(i).zip(b.bonds(i));
                let apart =
                    blocks.flat_map(|((_, a), (_, b))| (0..4).map(|k| a[k / 2][k % 2] - b[k / 2][k % 2]));
                let apart = apart.fold(0.0, |most: f64, one| most.max(one.abs()));
                assert!(apart < 1e-10 * scale, "{:?} {poisson}: {apart} of {scale}", spacings(0.4));
            }
        }
    }
}

#[test]
fn averaged_strains_pass_the_patch_test_and_pull_back_alike() {
    let materials = [slice(0.4999), fibres(1.999), stiff_in_shear()];
    for (spacings, elastic) in SPACINGS.into_iter().flat_map(|kind| materials.map(|elastic| (kind, elastic)))
    {
        let shape = Shape::Disc { centre: [0.3, 0.1], radius: 2.0 };
        let outline = Outline::of_shape(&shape).expect("a disc");
        let fitted = fit(&Lattice::new(spacings(0.4), [0.0; 2], 0.3), &outline).expect("fits");
        let (body, cells) = (fitted.body, fitted.cells);
        let near = cells.neighbours(body.count(), &elastic);
        let weights = MaterialWeights::assemble(&cells, &body, near, &elastic).expect("assembles");
        let affine: Vectors =
            body.reference.iter().map(|[x, y]| [0.3 * x + 0.4 * y, 0.1 * x - 0.2 * y]).collect();
        let wavy: Vectors = body.reference.iter().map(|[x, y]| [(2.0 * x).sin() * y, x * y]).collect();
        let stored = strain_energy(&cells, &elastic, &wavy, Rotation::Small).expect("has a stiffness");
        assert!((stored / weights.energy(&wavy) - 1.0).abs() < 1e-9, "{stored}");
        let on_edge = on_boundary(&cells, body.count());
        for (i, on_edge) in on_edge.into_iter().enumerate() {
            let scale = weights.diagonal(i)[0][0];
            let [x, y] = weights.force(i, &affine);
            assert!(on_edge || x.hypot(y) < 1e-11 * scale, "{x} {y}");
            for (j, block) in weights.bonds(i) {
                let back = weights.bonds(j).find(|(k, _)| *k == i).expect("is felt back").1;
                let apart =
                    (0..4).map(|k| (block[k / 2][k % 2] - back[k % 2][k / 2]).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-12 * scale, "{i} {j}");
            }
        }
    }
}

#[test]
fn rows_of_averaged_dilatations_are_kept_by_class_on_a_lattice() {
    let elastic = slice(0.49);
    for kind in KINDS {
        let classes = |size: u32| {
            let lattice = Lattice::new(kind, [0.0; 2], 0.0);
            let near = neighbourhood_of(&lattice, &elastic);
            let cut = Cut::Count { columns: size, rows: size };
            let (body, neighbours, cells) = of_whole_cells(&lattice, &cut, &near);
            MaterialWeights::assemble(&cells, &body, neighbours, &elastic)
                .expect("assembles")
                .weights
                .compliance
                .len()
        };
        let (small, large) = (classes(20), classes(30));
        assert!(small == large && small < 200, "{kind:?}: {small} {large}");
    }
}

#[test]
fn neighbours_one_cell_away_cannot_carry_an_averaged_dilatation() {
    let (body, neighbours, cells) = sample(KINDS[0], 0.0);
    let refused = MaterialWeights::assemble(&cells, &body, neighbours, &slice(0.49));
    let Err(error @ WeightsError::MissingMate { .. }) = refused else { panic!("{refused:?}") };
    assert!(error.to_string().contains("8 neighbours cannot carry a dilatation"), "{error}");
}
