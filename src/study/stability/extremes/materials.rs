//! Materials at the end of their range, and cells and bodies out of all proportion.

use super::{AT_REST, Case, End, MATERIAL, OWN, Outcome, SHEET, patch, plan, small, worst};
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::law::{Flock, Weights};
use crate::flock::rules::{Mean, Rotation, Rule};
use crate::flock::vectors::{Vectors, distance};
use crate::material::cells::{Cells, neighbourhood};
use crate::material::elastic::{Constants, Elastic, Plane};
use crate::material::weights::assemble;
use crate::scene::{Scene, SceneError};
use crate::solve::equilibrium::{Choice, Request, Solver, solve};
use crate::solve::linear::system;
use crate::study::stability::scaling;
use crate::study::stability::subject::Subject;

const OF_THE_LATTICE: &str = "a small body of its own on the scene's lattice";

pub fn cases(scene: &Scene) -> Vec<Case> {
    let mut all = Vec::new();
    let lattice = scaling::table(scene, "lattice").filter(|_| scene.material.is_some());
    let body = if lattice.is_some() { OF_THE_LATTICE } else { OWN };
    let lattice = lattice.unwrap_or_else(|| r#"lattice={kind="square",spacing=1.0}"#.into());
    for (plane, ratios) in [("stress", &[-0.99, 0.499, 0.99][..]), ("strain", &[-0.99, 0.499])] {
        for poisson in ratios {
            let sheet =
                format!(r#"material={{kind="isotropic",young=1000.0,poisson={poisson:?},plane="{plane}"}}"#);
            let made: [&str; 3] = [&lattice, &sheet, MATERIAL];
            let name = format!("nu = {poisson}, plane {plane}");
            let solved = [&made[..], &[AT_REST]].concat();
            all.push(Case::new(format!("{name}: strain"), body, patch(&solved, 1e-8)));
            all.push(Case::new(format!("{name}: stress"), body, stress(&made)));
            all.push(Case::new(format!("{name}: damping by itself"), body, damped(&made)));
        }
    }
    for (plane, poisson) in [("stress", -1.0), ("stress", 1.0), ("strain", 0.5), ("strain", -1.0)] {
        let sheet =
            format!(r#"material={{kind="isotropic",young=1000.0,poisson={poisson:?},plane="{plane}"}}"#);
        let outcome = patch(&[&sheet, MATERIAL, AT_REST], 0.0);
        all.push(Case::new(format!("nu = {poisson}, plane {plane}"), OWN, outcome));
    }
    for solver in Solver::ALL {
        for by in [1e6, 1e12] {
            all.push(Case::new(
                format!("stiffness contrast {by:e}, {solver}"),
                OWN,
                Ok(contrast(solver, by)),
            ));
        }
    }
    for (a, b) in [("1000.0", "1.0"), ("1.0", "1000.0")] {
        let lattice = format!(r#"lattice={{kind="rectangular",a={a},b={b}}}"#);
        let name = format!("cells of {a} by {b}");
        all.push(Case::new(name.clone(), OWN, patch(&[&lattice, "stop.steps=2000"], 1e-9)));
        all.push(Case::new(
            format!("{name}, material"),
            OWN,
            patch(&[&lattice, SHEET, MATERIAL, AT_REST], 1e-6),
        ));
    }
    all.push(Case::new("a strip of aspect ratio 1000, pulled", OWN, pulled()));
    for solver in ["auto", "multigrid", "conjugate-gradients"] {
        all.push(Case::new(format!("a strip of aspect ratio 1000, bent, {solver}"), OWN, bent(solver)));
    }
    all
}

/// The forces that a uniform strain takes are those of the material's stress on the outline.
fn stress(overrides: &[&str]) -> Result<Outcome, SceneError> {
    let scene = small(overrides)?;
    let plan = plan(&scene)?;
    let (Some(cells), Some(elastic)) = (&plan.setup.cells, &scene.material) else {
        return Err(scene.refuse("material", "the body has none", ""));
    };
    let reference = &plan.setup.body.reference;
    let strain = [3e-3, -1e-3, 2e-3];
    let displaced: Vectors =
        reference.iter().map(|[x, y]| [strain[0] * x + strain[2] * y, strain[1] * y]).collect();
    let [xx, yy, xy] = elastic.stress(strain).map(|stress| stress * elastic.thickness());
    let mut pushed = Vectors::zeros(reference.len());
    for side in cells.boundary_sides(&cells.incidence(reference.len())) {
        let [[ax, ay], [bx, by]] = side.map(|i| reference.get(i as usize));
        // Half of the side, turned outwards: the body lies to the left.
        let [nx, ny] = [0.5 * (by - ay), 0.5 * (ax - bx)];
        for i in side {
            pushed.x[i as usize] += xx * nx + xy * ny;
            pushed.y[i as usize] += xy * nx + yy * ny;
        }
    }
    let largest = pushed.iter().map(|p| distance(p, [0.0; 2])).fold(0.0, f64::max);
    let left = |i: usize| {
        let ([fx, fy], [px, py]) = (plan.setup.flock.force_under(i, &displaced), pushed.get(i));
        (fx + px).hypot(fy + py) / largest
    };
    let error = worst((0..reference.len()).map(left));
    // Rounding of displacements, times what the stiffest direction makes of it.
    Ok(Outcome::judged(error, 1e-9, "forces on the outline against the stress of the constants"))
}

/// The damping that the rule takes by itself lets nothing grow.
fn damped(overrides: &[&str]) -> Result<Outcome, SceneError> {
    let subject = Subject::of(&small(overrides)?)?;
    let radius = subject.sweep().radius();
    let check = format!("spectral radius {:.6} of the sweep as damped by itself", radius.radius);
    let error = if radius.converged { (radius.radius - 1.0).max(0.0) } else { f64::NAN };
    Ok(Outcome::judged(error, 0.0, check))
}

/// Three parts in a row, the middle one so many times as stiff, between a clamp and an end that is led: without
/// lateral contraction each part stretches as its compliance has it.
pub fn contrast(solver: Solver, contrast: f64) -> Outcome {
    match stretched(solver, contrast) {
        Ok(error) => Outcome::judged(error, 1e-3, "each part stretches by its compliance, over the pull"),
        Err(message) => Outcome::Refused { message },
    }
}

/// How far the three parts are from that, over the pull \[1\].
fn stretched(solver: Solver, contrast: f64) -> Result<f64, String> {
    let columns = 13u32;
    let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
    let around = neighbourhood(&lattice);
    let (body, neighbours) =
        Body::build(lattice, &Cut::Count { columns, rows: 4 }, &around, None).expect("builds");
    let sheet = |young: f64| {
        let constants = Constants::Isotropic { young, poisson: 0.0, plane: Plane::Stress };
        Elastic::new(constants, 1.0).expect("admissible")
    };
    let is_middle = |x: f64| (4.0..8.0).contains(&x);
    let mut cells = Cells::of_body(&body);
    cells.divide(&body.reference, 2, |[x, _]| usize::from(is_middle(x)));
    cells.inclusions.push(sheet(1000.0 * contrast));
    let weights = assemble(&cells, &body, &neighbours, &sheet(1000.0), Rotation::Small);
    let weights = Weights::Matrix(weights.map_err(|error| error.to_string())?);
    let end = f64::from(columns - 1);
    let mut flock = Flock::new(
        Rule { mean: Mean::Material { rotation: Rotation::Small }, ..Rule::BARYCENTRE },
        body.reference.clone(),
        neighbours,
        weights,
    );
    flock.keep_rest();
    let follows: Vec<bool> = body.reference.iter().map(|[x, _]| x > 0.0 && x < end).collect();
    let held: Vectors = body.reference.iter().map(|[x, _]| [if x == end { 1.0 } else { 0.0 }, 0.0]).collect();
    let system = system(&flock, &body, follows, held, &[]).map_err(|error| error.to_string())?;
    let request = Request {
        solver: Choice::This(solver),
        tolerance: 1e-8,
        most_iterations: 20_000,
        ..Request::default()
    };
    let solved = solve(&system, &request).map_err(|error| error.to_string())?;
    if !solved.is_at_rest() {
        let left = solved.residuals.last().copied().unwrap_or(f64::NAN);
        return Err(format!("{solver} ended short of its tolerance, {left:.1e} of the load being left"));
    }
    let compliance = |columns: std::ops::Range<u32>| {
        columns.map(|c| if is_middle(f64::from(c)) { 1.0 / contrast } else { 1.0 }).sum::<f64>()
    };
    let whole = compliance(0..columns - 1);
    let off = |i: usize| {
        let expected = compliance(0..body.reference.x[i] as u32) / whole;
        distance(solved.displacement.get(i), [expected, 0.0])
    };
    Ok(worst((0..body.count()).map(off)))
}

const STRIP: &str = r#"body={shape={kind="grid",columns=1001,rows=2}}"#;

fn pulled() -> Result<Outcome, SceneError> {
    let roles = "roles=[{region={kind=\"edge\",side=\"right\"},role=\"leader\",motion={kind=\"affine\",stretch=[1.01,1.0],\
                 steps=1}},{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
    let sheet = r#"material={kind="isotropic",young=1000.0,poisson=0.0}"#;
    let scene = small(&[STRIP, roles, sheet, MATERIAL, AT_REST])?;
    let end = End::of(&scene)?;
    let check = "without contraction the strip stretches evenly";
    Ok(Outcome::judged(end.apart_from_motion(&scene), 1e-6, check))
}

/// The strip as a cantilever, against the direct solver.
fn bent(solver: &str) -> Result<Outcome, SceneError> {
    let roles = r#"roles=[{region={kind="edge",side="left"},role="clamped"}]"#;
    let loads = r#"loads=[{kind="traction",region={kind="edge",side="right"},traction=[0.0,1e-6]}]"#;
    let by = |solver: &str| {
        let how = format!("equilibrium={{solver=\"{solver}\",tolerance=1e-8,most_iterations=100000}}");
        End::of(&small(&[STRIP, roles, loads, SHEET, MATERIAL, &how])?)
    };
    let (end, exact) = (by(solver)?, by("direct")?);
    // Bending is softer than stretching by the square of the aspect ratio: of a residual of 1e-8, 1e-2 is
    // what a displacement can be off by.
    Ok(Outcome::judged(exact.apart_from(&end, 1.0), 1e-2, "the direct solver"))
}
