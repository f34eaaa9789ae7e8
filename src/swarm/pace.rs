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
        Self { start, period: 1.0 / rate, tick: 0 }
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
        Due::Now { missed }
    }

    /// Another rate \[Hz\], from the next tick on.
    pub fn set_rate(&mut self, now: f64, rate: f64) {
        *self = Self::new(now + 1.0 / rate, rate);
    }

    /// Time at `now` since the tick that was begun last was due; 0 before there was one.
    fn lateness(&self, now: f64) -> f64 {
        self.tick.checked_sub(1).map_or(0.0, |tick| now - (self.start + tick as f64 * self.period))
    }
}

/// The schedule of ticks on a clock of which a reading comes now and then: a simulator's. Pure.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Followed {
    rate: f64,
    /// Last reading \[s\].
    last: f64,
    /// None before the first reading of a run.
    deadlines: Option<Deadlines>,
}

impl Followed {
    fn new(rate: f64) -> Self {
        Self { rate, last: f64::NEG_INFINITY, deadlines: None }
    }

    /// The number of ticks that were missed, where one is due at the reading `now` \[s\]. A clock that went back begins anew.
    fn due(&mut self, now: f64) -> Option<u64> {
        let last = std::mem::replace(&mut self.last, now);
        let running = self.deadlines.filter(|_| now >= last);
        // Half a period off the first reading: steps of about a period, to the rounding of stamps, then bring a tick each.
        let mut deadlines = running.unwrap_or(Deadlines::new(now - 0.5 / self.rate, self.rate));
        let due = deadlines.due(now);
        self.deadlines = Some(deadlines);
        match due {
            Due::In(_) => None,
            Due::Now { missed } => Some(missed),
        }
    }

    /// Another rate \[Hz\], from the next tick on.
    fn set_rate(&mut self, rate: f64) {
        self.rate = rate;
        if let Some(deadlines) = &mut self.deadlines {
            deadlines.set_rate(self.last - 0.5 / rate, rate);
        }
    }
}

/// How often a loop that follows a clock reads it \[s\].
const LOOK: Duration = Duration::from_millis(1);

/// Sleeps until each deadline, on the computer's monotonic clock or on one that the caller reads.
pub struct Pace {
    origin: Instant,
    deadlines: Deadlines,
    followed: Option<Followed>,
}

impl Pace {
    /// The first tick is due at once; `rate` \[Hz\] above 0.
    pub fn new(rate: f64) -> Self {
        Self { origin: Instant::now(), deadlines: Deadlines::new(0.0, rate), followed: None }
    }

    /// As [`Pace::new`], for [`Pace::follow`].
    pub fn following(rate: f64) -> Self {
        Self { followed: Some(Followed::new(rate)), ..Self::new(rate) }
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

    /// Time since the tick that was begun last was due \[s\].
    pub fn lateness(&self) -> f64 {
        self.deadlines.lateness(self.origin.elapsed().as_secs_f64())
    }

    /// Sleeps until a tick is due by the clock that `read` reads \[s\], where it has a reading, and returns how many were
    /// missed before it; at most for a period of the computer's, and `None` where no tick is due by then: there is more to
    /// be done than ticks. Of a pace that follows no clock, [`Pace::wait`].
    pub fn follow(&mut self, read: &mut dyn FnMut() -> Option<f64>) -> Option<u64> {
        loop {
            let Some(followed) = &mut self.followed else { return Some(self.wait()) };
            if let Some(missed) = read().and_then(|now| followed.due(now)) {
                return Some(missed);
            }
            match self.due() {
                Due::In(rest) => std::thread::sleep(Duration::from_secs_f64(rest.max(1e-6)).min(LOOK)),
                Due::Now { .. } => return None,
            }
        }
    }

    /// Another rate \[Hz\], from the next tick on.
    pub fn set_rate(&mut self, rate: f64) {
        self.followed.iter_mut().for_each(|followed| followed.set_rate(rate));
        self.deadlines.set_rate(self.origin.elapsed().as_secs_f64(), rate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs `ticks` ticks on a clock of which each tick takes `work` and each sleep oversleeps.
    fn begun(rate: f64, ticks: usize, work: impl Fn(usize) -> f64, oversleep: f64) -> (Vec<f64>, u64) {
        let mut deadlines = Deadlines::new(0.0, rate);
        let (mut now, mut all_missed) = (0.0, 0);
        let mut begun = Vec::new();
        while begun.len() < ticks {
            match deadlines.due(now) {
                Due::In(rest) => now += rest + oversleep,
                Due::Now { missed } => {
                    all_missed += missed;
                    begun.push(now);
                    now += work(begun.len() - 1);
                }
            }
        }
        (begun, all_missed)
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
        let mut one = Deadlines::new(1.0, 10.0);
        assert_eq!(
            (one.lateness(1.5), one.due(1.42), one.due(1.42)),
            (0.0, Due::Now { missed: 4 }, Due::In(1.5 - 1.42))
        );
        assert!((one.lateness(1.47) - 0.07).abs() < 1e-12, "by the last that was due");
        for pair in begun.windows(2) {
            assert!(pair[1] - pair[0] > 0.04, "{pair:?}");
        }
        let expected = 23.0 * 0.1;
        assert!((begun[19] - expected).abs() < 1e-6, "{}", begun[19]);
    }

    /// The readings at which ticks are due, and how many were missed.
    fn followed(rate: f64, readings: impl IntoIterator<Item = f64>) -> (Vec<f64>, u64) {
        let mut followed = Followed::new(rate);
        let due: Vec<_> = readings.into_iter().filter_map(|now| Some((now, followed.due(now)?))).collect();
        (due.iter().map(|(now, _)| *now).collect(), due.iter().map(|(_, missed)| missed).sum())
    }

    #[test]
    fn a_followed_clock_brings_a_tick_a_period_of_its_own_and_none_while_it_stands() {
        // Ten seconds of a clock that stands for a while, read far more often than it moves.
        let fine = (0..10_000).flat_map(|k| [100.0 + 1e-3 * f64::from(k); 3]);
        let standing = std::iter::repeat_n(110.0, 5000);
        let (ticks, missed) = followed(20.0, fine.chain(standing));
        assert!((200..=201).contains(&ticks.len()) && missed == 0, "{} ticks, {missed} missed", ticks.len());
        // Steps of a period, as stamps round them and as a busy simulator sends them.
        let steps: Vec<f64> =
            (0..1000).map(|k| 0.05 * f64::from(k) + 0.02 * (0.7 * f64::from(k)).sin()).collect();
        assert_eq!(followed(20.0, steps.clone()), (steps, 0));
        // What it leaps over is left out, and a new run begins at once.
        let (ticks, missed) = followed(10.0, [5.0, 5.1, 1005.1, 1005.2, 3.0, 3.1]);
        assert_eq!((ticks.len(), missed), (6, 9999));
    }

    #[test]
    fn another_rate_of_a_followed_clock_begins_one_of_its_periods_later() {
        let mut one = Followed::new(10.0);
        assert_eq!(one.due(7.0), Some(0));
        one.set_rate(100.0);
        assert_eq!([7.0, 7.004, 7.01, 7.02].map(|now| one.due(now)), [None, None, Some(0), Some(0)]);
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
