//! An outline costs the solver few iterations more, in whatever direction it cuts the lattice.

use flockform::continuum::equilibrium::of_plan;
use flockform::continuum::plan::Plan;
use flockform::solve::equilibrium::{Choice, Request, Solver, solve};

use crate::support::{KINDS, lattice, scene};

const PARTS: &str = r#"
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
roles = [{ region = { kind = "edge", side = "left" }, role = "clamped" }]
loads = [{ kind = "traction", region = { kind = "edge", side = "right" }, traction = [0.0, 1.0] }]
"#;

const PLATE: &str = r#"shape = { kind = "rectangle", max = [40.0, 30.0] }"#;
const BEAM: &str = r#"shape = { kind = "rectangle", max = [80.0, 8.0] }"#;
const COOK: &str =
    r#"shape = { kind = "polygon", vertices = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]] }"#;
const HOLE: &str = r#"
shape = { kind = "rectangle", max = [40.0, 30.0] }
holes = [{ kind = "disc", centre = [20.3, 14.1], radius = 6.0 }]
"#;
const RING: &str = r#"
[body.shape]
kind = "path"
from = [10.0, 0.0]
steps = [
    { to = [35.0, 0.0] },
    { to = [0.0, 35.0], centre = [0.0, 0.0] },
    { to = [0.0, 10.0] },
    { to = [10.0, 0.0], centre = [0.0, 0.0], clockwise = true },
]
"#;

fn iterations(kind: &str, orientation: f64, body: &str) -> usize {
    let parts = format!("{PARTS}\n[body]\n{body}");
    let scene = scene(&lattice(kind, 0.5, orientation), &parts).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let system = of_plan(&scene, &plan).expect("linear");
    let solver = Choice::This(Solver::Multigrid);
    let request = Request { solver, tolerance: 1e-8, ..Request::default() };
    let solved = solve(&system, &request).unwrap_or_else(|error| panic!("{kind} {orientation}: {error}"));
    assert!(solved.converged);
    solved.iterations
}

#[test]
fn a_cut_outline_takes_at_most_half_as_many_iterations_more_than_whole_cells() {
    for kind in KINDS {
        for (whole, bodies) in [(PLATE, &[PLATE, COOK, HOLE, RING][..]), (BEAM, &[BEAM][..])] {
            let aligned = iterations(kind, 0.0, &format!("outline = \"lattice\"\n{whole}"));
            for body in bodies {
                let turned = [0.0, 7.5, 17.0, 22.5, 30.0, 41.0, 60.0, 82.5]
                    .map(|orientation| iterations(kind, orientation, body));
                println!("{kind}: {turned:?} against {aligned}");
                let most = 1.5 * aligned as f64;
                assert!(
                    turned.iter().all(|&n| n as f64 <= most),
                    "{kind} {body}: {turned:?} against {aligned}"
                );
            }
        }
    }
}
