//! All that looks at a run on its way.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use flockform::continuum::plan::Plan;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::export::OutputFolder;
use flockform::record::body::BodyMessages;
use flockform::shm::positions::Positions;

use super::recorder::Recorder;
use super::resume_words;
use crate::cli::checkpoint::Checkpointer;
use crate::cli::interrupt;
use crate::cli::progress::Progress;

/// Longest time between two looks, but for a single step that takes longer.
const BETWEEN_LOOKS: Duration = Duration::from_millis(200);
/// Updates of particles between two looks, at most.
const UPDATES_BETWEEN_LOOKS: usize = 1 << 28;

/// Records, publications, progress, checkpoints, and the interrupt that ends them.
pub struct RunObserver<'a, 'f> {
    pub recorder: Recorder<'a>,
    /// Positions shown to other processes.
    pub shown: Option<Positions>,
    pub messages: Option<BodyMessages>,
    pub progress: Progress,
    pub checkpointer: Checkpointer<'a>,
    pub folder: &'f mut OutputFolder,
    pub looks: Looks,
    pub interrupted: &'static AtomicBool,
}

impl Observer for RunObserver<'_, '_> {
    fn next(&mut self, step: usize) -> usize {
        self.looks.next(step).min(self.recorder.next(step))
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        self.recorder.step(engine);
        if let Some(shown) = &mut self.shown {
            shown.show(engine);
        }
        if let Some(messages) = &mut self.messages {
            messages.step(engine, residual);
        }
        self.progress.step(engine.step(), residual);
        if self.checkpointer.is_due(engine.step())
            && !self.recorder.failed()
            && self.checkpointer.keep(self.folder, (engine, residual), self.recorder.kept())
        {
            // A rank that waits for one that was killed is ended without getting to leave another one.
            interrupt::says(resume_words(self.folder));
        }
        let stop = self.recorder.failed() || self.interrupted.load(Ordering::Relaxed);
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Looks beside those that are recorded: several a second, by the clock, since how long a step takes depends on the rule.
pub struct Looks {
    /// Most steps between two looks now, and ever.
    most: usize,
    bound: usize,
    /// The last look: when, and at which step.
    last: (Instant, usize),
}

impl Looks {
    /// Looks at each step if `every` or if there are probes.
    pub fn new(plan: &Plan, every: bool) -> Self {
        let every = every || !plan.probes.is_empty();
        let bound = if every { 1 } else { (UPDATES_BETWEEN_LOOKS / plan.count()).max(1) };
        Self { most: 1, bound, last: (Instant::now(), 0) }
    }

    /// Twice as many steps while all of the last ones were quickly done.
    fn next(&mut self, step: usize) -> usize {
        let (then, before) = std::mem::replace(&mut self.last, (Instant::now(), step));
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
