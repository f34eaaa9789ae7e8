//! The command line: commands, options, and the function behind each.

mod checkpoint;
mod compare;
mod gallery;
mod install;
mod interrupt;
pub mod log;
mod material;
mod node;
mod output;
mod progress;
mod recording;
mod replay;
mod run;
mod stability;
mod study;
mod supervise;
mod swarm;
mod trade;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue};
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use flockform::continuum::report::PlanReport;
use flockform::messages::escaped;
use flockform::ros::arguments::{RosArgumentError, RosArguments};
use flockform::ros::node::NodeError;
use flockform::scene::{self, Bundled, Scene, SceneError, bundled};
use flockform::shm::ShmError;
use flockform::study::compare::run::plan;
use flockform::{bench, export};
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
        after_help = "Example:\n  flockform compare beam --out /tmp/beam\n  flockform compare beam-paper --set neighbours.kind=second"
    )]
    Compare(compare::CompareArguments),
    /// Measures what accuracy costs: many rules, spacings and solvers of a scene against finite elements
    #[command(
        after_help = "Example:\n  flockform trade grips --out /tmp/trade\n  flockform trade beam-loaded --max-particles 5000"
    )]
    Trade(trade::TradeArguments),
    /// Predicts and measures when a scene's body grows instead of coming to rest, and tests extreme input
    #[command(
        after_help = "Example:\n  flockform stability tension --out /tmp/stability\n  flockform stability beam --set update.damping=0.7 --no-extremes\n\n\
                      Exit codes: 0 predictions and runs agree and no extreme is wrong, 1 otherwise, 2 bad input."
    )]
    Stability(stability::StabilityArguments),
    /// Flies a swarm of simulated robots, without middleware, and reports how it went
    #[command(
        after_help = "Example:\n  flockform swarm gap --out /tmp/gap\n  flockform swarm antipodal --set limits.speed=0.5\n\n\
                      Exit codes: 0 flown and every declared bound held, 1 a bound broken or interrupted, 2 bad input."
    )]
    Swarm(swarm::SwarmArguments),
    /// Replays a recorded flight and lists where today's targets differ from the recorded ones
    #[command(
        after_help = "Examples:\n  flockform swarm gap --record gap.mcap\n  flockform replay gap.mcap\n  flockform replay gap.mcap --set limits.speed=0.5 --tolerance 0.01\n\n\
                      Exit codes: 0 no target is farther off than the tolerance, 1 some are, 2 bad input."
    )]
    Replay(replay::ReplayArguments),
    /// Keeps a swarm in formation over ROS 2 or shared memory: poses in, safe targets out
    #[command(
        after_help = "Example:\n  flockform node square --ros-args -r __ns:=/fleet -p speed_limit:=0.5\n  flockform node square --member robot_3\n  flockform node square --transport shm\n\n\
                      Exit codes: 0 ended as asked, 2 bad input, 70 the middleware is gone and cannot be started again."
    )]
    Node(node::NodeArguments),
    /// Simulates the robots of a swarm file, over ROS 2 or shared memory
    #[command(
        after_help = "Example:\n  flockform robots square --ros-args -p publish_clock:=true\n  flockform robots square --node-per-robot\n  flockform robots square --transport shm"
    )]
    Robots(node::RobotsArguments),
    /// Runs every bundled scene and swarm and builds a page that links to their reports
    #[command(
        after_help = "Example:\n  flockform gallery --out /tmp/gallery\n  flockform gallery tension gap"
    )]
    Gallery(gallery::GalleryArguments),
    /// Lists the bundled scenes or swarms, one a line
    #[command(after_help = "Examples:\n  flockform list scenes\n  flockform list swarms")]
    List {
        /// Kind of file to list
        what: Listed,
    },
    /// Shows what a scene makes the program model and what it leaves out, without running it
    #[command(after_help = "Example:\n  flockform plan fracture --set lattice.a=5.0")]
    Plan(SceneArguments),
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
    #[command(after_help = "Example:\n  flockform schema > scene.schema.json\n  flockform schema --swarm")]
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
    Bench(BenchCommand),
}

/// The kinds of file that `list` lists.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Listed {
    Scenes,
    Swarms,
}

/// Commands and options that had another name once.
const RENAMED: [(&str, &str); 4] = [
    ("scenes", "list scenes"),
    ("swarms", "list swarms"),
    ("--fibres", "--fiber-angle"),
    ("--most-particles", "--max-particles"),
];

#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Particle updates per second, beside the machine's memory bandwidth
    #[command(after_help = "Example:\n  flockform bench sweep --json > sweep.json")]
    Sweep {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small sizes and few repetitions: a trial run, whose figures mean nothing
        #[arg(long)]
        quick: bool,
    },
    /// Robots per millisecond for neighbour query, rule, safety filter and whole tick; pose to target over loopback
    #[cfg(feature = "swarm")]
    #[command(after_help = "Example:\n  flockform bench swarm --json > swarm.json")]
    Swarm {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small swarms and few repetitions: a trial run, whose figures mean nothing
        #[arg(long)]
        quick: bool,
    },
    /// Latency and CPU of carrying poses: in process, iceoryx2, ours over it, Unix socket, DDS over loopback
    #[command(after_help = "Example:\n  flockform bench transport --out /tmp/transport")]
    Transport {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small messages and few of them: a trial run, whose figures mean nothing
        #[arg(long)]
        quick: bool,
        /// Also write the table and a figure to this folder; must be empty or new
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Seconds to equilibrium by multigrid, beside a factorisation of the same system
    #[cfg(feature = "fem")]
    #[command(after_help = "Example:\n  flockform bench equilibrium --json > equilibrium.json")]
    Equilibrium {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small bodies and few repetitions: a trial run, whose figures mean nothing
        #[arg(long)]
        quick: bool,
    },
}

/// A scene and the changes to it.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// Name of a bundled scene (see `flockform list scenes`) or path of a scene file
    pub scene: String,
    /// Override a key of the scene, validated like the file: `lattice.spacing=0.5`, `roles[1].from=30`
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub set: Vec<String>,
}

impl SceneArguments {
    fn load(&self, more: impl IntoIterator<Item = String>) -> Result<Scene, Refusal> {
        let more: Vec<String> = more.into_iter().collect();
        if bundled(&self.scene).is_none() {
            scene_path("scene", &self.scene, bundled::SCENES)?;
        }
        Ok(self.load_scene(&more)?)
    }

    /// The scene with these overrides after the user's own.
    fn load_scene(&self, more: &[String]) -> Result<Scene, SceneError> {
        let overrides = [&self.set, more].concat();
        match bundled(&self.scene) {
            Some(bundled) => bundled.load(&overrides),
            None => Scene::from_file(Path::new(&self.scene), &overrides),
        }
    }
}

/// A word as a path; one that is no file is taken for a misspelt name of a bundled file.
fn scene_path(what: &'static str, word: &str, all: &[Bundled]) -> Result<PathBuf, Refusal> {
    let path = PathBuf::from(word);
    if path.exists() || word.contains(['/', '\\', '.']) {
        return Ok(path);
    }
    let likeness = |name: &str| strsim::jaro_winkler(name, word);
    let names = all.iter().map(|one| one.name);
    let nearest = names.max_by(|a, b| likeness(a).total_cmp(&likeness(b))).unwrap_or_default();
    Err(Refusal::NotBundled { what, name: word.to_owned(), nearest })
}

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
        "--ros-args: this command is no ROS 2 node\n  help: leave them out, or use `flockform node` or `flockform robots` without --transport shm"
    )]
    NoNode,
    #[error(
        "--node-per-robot: robots are no ROS 2 nodes over shared memory\n  help: leave it out, or leave out --transport shm"
    )]
    NoNodes,
    #[error(
        "`{then}` is called `{now}` now\n  help: `flockform --help` lists every command, and `--help` after one its options"
    )]
    Renamed { then: &'static str, now: &'static str },
    #[error("{0}")]
    Export(#[from] export::ExportError),
    #[error("{0}")]
    Record(#[from] flockform::record::RecordError),
    #[error("{0}")]
    Checkpoint(#[from] export::checkpoint::CheckpointError),
    #[error(
        "there is no {what} file and no bundled {what} `{name}`\n  help: the nearest bundled {what} is `{nearest}`; `flockform list {what}s` lists them all"
    )]
    NotBundled { what: &'static str, name: String, nearest: &'static str },
    #[error(
        "`{name}` left no report for the gallery: {reason}\n  help: run it alone to see why, or name the others"
    )]
    Exhibit { name: String, reason: String },
    #[error("{0}")]
    Option(#[from] material::WrongOption),
    #[error("{0}")]
    Install(#[from] install::InstallError),
    #[error("no threads to measure with: {0}")]
    Bench(#[from] rayon::ThreadPoolBuildError),
    #[cfg(feature = "fem")]
    #[error("{0}")]
    BenchEquilibrium(#[from] bench::equilibrium::EquilibriumError),
    #[error("--threads {threads}: {error}\n  help: give a number from 1 to the machine's cores")]
    Threads { threads: usize, error: rayon::ThreadPoolBuildError },
}

impl Refusal {
    /// Whether the work was begun, and the machine failed it: a full disk above all.
    fn is_failure(&self) -> bool {
        use export::ExportError;
        use flockform::record::RecordError;
        let is_full = |error: &std::io::Error| {
            use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
            matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
        };
        match self {
            Refusal::Export(ExportError::Io { source, .. })
            | Refusal::Record(RecordError::Io { source, .. }) => is_full(source),
            Refusal::Export(ExportError::NotMoved { .. }) | Refusal::Record(RecordError::Kept { .. }) => true,
            Refusal::Record(RecordError::Write { .. }) => true,
            _ => false,
        }
    }
}

/// The command line, with the ROS arguments split off.
///
/// # Errors
/// Malformed ROS arguments, or ROS arguments for a command that is no node.
pub fn arguments() -> Result<(Arguments, RosArguments), Refusal> {
    let all = std::env::args_os().map(|argument| argument.to_string_lossy().into_owned());
    let all: Vec<String> = all.collect();
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
        None => error.exit(),
    })?;
    match arguments.command {
        Command::Node(node::NodeArguments { transport: Transport::Ros2, .. })
        | Command::Robots(node::RobotsArguments { transport: Transport::Ros2, .. }) => Ok((arguments, ros?)),
        _ if is_asked => Err(Refusal::NoNode),
        _ => Ok((arguments, RosArguments::default())),
    }
}

/// The command or option that the command line calls by its old name.
fn renamed(error: &clap::Error) -> Option<(&'static str, &'static str)> {
    let kinds = [ContextKind::InvalidSubcommand, ContextKind::InvalidArg];
    let wrong = kinds.into_iter().find_map(|kind| error.get(kind))?;
    RENAMED.into_iter().find(|(then, _)| matches!(wrong, ContextValue::String(word) if word == then))
}

/// From now on an interrupt ends the program within a second.
pub fn watch_interrupts() {
    interrupt::watch();
}

/// Says why nothing was done, and gives the exit code; what an interrupt has broken off is no bad input.
pub fn refuse(refusal: &Refusal) -> ExitCode {
    interrupt::leave_to_the_end();
    if interrupt::is_raised() {
        eprintln!("{}", interrupt::NOTHING_KEPT);
        return ExitCode::from(FAILED);
    }
    eprintln!("error: {}", on_terminal(&refusal.to_string()));
    ExitCode::from(if refusal.is_failure() { FAILED } else { BAD_INPUT })
}

pub fn dispatch(command: Command, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    match command {
        Command::Run(arguments) => return run::run(&arguments),
        Command::Compare(arguments) => return compare::compare(&arguments),
        Command::Trade(arguments) => return trade::trade(&arguments),
        Command::Stability(arguments) => return stability::stability(&arguments),
        Command::Swarm(arguments) => return swarm::swarm(&arguments),
        Command::Replay(arguments) => return replay::replay(&arguments),
        Command::Node(arguments) => return node::node(&arguments, ros),
        Command::Robots(arguments) => return node::robots(&arguments, ros),
        Command::List { what: Listed::Scenes } => {
            list(bundled::SCENES, |scene| Ok(scene.load(&[])?.raw.title))?
        }
        Command::List { what: Listed::Swarms } => {
            list(bundled::SWARMS, |swarm| Ok(swarm.load_swarm(&[])?.raw.title))?;
        }
        Command::Gallery(arguments) => return gallery::gallery(&arguments),
        Command::Install(arguments) => return install::install(&arguments),
        Command::Plan(arguments) => {
            let scene = arguments.load([])?;
            say(&PlanReport::new(&scene, &plan(&scene)?)?.to_string());
        }
        Command::Material(arguments) => say(&material::answer(&arguments)?),
        Command::Schema { swarm: false } => print(&format!("{:#}\n", scene::validate::schema())),
        Command::Schema { swarm: true } => print(&format!("{:#}\n", scene::swarm::schema())),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "flockform", &mut script);
            print(&String::from_utf8_lossy(&script));
        }
        Command::Bench(BenchCommand::Sweep { json, quick }) => {
            let report = bench::sweep::run(&bench::sweep::Options { quick })?;
            print(&if json { format!("{}\n", serde_json::json!(report)) } else { report.to_string() });
        }
        #[cfg(feature = "swarm")]
        Command::Bench(BenchCommand::Swarm { json, quick }) => {
            let report = bench::swarm::run(&bench::swarm::Options { quick });
            print(&if json { format!("{}\n", serde_json::json!(report)) } else { report.to_string() });
        }
        Command::Bench(BenchCommand::Transport { json, quick, out }) => {
            let folder = out.map(|out| output::create(&out, false)).transpose()?;
            let report = bench::transport::run(&bench::transport::Options { quick });
            print(&if json { format!("{}\n", serde_json::json!(report)) } else { report.to_string() });
            if let Some(folder) = folder {
                export::transport::write_transport(&folder, &report)?;
                interrupt::commit(folder)?;
            }
        }
        #[cfg(feature = "fem")]
        Command::Bench(BenchCommand::Equilibrium { json, quick }) => {
            let report = bench::equilibrium::run(&bench::equilibrium::Options { quick })?;
            print(&if json { format!("{}\n", serde_json::json!(report)) } else { report.to_string() });
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn list(all: &[Bundled], title: impl Fn(&Bundled) -> Result<String, SceneError>) -> Result<(), SceneError> {
    let width = all.iter().map(|one| one.name.len()).max().unwrap_or(0);
    for one in all {
        print(&format!("{:width$}  {}\n", one.name, title(one)?));
    }
    Ok(())
}

/// Prints words, some of which may come from files: no control character of theirs reaches the terminal.
fn say(text: &str) {
    print(&on_terminal(text));
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
fn print(text: &str) {
    use std::io::Write;
    let _ = std::io::stdout().write_all(text.as_bytes());
}
