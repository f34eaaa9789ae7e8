//! The command line: what can be asked for, and who answers.

mod compare;
mod material;
mod output;
mod progress;
mod run;
mod stability;
mod trade;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use flockform::compare::run::plan;
use flockform::continuum::report::PlanReport;
use flockform::scene::{self, Scene, SceneError, bundled};
use flockform::{bench, export};

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
    /// Say more on standard error: -v information, -vv debugging, -vvv everything (RUST_LOG overrides)
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    pub verbose: u8,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a continuum scene and write its results and figures
    #[command(
        after_help = "Example:\n  flockform run tension --out /tmp/tension --set stop.steps=800 --set frame=immediate"
    )]
    Run(run::RunArguments),
    /// Hold a scene's rule against finite elements on the same body
    #[command(
        after_help = "Example:\n  flockform compare beam --out /tmp/beam\n  flockform compare beam-paper --set neighbours.kind=second"
    )]
    Compare(compare::CompareArguments),
    /// What accuracy costs: run a scene by many rules, spacings and solvers against finite elements
    #[command(
        after_help = "Example:\n  flockform trade grips --out /tmp/trade\n  flockform trade beam-loaded --most-particles 5000"
    )]
    Trade(trade::TradeArguments),
    /// When a scene's body grows instead of coming to rest, foretold and found, and what holds at the extremes
    #[command(
        after_help = "Example:\n  flockform stability tension --out /tmp/stability\n  flockform stability beam --set update.damping=0.7 --no-extremes\n\n\
                      Exit codes: 0 predictions and runs agree and no extreme is wrong, 1 otherwise, 2 bad input."
    )]
    Stability(stability::StabilityArguments),
    /// List the bundled scenes
    #[command(after_help = "Example:\n  flockform scenes")]
    Scenes,
    /// Say what a scene makes the program model and what it leaves out, without running it
    #[command(after_help = "Example:\n  flockform plan fracture --set lattice.a=5.0")]
    Plan(SceneArguments),
    /// Say what material a rule is, or which weights a material takes
    #[command(
        after_help = "Examples:\n  flockform material --lattice square\n  flockform material --lattice hexagonal --neighbours second\n  \
                      flockform material --lattice hexagonal --young 210e9 --poisson 0.3 --thickness 1e-3\n  \
                      flockform material --lattice square --young 9,1 --poisson 0.4 --shear 0.6 --fibres 30\n  \
                      flockform material second-gradient --json"
    )]
    Material(material::MaterialArguments),
    /// Print the JSON Schema of a scene file
    #[command(after_help = "Example:\n  flockform schema > scene.schema.json")]
    Schema,
    /// Print a completion script for a shell
    #[command(
        after_help = "Example:\n  flockform completions bash > ~/.local/share/bash-completion/completions/flockform"
    )]
    Completions {
        /// The shell to complete for
        shell: Shell,
    },
    /// Measure how fast this machine runs the rules
    #[command(subcommand)]
    Bench(BenchCommand),
}

#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Particle updates per second of the plain rule, beside the machine's memory bandwidth
    #[command(after_help = "Example:\n  flockform bench sweep --json > sweep.json")]
    Sweep {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small sizes and few repetitions: shows that it works, measures nothing worth quoting
        #[arg(long)]
        quick: bool,
    },
    /// Robots served per millisecond by one thread: neighbour query and rule, and with the safety filter
    #[cfg(feature = "swarm")]
    #[command(after_help = "Example:\n  flockform bench swarm --json > swarm.json")]
    Swarm {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small swarms and few repetitions: shows that it works, measures nothing worth quoting
        #[arg(long)]
        quick: bool,
    },
    /// Seconds to equilibrium by multigrid, beside a factorisation of the same system
    #[cfg(feature = "fem")]
    #[command(after_help = "Example:\n  flockform bench equilibrium --json > equilibrium.json")]
    Equilibrium {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small bodies and few repetitions: shows that it works, measures nothing worth quoting
        #[arg(long)]
        quick: bool,
    },
}

/// Which scene, with which changes.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// Name of a bundled scene (see `flockform scenes`) or path of a scene file
    pub scene: String,
    /// Override a key of the scene, validated like the file: lattice.spacing=0.5, roles\[1\].from=30
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub set: Vec<String>,
}

impl SceneArguments {
    fn load(&self, more: impl IntoIterator<Item = String>) -> Result<Scene, Refusal> {
        let more: Vec<String> = more.into_iter().collect();
        if bundled(&self.scene).is_none() {
            self.path()?;
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

    /// The scene as a path; a word that is no file is taken for the name of a bundled scene, misspelt.
    fn path(&self) -> Result<PathBuf, Refusal> {
        let path = PathBuf::from(&self.scene);
        if path.exists() || self.scene.contains(['/', '\\', '.']) {
            return Ok(path);
        }
        let likeness = |name: &str| strsim::jaro_winkler(name, &self.scene);
        let names = bundled::SCENES.iter().map(|scene| scene.name);
        let nearest = names.max_by(|a, b| likeness(a).total_cmp(&likeness(b))).unwrap_or_default();
        Err(Refusal::NoScene { name: self.scene.clone(), nearest })
    }
}

/// Why nothing was done.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    #[error("{0}")]
    Scene(#[from] SceneError),
    #[error("{0}")]
    Export(#[from] export::ExportError),
    #[error(
        "there is no scene file and no bundled scene `{name}`\n  help: the nearest bundled scene is `{nearest}`; `flockform scenes` lists them all"
    )]
    NoScene { name: String, nearest: &'static str },
    #[error("{0}")]
    Option(#[from] material::WrongOption),
    #[error("no threads to measure with: {0}")]
    Bench(#[from] rayon::ThreadPoolBuildError),
    #[cfg(feature = "fem")]
    #[error("{0}")]
    BenchEquilibrium(#[from] bench::equilibrium::EquilibriumError),
    #[error("--threads {threads}: {error}\n  help: give a number from 1 to the machine's cores")]
    Threads { threads: usize, error: rayon::ThreadPoolBuildError },
}

/// Logs go to standard error; `RUST_LOG` wins over `-v`.
pub fn start_log(verbose: u8) {
    let level = ["warn", "flockform=info", "flockform=debug", "trace"][usize::from(verbose.min(3))];
    let filter = tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| level.into());
    let colours = std::io::stderr().is_terminal();
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    log.with_ansi(colours).without_time().init();
}

pub fn dispatch(command: Command) -> Result<ExitCode, Refusal> {
    match command {
        Command::Run(arguments) => return run::run(&arguments),
        Command::Compare(arguments) => return compare::compare(&arguments),
        Command::Trade(arguments) => return trade::trade(&arguments),
        Command::Stability(arguments) => return stability::stability(&arguments),
        Command::Scenes => list_scenes()?,
        Command::Plan(arguments) => {
            let scene = arguments.load([])?;
            print(&PlanReport::new(&scene, &plan(&scene)?)?.to_string());
        }
        Command::Material(arguments) => print(&material::answer(&arguments)?),
        Command::Schema => print(&format!("{:#}\n", scene::validate::schema())),
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
        #[cfg(feature = "fem")]
        Command::Bench(BenchCommand::Equilibrium { json, quick }) => {
            let report = bench::equilibrium::run(&bench::equilibrium::Options { quick })?;
            print(&if json { format!("{}\n", serde_json::json!(report)) } else { report.to_string() });
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn list_scenes() -> Result<(), SceneError> {
    let width = bundled::SCENES.iter().map(|scene| scene.name.len()).max().unwrap_or(0);
    for scene in bundled::SCENES {
        print(&format!("{:width$}  {}\n", scene.name, scene.load(&[])?.raw.title));
    }
    Ok(())
}

/// Writes to standard output; a reader that has gone away (`| head`) is no error.
fn print(text: &str) {
    use std::io::Write;
    let _ = std::io::stdout().write_all(text.as_bytes());
}
