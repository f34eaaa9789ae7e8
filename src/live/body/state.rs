//! A body under way and what was done to it, kept as the scene format says it.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::continuum::plan::Plan;
use crate::continuum::run::Bounds;
use crate::engine::Engine;
use crate::engine::forces::held;
use crate::engine::setup::{RoleChange, Setup};
use crate::flock::motion::{Interpolation, Keyframe, Motion};
use crate::flock::role::Role;
use crate::live::history::{self, Source};
use crate::live::session::{Refused, Viewer};
use crate::scene::raw::*;
use crate::scene::{self, Scene, SceneError};

/// Most particles of a body that is shown live.
const MOST_PARTICLES: usize = 1 << 20;
/// Most places of hands that are kept; a hand that moves takes one for each step.
const MOST_PLACES: usize = 200_000;
/// A hand that does not move takes as much memory as so many places.
const PLACES_OF_A_HAND: usize = 16;
/// Most particles that hands take, each time counted; all of a body can be taken once.
const MOST_HELD: usize = MOST_PARTICLES;

/// A body and everything that was done to it.
#[derive(Clone)]
pub(super) struct State {
    pub(super) scene: Arc<Scene>,
    pub(super) setup: Arc<Setup>,
    pub(super) bounds: Bounds,
    pub(super) engine: Engine,
    /// Past changes, in the scene format.
    hands: Vec<RawRoles>,
    pub(super) actions: Vec<RawAction>,
    /// Things that viewers hold.
    pub(super) grabs: BTreeMap<Viewer, Grab>,
}

/// Particles in a viewer's hand.
#[derive(Clone)]
pub(super) struct Grab {
    /// Number among the engine's role changes, and among `hands`.
    change: usize,
    hand: usize,
    frames: Vec<Keyframe>,
    /// Step before the first one led.
    since: usize,
    /// Whether the particles follow again when they are let go.
    follows: bool,
    /// Where the hand has them \[length\].
    pub(super) by: [f64; 2],
}

impl history::State for State {
    const NAME: &'static str = "body";
    type File = Scene;

    fn begin(source: &Source<Scene>, set: &[String]) -> Result<Self, SceneError> {
        let folder = source.folder.as_deref();
        let scene = source.file.with(set, folder)?.stepped(folder)?;
        let plan = plan(&scene)?;
        if plan.count() > MOST_PARTICLES {
            let message = format!("{} particles are more than a page can show live", plan.count());
            return Err(scene.refuse("body", message, format!("use at most {MOST_PARTICLES}")));
        }
        let bounds = Bounds::of(&plan);
        let setup = Arc::new(plan.setup);
        let engine = Engine::new(Setup::clone(&setup));
        let (hands, actions, grabs) = (Vec::new(), Vec::new(), BTreeMap::new());
        Ok(Self { scene: Arc::new(scene), setup, bounds, engine, hands, actions, grabs })
    }

    fn let_go_all(&mut self) {
        while let Some(&viewer) = self.grabs.keys().next() {
            self.let_go(viewer);
        }
    }

    fn size(&self) -> usize {
        self.engine.body().count() + self.places() + self.particles()
    }
}

impl State {
    pub(super) fn is_untouched(&self) -> bool {
        self.engine.step() == 0 && self.actions.is_empty() && self.hands.is_empty()
    }

    pub(super) fn is_cut(&self) -> bool {
        self.actions.iter().any(|action| matches!(action.what, RawActionKind::Cut { .. }))
    }

    /// The particles that one is held with, or itself.
    pub(super) fn held_with(&self, particle: usize) -> Vec<usize> {
        let groups = held(&self.engine).into_iter();
        let group = groups
            .filter(|_| self.engine.roles()[particle] != Role::Follower)
            .find(|group| group.iter().any(|one| one.particle == particle));
        group.map_or_else(|| vec![particle], |group| group.iter().map(|one| one.particle).collect())
    }

    /// Leads particles by a viewer's hand from the next step on.
    pub(super) fn take(&mut self, viewer: Viewer, particles: Vec<usize>, follows: bool) {
        let from = self.next_from();
        let ids = particles.iter().map(|&i| self.engine.body().id(i)).collect();
        let frames = vec![Keyframe { step: 1.0, displacement: [0.0; 2] }];
        self.hands.push(RawRoles {
            region: RawRegion::Ids { ids },
            role: RawRole::Leader,
            axis: None,
            from,
            when: None,
            motion: None,
        });
        let motion = Some(motion(frames.clone()));
        let change = RoleChange { particles, role: Role::Leader, axis: None, from, when: None, motion };
        let change = self.engine.add_role_change(change);
        let hand = self.hands.len() - 1;
        let grab = Grab { change, hand, frames, since: from - 1, follows, by: [0.0; 2] };
        self.grabs.insert(viewer, grab);
    }

    /// First step at which a role can be taken: those of the first step hold from the start.
    fn next_from(&self) -> usize {
        (self.engine.step() + 1).max(2)
    }

    pub(super) fn let_go(&mut self, viewer: Viewer) {
        let Some(grab) = self.grabs.remove(&viewer) else { return };
        let hand = &mut self.hands[grab.hand];
        hand.motion = Some(raw_motion(&grab.frames));
        if !grab.follows {
            return;
        }
        let from = self.next_from();
        let region = self.hands[grab.hand].region.clone();
        self.hands.push(RawRoles {
            region,
            role: RawRole::Follower,
            axis: None,
            from,
            when: None,
            motion: None,
        });
        let particles = self.engine.changes()[grab.change].particles.clone();
        let role = Role::Follower;
        self.engine.add_role_change(RoleChange {
            particles,
            role,
            axis: None,
            from,
            when: None,
            motion: None,
        });
    }

    /// Refuses more than a file should hold, were so many particles taken as well.
    pub(super) fn require_room(&self, taken: usize) -> Result<(), Refused> {
        let places = self.hands.len() * PLACES_OF_A_HAND + self.places();
        let is_full = places > MOST_PLACES
            || self.particles() + taken > MOST_HELD
            || self.actions.len() + 1 >= scene::MOST_ACTIONS;
        if is_full { Err("too much was done to be kept: save it, and reset".into()) } else { Ok(()) }
    }

    /// Places of all hands.
    fn places(&self) -> usize {
        let kept = |hand: &RawRoles| match &hand.motion {
            Some(RawMotion::Keyframes { frames, .. }) => frames.len(),
            _ => 0,
        };
        let moved: usize = self.grabs.values().map(|grab| grab.frames.len()).sum();
        moved + self.hands.iter().map(kept).sum::<usize>()
    }

    /// Particles that hands took, each time counted.
    fn particles(&self) -> usize {
        let taken = |hand: &RawRoles| match &hand.region {
            RawRegion::Ids { ids } => ids.len(),
            _ => 0,
        };
        self.hands.iter().map(taken).sum()
    }

    /// Keys that were changed on the way, in their order.
    pub(super) fn changed_keys(&self) -> impl Iterator<Item = String> + '_ {
        let keys = |action: &RawAction| match &action.what {
            RawActionKind::Set { keys } => keys.clone(),
            RawActionKind::Cut { .. } => Vec::new(),
        };
        self.actions.iter().flat_map(keys)
    }

    /// Keeps a changed key; of several changes of it before the same step the last.
    pub(super) fn keep_key(&mut self, at: usize, text: &str) {
        let key = |text: &str| text.split('=').next().unwrap_or_default().to_owned();
        let what = RawActionKind::Set { keys: vec![text.to_owned()] };
        match self.actions.last_mut() {
            Some(RawAction { at: last, what: RawActionKind::Set { keys } })
                if *last == at && keys.len() == 1 && key(&keys[0]) == key(text) =>
            {
                keys[0] = text.to_owned();
            }
            _ => self.actions.push(RawAction { at, what }),
        }
    }

    /// The scene with everything that was done.
    pub(super) fn replay(&self) -> RawScene {
        let mut state = self.clone();
        history::State::let_go_all(&mut state);
        let mut raw = state.scene.raw.clone();
        raw.roles.extend(state.hands);
        // What was done before a step came before what the file does at it.
        let own = std::mem::replace(&mut raw.actions, state.actions);
        raw.actions.extend(own);
        raw.actions.sort_by_key(|action| action.at);
        raw.stop.steps = self.engine.step().max(1);
        raw.stop.tolerance = None;
        raw
    }
}

impl Grab {
    /// Has its particles where the hand is from the next step on.
    pub(super) fn hold(&mut self, engine: &mut Engine) {
        if self.frames.last().is_none_or(|last| last.displacement == self.by) {
            return;
        }
        let step = (engine.step() + 1).saturating_sub(self.since).max(1);
        let frame = Keyframe { step: step as f64, displacement: self.by };
        match self.frames.last_mut() {
            Some(last) if last.step >= frame.step => last.displacement = frame.displacement,
            _ => self.frames.push(frame),
        }
        engine.steer(self.change, motion(self.frames.clone()));
    }
}

/// Jumps, so that each place is one that the hand was at.
fn motion(frames: Vec<Keyframe>) -> Motion {
    Motion::Keyframes { frames, interpolation: Interpolation::Hold }
}

fn raw_motion(frames: &[Keyframe]) -> RawMotion {
    let frame =
        |frame: &Keyframe| RawKeyframe { step: frame.step as usize, displacement: frame.displacement };
    RawMotion::Keyframes { frames: frames.iter().map(frame).collect(), interpolation: RawInterpolation::Hold }
}

/// The plan of a scene, led by finite elements where it asks for that and they are built.
pub(super) fn plan(scene: &Scene) -> Result<Plan, SceneError> {
    #[cfg(feature = "fem")]
    return crate::study::compare::run::plan(scene);
    #[cfg(not(feature = "fem"))]
    Plan::new(scene)
}
