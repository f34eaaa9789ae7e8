//! Displacements of second order on every lattice in any direction: a ring under pressure, a plate with a hole, a bent beam.

use crate::folders::temporary;
use crate::support::{KINDS, error, lattice, scene, scene_in, solved, table};

/// Orientations \[degree\] spread over the half turn after which every lattice comes back, and one between them.
const ORIENTATIONS: [f64; 13] =
    [0.0, 15.0, 30.0, 52.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0, 165.0];
/// How many of them, from the first on, are four of which no lattice takes one for the image of another.
const FOUR: usize = 4;

/// The least order that is asked of four orientations, each of which cuts the outline by its own chance.
const LEAST: f64 = 1.9;

/// Orders between spacings 0.5 and 0.25 of the errors' root mean square over four orientations and over all.
fn orders(error_at: impl Fn(f64, f64) -> f64) -> ([f64; 2], [f64; 2]) {
    let squares = [0.5, 0.25].map(|h| ORIENTATIONS.map(|orientation| error_at(h, orientation).powi(2)));
    let rms =
        |count: usize| squares.map(|squares| (squares[..count].iter().sum::<f64>() / count as f64).sqrt());
    let order = |[coarse, fine]: [f64; 2]| (coarse / fine).log2();
    ([order(rms(FOUR)), order(rms(ORIENTATIONS.len()))], rms(ORIENTATIONS.len()))
}

#[test]
fn a_ring_under_pressure_converges_with_order_two() {
    // G. Lame's ring from 4 to 10 in plane strain; a quarter of it.
    let parts = r#"
material = { kind = "isotropic", young = 1000.0, poisson = 0.3, plane = "strain" }
roles = [
    { region = { kind = "outline", pieces = [1] }, role = "clamped", axis = "y" },
    { region = { kind = "outline", pieces = [3] }, role = "clamped", axis = "x" },
]
loads = [{ kind = "pressure", region = { kind = "outline", pieces = [4] }, pressure = 10.0 }]
[body.shape]
kind = "path"
from = [4.0, 0.0]
steps = [
    { to = [10.0, 0.0] },
    { to = [0.0, 10.0], centre = [0.0, 0.0] },
    { to = [0.0, 4.0] },
    { to = [4.0, 0.0], centre = [0.0, 0.0], clockwise = true },
]
"#;
    let (young, nu, a, b, p) = (1000.0, 0.3, 4.0f64, 10.0f64, 10.0);
    let factor = (1.0 + nu) * p * a * a / (young * (b * b - a * a));
    let exact = |[x, y]: [f64; 2]| {
        let r = x.hypot(y);
        let u = factor * ((1.0 - 2.0 * nu) * r + b * b / r);
        [u * x / r, u * y / r]
    };
    for kind in KINDS {
        let (orders, errors) = orders(|h, orientation| {
            let scene = scene(&lattice(kind, h, orientation), parts).expect("a scene");
            let (plan, outcome) = solved(&scene);
            error(&plan, &outcome, exact)
        });
        println!("{kind}: orders {orders:.3?}, errors {errors:?}");
        assert!(orders.iter().all(|&order| order >= LEAST), "{kind}: orders {orders:?}, errors {errors:?}");
    }
}

#[test]
fn a_plate_with_a_hole_converges_with_order_two() {
    // G. Kirsch's hole of radius 4 in a quarter of a plate, whose outer edges are led by the exact displacement.
    let parts = r#"
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
roles = [
    { region = { kind = "outline", pieces = [1] }, role = "clamped", axis = "y" },
    { region = { kind = "outline", pieces = [4] }, role = "clamped", axis = "x" },
    { region = { kind = "outline", pieces = [2, 3] }, role = "leader", motion = { kind = "csv", file = "exact.csv" } },
]
[body.shape]
kind = "path"
from = [4.0, 0.0]
steps = [
    { to = [12.0, 0.0] },
    { to = [12.0, 12.0] },
    { to = [0.0, 12.0] },
    { to = [0.0, 4.0] },
    { to = [4.0, 0.0], centre = [0.0, 0.0], clockwise = true },
]
"#;
    let (young, nu, a, tension) = (1000.0, 0.3, 4.0f64, 10.0);
    let (shear, kappa) = (young / (2.0 * (1.0 + nu)), (3.0 - nu) / (1.0 + nu));
    let exact = |[x, y]: [f64; 2]| {
        let (r, t) = (x.hypot(y), y.atan2(x));
        let scale = tension * a / (8.0 * shear);
        let (q, c) = (a / r, a * a * a / (r * r * r));
        [
            scale
                * (r / a * (kappa + 1.0) * t.cos() + 2.0 * q * ((1.0 + kappa) * t.cos() + (3.0 * t).cos())
                    - 2.0 * c * (3.0 * t).cos()),
            scale
                * (r / a * (kappa - 3.0) * t.sin() + 2.0 * q * ((1.0 - kappa) * t.sin() + (3.0 * t).sin())
                    - 2.0 * c * (3.0 * t).sin()),
        ]
    };
    let folder = temporary();
    for kind in KINDS {
        let (orders, errors) = orders(|h, orientation| {
            let lattice = lattice(kind, h, orientation);
            let file = folder.path().join("exact.csv");
            // Where the particles are is known once the body is laid out, which does not look at the motion.
            let still = parts.replace(
                "{ kind = \"csv\", file = \"exact.csv\" }",
                "{ kind = \"velocity\", per_step = [0.0, 0.0] }",
            );
            let laid_out = solved(&scene(&lattice, &still).expect("a scene")).0;
            table(&file, &laid_out.setup.body.reference, exact, |[x, y]| x.max(y) > 11.999);
            let scene =
                scene_in(&lattice, parts, Some(folder.path())).unwrap_or_else(|error| panic!("{error}"));
            let (plan, outcome) = solved(&scene);
            error(&plan, &outcome, exact)
        });
        println!("{kind}: orders {orders:.3?}, errors {errors:?}");
        assert!(orders.iter().all(|&order| order >= LEAST), "{kind}: orders {orders:?}, errors {errors:?}");
    }
}

#[test]
fn a_bent_beam_converges_with_order_two() {
    let parts = r#"
body = { shape = { kind = "rectangle", min = [0.0, -2.0], max = [12.0, 2.0] } }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
roles = [{ region = { kind = "edge", side = "left" }, role = "leader", motion = { kind = "csv", file = "exact.csv" } }]
loads = [{ kind = "traction", region = { kind = "edge", side = "right" }, traction = [10.0, 0.0], profile = { from = [12.0, 0.0], to = [12.0, 1.0], factors = [0.0, 1.0] } }]
"#;
    let exact = |[x, y]: [f64; 2]| {
        let curvature = 10.0 / 1000.0;
        [curvature * x * y, -0.5 * curvature * (x * x + 0.3 * y * y)]
    };
    let folder = temporary();
    for kind in KINDS {
        let (orders, errors) = orders(|h, orientation| {
            let lattice = lattice(kind, h, orientation);
            let still = parts.replace(
                "{ kind = \"csv\", file = \"exact.csv\" }",
                "{ kind = \"velocity\", per_step = [0.0, 0.0] }",
            );
            let laid_out = solved(&scene(&lattice, &still).expect("a scene")).0;
            table(&folder.path().join("exact.csv"), &laid_out.setup.body.reference, exact, |[x, _]| x < 1e-6);
            let scene =
                scene_in(&lattice, parts, Some(folder.path())).unwrap_or_else(|error| panic!("{error}"));
            let (plan, outcome) = solved(&scene);
            error(&plan, &outcome, exact)
        });
        println!("{kind}: orders {orders:.3?}, errors {errors:?}");
        let is_exact = errors[1] < 1e-9;
        assert!(
            is_exact || orders.iter().all(|&order| order >= LEAST),
            "{kind}: orders {orders:?}, errors {errors:?}"
        );
    }
}
