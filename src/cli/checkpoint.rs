//! Checkpoints of a stepped run: when one is due, and how a run is taken up again.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, Instant};

use clap::Args;
use flockform::continuum::plan::Plan;
use flockform::engine::Engine;
use flockform::engine::state::EngineState;
use flockform::export::checkpoint::{Checkpoint, CheckpointError, RunRequest};
use flockform::export::report::RunRecorder;
use flockform::export::shell::quoted;
use flockform::export::{ExportError, OutputFolder, Records, VtkSeries, out_of, unfinished};
use flockform::scene::Scene;

use super::interrupt;

/// The interval when none is asked for.
const EVERY_MINUTE: &str = "60s";

#[derive(Debug, Args)]
pub struct CheckpointArguments {
    /// Interval between checkpoints, from which a killed run can be resumed: 60s, 10min, 2h, 5000steps or
    /// never; may be given twice
    #[arg(long, value_name = "INTERVAL", default_value = EVERY_MINUTE)]
    checkpoint_every: Vec<Interval>,
    /// Resume the killed or interrupted run with this --out; results are the same to the bit
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "force", "record"])]
    pub resume: Option<PathBuf>,
}

/// Most work that a killed run loses.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Interval {
    Time(Duration),
    Steps(usize),
    Never,
}

impl FromStr for Interval {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("`{text}` is no interval: give a number above 0 with ms, s, min, h or steps, or never")
        };
        let text = text.trim();
        if text == "never" {
            return Ok(Interval::Never);
        }
        let unit = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e').ok_or_else(wrong)?;
        let (number, unit) = (text[..unit].trim(), &text[unit..]);
        if matches!(unit, "steps" | "step") {
            let steps: usize = number.parse().map_err(|_| wrong())?;
            return if steps > 0 { Ok(Interval::Steps(steps)) } else { Err(wrong()) };
        }
        let seconds = match unit {
            "ms" => 1e-3,
            "s" => 1.0,
            "min" => 60.0,
            "h" => 3600.0,
            _ => return Err(wrong()),
        };
        let number: f64 = number.parse().map_err(|_| wrong())?;
        let time = Duration::try_from_secs_f64(number * seconds).map_err(|_| wrong())?;
        if time.is_zero() { Err(wrong()) } else { Ok(Interval::Time(time)) }
    }
}

impl CheckpointArguments {
    /// A warning where checkpoints are asked for and there will be none.
    pub fn caution(&self, scene: &Scene) -> Option<&'static str> {
        let is_asked = self
            .checkpoint_every
            .iter()
            .any(|&one| one != Interval::Never && Ok(one) != EVERY_MINUTE.parse());
        (is_asked && scene.equilibrium.is_some()).then_some(
            "--checkpoint-every is without effect: this scene is solved for its rest, which is done again from the start",
        )
    }

    /// The intervals asked for, as text.
    pub fn every(&self) -> String {
        format!("{:?}", self.checkpoint_every)
    }

    /// The run to go on with, if that is asked for.
    pub fn left(&self) -> Result<Option<ResumedRun>, CheckpointError> {
        self.resume.as_deref().map(ResumedRun::find).transpose()
    }
}

/// A run that was killed or interrupted.
pub struct ResumedRun {
    pub checkpoint: Checkpoint<'static>,
    /// Of the checkpoint as it was read, on every rank alike.
    pub fingerprint: u64,
    /// Where it stands.
    folder: PathBuf,
    /// Where its results shall go.
    out: PathBuf,
}

impl ResumedRun {
    /// A killed run stands beside the place of its results, an interrupted one in it.
    fn find(dir: &Path) -> Result<Self, CheckpointError> {
        let out = out_of(dir);
        for folder in [unfinished(&out), out.clone()] {
            if let Some(mut checkpoint) = Checkpoint::read(&folder)? {
                let fingerprint = checkpoint.fingerprint();
                // Results of an interrupted run are replaced by those of the run that goes on, however often that is taken up.
                checkpoint.asked.force |= folder == out;
                return Ok(Self { checkpoint, fingerprint, folder, out });
            }
        }
        Err(CheckpointError::Nothing { unfinished: unfinished(&out), out })
    }

    /// Makes its state that of the body, or of the part of it, that the plan has; refuses to go on with another scene.
    pub fn fit(&mut self, scene: &Scene, plan: &Plan, digest: u64) -> Result<(), CheckpointError> {
        self.checkpoint.require_of(&self.folder, scene, digest)?;
        self.checkpoint.join(&self.folder, &plan.setup)
    }

    /// Steps whose configurations are to be drawn and were not kept, as no figures were asked for then.
    pub fn undrawn(&self, scene: &Scene) -> Vec<usize> {
        let Checkpoint { engine, records, .. } = &self.checkpoint;
        let Records { snapshots, drawn, .. } = &**records;
        let kept = || snapshots.iter().map(|one| one.step).chain(drawn.iter().map(|one| one.step));
        let is_missing = |figure: &usize| *figure <= engine.step() && kept().all(|one| one != *figure);
        scene.record.figures.iter().copied().filter(is_missing).collect()
    }

    /// The folder to go on filling.
    pub fn open(&self) -> Result<OutputFolder, ExportError> {
        let open = if self.folder == self.out { OutputFolder::create } else { OutputFolder::reopen };
        open(&self.out, self.checkpoint.asked.force)
    }

    /// The frames that were written before the checkpoint.
    pub fn frames(&self, folder: &OutputFolder, every: usize) -> Result<VtkSeries, ExportError> {
        let from = if self.folder == self.out { &self.out } else { folder.folder() };
        VtkSeries::resume(folder, from, (0..=self.checkpoint.engine.step()).step_by(every))
    }

    /// The error for an engine that does not fit the checkpoint.
    pub fn foreign(folder: &OutputFolder, what: &dyn std::error::Error) -> CheckpointError {
        CheckpointError::foreign(folder.folder().to_owned(), &what.to_string())
    }
}

/// The records so far, with those of the report and the frames.
pub struct Recorded<'a> {
    pub records: &'a Records,
    pub animation: Option<&'a RunRecorder>,
    pub frames: Option<&'a mut VtkSeries>,
}

/// Writes checkpoints when they are due.
pub struct Checkpointer<'a> {
    every: &'a [Interval],
    asked: RunRequest,
    scene: &'a Scene,
    digest: u64,
    start: Instant,
    /// Time that earlier runs have taken.
    before: Duration,
    last: Instant,
    last_step: usize,
    /// The step of the one in the folder.
    written: Option<usize>,
    /// Whether the last one could not be written: each one more is no news.
    has_failed: bool,
}

impl<'a> Checkpointer<'a> {
    pub fn new(
        arguments: &'a CheckpointArguments,
        (asked, scene, digest): (RunRequest, &'a Scene, u64),
        left: Option<&ResumedRun>,
    ) -> Self {
        let (before, last_step) = left
            .map_or((Duration::ZERO, 0), |left| (left.checkpoint.stepping, left.checkpoint.engine.step()));
        let start = Instant::now();
        Self {
            every: &arguments.checkpoint_every,
            asked,
            scene,
            digest,
            start,
            before,
            last: start,
            last_step,
            written: left.map(|_| last_step),
            has_failed: false,
        }
    }

    /// Time taken for the steps by this run and those before it.
    pub fn stepping(&self) -> Duration {
        self.before + self.start.elapsed()
    }

    /// The next step at which one is due for its number.
    pub fn next(&self, step: usize) -> usize {
        let due = self.every.iter().filter_map(|interval| match interval {
            Interval::Steps(steps) if self.scene.equilibrium.is_none() => {
                Some(self.last_step.saturating_add(*steps))
            }
            _ => None,
        });
        due.filter(|due| *due > step).min().unwrap_or(usize::MAX)
    }

    pub fn is_due(&self, step: usize) -> bool {
        // A solved body has no way to go on.
        self.scene.equilibrium.is_none()
            && self.every.iter().any(|interval| match interval {
                Interval::Time(time) => self.last.elapsed() >= *time,
                Interval::Steps(steps) => step >= self.last_step.saturating_add(*steps),
                Interval::Never => false,
            })
    }

    /// Keeps the run as it is now, to be gone on with if it is killed, by all ranks together where each has a part of the body;
    /// the first one has the folder and the frames. One that cannot be written does not end the run.
    pub fn keep(
        &mut self,
        folder: Option<&mut OutputFolder>,
        engine: (&Engine, f64),
        mut kept: Recorded<'_>,
    ) {
        (self.last_step, self.last) = (engine.0.step(), Instant::now());
        let is_first = folder.is_some();
        let synced = kept.frames.as_mut().map_or(Ok(()), |frames| frames.sync());
        match self.write(folder, engine, &kept, synced) {
            Ok(()) => {
                let took = self.last.elapsed();
                tracing::debug!("checkpoint of step {} in {took:.1?}", self.last_step);
                if std::mem::take(&mut self.has_failed) && is_first {
                    tracing::warn!("checkpoints are written again, at step {}", self.last_step);
                }
            }
            Err(error) => {
                interrupt::leave_to_the_end();
                if !std::mem::replace(&mut self.has_failed, true) {
                    warn_of(&format!("no checkpoint at step {} and on", self.last_step), &error);
                }
            }
        }
        self.last = Instant::now();
    }

    /// Whether a run that is broken off is to be gone on with.
    fn is_asked(&self) -> bool {
        self.every.iter().any(|interval| *interval != Interval::Never)
    }

    /// Leaves a checkpoint of the last step, and says whether there is one. Frames are on their way to the disk then: to wait
    /// for each would take longer than an interrupt may.
    pub fn leave(
        &mut self,
        folder: Option<&mut OutputFolder>,
        engine: (&Engine, f64),
        kept: &Recorded<'_>,
    ) -> bool {
        if self.scene.equilibrium.is_some() || !self.is_asked() {
            return false;
        }
        let left = self.write(folder, engine, kept, Ok(()));
        if let Err(error) = &left {
            interrupt::leave_to_the_end();
            warn_of("no checkpoint of the end", error);
        }
        !engine.0.any_of_parts(left.is_err())
    }

    /// Writes it, once the frames are there as `synced` says, before the folder takes its name: that one is never without a
    /// checkpoint.
    fn write(
        &mut self,
        mut folder: Option<&mut OutputFolder>,
        (engine, residual): (&Engine, f64),
        kept: &Recorded<'_>,
        synced: Result<(), ExportError>,
    ) -> Result<(), ExportError> {
        if self.written != Some(engine.step()) {
            self.write_anew(folder.as_deref().map(OutputFolder::folder), (engine, residual), kept, synced)?;
            self.written = Some(engine.step());
        }
        folder.as_mut().map_or(Ok(()), |folder| interrupt::keep_unfinished(folder, resume_words))
    }

    fn write_anew(
        &self,
        folder: Option<&Path>,
        (engine, residual): (&Engine, f64),
        kept: &Recorded<'_>,
        synced: Result<(), ExportError>,
    ) -> Result<(), ExportError> {
        let of = (&self.asked, self.scene, self.digest);
        let animation = kept.animation.map(RunRecorder::animation_state);
        // A run is gone on with by the records of the first rank.
        let records = if folder.is_some() { Cow::Borrowed(kept.records) } else { Cow::default() };
        let state = (EngineState::of(engine), residual);
        let checkpoint = Checkpoint::new(of, state, (records, animation), self.stepping());
        if let Some(team) = engine.parted() {
            let first = engine.body().index_from(engine.body().owned().start);
            return checkpoint.write_in_parts(folder, (first, team), synced);
        }
        synced?;
        folder.map_or(Ok(()), |folder| checkpoint.write(folder))
    }
}

/// Says why there is no checkpoint; where another rank is at fault, that one does.
fn warn_of(what: &str, error: &ExportError) {
    if !matches!(error, ExportError::OnRank { .. }) {
        tracing::warn!("{what}: {error}");
    }
}

/// The message of a run that is left to be gone on with.
pub fn resume_words(folder: &OutputFolder) -> String {
    let folder = quoted(&folder.folder().to_string_lossy());
    format!("interrupted: `flockform run --resume {folder}` goes on")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_a_number_with_its_unit() {
        let read = |text: &str| text.parse::<Interval>();
        assert_eq!(read("60s"), Ok(Interval::Time(Duration::from_secs(60))));
        assert_eq!(read("1.5 min"), Ok(Interval::Time(Duration::from_secs(90))));
        assert_eq!(read("2h"), Ok(Interval::Time(Duration::from_secs(7200))));
        assert_eq!(read("250ms"), Ok(Interval::Time(Duration::from_millis(250))));
        assert_eq!(read("1e3s"), Ok(Interval::Time(Duration::from_secs(1000))));
        assert_eq!(read("500steps"), Ok(Interval::Steps(500)));
        assert_eq!(read("never"), Ok(Interval::Never));
        for wrong in ["", "60", "0s", "-1s", "nan s", "0steps", "1.5steps", "3weeks", "1e400s", "s"] {
            let error = read(wrong).expect_err(wrong);
            assert!(error.contains("min, h or steps"), "{error}");
        }
    }
}
