//! The loop around the engine: until equilibrium, the last step, an interrupt or divergence.

use std::ops::ControlFlow;

use super::bulk_response::FALLS_TOO_FAST;
use super::plan::Plan;
use crate::engine::Engine;
use crate::engine::movement::Movement;
use crate::engine::observer::{EachStep, Observer};
use crate::engine::several::StepBatch;
use crate::engine::shared::Agreed;
use crate::engine::state::{EngineState, WrongState};
use crate::flock::fracture::Ghosts;
use crate::flock::law::Weights;
use crate::flock::role::Role;
use crate::flock::rules::{Axis, FeedbackReference, Mean};
use crate::geometry::point::{dot, minus, plus};
use crate::ranks::Team;
use crate::scene::text::number;
use crate::scene::{SceneError, Stop};
use crate::solve::equilibrium::Solved;
use crate::sweep::Order;

/// Why a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum StopReason {
    /// Nothing moved farther in a step than the tolerance, or the solver reached its own, or what rounding allows.
    Equilibrium,
    /// The solver ended short of its tolerance.
    Unsettled,
    /// There is no equilibrium, or none that was found, for the next part of the load: why.
    Stuck(String),
    /// The scene's number of steps was reached.
    Steps,
    /// An observer broke the run off.
    Interrupted,
    /// A particle left the range of numbers, or went farther than the scene allows.
    Diverged(Divergence),
}

impl StopReason {
    /// The name of [`StopReason::Diverged`] in reports.
    pub const DIVERGED: &'static str = "diverged";

    /// The name in reports.
    pub fn name(&self) -> &'static str {
        match self {
            StopReason::Equilibrium => "equilibrium",
            StopReason::Unsettled => "unsettled",
            StopReason::Stuck(_) => "stuck",
            StopReason::Steps => "steps",
            StopReason::Interrupted => "interrupted",
            StopReason::Diverged(_) => Self::DIVERGED,
        }
    }

    /// Whether the run came to rest, or made all of its steps.
    pub fn is_good(&self) -> bool {
        matches!(self, StopReason::Equilibrium | StopReason::Steps)
    }

    /// What kept a stuck or diverged body from its end.
    pub fn fault(&self) -> Option<String> {
        match self {
            StopReason::Stuck(why) => Some(why.clone()),
            StopReason::Diverged(divergence) => Some(divergence.to_string()),
            _ => None,
        }
    }
}

/// The end of a sentence on the run.
impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            StopReason::Equilibrium => f.write_str("in equilibrium"),
            StopReason::Unsettled => f.write_str("the solver ended short of its tolerance"),
            StopReason::Stuck(why) => write!(f, "not {why}"),
            StopReason::Steps => f.write_str("all steps done"),
            StopReason::Interrupted => f.write_str("interrupted"),
            StopReason::Diverged(divergence) => divergence.fmt(f),
        }
    }
}

/// A body that ceased to be one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("diverged at step {step}: particle {particle} {what}; likely cause: {likely_cause}")]
pub struct Divergence {
    /// Step at which it was seen; the engine holds the state before it.
    pub step: usize,
    /// Id of the particle.
    pub particle: usize,
    /// The particle's fault, to follow its id in a sentence.
    pub what: String,
    /// The usual cause with such a rule.
    pub likely_cause: String,
}

/// How a run ended, with the engine in its last good state.
#[derive(Debug)]
pub struct Outcome {
    /// The engine in its last good state.
    pub engine: Engine,
    /// Why it ended.
    pub reason: StopReason,
    /// Largest one-step motion over the spacing, at the last step.
    pub residual: f64,
    /// How the equilibrium was found, unless it was stepped to.
    pub solved: Option<Solved>,
}

/// Steps a plan to its end, also that of a scene which asks for `[equilibrium]`: straight to that goes
/// [`run_to_equilibrium`](super::equilibrium::run_to_equilibrium), which any scene can be run by. `see` sees the engine before the
/// first step (with an infinite residual) and after each one, with the residual; it can break the run off.
pub fn run(plan: Plan, see: &mut dyn FnMut(&Engine, f64) -> ControlFlow<()>) -> Outcome {
    run_watched(plan, &mut EachStep(see))
}

/// Runs a plan to its end, seen at those steps alone that the observer names. The results are the same to the bit.
pub fn run_watched(plan: Plan, observer: &mut dyn Observer) -> Outcome {
    run_shared(plan, None, None::<&Team>, observer).expect("neither shared nor resumed")
}

/// Runs a plan, or goes on with it from a state and the residual that was seen with it, to the same end bit by bit; where
/// there is a `team`, shared with the other ranks, which all must have the same plan. The results are those of a run
/// alone, to the bit, on every rank. The first rank's `observer` names the steps that are looked at; at these every rank's
/// sees the whole body, and any of them can break the run off. The state that is gone on from is not seen again.
///
/// # Errors
/// A state of another body.
pub fn run_shared<'t>(
    plan: Plan,
    from: Option<(EngineState<'_>, f64)>,
    team: impl Into<Option<&'t Team>>,
    observer: &mut dyn Observer,
) -> Result<Outcome, SharedError> {
    let bounds = Bounds::of(&plan);
    let (mut engine, residual) = match from {
        Some((state, residual)) => (state.engine(plan.setup)?, Some(residual)),
        None => (Engine::new(plan.setup), None),
    };
    let mut agreed;
    let observer: &mut dyn Observer = match team.into() {
        None => observer,
        Some(team) => {
            engine.join(team.clone());
            agreed = Agreed { team, own: observer };
            &mut agreed
        }
    };
    let begin = match residual {
        Some(residual) => (residual, false),
        None => (f64::INFINITY, observer.see(&engine, f64::INFINITY).is_break()),
    };
    Ok(run_loop(engine, begin, &bounds, observer))
}

/// The reason why a run cannot go on, or not to its equilibrium.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SharedError {
    /// The state that it was to go on from.
    #[error("{0}")]
    State(#[from] WrongState),
    /// The equilibrium that the scene asks for.
    #[error("{0}")]
    Scene(#[from] SceneError),
}

/// Displacement beyond which sums of squares, which energies are, overflow \[length\].
const FARTHEST: f64 = 1e153;

/// The conditions that end a run.
#[derive(Clone, Debug)]
pub(crate) struct Bounds {
    stop: Stop,
    /// Largest displacement over the spacing, as the movement is.
    divergence_ratio: f64,
}

impl Bounds {
    pub(crate) fn of(plan: &Plan) -> Self {
        let allowed = f64::min(plan.stop.divergence_ratio * plan.diagonal, FARTHEST);
        let divergence_ratio = allowed / plan.setup.body.lattice.spacing();
        Self { stop: plan.stop, divergence_ratio }
    }

    /// The divergence that the last step was, if it was one.
    #[cfg(feature = "live")]
    pub(crate) fn divergence(&self, engine: &Engine) -> Option<Divergence> {
        divergence(engine, &engine.movement(), self.divergence_ratio)
    }
}

fn run_loop(
    mut engine: Engine,
    (mut residual, mut interrupted): (f64, bool),
    Bounds { stop, divergence_ratio }: &Bounds,
    observer: &mut dyn Observer,
) -> Outcome {
    let mut batch = StepBatch::new(&engine, stop.tolerance, *divergence_ratio);
    let settled = |residual: f64, engine: &Engine| {
        stop.tolerance.is_some_and(|tolerance| residual <= tolerance) && !engine.is_scheduled()
    };
    let mut look = engine.step();
    let reason = loop {
        if settled(residual, &engine) {
            break StopReason::Equilibrium;
        }
        if interrupted {
            break StopReason::Interrupted;
        }
        if engine.step() >= stop.steps {
            break StopReason::Steps;
        }
        // Asked anew only once it is reached: a batch may end before it.
        if look <= engine.step() {
            look = observer.next(engine.step()).clamp(engine.step() + 1, stop.steps);
        }
        let movement = batch.advance(&mut engine, look);
        if !(movement.is_finite && movement.largest_displacement <= *divergence_ratio) {
            engine.gather();
        }
        if let Some(divergence) = divergence(&engine, &movement, *divergence_ratio) {
            batch.undo(&mut engine);
            break StopReason::Diverged(divergence);
        }
        residual = movement.largest_move;
        if engine.step() == look || settled(residual, &engine) {
            engine.gather();
            interrupted = observer.see(&engine, residual).is_break();
        }
    };
    engine.gather();
    Outcome { engine, reason, residual, solved: None }
}

/// The divergence of a body that was put where its energies overflow; `None` for any other.
pub fn overflow(engine: &Engine) -> Option<Divergence> {
    divergence(engine, &engine.movement(), FARTHEST / engine.body().lattice.spacing())
}

fn divergence(engine: &Engine, movement: &Movement, bound: f64) -> Option<Divergence> {
    let (mut raise, mut too_far) = ("", "so far that energies overflow");
    let (particle, what) = if let Some(lost) = (!movement.is_finite).then(|| engine.first_lost()).flatten() {
        (lost, "has no finite position any more".to_owned())
    } else if movement.largest_displacement > bound {
        let (far, apart) = engine.farthest();
        if apart <= FARTHEST {
            (raise, too_far) = (", or raise stop.divergence_ratio", "more than stop.divergence_ratio allows");
        }
        (far, format!("is {apart:.3e} from its reference place, {too_far}"))
    } else {
        return None;
    };
    // A body that is put to rest at once has not moved, and a leader goes by no rule.
    let leads = |i: usize| engine.roles()[i] == Role::Leader && engine.body().id(i) == particle;
    let is_led = engine.count_of_parts(engine.body().owned().filter(|&i| leads(i)).count()) > 0;
    let is_swept = (movement.largest_move > 0.0 || !movement.is_finite) && !is_led;
    let likely_cause = is_swept.then(|| cause_in_sweep(engine)).flatten().unwrap_or_else(|| {
        let cause = match engine.whole_load() {
            Some(_) => "the loads move the body that far; check them and the stiffness of the material",
            None => "a leader leaves the body behind; check the leaders' motions",
        };
        format!("{cause}{raise}")
    });
    Some(Divergence { step: engine.step(), particle, what, likely_cause })
}

/// The likeliest reason for a sweep to grow, from what the rule contains; `None` where the sweep is stable.
fn cause_in_sweep(engine: &Engine) -> Option<String> {
    let rule = engine.flock().rule;
    let damping = engine.update().damping;
    let ghosts = engine.flock().bonds.as_ref().map(|bonds| bonds.ghosts);
    if ghosts == Some(Ghosts::Mirrored) && matches!(rule.mean, Mean::Power { .. }) {
        return Some(format!(
            "mirror images move with their particle, away from the {} of neighbour and image; use fracture.ghosts = \"lattice\"",
            rule.mean
        ));
    }
    let overshoot = rule.feedback.map(|f| (f.factor, f.reference));
    if let Some((factor, FeedbackReference::Initial)) =
        overshoot.filter(|(factor, _)| !(-2.0..=0.0).contains(factor))
    {
        let is_framed = engine.roles()[engine.body().owned()].contains(&Role::Frame);
        // Frame points copy displacements and take no feedback.
        let limit = match engine.count_of_parts(usize::from(is_framed)) > 0 {
            true => "makes the sweep grow (`flockform stability` finds the limit)",
            false => "makes the sweep grow once |1 + factor| times its spectral radius exceeds 1",
        };
        return Some(format!("feedback factor {factor} {limit}; bring the factor closer to 0"));
    }
    if let Some((factor, FeedbackReference::Previous)) =
        overshoot.filter(|(factor, _)| !(-1.0..=0.0).contains(factor))
    {
        return Some(format!(
            "over-relaxation by 1 + {factor} in a synchronous update; bring the factor between -1 and 0"
        ));
    }
    if damping > 1.0 {
        return Some(format!("damping = {damping} overshoots every target; use at most 1"));
    }
    if let Some(poisson) = rule.poisson.filter(|poisson| poisson.k != 0.0) {
        let (low, high) = engine.body().bounds();
        let (across, name) = match poisson.axis {
            Axis::X => (1, "y"),
            Axis::Y => (0, "x"),
        };
        if !(low[across]..=high[across]).contains(&poisson.centre) {
            return Some(format!(
                "the Poisson term grows with the distance from its centre, {name} = {}, which lies outside the body; leave \
                 rule.poisson.centre out",
                number(poisson.centre)
            ));
        }
        return Some(format!("the Poisson term adds K = {} at every step; use a smaller K", poisson.k));
    }
    let is_synchronous = engine.update().order == Order::Synchronous;
    if matches!(rule.mean, Mean::Material { .. }) {
        return (is_synchronous && overshoots(engine)).then(|| {
            format!(
                "a material swept synchronously with damping = {damping:.3} lets its shortest waves grow; use a smaller \
                 update.damping, or update.order = \"sequential\""
            )
        });
    }
    if matches!(rule.mean, Mean::Distance { power } if power < FALLS_TOO_FAST) {
        return Some("weights that fall with the distance draw each particle to its nearest neighbour; use a rule.mean.power above -1".into());
    }
    if matches!(rule.mean, Mean::Distance { .. })
        && is_synchronous
        && damping > rule.mean.settling_damping()
        && rule.mean.overshoots()
    {
        return Some("weights that grow with distance let the shortest waves of a synchronous update grow; use update.order = \"sequential\" or a smaller update.damping (`flockform material` computes the limit)".into());
    }
    let are_of_both_signs = matches!(&engine.flock().weights, Weights::Scalar(weights) if weights.iter().any(|weight| *weight < 0.0));
    let are_of_both_signs = engine.count_of_parts(usize::from(are_of_both_signs)) > 0;
    are_of_both_signs.then(|| {
        let remedy = match is_synchronous && overshoots(engine) {
            true => "use a smaller update.damping, or update.order = \"sequential\"",
            false => "give weights that are not negative",
        };
        format!("weights of both signs; {remedy}")
    })
}

/// Why a sweep grows that has not diverged yet: its moves are each farther than the last, and turn back, or no leader goes on. `None` of
/// others.
pub(super) fn growth(engine: &Engine) -> Option<String> {
    /// Of the squares of the moves, from one to the next \[1\].
    const GROWS: f64 = 1.01;
    let [along, next, last] = moves(engine);
    let goes_on = |i: &usize| {
        engine.roles()[*i] == Role::Leader && engine.present().get(*i) != engine.previous().get(*i)
    };
    let is_led = engine.count_of_parts(engine.body().owned().filter(goes_on).count()) > 0;
    ((along < 0.0 || !is_led) && next > GROWS * last).then(|| cause_in_sweep(engine)).flatten()
}

/// The warning about a body that is stepped by a rule without forces and is not at rest yet. `residual` is its largest last move over the
/// spacing, within `tolerance`. `None` where little is left to go if the moves go on to shrink as they do now.
pub fn still_moving(engine: &Engine, residual: f64, tolerance: f64) -> Option<String> {
    /// Over the spacing \[1\], and over the tolerance.
    const LITTLE: (f64, f64) = (0.01, 10.0);
    /// Over the spacing: moves that may be rounding \[1\].
    const ROUNDING: f64 = 1e-9;
    if matches!(engine.flock().rule.mean, Mean::Material { .. }) || residual < ROUNDING {
        return None;
    }
    let [along, next, last] = moves(engine);
    let ratio = (next / last).sqrt();
    let left = if ratio < 1.0 { residual * ratio / (1.0 - ratio) } else { f64::INFINITY };
    (along > 0.0 && left > LITTLE.0.max(LITTLE.1 * tolerance)).then(|| {
        let how = match left.is_finite() {
            true => format!(
                "shrink by {:.1e} of themselves a step: about {left:.2} spacings or more are left to go",
                1.0 - ratio
            ),
            false => "do not shrink yet".to_owned(),
        };
        format!(
            "nothing moves farther in a step than stop.tolerance, but the moves {how}; lower stop.tolerance"
        )
    })
}

/// Whether the followers' next moves go against their last ones: waves that grow from step to step change their sign at
/// each, and outweigh all else in the end.
fn overshoots(engine: &Engine) -> bool {
    moves(engine)[0] < 0.0
}

/// Products of the followers' next moves with their last ones, with themselves, and of the last with themselves, in sum.
fn moves(engine: &Engine) -> [f64; 3] {
    let (present, previous, damping) = (engine.present(), engine.previous(), engine.update().damping);
    let followers = engine.body().owned().filter(|&i| engine.roles()[i] == Role::Follower);
    // Each sees where those before it are by then.
    let mut swept = (engine.update().order == Order::Sequential).then(|| present.clone());
    let mut products = |i: usize| {
        let here = present.get(i);
        let target = engine.flock().target(i, swept.as_ref().unwrap_or(present));
        let next = minus(target, here).map(|x| damping * x);
        if let Some(swept) = &mut swept {
            swept.set(i, plus(here, next));
        }
        let last = minus(here, previous.get(i));
        [dot(next, last), dot(next, next), dot(last, last)]
    };
    engine.sum_over([0.0; 3], followers.map(|i| (i, products(i))))
}

#[cfg(test)]
mod tests;
