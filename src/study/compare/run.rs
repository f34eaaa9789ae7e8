//! Rule and truth of a scene.

use std::ops::ControlFlow;
use std::time::Duration;

use super::measures::{Comparison, Sides, energy_norm, von_mises};
use super::places::{PlaceComparison, compare_places};
use super::reference::{Reference, Setting};
use super::split::{ErrorParts, are_alike, outlines};
use super::supports::supports;
use crate::continuum::equilibrium::run_to_equilibrium;
use crate::continuum::layout::Layout;
use crate::continuum::mechanics::Stresses;
use crate::continuum::places::at_places;
use crate::continuum::plan::Plan;
use crate::continuum::run::Outcome;
use crate::engine::Engine;
use crate::engine::setup::RoleChange;
use crate::fem::{Effort, FemError, Stress};
use crate::flock::role::Role;
use crate::flock::rules::Rotation;
use crate::flock::vectors::Vectors;
use crate::geometry::Point;
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::scene::{LeaderMotion, Load, LoadSteps, Scene, SceneError};
use crate::solve::stopwatch::Stopwatch;

/// The truth of a scene's body in its material, under its loads, clamps and leaders.
#[derive(Clone, Debug)]
pub struct SceneReference {
    /// True displacements, at the particles and everywhere else.
    pub solution: Reference,
    /// The body whose particles are asked for.
    pub layout: Layout,
    /// The material of the scene.
    pub elastic: Elastic,
    /// Time to the solution.
    pub time: Duration,
}

/// The results of a comparison. Arrays follow the particles or the cells of the body.
#[derive(Debug)]
pub struct Compared {
    /// How far rule and truth are apart.
    pub comparison: Comparison,
    /// How the rule's run ended.
    pub outcome: Outcome,
    /// The reference that the rule is compared with.
    pub reference: SceneReference,
    /// Cells over which stress and energy are taken.
    pub cells: Cells,
    /// Displacements by the rule \[length\], shape \[particles\]; the true ones are the truth's.
    pub rule: Vectors,
    /// Stress at the centres of the cells \[force / length^2\], shape \[cells\].
    pub von_mises_rule: Vec<f64>,
    /// The same of the truth itself.
    pub von_mises_truth: Vec<f64>,
    /// At the scene's `record.places`.
    pub places: Vec<PlaceComparison>,
    /// Warnings about the truth.
    pub cautions: Vec<String>,
}

/// Solves for the truth of a scene: clamped particles and leaders with a motion of their own are held where
/// they are at step `stop.steps`, leaders led by the truth are as free as the followers.
///
/// # Errors
/// Names the key of the scene for which there is no truth: no material, a body without an outline, a body that nothing
/// holds, a leader outside the shape.
pub fn reference_of(scene: &Scene, effort: &Effort) -> Result<SceneReference, SceneError> {
    let start = Stopwatch::start();
    let layout = Layout::new(scene)?;
    let Some(elastic) = scene.material else { return Err(without_material(scene)) };
    let Some(outline) = &layout.outline else {
        let message = "the truth is that of a shape, and the body has no outline that bounds one";
        return Err(scene.refuse(
            "body.shape",
            message,
            "give a shape that is one piece and crosses itself nowhere",
        ));
    };
    let changes = layout.role_changes(scene, None)?;
    let supports = supports(scene, &layout, outline, &changes, scene.stop.steps as f64)?;
    let loads = layout.loads(scene)?;
    let setting = Setting { scene, layout: &layout, elastic: &elastic, outline, supports, loads: &loads };
    let solution = Reference::solve(setting, effort).map_err(|error| refused(scene, &error))?;
    require_known(scene, &solution, &changes)?;
    Ok(SceneReference { solution, layout, elastic, time: start.elapsed() })
}

/// The plan of a scene, its leaders led by the truth where the scene asks for that.
///
/// # Errors
/// As [`reference_of`] and [`Plan::new`].
pub fn plan(scene: &Scene) -> Result<Plan, SceneError> {
    match scene.led_by_reference() {
        None => Plan::new(scene),
        Some(_) => {
            let SceneReference { solution, layout, .. } = reference_of(scene, &Effort::default())?;
            Plan::of_layout(scene, layout, Some(&led_by(&solution)))
        }
    }
}

/// Runs the rule of a scene to its end and measures where it has the body against where the truth has it.
/// `watch` sees the run as [`run_to_equilibrium`] shows it.
///
/// # Errors
/// Names the key of a scene that has no truth, or none that its end could be held against.
pub fn compare(
    scene: &Scene,
    effort: &Effort,
    watch: &mut dyn FnMut(&Engine, f64) -> ControlFlow<()>,
) -> Result<Compared, SceneError> {
    require_comparable(scene)?;
    let truth = reference_of(scene, effort)?;
    let start = Stopwatch::start();
    let plan = Plan::of_layout(scene, truth.layout.clone(), Some(&led_by(&truth.solution)))?;
    let cells = plan.setup.cells.clone().unwrap_or_else(|| Cells::of_body(&plan.setup.body));
    let outcome = run_to_equilibrium(scene, plan, watch)?;
    let time = start.elapsed();

    let engine = &outcome.engine;
    let rule = engine.displacements();
    let followed = |(i, &role): (usize, &Role)| role == Role::Follower && truth.solution.knows(i);
    let follows: Vec<bool> = engine.roles().iter().enumerate().map(followed).collect();
    let (elastic, known) = (&truth.elastic, &truth.solution.displacement);
    let rotation = scene.rotation();
    let von_mises_rule = von_mises(&cells, elastic, &rule, rotation);
    let true_stress = truth.solution.stress_at(&cells.centres(&engine.body().reference));
    let true_stress = true_stress.map_err(|error| refused(scene, &error))?;
    let von_mises_truth: Vec<f64> = true_stress.iter().map(Stress::von_mises).collect();
    let sides = Sides {
        cells: &cells,
        elastic,
        rotation,
        rule: &rule,
        truth: known,
        von_mises: [&von_mises_rule, &von_mises_truth],
        follows: &follows,
    };
    let mut comparison = Comparison::of(&sides)
        .map_err(|shape| scene.refuse("lattice", shape.to_string(), "use a lattice less slender"))?;
    let energy = truth.solution.strain_energy();
    comparison.strain_energy_truth = Some(energy);
    comparison.energy_norm_rel = is_orthogonal(scene, engine, &truth.layout)
        .then(|| energy_norm(comparison.strain_energy_rule, energy));
    comparison.seconds_rule = time.as_secs_f64();
    comparison.seconds_truth = truth.time.as_secs_f64();
    comparison.truth_stated_rel_l2 =
        Some(truth.solution.error().displacement).filter(|error| error.is_finite());
    comparison.parts = ErrorParts::of(scene, &truth, &rule, &follows)?;
    let stresses = Stresses::at_present(engine).filter(|_| !scene.record.places.is_empty());
    let at_places = stresses.map_or_else(Vec::new, |stresses| at_places(scene, engine, &stresses));
    let places = compare_places(at_places, &truth.solution).map_err(|error| refused(scene, &error))?;
    Ok(Compared {
        comparison,
        outcome,
        cautions: cautions(scene, &truth.solution, effort),
        reference: truth,
        cells,
        rule,
        von_mises_rule,
        von_mises_truth,
        places,
    })
}

/// Why the truth is less true than it was asked to be.
fn cautions(scene: &Scene, truth: &Reference, effort: &Effort) -> Vec<String> {
    let pushed = scene.loads.iter().position(|load| matches!(load, Load::Force { .. }));
    let pushed = pushed.map(|k| {
        format!(
            "loads[{k}] pushes single points, where elasticity yields without limit: displacement, energy and stress of the truth depend on its mesh, and so do the errors against it; a traction on an edge has a truth"
        )
    });
    let own = truth.error().displacement;
    let missed = (own.is_nan() || own > effort.target).then(|| {
        format!(
            "the truth's own error is not known to be below the {:.2e} % asked for, on {} nodes; where single points hold or push a body no mesh is fine enough",
            100.0 * effort.target,
            truth.nodes()
        )
    });
    pushed.into_iter().chain(missed).collect()
}

/// Whether energies tell the error, by the orthogonality of B. G. Galerkin: of cells that have the shape of the body and the
/// energy of one continuous displacement, which loads alone or moved supports alone drive under small rotations.
fn is_orthogonal(scene: &Scene, engine: &Engine, layout: &Layout) -> bool {
    let is_moved = engine.changes().iter().any(|change| change.motion.is_some());
    let is_driven_by_one = scene.rotation() == Rotation::Small && (scene.loads.is_empty() || !is_moved);
    let cells = layout.cells.as_ref().zip(scene.material.as_ref());
    let are_conforming = cells.is_some_and(|(cells, elastic)| cells.are_conforming(elastic));
    // Edges of inclusions need not run along sides of cells.
    let have_shape = layout.partition.is_none()
        && outlines(layout).is_some_and(|(outline, of_cells)| are_alike(outline, &of_cells));
    scene.is_fitted && is_driven_by_one && are_conforming && have_shape
}

/// The plan of a scene, its leaders led by this truth of its body or of a finer one.
///
/// # Errors
/// As [`Plan::new`].
pub(crate) fn plan_led_by(scene: &Scene, truth: &Reference) -> Result<Plan, SceneError> {
    Plan::of_layout(scene, Layout::new(scene)?, Some(&led_by(truth)))
}

/// The places to which this truth leads leaders; one that it does not know has no place to go.
pub(crate) fn led_by(truth: &Reference) -> impl Fn(&Vectors) -> Vec<Point> + '_ {
    |places| match truth.displacements_at(places) {
        Ok(found) => found.iter().collect(),
        Err(_) => vec![[f64::NAN; 2]; places.len()],
    }
}

/// The reference covers one body in one equilibrium state, under the whole load.
pub(crate) fn require_comparable(scene: &Scene) -> Result<(), SceneError> {
    if scene.material.is_none() {
        return Err(without_material(scene));
    }
    if let Some(LoadSteps::Solved(parts)) = &scene.load_steps
        && let Some(last) = parts.last().filter(|&&last| last != 1.0)
    {
        let message = format!("the truth is that of the whole load, and the last part is {last}");
        let help = "let the schedule end with 1, or leave it out and give that part of the loads and motions";
        return Err(scene.refuse("load_steps.schedule", message, help));
    }
    if !scene.actions.is_empty() {
        let message = "the truth knows one body, and this one is changed on its way";
        return Err(scene.refuse("actions", message, "leave this out to compare"));
    }
    let later = scene.roles.iter().position(|entry| entry.from > 1 || entry.when.is_some());
    if let Some(k) = later {
        let key = if scene.roles[k].when.is_some() { "when" } else { "from" };
        return Err(scene.refuse(
            &format!("roles[{k}].{key}"),
            "the truth knows the body at rest under roles that hold from the start, and this one comes later",
            "leave this entry out to compare",
        ));
    }
    let ghosts = scene.roles.iter().position(|entry| entry.role == Role::Ghost);
    let broken = [
        (scene.fracture.is_some(), "fracture".to_owned()),
        (!scene.cuts.is_empty(), "cuts".to_owned()),
        (ghosts.is_some(), format!("roles[{}].role", ghosts.unwrap_or_default())),
    ];
    match broken.into_iter().find(|(is_there, _)| *is_there) {
        None => Ok(()),
        Some((_, key)) => Err(scene.refuse(
            &key,
            "the truth is that of a whole body: bonds that break have no part in it",
            "leave this out to compare",
        )),
    }
}

fn without_material(scene: &Scene) -> SceneError {
    let help = "add [material] with kind = \"isotropic\", young and poisson";
    scene.refuse("material", "the truth is that of a material, and the scene has none", help)
}

/// Particles outside the shape cannot be led by a truth that does not know them.
fn require_known(scene: &Scene, truth: &Reference, changes: &[RoleChange]) -> Result<(), SceneError> {
    for (k, change) in changes.iter().enumerate() {
        let is_led = matches!(scene.roles[k].motion, Some(LeaderMotion::Reference { .. }));
        if let Some(i) = change.particles.iter().find(|&&i| is_led && !truth.knows(i)) {
            let message = format!("particle {} is outside the shape: the truth does not know it", i + 1);
            return Err(scene.refuse(&format!("roles[{k}].region"), message, "narrow the region"));
        }
    }
    Ok(())
}

pub(super) fn refused(scene: &Scene, error: &FemError) -> SceneError {
    let (key, help) = match error {
        FemError::Mechanism { .. } => {
            ("roles", "clamp at least two particles of every part, or lead them by a motion of their own")
        }
        FemError::Singular { .. } => ("body.shape", "use a larger shape, or hold it in more places"),
        FemError::Unmeshable { .. } | FemError::InvertedCell { .. } => {
            ("body.shape", "keep corners, holes and supports further apart")
        }
        FemError::EmptySupport { .. } => ("roles", "move the region onto the body"),
        FemError::Lost { .. } if scene.loads.is_empty() => ("roles", "lead it less far"),
        FemError::Lost { .. } => ("loads", "load it less, or lead it there"),
        _ => ("material", "use constants, lattice and loads less far apart"),
    };
    let what = match error {
        FemError::Mechanism { .. } | FemError::Singular { .. } => "the finite elements have no equilibrium",
        _ => "the truth cannot be computed",
    };
    let why = match error {
        FemError::InvertedCell { .. } => {
            "two of its lines touch in a cusp, or nearly, where no finite element fits".into()
        }
        error => error.to_string(),
    };
    scene.refuse(key, format!("{what}: {why}"), help)
}
