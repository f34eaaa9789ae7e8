//! The pace of a loop: deadlines at whole periods from a start, so that lateness never adds up. The one place of
//! this room that has a clock, for the edges that fly in real time.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The computer's time \[s since the Unix epoch\].
pub fn system_time() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// The schedule of ticks, on a clock that the caller reads \[s\]. Pure: [`Pace`] sleeps by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deadlines {
    start: f64,
    period: f64,
    /// Tick that was begun last, counted in periods from the start.
    tick: u64,
    missed: u64,
}

/// The action due at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Due {
    /// Sleep this long \[s\].
    In(f64),
    /// Do the tick; so many before it were missed and are left out.
    Now {
        /// Ticks that are left out.
        missed: u64,
    },
}

impl Deadlines {
    /// The first tick is due at `start`; `rate` \[Hz\] above 0.
    pub fn new(start: f64, rate: f64) -> Self {
        Self { start, period: 1.0 / rate, tick: 0, missed: 0 }
    }

    /// Returns the action due at `now`. After [`Due::Now`] the tick counts as begun.
    pub fn due(&mut self, now: f64) -> Due {
        let next = self.start + self.tick as f64 * self.period;
        if now < next {
            return Due::In(next - now);
        }
        // Ticks whose whole period has passed are left out: a late loop must not answer with a burst.
        let missed = ((now - next) / self.period) as u64;
        self.tick += missed + 1;
        self.missed += missed;
        Due::Now { missed }
    }

    /// Another rate \[Hz\], from the next tick on.
    pub fn set_rate(&mut self, now: f64, rate: f64) {
        let missed = self.missed;
        *self = Self { missed, ..Self::new(now + 1.0 / rate, rate) };
    }

    /// Ticks left out since the beginning \[1\].
    pub fn missed(&self) -> u64 {
        self.missed
    }
}

/// Sleeps until each deadline, on the computer's monotonic clock.
pub struct Pace {
    origin: Instant,
    deadlines: Deadlines,
}

impl Pace {
    /// The first tick is due at once; `rate` \[Hz\] above 0.
    pub fn new(rate: f64) -> Self {
        Self { origin: Instant::now(), deadlines: Deadlines::new(0.0, rate) }
    }

    /// Returns the action due now, for a loop that also waits for something else.
    pub fn due(&mut self) -> Due {
        self.deadlines.due(self.origin.elapsed().as_secs_f64())
    }

    /// Sleeps until the next tick is due; returns how many were missed before it.
    pub fn wait(&mut self) -> u64 {
        loop {
            match self.due() {
                // At least a microsecond: a rest below the clock's resolution must not spin.
                Due::In(rest) => std::thread::sleep(Duration::from_secs_f64(rest.max(1e-6))),
                Due::Now { missed } => return missed,
            }
        }
    }

    /// Another rate \[Hz\], from the next tick on.
    pub fn set_rate(&mut self, rate: f64) {
        self.deadlines.set_rate(self.origin.elapsed().as_secs_f64(), rate);
    }

    /// Ticks left out since the beginning \[1\].
    pub fn missed(&self) -> u64 {
        self.deadlines.missed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs `ticks` ticks on a clock of which each tick takes `work` and each sleep oversleeps.
    fn begun(rate: f64, ticks: usize, work: impl Fn(usize) -> f64, oversleep: f64) -> (Vec<f64>, u64) {
        let mut deadlines = Deadlines::new(0.0, rate);
        let mut now = 0.0;
        let mut begun = Vec::new();
        while begun.len() < ticks {
            match deadlines.due(now) {
                Due::In(rest) => now += rest + oversleep,
                Due::Now { .. } => {
                    begun.push(now);
                    now += work(begun.len() - 1);
                }
            }
        }
        (begun, deadlines.missed())
    }

    #[test]
    fn lateness_of_single_ticks_does_not_add_up() {
        let (begun, missed) = begun(100.0, 1000, |_| 0.003, 0.0005);
        assert!((begun[999] - 9.99).abs() < 0.001, "{}", begun[999]);
        assert_eq!(missed, 0);
    }

    #[test]
    fn a_long_tick_leaves_ticks_out_and_is_followed_by_no_burst() {
        let (begun, missed) = begun(10.0, 20, |tick| if tick == 4 { 0.55 } else { 0.01 }, 0.0);
        assert_eq!(missed, 4);
        for pair in begun.windows(2) {
            assert!(pair[1] - pair[0] > 0.04, "{pair:?}");
        }
        let expected = 23.0 * 0.1;
        assert!((begun[19] - expected).abs() < 1e-6, "{}", begun[19]);
    }

    #[test]
    fn another_rate_begins_one_of_its_periods_later() {
        let mut deadlines = Deadlines::new(0.0, 10.0);
        assert_eq!(deadlines.due(0.0), Due::Now { missed: 0 });
        deadlines.set_rate(0.05, 100.0);
        assert!(matches!(deadlines.due(0.05), Due::In(rest) if (rest - 0.01).abs() < 1e-12));
        assert_eq!(deadlines.due(0.061), Due::Now { missed: 0 });
    }
}
