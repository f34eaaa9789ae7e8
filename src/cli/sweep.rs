//! `flockform sweep`: a scene with many values of its keys, one table and one figure.

mod runs;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use flockform::export::shell::quoted;
use flockform::export::sweep::{
    Journal, JournalHeader, Output, Row, StoredSweep, SweepError, SweepRequest, Table, gather, read,
    write_sweep,
};
use flockform::export::{ExportError, OutputFolder, unfinished};
use flockform::scene::Scene;
use flockform::scene::document::is_lost_to;
use flockform::scene::text::counted;
use flockform::study::design::{Design, Sampling, Shard};
use runs::Runs;

use super::material::wrong;
use super::names::{FileName, Overrides, SceneArguments, in_full};
use super::output::{FigureArguments, OutputArguments};
use super::{FAILED, Refusal, exit_code, interrupt, print, say};

#[derive(Debug, Args)]
#[command(mut_arg("set", |set| set.requires("scene")))]
pub struct SweepArguments {
    /// Name of a bundled scene (see `flockform list scenes`) or path of a scene file; not with --resume or --merge
    #[arg(
        required_unless_present_any = ["resume", "merge"],
        value_parser = FileName::SCENE,
        hide_possible_values = true
    )]
    scene: Option<String>,
    #[command(flatten)]
    overrides: Overrides,
    /// Vary a key: FROM:TO:COUNT (a grid; with :log by ratios), [VALUE, ...], or FROM:TO with --samples. Keys given
    /// together make every combination
    #[arg(long, value_name = "KEY.PATH=VALUES", requires = "scene", required_unless_present_any = ["resume", "merge"])]
    vary: Vec<String>,
    /// Draw so many runs from the ranges and lists instead of making every combination
    #[arg(long, value_name = "N", requires = "scene", value_parser = clap::value_parser!(u32).range(1..))]
    samples: Option<u32>,
    /// How samples are drawn
    #[arg(long, value_enum, default_value_t, requires = "samples")]
    sampling: Sampling,
    /// Seed of the samples: the same seed draws the same runs
    #[arg(long, value_name = "S", default_value_t, requires = "samples")]
    seed: u64,
    /// Keys of summary.json, and probe.ID.QUANTITY@STEP with x, y, ux, uy, pe1 or pe2, separated by commas
    /// [default: energy, strain, residual, steps; of a material strain energy and largest stress too]
    #[arg(long, value_name = "KEY", value_delimiter = ',', requires = "scene")]
    outputs: Vec<String>,
    /// Output to draw [default: over one key those that vary, up to four; over more the first of them]
    #[arg(long, value_name = "KEY")]
    plot: Option<String>,
    /// Make only every Nth run, from the Ith on: part I of N, to be merged with the others
    #[arg(long, value_name = "I/N", requires = "scene")]
    shard: Option<String>,
    /// Threads to use [default: the machine's]; the table is the same for any number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Go on with the killed or interrupted sweep to this --out
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scene", "out", "force", "merge", "vary", "set", "samples", "outputs", "shard"])]
    resume: Option<PathBuf>,
    /// Put the shards in these folders together
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["scene", "vary", "set", "samples", "outputs", "shard"])]
    merge: Vec<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    figures: FigureArguments,
    /// Print the table as JSON
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

impl SweepArguments {
    /// Whether it is one of several that share the runs, each with a folder of its own.
    pub fn is_shard(&self) -> bool {
        self.shard.is_some()
    }

    fn request(&self) -> Result<SweepRequest, Refusal> {
        Ok(SweepRequest {
            scene: in_full(self.scene.as_deref().unwrap_or_default()),
            set: self.overrides.set.clone(),
            vary: self.vary.clone(),
            samples: self.samples.map(|count| (count as usize, self.sampling, self.seed)),
            outputs: self.outputs.clone(),
            shard: self.shard.as_deref().map_or(Ok(Shard::WHOLE), str::parse)?,
            force: self.output.force,
        })
    }

    /// Refuses a key that is set and varied: each run has the varied one alone.
    fn require_unvaried(&self, design: &Design) -> Result<(), Refusal> {
        let varies = |set: &&String| design.factors.iter().any(|factor| is_lost_to(set, &factor.key));
        match self.overrides.set.iter().find(varies) {
            None => Ok(()),
            Some(set) => {
                let message = format!("`{set}` has no effect: each run has a value of --vary there");
                Err(wrong("--set", message, "leave it out, or vary another key").into())
            }
        }
    }

    fn require_plotted(&self, outputs: &[String]) -> Result<(), Refusal> {
        match &self.plot {
            Some(name) if !outputs.contains(name) => Err(wrong(
                "--plot",
                format!("`{name}` is no output of this sweep"),
                format!("give one of {}, or add it to --outputs", outputs.join(", ")),
            )
            .into()),
            _ => Ok(()),
        }
    }
}

/// A sweep of a scene, laid out.
struct Sweep {
    begun: JournalHeader,
    /// Without the variations.
    scene: Scene,
    design: Design,
    rows: BTreeMap<usize, Row>,
}

impl Sweep {
    /// Lays out what is asked for; the usual outputs where none are named.
    fn new(mut request: SweepRequest, rows: BTreeMap<usize, Row>) -> Result<Self, Refusal> {
        let scene = scene_arguments(&request).load()?;
        if request.outputs.is_empty() {
            request.outputs = Output::usual(&scene);
        }
        let arguments = scene_arguments(&request);
        let is_whole = |key: &str, start: f64| {
            let scene = arguments.load_scene(&[format!("{key}={start}")]);
            scene.is_ok_and(|scene| scene.takes_whole_numbers(key))
        };
        let design = request.design(is_whole)?;
        require_columns(&design, &request.outputs)?;
        Ok(Self { begun: JournalHeader::new(request, &scene), scene, design, rows })
    }

    fn request(&self) -> &SweepRequest {
        &self.begun.request
    }

    /// Runs of the shard that have not ended yet.
    fn pending(&self) -> Vec<usize> {
        let shard = self.request().shard;
        (0..self.design.runs.len()).filter(|&run| shard.has(run) && !self.rows.contains_key(&run)).collect()
    }

    /// Name of the folder where none is given.
    fn name(&self) -> String {
        let Shard { number, of } = self.request().shard;
        let shard = if of > 1 { format!("-{number}-of-{of}") } else { String::new() };
        format!("{}-sweep{shard}", self.scene.name)
    }

    /// Writes the table, gives the folder its name, and prints JSON or words.
    fn finish(
        self,
        arguments: &SweepArguments,
        folder: OutputFolder,
        start: Instant,
    ) -> Result<ExitCode, Refusal> {
        let table = Table {
            title: &self.scene.raw.title,
            design: &self.design,
            is_grid: self.request().samples.is_none(),
            outputs: &self.request().outputs,
            rows: &self.rows,
        };
        if let Some(name) = arguments.plot.as_deref().filter(|name| !table.has_numbers(name)) {
            let why = match table.diverged() {
                0 => "is a number in no run",
                _ => "is a number in no run but those that diverged",
            };
            note!("caution: `{name}` {why}, so that there is nothing to draw");
        }
        if let Some(caution) = self.ids_elsewhere() {
            note!("caution: {caution}");
        }
        write_sweep(&folder, &table, arguments.figures.figures, arguments.plot.as_deref())?;
        let json = arguments.json.then(|| table.json());
        let kept = interrupt::commit(folder)?;
        if let Some(json) = json {
            print(&format!("{json:#}\n"))?;
        } else if !arguments.output.quiet {
            let seconds = start.elapsed().as_secs_f64();
            let (name, ends) = (&self.scene.name, self.ends());
            say(&format!("{name}: {ends}, {seconds:.2} s\nresults in {}\n", kept.display()))?;
        }
        let cautioned = self.rows.values().filter(|row| !row.cautions.is_empty()).count();
        if cautioned > 0 {
            let all = counted(self.rows.len(), "run");
            note!("caution: {cautioned} of {all} with cautions of their own: see the column `cautions`");
        }
        let is_refused = self.rows.values().any(Row::is_refused);
        Ok(exit_code(!is_refused))
    }

    /// Names what asks for particles by ids where a varied key gives those to others.
    fn ids_elsewhere(&self) -> Option<String> {
        let lays_out =
            |key: &&str| ["lattice", "body"].contains(&key.split(['.', '[']).next().unwrap_or(key));
        let key = self.design.factors.iter().map(|factor| factor.key.as_str()).find(lays_out)?;
        let probe = self.request().outputs.iter().find(|name| name.starts_with("probe.")).cloned();
        let name = probe.or_else(|| self.scene.picks_by_ids())?;
        Some(format!(
            "`{key}` lays the particles out anew, and an id, as `{name}` has, is then another one's: ask for places (record.places), \
             and pick regions by place"
        ))
    }

    /// `20 runs, all ended at stop.steps`, or `20 runs: 18 ended at stop.steps, 2 diverged`.
    fn ends(&self) -> String {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        self.rows.values().for_each(|row| *counts.entry(&row.stop_reason).or_default() += 1);
        if counts.is_empty() {
            return "no runs: this shard has none of the study's".into();
        }
        let runs = counted(self.rows.len(), "run");
        let counts: Vec<(&str, usize)> = counts.into_iter().collect();
        if let [(reason, count)] = counts[..] {
            let all = if count == 1 { "" } else { "all " };
            return format!("{runs}, {all}{}", in_words(reason));
        }
        let parts: Vec<String> =
            counts.iter().map(|(reason, count)| format!("{count} {}", in_words(reason))).collect();
        format!("{runs}: {}", parts.join(", "))
    }
}

/// How a run ended, after its subject.
fn in_words(reason: &str) -> &str {
    match reason {
        "steps" => "ended at stop.steps",
        "equilibrium" => "came to equilibrium",
        "unsettled" => "did not come to rest",
        "stuck" => "got stuck",
        other => other,
    }
}

fn scene_arguments(request: &SweepRequest) -> SceneArguments {
    SceneArguments::new(&request.scene, &request.set)
}

/// Refuses an output whose name another column of the table has.
fn require_columns(design: &Design, outputs: &[String]) -> Result<(), Refusal> {
    let rows = BTreeMap::new();
    let table = Table { title: "", design, is_grid: true, outputs, rows: &rows };
    let head = table.head();
    match outputs.iter().find(|name| head.iter().filter(|column| *column == name).count() > 1) {
        None => Ok(()),
        Some(name) => {
            let message = format!("the table would have two columns `{name}`");
            Err(wrong("--outputs", message, "name it once; varied keys and `stop_reason` are there unasked")
                .into())
        }
    }
}

/// Makes the runs, goes on with them, or puts shards together.
pub fn sweep(arguments: &SweepArguments) -> Result<ExitCode, Refusal> {
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| Refusal::threads(threads, error))?.install(|| sweep_here(arguments))
}

fn sweep_here(arguments: &SweepArguments) -> Result<ExitCode, Refusal> {
    let start = Instant::now();
    if !arguments.merge.is_empty() {
        return merge(arguments, start);
    }
    let found = arguments.resume.as_deref().map(read).transpose()?;
    let (request, rows) = match &found {
        Some(found) => {
            let mut request = found.begun.request.clone();
            // The place is taken by the runs that are gone on with, and will be when this is gone on with in turn.
            request.force |= found.folder == found.out;
            let mut rows = gather(std::slice::from_ref(found))?;
            // What was in the way of a run may be gone.
            rows.retain(|_, row| !row.is_refused());
            (request, rows)
        }
        None => (arguments.request()?, BTreeMap::new()),
    };
    let mut sweep = Sweep::new(request, rows)?;
    found.as_ref().map_or(Ok(()), |found| found.begun.require_same(&found.folder, &sweep.begun))?;
    arguments.require_unvaried(&sweep.design)?;
    arguments.require_plotted(&sweep.request().outputs)?;
    let outputs: Vec<Output> =
        sweep.request().outputs.iter().map(|name| name.parse()).collect::<Result<_, _>>()?;
    let scene = scene_arguments(sweep.request());
    let runs = Runs { scene: &scene, design: &sweep.design, outputs: &outputs };

    runs.require_reached()?;
    let mut pending = sweep.pending();
    // A misspelt key or output is found before a folder is made.
    let first = if found.is_none() && !pending.is_empty() { runs.first(&pending)? } else { Vec::new() };
    let interrupted = interrupt::keeps();
    let (folder, journal) = open(arguments, found.as_ref(), &sweep)?;
    let begun = quoted(&folder.folder().to_string_lossy());
    let words = format!("interrupted: `flockform sweep --resume {begun}` goes on");
    interrupt::says(words.clone());
    for row in first {
        journal.add(&row)?;
        pending.retain(|&run| run != row.run);
        sweep.rows.insert(row.run, row);
    }
    let made = runs.make((sweep.rows.len(), &pending), &journal, arguments.output.quiet)?;
    drop(journal);
    if interrupted.load(std::sync::atomic::Ordering::Relaxed) {
        note!("{words}");
        return Ok(ExitCode::from(FAILED));
    }
    sweep.rows.extend(made.into_iter().map(|row| (row.run, row)));
    sweep.finish(arguments, folder, start)
}

/// The folder of a new sweep, or of one that is gone on with, and its journal.
fn open(
    arguments: &SweepArguments,
    found: Option<&StoredSweep>,
    sweep: &Sweep,
) -> Result<(OutputFolder, Journal), ExportError> {
    match found {
        Some(found) if found.folder != found.out => {
            let folder = OutputFolder::reopen(&found.out, found.begun.request.force)?;
            let journal = Journal::resume(&folder, found)?;
            Ok((folder, journal))
        }
        _ => {
            let mut folder = match found {
                Some(found) => {
                    // What else was begun in this place is not discarded unasked.
                    let begun = unfinished(&found.out);
                    if begun.exists() {
                        return Err(ExportError::Unfinished(begun));
                    }
                    super::output::create(&found.out, true)?
                }
                None => arguments.output.folder(&sweep.name())?,
            };
            let rows: Vec<Row> = sweep.rows.values().cloned().collect();
            let journal = Journal::begin(&mut folder, &sweep.begun, &rows)?;
            Ok((folder, journal))
        }
    }
}

/// Puts the runs of several folders into one; what is missing can be made with `--resume`.
fn merge(arguments: &SweepArguments, start: Instant) -> Result<ExitCode, Refusal> {
    let parts: Vec<StoredSweep> = arguments.merge.iter().map(|dir| read(dir)).collect::<Result<_, _>>()?;
    let Some((one, others)) = parts.split_first() else { return Ok(ExitCode::SUCCESS) };
    let whole = one.begun.whole();
    if let Some(other) = others.iter().find(|other| other.begun.whole() != whole) {
        return Err(SweepError::apart(&one.folder, &other.folder, "they were asked for otherwise").into());
    }
    let rows = gather(&parts)?;
    let mut request = whole.request;
    request.force = arguments.output.force;
    let sweep = Sweep::new(request, rows)?;
    one.begun.require_same(&one.folder, &sweep.begun)?;
    arguments.require_plotted(&sweep.request().outputs)?;
    let (folder, journal) = open(arguments, None, &sweep)?;
    drop(journal);
    let missing = sweep.pending();
    let out = folder.folder().with_extension("");
    let code = sweep.finish(arguments, folder, start)?;
    if missing.is_empty() {
        return Ok(code);
    }
    let (count, first) = (missing.len(), missing[0]);
    note!(
        "{} {} missing, the first is run {first}: `flockform sweep --resume {}` makes {}",
        counted(count, "run"),
        if count == 1 { "is" } else { "are" },
        quoted(&out.to_string_lossy()),
        if count == 1 { "it" } else { "them" }
    );
    Ok(ExitCode::from(FAILED))
}
