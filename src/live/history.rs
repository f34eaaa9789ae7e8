//! The states that undo returns to: the state of a session now, and those before it.

use std::path::PathBuf;
use std::sync::Arc;

use super::command::Command;
use super::session::Refused;
use crate::scene::SceneError;

/// States that can be returned to.
const MOST_KEPT: usize = 40;
/// Size of all of them together, see [`State::size`].
const MOST_SIZE: usize = 1 << 21;

/// A file as it was read when the session began, or as a hand designed it.
pub(super) struct Source<F> {
    pub(super) file: F,
    /// Where files that it names are looked up.
    pub(super) folder: Option<PathBuf>,
}

/// The state of a session at a moment.
pub(super) trait State: Clone {
    /// The word for what the session shows.
    const NAME: &'static str;
    /// The file that it begins with.
    type File;

    /// The beginning, with these keys set after those of the file.
    ///
    /// # Errors
    /// Names a key that cannot be set so.
    fn begin(source: &Source<Self::File>, set: &[String]) -> Result<Self, SceneError>;

    /// Lets go of everything that viewers hold.
    fn let_go_all(&mut self);

    /// About how many numbers it holds.
    fn size(&self) -> usize;
}

/// The state of a session now, and those that can be returned to.
pub(super) struct History<S: State> {
    pub(super) source: Arc<Source<S::File>>,
    pub(super) now: S,
    /// Keys that were set from the start of `now`.
    set: Vec<String>,
    /// Changes whenever `now` is laid out anew.
    layout: u64,
    before: Vec<Before<S>>,
}

/// The same at a moment before.
struct Before<S: State> {
    source: Arc<Source<S::File>>,
    state: S,
    set: Vec<String>,
    layout: u64,
}

impl<S: State> History<S> {
    /// # Errors
    /// As [`State::begin`].
    pub(super) fn new(file: S::File, folder: Option<PathBuf>) -> Result<Self, SceneError> {
        let source = Arc::new(Source { file, folder });
        let now = S::begin(&source, &[])?;
        Ok(Self { source, now, set: Vec::new(), layout: 0, before: Vec::new() })
    }

    /// Keys that were set from the start, `KEY=VALUE`, in their order.
    pub(super) fn set(&self) -> &[String] {
        &self.set
    }

    /// Changes with every other layout.
    pub(super) fn layout(&self) -> u64 {
        self.layout
    }

    /// States that can be returned to.
    pub(super) fn undoable(&self) -> usize {
        self.before.len()
    }

    /// Does what is the same in every session.
    ///
    /// # Errors
    /// Why it cannot be done; nothing has changed then.
    pub(super) fn perform(&mut self, command: &Command) -> Result<(), Refused> {
        match command {
            Command::Undo {} => self.undo(),
            Command::Reset {} => self.restart(self.set.clone()),
            _ => Err(format!("a {} cannot do this", S::NAME).into()),
        }
    }

    /// Keeps the state, to be returned to. Hands do not come back.
    pub(super) fn keep(&mut self) {
        self.keep_state(self.now.clone());
    }

    /// Does something that undo takes back; what is refused is nothing to undo.
    ///
    /// # Errors
    /// As `act`.
    pub(super) fn attempt(&mut self, act: impl FnOnce(&mut S) -> Result<(), Refused>) -> Result<(), Refused> {
        let before = self.now.clone();
        act(&mut self.now)?;
        self.keep_state(before);
        Ok(())
    }

    fn keep_state(&mut self, mut state: S) {
        state.let_go_all();
        let size = |before: &[Before<S>]| before.iter().map(|one| one.state.size()).sum::<usize>();
        let room = MOST_SIZE.saturating_sub(state.size());
        while self.before.len() >= MOST_KEPT || (!self.before.is_empty() && size(&self.before) > room) {
            self.before.remove(0);
        }
        let source = Arc::clone(&self.source);
        self.before.push(Before { source, state, set: self.set.clone(), layout: self.layout });
    }

    fn undo(&mut self) -> Result<(), Refused> {
        let Before { source, state, set, layout } = self.before.pop().ok_or("nothing was done yet")?;
        // A layout that was left counts as a new one.
        let layout = if layout == self.layout { layout } else { self.layout + 1 };
        (self.source, self.now, self.set, self.layout) = (source, state, set, layout);
        Ok(())
    }

    /// Begins anew, with these keys set.
    ///
    /// # Errors
    /// As [`State::begin`]; nothing has changed then.
    pub(super) fn restart(&mut self, set: Vec<String>) -> Result<(), Refused> {
        self.begin(Arc::clone(&self.source), set)
    }

    /// Begins anew with another file.
    ///
    /// # Errors
    /// As [`State::begin`]; nothing has changed then.
    pub(super) fn replace(&mut self, file: S::File) -> Result<(), Refused> {
        let folder = self.source.folder.clone();
        self.begin(Arc::new(Source { file, folder }), Vec::new())
    }

    fn begin(&mut self, source: Arc<Source<S::File>>, set: Vec<String>) -> Result<(), Refused> {
        let state = S::begin(&source, &set)?;
        self.keep();
        (self.source, self.now, self.set, self.layout) = (source, state, set, self.layout + 1);
        Ok(())
    }
}
