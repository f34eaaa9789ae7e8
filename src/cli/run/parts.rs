//! A run of which each rank has a part of the body, and none the whole: tables, frames for ParaView, and the summary.

use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use flockform::continuum::equilibrium::run_to_equilibrium_shared;
use flockform::continuum::looks::Looks;
use flockform::continuum::parts::laid_out_whole_for;
use flockform::continuum::run::{SharedError, StopReason};
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::export::checkpoint;
use flockform::export::memory::Outputs;
use flockform::export::{
    Drawing, ExportError, OutputFolder, Results, Timings, VtkSeries, probes_of_parts, write_all, write_piece,
};
use flockform::ranks::Team;
use flockform::scene::Scene;

use super::words::{closing_words, where_to_look};
use super::{Prepared, QUICKLY_WRITTEN, RunArguments, exit_code, steps_of};
use crate::cli::checkpoint::{Checkpointer, resume_words};
use crate::cli::output::command_line;
use crate::cli::progress::Progress;
use crate::cli::ranks::{RanksError, Start};
use crate::cli::{FAILED, Refusal, interrupt, print, say};

impl RunArguments {
    /// Whether each rank is to lay out a part of the body: where nothing that is asked for needs the whole.
    pub fn is_parted(&self, scene: &Scene) -> bool {
        let needs_none = self.outputs() == Outputs::TABLES
            && !self.film.is_asked()
            && !self.record.is_asked()
            && self.publish.is_none();
        needs_none && laid_out_whole_for(scene).is_none()
    }
}

/// What looks at a part on its way, on each rank.
struct PartObserver<'a> {
    team: &'a Team,
    scene: &'a Scene,
    /// Indices of the probed particles in the whole body.
    probes: Vec<usize>,
    looks: Looks,
    progress: Option<Progress>,
    /// Of the first rank.
    folder: Option<OutputFolder>,
    frames: Option<VtkSeries>,
    checkpointer: Checkpointer<'a>,
    failure: Option<ExportError>,
    interrupted: &'static AtomicBool,
    writing: Duration,
}

impl PartObserver<'_> {
    fn write_frame(&mut self, engine: &Engine) {
        let start = Instant::now();
        let written = match &mut self.frames {
            Some(frames) => frames.write(engine),
            None => write_piece(engine, self.team),
        };
        self.failure = written.err();
        self.writing += start.elapsed();
    }

    fn keep(&mut self, engine: &Engine, residual: f64) -> bool {
        let Self { folder, frames, checkpointer, team, probes, .. } = self;
        checkpointer.keep_parts(folder.as_mut(), (engine, residual, probes), frames.as_mut(), team)
    }

    /// The last step is written in any case.
    fn finish(&mut self, engine: &Engine) -> Result<(), ExportError> {
        let every = self.scene.record.vtk_every;
        if every > 0 && !engine.step().is_multiple_of(every) && !self.team.any(self.failure.is_some()) {
            self.write_frame(engine);
        }
        match self.failure.take() {
            Some(failure) => Err(failure),
            None => self.frames.take().map_or(Ok(()), |frames| frames.finish().map(drop)),
        }
    }
}

impl Observer for PartObserver<'_> {
    fn next(&mut self, step: usize) -> usize {
        let every = self.scene.record.vtk_every;
        let frame = (step.checked_div(every)).map_or(usize::MAX, |frames| (frames + 1) * every);
        self.looks.next(step).min(frame)
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        let every = self.scene.record.vtk_every;
        if every > 0 && engine.step().is_multiple_of(every) {
            self.write_frame(engine);
        }
        if let Some(progress) = &self.progress {
            progress.step(engine.step(), residual);
        }
        // By the first rank's clock.
        let [is_due] = self.team.of_first([u64::from(self.checkpointer.is_due(engine.step()))]);
        if is_due == 1 && !self.team.any(self.failure.is_some()) {
            self.keep(engine, residual);
        }
        let stop = self.failure.is_some() || self.interrupted.load(Ordering::Relaxed);
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Runs a part, on each rank; the first one writes, but for frames, and prints.
pub fn run(
    arguments: &RunArguments,
    team: &Team,
    prepared: Prepared,
    mut begin: Start<'_>,
    start: Instant,
) -> Result<ExitCode, Refusal> {
    let common = prepared.common();
    let Prepared { left, asked, scene, words, mut plan, digest, .. } = prepared;
    begin.agree(common)?;
    let mut folder: Option<OutputFolder> = None;
    let mut frames = None;
    if team.is_first() {
        let mut own = match &left {
            Some(left) => left.open()?,
            None => arguments.output.folder(&scene.name)?,
        };
        own.set_command(command_line(asked.arguments()));
        frames = match (scene.record.vtk_every, &left) {
            (0, _) => None,
            (_, None) => Some(VtkSeries::create(&own)?),
            (every, Some(left)) => Some(left.frames(&own, every)?),
        };
        folder = Some(own);
    }
    let setup = start.elapsed();
    let owned = plan.setup.body.owned();
    tracing::info!("planned {} of {} particles in {setup:.1?}", owned.len(), plan.setup.body.total());
    let mut observer = PartObserver {
        team,
        scene: &scene,
        probes: plan.probes.clone(),
        looks: Looks::new(&plan, false),
        progress: team.is_first().then(|| Progress::of_steps(arguments.output.quiet, steps_of(&scene))),
        folder,
        frames,
        checkpointer: Checkpointer::new(&arguments.checkpoints, (asked, &scene, digest), left.as_ref()),
        failure: None,
        interrupted: if team.is_first() { interrupt::keeps() } else { interrupt::serves() },
        writing: Duration::ZERO,
    };
    begin.begin(common)?;
    if let (Some(probes), Some(left)) = (&mut plan.setup.probes, &left) {
        *probes = left.checkpoint.probes.to_vec();
    }
    let from = left.map(|left| (left.checkpoint.engine, left.checkpoint.residual));
    let outcome = run_to_equilibrium_shared(&scene, plan, from, team, &mut observer);
    let outcome = outcome.map_err(|error| match error {
        SharedError::Scene(error) if team.is_first() => Refusal::from(error),
        _ => RanksError::SaidElsewhere.into(),
    })?;
    let elapsed = observer.checkpointer.stepping();
    observer.progress.take().into_iter().for_each(Progress::finish);
    let is_interrupted = outcome.reason == StopReason::Interrupted;
    let is_left = is_interrupted
        && observer.checkpointer.is_asked()
        && !team.any(observer.failure.is_some())
        && observer.keep(&outcome.engine, outcome.residual);
    if is_left && outcome.engine.body().total() > QUICKLY_WRITTEN {
        if let Some(folder) = &observer.folder {
            interrupt::says_at_once(&resume_words(folder));
        }
        return Ok(ExitCode::from(FAILED));
    }
    let finished = observer.finish(&outcome.engine);
    let writing = observer.writing;
    if team.any(finished.is_err()) {
        return Err(finished.map_or_else(Refusal::from, |()| RanksError::SaidElsewhere.into()));
    }
    let timings = Timings { setup, steps: elapsed.saturating_sub(writing), output: writing };
    let folder = observer.folder.take();
    let probes = &probes_of_parts(&outcome.engine, &observer.probes, team)[..];
    let (snapshots, load_steps) = (&[], &[]);
    let results = Results { scene: &scene, outcome: &outcome, snapshots, probes, load_steps, timings };
    let drawing = Drawing { formats: arguments.figures.figures, ..Drawing::default() };
    let (_, summary) = write_all(folder.as_ref(), &results, drawing)?;
    let Some(folder) = folder else { return Ok(ExitCode::SUCCESS) };
    let kept = interrupt::commit(folder)?;
    if !is_interrupted {
        checkpoint::remove(&kept);
    }
    if arguments.json {
        print(&format!("{:#}\n", serde_json::json!(summary)))?;
    } else if !arguments.output.quiet {
        say(&words)?;
        say(&(closing_words(&scene, &outcome, &summary, elapsed) + &where_to_look(&kept)))?;
    }
    Ok(exit_code(&outcome))
}
