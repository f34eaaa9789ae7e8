//! The body of a scene, held where it is held and pushed by nothing, under settings of its update.

use serde::Serialize;

use crate::continuum::layout::Layout;
use crate::continuum::plan::Plan;
use crate::engine::Engine;
use crate::engine::setup::Setup;
use crate::flock::law::Weights;
use crate::flock::role::Role;
use crate::flock::rules::{Feedback, FeedbackReference};
use crate::flock::vectors::Vectors;
use crate::scene::{Scene, SceneError};
use crate::solve::spectrum::LinearSweep;
use crate::sweep::Order;

named! {
    /// The parameter that is varied.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Parameter {
        /// The feedback factor `fd` of Eq. 4.
        Feedback => "feedback factor",
        /// The damping of the update.
        Damping => "damping",
    }
}

/// A linear body at rest.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Particles that do not follow are clamped, roles do not change, and there are no loads.
    plan: Plan,
}

/// Sweeps in which an eigenvalue has to be found.
const MOST_SWEEPS: usize = 200_000;

impl Subject {
    /// The body with the roles that hold at the end of the scene, its leaders held.
    ///
    /// # Errors
    /// Names what makes the rule nonlinear, what changes it on the way, and a follower that no leader holds.
    pub fn of(scene: &Scene) -> Result<Self, SceneError> {
        // The places that the truth gives its leaders do not matter: they are held at rest.
        let at_rest = |places: &Vectors| vec![[0.0; 2]; places.len()];
        let mut plan = Plan::of_layout(scene, Layout::new(scene)?, Some(&at_rest))?;
        require_linear(scene, &plan)?;
        let mut changes = std::mem::take(&mut plan.setup.changes);
        changes.sort_by_key(|change| change.from);
        // Single components are held by the rule's weights, and their particles follow.
        for change in changes.iter().filter(|change| change.when.is_none() && change.axis.is_none()) {
            change.particles.iter().for_each(|&i| plan.setup.roles[i] = change.role);
        }
        for role in plan.setup.roles.iter_mut().filter(|role| **role == Role::Leader) {
            *role = Role::Clamped;
        }
        plan.setup.flock.forces = None;
        // Runs are watched from here: neither a limit nor a tolerance ends them.
        plan.stop.tolerance = None;
        let subject = Self { plan };
        subject.require_held(scene)?;
        Ok(subject)
    }

    /// The feedback factor or the damping as the scene has it.
    pub fn present(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Feedback => self.plan.setup.flock.rule.feedback.map_or(0.0, |f| f.factor),
            Parameter::Damping => self.plan.setup.update.damping,
        }
    }

    /// The meaning of `MT` of Eq. 4, for feedback that is added as well.
    pub(crate) fn feedback_reference(&self) -> FeedbackReference {
        self.plan.setup.flock.rule.feedback.map_or(FeedbackReference::Initial, |f| f.reference)
    }

    /// The order of updates within a step.
    pub fn order(&self) -> Order {
        self.plan.setup.update.order
    }

    /// Number of particles, those of the frame included.
    pub fn particles(&self) -> usize {
        self.plan.count()
    }

    /// Number of particles that follow.
    pub fn followers(&self) -> usize {
        self.plan.setup.roles.iter().filter(|&&role| role == Role::Follower).count()
    }

    /// Whether frame points remember the step before, so that the sweep is more than one matrix.
    pub(crate) fn has_memory(&self) -> bool {
        self.plan.setup.body.frame.as_ref().is_some_and(|frame| frame.rule.looks_before_the_sweep())
    }

    /// The same body with a parameter set.
    pub fn with(&self, parameter: Parameter, value: f64) -> Self {
        let mut plan = self.plan.clone();
        match parameter {
            Parameter::Feedback => {
                let reference = self.feedback_reference();
                let feedback = Feedback { factor: value, reference };
                plan.setup.flock.rule.feedback = (value != 0.0).then_some(feedback);
            }
            Parameter::Damping => plan.setup.update.damping = value,
        }
        Self { plan }
    }

    /// The body in an engine, at rest.
    pub fn engine(&self) -> Engine {
        Engine::new(self.plan.setup.clone())
    }

    /// Distance of neighbours \[length\].
    pub fn spacing(&self) -> f64 {
        self.plan.setup.body.lattice.spacing()
    }

    /// Its sweep on displacements.
    pub fn sweep(&self) -> LinearSweep<'_> {
        let (engine, frame) = (self.engine(), self.plan.setup.body.frame.as_ref());
        LinearSweep::new(engine.flock(), frame, engine.roles(), engine.update(), MOST_SWEEPS)
            .expect("linear, with followers")
    }

    /// Refuses followers in a part of the body without leaders and clamps: nothing brings them back to rest.
    fn require_held(&self, scene: &Scene) -> Result<(), SceneError> {
        let Setup { body, flock, roles, .. } = &self.plan.setup;
        let labels = body.components(&flock.neighbours);
        let mut held = vec![false; labels.len()];
        let by_weights = |i: usize| match &flock.weights {
            Weights::Matrix(weights) => weights.held(i).contains(&true),
            _ => false,
        };
        for i in (0..labels.len()).filter(|&i| roles[i] == Role::Clamped || by_weights(i)) {
            held[labels[i] as usize] = true;
        }
        let follower = |&i: &usize| roles[i] == Role::Follower;
        let help = "clamp or lead some of every part, and leave some to follow";
        match (0..labels.len()).filter(follower).find(|&i| !held[labels[i] as usize]) {
            Some(i) => {
                let message = format!(
                    "particle {} follows in a part of the body that has no leader and no clamp: nothing brings it \
                     back to rest, and every damping and feedback is marginal",
                    body.id(i)
                );
                Err(scene.refuse("roles", message, help))
            }
            None if self.followers() == 0 => Err(scene.refuse(
                "roles",
                "the body has no followers, and so no sweep that could be stable",
                help,
            )),
            None => Ok(()),
        }
    }
}

fn require_linear(scene: &Scene, plan: &Plan) -> Result<(), SceneError> {
    if !scene.actions.is_empty() {
        let message = "a body that is changed on its way has no one sweep, and so no one threshold";
        return Err(scene.refuse("actions", message, "leave actions out, and set their keys from the start"));
    }
    let (key, reason) = match scene.mean {
        mean if !mean.is_affine() => ("rule.mean", &*format!("targets by the {mean}")),
        _ if plan.setup.present_radius.is_some() => ("neighbours", "neighbours found anew at every step"),
        _ if scene.fracture.is_some_and(|fracture| fracture.threshold.is_some()) => {
            ("fracture", "bonds that break")
        }
        _ => return Ok(()),
    };
    let message = format!(
        "{reason} make the rule nonlinear: its sweep is no matrix, so it has no spectrum and no one threshold"
    );
    Err(scene.refuse(
        key,
        message,
        "ask about a linear rule: rule.mean.kind = \"barycentre\" or \"material\"",
    ))
}
