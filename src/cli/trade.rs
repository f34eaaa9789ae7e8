//! `flockform trade`: what accuracy costs in a scene.

use std::process::ExitCode;

use clap::Args;
use flockform::export::report;
use flockform::export::trade::write_trade;
use flockform::study::trade::{Grid, run};

use super::Refusal;
use super::progress::Progress;
use super::study::StudyArguments;

#[derive(Debug, Args)]
pub struct TradeArguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Runs of each setting, of which the median time counts [default: 3, or 1 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    repeats: Option<u16>,
    /// Most particles of a body; larger ones are left out [default: 20000, or 3000 with --quick]
    #[arg(long, value_name = "N")]
    max_particles: Option<usize>,
    /// A few settings, once each: a trial run, whose figures mean nothing
    #[arg(long)]
    quick: bool,
}

/// Runs the scene in many settings and writes what each costs.
pub fn trade(arguments: &TradeArguments) -> Result<ExitCode, Refusal> {
    let usual = if arguments.quick { Grid::quick() } else { Grid::default() };
    let grid = Grid {
        repeats: arguments.repeats.map_or(usual.repeats, usize::from),
        max_particles: arguments.max_particles.unwrap_or(usual.max_particles),
        ..usual
    };
    // Asked for first, so that a misspelt name is a misspelt name.
    let name = arguments.study.scene.load()?.name;
    let folder = arguments.study.output.folder(&format!("{name}-trade"))?;
    let load = |more: &[String]| arguments.study.scene.load_scene(more);
    let progress = Progress::of_stages(arguments.study.output.quiet);
    let study = run(&load, &grid, &mut |setting| progress.stage(&setting.to_string()));
    progress.finish();
    let study = study?;
    write_trade(&folder, &study)?;
    arguments.study.finish(
        folder,
        |folder| report::trade::write(folder, &study),
        || serde_json::json!(study),
        || study.to_string(),
    )?;
    Ok(ExitCode::SUCCESS)
}
