//! The threads of the middleware, as the system shows them.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// Threads that RustDDS has in this process \[1\]; 0 where the system does not say.
pub fn count() -> usize {
    all().count()
}

/// How long they have been ready to run without a processor since they began, all together \[s\]; 0 where the system does
/// not say. A wait is counted when it ends (Linux, Documentation/scheduler/sched-stats.rst).
pub fn waited() -> Duration {
    Duration::from_nanos(all().filter_map(|thread| wait(&thread)).sum())
}

fn all() -> impl Iterator<Item = PathBuf> {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let is_theirs = |thread: &PathBuf| {
        std::fs::read_to_string(thread.join("comm")).is_ok_and(|name| name.starts_with("RustDDS"))
    };
    threads.map(|thread| thread.path()).filter(is_theirs)
}

/// The second number \[ns\].
fn wait(thread: &Path) -> Option<u64> {
    std::fs::read_to_string(thread.join("schedstat")).ok()?.split_whitespace().nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_that_a_thread_waits_for_a_processor_is_known_and_only_grows() {
        let waited = || wait(Path::new("/proc/thread-self")).expect("a system that counts it");
        let before = waited();
        std::thread::sleep(Duration::from_millis(1));
        assert!(waited() >= before);
        assert_eq!(wait(Path::new("/proc/self/task/0")), None, "of no thread");
    }
}
