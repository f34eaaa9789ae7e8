//! `flockform bench`: what this machine does.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use flockform::ranks::Team;
use flockform::{bench, export};
use serde::Serialize;

use super::ranks::{Start, team};
use super::{Refusal, interrupt, output, print};

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
    /// Efficiency on more and more ranks, measured, counted, and predicted for thousands
    #[command(
        after_help = "Examples:\n  flockform bench scale --out /tmp/scale\n  mpirun -n 4 flockform bench scale    (built with the feature mpi)"
    )]
    Scale {
        /// Print JSON instead of a table
        #[arg(long)]
        json: bool,
        /// Small bodies and few repetitions: a trial run, whose times mean nothing
        #[arg(long)]
        quick: bool,
        /// Also two ranks, or those under mpirun, on large bodies: sweeps of 4096 x 4096 beside as many threads, and the
        /// equilibrium of 1056 x 1056 cells; takes several GB and minutes
        #[arg(long)]
        large: bool,
        /// Most ranks, where they are threads of this process [default: one for each core, at most 8]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=64))]
        ranks: Option<u8>,
        /// Also write the tables and a figure to this folder; must be empty or new
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

/// Measures, and prints a table or JSON.
pub fn bench(command: BenchCommand) -> Result<(), Refusal> {
    match command {
        BenchCommand::Sweep { json, quick } => {
            print_report(&bench::sweep::run(&bench::sweep::Options { quick })?, json)?;
        }
        #[cfg(feature = "swarm")]
        BenchCommand::Swarm { json, quick } => {
            print_report(&bench::swarm::run(&bench::swarm::Options { quick }), json)?;
        }
        BenchCommand::Transport { json, quick, out } => {
            let folder = out.map(|out| output::create(&out, false)).transpose()?;
            let report = bench::transport::run(&bench::transport::Options { quick });
            print_report(&report, json)?;
            if let Some(folder) = folder {
                export::transport::write_transport(&folder, &report)?;
                interrupt::commit(folder)?;
            }
        }
        BenchCommand::Scale { json, quick, large, ranks, out } => {
            scale(
                bench::scale::Options { quick, large, ranks: ranks.map(usize::from) },
                json,
                out.as_deref(),
            )?;
        }
        #[cfg(feature = "fem")]
        BenchCommand::Equilibrium { json, quick } => {
            print_report(&bench::equilibrium::run(&bench::equilibrium::Options { quick })?, json)?;
        }
    }
    Ok(())
}

fn print_report(report: &(impl Serialize + std::fmt::Display), json: bool) -> Result<(), Refusal> {
    print(&if json { format!("{}\n", serde_json::json!(report)) } else { report.to_string() })
}

/// Every rank measures, and the first one says what was found.
fn scale(options: bench::scale::Options, json: bool, out: Option<&Path>) -> Result<(), Refusal> {
    let team = team()?;
    let start = Start::new(team.as_ref());
    let is_first = team.as_ref().is_none_or(Team::is_first);
    let folder = match out.filter(|_| is_first).map(|out| output::create(out, false)).transpose() {
        Ok(folder) => folder,
        Err(refusal) => return Err(start.refused(refusal.into())),
    };
    start.begin(u64::from(options.quick) | u64::from(options.large) << 1)?;
    let report = bench::scale::run(&options, team.as_ref())?;
    if is_first {
        print_report(&report, json)?;
    }
    if let Some(folder) = folder {
        export::scale::write_scale(&folder, &report)?;
        interrupt::commit(folder)?;
    }
    Ok(())
}
