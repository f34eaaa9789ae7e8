//! `flockform run`: plan, step, record, write.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use flockform::compare::run::plan;
use flockform::continuum::engine::Engine;
use flockform::continuum::equilibrium::come_to_rest_watched;
use flockform::continuum::plan::Plan;
use flockform::continuum::record::{ProbeSeries, Snapshot};
use flockform::continuum::run::{Outcome, StopReason, Watch};
use flockform::export::report::stage::Stage;
use flockform::export::report::{self, RunRecorder};
use flockform::export::{
    Energies, ExportError, OutputFolder, Results, Summary, Timings, VtkSeries, write_all,
};
use flockform::scene::Scene;
use flockform::shm::Domain;
use flockform::shm::positions::Positions;
use flockform::trade::{Chosen, choose};

use super::output::{OutputArguments, ReportArguments};
use super::progress::Progress;
use super::{FAILED, Refusal, SceneArguments, print};

#[derive(Debug, Args)]
pub struct RunArguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    report: ReportArguments,
    /// Run at most this many steps (the same as --set stop.steps=N)
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Threads to use [default: the machine's]; results are the same to the bit for any number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Show the positions after every step to other processes, as flockform/NAME/positions in shared memory
    #[arg(long, value_name = "NAME")]
    publish: Option<String>,
}

/// Runs a scene and writes what comes of it.
pub fn run(arguments: &RunArguments) -> Result<ExitCode, Refusal> {
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| Refusal::Threads { threads, error })?.install(|| run_here(arguments))
}

fn run_here(arguments: &RunArguments) -> Result<ExitCode, Refusal> {
    let start = Instant::now();
    let steps = arguments.steps.map(|steps| format!("stop.steps={steps}"));
    let scene = arguments.scene.load(steps.clone())?;
    let load = |more: &[String]| arguments.scene.load_scene(&[steps.as_slice(), more].concat());
    let Chosen { scene, words } = choose(scene, &load)?;
    let plan = plan(&scene)?;
    let shown = arguments.publish.as_ref();
    let open = |name: &String| Positions::open(&Domain::from_environment()?, name, plan.count());
    let mut shown = shown.map(open).transpose()?;
    let folder = arguments.output.folder(&scene.name)?;
    let setup = start.elapsed();
    tracing::info!("planned {} particles of `{}` in {setup:.1?}", plan.count(), scene.name);

    let mut recorder = Recorder::new(&scene, &plan, &folder)?;
    recorder.reports = !arguments.report.no_report;
    let mut progress = Progress::new(arguments.output.quiet, scene.stop.steps);
    let interrupted = interrupt_flag();
    let stepping = Instant::now();
    let looks = Looks::new(&scene, &plan, shown.is_some());
    let mut see = |engine: &Engine, residual: f64| {
        recorder.step(engine);
        looks.film.set(recorder.film.as_ref().map(|film| film.next(engine.step())));
        if let Some(shown) = &mut shown {
            shown.show(engine);
        }
        progress.step(engine.step(), residual);
        let stop = recorder.failed() || interrupted.load(Ordering::Relaxed);
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let watch = Watch { next: &|step| looks.after(step), see: &mut see };
    let outcome = come_to_rest_watched(&scene, plan, watch)?;
    progress.finish();

    let elapsed = stepping.elapsed();
    tracing::info!("{} steps in {elapsed:.1?}, writing", outcome.engine.step());
    let on_the_way = recorder.writing;
    let records = recorder.finish(&outcome)?;
    let timings = Timings { setup, steps: elapsed.saturating_sub(on_the_way), output: records.writing };
    let (snapshots, probes) = (&records.snapshots, &records.probes);
    let results = Results { scene: &scene, outcome: &outcome, snapshots, probes, timings };
    let (_, summary) = write_all(&folder, &results)?;
    if let Some(stage) = records.stage {
        report::run::write(&folder, &results, &summary, stage)?;
    }
    let Summary { energies, .. } = summary;
    let kept = folder.commit()?;
    if !arguments.output.quiet {
        print(&words);
        print(&closing_words(&scene, &outcome, &energies, elapsed, &kept));
    }
    Ok(exit_code(&outcome))
}

/// Set by Ctrl-C and by SIGTERM; the run then stops at the next step.
pub fn interrupt_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    if let Err(error) = ctrlc::set_handler(move || raised.store(true, Ordering::Relaxed)) {
        tracing::warn!("an interrupt will end the program without writing results: {error}");
    }
    flag
}

/// At which steps a run is looked at: those that are recorded, and now and then one to show how far it is.
struct Looks<'a> {
    scene: &'a Scene,
    /// Most steps between two looks.
    most: usize,
    /// The next step that the report shows.
    film: Cell<Option<usize>>,
}

impl<'a> Looks<'a> {
    /// If `every`, somebody wants to see each step; probes do. Otherwise about twice a second is enough.
    fn new(scene: &'a Scene, plan: &Plan, every: bool) -> Self {
        let every = every || !plan.probes.is_empty();
        let most = if every { 1 } else { (UPDATES_BETWEEN_LOOKS / plan.count()).max(1) };
        Self { scene, most, film: Cell::new(None) }
    }

    fn after(&self, step: usize) -> usize {
        let record = &self.scene.record;
        let figure = record.figures.iter().copied().filter(|&figure| figure > step).min();
        let vtk = (record.vtk_every > 0).then(|| (step / record.vtk_every + 1) * record.vtk_every);
        [figure, vtk, self.film.get()].into_iter().flatten().fold(step + self.most, usize::min)
    }
}

/// Updates of particles that take some half a second.
const UPDATES_BETWEEN_LOOKS: usize = 1 << 28;

/// Keeps what the scene asks for while the run goes on.
struct Recorder<'a> {
    scene: &'a Scene,
    snapshots: Vec<Snapshot>,
    probes: Vec<ProbeSeries>,
    frames: Option<VtkSeries>,
    /// Whether there shall be a `report.html`, and what it shows.
    reports: bool,
    film: Option<RunRecorder>,
    failure: Option<ExportError>,
    writing: Duration,
}

/// What was kept, and how long that took on the way.
struct Records {
    snapshots: Vec<Snapshot>,
    probes: Vec<ProbeSeries>,
    stage: Option<Stage>,
    writing: Duration,
}

impl<'a> Recorder<'a> {
    fn new(scene: &'a Scene, plan: &Plan, folder: &OutputFolder) -> Result<Self, ExportError> {
        // A body that is not stepped has no history.
        let probed: &[usize] = if scene.raw.equilibrium.is_some() { &[] } else { &plan.probes };
        Ok(Self {
            scene,
            snapshots: Vec::new(),
            probes: probed.iter().map(|&particle| ProbeSeries::new(particle)).collect(),
            frames: (scene.record.vtk_every > 0).then(|| VtkSeries::create(folder)).transpose()?,
            reports: true,
            film: None,
            failure: None,
            writing: Duration::ZERO,
        })
    }

    fn step(&mut self, engine: &Engine) {
        self.probes.iter_mut().for_each(|probe| probe.record(engine));
        if self.scene.record.figures.contains(&engine.step()) {
            self.snapshots.push(Snapshot::of(engine));
        }
        if self.frames.is_some() && engine.step().is_multiple_of(self.scene.record.vtk_every) {
            self.write_frame(engine);
        }
        if self.reports {
            let start = Instant::now();
            RunRecorder::watch(&mut self.film, engine);
            self.writing += start.elapsed();
        }
    }

    fn write_frame(&mut self, engine: &Engine) {
        let start = Instant::now();
        if let Some(frames) = &mut self.frames {
            self.failure = frames.write(engine).err();
        }
        self.writing += start.elapsed();
    }

    fn failed(&self) -> bool {
        self.failure.is_some()
    }

    /// The last configuration is always drawn, and for ParaView always written.
    fn finish(mut self, outcome: &Outcome) -> Result<Records, ExportError> {
        let engine = &outcome.engine;
        let step = engine.step();
        if self.snapshots.last().is_none_or(|last| last.step != step) {
            self.snapshots.push(Snapshot::of(engine));
        }
        if self.frames.is_some() && !self.failed() && !step.is_multiple_of(self.scene.record.vtk_every) {
            self.write_frame(engine);
        }
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        if let Some(frames) = self.frames {
            frames.finish()?;
        }
        let start = Instant::now();
        let stage = self.film.map(|film| film.stage(self.scene, outcome));
        let writing = self.writing + start.elapsed();
        Ok(Records { snapshots: self.snapshots, probes: self.probes, stage, writing })
    }
}

fn closing_words(
    scene: &Scene,
    outcome: &Outcome,
    energies: &Energies,
    elapsed: Duration,
    kept: &Path,
) -> String {
    let engine = &outcome.engine;
    let how = match &outcome.reason {
        StopReason::Equilibrium => "in equilibrium".to_owned(),
        StopReason::Unsettled => "the solver ended short of its tolerance".to_owned(),
        StopReason::Steps => "all steps done".to_owned(),
        StopReason::Interrupted => "interrupted: what there was is written".to_owned(),
        StopReason::Diverged(divergence) => format!("{divergence}; the last good state is written"),
    };
    let mut words = format!(
        "{}: step {}, residual {:.2e}, {how} ({:.2} s)\n",
        scene.name,
        engine.step(),
        outcome.residual,
        elapsed.as_secs_f64()
    );
    if let Some(solved) = &outcome.solved {
        let phases: Vec<String> =
            solved.phases.iter().map(|(name, time)| format!("{name} {:.3} s", time.as_secs_f64())).collect();
        let rounding = solved.known_to.map_or(String::new(), |error| {
            format!(" (what rounding leaves: displacements are known to about {error:.0e} of themselves)")
        });
        words += &format!(
            "{}, {}: {} iterations to a residual force of {:.1e} of the load{rounding}, {}\n",
            solved.solver,
            solved.why,
            solved.iterations,
            solved.residuals.last().copied().unwrap_or_default(),
            phases.join(", ")
        );
    }
    words += &format!(
        "PE1 {:.4e} {unit}^2 in all, largest strain {:.4e}\n",
        energies.pe1,
        energies.largest_strain.unwrap_or(0.0),
        unit = scene.unit(),
    );
    let broken: Vec<_> = engine.breaks().iter().filter(|b| b.step > 0).collect();
    if let (Some(first), Some(last)) = (broken.first(), broken.last()) {
        words += &format!(
            "{} bonds broke, from step {} to {}, the first at ({:.1}, {:.1}) {}, {:.0} % along the body\n",
            broken.len(),
            first.step,
            last.step,
            first.place[0],
            first.place[1],
            scene.unit(),
            100.0 * engine.body().along()(first.place)
        );
    }
    words + &format!("results in {}\n", kept.display())
}

pub fn exit_code(outcome: &Outcome) -> ExitCode {
    match outcome.reason {
        StopReason::Equilibrium | StopReason::Steps => ExitCode::SUCCESS,
        StopReason::Unsettled | StopReason::Interrupted | StopReason::Diverged(_) => ExitCode::from(FAILED),
    }
}
