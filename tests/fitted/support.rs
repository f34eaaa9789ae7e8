//! Scenes put together from parts, and their equilibria.

use flockform::continuum::equilibrium::solve_equilibrium;
use flockform::continuum::plan::Plan;
use flockform::continuum::run::Outcome;
use flockform::flock::vectors::Vectors;
use flockform::material::cells::Cells;
use flockform::scene::{Scene, SceneError};

/// The six lattices with cells of about unit size, by the names of their kinds.
pub const KINDS: [&str; 6] =
    ["square", "rectangular", "hexagonal", "centred-rectangular", "oblique", "honeycomb"];

/// A lattice of a kind with cells of about this size \[length\], turned by an angle \[degree\].
pub fn lattice(kind: &str, h: f64, orientation: f64) -> String {
    let sizes = match kind {
        "rectangular" => format!("a = {h}, b = {}", 0.8 * h),
        "centred-rectangular" => format!("a = {h}, b = {h}"),
        "oblique" => format!("a = {h}, b = {h}, angle = 70.0"),
        "honeycomb" => format!("spacing = {}", h / 3f64.sqrt()),
        _ => format!("spacing = {h}"),
    };
    format!("lattice = {{ kind = \"{kind}\", {sizes}, orientation = {orientation} }}")
}

/// A scene of a material; `parts` are the tables that differ.
pub fn scene(lattice: &str, parts: &str) -> Result<Scene, SceneError> {
    scene_in(lattice, parts, None)
}

/// The same with its CSV files in a folder.
pub fn scene_in(lattice: &str, parts: &str, folder: Option<&std::path::Path>) -> Result<Scene, SceneError> {
    let text = format!(
        "title = \"test\"\nstop = {{ steps = 1 }}\nequilibrium = {{ tolerance = 1e-12 }}\n\
         rule = {{ mean = {{ kind = \"material\" }} }}\n{lattice}\n{parts}"
    );
    Scene::parse("test", "test.toml", &text, &[], folder)
}

/// The plan of a scene and its equilibrium.
pub fn solved(scene: &Scene) -> (Plan, Outcome) {
    let plan = Plan::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let request = scene.equilibrium.expect("asked for").request;
    let outcome = solve_equilibrium(scene, &request, plan.clone()).unwrap_or_else(|error| panic!("{error}"));
    (plan, outcome)
}

/// Area that belongs to each particle \[length^2\], shape \[count\].
pub fn shares(cells: &Cells, count: usize) -> Vec<f64> {
    let mut shares = vec![0.0; count];
    for (cell, &kind) in cells.iter().zip(&cells.kind) {
        for (&i, share) in cell.iter().zip(cells.load_shares(kind as usize)) {
            shares[i as usize] += share;
        }
    }
    shares
}

/// Relative L2 distance of the displacements from the exact ones, over the body's area.
pub fn error(plan: &Plan, outcome: &Outcome, exact: impl Fn([f64; 2]) -> [f64; 2]) -> f64 {
    let shares = shares(plan.setup.cells.as_ref().expect("a material"), plan.count());
    let (mut off, mut size) = (0.0, 0.0);
    for (i, share) in shares.into_iter().enumerate() {
        let (u, v) = (outcome.engine.displacement(i), exact(plan.setup.body.reference.get(i)));
        off += share * ((u[0] - v[0]).powi(2) + (u[1] - v[1]).powi(2));
        size += share * (v[0] * v[0] + v[1] * v[1]);
    }
    (off / size).sqrt()
}

/// Writes a table of displacements of the particles that `leads` picks \[length\]; a scene leads them by it.
pub fn table(
    path: &std::path::Path,
    points: &Vectors,
    exact: impl Fn([f64; 2]) -> [f64; 2],
    leads: impl Fn([f64; 2]) -> bool,
) {
    let mut text = String::from("x,y,ux,uy\n");
    for p in points.iter().filter(|&p| leads(p)) {
        let u = exact(p);
        text += &format!("{:e},{:e},{:e},{:e}\n", p[0], p[1], u[0], u[1]);
    }
    std::fs::write(path, text).expect("written");
}

/// A displacement along the right edge of a body, interpolated at a height \[length\].
pub fn on_right_edge(plan: &Plan, outcome: &Outcome, x: f64, y: f64) -> [f64; 2] {
    let reference = &plan.setup.body.reference;
    let on = (0..plan.count()).filter(|&i| (reference.x[i] - x).abs() < 1e-9);
    let mut on: Vec<usize> = on.collect();
    on.sort_by(|&a, &b| reference.y[a].total_cmp(&reference.y[b]));
    let above = on.iter().position(|&i| reference.y[i] >= y - 1e-12).expect("an edge that high");
    let (b, a) = (on[above], on[above.saturating_sub(1)]);
    let (low, high) = (reference.y[a], reference.y[b]);
    let share = if a == b { 0.0 } else { (y - low) / (high - low) };
    let (u, v) = (outcome.engine.displacement(a), outcome.engine.displacement(b));
    [0, 1].map(|k| u[k] + share * (v[k] - u[k]))
}
