//! All that looks at a run on its way.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use flockform::continuum::looks::Looks;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::export::OutputFolder;
use flockform::record::body::BodyMessages;
use flockform::shm::positions::Positions;

use super::recorder::Recorder;
use crate::cli::checkpoint::Checkpointer;
use crate::cli::progress::Progress;

/// Records, publications, progress, checkpoints, and the interrupt that ends them.
pub struct RunObserver<'a> {
    pub recorder: Recorder<'a>,
    /// Whether positions are shown to other processes, and what the rank that writes shows them by.
    pub is_shown: bool,
    pub shown: Option<Positions>,
    pub messages: Option<BodyMessages>,
    pub progress: Progress,
    pub checkpointer: Checkpointer<'a>,
    /// Of the rank that writes.
    pub folder: Option<OutputFolder>,
    pub looks: Looks,
    pub interrupted: &'static AtomicBool,
}

impl Observer for RunObserver<'_> {
    fn next(&mut self, step: usize) -> usize {
        let message = self.messages.as_ref().map_or(usize::MAX, |messages| messages.next(step));
        let asked = self.recorder.next(step).min(self.checkpointer.next(step)).min(message);
        self.looks.next(step).min(asked)
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        self.recorder.step(engine);
        if self.is_shown {
            Positions::show(self.shown.as_mut(), engine);
        }
        if let Some(messages) = &mut self.messages {
            messages.step(engine, residual);
        }
        self.progress.step(engine.step(), residual);
        if self.is_checkpoint_due(engine) && !engine.any_of_parts(self.recorder.failed()) {
            let kept = self.recorder.kept(engine);
            self.checkpointer.keep(self.folder.as_mut(), (engine, residual), kept);
        }
        let stop = self.recorder.failed() || self.interrupted.load(Ordering::Relaxed);
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl RunObserver<'_> {
    /// By the first rank's clock.
    fn is_checkpoint_due(&self, engine: &Engine) -> bool {
        let own = self.checkpointer.is_due(engine.step());
        engine.parted().map_or(own, |team| team.of_first([u64::from(own)]) == [1])
    }
}
