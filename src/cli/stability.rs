//! `flockform stability`: when a scene's body grows, foretold and found.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use flockform::export::OutputFolder;
use flockform::export::stability::{json, write_stability};
use flockform::stability::bisection::Effort;
use flockform::stability::extremes::plan;
use flockform::stability::study::{Options, run};

use super::run::free_folder;
use super::{FAILED, Refusal, SceneArguments, print};

#[derive(Debug, Args)]
pub struct StabilityArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Folder for the results; must be empty or new [default: out/SCENE-stability, numbered if taken]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Fewer and shorter runs: slow bodies may not settle in them
    #[arg(long)]
    quick: bool,
    /// Leave the extremes out
    #[arg(long)]
    no_extremes: bool,
    /// Print stability.json instead of a table
    #[arg(long)]
    json: bool,
    /// Print nothing but errors
    #[arg(long, short, conflicts_with = "json")]
    quiet: bool,
    /// Replace an earlier output of flockform in DIR
    #[arg(long)]
    force: bool,
}

/// Foretells and finds a scene's thresholds, runs its extremes and writes what came of it.
pub fn stability(arguments: &StabilityArguments) -> Result<ExitCode, Refusal> {
    let effort = if arguments.quick { Effort::quick() } else { Effort::default() };
    let options = Options { effort, no_extremes: arguments.no_extremes };
    // Before a folder is made: a misspelt name, a body that cannot be.
    let scene = arguments.scene.load([])?;
    plan(&scene)?;
    let name = scene.name;
    let out = arguments.out.clone().unwrap_or_else(|| free_folder(&format!("{name}-stability")));
    let folder = OutputFolder::create(&out, arguments.force)?;
    let load = |more: &[String]| arguments.scene.load_scene(more);
    let study = run(&load, options, &mut |next| tracing::info!("{next}"))?;
    write_stability(&folder, &study)?;
    let kept = folder.commit()?;
    if arguments.json {
        print(&json(&study).unwrap_or_default());
    } else if !arguments.quiet {
        print(&format!("{study}results in {}\n", kept.display()));
    }
    Ok(if study.holds() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
