//! `flockform plan`: a scene or a swarm before it runs.

use clap::Args;
use flockform::continuum::memory::{at_least, fallback, readable_bytes};
use flockform::continuum::parts::laid_out_whole_for;
use flockform::continuum::plan::Plan;
use flockform::continuum::report::PlanReport;
use flockform::continuum::shares::{PartShares, Shares};
use flockform::export::figures::{Formats, is_raster};
use flockform::export::memory::Outputs;
use flockform::scene::Scene;
use flockform::study::compare::run::plan as plan_of;
use flockform::swarm::plan::SwarmPlan;
use serde_json::{Value, json};

use super::material::wrong;
use super::memory::{of_part, predicted, require};
use super::names::{FileName, Kind, Overrides, SceneArguments};
use super::swarm::SwarmFileArguments;
use super::{Refusal, print, say};

#[derive(Debug, Args)]
pub struct PlanArguments {
    /// Name of a bundled scene or swarm (see `flockform list`) or path of a file of either kind
    #[arg(value_parser = FileName::ANY, hide_possible_values = true)]
    file: String,
    #[command(flatten)]
    overrides: Overrides,
    /// Also say how so many ranks would share the run of a scene (see the guide to ranks)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    ranks: Option<u16>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Plans a scene or a swarm and prints the plan; a file of neither kind is refused as a scene.
pub fn plan(arguments: &PlanArguments) -> Result<(), Refusal> {
    let PlanArguments { file, overrides: Overrides { set }, ranks, json } = arguments;
    let (words, value) = match Kind::of_either(file)? {
        Kind::Swarm if ranks.is_some() => {
            let message = "ranks share the run of a scene; a swarm is parted by `flockform node --member`";
            return Err(wrong("--ranks", message, "leave it out").into());
        }
        Kind::Swarm => {
            let swarm = SwarmFileArguments::new(file, set).load()?;
            let plan = SwarmPlan::new(&swarm)?;
            (plan.to_string(), json!(plan))
        }
        Kind::Scene => {
            let count = ranks.map_or(1, usize::from);
            let parts = |scene: &Scene| if laid_out_whole_for(scene).is_none() { count } else { 1 };
            let scene = SceneArguments::new(file, set).load_part(parts)?;
            let parts = PartShares::new(&scene, count)?;
            let of_parts = parts.map(|parts| {
                let are_drawn = is_raster(parts.total());
                let figures = if are_drawn { Formats::All } else { Formats::None };
                let outputs = [Outputs { figures, ..Outputs::ALL }, Outputs::TABLES];
                let bytes = outputs.map(|outputs| of_part(&scene, &parts.largest, count, (outputs, true)));
                parts.facts(bytes, are_drawn)
            });
            if let (Some(facts), Err(too_large)) = (&of_parts, require(&scene, at_least(&scene))) {
                // What is said of the whole would take the memory that it takes.
                let facts = facts.iter().map(|(name, value)| json!({ "name": name, "value": value }));
                let value = json!({ "name": scene.name, "title": scene.raw.title, "facts": facts.collect::<Vec<_>>() });
                let words = of_parts.iter().flatten().map(|(name, value)| format!("{name}: {value}\n"));
                let words = format!("{}\n{}", scene.raw.title, words.collect::<String>());
                note!("the whole is not planned here: {too_large}");
                return show(*json, &words, &value);
            }
            let plan = plan_of(&scene)?;
            // Before the report, which takes what a run does not.
            let memory = [Outputs::ALL, Outputs::TABLES].map(|outputs| predicted(&scene, &plan, outputs));
            let mut report = PlanReport::new(&scene, &plan)?;
            let [all, tables] = memory.map(readable_bytes);
            let fallback = fallback(&scene, &plan).map_or_else(String::new, |bytes| {
                let bytes = readable_bytes(bytes);
                format!("; about {bytes} more if multigrid fails and a factorisation decides")
            });
            let is_chosen = scene.equilibrium.is_some_and(|asked| asked.accuracy.is_some());
            let truth = if is_chosen { "; more while the truth for the accuracy is solved for" } else { "" };
            let words = format!("about {all}; {tables} with --figures none --no-report{fallback}{truth}");
            report.facts.push(("memory".into(), words));
            if let Some(ranks) = ranks {
                report.facts.extend(Shares::new(&scene, &plan, usize::from(*ranks))?.facts());
                let whole_for = |key: String| {
                    vec![(
                        "parts".to_owned(),
                        format!("none: each rank lays out the whole body, for `{key}`"),
                    )]
                };
                let whole = || laid_out_whole_for(&scene).map_or_else(Vec::new, whole_for);
                report.facts.extend(of_parts.unwrap_or_else(whole));
            }
            (report.to_string(), scene_json(&scene.name, &plan, &report, memory))
        }
    };
    show(*json, &words, &value)
}

fn show(json: bool, words: &str, value: &Value) -> Result<(), Refusal> {
    if json { print(&format!("{value:#}\n")) } else { say(words) }
}

fn scene_json(name: &str, plan: &Plan, report: &PlanReport, [all, tables]: [usize; 2]) -> Value {
    let pairs = |pairs: &[(String, String)], [left, right]: [&str; 2]| -> Value {
        pairs.iter().map(|(a, b)| json!({ left: a.trim_start(), right: b })).collect()
    };
    json!({
        "name": name,
        "title": report.title,
        "particles": plan.count(),
        "steps": plan.stop.steps,
        "memory_bytes": { "all": all, "tables": tables },
        "facts": pairs(&report.facts, ["name", "value"]),
        "models": pairs(&report.modelled, ["effect", "key"]),
        "leaves_out": pairs(&report.left_out, ["key", "reason"]),
        "cautions": report.cautions,
    })
}
