//! The command line: commands, options, and the function behind each.

/// Writes a line to standard error, and goes on where nothing takes it: work is not lost with a caution.
macro_rules! note {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($words)*);
    }};
}

mod bench;
mod bundle;
mod checkpoint;
mod compare;
mod completions;
mod film;
mod gallery;
mod install;
pub mod interrupt;
mod live;
pub mod log;
mod log_writer;
mod material;
pub mod memory;
mod names;
mod node;
mod output;
mod plan;
mod progress;
mod ranks;
mod recording;
mod replay;
mod run;
mod stability;
mod study;
mod supervise;
mod swarm;
mod sweep;
mod trade;

use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue};
use clap::{Parser, Subcommand};
use clap_complete::Shell;
use flockform::export;
use flockform::messages::escaped;
use flockform::ros::arguments::{RosArgumentError, RosArguments};
use flockform::ros::node::NodeError;
use flockform::scene::{self, SceneError};
use flockform::shm::ShmError;
use node::Transport;

/// Exit code of a run that started and failed: diverged or interrupted.
pub const FAILED: u8 = 1;

/// Exit code for input that was refused.
pub const BAD_INPUT: u8 = 2;

/// Flocking rules that make a body deform or a swarm hold a formation.
#[derive(Debug, Parser)]
#[command(
    version,
    propagate_version = true,
    after_help = "Example:\n  flockform run tension\n\nExit codes: 0 done, 1 ran but failed (diverged, interrupted), 2 bad input."
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    /// Log more to standard error: -v information, -vv debugging, -vvv everything (RUST_LOG overrides)
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    pub verbose: u8,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Runs a continuum scene and writes its results and figures
    #[command(
        after_help = "Examples:\n  flockform run tension --out /tmp/tension --set stop.steps=800 --set frame=immediate\n  flockform run --resume /tmp/tension"
    )]
    Run(run::RunArguments),
    /// Compares a scene's rule with finite elements on the same body
    #[command(
        after_help = "Examples:\n  flockform compare beam --out /tmp/beam\n  flockform compare beam-paper --set neighbours.kind=second"
    )]
    Compare(compare::CompareArguments),
    /// Measures what accuracy costs: many rules, spacings and solvers of a scene against finite elements
    #[command(
        after_help = "Examples:\n  flockform trade grips --out /tmp/trade\n  flockform trade beam-loaded --max-particles 5000"
    )]
    Trade(trade::TradeArguments),
    /// Runs a scene with many values of its keys, in parallel: one table, one figure
    #[command(
        after_help = "Examples:\n  flockform sweep tension --vary 'roles[1].motion.per_step=[[0.3, 0.0], [0.6, 0.0]]'\n  \
                      flockform sweep tension --vary rule.feedback.factor=-0.2:0:5 --vary stop.steps=100:400:4 --outputs energies.pe1,probe.67.ux@60\n  \
                      flockform sweep beam --vary material.poisson=0:0.45 --samples 40 --seed 1 --shard 1/4 --out part-1\n  \
                      flockform sweep --resume part-1\n  \
                      flockform sweep --merge part-1 part-2 part-3 part-4 --out all\n\n\
                      Exit codes: 0 all runs ended, 1 interrupted or some refused, 2 bad input."
    )]
    Sweep(sweep::SweepArguments),
    /// Predicts and measures when a scene's body grows instead of coming to rest, and tests extreme input
    #[command(
        after_help = "Examples:\n  flockform stability tension --out /tmp/stability\n  flockform stability beam --set update.damping=0.7 --no-extremes\n\n\
                      Exit codes: 0 predictions and runs agree and no extreme is wrong, 1 otherwise, 2 bad input."
    )]
    Stability(stability::StabilityArguments),
    /// Flies a swarm of simulated robots, without middleware, and reports how it went
    #[command(
        after_help = "Examples:\n  flockform swarm gap --out /tmp/gap\n  flockform swarm antipodal --set limits.speed=0.5\n\n\
                      Exit codes: 0 flown and every declared bound held, 1 a bound broken or interrupted, 2 bad input."
    )]
    Swarm(swarm::SwarmArguments),
    /// Shows a body or a swarm in a browser on this computer, to be led by hand, cut and changed while it runs
    #[command(
        after_help = "Examples:\n  flockform live tension --open\n  flockform live gap --port 8080\n\n\
                      Drag leaders, clamps or any particle; cut bonds; change keys; save what was done as a file that \
                      `flockform run` or `flockform swarm` replays to the bit."
    )]
    Live(live::LiveArguments),
    /// Replays a recorded flight and lists where today's targets differ from the recorded ones
    #[command(
        after_help = "Examples:\n  flockform swarm gap --record gap.mcap\n  flockform replay gap.mcap\n  flockform replay gap.mcap --set limits.speed=0.5 --tolerance 0.01\n\n\
                      Exit codes: 0 no target is farther off than the tolerance, 1 some are or the recording breaks off, 2 bad input."
    )]
    Replay(replay::ReplayArguments),
    /// Keeps a swarm in formation over ROS 2 or shared memory: poses in, safe targets out
    #[command(
        after_help = "Examples:\n  flockform node square --ros-args -r __ns:=/fleet -p speed_limit:=0.5\n  flockform node square --member robot_3 --set control.sweeps=1\n  flockform node square --live --open\n  flockform node square --transport shm\n\n\
                      Exit codes: 0 ended as asked, 2 bad input, 70 the middleware is gone and cannot be started again."
    )]
    Node(node::NodeArguments),
    /// Simulates the robots of a swarm file, over ROS 2 or shared memory
    #[command(
        after_help = "Examples:\n  flockform robots square --ros-args -p publish_clock:=true\n  flockform robots square --node-per-robot\n  flockform robots square --transport shm"
    )]
    Robots(node::RobotsArguments),
    /// Runs every bundled scene and swarm and builds a page that links to their reports
    #[command(
        after_help = "Examples:\n  flockform gallery --out /tmp/gallery\n  flockform gallery tension gap"
    )]
    Gallery(gallery::GalleryArguments),
    /// Lists the bundled scenes or swarms, one a line
    #[command(after_help = "Examples:\n  flockform list scenes\n  flockform list swarms --json")]
    List(bundle::ListArguments),
    /// Prints the file of a bundled scene or swarm as it is
    #[command(after_help = "Examples:\n  flockform show tension\n  flockform show square > my_swarm.toml")]
    Show(bundle::ShowArguments),
    /// Writes a scene or swarm file to begin with
    #[command(
        after_help = "Examples:\n  flockform new scene plate --from plate-hole && flockform run plate.toml\n  flockform new swarm patrol"
    )]
    New(bundle::NewArguments),
    /// Shows what a scene makes the program model, or the margins and speeds of a swarm, without running it
    #[command(
        after_help = "Examples:\n  flockform plan fracture --set lattice.a=5.0\n  flockform plan square --set control.sweeps=1"
    )]
    Plan(plan::PlanArguments),
    /// Computes which material a rule is, or which weights a material takes
    #[command(
        after_help = "Examples:\n  flockform material --lattice square\n  flockform material --lattice hexagonal --neighbours second\n  \
                      flockform material --lattice hexagonal --young 210e9 --poisson 0.3 --thickness 1e-3\n  \
                      flockform material --lattice square --young 9,1 --poisson 0.4 --shear 0.6 --fiber-angle 30\n  \
                      flockform material second-gradient --json"
    )]
    Material(material::MaterialArguments),
    /// Installs this program as a ROS 2 package: executable, launch files, parameters, swarms
    #[command(
        after_help = "Example:\n  flockform install --prefix ~/flockform && source ~/flockform/setup.bash && ros2 launch flockform formation_launch.xml"
    )]
    Install(install::InstallArguments),
    /// Prints the JSON Schema of a scene file
    #[command(after_help = "Examples:\n  flockform schema > scene.schema.json\n  flockform schema --swarm")]
    Schema {
        /// Print that of a swarm file instead
        #[arg(long)]
        swarm: bool,
    },
    /// Prints a completion script for a shell
    #[command(
        after_help = "Example:\n  flockform completions bash > ~/.local/share/bash-completion/completions/flockform"
    )]
    Completions {
        /// The shell to complete for
        shell: Shell,
    },
    /// Measures how fast this machine runs the rules
    #[command(subcommand)]
    Bench(bench::BenchCommand),
}

/// Commands and options that had another name once.
const RENAMED: [(&str, &str); 4] = [
    ("scenes", "list scenes"),
    ("swarms", "list swarms"),
    ("--fibres", "--fiber-angle"),
    ("--most-particles", "--max-particles"),
];

/// Reason why a command refused its input.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    #[error("{0}")]
    Scene(#[from] SceneError),
    #[error("{0}")]
    Node(#[from] NodeError),
    #[error("cannot start a process to do the work: {0}")]
    Supervise(std::io::Error),
    #[error("{0}")]
    Shm(#[from] ShmError),
    #[error("{0}")]
    Ros(#[from] RosArgumentError),
    #[error(
        "`{then}` is called `{now}` now\n  help: `flockform --help` lists every command, and `--help` after one its options"
    )]
    Renamed { then: &'static str, now: &'static str },
    /// Words of the parser: what is wrong with a command line, or the help that it asks for.
    #[error("{}", .0.to_string().trim_start_matches("error: ").trim_end())]
    Usage(clap::Error),
    #[error("{0}")]
    Export(#[from] export::ExportError),
    #[error("{0}")]
    Film(#[from] export::film::FilmError),
    #[error("{0}")]
    Record(#[from] flockform::record::RecordError),
    #[error("{0}")]
    Design(#[from] flockform::study::design::DesignError),
    #[error("{0}")]
    Sweep(#[from] export::sweep::SweepError),
    #[error("{0}")]
    Checkpoint(#[from] export::checkpoint::CheckpointError),
    #[error("{0}")]
    NotBundled(String),
    #[error("`{name}` is a {kind}\n  help: `flockform {command} {name}`")]
    OtherKind { name: String, kind: &'static str, command: &'static str },
    #[error(
        "`{name}` cannot be the name of a {kind} file\n  help: give letters, digits, `-` and `_`, with a folder before them if need be"
    )]
    NewName { name: String, kind: &'static str },
    #[error("{} is there already\n  help: give another name, or remove it first", .0.display())]
    Exists(PathBuf),
    #[error("cannot write to standard output: {0}")]
    Print(std::io::Error),
    #[error("cannot write {}: {source}{}", .path.display(), folder_first(.path))]
    NewFile { path: PathBuf, source: std::io::Error },
    #[error(
        "`{name}` left no report for the gallery: {reason}\n  help: run it alone to see why, or name the others"
    )]
    Exhibit { name: String, reason: String },
    #[error(
        "no page can be served{}: {source}\n  help: give another --port, or none",
        .port.map_or_else(String::new, |port| format!(" at port {port}"))
    )]
    Live { port: Option<u16>, source: std::io::Error },
    #[error("--record: nothing is recorded: {0}")]
    LiveRecord(String),
    #[error("{} is no folder to save in\n  help: make it, or give another as --out", .0.display())]
    LiveFolder(PathBuf),
    #[error("{0}")]
    Option(#[from] material::WrongOption),
    #[error("{0}")]
    Install(#[from] install::InstallError),
    #[error("no threads to measure with: {0}")]
    Bench(#[from] rayon::ThreadPoolBuildError),
    #[error("{0}")]
    BenchEquilibrium(#[from] flockform::bench::equilibrium::EquilibriumError),
    #[error("{0}")]
    Ranks(#[from] ranks::RanksError),
    #[error("--threads {threads}: {error}\n  help: give a number from 1 to the machine's cores")]
    Threads { threads: usize, error: std::io::Error },
}

/// The remedy for a file in a folder that is not there.
fn folder_first(path: &Path) -> String {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.exists());
    folder.map_or_else(String::new, |folder| {
        format!("\n  help: make the folder first: mkdir -p {}", folder.display())
    })
}

impl Refusal {
    /// Threads that the system does not give.
    fn threads(threads: usize, error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Refusal::Threads { threads, error: std::io::Error::other(error) }
    }

    /// Whether the work was begun, and the machine failed it: a full disk above all.
    fn is_failure(&self) -> bool {
        use export::ExportError;
        use export::film::FilmError;
        use flockform::record::RecordError;
        let is_full = |error: &std::io::Error| {
            use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
            matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
        };
        match self {
            Refusal::Export(ExportError::Io { source, .. } | ExportError::Unmakeable { source, .. })
            | Refusal::Film(FilmError::File(ExportError::Io { source, .. }))
            | Refusal::Record(RecordError::Io { source, .. })
            | Refusal::Install(install::InstallError::Write { error: source, .. })
            | Refusal::NewFile { source, .. } => is_full(source),
            Refusal::LiveRecord(_) | Refusal::Print(_) | Refusal::Exhibit { .. } => true,
            Refusal::Export(ExportError::NotMoved { .. }) | Refusal::Record(RecordError::Kept { .. }) => true,
            Refusal::Record(RecordError::Write { .. }) => true,
            Refusal::Film(FilmError::Encoder { .. } | FilmError::Frame { .. }) => true,
            _ => false,
        }
    }
}

/// The command line, with the ROS arguments split off.
///
/// # Errors
/// One that cannot be read: of several ranks that have the same, the first one speaks.
pub fn arguments() -> Result<(Arguments, RosArguments), Refusal> {
    read_arguments().map_err(ranks::said_by_one)
}

fn read_arguments() -> Result<(Arguments, RosArguments), Refusal> {
    let all: Vec<OsString> = std::env::args_os().collect();
    let is_asked = all.iter().any(|argument| argument == "--ros-args");
    let split = RosArguments::parse(all.clone(), &|name| std::env::var(name).ok());
    // Only a node is concerned by wrong ROS variables.
    let (rest, ros) = match split {
        Err(error) if is_asked => return Err(error.into()),
        Err(error) => (all, Err(error)),
        Ok((rest, ros)) => (rest, Ok(ros)),
    };
    let arguments = Arguments::try_parse_from(rest).map_err(|error| match renamed(&error) {
        Some((then, now)) => Refusal::Renamed { then, now },
        None => Refusal::Usage(error),
    })?;
    match arguments.command {
        Command::Node(node::NodeArguments { transport: Transport::Ros2, .. })
        | Command::Robots(node::RobotsArguments { transport: Transport::Ros2, .. }) => Ok((arguments, ros?)),
        _ if is_asked => {
            let help =
                "leave them out, or use `flockform node` or `flockform robots` without --transport shm";
            Err(material::wrong("--ros-args", "this command is no ROS 2 node", help).into())
        }
        _ => Ok((arguments, RosArguments::default())),
    }
}

/// The command or option that the command line calls by its old name.
fn renamed(error: &clap::Error) -> Option<(&'static str, &'static str)> {
    let kinds = [ContextKind::InvalidSubcommand, ContextKind::InvalidArg];
    let wrong = kinds.into_iter().find_map(|kind| error.get(kind))?;
    RENAMED.into_iter().find(|(then, _)| matches!(wrong, ContextValue::String(word) if word == then))
}

/// Has a run take no more memory than it must: it is the one command whose size is that of its body. `plan` says what a run takes.
pub fn spare_memory(command: &Command) {
    if matches!(command, Command::Run(_) | Command::Plan(_)) {
        memory::return_what_is_dropped();
    }
}

/// Says why nothing was done, and gives the exit code; what an interrupt has broken off is no bad input.
pub fn refuse(refusal: &Refusal) -> ExitCode {
    interrupt::leave_to_the_end();
    if interrupt::is_raised() && !matches!(refusal, Refusal::Export(export::ExportError::NotMoved { .. })) {
        interrupt::print_last_words();
        return ExitCode::from(FAILED);
    }
    if matches!(
        refusal,
        Refusal::Ranks(ranks::RanksError::SaidElsewhere)
            | Refusal::Export(export::ExportError::OnRank { .. })
    ) {
        // A launcher ends all ranks when one of them fails: the one that speaks fails, and gets to speak.
        return ExitCode::SUCCESS;
    }
    if let Refusal::Usage(usage) = refusal {
        return match usage.print() {
            Err(lost) if lost.kind() != ErrorKind::BrokenPipe => refuse(&Refusal::Print(lost)),
            _ => u8::try_from(usage.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from),
        };
    }
    note!("error: {}", on_terminal(&refusal.to_string()));
    ExitCode::from(if refusal.is_failure() { FAILED } else { BAD_INPUT })
}

/// The name of a command that several ranks may not share: they would write their results over each other, or each the
/// same. A command that is added has to be placed here.
fn runs_alone(command: &Command) -> Option<&'static str> {
    match command {
        Command::Compare(_) => Some("compare"),
        Command::Trade(_) => Some("trade"),
        Command::Sweep(sweep) => (!sweep.is_shard()).then_some("sweep"),
        Command::Stability(_) => Some("stability"),
        Command::Swarm(_) => Some("swarm"),
        Command::Live(_) => Some("live"),
        Command::Replay(_) => Some("replay"),
        Command::Gallery(_) => Some("gallery"),
        Command::New(_) => Some("new"),
        Command::Install(_) => Some("install"),
        // They share what they do.
        Command::Run(_) | Command::Bench(bench::BenchCommand::Scale { .. }) => None,
        Command::Bench(_) => Some("bench"),
        // Each is a node of its own.
        Command::Node(_) | Command::Robots(_) => None,
        // They write nothing.
        Command::List(_) | Command::Show(_) | Command::Plan(_) | Command::Material(_) => None,
        Command::Schema { .. } | Command::Completions { .. } => None,
    }
}

/// The exit code of what ended well, or failed.
fn exit_code(is_well: bool) -> ExitCode {
    if is_well { ExitCode::SUCCESS } else { ExitCode::from(FAILED) }
}

pub fn dispatch(command: Command, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    if let Some(name) = runs_alone(&command) {
        ranks::require_alone(name)?;
    }
    match command {
        Command::Run(arguments) => return run::run(&arguments),
        Command::Compare(arguments) => return compare::compare(&arguments),
        Command::Trade(arguments) => return trade::trade(&arguments),
        Command::Sweep(arguments) => return sweep::sweep(&arguments),
        Command::Stability(arguments) => return stability::stability(&arguments),
        Command::Swarm(arguments) => return swarm::swarm(&arguments),
        Command::Live(arguments) => return live::live(&arguments),
        Command::Replay(arguments) => return replay::replay(&arguments),
        Command::Node(arguments) => return node::node(&arguments, ros),
        Command::Robots(arguments) => return node::robots(&arguments, ros),
        Command::List(arguments) => bundle::list(&arguments)?,
        Command::Show(arguments) => bundle::show(&arguments)?,
        Command::New(arguments) => bundle::new(&arguments)?,
        Command::Gallery(arguments) => return gallery::gallery(&arguments),
        Command::Install(arguments) => return install::install(&arguments),
        Command::Plan(arguments) => plan::plan(&arguments)?,
        Command::Material(arguments) => say(&material::answer(&arguments)?)?,
        Command::Schema { swarm: false } => print(&format!("{:#}\n", scene::validate::schema()))?,
        Command::Schema { swarm: true } => print(&format!("{:#}\n", scene::swarm::schema()))?,
        Command::Completions { shell } => print(&completions::script(shell))?,
        Command::Bench(command) => bench::bench(command)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Prints words, some of which may come from files: no control character of theirs reaches the terminal.
fn say(text: &str) -> Result<(), Refusal> {
    print(&on_terminal(text))
}

/// A text whose lines stay, and whose other control characters are escaped.
fn on_terminal(text: &str) -> String {
    let ends = ['\n', '\t'];
    let shown = |piece: &str| {
        let words = piece.trim_end_matches(ends);
        escaped(words, usize::MAX) + &piece[words.len()..]
    };
    text.replace("\r\n", "\n").split_inclusive(ends).map(shown).collect()
}

/// Writes to standard output; a reader that has gone away (`| head`) is no error.
fn print(text: &str) -> Result<(), Refusal> {
    use std::io::Write;
    let mut output = std::io::stdout();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Refusal::Print(error)),
        _ => Ok(()),
    }
}
