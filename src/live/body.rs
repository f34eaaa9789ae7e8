//! A body under the reader's hands: stepped, led by hand, cut, its rule changed; and the file that replays it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::command::Command;
use super::session::{Broken, Frame, Refused, Viewer};
use crate::continuum::plan::Plan;
use crate::continuum::run::Bounds;
use crate::engine::Engine;
use crate::engine::forces::held;
use crate::engine::setup::{ActionKind, RoleChange, Setup};
use crate::export::report::RunRecorder;
use crate::export::report::view::View;
use crate::flock::motion::{Interpolation, Keyframe, Motion};
use crate::flock::role::Role;
use crate::flock::rules::Mean;
use crate::scene::raw::*;
use crate::scene::{self, Scene, SceneError, is_changeable};

/// Most particles of a body that is shown live.
const MOST_PARTICLES: usize = 1 << 20;
/// Most places of hands that are kept; a hand that moves takes one for each step.
const MOST_PLACES: usize = 200_000;
/// A hand moves particles no farther than this many diagonals of the body.
const FARTHEST: f64 = 20.0;
/// States that can be returned to, and the particles of all of them together.
const MOST_UNDONE: usize = 40;
const MOST_UNDONE_PARTICLES: usize = 1 << 21;

/// Reads the scene with these overrides after those that the session began with.
pub type Load = Box<dyn Fn(&[String]) -> Result<Scene, SceneError> + Send>;

/// A body under way, and everything that was done to it.
pub struct Body {
    load: Load,
    /// Where files that the scene names are looked up.
    folder: Option<PathBuf>,
    now: State,
    before: Vec<State>,
}

/// What [`Command::Undo`] returns to.
#[derive(Clone)]
struct State {
    /// Overrides from the start.
    set: Vec<String>,
    scene: Arc<Scene>,
    setup: Arc<Setup>,
    bounds: Bounds,
    engine: Engine,
    /// What was done, as the scene format says it.
    hands: Vec<RawRoles>,
    actions: Vec<RawAction>,
    /// What viewers hold.
    grabs: BTreeMap<Viewer, Grab>,
    /// Changes with every scene that is laid out anew.
    layout: u64,
}

/// Particles in a viewer's hand.
#[derive(Clone)]
struct Grab {
    /// Number among the engine's role changes, and among `hands`.
    change: usize,
    hand: usize,
    frames: Vec<Keyframe>,
    /// Step before the first one led.
    since: usize,
    /// Whether the particles follow again when they are let go.
    follows: bool,
    /// Where the hand has them \[length\].
    by: [f64; 2],
}

impl Body {
    /// # Errors
    /// Names the key of a scene that cannot be laid out, or that is too large to be shown.
    pub fn new(load: Load, folder: Option<PathBuf>) -> Result<Self, SceneError> {
        let now = State::begin(&load, folder.as_deref(), Vec::new(), 0)?;
        Ok(Self { load, folder, now, before: Vec::new() })
    }

    /// The body as it is.
    pub fn engine(&self) -> &Engine {
        &self.now.engine
    }

    /// The scene that it began with.
    pub fn scene(&self) -> &Scene {
        &self.now.scene
    }

    /// Changes whenever particles and neighbours are other ones.
    pub fn layout(&self) -> u64 {
        self.now.layout
    }

    /// States that can be returned to.
    pub fn undoable(&self) -> usize {
        self.before.len()
    }

    /// Keys that were changed and hold now, `KEY=VALUE`, in their order.
    pub fn sets(&self) -> Vec<String> {
        self.now.set.iter().cloned().chain(self.now.changed_keys()).collect()
    }

    /// Takes a step.
    ///
    /// # Errors
    /// Why it was taken back.
    pub fn advance(&mut self) -> Result<(), String> {
        let state = &mut self.now;
        for grab in state.grabs.values_mut() {
            let step = state.engine.step() + 1 - grab.since.min(state.engine.step());
            grab.hold(step, &mut state.engine);
        }
        state.engine.advance();
        match state.bounds.divergence(&state.engine) {
            None => Ok(()),
            Some(divergence) => {
                state.engine.undo_step();
                Err(divergence.to_string())
            }
        }
    }

    /// Does what a viewer asks of a body.
    ///
    /// # Errors
    /// Why it cannot be done; nothing has changed then.
    pub fn perform(&mut self, viewer: Viewer, command: &Command) -> Result<(), Refused> {
        match command {
            Command::Grab { particle, alone } => self.grab(viewer, *particle, *alone),
            Command::Drag { by } => self.drag(viewer, *by),
            Command::Release {} => {
                self.release(viewer);
                Ok(())
            }
            Command::Cut { from, to } => self.cut((*from, *to)),
            Command::Set { key, value } => self.set(&format!("{key}={value}")),
            Command::Reset {} => self.restart(self.now.set.clone()),
            Command::Undo {} => {
                let layout = self.now.layout;
                self.now = self.before.pop().ok_or("nothing was done yet")?;
                // A layout that was left counts as a new one.
                if self.now.layout != layout {
                    self.now.layout = layout + 1;
                }
                Ok(())
            }
            _ => Err("a body cannot do this".into()),
        }
    }

    fn keep(&mut self) {
        let most = (MOST_UNDONE_PARTICLES / self.now.engine.body().count().max(1)).clamp(1, MOST_UNDONE);
        if self.before.len() >= most {
            self.before.remove(0);
        }
        let mut state = self.now.clone();
        // Hands do not come back.
        state.let_go_all();
        self.before.push(state);
    }

    fn grab(&mut self, viewer: Viewer, particle: usize, alone: bool) -> Result<(), Refused> {
        let engine = &self.now.engine;
        let role = *engine.roles().get(particle).ok_or("there is no such particle")?;
        if !role.is_body() {
            return Err(format!("a {} particle cannot be led", role.name()).into());
        }
        self.now.require_room()?;
        self.release(viewer);
        self.keep();
        let particles = if alone { vec![particle] } else { self.now.held_with(particle) };
        self.now.take(viewer, particles, role == Role::Follower);
        Ok(())
    }

    fn drag(&mut self, viewer: Viewer, by: [f64; 2]) -> Result<(), Refused> {
        let (low, high) = self.now.engine.body().bounds();
        let farthest = FARTHEST * f64::hypot(high[0] - low[0], high[1] - low[1]).max(1e-300);
        let grab = self.now.grabs.get_mut(&viewer).ok_or("nothing is held")?;
        grab.by = by.map(|along| along.clamp(-farthest, farthest));
        self.now.require_room()
    }

    /// Lets go of what a viewer holds, if it holds anything.
    pub fn release(&mut self, viewer: Viewer) {
        self.now.let_go(viewer);
    }

    fn cut(&mut self, cut: ([f64; 2], [f64; 2])) -> Result<(), Refused> {
        if self.now.engine.lasting_neighbours().is_none() {
            return Err("neighbours that are found anew at every step cannot be cut".into());
        }
        if matches!(self.now.engine.flock().rule.mean, Mean::Material { .. }) {
            return Err("a material is in cells, not in bonds that could be cut".into());
        }
        self.now.require_room()?;
        self.keep();
        let at = self.now.engine.step() + 1;
        self.now.engine.perform(&ActionKind::Cut(cut), at);
        self.now.actions.push(RawAction { at, what: RawActionKind::Cut { from: cut.0, to: cut.1 } });
        Ok(())
    }

    fn set(&mut self, text: &str) -> Result<(), Refused> {
        let sets = |action: &scene::Action| matches!(action.what, scene::ActionKind::Set(_));
        // A file that changes keys on its way would change them back.
        if !is_changeable(text) || self.now.scene.actions.iter().any(sets) || self.now.is_untouched() {
            let mut set = self.now.set.clone();
            set.push(text.to_owned());
            return self.restart(set);
        }
        self.now.require_room()?;
        let changed: Vec<String> = self.now.changed_keys().chain([text.to_owned()]).collect();
        let all = [&self.now.set[..], &changed].concat();
        let scene = (self.load)(&all)?.stepped(self.folder.as_deref())?;
        if matches!(scene.mean, Mean::Material { .. }) && self.now.is_cut() {
            return Err("a material is in cells, and bonds of this body were cut: reset it first".into());
        }
        let Ok(conduct) = plan(&scene)?.conduct_of(&self.now.setup) else {
            // Another body: from the start, then.
            return self.restart([&self.now.set[..], &[text.to_owned()]].concat());
        };
        self.keep();
        let at = self.now.engine.step() + 1;
        self.now.engine.perform(&ActionKind::Conduct(Arc::new(conduct)), at);
        self.now.keep_key(at, text);
        Ok(())
    }

    fn restart(&mut self, set: Vec<String>) -> Result<(), Refused> {
        let state = State::begin(&self.load, self.folder.as_deref(), set, self.now.layout + 1)?;
        self.keep();
        self.now = state;
        Ok(())
    }

    /// The scene that replays what was done, as TOML.
    ///
    /// # Errors
    /// A scene that cannot be written, or that no run would take.
    pub fn saved(&self) -> Result<String, String> {
        let raw = self.now.replay();
        let text = toml::to_string(&raw).map_err(|error| error.to_string())?;
        match Scene::parse("saved", "saved.toml", &text, &[], self.folder.as_deref()) {
            Ok(_) => Ok(text),
            Err(error) => Err(format!("no run would take this file yet: {error}")),
        }
    }

    /// The page's view of the body as it is.
    pub fn view(&self) -> View {
        RunRecorder::still(&self.now.scene, &self.now.engine)
    }

    /// Quantities that the page cannot compute from displacements.
    pub fn channels(&self) -> Vec<&'static str> {
        match self.now.engine.lasting_neighbours() {
            Some(_) => vec!["pe2"],
            None => vec!["pe2", "pe1", "strain"],
        }
    }

    /// The state of every particle; of the channels those that are wanted.
    pub fn frame(&self, wanted: &[bool]) -> Frame {
        let engine = &self.now.engine;
        let (present, reference) = (engine.present(), &engine.body().reference);
        let moved = |now: &[f64], then: &[f64]| now.iter().zip(then).map(|(n, t)| (n - t) as f32).collect();
        let places = [moved(&present.x, &reference.x), moved(&present.y, &reference.y)];
        let of = |name: &str| -> Vec<f32> {
            let value = |i: usize| match name {
                "pe2" => engine.pe2(i),
                "pe1" => engine.pe1(i),
                _ => engine.strain(i).map_or(f64::NAN, |strain| strain.largest()),
            };
            (0..present.len()).map(|i| value(i) as f32).collect()
        };
        let channels = self.channels().into_iter().zip(wanted);
        let channels = channels.map(|(name, wanted)| wanted.then(|| of(name))).collect();
        Frame { clock: engine.step() as f64, places, channels }
    }

    /// Broken bonds, as the page's view knows them.
    pub fn broken(&self) -> Broken {
        self.now.engine.breaks().iter().map(|one| one.pair).collect()
    }
}

impl State {
    fn begin(
        load: &Load,
        folder: Option<&std::path::Path>,
        set: Vec<String>,
        layout: u64,
    ) -> Result<Self, SceneError> {
        let scene = load(&set)?.stepped(folder)?;
        let plan = plan(&scene)?;
        if plan.count() > MOST_PARTICLES {
            let message = format!("{} particles are more than a page can show live", plan.count());
            return Err(scene.refuse("body", message, format!("use at most {MOST_PARTICLES}")));
        }
        let bounds = Bounds::of(&plan);
        let setup = Arc::new(plan.setup);
        let engine = Engine::new(Setup::clone(&setup));
        let (hands, actions, grabs) = (Vec::new(), Vec::new(), BTreeMap::new());
        Ok(Self { set, scene: Arc::new(scene), setup, bounds, engine, hands, actions, grabs, layout })
    }

    fn is_untouched(&self) -> bool {
        self.engine.step() == 0 && self.actions.is_empty() && self.hands.is_empty()
    }

    fn is_cut(&self) -> bool {
        self.actions.iter().any(|action| matches!(action.what, RawActionKind::Cut { .. }))
    }

    /// The particles that one is held with, or itself.
    fn held_with(&self, particle: usize) -> Vec<usize> {
        let groups = held(&self.engine).into_iter();
        let group = groups
            .filter(|_| self.engine.roles()[particle] != Role::Follower)
            .find(|group| group.iter().any(|one| one.particle == particle));
        group.map_or_else(|| vec![particle], |group| group.iter().map(|one| one.particle).collect())
    }

    /// Leads particles by a viewer's hand from the next step on.
    fn take(&mut self, viewer: Viewer, particles: Vec<usize>, follows: bool) {
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

    fn let_go_all(&mut self) {
        while let Some(&viewer) = self.grabs.keys().next() {
            self.let_go(viewer);
        }
    }

    fn let_go(&mut self, viewer: Viewer) {
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

    /// Refuses more than a file should hold.
    fn require_room(&self) -> Result<(), Refused> {
        let moved: usize = self.grabs.values().map(|grab| grab.frames.len()).sum();
        let kept = |hand: &RawRoles| match &hand.motion {
            Some(RawMotion::Keyframes { frames, .. }) => frames.len(),
            _ => 0,
        };
        let places = moved + self.hands.iter().map(kept).sum::<usize>();
        let is_full = places > MOST_PLACES || self.actions.len() + 1 >= scene::MOST_ACTIONS;
        if is_full { Err("too much was done to be kept: save it, and reset".into()) } else { Ok(()) }
    }

    /// Keys that were changed on the way, in their order.
    fn changed_keys(&self) -> impl Iterator<Item = String> + '_ {
        let keys = |action: &RawAction| match &action.what {
            RawActionKind::Set { keys } => keys.clone(),
            RawActionKind::Cut { .. } => Vec::new(),
        };
        self.actions.iter().flat_map(keys)
    }

    /// Keeps a changed key; of several changes of it before the same step the last.
    fn keep_key(&mut self, at: usize, text: &str) {
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
    fn replay(&self) -> RawScene {
        let mut state = self.clone();
        state.let_go_all();
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
    /// Has its particles where the hand is at this step since they were taken.
    fn hold(&mut self, step: usize, engine: &mut Engine) {
        if self.frames.last().is_none_or(|last| last.displacement == self.by) {
            return;
        }
        let frame = Keyframe { step: step.max(1) as f64, displacement: self.by };
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
fn plan(scene: &Scene) -> Result<Plan, SceneError> {
    #[cfg(feature = "fem")]
    return crate::study::compare::run::plan(scene);
    #[cfg(not(feature = "fem"))]
    Plan::new(scene)
}
