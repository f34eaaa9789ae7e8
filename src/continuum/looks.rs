//! How often a run is looked at while nothing of it is recorded.

use std::time::Duration;

use super::plan::Plan;
use crate::solve::stopwatch::Stopwatch;

/// Longest time between two looks, but for a single step that takes longer.
const BETWEEN_LOOKS: Duration = Duration::from_millis(200);
/// Updates of particles between two looks, at most.
const UPDATES_BETWEEN_LOOKS: usize = 1 << 28;

/// Looks beside those that are recorded: several a second, by the clock, since how long a step takes depends on the rule.
#[derive(Clone, Copy, Debug)]
pub struct Looks {
    /// Most steps between two looks now, and ever.
    most: usize,
    bound: usize,
    /// The last look: when, and at which step.
    last: (Stopwatch, usize),
}

impl Looks {
    /// Looks at each step if `every` or if there are probes that the engine does not record itself.
    pub fn new(plan: &Plan, every: bool) -> Self {
        let every = every || (!plan.probes.is_empty() && plan.setup.probes.is_none());
        let bound = if every { 1 } else { (UPDATES_BETWEEN_LOOKS / plan.count()).max(1) };
        Self { most: 1, bound, last: (Stopwatch::start(), 0) }
    }

    /// The next step to look at; twice as many steps on while all of the last ones were quickly done.
    pub fn next(&mut self, step: usize) -> usize {
        let (then, before) = std::mem::replace(&mut self.last, (Stopwatch::start(), step));
        let took = then.elapsed();
        let most = match took {
            _ if took > BETWEEN_LOOKS => self.most / 2,
            _ if took < BETWEEN_LOOKS / 4 && step - before >= self.most => 2 * self.most,
            _ => self.most,
        };
        self.most = most.clamp(1, self.bound);
        step + self.most
    }
}
