//! The memory that a run takes, before it does: what it steps, solves and measures. `export::memory` adds what its
//! outputs take.
//!
//! Arrays of the plan are counted; what solvers and measurements take beside them was measured on square and hexagonal
//! bodies of 100,000 to 1,200,000 particles, aligned and fitted, and is the same for each particle.

use super::equilibrium::is_nearly_incompressible;
use super::plan::Plan;
use crate::engine::setup::Setup;
use crate::flock::body::Cut;
use crate::flock::lattice::Site;
use crate::flock::law::Weights;
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::outlay::{MOST_ENTRIES, MOST_SITES};
use crate::flock::role::Role;
use crate::flock::rules::Mean;
use crate::geometry::outline::{Outline, Place};
use crate::scene::{BodySource, Scene, Weights as FixedWeights};
use crate::solve::corotated::{self, is_corotated};
use crate::solve::equilibrium::{
    Choice, DIRECT_UP_TO, FACTORISED_UP_TO, INCOMPRESSIBLE_UP_TO, Precision, Solver, UNSYMMETRIC_UP_TO,
};

/// A number of the status of this process, where the system has one \[B\].
pub fn own(name: &str) -> Option<u64> {
    Some(1024 * field(&std::fs::read_to_string("/proc/self/status").ok()?, name)?)
}

/// The number behind a word of a text, if there is one.
pub fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Fewest bytes that a run of a scene takes, known before anything is laid out; 0 where its layout is refused anyway.
pub fn at_least(scene: &Scene) -> f64 {
    let lattice = &scene.lattice;
    let (particles, seen) = match &scene.body {
        BodySource::Points(cloud) => {
            // The lists, and what finds them anew or sweeps over them; means that are not affine are swept over as they are.
            let is_within = matches!(scene.neighbourhood, Neighbourhood::Within { .. });
            let entry = if is_within && scene.mean != Mean::Barycentre { 4.0 } else { 8.0 };
            return (cloud.ids.len() * EACH) as f64 + entry * cloud.entries as f64;
        }
        BodySource::Cut(Cut::Count { columns, rows }) => {
            let extent = [columns, rows].map(|&count| f64::from(count));
            let inside = |far: f64, extent: f64| (1.0 - far / extent).max(0.0);
            let seen = seen(scene, |[x, y]| inside(x, extent[0]) * inside(y, extent[1]));
            (extent[0] * extent[1], seen)
        }
        BodySource::Cut(Cut::Shape(shape)) => {
            let Ok(outline) = Outline::of_shape(shape) else { return 0.0 };
            let (area, length) = (outline.area(), outline.length());
            let [a, b] = [[1, 0], [0, 1]].map(|axis| lattice.vector(axis)).map(|[x, y]| x.hypot(y));
            // What a shape shares with itself moved by d is its area less d times half its perimeter, at least (its covariogram).
            let seen = seen(scene, |[x, y]| (1.0 - (x * a + y * b) * length / (2.0 * area)).max(0.0));
            (area / lattice.cell_area(), seen)
        }
    };
    let entries = particles * seen;
    let is_refused = particles > MOST_SITES as f64 || entries > MOST_ENTRIES as f64;
    if is_refused { 0.0 } else { particles * EACH as f64 + 4.0 * entries }
}

/// Others that a particle sees on average, at least, where it sees this share of those that are so many columns and rows away.
fn seen(scene: &Scene, share: impl Fn([f64; 2]) -> f64) -> f64 {
    let share = |offset: &Site| share(offset.map(|far| f64::from(far.abs())));
    let lists = scene.neighbourhood.offsets(&scene.lattice).unwrap_or_default();
    lists.iter().map(|list| list.iter().map(share).sum()).reduce(f64::min).unwrap_or(0.0)
}

/// Bytes of each particle: positions (twice), reference, roles, sites, and where its neighbours begin.
const EACH: usize = 3 * 16 + 3 + 8 + 4;

/// Bytes of a leader: where it was, by which change it is led, and lists that it is in.
const LED: usize = 48 + 3 * 8;

/// Bytes of an engine: positions (twice), reference, roles, sites, neighbour lists and what the scene adds to them.
pub fn stepped(plan: &Plan) -> usize {
    let (count, bonds) = (plan.count(), neighbour_entries(plan));
    let present = |is: bool, bytes: usize| if is { bytes } else { 0 };
    let cells = plan
        .setup
        .cells
        .as_ref()
        .map_or(0, |cells| 4 * (cells.starts.len() + cells.index.len() + cells.count()));
    let leaders = plan.setup.roles.iter().filter(|&&role| role == Role::Leader).count();
    count * EACH
        + leaders * LED
        + bonds * 4
        + lists_of_the_sweep(plan)
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
        + present(plan.setup.body.outline.is_some(), size_of::<Option<Place>>() * count)
        + present(plan.setup.free_edge.is_some(), 2 * count)
        + present(plan.setup.flock.forces.is_some(), 16 * count)
        + present(plan.setup.flock.rest.is_some(), 16 * count)
        // Whether each is broken, and those that may still break: on a lattice few spans of them, of points each pair.
        + present(plan.setup.flock.bonds.is_some(), if plan.setup.body.numbering.is_some() { 10 } else { 4 } * bonds)
        + present(plan.setup.present_radius.is_some(), 8 * count)
}

/// Bytes of the lists that a sweep reads where no two particles see the same, as those of points: a second copy, with a row of
/// coefficients for each particle where these count. Of a lattice there are few.
fn lists_of_the_sweep(plan: &Plan) -> usize {
    let flock = &plan.setup.flock;
    let is_compiled = flock.rule.mean == Mean::Barycentre && plan.setup.present_radius.is_none();
    if plan.setup.body.numbering.is_none() || !is_compiled {
        return 0;
    }
    let entry = match &flock.weights {
        Weights::Equal => 4,
        Weights::Scalar(_) | Weights::Matrix(_) => 4 + 8,
    };
    entry * flock.neighbours.index.len()
}

/// Bytes that finding the equilibrium takes beside the plan, less the positions that the engine has later; 0 for a scene
/// that is stepped. Of a part of a body a solver that ranks do not share takes what it takes of the whole.
pub fn solving(scene: &Scene, plan: &Plan) -> usize {
    /// Vectors of conjugate gradients, and of all levels of multigrid.
    const BY_ITERATION: f64 = 118.0;
    /// The matrix of a body that turns, which differs from row to row, and its factor; the latter where rows are wide.
    const COROTATED: f64 = 2_000.0;
    const COROTATED_FACTOR: [f64; 2] = [2_600.0, 6_300.0];
    if scene.equilibrium.is_none() {
        return 0;
    }
    let count = if iterates_in_parts(scene, plan) { plan.count() } else { plan.setup.body.total() } as f64;
    let of_each = match (is_corotated(&plan.setup.flock), is_factorised(scene, plan)) {
        (true, is_factorised) => {
            let factor =
                if is_factorised { between(COROTATED_FACTOR, share_of_wide_rows(plan)) } else { 0.0 };
            COROTATED + factor
        }
        (false, true) => return factor(plan, count),
        (false, false) => BY_ITERATION,
    };
    (of_each * count) as usize
}

/// Whether the equilibrium is found by a factorisation, as far as is known before.
fn is_factorised(scene: &Scene, plan: &Plan) -> bool {
    let Some(asked) = &scene.equilibrium else { return false };
    let total = plan.setup.body.total();
    match asked.request.solver {
        Choice::This(solver) => solver == Solver::Direct,
        Choice::Auto if is_corotated(&plan.setup.flock) => total <= corotated::DIRECT_UP_TO,
        // In larger bodies nothing depends on which particles see each other, and it takes long to find out.
        Choice::Auto if plan.count() <= UNSYMMETRIC_UP_TO && is_one_sided(plan) => true,
        Choice::Auto => {
            let most = if is_nearly_incompressible(scene) { INCOMPRESSIBLE_UP_TO } else { DIRECT_UP_TO };
            // Of a part it is not known how many of the others follow.
            let followers = if plan.setup.body.part.is_some() { total } else { followers(plan) };
            asked.request.precision == Precision::F64 && followers <= most
        }
    }
}

fn followers(plan: &Plan) -> usize {
    plan.setup.roles.iter().filter(|&&role| role == Role::Follower).count()
}

/// The part of the cells whose dilatation is averaged with that of others, so that particles feel each other across two cells \[1\].
fn share_of_wide_rows(plan: &Plan) -> f64 {
    let Setup { cells: Some(cells), elastic: Some(elastic), .. } = &plan.setup else { return 0.0 };
    let is_wide = |cell: &usize| cells.material_of(*cell, elastic).averaged().is_some();
    (0..cells.count()).filter(is_wide).count() as f64 / cells.count().max(1) as f64
}

fn between([low, high]: [f64; 2], share: f64) -> f64 {
    low + share * (high - low)
}

/// Bytes that equilibria on the way take beside the last one: the plan, of which the engine has a copy but for the places, forces and
/// places of two of them between which work is summed up, and the solution that the next begins with.
pub fn on_the_way(scene: &Scene, plan: &Plan) -> usize {
    const PLACES: usize = 3 * 16;
    const EACH: usize = 2 * 3 * 16 + 16;
    let is_solved_in_parts = scene.equilibrium.is_some() && scene.load_steps.is_some();
    let bytes = stepped(plan) + EACH * plan.count();
    if is_solved_in_parts { bytes - PLACES * plan.count() } else { 0 }
}

/// Whether ranks that have parts of a body share the iterations by which its equilibrium is found, as far as its size and its
/// rule say; otherwise each of them is given the whole matrix.
pub(super) fn iterates_in_parts(scene: &Scene, plan: &Plan) -> bool {
    scene.equilibrium.is_some_and(|asked| match asked.request.solver {
        Choice::This(solver) => solver.is_shared(),
        Choice::Auto if is_corotated(&plan.setup.flock) => plan.setup.body.total() > corotated::DIRECT_UP_TO,
        // Neighbours hardly feel each other alike.
        Choice::Auto => scene.weights != Some(FixedWeights::Solved) && !is_factorised(scene, plan),
    })
}

/// Bytes of the factor that an automatic choice falls back on where its iteration takes the body for unstable; `None` where
/// it does not iterate, or would not fall back. Few bodies need it: [`solving`] leaves it out.
pub fn fallback(scene: &Scene, plan: &Plan) -> Option<usize> {
    let request = &scene.equilibrium.as_ref()?.request;
    let falls_back = request.solver == Choice::Auto
        && request.precision == Precision::F64
        && followers(plan) <= FACTORISED_UP_TO
        && !is_corotated(&plan.setup.flock)
        && !is_factorised(scene, plan)
        && !is_one_sided(plan);
    falls_back.then(|| factor(plan, plan.count() as f64))
}

/// Bytes of a factor of so many particles.
fn factor(plan: &Plan, count: f64) -> usize {
    /// Of each particle, by each doubling of the body from 2^11 particles on; and where rows are wide, with what it has before.
    const EACH: f64 = 530.0;
    const WIDE: [f64; 2] = [3_680.0, 658.0];
    let doublings = (count.log2() - 11.0).max(1.0);
    (between([EACH * doublings, WIDE[0] + WIDE[1] * doublings], share_of_wide_rows(plan)) * count) as usize
}

/// Whether a particle sees another that does not see it; a material's never do.
fn is_one_sided(plan: &Plan) -> bool {
    let neighbours = &plan.setup.flock.neighbours;
    let sees = |i: usize, j: usize| neighbours.of(j).contains(&(i as u32));
    let all = |i: usize| neighbours.of(i).iter().all(|&j| sees(i, j as usize));
    !matches!(plan.setup.flock.weights, Weights::Matrix(_)) && !(0..plan.count()).all(all)
}

/// Bytes of stresses and forces as they are measured, where the scene has a material.
pub fn measured(plan: &Plan) -> usize {
    let Some(cells) = &plan.setup.cells else { return 0 };
    195 * plan.count() + 55 * cells.count()
}

/// Entries of the neighbour lists; where they are found anew at every step, about as many as the
/// radius holds at the reference density.
pub(crate) fn neighbour_entries(plan: &Plan) -> usize {
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
