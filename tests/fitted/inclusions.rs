//! Parts of another material, whose edges are fitted as the outline is.

use flockform::continuum::plan::Plan;
use flockform::flock::lattice::Lattice;
use flockform::flock::vectors::Vectors;
use flockform::geometry::outline::Outline;
use flockform::geometry::partition::Partition;
use flockform::geometry::point::area;
use flockform::geometry::shape::Shape;
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::fit::{FitError, Fitted, LEAST_AREA, LEAST_SIDE, LEAST_WIDTH, fit_regions};
use nalgebra::{Matrix2, Vector2};

use crate::outlines::{KINDS, Noise, felt};
use crate::scenes::load;
use crate::support::{KINDS as SCENE_KINDS, error, lattice, on_right_edge, scene, solved};

fn isotropic(young: f64, poisson: f64, plane: Plane) -> Elastic {
    Elastic::new(Constants::Isotropic { young, poisson, plane }, 1.0).expect("admissible")
}

/// Area of each region \[length^2\].
fn areas(fitted: &Fitted, regions: usize) -> Vec<f64> {
    let mut areas = vec![0.0; regions];
    for &kind in &fitted.cells.kind {
        areas[fitted.cells.region[kind as usize] as usize] += area(&fitted.cells.shapes[kind as usize]);
    }
    areas
}

/// A polygon around a place, with sides longer than 3.
fn polygon(centre: [f64; 2], radius: f64, corners: usize, angle: f64) -> Vec<[f64; 2]> {
    let corner = |k: usize| {
        let angle = angle + std::f64::consts::TAU * k as f64 / corners as f64;
        [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
    };
    (0..corners).map(corner).collect()
}

#[test]
fn more_than_a_hundred_bodies_with_inclusions_keep_their_areas_and_the_quality_of_cells() {
    let (mut noise, mut fits) = (Noise(31), 0);
    for round in 0..200 {
        let kind = KINDS[round % 6];
        let body = polygon([0.0; 2], 9.0, 3 + round % 4, noise.next());
        // One inside and one across the edge of the body.
        let middle = [noise.next() - 0.5, noise.next() - 0.5];
        let inside = polygon(middle, 2.5 + 0.5 * noise.next(), 3 + round % 3, noise.next());
        let across = polygon([8.6, 0.5], 4.8 + 0.2 * noise.next(), 4, 0.3 * noise.next());
        let outline = Outline::of_polygons(std::slice::from_ref(&body)).expect("an outline");
        let regions = [inside, across].map(|vertices| Shape::Polygon { vertices });
        let partition = Partition::new(&outline, &regions).expect("regions");
        let lattice = Lattice::new(kind, [noise.next(), noise.next()], 3.0 * noise.next());
        let label = format!("round {round}, {kind:?}");
        let fitted = match fit_regions(&lattice, &partition) {
            Ok(fitted) => fitted,
            Err(FitError::Narrow { .. }) => continue,
            Err(error) => panic!("{label}: {error}"),
        };
        fits += 1;
        let total: f64 = areas(&fitted, 3).iter().sum();
        assert!((total / outline.area() - 1.0).abs() < 1e-12, "{label}: area");
        let first = Outline::of_shape(&regions[0]).expect("an outline").area();
        let found = areas(&fitted, 3);
        assert!((found[1] / first - 1.0).abs() < 1e-12, "{label}: the inclusion inside: {found:?}, {first}");
        let quality = fitted.quality();
        // Two corners that near to each other are kept: a line that ends beside a corner.
        let has_detail = partition.pieces().any(|(.., piece)| piece.length() < LEAST_SIDE);
        assert!(quality.area >= LEAST_AREA - 1e-9, "{label}: {quality:?}");
        assert!(
            (has_detail || quality.side >= LEAST_SIDE - 1e-9) && quality.width > LEAST_WIDTH - 1e-9,
            "{label}: {quality:?}"
        );
    }
    assert!(fits > 100, "{fits} of 200");
}

/// The gradient of displacement on the far side of an interface of this normal, such that displacement and traction go on.
fn beyond(near: Matrix2<f64>, [here, there]: [&Elastic; 2], normal: Vector2<f64>) -> Matrix2<f64> {
    let traction = |elastic: &Elastic, gradient: Matrix2<f64>| {
        let strain = [gradient[(0, 0)], gradient[(1, 1)], gradient[(0, 1)] + gradient[(1, 0)]];
        let [xx, yy, xy] = elastic.stress(strain);
        Matrix2::new(xx, xy, xy, yy) * normal
    };
    let jump = traction(here, near) - traction(there, near);
    let column = |k: usize| traction(there, Vector2::ith(k, 1.0) * normal.transpose());
    let a = Matrix2::from_columns(&[column(0), column(1)]).lu().solve(&jump).expect("a stiff material");
    near + a * normal.transpose()
}

#[test]
fn two_materials_that_meet_along_any_line_carry_uniform_stresses_on_every_lattice() {
    let mut noise = Noise(5);
    let mut fits = 0;
    let near = Matrix2::new(2e-3, -1e-3, 0.5e-3, 3e-3);
    let pairs = [
        [isotropic(1000.0, 0.3, Plane::Stress), isotropic(20.0, -0.2, Plane::Stress)],
        [isotropic(1000.0, 0.3, Plane::Strain), isotropic(300.0, 0.49, Plane::Strain)],
        [isotropic(1000.0, 0.45, Plane::Strain), isotropic(9000.0, 0.4995, Plane::Strain)],
    ];
    for round in 0..54 {
        let (kind, pair) = (KINDS[round % 6], &pairs[round / 6 % 3]);
        let angle = std::f64::consts::TAU * noise.next();
        let normal = Vector2::new(angle.cos(), angle.sin());
        let far = beyond(near, [&pair[0], &pair[1]], normal);
        let off = 2.0 * noise.next() - 1.0;
        let along = [-normal.y, normal.x];
        let corner = |s: f64, t: f64| [0, 1].map(|k| (off + s) * normal[k] + t * along[k]);
        let half = [corner(0.0, -40.0), corner(40.0, -40.0), corner(40.0, 40.0), corner(0.0, 40.0)];
        let outline = Outline::of_polygons(&[polygon([0.0; 2], 8.0, 5, noise.next())]).expect("an outline");
        let partition =
            Partition::new(&outline, &[Shape::Polygon { vertices: half.to_vec() }]).expect("regions");
        let lattice = Lattice::new(kind, [noise.next(), noise.next()], 3.0 * noise.next());
        let label = format!("round {round}, {kind:?}, {angle}");
        let fitted = match fit_regions(&lattice, &partition) {
            Ok(fitted) => fitted,
            // The line may graze a side of the body, or pass a corner.
            Err(FitError::Narrow { .. }) => continue,
            Err(error) => panic!("{label}: {error}"),
        };
        fits += 1;
        let Fitted { body, mut cells } = fitted;
        cells.inclusions = vec![pair[1]];
        let felt = felt(&body, &cells, cells.neighbours(body.count(), &pair[0]), &pair[0]);
        let place = |p: [f64; 2]| {
            let p = Vector2::from(p);
            let beyond = (p.dot(&normal) - off).max(0.0);
            (near * p + (far - near) * normal * beyond).into()
        };
        let moved: Vectors = body.reference.iter().map(place).collect();
        let incidence = cells.incidence(body.count());
        let mut on_edge = vec![false; body.count()];
        cells.boundary_sides(&incidence).iter().flatten().for_each(|&i| on_edge[i as usize] = true);
        let inside = (0..body.count()).filter(|&i| !on_edge[i]);
        let left = inside.map(|i| felt.force_under(i, &moved)).map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
        assert!(left < 1e-9, "{label}: {left:e} is left inside");
    }
    assert!(fits > 40, "{fits} of 54");
}

/// A quarter of a disc of radius 10 whose core of radius 5 is ten times as stiff, under a pressure of 10.
const CORE: &str = r#"
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
roles = [
    { region = { kind = "outline", pieces = [1] }, role = "clamped", axis = "y" },
    { region = { kind = "outline", pieces = [3] }, role = "clamped", axis = "x" },
]
loads = [{ kind = "pressure", region = { kind = "outline", pieces = [2] }, pressure = 10.0 }]
[body]
inclusions = [{ shape = { kind = "disc", radius = 5.0 }, material = { kind = "isotropic", young = 10000.0, poisson = 0.2 } }]
[body.shape]
kind = "path"
from = [0.0, 0.0]
steps = [{ to = [10.0, 0.0] }, { to = [0.0, 10.0], centre = [0.0, 0.0] }]
"#;

/// Displacement of that disc, from G. Lame's rings: what the core and the ring around it do to each other is the pressure
/// at which both have the same radius. Returns it with the pressure.
fn core() -> (impl Fn([f64; 2]) -> [f64; 2], f64) {
    let (a, b, p) = (5.0f64, 10.0f64, 10.0);
    let ([e, nu], [e_core, nu_core]) = ([1000.0, 0.3], [10_000.0, 0.2]);
    // Of a ring from a to b under q inside and p outside, at r.
    let ring = move |r: f64, q: f64| {
        let area = b * b - a * a;
        ((1.0 - nu) * (q * a * a - p * b * b) / area * r + (1.0 + nu) * a * a * b * b * (q - p) / area / r)
            / e
    };
    let of_core = move |r: f64, q: f64| -q * r * (1.0 - nu_core) / e_core;
    // Both are linear in q.
    let gap = |q: f64| ring(a, q) - of_core(a, q);
    let q = -gap(0.0) / (gap(1.0) - gap(0.0));
    let exact = move |[x, y]: [f64; 2]| {
        let r = x.hypot(y);
        let u = if r < a { of_core(r, q) } else { ring(r, q) };
        if r == 0.0 { [0.0; 2] } else { [u * x / r, u * y / r] }
    };
    (exact, q)
}

#[test]
fn a_disc_with_a_stiff_core_converges_with_order_two_on_every_lattice() {
    let (exact, _) = core();
    for kind in SCENE_KINDS {
        let errors = [0.5, 0.25].map(|h| {
            let squares = [0.0, 17.0, 45.0, 71.0].map(|orientation| {
                let scene =
                    scene(&lattice(kind, h, orientation), CORE).unwrap_or_else(|error| panic!("{error}"));
                let (plan, outcome) = solved(&scene);
                error(&plan, &outcome, &exact).powi(2)
            });
            (squares.iter().sum::<f64>() / 4.0).sqrt()
        });
        let order = (errors[0] / errors[1]).log2();
        println!("{kind}: order {order:.2}, errors {errors:?}");
        assert!(order > 1.85 && errors[1] < 2e-3, "{kind}: order {order}, errors {errors:?}");
    }
}

#[cfg(feature = "fem")]
#[test]
fn the_truth_of_a_disc_with_a_stiff_core_is_lames() {
    use flockform::study::compare::reference::Effort;
    use flockform::study::compare::run::reference_of;
    let (exact, q) = core();
    let scene = scene(&lattice("hexagonal", 1.0, 20.0), CORE).expect("a scene");
    let found = reference_of(&scene, &Effort::default()).expect("a truth");
    let reference = &found.layout.body.reference;
    let (mut off, mut size) = (0.0, 0.0);
    for (p, u) in reference.iter().zip(found.solution.displacement.iter()) {
        let v = exact(p);
        off += (u[0] - v[0]).powi(2) + (u[1] - v[1]).powi(2);
        size += v[0] * v[0] + v[1] * v[1];
    }
    let (off, stated) = ((off / size).sqrt(), found.solution.error().displacement);
    println!("off by {off:e}, stated {stated:e}");
    assert!(off < 1e-4 && off < 3.0 * stated, "off by {off:e}, stated {stated:e}");
    // Uniform in the core, two unequal stresses at its edge.
    let stress = found.solution.stress_at(&[[1.0, 2.0], [3.0, 0.5]].into_iter().collect()).expect("inside");
    assert!(stress.iter().all(|s| (s.von_mises() / q - 1.0).abs() < 1e-3), "{stress:?} {q}");
}

#[test]
fn inclusions_that_no_body_has_are_refused_by_name() {
    let refused = |from: &str, to: &str| {
        let parts = CORE.replace(from, to);
        assert_ne!(parts, CORE);
        let scene = scene(&lattice("square", 1.0, 10.0), &parts);
        scene.and_then(|scene| Plan::new(&scene)).expect_err("refused").to_string()
    };
    let disc = "shape = { kind = \"disc\", radius = 5.0 }";
    let cases = [
        (disc, "shape = { kind = \"disc\", centre = [-9.0, 0.0], radius = 5.0 }", "no part of the body"),
        (disc, "shape = { kind = \"disc\", radius = 9.5 }", "less than the spacing"),
        (disc, "shape = { kind = \"grid\", columns = 3, rows = 3 }", "shape of its own"),
        ("poisson = 0.2", "poisson = 1.2", "Poisson's ratio"),
        ("poisson = 0.2", "poisson = 0.2, plane = \"strain\"", "plane strain"),
        ("poisson = 0.2", "poisson = 0.2, thickness = 2.0", "1 thick"),
    ];
    for (from, to, expected) in cases {
        let message = refused(from, to);
        assert!(message.contains(expected), "{to}: {message}");
        assert!(message.contains("inclusions[0]") || message.contains("body.shape"), "{to}: {message}");
    }
}

#[test]
fn inclusions_hold_whatever_carries_the_material() {
    let corner = |sets: &[&str]| {
        let (plan, outcome) = solved(&load("inclusion", sets));
        on_right_edge(&plan, &outcome, 20.0, 20.0)[0]
    };
    let square = "lattice={ kind = \"square\", spacing = 1.0 }";
    let [fitted, staircase] = [&[square][..], &[square, "body.outline=\"lattice\""]].map(corner);
    assert!((staircase / fitted - 1.0).abs() < 2e-3 && staircase != fitted, "{fitted} {staircase}");
    let light = "loads[0].traction=[1e-3, 0.0]";
    let [small, corotated] = ["small", "corotated"]
        .map(|rotation| corner(&[square, light, &format!("rule.mean.rotation=\"{rotation}\"")]));
    assert!((corotated / small - 1.0).abs() < 1e-4, "{small} {corotated}");
    let at = lattice("square", 0.5, 0.0);
    // A void and a rigid core, but for a factor.
    for factor in [1e-4, 1e4] {
        let young = format!("young = {:e}", 1000.0 * factor);
        let parts = CORE.replace("young = 10000.0", &young);
        let scene = scene(&at, &parts).expect("a scene");
        let (_, outcome) = solved(&scene);
        let solved = outcome.solved.expect("solved");
        assert!(solved.is_at_rest() && solved.iterations <= 40, "{factor}: {}", solved.iterations);
    }
}
