//! `flockform compare`: rule and truth of a scene, how far apart they are.

use std::ops::ControlFlow;
use std::process::ExitCode;

use clap::Args;
use flockform::continuum::run::StopReason;
use flockform::export::comparison::{ComparisonReport, write_comparison};
use flockform::export::{Signed, report};
use flockform::fem::Effort;
use flockform::flock::rules::Rotation;
use flockform::scene::Scene;
use flockform::scene::text::counted;
use flockform::study::compare::run::{Compared, compare as compare_scene};
use flockform::study::trade::{Chosen, choose};

use super::progress::Progress;
use super::study::StudyArguments;
use super::{Refusal, exit_code};

#[derive(Debug, Args)]
pub struct CompareArguments {
    #[command(flatten)]
    study: StudyArguments,
    /// Largest relative error of displacement that the finite elements may state of themselves
    #[arg(long, value_name = "E", default_value_t = Effort::default().target, value_parser = part_of_one)]
    truth_error: f64,
}

fn part_of_one(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err("give a number more than 0 and less than 1".into()),
    }
}

/// Compares a scene's rule with its truth, prints the measures and writes what comes of it.
pub fn compare(arguments: &CompareArguments) -> Result<ExitCode, Refusal> {
    let open = &arguments.study.scene;
    let Chosen { scene, words: chosen, .. } = choose(open.load()?, &|more: &[String]| open.load_scene(more))?;
    let folder = arguments.study.output.folder(&format!("{}-compare", scene.name))?;
    let effort = Effort { target: arguments.truth_error, ..Effort::default() };
    let progress = Progress::of_steps(arguments.study.output.quiet, scene.stop.steps);
    let compared = compare_scene(&scene, &effort, &mut |engine, residual| {
        progress.step(engine.step(), residual);
        ControlFlow::Continue(())
    })?;
    progress.finish();

    let report = ComparisonReport::new(&scene, &compared);
    write_comparison(&folder, &scene, &compared, &report)?;
    arguments.study.finish(
        folder,
        |folder| report::comparison::write(folder, &scene, &compared, &report),
        || serde_json::json!(Signed::new(&report)),
        || chosen + &words(&scene, &compared),
    )?;
    Ok(exit_code(compared.outcome.reason.is_good()))
}

/// How the rule's run ended, and the table.
fn words(scene: &Scene, compared: &Compared) -> String {
    let outcome = &compared.outcome;
    let end = &outcome.reason;
    let more = match end {
        StopReason::Equilibrium => String::new(),
        StopReason::Unsettled | StopReason::Steps => format!(", residual {:.2e}", outcome.residual),
        StopReason::Stuck(_) => "; the last equilibrium is compared".to_owned(),
        StopReason::Interrupted => ": compared as far as it came".to_owned(),
        StopReason::Diverged(_) => "; the last good state is compared".to_owned(),
    };
    let way = match &outcome.solved {
        Some(solved) => format!("{}, {}", solved.solver, counted(solved.iterations, "iteration")),
        None => counted(outcome.engine.step(), "step"),
    };
    let nodes = compared.reference.solution.nodes();
    let mut words = format!(
        "{}: the rule by {way}, {end}{more}; truth of the shape on {nodes} nodes\n{}",
        scene.name, compared.comparison
    );
    if scene.rotation() == Rotation::Corotated {
        words += "rule and truth follow the body's turns: strain is its stretch, stress is in axes that turn with it\n";
    }
    for place in &compared.places {
        words += &place.to_string();
    }
    words + &compared.cautions.iter().map(|caution| format!("caution: {caution}\n")).collect::<String>()
}
