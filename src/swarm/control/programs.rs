//! The time of the leaders' programs: when it begins, stands still and goes on.

/// Time for which others than the leaders are waited for \[s\].
const PATIENCE: f64 = 5.0;

/// How far the leaders' programs are. They stand still while the loop is not running.
#[derive(Clone, Default)]
pub(super) struct Programs {
    /// Periods run since the period last changed.
    run: u64,
    /// Time run before that \[s\].
    run_before: f64,
    periods: u64,
    begun: bool,
    goes_on: bool,
    /// When all leaders had first been heard \[s\].
    led_since: Option<f64>,
}

/// The members heard, of those that are waited for.
pub(super) struct Heard {
    pub all: bool,
    pub every_leader: bool,
    pub a_leader: bool,
}

impl Programs {
    /// The programs of an earlier loop, which had run for a time \[s\] and some periods, or had not begun.
    pub fn continued(time: f64, periods: u64, had_begun: bool) -> Self {
        Self { run_before: time, periods, goes_on: had_begun, ..Self::default() }
    }

    /// Time run so far, where a period takes so long \[s\].
    pub fn time(&self, period: f64) -> f64 {
        self.run_before + self.run as f64 * period
    }

    /// Keeps the time run so far where the period \[s\] is about to change.
    pub fn before_another(&mut self, period: f64) {
        (self.run_before, self.run) = (self.time(period), 0);
    }

    /// Periods run since the beginning.
    pub fn periods(&self) -> u64 {
        self.periods
    }

    /// Whether they have begun in this loop.
    pub fn have_begun(&self) -> bool {
        self.begun
    }

    /// Whether they have begun in this loop or in an earlier one of which it is the continuation.
    pub fn had_begun(&self) -> bool {
        self.begun || self.goes_on
    }

    /// Runs for a period at `now` \[s\], if they have begun or may begin. A program that ran before its leaders were up would be
    /// over before they could follow it.
    pub fn run(&mut self, now: f64, heard: impl FnOnce() -> Heard) -> bool {
        self.begun = self.begun || self.may_begin(now, &heard());
        self.run += u64::from(self.begun);
        self.periods += u64::from(self.begun);
        self.begun
    }

    /// Whether they may begin: all leaders are heard and the others too, or not for some seconds. To begin among robots
    /// that are about to be heard would lead those that are around them.
    fn may_begin(&mut self, now: f64, heard: &Heard) -> bool {
        if heard.all {
            return true;
        }
        // A leader that is lost on the way holds up no program, nor does it where an earlier loop had begun and another is heard.
        let is_led = heard.every_leader || (self.goes_on && heard.a_leader);
        if !is_led {
            self.led_since = None;
            return false;
        }
        let since = self.led_since.filter(|&since| since <= now).unwrap_or(now);
        self.led_since = Some(since);
        now - since >= PATIENCE
    }
}
