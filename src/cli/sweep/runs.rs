//! The runs of a sweep, made in parallel, each on a thread of its own.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::Builder;
use std::time::Instant;

use flockform::continuum::equilibrium::run_to_equilibrium_watched;
use flockform::continuum::run::StopReason;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::export::sweep::{Journal, Output, Probed, Row, SweepError, Values, checksums};
use flockform::export::{ExportError, Measured, Summary, Timings};
use flockform::scene::{Scene, SceneError};
use flockform::study::compare::run::plan;
use flockform::study::design::Design;
use flockform::study::trade::choose;

use super::super::names::{SceneArguments, folder_of};
use super::super::progress::Progress;
use super::super::run::interruptible;
use super::super::{Refusal, interrupt};

/// Updates of particles between two looks at the interrupt, at most: about a tenth of a second.
const UPDATES_BETWEEN_LOOKS: usize = 1 << 23;

/// The runs of a design.
pub struct Runs<'a> {
    pub scene: &'a SceneArguments,
    pub design: &'a Design,
    pub outputs: &'a [Output],
}

/// A run that has ended, and its outputs.
struct Ended {
    stop_reason: StopReason,
    outputs: Vec<Result<String, SweepError>>,
    cautions: Vec<String>,
    files: BTreeMap<String, Option<u32>>,
}

impl Ended {
    /// Whether it has all that such a run has: what diverged may lack some of it.
    fn is_sound(&self) -> bool {
        self.stop_reason.fault().is_none()
    }

    /// The first output that such a run does not have.
    fn misspelt(&self) -> Option<&SweepError> {
        self.outputs.iter().find_map(|output| output.as_ref().err()).filter(|_| self.is_sound())
    }
}

impl Runs<'_> {
    /// Makes the first of these runs before anything is written; where it does not show what a run has, the last too.
    ///
    /// # Errors
    /// Keys that the scene refuses in the first run and in the last; outputs that a run does not have.
    pub fn first(&self, pending: &[usize]) -> Result<Vec<Row>, Refusal> {
        let (run, last) = (pending[0], pending[pending.len() - 1]);
        let first = match self.ended(run) {
            Err(error) if self.scene.load_scene(&self.design.overrides(last)).is_err() => {
                return Err(error.into());
            }
            first => first,
        };
        let shows_all = first.as_ref().is_ok_and(Ended::is_sound) || interrupt::is_raised();
        let mut ended = vec![(run, first)];
        if !shows_all && last != run {
            ended.push((last, self.ended(last)));
        }
        match ended.iter().filter_map(|(_, ended)| ended.as_ref().ok()).find_map(Ended::misspelt) {
            Some(error) => Err(error.clone().into()),
            None => Ok(ended.into_iter().filter_map(|(run, ended)| self.row(run, ended)).collect()),
        }
    }

    /// Refuses outputs of steps that no run can come to, as far as that is known before they are made.
    ///
    /// # Errors
    /// Names the first such output, and the last step of the longest run.
    pub fn require_reached(&self) -> Result<(), Refusal> {
        let factors = &self.design.factors;
        let decides =
            |key: &str| ["stop", "load_steps", "equilibrium"].iter().any(|table| key.starts_with(table));
        let of_steps = factors.iter().position(|factor| factor.key == "stop.steps");
        if factors.iter().enumerate().any(|(k, factor)| Some(k) != of_steps && decides(&factor.key)) {
            return Ok(());
        }
        let steps = |run: &usize| of_steps.and_then(|k| self.design.runs[*run][k].number).unwrap_or(0.0);
        let longest = (0..self.design.runs.len()).max_by(|a, b| steps(a).total_cmp(&steps(b)));
        let scene = longest.and_then(|run| self.scene.load_scene(&self.design.overrides(run)).ok());
        let reached = |scene: Scene| self.outputs.iter().try_for_each(|output| output.require_within(&scene));
        Ok(scene.map_or(Ok(()), reached)?)
    }

    /// Makes these runs after those that are done, and adds each to the journal as it ends; an interrupt leaves out those under way.
    ///
    /// # Errors
    /// No threads, or a journal that cannot be written.
    pub fn make(
        &self,
        (done, pending): (usize, &[usize]),
        journal: &Journal,
        quiet: bool,
    ) -> Result<Vec<Row>, Refusal> {
        let threads = rayon::current_num_threads();
        let workers = threads.min(pending.len());
        // Where there are fewer runs than cores, each gets several.
        let pool = || rayon::ThreadPoolBuilder::new().num_threads((threads / workers).max(1)).build();
        let pools: Vec<_> = (0..workers)
            .map(|_| pool())
            .collect::<Result<_, _>>()
            .map_err(|error: rayon::ThreadPoolBuildError| Refusal::threads(threads, error))?;
        let work = Work {
            runs: self,
            done,
            pending,
            journal,
            next: AtomicUsize::new(0),
            made: Mutex::default(),
            failure: Mutex::default(),
            progress: Progress::of_stages(quiet),
        };
        let spawned = std::thread::scope(|scope| {
            let work = &work;
            let spawned = pools.iter().try_for_each(|pool| {
                let runs = || pool.install(|| while work.one().is_continue() {});
                Builder::new().spawn_scoped(scope, runs).map(drop)
            });
            // Without all of its threads it ends with the runs that are under way.
            spawned.inspect_err(|_| work.next.store(pending.len(), Ordering::Relaxed))
        });
        let Work { made, failure, progress, .. } = work;
        progress.finish();
        spawned.map_err(|error| Refusal::threads(threads, error))?;
        match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error.into()),
            None => Ok(made.into_inner().unwrap_or_else(PoisonError::into_inner)),
        }
    }

    /// The end and the outputs of a run, as `flockform run` makes it.
    fn ended(&self, run: usize) -> Result<Ended, SceneError> {
        let overrides = self.design.overrides(run);
        self.ended_with(&overrides).map_err(|error| error.varied_by(&overrides))
    }

    fn ended_with(&self, overrides: &[String]) -> Result<Ended, SceneError> {
        let start = Instant::now();
        let load = |more: &[String]| self.scene.load_scene(&[overrides, more].concat());
        let scene = interruptible(choose(load(&[])?, &load)?.scene);
        let files = checksums(&scene.raw.files(folder_of(&self.scene.scene).as_deref()));
        let plan = plan(&scene)?;
        let between = (UPDATES_BETWEEN_LOOKS / plan.count().max(1)).max(1);
        let mut observer = Look { outputs: self.outputs, probed: Probed::default(), between };
        let setup = start.elapsed();
        let outcome = run_to_equilibrium_watched(&scene, plan, &mut observer)?;
        let timings = Timings { setup, steps: start.elapsed() - setup, ..Timings::default() };
        let measured = Measured::of(&scene, &outcome).map(|(measured, _)| measured);
        let summary = Summary::new(&scene, &outcome, measured, timings);
        let values = Values { engine: &outcome.engine, summary: &summary, probed: &observer.probed };
        let outputs = values.texts(self.outputs);
        Ok(Ended { outputs, stop_reason: outcome.reason, cautions: summary.cautions, files })
    }

    /// The row of a run; none for one that was broken off.
    fn row(&self, run: usize, ended: Result<Ended, SceneError>) -> Option<Row> {
        match ended {
            Ok(Ended { stop_reason: StopReason::Interrupted, .. }) => None,
            Ok(Ended { stop_reason, outputs, mut cautions, files }) => {
                let missing =
                    outputs.iter().filter_map(|output| output.as_ref().err()).map(SweepError::to_string);
                cautions.extend(missing.map(|error| error.lines().next().unwrap_or_default().to_owned()));
                let outputs = outputs.into_iter().map(Result::unwrap_or_default).collect();
                let reason = stop_reason.fault().unwrap_or_default();
                Some(Row {
                    run,
                    stop_reason: stop_reason.name().to_owned(),
                    outputs,
                    reason,
                    cautions,
                    files,
                })
            }
            // A solve that was broken off has an error as well.
            Err(_) if interrupt::is_raised() => None,
            Err(error) => {
                let words = error.to_string();
                let reason = words.lines().next().unwrap_or_default().to_owned();
                let outputs = vec![String::new(); self.outputs.len()];
                let (stop_reason, cautions, files) = (Row::REFUSED.to_owned(), Vec::new(), BTreeMap::new());
                Some(Row { run, stop_reason, outputs, reason, cautions, files })
            }
        }
    }
}

/// The runs under way.
struct Work<'a> {
    runs: &'a Runs<'a>,
    /// Runs made before these.
    done: usize,
    pending: &'a [usize],
    journal: &'a Journal,
    /// Place in `pending` of the run to be begun next.
    next: AtomicUsize,
    made: Mutex<Vec<Row>>,
    failure: Mutex<Option<ExportError>>,
    progress: Progress,
}

impl Work<'_> {
    /// Makes the next run; breaks off where there is none, or none that could be kept.
    fn one(&self) -> ControlFlow<()> {
        let has_failed = self.failure.lock().unwrap_or_else(PoisonError::into_inner).is_some();
        let place = self.next.fetch_add(1, Ordering::Relaxed);
        let (Some(&run), false) = (self.pending.get(place), has_failed || interrupt::is_raised()) else {
            return ControlFlow::Break(());
        };
        let words = self.runs.design.overrides(run).join(", ");
        let stage = format!("run {} of {}: {words}", self.done + place + 1, self.done + self.pending.len());
        self.progress.stage(&stage);
        let Some(row) = self.runs.row(run, self.runs.ended(run)) else { return ControlFlow::Break(()) };
        if let Err(error) = self.journal.add(&row) {
            *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            return ControlFlow::Break(());
        }
        self.made.lock().unwrap_or_else(PoisonError::into_inner).push(row);
        ControlFlow::Continue(())
    }
}

/// Reads the particles that are asked for, and looks at the interrupt on the way.
struct Look<'a> {
    outputs: &'a [Output],
    probed: Probed,
    /// Most steps between two looks.
    between: usize,
}

impl Observer for Look<'_> {
    fn next(&mut self, step: usize) -> usize {
        Probed::next(self.outputs, step).min(step + self.between)
    }

    fn see(&mut self, engine: &Engine, _residual: f64) -> ControlFlow<()> {
        self.probed.see(self.outputs, engine);
        if interrupt::is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
