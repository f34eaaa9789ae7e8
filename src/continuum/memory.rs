//! The memory that a run takes, before it does.

use super::plan::Plan;
use crate::flock::body::{Cut, MOST_SITES};
use crate::flock::law::Weights;
use crate::geometry::outline::Outline;
use crate::material::stress::StressState;
use crate::scene::{BodySource, Scene};

/// Fewest bytes that a run of a scene takes, known before anything is laid out; 0 where its layout is refused anyway.
pub fn at_least(scene: &Scene) -> f64 {
    let BodySource::Cut(cut) = &scene.body else { return 0.0 };
    let particles = match cut {
        Cut::Count { columns, rows } => f64::from(*columns) * f64::from(*rows),
        Cut::Shape(shape) => {
            Outline::of_shape(shape).map_or(0.0, |outline| outline.area() / scene.lattice.cell_area())
        }
    };
    if particles > MOST_SITES as f64 { 0.0 } else { particles * EACH as f64 }
}

/// Bytes that the run holds when it writes its results, at its largest: what it steps, and the configurations that are
/// kept. The report takes more of it (`export::report::run::most_bytes`), and each figure some 20 MB while it is drawn.
pub fn predicted(scene: &Scene, plan: &Plan) -> usize {
    stepped(plan) + results(scene, plan)
}

/// Bytes of configurations kept for figures, and of the last one in numbers.
fn results(scene: &Scene, plan: &Plan) -> usize {
    let is_solved_at_once = scene.equilibrium.is_some() && scene.load_steps.is_none();
    let before = |figure: &&usize| !is_solved_at_once && **figure < plan.stop.steps;
    // The last one is kept for its figure and for the numbers.
    let snapshots = scene.record.figures.iter().filter(before).count() + 1;
    let stress = scene.material.map_or(0, |_| size_of::<Option<StressState>>());
    plan.count() * (snapshots * SNAPSHOT + stress)
}

/// Bytes of a particle in a [`Snapshot`](super::record::Snapshot): position, role and energies.
const SNAPSHOT: usize = 16 + 1 + 2 * 8;

/// Bytes of each particle: positions (twice), reference, roles, sites, and where its neighbours begin.
const EACH: usize = 3 * 16 + 3 + 8 + 4;

/// Bytes that the steps take: positions (twice), reference, roles, sites, neighbour lists and what
/// the scene adds to them.
fn stepped(plan: &Plan) -> usize {
    let (count, bonds) = (plan.count(), neighbour_entries(plan));
    let present = |is: bool, bytes: usize| if is { bytes } else { 0 };
    let cells = plan
        .setup
        .cells
        .as_ref()
        .map_or(0, |cells| 4 * (cells.starts.len() + cells.index.len() + cells.count()));
    count * EACH
        + bonds * 4
        + match &plan.setup.flock.weights {
            Weights::Equal => 0,
            Weights::Scalar(weights) => 8 * weights.len(),
            Weights::Matrix(weights) => {
                let cells = weights.cells.as_ref().map_or(0, |cells| cells.bytes());
                4 * count + 32 * weights.blocks.len() + cells
            }
        }
        + cells
        + 16 * count * plan.setup.loads.len()
        + present(plan.setup.flock.forces.is_some(), 16 * count)
        + present(plan.setup.flock.rest.is_some(), 16 * count)
        + present(plan.setup.flock.bonds.is_some(), bonds)
        + present(plan.setup.present_radius.is_some(), 8 * count)
}

/// Entries of the neighbour lists; where they are found anew at every step, about as many as the
/// radius holds at the reference density.
pub fn neighbour_entries(plan: &Plan) -> usize {
    match plan.setup.present_radius {
        None => plan.setup.flock.neighbours.index.len(),
        Some(radius) => {
            let within = std::f64::consts::PI * radius * radius / plan.setup.body.lattice.cell_area();
            (plan.count() as f64 * within.min(plan.count() as f64)) as usize
        }
    }
}

/// Bytes in the unit that suits them.
pub fn readable_bytes(bytes: usize) -> String {
    match bytes as f64 {
        b if b < 1024.0 * 1024.0 => format!("{:.0} KiB", (b / 1024.0).ceil()),
        b if b < 1024.0 * 1024.0 * 1024.0 => format!("{:.1} MiB", b / 1024.0 / 1024.0),
        b => format!("{:.2} GiB", b / 1024.0 / 1024.0 / 1024.0),
    }
}
