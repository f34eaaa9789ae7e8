//! Runs the settings and holds them against the truth.

use std::fmt;

use serde::Serialize;

use super::alike::{Extent, extents_of_roles, held_elsewhere, require_alike};
use super::grid::{Grid, RuleChoice, Setting, body_overrides, divides, settings, solver_overrides};
use crate::continuum::equilibrium::solve_equilibrium;
use crate::continuum::layout::Layout;
use crate::continuum::plan::Plan;
use crate::continuum::run::Outcome as RunOutcome;
use crate::flock::role::Role;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::text::counted;
use crate::scene::{Scene, SceneError};
use crate::solve::stopwatch::{Stopwatch, median};
use crate::study::Load;
use crate::study::compare::reference::{Effort, Reference};
use crate::study::compare::run::{SceneReference, led_by, plan_led_by, reference_of, require_comparable};

/// The outcome of a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "kebab-case")]
pub enum Outcome {
    /// The solver reached its tolerance.
    Settled,
    /// The solver ended short of its tolerance.
    Unsettled,
    /// The scene is not to be had in this setting.
    Refused {
        /// The message that refused it.
        reason: String,
    },
}

impl Outcome {
    /// Its name, and the reason of a refusal, which is empty otherwise.
    #[cfg(feature = "export")]
    pub(crate) fn words(&self) -> (&'static str, &str) {
        match self {
            Self::Settled => ("settled", ""),
            Self::Unsettled => ("unsettled", ""),
            Self::Refused { reason } => ("refused", reason),
        }
    }
}

/// A setting with what it costs and how far it is from the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// The setting that was tried.
    #[serde(flatten)]
    pub setting: Setting,
    /// Number of particles; 0 where the body was refused.
    pub particles: usize,
    /// Relative L2 error of the followers' displacements \[1\].
    pub error: Option<f64>,
    /// From the scene to the followers at rest, median of the repeats \[s\].
    pub seconds: Option<f64>,
    /// Iterations of the solver.
    pub iterations: Option<usize>,
    /// The outcome.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// All settings of a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    /// Short name of the scene.
    pub name: String,
    /// Title of the scene.
    pub title: String,
    /// Nodes of the truth that errors are measured against.
    pub truth_nodes: usize,
    /// Time that the truth took \[s\].
    pub truth_seconds: f64,
    /// Relative L2 error that the truth states of its own displacement \[1\]; `None` where it cannot.
    pub truth_stated_error: Option<f64>,
    /// Runs of each setting, of which the median time counts.
    pub repeats: usize,
    /// Every setting with its outcome.
    pub points: Vec<Point>,
}

/// Runs a scene in every setting of the grid. `progress` is called with each before it runs.
///
/// # Errors
/// Whatever keeps the scene from having a truth; bodies that are all too large. A setting that is refused is part of the
/// study.
pub fn run(load: Load<'_>, grid: &Grid, progress: &mut dyn FnMut(&Setting)) -> Result<Study, SceneError> {
    let scene = load(&[])?;
    require_comparable(&scene)?;
    let takes = ("the study takes finer bodies", "or compare this spacing alone");
    let unlike = require_alike(&scene, &Layout::new(&scene)?, takes).err();
    let truth = match &unlike {
        None => finest_reference(load, &scene, grid)?,
        Some(_) => reference_of(&scene, &Effort::default())?,
    };
    let held = extents_of_roles(&scene, &truth.layout)?;
    let mut study = Study {
        name: scene.name.clone(),
        title: scene.raw.title.clone(),
        truth_nodes: truth.solution.nodes(),
        truth_seconds: truth.time.as_secs_f64(),
        truth_stated_error: Some(truth.solution.error().displacement).filter(|error| error.is_finite()),
        repeats: grid.repeats,
        points: Vec::new(),
    };
    let mut left_out = Vec::new();
    for rule in RuleChoice::ALL {
        for &spacing in &grid.spacings {
            let overrides = body_overrides(&scene, rule, spacing);
            let planned = match &unlike {
                Some(error) if spacing != 1.0 => Err(error.clone()),
                _ if !divides(&scene, spacing) => Err(scene.refuse(
                    "body.shape",
                    "the gaps of this grid are no multiple of so many",
                    "give another number of columns and rows",
                )),
                _ => load(&overrides).and_then(|scene| plan_alike(&scene, &held, &truth.solution)),
            };
            let particles = match planned {
                Ok(plan) if plan.count() <= grid.max_particles => plan.count(),
                Ok(plan) => {
                    left_out.push(plan.count());
                    continue;
                }
                Err(error) => {
                    let setting = Setting { rule, spacing, solver: "", tolerance: 0.0, bits: 64 };
                    study.points.push(refused(setting, 0, &error));
                    continue;
                }
            };
            for setting in settings(grid, rule, spacing, particles) {
                progress(&setting);
                let overrides: Vec<String> =
                    overrides.iter().cloned().chain(solver_overrides(&setting)).collect();
                study.points.push(measure(
                    &load(&overrides)?,
                    &truth.solution,
                    setting,
                    particles,
                    grid.repeats,
                ));
            }
        }
    }
    let is_tried = |point: &Point| !matches!(point.outcome, Outcome::Refused { .. });
    match left_out.into_iter().min() {
        Some(least) if !study.points.iter().any(is_tried) => Err(scene.refuse(
            "body",
            format!(
                "no setting is left: the smallest body has {least} particles, beyond the {} allowed",
                grid.max_particles
            ),
            "allow more (--max-particles), or give a smaller body",
        )),
        _ => Ok(study),
    }
}

/// The plan of a body that is held where the truth is.
fn plan_alike(scene: &Scene, held: &[Extent], truth: &Reference) -> Result<Plan, SceneError> {
    let layout = Layout::new(scene)?;
    let own = extents_of_roles(scene, &layout)?;
    match held_elsewhere(held, &own, scene.lattice.spacing()) {
        None => Plan::of_layout(scene, layout, Some(&led_by(truth))),
        Some((key, elsewhere)) => {
            let message = format!("another spacing makes another body, {elsewhere}");
            Err(scene.refuse(&key, message, "pick pieces of the outline"))
        }
    }
}

/// The truth of the finest body that is within bounds.
fn finest_reference(load: Load<'_>, scene: &Scene, grid: &Grid) -> Result<SceneReference, SceneError> {
    let mut spacings = grid.spacings.clone();
    spacings.sort_by(f64::total_cmp);
    let fits = |truth: &SceneReference| truth.layout.body.count() <= grid.max_particles;
    for &spacing in spacings.iter().filter(|&&spacing| spacing <= 1.0 && divides(scene, spacing)) {
        let finer = load(&body_overrides(scene, RuleChoice::Material, spacing));
        if let Some(truth) =
            finer.ok().and_then(|scene| reference_of(&scene, &Effort::default()).ok()).filter(fits)
        {
            return Ok(truth);
        }
    }
    reference_of(scene, &Effort::default())
}

fn refused(setting: Setting, particles: usize, error: &SceneError) -> Point {
    let outcome = Outcome::Refused { reason: reason(error) };
    Point { setting, particles, error: None, seconds: None, iterations: None, outcome }
}

/// The message of an error without its place, which is in an override of the study's own.
pub(super) fn reason(error: &SceneError) -> String {
    error.problems().first().map_or_else(String::new, |problem| problem.message.clone())
}

fn measure(scene: &Scene, truth: &Reference, setting: Setting, particles: usize, repeats: usize) -> Point {
    let mut seconds = Vec::new();
    let mut last = None;
    for _ in 0..repeats.max(1) {
        let start = Stopwatch::start();
        let settled = plan_led_by(scene, truth).and_then(|plan| match &scene.equilibrium {
            Some(asked) => solve_equilibrium(scene, &asked.request, plan),
            None => Err(scene.refuse("equilibrium", "no solver is set", "set one")),
        });
        seconds.push(start.elapsed().as_secs_f64());
        match settled {
            Ok(outcome) => last = Some(outcome),
            Err(error) => return refused(setting, particles, &error),
        }
    }
    let solved = last.as_ref().and_then(|outcome| outcome.solved.as_ref());
    let converged = solved.is_some_and(|solved| solved.converged);
    Point {
        setting,
        particles,
        error: last.as_ref().and_then(|outcome| error_of(outcome, truth)),
        seconds: Some(median(&mut seconds)),
        iterations: solved.map(|solved| solved.iterations),
        outcome: if converged { Outcome::Settled } else { Outcome::Unsettled },
    }
}

/// Relative L2 distance of the followers from where the truth has them; `None` where it has none of them.
pub(super) fn error_of(outcome: &RunOutcome, truth: &Reference) -> Option<f64> {
    let engine = &outcome.engine;
    let reference = &engine.body().reference;
    let followers = (0..reference.len()).filter(|&i| engine.roles()[i] == Role::Follower);
    let places: Vectors = followers.clone().map(|i| reference.get(i)).collect();
    let known = truth.displacements_at(&places).ok()?;
    let (mut off, mut size) = (0.0, 0.0);
    for (i, t) in followers.zip(known.iter()) {
        off += distance(engine.displacement(i), t).powi(2);
        size += t[0] * t[0] + t[1] * t[1];
    }
    let error = if off == 0.0 { 0.0 } else { f64::sqrt(off / size) };
    (!places.is_empty() && error.is_finite()).then_some(error)
}

/// Less than this is rounding, or luck.
const NEARER: f64 = 0.99;

impl Study {
    /// Settings that none other beats both in time and in error, the quickest first; one that is nearer by
    /// less than a hundredth of its error is not counted as nearer.
    pub fn front(&self) -> Vec<&Point> {
        let mut known: Vec<(f64, f64, &Point)> =
            self.settled().filter_map(|p| Some((p.seconds?, p.error?, p))).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut best = f64::INFINITY;
        known.retain(|&(_, error, _)| {
            let better = error < NEARER * best;
            best = if better { error } else { best };
            better
        });
        known.into_iter().map(|(_, _, point)| point).collect()
    }

    /// The quickest setting whose error is at most `error` \[1\].
    pub fn cheapest(&self, error: f64) -> Option<&Point> {
        let near = self.settled().filter(|point| point.error.is_some_and(|e| e <= error));
        let timed = near.filter_map(|point| Some((point.seconds?, point)));
        timed.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point)
    }

    fn settled(&self) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(|point| point.outcome == Outcome::Settled)
    }
}

/// Errors that the table is written for \[1\].
const ASKED: [f64; 4] = [0.3, 0.1, 0.01, 0.001];

impl fmt::Display for Study {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let runs = counted(self.repeats, "run");
        writeln!(f, "{}: {} settings, {runs} each", self.title, self.points.len())?;
        write!(f, "truth: {} nodes, {:.3} s", self.truth_nodes, self.truth_seconds)?;
        match self.truth_stated_error {
            Some(error) => writeln!(f, ", states an error of {:.1e} % of its own", 100.0 * error)?,
            None => writeln!(f)?,
        }
        for asked in ASKED {
            match self.cheapest(asked) {
                Some(point) => writeln!(
                    f,
                    "for {} % error the cheapest setting is {} ({} particles): {:.3} % in {:.2} ms",
                    100.0 * asked,
                    point.setting,
                    point.particles,
                    100.0 * point.error.unwrap_or_default(),
                    1e3 * point.seconds.unwrap_or_default()
                )?,
                None => writeln!(f, "for {} % error no setting tried is good enough", 100.0 * asked)?,
            }
        }
        let best = |rule: RuleChoice| {
            let errors = self.settled().filter(|p| p.setting.rule == rule).filter_map(|p| p.error);
            errors.fold(f64::INFINITY, f64::min)
        };
        for rule in RuleChoice::ALL {
            let best = best(rule);
            if best.is_finite() {
                writeln!(f, "the {} rule comes as near as {:.3} %", rule.name(), 100.0 * best)?;
            }
            let refused = self.points.iter().filter(|point| point.setting.rule == rule).filter_map(|point| {
                let Outcome::Refused { reason } = &point.outcome else { return None };
                Some((point.setting.spacing, reason.as_str()))
            });
            let mut reasons: Vec<(&str, Vec<f64>)> = Vec::new();
            for (spacing, reason) in refused {
                match reasons.iter_mut().find(|(known, _)| *known == reason) {
                    Some((_, spacings)) if spacings.contains(&spacing) => {}
                    Some((_, spacings)) => spacings.push(spacing),
                    None => reasons.push((reason, vec![spacing])),
                }
            }
            for (reason, spacings) in reasons {
                let spacings: Vec<String> = spacings.iter().map(f64::to_string).collect();
                let (rule, spacings) = (rule.name(), spacings.join(", "));
                writeln!(f, "the {rule} rule at {spacings} x spacing is not to be had: {reason}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(seconds: f64, error: f64) -> Point {
        let setting =
            Setting { rule: RuleChoice::Paper, spacing: 1.0, solver: "direct", tolerance: 1e-2, bits: 64 };
        let (error, seconds) = (Some(error), Some(seconds));
        Point { setting, particles: 1, error, seconds, iterations: Some(1), outcome: Outcome::Settled }
    }

    #[test]
    fn the_front_is_what_nothing_beats_in_both() {
        let mut points = vec![point(3.0, 0.1), point(1.0, 0.5), point(2.0, 0.6), point(4.0, 0.1)];
        points.push(Point { outcome: Outcome::Unsettled, ..point(0.1, 0.001) });
        let mut study = Study {
            name: String::new(),
            title: String::new(),
            truth_nodes: 1,
            truth_seconds: 0.0,
            truth_stated_error: None,
            repeats: 1,
            points,
        };
        let times: Vec<f64> = study.front().iter().filter_map(|p| p.seconds).collect();
        assert_eq!(times, [1.0, 3.0]);
        assert_eq!(study.cheapest(0.2).and_then(|p| p.seconds), Some(3.0));
        assert_eq!(study.cheapest(0.01), None);
        // Too little nearer than the quicker one to be of the front, and the one that is near enough.
        study.points.extend([point(5.0, 0.05), point(6.0, 0.0499)]);
        assert_eq!(study.front().last().and_then(|p| p.seconds), Some(5.0));
        assert_eq!(study.cheapest(0.0499).and_then(|p| p.seconds), Some(6.0));
    }
}
