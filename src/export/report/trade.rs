//! The report of a trade study: error against time, every setting by name.

use std::path::PathBuf;

use super::super::OutputFolder;
use super::super::error::ExportError;
use super::super::trade::chart;
use super::page::{Page, Table, number};
use crate::study::trade::{Outcome, Point, Study};

/// Writes `report.html`.
///
/// # Errors
/// The file cannot be written.
pub fn write(folder: &OutputFolder, study: &Study) -> Result<PathBuf, ExportError> {
    let page = Page {
        title: study.title.clone(),
        command: format!("flockform trade {}", study.name),
        plots: vec![chart(study)],
        facts: facts(study),
        tables: tables(study),
        texts: vec![("The study in words".into(), study.to_string())],
        ..Page::default()
    };
    page.write(folder)
}

fn facts(study: &Study) -> Vec<(&'static str, String)> {
    let settled = study.points.iter().filter(|point| point.outcome == Outcome::Settled).count();
    vec![
        ("Settings", format!("{}, {settled} of them came to rest", study.points.len())),
        ("Reference", format!("{} nodes, {} s", study.truth_nodes, number(study.truth_seconds))),
    ]
}

fn tables(study: &Study) -> Vec<Table> {
    let head = [
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
    ];
    let row = |point: &Point| {
        let setting = &point.setting;
        let outcome = match point.outcome.words() {
            (name, "") => name.to_owned(),
            (name, reason) => format!("{name}: {reason}"),
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
    vec![
        Table::new("Pareto-optimal settings", &head, study.front().into_iter().map(row)),
        Table::new("Every setting", &head, study.points.iter().map(row)),
    ]
}
