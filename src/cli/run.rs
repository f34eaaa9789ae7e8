//! `flockform run`: plan, step, record, write; or go on where an earlier run was killed.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use flockform::compare::run::plan;
use flockform::continuum::engine::Engine;
use flockform::continuum::engine::state::digest;
use flockform::continuum::equilibrium::run_to_equilibrium_watched;
use flockform::continuum::plan::Plan;
use flockform::continuum::record::{LoadStep, ProbeSeries, Snapshot};
use flockform::continuum::run::{Outcome, StopReason, Watch, resume};
use flockform::export::checkpoint::{self, Checkpoint, RunRequest};
use flockform::export::report::view::View;
use flockform::export::report::{self, AnimationState, RunRecorder, page};
use flockform::export::{
    Drawing, ExportError, Measured, OutputFolder, Results, Summary, Timings, VtkSeries, write_all,
};
use flockform::record::About;
use flockform::record::body::BodyMessages;
use flockform::scene::{LoadSteps, Scene, bundled};
use flockform::shm::Domain;
use flockform::shm::positions::Positions;
use flockform::solve::interrupt::Interrupt;
use flockform::trade::{Chosen, choose};

use super::checkpoint::{CheckpointArguments, Checkpointer, Recorded, ResumedRun};
use super::output::{FigureArguments, OutputArguments, ReportArguments};
use super::progress::{Drawn, Progress};
use super::recording::{RecordArguments, close};
use super::{FAILED, Refusal, SceneArguments, interrupt, say};

#[derive(Debug, Args)]
pub struct RunArguments {
    /// Name of a bundled scene (see `flockform list scenes`) or path of a scene file; not with --resume
    #[arg(required_unless_present = "resume")]
    scene: Option<String>,
    /// Override a key of the scene, validated like the file: `lattice.spacing=0.5`, `roles[1].from=30`
    #[arg(long = "set", value_name = "KEY.PATH=VALUE", requires = "scene")]
    set: Vec<String>,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    report: ReportArguments,
    #[command(flatten)]
    figures: FigureArguments,
    #[command(flatten)]
    checkpoints: CheckpointArguments,
    #[command(flatten)]
    record: RecordArguments,
    /// Run at most this many steps (the same as --set stop.steps=N)
    #[arg(long, value_name = "N", requires = "scene")]
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
    let left = arguments.checkpoints.left()?;
    let asked = arguments.asked(left.as_ref());
    let words_of = SceneArguments { scene: asked.scene.clone(), set: asked.set.clone() };
    let Chosen { mut scene, words } =
        choose(words_of.load([])?, &|more: &[String]| words_of.load_scene(more))?;
    if let Some(equilibrium) = &mut scene.equilibrium {
        equilibrium.request.interrupt = Interrupt::new(interrupt::flag());
    }
    let plan = plan(&scene)?;
    let shown = arguments.publish.as_ref();
    let open = |name: &String| Positions::open(&Domain::from_environment()?, name, plan.count());
    let mut shown = shown.map(open).transpose()?;
    let digest = digest(&plan);
    left.as_ref().map_or(Ok(()), |left| left.require_of(&scene, digest))?;
    let mut folder = match &left {
        Some(left) => left.open()?,
        None => arguments.output.folder(&scene.name)?,
    };
    let setup = start.elapsed();
    tracing::info!("planned {} particles of `{}` in {setup:.1?}", plan.count(), scene.name);

    let mut recorder = Recorder::new(&scene, &plan, &folder, left.as_ref())?;
    recorder.reports = !arguments.report.no_report;
    let about = About { source: "run", name: scene.name.clone(), ..About::default() };
    let recording = arguments.record.open(&about, arguments.output.force, 1)?;
    let mut messages = recording.as_ref().map(|one| BodyMessages::new(&scene, one.sink())).transpose()?;
    let mut progress = Progress::new(arguments.output.quiet, steps_of(&scene));
    let interrupted = interrupt::keeps();
    let looks = Looks::new(&scene, &plan, shown.is_some() || messages.is_some());
    let mut checkpointer = Checkpointer::new(&arguments.checkpoints, (asked, &scene, digest), left.as_ref());
    let mut see = |engine: &Engine, residual: f64| {
        recorder.step(engine);
        looks.animation.set(recorder.animation.as_ref().map(|animation| animation.next(engine.step())));
        if let Some(shown) = &mut shown {
            shown.show(engine);
        }
        if let Some(messages) = &mut messages {
            messages.step(engine, residual);
        }
        progress.step(engine.step(), residual);
        if checkpointer.is_due(engine.step()) && !recorder.failed() {
            checkpointer.keep(&mut folder, (engine, residual), recorder.kept());
        }
        let stop = recorder.failed() || interrupted.load(Ordering::Relaxed);
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let watch = Watch { next: &|step| looks.after(step), see: &mut see };
    let outcome = match left.map(|left| left.checkpoint) {
        None => run_to_equilibrium_watched(&scene, plan, watch)?,
        Some(Checkpoint { engine, residual, .. }) => {
            resume(plan, engine, residual, watch).map_err(|error| ResumedRun::foreign(&folder, &error))?
        }
    };
    progress.finish();
    if let Some(messages) = messages {
        messages.finish(&outcome.engine, outcome.residual);
    }

    let elapsed = checkpointer.stepping();
    tracing::info!("{} steps in {elapsed:.1?}, writing", outcome.engine.step());
    let is_interrupted = outcome.reason == StopReason::Interrupted;
    let is_small = outcome.engine.body().count() <= QUICKLY_WRITTEN;
    let mut saving = (is_interrupted && is_small).then(interrupt::saving);
    if is_interrupted || elapsed > WORTH_KEEPING {
        let _saving = interrupt::saving();
        let is_left = checkpointer.leave(&mut folder, (&outcome.engine, outcome.residual), recorder.kept());
        if is_left && is_interrupted && !is_small {
            eprintln!("{}", resume_words(&folder));
            return Ok(ExitCode::from(FAILED));
        }
        if is_left {
            interrupt::says(resume_words(&folder));
        }
    }
    let on_the_way = recorder.writing;
    let records = recorder.finish(&outcome)?;
    let Records { snapshots, probes, load_steps, stage, writing } = records;
    let timings = Timings { setup, steps: elapsed.saturating_sub(on_the_way), output: writing };
    let (snapshots, probes, load_steps) = (&snapshots[..], &probes[..], &load_steps[..]);
    let results = Results { scene: &scene, outcome: &outcome, snapshots, probes, load_steps, timings };
    let drawn = Drawn::new(arguments.output.quiet);
    let show = |done: usize, of: usize| {
        drawn.show(done, of);
        if interrupt::is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let drawing = Drawing { formats: arguments.figures.formats(), progress: &show };
    let (_, summary) = write_all(&folder, &results, drawing)?;
    drawn.finish();
    if let Some(stage) = stage {
        report::run::write(&folder, &results, &summary, stage)?;
    }
    let kept = interrupt::commit(folder)?;
    let recorded = close(recording)?;
    saving.take();
    if !is_interrupted {
        checkpoint::remove(&kept);
    }
    if !arguments.output.quiet {
        say(&words);
        say(&(closing_words(&scene, &outcome, &summary, elapsed) + &where_to_look(&kept) + &recorded));
    }
    if interrupt::is_raised() && !is_interrupted {
        eprintln!("interrupted: figures are missing, the rest is written");
        return Ok(ExitCode::from(FAILED));
    }
    Ok(exit_code(&outcome))
}

fn resume_words(folder: &OutputFolder) -> String {
    format!("interrupted: `flockform run --resume {}` goes on", folder.folder().display())
}

impl RunArguments {
    /// The requested run, independent of the working folder.
    fn asked(&self, left: Option<&ResumedRun>) -> RunRequest {
        let force = self.output.force;
        match (&self.scene, left) {
            (None, Some(left)) => left.checkpoint.asked.clone(),
            (None, None) => unreachable!("a scene is required without --resume"),
            (Some(scene), _) => {
                let place = Path::new(scene);
                let in_full = std::path::absolute(place).ok().filter(|_| place.exists());
                let is_path = bundled(scene).is_none();
                let named = in_full.filter(|_| is_path).map(|path| path.display().to_string());
                let steps = self.steps.map(|steps| format!("stop.steps={steps}"));
                let set = self.set.iter().cloned().chain(steps).collect();
                RunRequest { scene: named.unwrap_or_else(|| scene.clone()), set, force }
            }
        }
    }
}

/// At which steps a run is looked at: those that are recorded, and now and then one to show how far it is.
struct Looks<'a> {
    scene: &'a Scene,
    /// Most steps between two looks now, and ever.
    most: Cell<usize>,
    bound: usize,
    /// The last look: when, and at which step.
    last: Cell<(Instant, usize)>,
    /// The next step that the report shows.
    animation: Cell<Option<usize>>,
}

impl<'a> Looks<'a> {
    /// Looks at each step if `every` or if there are probes. Otherwise several looks a second are enough, by the clock:
    /// how long a step takes depends on the rule.
    fn new(scene: &'a Scene, plan: &Plan, every: bool) -> Self {
        let every = every || !plan.probes.is_empty();
        let bound = if every { 1 } else { (UPDATES_BETWEEN_LOOKS / plan.count()).max(1) };
        let last = Cell::new((Instant::now(), 0));
        // The report has yet to say what it wants: the next one.
        Self { scene, most: Cell::new(1), bound, last, animation: Cell::new(Some(0)) }
    }

    /// Most steps to the next look: twice as many while all of the last ones were quickly done.
    fn most(&self, step: usize) -> usize {
        let (then, before) = self.last.replace((Instant::now(), step));
        let (took, most) = (then.elapsed(), self.most.get());
        let next = match took {
            _ if took > BETWEEN_LOOKS => most / 2,
            _ if took < BETWEEN_LOOKS / 4 && step - before >= most => 2 * most,
            _ => most,
        };
        self.most.set(next.clamp(1, self.bound));
        self.most.get()
    }

    fn after(&self, step: usize) -> usize {
        let record = &self.scene.record;
        let figure = record.figures.iter().copied().filter(|&figure| figure > step).min();
        let next = |every: usize| (step / every + 1) * every;
        let vtk = (record.vtk_every > 0).then(|| next(record.vtk_every));
        let load = load_every(self.scene).map(next);
        [figure, vtk, load, self.animation.get()]
            .into_iter()
            .flatten()
            .fold(step + self.most(step), usize::min)
    }
}

/// Steps, or increments, that a run takes at most.
fn steps_of(scene: &Scene) -> usize {
    match &scene.load_steps {
        Some(LoadSteps::Solved(parts)) => parts.len(),
        _ => scene.stop.steps,
    }
}

/// Steps from one row of `load.csv` to the next, where there is one.
fn load_every(scene: &Scene) -> Option<usize> {
    match scene.load_steps.as_ref()? {
        LoadSteps::Solved(_) => Some(1),
        LoadSteps::Stepped { every, .. } => Some(*every),
    }
}

/// Longest time between two looks, but for a single step that takes longer.
const BETWEEN_LOOKS: Duration = Duration::from_millis(200);
/// Updates of particles between two looks, at most.
const UPDATES_BETWEEN_LOOKS: usize = 1 << 28;
/// Particles up to which the results of an interrupted run are written at once; more are left to `--resume`.
const QUICKLY_WRITTEN: usize = 50_000;
/// Stepping that took longer is not lost to an interrupt while figures are drawn.
const WORTH_KEEPING: Duration = Duration::from_secs(5);

/// Keeps what the scene asks for while the run goes on.
struct Recorder<'a> {
    scene: &'a Scene,
    snapshots: Vec<Snapshot>,
    probes: Vec<ProbeSeries>,
    load_steps: Vec<LoadStep>,
    frames: Option<VtkSeries>,
    /// Whether there shall be a `report.html`, and what it shows.
    reports: bool,
    animation: Option<RunRecorder>,
    /// The state that an earlier run saved for it.
    animation_state: Option<AnimationState<'static>>,
    failure: Option<ExportError>,
    writing: Duration,
}

/// The records of a run, and the time spent writing them.
struct Records {
    snapshots: Vec<Snapshot>,
    probes: Vec<ProbeSeries>,
    load_steps: Vec<LoadStep>,
    stage: Option<View>,
    writing: Duration,
}

impl<'a> Recorder<'a> {
    fn new(
        scene: &'a Scene,
        plan: &Plan,
        folder: &OutputFolder,
        left: Option<&ResumedRun>,
    ) -> Result<Self, ExportError> {
        // A body that is not stepped has no history.
        let is_solved_at_once = scene.equilibrium.is_some() && scene.load_steps.is_none();
        let probed: &[usize] = if is_solved_at_once { &[] } else { &plan.probes };
        let new_probes = || probed.iter().map(|&particle| ProbeSeries::new(particle)).collect();
        let every = scene.record.vtk_every;
        let frames = match left {
            _ if every == 0 => None,
            None => Some(VtkSeries::create(folder)?),
            Some(left) => Some(left.frames(folder, every)?),
        };
        let frames = frames.map(|frames| frames.with_material(scene.material));
        Ok(Self {
            scene,
            snapshots: left.map_or_else(Vec::new, |left| left.checkpoint.snapshots.to_vec()),
            probes: left.map_or_else(new_probes, |left| left.checkpoint.probes.to_vec()),
            load_steps: left.map_or_else(Vec::new, |left| left.checkpoint.load_steps.to_vec()),
            frames,
            reports: true,
            animation: None,
            animation_state: left.and_then(|left| left.checkpoint.animation.clone()),
            failure: None,
            writing: Duration::ZERO,
        })
    }

    /// For a checkpoint.
    fn kept(&mut self) -> Recorded<'_> {
        Recorded {
            snapshots: &self.snapshots,
            probes: &self.probes,
            load_steps: &self.load_steps,
            animation: self.animation.as_ref(),
            frames: self.frames.as_mut(),
        }
    }

    fn step(&mut self, engine: &Engine) {
        self.probes.iter_mut().for_each(|probe| probe.record(engine));
        if self.scene.record.figures.contains(&engine.step()) {
            self.snapshots.push(Snapshot::of(engine));
        }
        if load_every(self.scene).is_some_and(|every| engine.step().is_multiple_of(every)) {
            self.measure(engine);
        }
        if self.frames.is_some() && engine.step().is_multiple_of(self.scene.record.vtk_every) {
            self.write_frame(engine);
        }
        if self.reports {
            let start = Instant::now();
            RunRecorder::open(&mut self.animation, &mut self.animation_state, engine).watch(engine);
            self.writing += start.elapsed();
        }
    }

    fn measure(&mut self, engine: &Engine) {
        let measured = self.scene.material.as_ref().and_then(|elastic| LoadStep::of(engine, elastic));
        self.load_steps.extend(measured);
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
        if load_every(self.scene).is_some() && self.load_steps.last().is_none_or(|last| last.step != step) {
            self.measure(engine);
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
        if self.reports {
            // A run that is gone on with from its last step has seen none.
            RunRecorder::open(&mut self.animation, &mut self.animation_state, engine);
        }
        let stage = self.animation.map(|animation| animation.stage(self.scene, outcome));
        let writing = self.writing + start.elapsed();
        let Self { snapshots, probes, load_steps, .. } = self;
        Ok(Records { snapshots, probes, load_steps, stage, writing })
    }
}

fn closing_words(scene: &Scene, outcome: &Outcome, summary: &Summary, elapsed: Duration) -> String {
    let engine = &outcome.engine;
    let how = match &outcome.reason {
        StopReason::Equilibrium => "in equilibrium".to_owned(),
        StopReason::Unsettled => "the solver ended short of its tolerance".to_owned(),
        StopReason::Stuck(why) => format!("not {why}"),
        StopReason::Steps => "all steps done".to_owned(),
        StopReason::Interrupted if outcome.solved.is_some() => {
            "interrupted: what there was is written".to_owned()
        }
        StopReason::Interrupted => {
            "interrupted: what there was is written, `flockform run --resume` goes on".to_owned()
        }
        StopReason::Diverged(divergence) => format!("{divergence}; the last good state is written"),
    };
    let mut words = format!(
        "{}: {} {}, residual {:.2e}, {how} ({:.2} s)\n",
        scene.name,
        scene.counts(),
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
        summary.energies.pe1,
        summary.energies.largest_strain.unwrap_or(0.0),
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
    words += &summary.mechanics.as_ref().map_or_else(String::new, Measured::to_string);
    words + &summary.cautions.iter().map(|caution| format!("caution: {caution}\n")).collect::<String>()
}

fn where_to_look(kept: &Path) -> String {
    let report = kept.join(page::FILE);
    let report = report.is_file().then(|| format!("open {}\n", report.display()));
    format!("results in {}\n{}", kept.display(), report.unwrap_or_default())
}

pub fn exit_code(outcome: &Outcome) -> ExitCode {
    match outcome.reason {
        StopReason::Equilibrium | StopReason::Steps => ExitCode::SUCCESS,
        StopReason::Unsettled | StopReason::Stuck(_) | StopReason::Interrupted | StopReason::Diverged(_) => {
            ExitCode::from(FAILED)
        }
    }
}
