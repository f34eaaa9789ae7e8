//! A recording that a loop writes into and its caller closes.

use std::sync::{Arc, Mutex, PoisonError};

use super::Recording;
use crate::messages::recorder::RecordSink;

/// Clones share one recording.
#[derive(Clone)]
pub struct Shared(Arc<Mutex<Option<Recording>>>);

impl Shared {
    /// The one recording of all clones.
    pub fn new(recording: Recording) -> Self {
        Self(Arc::new(Mutex::new(Some(recording))))
    }

    /// Where a loop puts its copies.
    pub fn sink(&self) -> RecordSink {
        let shared = self.clone();
        Box::new(move |taped| {
            let mut open = shared.0.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(recording) = &mut *open {
                recording.write(taped);
            }
        })
    }

    /// As [`Recording::attach_swarm`].
    pub fn attach_swarm(&self, text: &str) {
        if let Some(recording) = &mut *self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            recording.attach_swarm(text);
        }
    }

    /// Takes the recording back, to be closed; `None` the second time.
    pub fn take(&self) -> Option<Recording> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
