//! Processes that end with their test.

use std::process::Child;
use std::time::Duration;

use crate::signals::signal;
use crate::waits::within;

/// Longest wait for a process that has been asked to end.
const PATIENCE: Duration = Duration::from_secs(30);

/// A process that ends with its test, whatever becomes of that.
pub struct Running(pub Child);

impl Running {
    /// Ends it as a user does (SIGTERM) and returns its exit status.
    pub fn terminate(&mut self) -> Option<i32> {
        signal("TERM", self.0.id());
        within(PATIENCE, "the process ends", || self.0.try_wait().expect("a child")).code()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // SIGKILL; an error means that it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
