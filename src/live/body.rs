//! A body under the reader's hands: stepped, led by hand, cut, its rule changed; and the file that replays it.

mod load;
mod state;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value, json};

use super::command::Command;
use super::history::{History, Source};
use super::session::{Broken, Frame, Refused, Session, Viewer};
use crate::continuum::mechanics::Stresses;
use crate::engine::{Before, Engine};
use crate::export::report::RunRecorder;
use crate::export::report::view::View;
use crate::flock::action::{Action, ActionKind};
use crate::flock::rules::Mean;
use crate::scene::raw::*;
use crate::scene::{Scene, SceneError, is_changeable};
use load::load_key;
use state::{State, plan};

/// A hand moves particles no farther than this many diagonals of the body.
const FARTHEST: f64 = 20.0;

/// A body under way, and everything that was done to it.
pub struct Body {
    history: History<State>,
    /// The engine before the last step.
    before: Before,
}

impl Body {
    /// A body whose scene looks up other files in `folder`.
    ///
    /// # Errors
    /// Names the key of a scene that cannot be laid out, or that is too large to be shown.
    pub fn new(scene: Scene, folder: Option<PathBuf>) -> Result<Self, SceneError> {
        Ok(Self { history: History::new(scene, folder)?, before: Before::default() })
    }

    /// The body as it is.
    pub fn engine(&self) -> &Engine {
        &self.history.now.engine
    }

    /// The scene that it began with.
    pub fn scene(&self) -> &Scene {
        &self.history.now.scene
    }

    /// Whether bonds could break past a stretch, and none has been set.
    fn can_break(&self) -> bool {
        let engine = &self.history.now.engine;
        engine.flock().bonds.as_ref().is_none_or(|bonds| bonds.threshold.is_none()) && self.takes_cuts()
    }

    fn grab(&mut self, viewer: Viewer, particle: usize, alone: bool) -> Result<(), Refused> {
        let engine = &self.history.now.engine;
        let role = *engine.roles().get(particle).ok_or("there is no such particle")?;
        if !role.is_body() {
            return Err(format!("a {} particle cannot be led", role.name()).into());
        }
        self.release(viewer);
        self.history.now.grab(viewer, particle, alone)
    }

    fn drag(&mut self, viewer: Viewer, by: [f64; 2]) -> Result<(), Refused> {
        let (low, high) = self.history.now.engine.body().bounds();
        let farthest = FARTHEST * f64::hypot(high[0] - low[0], high[1] - low[1]).max(1e-300);
        self.history.now.drag(viewer, by.map(|along| along.clamp(-farthest, farthest)))
    }

    /// Leads what hands have moved. That one began to is a thing to undo.
    fn lead(&mut self) {
        if self.history.now.begins_to_lead() {
            self.history.keep();
        }
        self.history.now.lead();
    }

    fn cut(&mut self, cut: ([f64; 2], [f64; 2])) -> Result<(), Refused> {
        if self.history.now.engine.lasting_neighbours().is_none() {
            return Err("neighbours that are found anew at every step cannot be cut".into());
        }
        if matches!(self.history.now.engine.flock().rule.mean, Mean::Material { .. }) {
            return Err("a material is in cells, not in bonds that could be cut".into());
        }
        self.history.now.require_room(0)?;
        self.history.keep();
        let at = self.history.now.engine.step() + 1;
        self.history.now.engine.perform(&ActionKind::Cut(cut), at);
        self.history.now.actions.push(RawAction { at, what: RawActionKind::Cut { from: cut.0, to: cut.1 } });
        Ok(())
    }

    fn load(&mut self, side: RawSide, by: [f64; 2]) -> Result<(), Refused> {
        let Source { file, folder } = &*self.history.source;
        let scene = file.with(&self.sets(), folder.as_deref())?;
        let key = load_key(&self.history.now, &scene, side, by)?;
        self.set(&key)
    }

    fn set(&mut self, text: &str) -> Result<(), Refused> {
        // A file that changes keys on its way would change them back.
        if !is_changeable(text)
            || !self.history.now.scene.actions.iter().all(Action::is_cut)
            || self.history.now.is_untouched()
        {
            return self.restart_with(text);
        }
        self.history.now.require_room(0)?;
        let changed: Vec<String> = self.history.now.changed_keys().chain([text.to_owned()]).collect();
        let all = [self.history.set(), &changed].concat();
        let Source { file, folder } = &*self.history.source;
        let scene = file.with(&all, folder.as_deref())?.stepped(folder.as_deref())?;
        if matches!(scene.mean, Mean::Material { .. }) && self.history.now.is_cut() {
            return Err("a material is in cells, and bonds of this body were cut: reset it first".into());
        }
        let Ok(conduct) = plan(&scene)?.conduct_of(&self.history.now.setup) else {
            // Another body: from the start, then.
            return self.restart_with(text);
        };
        self.history.keep();
        let at = self.history.now.engine.step() + 1;
        self.history.now.engine.perform(&ActionKind::Follow(Arc::new(conduct)), at);
        self.history.now.keep_key(at, text);
        Ok(())
    }

    /// Begins anew with one more key set, besides those that were changed on the way.
    fn restart_with(&mut self, text: &str) -> Result<(), Refused> {
        self.history.restart([self.sets(), vec![text.to_owned()]].concat())
    }

    /// Whether it has bonds that can be cut.
    fn takes_cuts(&self) -> bool {
        let engine = &self.history.now.engine;
        engine.lasting_neighbours().is_some() && !matches!(engine.flock().rule.mean, Mean::Material { .. })
    }
}

impl Session for Body {
    fn advance(&mut self) -> Result<(), String> {
        self.lead();
        let state = &mut self.history.now;
        state.engine.advance_noting(&mut self.before);
        match state.bounds.divergence(&state.engine) {
            None => Ok(()),
            Some(divergence) => {
                state.engine.undo_step(&mut self.before);
                Err(divergence.to_string())
            }
        }
    }

    fn perform(&mut self, viewer: Viewer, command: &Command) -> Result<(), Refused> {
        match command {
            Command::Grab { particle, alone } => self.grab(viewer, *particle, *alone),
            Command::Drag { by } => self.drag(viewer, *by),
            Command::Release {} => {
                self.release(viewer);
                Ok(())
            }
            Command::Cut { from, to } => self.cut((*from, *to)),
            Command::Load { side, by } => self.load(*side, *by),
            Command::Set { key, value } => self.set(&format!("{key}={value}")),
            other => self.history.perform(other),
        }
    }

    fn release(&mut self, viewer: Viewer) {
        self.lead();
        self.history.now.let_go(viewer);
    }

    fn saved(&self, folder: Option<&Path>) -> Result<String, String> {
        let (mut raw, from) = (self.history.now.replay(), self.history.source.folder.as_deref());
        if let Some(to) = folder {
            raw.name_files_from(from, to);
        }
        let text = toml::to_string(&raw).map_err(|error| error.to_string())?;
        match Scene::parse("saved", "saved.toml", &text, &[], folder.or(from)) {
            Ok(_) => Ok(text),
            Err(error) => Err(format!("no run would take this file yet: {error}")),
        }
    }

    fn frame(&self, wanted: &[bool]) -> Frame {
        let engine = &self.history.now.engine;
        let (present, reference) = (engine.present(), &engine.body().reference);
        let mut displacements = present.since(reference);
        // A hand is not to wait for the next step, least of all where the body stands still.
        for (i, by) in self.history.now.ahead() {
            let (now, then) = (present.get(i), reference.get(i));
            displacements.set(i, [0, 1].map(|axis| now[axis] + by[axis] - then[axis]));
        }
        let of = |name: &str| -> Vec<f64> {
            if name == "von_mises" {
                return Stresses::von_mises_of_cells(engine);
            }
            let value = |i: usize| match name {
                "pe2" => engine.pe2(i),
                "pe1" => engine.pe1(i),
                _ => engine.strain(i).map_or(f64::NAN, |strain| strain.largest()),
            };
            (0..present.len()).map(value).collect()
        };
        let channels = self.channels().into_iter().zip(wanted);
        let channels = channels.map(|(name, wanted)| wanted.then(|| of(name))).collect();
        Frame { clock: engine.step() as f64, displacements, channels }
    }

    fn channels(&self) -> Vec<&'static str> {
        let engine = &self.history.now.engine;
        let mut channels = vec!["pe2"];
        if engine.lasting_neighbours().is_none() {
            channels.extend(["pe1", "strain"]);
        }
        channels.extend(engine.cells().map(|_| "von_mises"));
        channels
    }

    fn roles(&self) -> Vec<u8> {
        self.engine().roles().iter().map(|role| role.number()).collect()
    }

    fn broken(&self) -> Broken {
        self.history.now.engine.breaks().iter().map(|one| one.pair).collect()
    }

    fn layout(&self) -> u64 {
        self.history.layout()
    }

    fn undoable(&self) -> usize {
        self.history.undoable()
    }

    fn sets(&self) -> Vec<String> {
        self.history.set().iter().cloned().chain(self.history.now.changed_keys()).collect()
    }

    fn defaults(&self) -> Vec<(String, Value)> {
        let engine = &self.history.now.engine;
        let mut defaults = vec![("update.damping".to_owned(), json!(engine.update().damping))];
        if !matches!(engine.flock().rule.mean, Mean::Material { .. }) {
            defaults.push(("rule.feedback.factor".into(), json!(0.0)));
        }
        if self.can_break() {
            defaults.push(("fracture.stretch".into(), Value::Null));
        }
        defaults
    }

    fn tools(&self) -> Vec<&'static str> {
        // A side can be loaded where there is stress, which takes a material.
        let tools = [("cut", self.takes_cuts()), ("load", self.scene().material.is_some())];
        tools.into_iter().filter(|(_, is)| *is).map(|(name, _)| name).collect()
    }

    fn rate(&self) -> f64 {
        // As fast as screens are drawn.
        60.0
    }

    fn view(&self) -> View {
        RunRecorder::still(&self.history.now.scene, &self.history.now.engine)
    }

    fn title(&self) -> (&str, &str) {
        (&self.scene().name, &self.scene().raw.title)
    }

    fn runner(&self) -> &'static str {
        "run"
    }

    fn is_body(&self) -> bool {
        true
    }

    fn raw(&self) -> Value {
        serde_json::to_value(&self.scene().raw).unwrap_or_default()
    }
}
