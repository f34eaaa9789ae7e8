//! Warnings of messages that are dropped: a line at the first, and then few, however many there are.

use std::collections::BTreeMap;
use std::fmt::Display;

/// Shortest time between two lines of one cause and robot \[s\].
const INTERVAL: f64 = 10.0;

/// The messages dropped of every robot, by cause.
#[derive(Clone, Debug, Default)]
pub struct Complaints {
    dropped: BTreeMap<(&'static str, usize), Dropped>,
}

#[derive(Clone, Copy, Debug)]
struct Dropped {
    /// Time of the last line \[s\].
    warned: f64,
    /// Messages since that line.
    since: u64,
}

impl Complaints {
    /// Counts a message of a robot that was dropped for this cause at `now` \[s\], and warns of it with `text` if a
    /// line is due.
    pub fn warn(&mut self, cause: &'static str, robot: usize, now: f64, text: &dyn Display) {
        match self.count(cause, robot, now) {
            None => {}
            Some(1) => tracing::warn!("{text}"),
            Some(count) => tracing::warn!("{text} ({count} dropped since the last line about it)"),
        }
    }

    /// Counts a message; returns how many were dropped since the last line, this one included, if another line is due.
    fn count(&mut self, cause: &'static str, robot: usize, now: f64) -> Option<u64> {
        let Some(dropped) = self.dropped.get_mut(&(cause, robot)) else {
            self.dropped.insert((cause, robot), Dropped { warned: now, since: 0 });
            return Some(1);
        };
        dropped.since += 1;
        // A clock that was set back must not silence the warnings.
        if (0.0..INTERVAL).contains(&(now - dropped.warned)) {
            return None;
        }
        dropped.warned = now;
        Some(std::mem::take(&mut dropped.since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cause_and_robot_has_a_line_at_the_first_and_then_one_in_ten_seconds() {
        let mut complaints = Complaints::default();
        let mut count = |cause, robot, now| complaints.count(cause, robot, now);
        assert_eq!(count("too old", 3, 100.0), Some(1));
        for k in 1..100 {
            assert_eq!(count("too old", 3, 100.0 + 0.1 * f64::from(k)), None);
        }
        assert_eq!(count("wrong frame", 3, 105.0), Some(1), "another cause");
        assert_eq!(count("too old", 4, 105.0), Some(1), "another robot");
        assert_eq!(count("too old", 3, 110.0), Some(100));
        assert_eq!(count("too old", 3, 119.9), None);
        assert_eq!(count("too old", 3, 1000.0), Some(2));
        assert_eq!(count("too old", 3, 5.0), Some(1), "the clock was set back");
    }
}
