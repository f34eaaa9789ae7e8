//! Bounded waits.

use std::time::{Duration, Instant};

/// What `look` finds before the patience is over.
pub fn within<T>(patience: Duration, what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let since = Instant::now();
    while since.elapsed() < patience {
        if let Some(found) = look() {
            return found;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    panic!("{what}: not within {patience:?}");
}
