//! `flockform stability`: when a scene's body grows, predicted and measured.

use std::process::ExitCode;

use clap::Args;
use flockform::export::report;
use flockform::export::stability::{json, write_stability};
use flockform::stability::bisection::Effort;
use flockform::stability::extremes::plan;
use flockform::stability::study::{Options, run};

use super::output::{OutputArguments, ReportArguments};
use super::progress::Stages;
use super::{FAILED, Refusal, SceneArguments, interrupt, print, say};

#[derive(Debug, Args)]
pub struct StabilityArguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    report: ReportArguments,
    /// Fewer and shorter runs: slow bodies may not settle in them
    #[arg(long)]
    quick: bool,
    /// Leave out the extreme inputs
    #[arg(long)]
    no_extremes: bool,
    /// Print stability.json instead of a table
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

/// Predicts and measures a scene's thresholds, runs its extremes and writes the results.
pub fn stability(arguments: &StabilityArguments) -> Result<ExitCode, Refusal> {
    let effort = if arguments.quick { Effort::quick() } else { Effort::default() };
    let options = Options { effort, no_extremes: arguments.no_extremes };
    // Before a folder is made: a misspelt name, a body that cannot be.
    let scene = arguments.scene.load([])?;
    plan(&scene)?;
    let name = scene.name;
    let folder = arguments.output.folder(&format!("{name}-stability"))?;
    let load = |more: &[String]| arguments.scene.load_scene(more);
    let mut stages = Stages::new(arguments.output.quiet);
    let study = run(&load, options, &mut |next| stages.next(next));
    stages.finish();
    let study = study?;
    write_stability(&folder, &study)?;
    if !arguments.report.no_report {
        report::stability::write(&folder, &study)?;
    }
    let kept = interrupt::commit(folder)?;
    if arguments.json {
        print(&json(&study).unwrap_or_default());
    } else if !arguments.output.quiet {
        say(&format!("{study}results in {}\n", kept.display()));
    }
    Ok(if study.holds() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
