//! The report of a trade study: error against time, every setting by name.

use std::path::PathBuf;

use super::super::OutputFolder;
use super::super::error::ExportError;
use super::super::figures::SERIES;
use super::page::{Page, Table, number};
use super::plot::{Plot, PlotAxis, PlotLandmark, PlotSeries};
use crate::solve::equilibrium::Solver;
use crate::study::trade::{Outcome, Point, RuleChoice, Study};

/// Writes `report.html`.
///
/// # Errors
/// The file cannot be written.
pub fn write(folder: &OutputFolder, study: &Study) -> Result<PathBuf, ExportError> {
    let page = Page {
        title: study.title.clone(),
        command: format!("flockform trade {}", study.name),
        plots: vec![plot(study)],
        facts: facts(study),
        tables: tables(study),
        texts: vec![("The study in words".into(), study.to_string())],
        ..Page::default()
    };
    page.write(folder)
}

/// As the figure `trade`, with the setting of each point.
fn plot(study: &Study) -> Plot {
    let settled = || study.points.iter().filter(|point| point.outcome == Outcome::Settled);
    let mut series = Vec::new();
    for (solver, colour) in Solver::ALL.into_iter().zip(SERIES) {
        for (rule, style) in [(RuleChoice::Paper, "rings"), (RuleChoice::Material, "dots")] {
            let of = settled().filter(|p| p.setting.solver == solver.name() && p.setting.rule == rule);
            let name = format!("{}, {} rule", solver.name(), rule.name());
            series.push(points(name, colour, style, of));
        }
    }
    series.retain(|series| !series.points.is_empty());
    let front = "Pareto-optimal".to_owned();
    series.push(points(front, "ink", "front", study.front().into_iter()));
    let axis =
        |quantity: &str, unit: &str| PlotAxis { quantity: quantity.into(), unit: unit.into(), log: true };
    Plot {
        title: "What accuracy costs".into(),
        note: format!(
            "{} settings, median of {} runs each, from the scene to rest; error against finite elements on {} nodes",
            study.points.len(),
            study.repeats,
            study.truth_nodes
        ),
        x: axis("time", "s"),
        y: axis("relative L2 error of the displacement", ""),
        series,
        landmarks: vec![PlotLandmark { x: study.truth_seconds, name: "the truth itself".into() }],
        follows_clock: false,
    }
}

fn points<'a>(
    name: String,
    colour: &str,
    style: &'static str,
    of: impl Iterator<Item = &'a Point>,
) -> PlotSeries {
    let placed = of.filter_map(|point| Some(([point.seconds?, point.error?], label(point))));
    let (points, labels) = placed.unzip();
    PlotSeries { name, colour: colour.into(), style, points, labels }
}

fn label(point: &Point) -> String {
    let (error, seconds) = (point.error.unwrap_or(f64::NAN), point.seconds.unwrap_or(f64::NAN));
    let iterations = point.iterations.map_or_else(String::new, |count| format!(", {count} iterations"));
    format!(
        "{}\n{} particles{iterations}\nerror {:.3} %, {:.3} ms",
        point.setting,
        point.particles,
        100.0 * error,
        1e3 * seconds
    )
}

fn facts(study: &Study) -> Vec<(String, String)> {
    let settled = study.points.iter().filter(|point| point.outcome == Outcome::Settled).count();
    vec![
        ("Settings".into(), format!("{}, {settled} of them came to rest", study.points.len())),
        ("Reference".into(), format!("{} nodes, {} s", study.truth_nodes, number(study.truth_seconds))),
    ]
}

fn tables(study: &Study) -> Vec<Table> {
    let head = || {
        [
            "rule",
            "spacing",
            "particles",
            "solver",
            "tolerance",
            "bits",
            "error",
            "time",
            "iterations",
            "outcome",
        ]
    };
    let row = |point: &Point| {
        let setting = &point.setting;
        let outcome = match &point.outcome {
            Outcome::Settled => "settled".to_owned(),
            Outcome::Unsettled => "unsettled".to_owned(),
            Outcome::Refused { reason } => format!("refused: {reason}"),
        };
        vec![
            setting.rule.name().into(),
            number(setting.spacing),
            point.particles.to_string(),
            setting.solver.into(),
            number(setting.tolerance),
            setting.bits.to_string(),
            point.error.map_or_else(String::new, |error| format!("{} %", number(100.0 * error))),
            point.seconds.map_or_else(String::new, |seconds| format!("{} ms", number(1e3 * seconds))),
            point.iterations.map_or_else(String::new, |count| count.to_string()),
            outcome,
        ]
    };
    let table = |caption: &str, rows: Vec<Vec<String>>| Table {
        caption: caption.into(),
        head: head().map(String::from).to_vec(),
        rows,
    };
    vec![
        table("Pareto-optimal settings", study.front().into_iter().map(row).collect()),
        table("Every setting", study.points.iter().map(row).collect()),
    ]
}
