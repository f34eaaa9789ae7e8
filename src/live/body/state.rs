//! A body under way and what was done to it, kept as the scene format says it.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::continuum::plan::Plan;
use crate::continuum::run::Bounds;
use crate::engine::Engine;
use crate::engine::forces::{Held, held};
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
    grabs: BTreeMap<Viewer, Grab>,
    /// Hands that have let go, whose last step is still to come or has just been taken.
    let_go: Vec<LetGo>,
}

/// Particles in a viewer's hand.
#[derive(Clone)]
struct Grab {
    particles: Vec<usize>,
    /// Whether the particles follow again when they are let go.
    follows: bool,
    /// Where the hand has them, from where it took them \[length\].
    by: [f64; 2],
    /// Absent until it has moved them: a hand that moves nothing does nothing.
    lead: Option<Lead>,
}

/// A hand's part in the engine, and in the scene that replays what was done.
#[derive(Clone)]
struct Lead {
    /// Number among the engine's role changes, and among `hands`.
    change: usize,
    hand: usize,
    frames: Vec<Keyframe>,
    /// Step before the first one led.
    since: usize,
    /// How far they were to go by an earlier hand when this one took them \[length\].
    from: [f64; 2],
}

#[derive(Clone)]
struct LetGo {
    change: usize,
    /// Last step that it leads.
    until: usize,
    follows: bool,
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
        let (hands, actions, grabs, let_go) = (Vec::new(), Vec::new(), BTreeMap::new(), Vec::new());
        Ok(Self { scene: Arc::new(scene), setup, bounds, engine, hands, actions, grabs, let_go })
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

    /// The particles that one is held with and goes on with, or itself.
    fn held_with(&self, particle: usize) -> Vec<usize> {
        let groups = held(&self.engine).into_iter();
        let group = groups
            .filter(|_| self.engine.roles()[particle] != Role::Follower)
            .find(|group| group.iter().any(|one| one.particle == particle));
        let ahead = self.ahead();
        let goes_along = |i: &usize| ahead.get(i) == ahead.get(&particle);
        let together = |group: Vec<Held>| group.iter().map(|one| one.particle).filter(goes_along).collect();
        group.map_or_else(|| vec![particle], together)
    }

    /// Takes particles in a viewer's hand: one, or all that are held as it is.
    pub(super) fn grab(&mut self, viewer: Viewer, particle: usize, alone: bool) -> Result<(), Refused> {
        let particles = if alone { vec![particle] } else { self.held_with(particle) };
        self.require_room(particles.len())?;
        // One that was let go follows at the step after the last one led.
        let is_freed =
            |one: &LetGo| one.follows && self.engine.changes()[one.change].particles.contains(&particle);
        let follows = self.engine.roles()[particle] == Role::Follower || self.let_go.iter().any(is_freed);
        self.grabs.insert(viewer, Grab { particles, follows, by: [0.0; 2], lead: None });
        Ok(())
    }

    /// Moves what a viewer holds, from where it was taken \[length\].
    pub(super) fn drag(&mut self, viewer: Viewer, by: [f64; 2]) -> Result<(), Refused> {
        self.grabs.get_mut(&viewer).ok_or("nothing is held")?.by = by;
        self.require_room(0)
    }

    /// Whether a hand has moved something for the first time.
    pub(super) fn begins_to_lead(&self) -> bool {
        self.grabs.values().any(Grab::begins_to_lead)
    }

    /// Leads what hands have moved to where they have it, from the next step on.
    pub(super) fn lead(&mut self) {
        let step = self.engine.step();
        self.let_go.retain(|one| one.until >= step);
        for (viewer, mut grab) in std::mem::take(&mut self.grabs) {
            if grab.begins_to_lead() {
                grab.lead = Some(self.begin(&grab.particles));
            }
            if let Some(lead) = &mut grab.lead {
                lead.hold(&mut self.engine, grab.by);
            }
            self.grabs.insert(viewer, grab);
        }
    }

    /// Leads particles by a hand from the next step on.
    fn begin(&mut self, particles: &[usize]) -> Lead {
        let from = self.next_from();
        let taken_at = self.ahead().get(&particles[0]).copied().unwrap_or_default();
        let ids = particles.iter().map(|&i| self.engine.body().id(i)).collect();
        let frames = vec![Keyframe { step: 1.0, displacement: [0.0; 2] }];
        self.hands.push(raw_role(RawRegion::Ids { ids }, RawRole::Leader, from));
        let motion = Some(motion(frames.clone()));
        let change = RoleChange { motion, ..RoleChange::new(particles.to_vec(), Role::Leader, from) };
        let change = self.engine.add_role_change(change);
        Lead { change, hand: self.hands.len() - 1, frames, since: from - 1, from: taken_at }
    }

    /// First step at which a role can be taken: those of the first step hold from the start.
    fn next_from(&self) -> usize {
        (self.engine.step() + 1).max(2)
    }

    /// Lets go of what a viewer holds, where [`State::lead`] has it.
    pub(super) fn let_go(&mut self, viewer: Viewer) {
        let Some(Grab { follows, lead: Some(lead), .. }) = self.grabs.remove(&viewer) else { return };
        let hand = &mut self.hands[lead.hand];
        hand.motion = Some(raw_motion(&lead.frames));
        // A place that no step has reached yet is the next step's.
        let from = self.next_from().max(lead.last_step() + 1);
        // Of several hands before a step the last has them.
        let changes = self.engine.changes();
        let is_other = |one: &LetGo| changes[one.change].particles != changes[lead.change].particles;
        self.let_go.retain(is_other);
        self.let_go.push(LetGo { change: lead.change, until: from - 1, follows });
        if !follows {
            return;
        }
        let region = self.hands[lead.hand].region.clone();
        self.hands.push(raw_role(region, RawRole::Follower, from));
        let particles = self.engine.changes()[lead.change].particles.clone();
        self.engine.add_role_change(RoleChange::new(particles, Role::Follower, from));
    }

    /// Particles that hands have taken on since the last step, and how far they are to go \[length\].
    pub(super) fn ahead(&self) -> BTreeMap<usize, [f64; 2]> {
        let mut ahead = BTreeMap::new();
        let changes = self.engine.changes();
        let (now, end) = (self.engine.step() as f64, f64::INFINITY);
        // A hand's jumps lead all of its particles alike, wherever they began.
        let led = |change: &RoleChange, step: f64| {
            change.motion.as_ref().map_or([0.0; 2], |motion| motion.displacement(step, 0, [0.0; 2]))
        };
        let to_go = |change: &RoleChange, to: [f64; 2]| {
            let here = led(change, now + 1.0 - change.from as f64);
            [0, 1].map(|k| to[k] - here[k])
        };
        for one in &self.let_go {
            let change = &changes[one.change];
            let by = to_go(change, led(change, end));
            ahead.extend(change.particles.iter().map(|&i| (i, by)));
        }
        for grab in self.grabs.values() {
            let by = match &grab.lead {
                Some(lead) => to_go(&changes[lead.change], lead.place(grab.by)),
                None => {
                    let before = ahead.get(&grab.particles[0]).copied().unwrap_or_default();
                    [0, 1].map(|k| before[k] + grab.by[k])
                }
            };
            ahead.extend(grab.particles.iter().map(|&i| (i, by)));
        }
        ahead.retain(|_, by| *by != [0.0; 2]);
        ahead
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
        let leads = self.grabs.values().filter_map(|grab| grab.lead.as_ref());
        let moved: usize = leads.map(|lead| lead.frames.len()).sum();
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
    fn begins_to_lead(&self) -> bool {
        self.lead.is_none() && self.by != [0.0; 2]
    }
}

impl Lead {
    /// Has its particles where the hand is from the next step on.
    fn hold(&mut self, engine: &mut Engine, by: [f64; 2]) {
        let displacement = self.place(by);
        if self.frames.last().is_none_or(|last| last.displacement == displacement) {
            return;
        }
        let step = (engine.step() + 1).saturating_sub(self.since).max(1);
        let frame = Keyframe { step: step as f64, displacement };
        match self.frames.last_mut() {
            Some(last) if last.step >= frame.step => last.displacement = displacement,
            _ => self.frames.push(frame),
        }
        engine.steer(self.change, motion(self.frames.clone()));
    }

    /// Where a hand that has moved so far has its particles, from where they began \[length\].
    fn place(&self, by: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| self.from[k] + by[k])
    }

    /// The first step that has its particles where the hand was last.
    fn last_step(&self) -> usize {
        self.since + self.frames.last().map_or(0, |frame| frame.step as usize)
    }
}

/// A role that is taken at a step, without motion.
fn raw_role(region: RawRegion, role: RawRole, from: usize) -> RawRoles {
    RawRoles { region, role, axis: None, from, when: None, motion: None }
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
