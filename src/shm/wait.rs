//! Sleeping until something arrives or is due.

use std::fmt::Display;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::prelude::{CallbackProgression, SignalHandlingMode, WaitSetBuilder, ipc};

use super::ShmError;

/// Longest sleep, within which a request to stop is obeyed.
const LONGEST: Duration = Duration::from_millis(100);

/// The bell that wakes a reader; shared, so that a loop can wait for it while it uses the reader.
pub type Bell = Rc<Listener<ipc::Service>>;

/// Calls `next` until `stop` is set: at once, whenever a bell rings (with `true`), and when the time it returned has
/// passed. `next` has to take what arrived, or the bell rings on.
///
/// # Errors
/// A computer that gives no file descriptor to wait on.
pub fn keep(
    bells: &[Bell],
    stop: &AtomicBool,
    next: &mut dyn FnMut(bool) -> Duration,
) -> Result<(), ShmError> {
    let refused = |error: &dyn Display| ShmError::Refused(format!("cannot wait for what arrives: {error}"));
    let builder = WaitSetBuilder::new().signal_handling_mode(SignalHandlingMode::Disabled);
    let set = builder.create::<ipc::Service>().map_err(|error| refused(&error))?;
    let mut guards = Vec::with_capacity(bells.len());
    for bell in bells {
        guards.push(set.attach_notification(&**bell).map_err(|error| refused(&error))?);
    }
    let mut arrived = false;
    while !stop.load(Ordering::Relaxed) {
        let rest = next(std::mem::take(&mut arrived)).min(LONGEST);
        let mut ring = |_| {
            arrived = true;
            CallbackProgression::Continue
        };
        set.wait_and_process_once_with_timeout(&mut ring, rest).map_err(|error| refused(&error))?;
    }
    Ok(())
}
