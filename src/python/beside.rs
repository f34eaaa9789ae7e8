//! Computes beside the interpreter: other Python threads go on, and Ctrl-C ends the wait.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;

use super::threads::Threads;
use crate::engine::Engine;

/// Time between two looks for a signal.
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);
/// How long work may take to notice that it is to end; what does not notice goes on unseen, and its result is dropped.
const GRACE: Duration = Duration::from_millis(500);

/// Seen by the work and by the thread that waits for it.
pub(super) struct Progress {
    /// Raised for the work to end.
    pub(super) flag: &'static AtomicBool,
    /// Whether the flag is another's by now.
    is_over: Mutex<bool>,
    step: AtomicUsize,
    residual: AtomicU64,
}

impl Progress {
    fn new() -> Self {
        let (flag, is_over) = (taken_flag(), Mutex::new(false));
        let residual = AtomicU64::new(f64::INFINITY.to_bits());
        Self { flag, is_over, step: AtomicUsize::new(0), residual }
    }

    /// Tells the work to end, unless it has.
    fn end(&self) {
        let is_over = self.is_over.lock().unwrap_or_else(PoisonError::into_inner);
        if !*is_over {
            self.flag.store(true, Ordering::Relaxed);
        }
    }

    /// Gives the flag back. The work itself does it once it is done, so that no other work sees the flag of one that still
    /// has to end.
    fn give_back(&self) {
        *self.is_over.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.flag.store(false, Ordering::Relaxed);
        FLAGS.lock().unwrap_or_else(PoisonError::into_inner).push(self.flag);
    }

    /// Reports the step that the work has come to, and breaks it off once it is to end.
    pub(super) fn see(&self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        self.step.store(engine.step(), Ordering::Relaxed);
        self.residual.store(residual.to_bits(), Ordering::Relaxed);
        if self.flag.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Ends work that looks at no flag of its own, once it is to end; [`beside`] catches it.
    pub(super) fn leave_if_raised(&self) {
        if self.flag.load(Ordering::Relaxed) {
            resume_unwind(Box::new("no caller waits any more"));
        }
    }

    fn call(&self, callback: &Bound<'_, PyAny>) -> PyResult<()> {
        let residual = f64::from_bits(self.residual.load(Ordering::Relaxed));
        callback.call1((self.step.load(Ordering::Relaxed), residual)).map(drop)
    }
}

/// Does `work` in a thread of its own and waits for it, with the interpreter free. `callback`, if there is one, is called
/// in the waiting thread with the step and the residual, several times a second.
///
/// # Errors
/// What a signal raises (`KeyboardInterrupt`), what `callback` raises, one that cannot be called, and work that panicked.
pub(super) fn beside<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> T + Send + 'static,
) -> PyResult<T> {
    if callback.is_some_and(|callback| !callback.is_callable()) {
        let message = "progress cannot be called: give a function of a step and a residual, or leave it out";
        return Err(PyTypeError::new_err(message));
    }
    let threads = Threads::taken()?;
    let progress = Arc::new(Progress::new());
    let (send, receive) = sync_channel(1);
    let receive = Mutex::new(receive);
    let shown = Arc::clone(&progress);
    let job = move || {
        let result = catch_unwind(AssertUnwindSafe(|| threads.install(|| work(&shown))));
        drop(threads);
        shown.give_back();
        // What was interrupted has no caller any more.
        let _ = send.send(result);
    };
    std::thread::Builder::new().name("flockform".into()).spawn(job)?;
    loop {
        let result = wait(py, &receive, BETWEEN_LOOKS);
        match result {
            Ok(result) => return result.map_err(|panic| panicked(&*panic)),
            Err(RecvTimeoutError::Disconnected) => return Err(panicked(&"its thread ended")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let seen = py.check_signals().and_then(|()| callback.map_or(Ok(()), |one| progress.call(one)));
        if let Err(error) = seen {
            progress.end();
            let _ = wait(py, &receive, GRACE);
            return Err(error);
        }
    }
}

/// Waits with the interpreter free.
fn wait<T: Send>(
    py: Python<'_>,
    receive: &Mutex<Receiver<T>>,
    time: Duration,
) -> Result<T, RecvTimeoutError> {
    py.detach(|| receive.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(time))
}

fn panicked(panic: &dyn std::any::Any) -> PyErr {
    let words = panic.downcast_ref::<&str>().map(|words| (*words).to_owned());
    let words = words.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    PyRuntimeError::new_err(format!("flockform has a fault, please report it: {words}"))
}

/// Flags not in use: solvers keep theirs for as long as a program lives, so they are used again.
static FLAGS: Mutex<Vec<&'static AtomicBool>> = Mutex::new(Vec::new());

fn taken_flag() -> &'static AtomicBool {
    let free = FLAGS.lock().unwrap_or_else(PoisonError::into_inner).pop();
    free.unwrap_or_else(|| Box::leak(Box::new(AtomicBool::new(false))))
}
