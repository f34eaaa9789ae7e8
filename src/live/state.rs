//! The state that viewers are shown: the latest alone, of which each viewer takes as much as it can draw.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tungstenite::{Bytes, Message, Utf8Bytes};

use super::session::{Broken, Viewer};

/// Messages that wait for a viewer; older ones are dropped.
const MOST_NOTICES: usize = 32;

/// The state at a moment, encoded once for all viewers.
#[derive(Clone, Debug, Default)]
pub struct Published {
    /// Counts states from 1.
    pub number: u64,
    /// As the page unpacks it.
    pub frame: Bytes,
    /// Roles of particles, as the page unpacks them.
    pub roles: Bytes,
    /// Broken bonds; of one `lineage` a longer list begins as a shorter one.
    pub broken: Arc<Broken>,
    /// Changes where the list of broken bonds may have become another one.
    pub lineage: u64,
    /// Everything else, as JSON.
    pub status: Utf8Bytes,
}

/// The latest state, and words for single viewers.
#[derive(Debug, Default)]
pub struct Board {
    inner: Mutex<Inner>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Inner {
    now: Published,
    page: Arc<str>,
    viewers: BTreeMap<Viewer, VecDeque<Message>>,
    /// Quantities that viewers look at.
    wanted: BTreeMap<Viewer, String>,
    is_closed: bool,
}

/// Something new for a viewer.
#[derive(Debug)]
pub enum News {
    /// A message for this viewer.
    Notice(Message),
    /// A later state than the one it has.
    State(Published),
    /// Nothing in the time that was waited.
    Nothing,
    /// The session is over.
    Closed,
}

impl Board {
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows a state.
    pub fn publish(&self, now: Published) {
        self.inner().now = now;
        self.changed.notify_all();
    }

    /// Gives later viewers this page.
    pub(crate) fn set_page(&self, page: String) {
        self.inner().page = page.into();
    }

    /// The page for a new viewer.
    pub fn page(&self) -> Arc<str> {
        self.inner().page.clone()
    }

    /// Lets a viewer in, unless there are `most`.
    pub fn enter(&self, viewer: Viewer, most: usize) -> bool {
        let viewers = &mut self.inner().viewers;
        let has_room = viewers.len() < most;
        if has_room {
            viewers.insert(viewer, VecDeque::new());
        }
        has_room
    }

    /// Forgets a viewer.
    pub fn leave(&self, viewer: Viewer) {
        let mut inner = self.inner();
        inner.viewers.remove(&viewer);
        inner.wanted.remove(&viewer);
    }

    /// Viewers now.
    pub fn viewers(&self) -> usize {
        self.inner().viewers.len()
    }

    /// Notes which quantity a viewer looks at, unless it has gone.
    pub fn want(&self, viewer: Viewer, quantity: String) {
        let mut inner = self.inner();
        if inner.viewers.contains_key(&viewer) {
            inner.wanted.insert(viewer, quantity);
        }
    }

    /// Whether a viewer looks at this quantity.
    pub(crate) fn is_wanted(&self, quantity: &str) -> bool {
        self.inner().wanted.values().any(|wanted| wanted == quantity)
    }

    /// Says something to a viewer.
    pub fn send(&self, viewer: Viewer, words: &serde_json::Value) {
        self.post(viewer, Message::text(words.to_string()));
    }

    /// Sends a message to a viewer alone.
    pub(super) fn post(&self, viewer: Viewer, message: Message) {
        if let Some(notices) = self.inner().viewers.get_mut(&viewer) {
            if notices.len() >= MOST_NOTICES {
                notices.pop_front();
            }
            notices.push_back(message);
        }
        self.changed.notify_all();
    }

    /// Wakes viewers that may be ready for more.
    pub fn wake(&self) {
        // One that has looked and does not wait yet would miss it.
        let _held = self.inner();
        self.changed.notify_all();
    }

    /// Whether the session is over.
    pub(crate) fn is_closed(&self) -> bool {
        self.inner().is_closed
    }

    /// Sends every viewer away.
    pub fn close(&self) {
        self.inner().is_closed = true;
        self.changed.notify_all();
    }

    /// Waits for news for a viewer that has the state of this number; `is_ready` is whether it can take another.
    pub fn wait(&self, viewer: Viewer, has: u64, is_ready: impl Fn() -> bool, most: Duration) -> News {
        let is_idle = |inner: &mut Inner| {
            let has_notice = inner.viewers.get(&viewer).is_none_or(|notices| !notices.is_empty());
            !(inner.is_closed || has_notice || (inner.now.number != has && is_ready()))
        };
        let waited = self.changed.wait_timeout_while(self.inner(), most, is_idle);
        let (mut inner, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let is_closed = inner.is_closed;
        match inner.viewers.get_mut(&viewer).map(VecDeque::pop_front) {
            Some(_) | None if is_closed => News::Closed,
            None => News::Closed,
            Some(Some(notice)) => News::Notice(notice),
            Some(None) if inner.now.number != has && is_ready() => News::State(inner.now.clone()),
            Some(None) => News::Nothing,
        }
    }
}
