//! `flockform run`: plan, step, record, write; or go on where an earlier run was killed.

mod observer;
mod recorder;
mod words;

use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use flockform::continuum::digest::{digest, digest_of_parts, fnv1a};
use flockform::continuum::equilibrium::run_to_equilibrium_shared;
use flockform::continuum::looks::Looks;
use flockform::continuum::parts::{Parting, laid_out_whole_for};
use flockform::continuum::plan::Plan;
use flockform::continuum::run::{SharedError, StopReason};
use flockform::continuum::shares::bytes_each;
use flockform::export::checkpoint::{self, Checkpoint, RunRequest};
use flockform::export::figures::is_raster;
use flockform::export::film::{self, FilmColour};
use flockform::export::memory::Outputs;
use flockform::export::report;
use flockform::export::{Drawing, Results, Signed, Timings, write_all};
use flockform::ranks::Team;
use flockform::record::About;
use flockform::record::body::BodyMessages;
use flockform::scene::Scene;
use flockform::scene::document::is_lost_to;
use flockform::shm::Domain;
use flockform::shm::positions::Positions;
use flockform::solve::interrupt::Interrupt;
use flockform::study::compare::run::plan;
use flockform::study::trade::{Chosen, choose};
use observer::RunObserver;
use recorder::{Finished, Recorder};
use words::{closing_words, where_to_look};

use super::checkpoint::{CheckpointArguments, Checkpointer, ResumedRun, resume_words};
use super::film::{FilmArguments, Finish};
use super::material::wrong;
use super::names::{FileName, Overrides, SceneArguments, in_full};
use super::output::{FigureArguments, OutputArguments, ReportArguments, command_line};
use super::progress::Progress;
use super::ranks::{self, Interrupted, RanksError, Start};
use super::recording::{RecordArguments, close};
use super::{FAILED, Refusal, exit_code, interrupt, memory, on_terminal};

#[derive(Debug, Args)]
#[command(mut_arg("set", |set| set.requires("scene")))]
pub struct RunArguments {
    /// Name of a bundled scene (see `flockform list scenes`) or path of a scene file; left out with --resume; if given, it must be the scene that was run
    #[arg(required_unless_present = "resume", value_parser = FileName::SCENE, hide_possible_values = true)]
    scene: Option<String>,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    report: ReportArguments,
    #[command(flatten)]
    figures: FigureArguments,
    #[command(flatten)]
    film: FilmArguments,
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
    /// Print the summary as JSON, as in summary.json, instead of words
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

/// Runs a scene and writes what comes of it; one rank of several does its part of it, and the first one writes.
pub fn run(arguments: &RunArguments) -> Result<ExitCode, Refusal> {
    let team = ranks::team()?;
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    // The others wait already: a rank without threads has to tell them.
    let pool = pool.map_err(|error| Start::new(team.as_ref()).refused(Refusal::threads(threads, error)))?;
    pool.install(|| run_here(arguments, team.as_ref()))
}

/// A run that is about to begin.
struct Prepared {
    left: Option<ResumedRun>,
    asked: RunRequest,
    scene: Scene,
    /// The choice that was made for it.
    words: String,
    plan: Plan,
    digest: u64,
    /// Whether the plan is that of this rank's part of the body.
    is_parted: bool,
}

impl Prepared {
    fn new(arguments: &RunArguments, team: Option<&Team>, begin: &mut Start<'_>) -> Result<Self, Refusal> {
        arguments.require_one_end()?;
        let mut left = arguments.checkpoints.left()?;
        let asked = arguments.asked(left.as_ref());
        let words_of = SceneArguments::new(&asked.scene, &asked.set);
        let may_be_parted = |scene: &Scene| team.is_some() && laid_out_whole_for(scene).is_none();
        let parts = |scene: &Scene| if may_be_parted(scene) { team.map_or(1, Team::count) } else { 1 };
        let scene = words_of.load_part(parts)?;
        if let (Some(team), true) = (team, may_be_parted(&scene)) {
            // What follows all ranks do together.
            begin.agree(arguments.common(&scene))?;
            let parting = Parting::among(&scene, team)?;
            // Of a small body each particle is drawn and recorded with its bonds, which takes all of them.
            if !arguments.shows_each() || is_raster(parting.total()) {
                let scene = interruptible(scene);
                let plan = Plan::of_counted_part(&scene, &parting, team)?;
                let digest = digest_of_parts(&plan, team);
                let of_one = |writes: bool| {
                    memory::of_part(&scene, &plan, team.count(), (arguments.outputs(), writes))
                };
                // One of those on this machine may be the first.
                let bytes = of_one(true) + ranks::others_here() * of_one(false);
                memory::require(&scene, bytes as f64)?;
                left.as_mut().map_or(Ok(()), |left| left.fit(&scene, &plan, digest))?;
                return Ok(Self { left, asked, scene, words: String::new(), plan, digest, is_parted: true });
            }
        }
        let Chosen { scene, words, .. } = choose(scene, &|more: &[String]| words_of.load_scene(more))?;
        let scene = interruptible(scene);
        let plan = plan(&scene)?;
        // The ranks of a machine share its memory, and each holds the whole body.
        let of_others = ranks::others_here() * bytes_each(&scene, &plan);
        let bytes = memory::predicted(&scene, &plan, arguments.outputs()) + of_others;
        memory::require(&scene, bytes as f64)?;
        let digest = digest(&plan);
        left.as_mut().map_or(Ok(()), |left| left.fit(&scene, &plan, digest))?;
        Ok(Self { left, asked, scene, words, plan, digest, is_parted: false })
    }

    /// A fingerprint of what all ranks must have in common: plan, scene, options, and the state to go on from.
    fn common(&self, arguments: &RunArguments) -> u64 {
        let state = self.left.iter().map(|left| left.fingerprint);
        let all = [self.digest, arguments.common(&self.scene)].into_iter().chain(state);
        fnv1a(&all.flat_map(u64::to_le_bytes).collect::<Vec<_>>())
    }
}

/// The scene with an equilibrium whose solve an interrupt ends.
pub fn interruptible(mut scene: Scene) -> Scene {
    if let Some(equilibrium) = &mut scene.equilibrium {
        equilibrium.request.interrupt = Interrupt::new(interrupt::flag());
    }
    scene
}

/// The part of a rank that neither prints nor writes, and has the whole body.
fn help_to_run(prepared: Prepared, common: u64, team: &Team, begin: Start<'_>) -> Result<ExitCode, Refusal> {
    let mut observer = Interrupted(interrupt::serves());
    begin.begin(common)?;
    let from = prepared.left.map(|left| left.checkpoint).map(|from| (from.engine, from.residual));
    // The first rank says how it ended, in its exit code too: all have the same.
    run_to_equilibrium_shared(&prepared.scene, prepared.plan, from, team, &mut observer)
        .map_err(|_| RanksError::SaidElsewhere)?;
    Ok(ExitCode::SUCCESS)
}

fn run_here(arguments: &RunArguments, team: Option<&Team>) -> Result<ExitCode, Refusal> {
    let start = Instant::now();
    let mut begin = Start::new(team);
    let prepared = match Prepared::new(arguments, team, &mut begin) {
        Ok(prepared) => prepared,
        Err(refusal) => return Err(begin.refused(refusal)),
    };
    let common = team.map_or(0, |_| prepared.common(arguments));
    begin.agree(common)?;
    let others = team.filter(|team| !team.is_first());
    if let (Some(team), false) = (others, prepared.is_parted) {
        return help_to_run(prepared, common, team, begin);
    }
    let Prepared { left, asked, scene, words, mut plan, digest, .. } = prepared;
    let shown = arguments.publish.as_ref();
    let total = plan.setup.body.total();
    let open = |name: &String| Positions::open(&Domain::from_environment()?, name, total);
    let shown = shown.filter(|_| others.is_none()).map(open).transpose()?;
    let folder = others.is_none().then(|| match &left {
        Some(left) => left.open(),
        None => arguments.output.folder(&scene.name),
    });
    let mut folder = folder.transpose()?;
    if let Some(folder) = &mut folder {
        // A resumed run is described by how it began.
        folder.set_command(command_line(asked.arguments()));
    }
    let required = |colour| film::run::require_colour(&scene, colour);
    let force = arguments.output.force;
    let film = match &folder {
        Some(folder) => arguments.film.open(folder, force, FilmColour::Displacement, required)?,
        None => None,
    };
    let setup = start.elapsed();
    let own = plan.setup.body.owned().len();
    tracing::info!("planned {own} of {total} particles of `{}` in {setup:.1?}", scene.name);
    tracing::info!("{}", flockform::sweep::chosen_here());

    if let Some(caution) = arguments.checkpoints.caution(&scene).filter(|_| folder.is_some()) {
        note!("caution: {caution}");
    }
    let undrawn = left.as_ref().map_or_else(Vec::new, |left| left.undrawn(&scene));
    if arguments.outputs().draws() && !undrawn.is_empty() && folder.is_some() && !arguments.output.quiet {
        note!(
            "caution: no figures were asked for until now: there are none of steps {}",
            undrawn.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
        );
    }
    let recorder = Recorder::new(&scene, &plan, folder.as_ref(), left.as_ref(), arguments.outputs())?;
    let about = About { source: "run", name: scene.name.clone(), ..About::default() };
    let recording = match &folder {
        Some(folder) => arguments.record.open_beside(folder, &about, force)?,
        None => None,
    };
    let sink = || recording.as_ref().map(|one| one.sink());
    let messages = arguments.record.is_asked().then(|| BodyMessages::new(&scene, sink())).transpose()?;
    let quiet = arguments.output.quiet || folder.is_none();
    let mut observer = RunObserver {
        recorder,
        looks: Looks::new(&plan, arguments.publish.is_some()),
        is_shown: arguments.publish.is_some(),
        shown,
        messages,
        progress: Progress::of_steps(quiet, scene.most_steps()),
        checkpointer: Checkpointer::new(&arguments.checkpoints, (asked, &scene, digest), left.as_ref()),
        interrupted: if folder.is_some() { interrupt::keeps() } else { interrupt::serves() },
        folder,
    };
    begin.begin(common)?;
    if let (Some(probes), Some(left)) = (&mut plan.setup.probes, &left) {
        *probes = left.checkpoint.records.probes.clone();
    }
    let from = left.map(|left| left.checkpoint).map(|Checkpoint { engine, residual, .. }| (engine, residual));
    let outcome = run_to_equilibrium_shared(&scene, plan, from, team, &mut observer);
    let outcome = outcome.map_err(|error| match (error, &observer.folder) {
        (_, None) => RanksError::SaidElsewhere.into(),
        (SharedError::Scene(error), _) => Refusal::from(error),
        (error, Some(folder)) => ResumedRun::foreign(folder, &error).into(),
    })?;
    let RunObserver { mut recorder, messages, progress, mut checkpointer, mut folder, .. } = observer;
    progress.finish();
    if let Some(messages) = messages {
        messages.finish(&outcome.engine, outcome.residual);
    }

    let (engine, elapsed) = (&outcome.engine, checkpointer.stepping());
    tracing::info!("{} steps in {elapsed:.1?}, writing", engine.step());
    let is_interrupted = outcome.reason == StopReason::Interrupted;
    let is_small = engine.body().total() <= QUICKLY_WRITTEN;
    let mut saving = is_interrupted.then(interrupt::saving);
    let is_worth_keeping =
        is_interrupted || (arguments.outputs().draws() && engine.any_of_parts(elapsed > WORTH_KEEPING));
    if is_worth_keeping && !engine.any_of_parts(recorder.failed()) {
        let _saving = interrupt::saving();
        let kept = recorder.kept(engine);
        let is_left = checkpointer.leave(folder.as_mut(), (engine, outcome.residual), &kept);
        if is_left && is_interrupted && !is_small {
            folder.iter().for_each(|folder| interrupt::says_at_once(&resume_words(folder)));
            return Ok(ExitCode::from(FAILED));
        }
    }
    let on_the_way = recorder.writing;
    let finished = recorder.finish(&outcome);
    // What one rank cannot write ends all.
    let is_lost = engine.any_of_parts(finished.is_err());
    let Finished { records, stage, animation, writing } = finished?;
    if is_lost {
        return Err(RanksError::SaidElsewhere.into());
    }
    memory::return_what_is_free();
    let timings = Timings { setup, steps: elapsed.saturating_sub(on_the_way), output: writing };
    let results = Results { scene: &scene, outcome: &outcome, records: &records, timings };
    let progress = Progress::of_drawing(quiet, "figure");
    let is_cut_short = AtomicBool::new(false);
    let show = |done: usize, of: usize| {
        progress.drawn(done, of);
        if interrupt::is_raised() {
            is_cut_short.store(done < of, Ordering::Relaxed);
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    };
    let drawing = Drawing { formats: arguments.figures.figures, progress: &show };
    let (_, summary) = write_all(folder.as_ref(), &results, drawing)?;
    progress.finish();
    let Some(folder) = folder else { return Ok(ExitCode::SUCCESS) };
    if let Some(stage) = stage {
        report::run::write(&folder, &results, &summary, stage)?;
    }
    let kept = interrupt::commit(folder)?;
    let recorded = close(recording)?;
    saving.take();
    if !is_interrupted {
        checkpoint::remove(&kept);
    }
    let drawn = film.as_ref().filter(|_| !is_interrupted).zip(animation.as_ref());
    let drawn = drawn.map(|(film, animation)| film::run::film(&scene, &outcome, animation, film.colour));
    let finish = Finish {
        kept: &kept,
        output: &arguments.output,
        report: &arguments.report,
        is_json: arguments.json,
        is_interrupted,
        is_cut_short: is_cut_short.into_inner() && !is_interrupted,
    };
    let closing =
        || words + &closing_words(&scene, &outcome, &summary, elapsed) + &where_to_look(&kept) + &recorded;
    let is_whole = finish.done(film, drawn, || serde_json::json!(Signed::new(&summary)), closing)?;
    if arguments.output.quiet && !is_interrupted && !outcome.reason.is_good() {
        note!("error: {}", on_terminal(&format!("{}: {}", scene.name, outcome.reason)));
    }
    Ok(exit_code(is_whole && outcome.reason.is_good()))
}

impl RunArguments {
    /// Whether something is asked for that shows each particle of a small body.
    fn shows_each(&self) -> bool {
        self.outputs().draws() || self.film.is_asked() || self.record.is_asked()
    }

    fn outputs(&self) -> Outputs {
        let film = self.film.is_asked();
        Outputs { figures: self.figures.figures, report: !self.report.no_report, film }
    }

    /// A fingerprint of what ranks must have in common before they lay out a body: the scene, with what it read from files, and
    /// the options that decide what all of them do together.
    fn common(&self, scene: &Scene) -> u64 {
        let mut all = serde_json::to_vec(&scene.raw).expect("a scene was read from text");
        let asked = (self.outputs(), self.checkpoints.every(), self.record.is_asked());
        all.extend(format!("{:?} {asked:?} {:?}", scene.roles, self.publish).bytes());
        fnv1a(&all)
    }

    /// Refuses two numbers of steps, of which one would be lost.
    fn require_one_end(&self) -> Result<(), Refusal> {
        let set = self.overrides.set.iter().find(|set| is_lost_to(set, "stop.steps"));
        let (Some(steps), Some(set)) = (self.steps, set) else { return Ok(()) };
        let message = format!("{steps} steps are asked for, and `--set {set}` says how many too");
        Err(wrong("--steps", message, "leave one of the two out").into())
    }

    /// The requested run, independent of the working folder.
    fn asked(&self, left: Option<&ResumedRun>) -> RunRequest {
        let force = self.output.force || left.is_some_and(|left| left.checkpoint.asked.force);
        match (&self.scene, left) {
            (None, Some(left)) => left.checkpoint.asked.clone(),
            (None, None) => unreachable!("a scene is required without --resume"),
            (Some(scene), _) => {
                let steps = self.steps.map(|steps| format!("stop.steps={steps}"));
                let set = self.overrides.set.iter().cloned().chain(steps).collect();
                RunRequest { scene: in_full(scene), set, force }
            }
        }
    }
}

/// Particles up to which the results of an interrupted run are written at once; more are left to `--resume`.
const QUICKLY_WRITTEN: usize = 50_000;
/// Stepping that took longer is not lost to an interrupt while figures are drawn.
const WORTH_KEEPING: Duration = Duration::from_secs(5);
