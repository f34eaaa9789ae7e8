//! `flockform bench`: what this machine does.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use flockform::export::OutputFolder;
use flockform::ranks::Team;
use flockform::{bench, export};
use serde::Serialize;

use super::ranks::{Start, team};
use super::{Refusal, interrupt, output, print};

#[derive(Clone, Copy, Debug, Args)]
pub struct BenchArguments {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Small sizes and few repetitions: a trial run, whose figures mean nothing
    #[arg(long)]
    quick: bool,
}

#[derive(Debug, Args)]
pub struct OutArguments {
    /// Also write tables and a figure to this folder; must be empty or new
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Particle updates per second, beside the machine's memory bandwidth
    #[command(after_help = "Example:\n  flockform bench sweep --json > sweep.json")]
    Sweep(BenchArguments),
    /// Robots per millisecond for neighbour query, rule, safety filter and whole tick; pose to target over loopback
    #[command(after_help = "Example:\n  flockform bench swarm --json > swarm.json")]
    Swarm(BenchArguments),
    /// Latency and CPU of carrying poses: in process, iceoryx2, ours over it, Unix socket, DDS over loopback
    #[command(after_help = "Example:\n  flockform bench transport --out /tmp/transport")]
    Transport {
        #[command(flatten)]
        bench: BenchArguments,
        #[command(flatten)]
        out: OutArguments,
    },
    /// Efficiency on more and more ranks, measured, counted, and predicted for thousands
    #[command(
        after_help = "Examples:\n  flockform bench scale --out /tmp/scale\n  mpirun -n 4 flockform bench scale    (built with the feature mpi)"
    )]
    Scale {
        #[command(flatten)]
        bench: BenchArguments,
        /// Also two ranks, or those under mpirun, on large bodies: sweeps of 4096 x 4096 beside as many threads, and the
        /// equilibrium of 1056 x 1056 cells; takes several GB and minutes
        #[arg(long)]
        large: bool,
        /// Most ranks, where they are threads of this process [default: one for each core, at most 8]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=64))]
        ranks: Option<u8>,
        #[command(flatten)]
        out: OutArguments,
    },
    /// Seconds to equilibrium by multigrid, beside a factorisation of the same system
    #[command(after_help = "Example:\n  flockform bench equilibrium --json > equilibrium.json")]
    Equilibrium(BenchArguments),
}

/// Measures, and prints a table or JSON.
pub fn bench(command: BenchCommand) -> Result<(), Refusal> {
    match command {
        BenchCommand::Sweep(bench) => bench.print(&bench::sweep::run(bench.quick)?),
        BenchCommand::Swarm(bench) => bench.print(&bench::swarm::run(bench.quick)),
        BenchCommand::Transport { bench, out } => {
            let folder = out.folder()?;
            let report = bench::transport::run(bench.quick);
            bench.print(&report)?;
            if let Some(folder) = folder {
                export::transport::write_transport(&folder, &report)?;
                interrupt::commit(folder)?;
            }
            Ok(())
        }
        BenchCommand::Scale { bench, large, ranks, out } => scale(bench, large, ranks.map(usize::from), &out),
        BenchCommand::Equilibrium(bench) => bench.print(&bench::equilibrium::run(bench.quick)?),
    }
}

impl BenchArguments {
    fn print(self, report: &(impl Serialize + std::fmt::Display)) -> Result<(), Refusal> {
        print(&if self.json { format!("{}\n", serde_json::json!(report)) } else { report.to_string() })
    }
}

impl OutArguments {
    fn folder(&self) -> Result<Option<OutputFolder>, Refusal> {
        Ok(self.out.as_deref().map(|out| output::create(out, false)).transpose()?)
    }
}

/// Every rank measures, and the first one says what was found.
fn scale(
    bench: BenchArguments,
    large: bool,
    ranks: Option<usize>,
    out: &OutArguments,
) -> Result<(), Refusal> {
    let team = team()?;
    let start = Start::new(team.as_ref());
    let is_first = team.as_ref().is_none_or(Team::is_first);
    let folder = match if is_first { out.folder() } else { Ok(None) } {
        Ok(folder) => folder,
        Err(refusal) => return Err(start.refused(refusal)),
    };
    start.begin(u64::from(bench.quick) | u64::from(large) << 1)?;
    let options = bench::scale::Options { quick: bench.quick, large, ranks };
    let report = bench::scale::run(&options, team.as_ref())?;
    if is_first {
        bench.print(&report)?;
    }
    if let Some(folder) = folder {
        export::scale::write_scale(&folder, &report)?;
        interrupt::commit(folder)?;
    }
    Ok(())
}
