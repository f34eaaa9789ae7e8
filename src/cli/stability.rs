//! `flockform stability`: when a scene's body grows, predicted and measured.

use std::process::ExitCode;

use clap::Args;
use flockform::export::report;
use flockform::export::stability::{json, write_stability};
use flockform::study::stability::bisection::Effort;
use flockform::study::stability::extremes::plan;
use flockform::study::stability::study::{Options, run};

use super::progress::Progress;
use super::study::StudyArguments;
use super::{Refusal, exit_code};

#[derive(Debug, Args)]
pub struct StabilityArguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Fewer and shorter runs: slow bodies may not settle in them
    #[arg(long)]
    quick: bool,
    /// Leave out the extreme inputs
    #[arg(long)]
    no_extremes: bool,
}

/// Predicts and measures a scene's thresholds, runs its extremes and writes the results.
pub fn stability(arguments: &StabilityArguments) -> Result<ExitCode, Refusal> {
    let effort = if arguments.quick { Effort::quick() } else { Effort::default() };
    let options = Options { effort, no_extremes: arguments.no_extremes };
    // Before a folder is made: a misspelt name, a body that cannot be.
    let scene = arguments.study.scene.load()?;
    plan(&scene)?;
    let name = scene.name;
    let folder = arguments.study.output.folder(&format!("{name}-stability"))?;
    let load = |more: &[String]| arguments.study.scene.load_scene(more);
    let progress = Progress::of_stages(arguments.study.output.quiet);
    let study = run(&load, options, &mut |next| progress.stage(next));
    progress.finish();
    let study = study?;
    write_stability(&folder, &study)?;
    arguments.study.finish(
        folder,
        |folder| report::stability::write(folder, &study),
        || json(&study),
        || study.to_string(),
    )?;
    Ok(exit_code(study.holds()))
}
