//! Threads that compute, lent to one piece of work at a time: none waits behind another's, such as one that an interrupt
//! could not end.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::ThreadPool;

/// Most pools that are kept for what comes next.
const MOST_IDLE: usize = 8;

/// Pools that nothing uses, and the process that each is in.
static IDLE: Mutex<Vec<(u32, Arc<ThreadPool>)>> = Mutex::new(Vec::new());

/// A pool of threads, given back when it is dropped. `RAYON_NUM_THREADS` says how many threads it has; without it there are
/// as many as processors.
pub(super) struct Threads {
    process: u32,
    pool: Arc<ThreadPool>,
}

impl Threads {
    /// A pool of this process. A child that was forked, as `multiprocessing` does it, has none of its parent's threads.
    pub(super) fn taken() -> PyResult<Self> {
        let process = std::process::id();
        while let Some((owner, pool)) = popped() {
            if owner == process {
                return Ok(Self { process, pool });
            }
            // The parent's threads are not here to be ended.
            std::mem::forget(pool);
        }
        let built = rayon::ThreadPoolBuilder::new().thread_name(|_| "flockform-pool".into()).build();
        let pool = Arc::new(built.map_err(|error| PyRuntimeError::new_err(error.to_string()))?);
        Ok(Self { process, pool })
    }

    /// Does `work` in these threads and waits for it.
    pub(super) fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
        if idle.len() < MOST_IDLE {
            idle.push((self.process, Arc::clone(&self.pool)));
        }
    }
}

fn popped() -> Option<(u32, Arc<ThreadPool>)> {
    IDLE.lock().unwrap_or_else(PoisonError::into_inner).pop()
}

/// Does what is short with the interpreter free, and waits for it.
pub(super) fn here<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let threads = Threads::taken()?;
    Ok(py.detach(|| threads.install(work)))
}
