//! Numbers and shapes as bad as they come: each ends in a right answer or in a refusal that says why.
//!
//! Every case is held against something known: the same body in ordinary numbers, an affine field that every
//! rule here must reproduce (the patch test), a solution on paper, the direct solver. What a case is run
//! on, and within what error it counts as right, is part of it.

mod bodies;
mod materials;
mod numbers;
mod units;

use std::fmt;
use std::ops::ControlFlow;

use serde::Serialize;

use crate::continuum::equilibrium::run_to_equilibrium;
use crate::continuum::layout::Layout;
use crate::continuum::plan::Plan;
use crate::continuum::run::StopReason;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::{LeaderMotion, Scene, SceneError};
use crate::study::Load;

/// The outcome of an extreme.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "kebab-case")]
pub enum Outcome {
    /// The answer is known, and this one is off by `error`, no more than `within` \[1\].
    Right {
        /// By how much, relative to what `check` names.
        error: f64,
        /// Greatest error that counts as right.
        within: f64,
        /// The reference of the answer, in words.
        check: String,
    },
    /// The program said that it could not, and why.
    Refused {
        /// The first problem that it named.
        message: String,
    },
    /// It said nothing, and was off.
    Wrong {
        /// By how much, relative to what `check` names; none where the answer is not a number.
        error: Option<f64>,
        /// Greatest error that counts as right.
        within: f64,
        /// The reference of the answer, in words.
        check: String,
    },
}

impl Outcome {
    /// Right if `error` is within what is stated; an error that is not a number never is.
    pub(crate) fn judged(error: f64, within: f64, check: impl Into<String>) -> Self {
        let check = check.into();
        if error <= within {
            Outcome::Right { error, within, check }
        } else {
            Outcome::Wrong { error: error.is_finite().then_some(error), within, check }
        }
    }

    fn refused(error: &SceneError) -> Self {
        let first = error.problems().first();
        let key = |key: &str| if key.is_empty() { String::new() } else { format!("{key}: ") };
        let message = first.map_or_else(String::new, |p| format!("{}{}", key(&p.key), p.message));
        Outcome::Refused { message }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Outcome::Right { error, within, check } => {
                write!(f, "right: {error:.1e} off, within {within:.0e} ({check})")
            }
            Outcome::Refused { message } => write!(f, "refused: {message}"),
            Outcome::Wrong { error, within, check } => {
                let off = error.map_or("not a number".into(), |error| format!("{error:.1e} off"));
                write!(f, "WRONG: {off}, not within {within:.0e} ({check})")
            }
        }
    }
}

/// One extreme.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Case {
    /// The extreme, in words.
    pub name: String,
    /// The body of the case.
    pub body: String,
    /// The outcome.
    #[serde(flatten)]
    pub outcome: Outcome,
}

impl Case {
    fn new(name: impl Into<String>, body: &str, outcome: Result<Outcome, SceneError>) -> Self {
        let outcome = outcome.unwrap_or_else(|error| Outcome::refused(&error));
        Self { name: name.into(), body: body.to_owned(), outcome }
    }
}

const THE_SCENE: &str = "the scene";
const OWN: &str = "a small body of its own";

/// Runs all extremes: of the scene where it has them, otherwise of small bodies made for the purpose.
pub fn run(load: Load<'_>, scene: &Scene, progress: &mut dyn FnMut(&str)) -> Vec<Case> {
    let mut all = Vec::new();
    progress("extremes of the unit of length");
    all.extend(units::cases(load, scene));
    progress("extremes of the body");
    all.extend(bodies::cases(scene));
    progress("extremes of the material");
    all.extend(materials::cases(scene));
    progress("extremes of loads and precision");
    all.extend(numbers::cases());
    all
}

/// The plan of a scene; leaders that finite elements would lead are led by a strain of the body.
///
/// # Errors
/// As [`Plan::new`].
pub fn plan(scene: &Scene) -> Result<Plan, SceneError> {
    let strained = |places: &Vectors| places.iter().map(|[x, y]| [0.01 * x, -0.003 * y]).collect();
    Plan::of_layout(scene, Layout::new(scene)?, Some(&strained))
}

/// A body at the end of its scene.
struct End {
    reference: Vectors,
    present: Vectors,
    spacing: f64,
    /// The error that the solver states where rounding keeps it from its tolerance \[1\].
    known_to: f64,
}

impl End {
    /// # Errors
    /// Refused scenes, and runs that report themselves that they have not ended.
    fn of(scene: &Scene) -> Result<Self, SceneError> {
        let plan = plan(scene)?;
        let spacing = plan.setup.body.lattice.spacing();
        let outcome = run_to_equilibrium(scene, plan, &mut |_, _| ControlFlow::Continue(()))?;
        match outcome.reason {
            StopReason::Diverged(divergence) => {
                return Err(scene.refuse("", divergence.to_string(), ""));
            }
            StopReason::Unsettled => {
                let left = outcome.solved.and_then(|s| s.residuals.last().copied()).unwrap_or(f64::NAN);
                let message =
                    format!("the solver ended short of its tolerance, {left:.1e} of the load being left");
                return Err(scene.refuse("equilibrium", message, ""));
            }
            _ => {}
        }
        let engine = &outcome.engine;
        Ok(Self {
            reference: Vectors::clone(&engine.body().reference),
            present: engine.present().clone(),
            spacing,
            known_to: outcome.solved.as_ref().and_then(|solved| solved.known_to).unwrap_or(0.0),
        })
    }

    /// Displacement of a particle over `unit` \[1\].
    fn moved(&self, i: usize, unit: f64) -> [f64; 2] {
        [(self.present.x[i] - self.reference.x[i]) / unit, (self.present.y[i] - self.reference.y[i]) / unit]
    }

    /// Largest displacement over the spacing, or 1 where that is less.
    fn size(&self) -> f64 {
        let moved = |i| distance(self.moved(i, self.spacing), [0.0; 2]);
        (0..self.reference.len()).map(moved).fold(1.0, f64::max)
    }

    /// How far the body is from another, `factor` times as large, over its own displacements. Infinite where they differ in
    /// number, not a number where one is lost.
    fn apart_from(&self, other: &Self, factor: f64) -> f64 {
        if self.reference.len() != other.reference.len() {
            return f64::INFINITY;
        }
        let size = self.size();
        let apart = |i| {
            let ([ax, ay], [bx, by]) = (self.moved(i, self.spacing), other.moved(i, other.spacing));
            // The spacing itself may be off.
            let spacing = other.spacing / self.spacing / factor;
            distance([ax, ay], [bx * spacing, by * spacing]) / size
        };
        worst((0..self.reference.len()).map(apart))
    }

    /// How far the body is from where the motion of the scene's first leaders would have all of it, over the
    /// displacements.
    fn apart_from_motion(&self, scene: &Scene) -> f64 {
        let Some(Some(LeaderMotion::Program(motion))) = scene.roles.first().map(|role| &role.motion) else {
            return f64::NAN;
        };
        let size = self.size();
        let apart = |i| {
            let base = self.reference.get(i);
            let expected = motion.displacement(scene.stop.steps as f64, 0, base).map(|d| d / self.spacing);
            distance(self.moved(i, self.spacing), expected) / size
        };
        worst((0..self.reference.len()).map(apart))
    }
}

/// The largest, or not a number where one is not.
fn worst(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(
        0.0,
        |worst: f64, error| if worst.is_nan() || error.is_nan() { f64::NAN } else { worst.max(error) },
    )
}

/// A small body whose whole outline is led by a strain.
const SMALL: &str = r#"
title = "A small body led by its outline"
lattice = { kind = "square", spacing = 1.0 }
body = { shape = { kind = "grid", columns = 9, rows = 8 } }

[[roles]]
region = { kind = "boundary" }
role = "leader"
motion = { kind = "affine", stretch = [1.01, 0.995], shear = [0.004, 0.002], steps = 1 }

[stop]
steps = 1
"#;

/// The material of a small body unless the scene gives one.
const SHEET: &str = r#"material={kind="isotropic",young=1000.0,poisson=0.3}"#;
const MATERIAL: &str = r#"rule.mean={kind="material"}"#;
const AT_REST: &str = "equilibrium={solver=\"auto\",tolerance=1e-11}";

fn small(overrides: &[impl ToString]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
    Scene::parse("small-body", "the small body of flockform stability", SMALL, &overrides, None)
}

/// The patch test on a small body.
fn patch(overrides: &[&str], within: f64) -> Result<Outcome, SceneError> {
    let scene = small(overrides)?;
    let end = End::of(&scene)?;
    Ok(Outcome::judged(
        end.apart_from_motion(&scene),
        within,
        "patch test: every particle follows the strain of the outline",
    ))
}
