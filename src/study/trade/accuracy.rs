//! The cheapest setting for an accuracy, measured against the truth of the scene's shape.
//!
//! The findings of `flockform trade`: the paper's rule ends at an error that no spacing removes, the material
//! rule's falls with the spacing. So the spacing is halved until the rule, solved as far as doubles go, is near enough
//! to the truth; then the coarsest tolerance and, where they suffice, singles are taken that leave it so. Every error is
//! that of a solved body, to which the truth's own is added: what is delivered is what was measured.

use super::alike::{extents_of_roles, held_elsewhere, require_alike};
use super::grid::{RuleChoice, body_overrides};
use super::study::{error_of, reason};
use crate::continuum::equilibrium::solve_equilibrium;
use crate::continuum::run::Outcome;
use crate::flock::role::Role;
use crate::scene::raw::RawMean;
use crate::scene::text::percent;
use crate::scene::{Scene, SceneError};
use crate::solve::equilibrium::{Precision, Request};
use crate::study::Load;
use crate::study::compare::reference::Effort;
use crate::study::compare::run::{SceneReference, plan_led_by, reference_of, require_comparable};

/// Halvings tried before giving up.
const MOST_HALVINGS: u32 = 5;

/// Bodies of more particles are not tried.
const MOST_PARTICLES: usize = 400_000;

/// Residual over load beyond which nothing of a solver's own error is left to see.
const TIGHT: f64 = 1e-9;

/// Of the accuracy, how much the truth's own error may use up.
const OF_TRUTH: f64 = 0.05;

const FINER: &str = "the accuracy takes a finer body";
const OR: &str = "write a smaller spacing, or ask for less";

/// A scene in the setting that was chosen.
#[derive(Debug)]
pub struct Chosen {
    /// The scene, refined and with its solver set.
    pub scene: Scene,
    /// The choice in words.
    pub words: String,
    /// The error that it was chosen for, relative L2 of the displacements, the truth's own included \[1\]; `None` where
    /// nothing was measured.
    pub estimate: Option<f64>,
}

/// Chooses the widest spacing, the written one at most, at which the scene's followers are as near to
/// elasticity as its accuracy asks; a scene without an accuracy is returned as it is. `load` loads `scene`
/// with more overrides.
///
/// # Errors
/// Names what keeps the scene from being refined or held against a truth, or how near it came.
pub fn choose(scene: Scene, load: Load<'_>) -> Result<Chosen, SceneError> {
    let Some(accuracy) = scene.equilibrium.and_then(|asked| asked.accuracy) else {
        return Ok(Chosen { scene, words: String::new(), estimate: None });
    };
    if !matches!(scene.raw.rule.mean, Some(RawMean::Material { .. })) {
        let words = format!("accuracy {}: the paper's rule at the written spacing\n", percent(accuracy));
        return Ok(Chosen { scene, words, estimate: None });
    }
    require_comparable(&scene)?;
    let mut nearest = f64::INFINITY;
    let (mut particles, mut written) = (0, None);
    for halvings in 0..=MOST_HALVINGS {
        let part = 0.5f64.powi(halvings as i32);
        // Half the spacing is four times as many.
        if 4 * particles > MOST_PARTICLES {
            break;
        }
        let body = Body::new(&scene, load, part, accuracy)?;
        let extents = extents_of_roles(&body.scene, &body.truth.layout)?;
        let written = written.get_or_insert_with(|| extents.clone());
        if let Some((key, held)) = held_elsewhere(written, &extents, body.scene.lattice.spacing()) {
            let help = format!("pick pieces of the outline, {OR}");
            return Err(scene.refuse(&key, format!("{FINER}, {held}"), help));
        }
        let solved =
            body.solve(&[format!("equilibrium.tolerance={TIGHT:e}"), DOUBLES.into(), ANY_SOLVER.into()])?;
        particles = solved.particles;
        nearest = solved.error;
        if nearest <= accuracy {
            return body.cheapest(accuracy, solved.error);
        }
        require_alike(&scene, &body.truth.layout, (FINER, OR))?;
        if !scene.record.probes.is_empty() {
            let message = format!("{FINER}, in which these ids are other particles");
            return Err(scene.refuse("record.probes", message, format!("record.places instead, {OR}")));
        }
    }
    let message = format!(
        "the error is still {:.2} % at {particles} particles, after {MOST_HALVINGS} halvings of the spacing or as many as \
         {MOST_PARTICLES} particles allow",
        100.0 * nearest
    );
    let help = "ask for less, write a smaller spacing, or leave the accuracy out and set the tolerance";
    Err(scene.refuse("equilibrium.accuracy", message, help))
}

const ANY_SOLVER: &str = "equilibrium.solver=\"auto\"";
const DOUBLES: &str = "equilibrium.precision=\"f64\"";

/// The scene at one spacing.
struct Body<'a> {
    load: Load<'a>,
    overrides: Vec<String>,
    part: f64,
    /// As the scene's accuracy has it.
    asked: Request,
    /// Whether the scene leaves them open.
    is_open: [bool; 2],
    scene: Scene,
    truth: SceneReference,
}

/// A body at rest: how far it is from the truth, the truth's own error included \[1\].
struct Solved {
    scene: Scene,
    error: f64,
    converged: bool,
    particles: usize,
}

impl<'a> Body<'a> {
    fn new(scene: &Scene, load: Load<'a>, part: f64, accuracy: f64) -> Result<Self, SceneError> {
        let overrides = body_overrides(scene, RuleChoice::Material, part);
        let scene = load(&overrides)?;
        let effort = Effort { target: (OF_TRUTH * accuracy).min(1e-3), ..Effort::default() };
        let truth = reference_of(&scene, &effort)?;
        let own = truth.solution.error().displacement;
        if own > 0.5 * accuracy {
            let message = format!(
                "the truth itself is not known so well: on {} nodes the truth states an error of {:.1e} % of its own, and where \
                 single points hold or push a body it always will",
                truth.solution.nodes(),
                100.0 * own
            );
            let help = "hold and push edges instead of points, or ask for less";
            return Err(scene.refuse("equilibrium.accuracy", message, help));
        }
        let asked = scene.equilibrium.map(|asked| asked.request).unwrap_or_default();
        let raw = scene.raw.equilibrium.as_ref();
        let is_open =
            [raw.is_none_or(|raw| raw.tolerance.is_none()), raw.is_none_or(|raw| raw.precision.is_none())];
        Ok(Self { load, overrides, part, asked, is_open, scene, truth })
    }

    /// Solves for this body with more overrides.
    fn solve(&self, more: &[String]) -> Result<Solved, SceneError> {
        let scene = (self.load)(&[&self.overrides, more].concat())?;
        let request = scene.equilibrium.map(|asked| asked.request).unwrap_or_default();
        let outcome: Outcome =
            solve_equilibrium(&scene, &request, plan_led_by(&scene, &self.truth.solution)?)?;
        let own = self.truth.solution.error().displacement;
        let follows = outcome.engine.roles().contains(&Role::Follower);
        let error = match error_of(&outcome, &self.truth.solution) {
            Some(error) => error + own,
            // Without followers there is nothing to be wrong; else some are where the truth is not.
            None if follows => f64::INFINITY,
            None => 0.0,
        };
        let converged = outcome.solved.as_ref().is_some_and(|solved| solved.converged);
        Ok(Solved { scene, error, converged, particles: outcome.engine.body().count() })
    }

    /// The coarsest tolerance and precision that keep the accuracy and are reached.
    fn cheapest(&self, accuracy: f64, best: f64) -> Result<Chosen, SceneError> {
        let mut last = String::new();
        for more in self.solver_settings() {
            // Singles may fail where doubles do not.
            let solved = match self.solve(&more) {
                Ok(solved) => solved,
                Err(error) => {
                    last = reason(&error);
                    continue;
                }
            };
            if solved.converged && solved.error <= accuracy {
                let words = words(&solved, accuracy, self.part);
                return Ok(Chosen { scene: solved.scene, words, estimate: Some(solved.error) });
            }
            last = match solved.converged {
                true => format!("the last one tried leaves {:.2} %", 100.0 * solved.error),
                false => "the last one tried ends short of its tolerance".into(),
            };
        }
        let message = format!(
            "the spacing is fine enough ({:.2} %), but no tolerance and precision that the solver reaches keep it so: {last}",
            100.0 * best
        );
        let help = "choose another solver, or leave solver, tolerance and precision out";
        Err(self.scene.refuse("equilibrium.accuracy", message, help))
    }

    /// Tolerances and precisions as overrides, the cheapest first; what the scene writes stays.
    fn solver_settings(&self) -> Vec<Vec<String>> {
        let [tolerance_is_open, precision_is_open] = self.is_open;
        let doubles: Vec<String> = if precision_is_open { vec![DOUBLES.into()] } else { Vec::new() };
        let mut settings = Vec::new();
        if self.asked.precision == Precision::F32 || !precision_is_open {
            settings.push(Vec::new());
        }
        if precision_is_open {
            settings.push(doubles.clone());
        }
        if tolerance_is_open {
            let tighter = |factor: f64| {
                format!("equilibrium.tolerance={:e}", (factor * self.asked.tolerance).max(TIGHT))
            };
            settings.extend([1e-2, 1e-4].map(|factor| [&doubles[..], &[tighter(factor)]].concat()));
        }
        settings
    }
}

fn words(solved: &Solved, accuracy: f64, part: f64) -> String {
    let spacing = match part {
        1.0 => "the written spacing".to_owned(),
        _ => format!("{part} of the written spacing"),
    };
    let request = solved.scene.equilibrium.map(|asked| asked.request).unwrap_or_default();
    format!(
        "accuracy {}: material rule at {spacing} (error {:.3} % against finite elements on the shape), tolerance {:e}, {:?}\n",
        percent(accuracy),
        100.0 * solved.error,
        request.tolerance,
        request.precision
    )
}
