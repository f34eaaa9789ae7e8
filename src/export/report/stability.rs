//! The report of a stability study: growth against each parameter, thresholds from both sides, the extremes.

use std::path::PathBuf;

use super::super::OutputFolder;
use super::super::error::ExportError;
use super::super::stability::panels;
use super::page::{Page, Table, number};
use crate::study::stability::extremes::Case;
use crate::study::stability::study::Study;

/// Writes `report.html`.
///
/// # Errors
/// The file cannot be written.
pub fn write(folder: &OutputFolder, study: &Study) -> Result<PathBuf, ExportError> {
    let holds = study.holds();
    let words = if holds {
        "predictions and runs agree, no extreme is wrong"
    } else {
        "predictions and runs disagree, or an extreme is wrong"
    };
    let page = Page {
        title: study.title.clone(),
        command: format!("flockform stability {}", study.name),
        verdict: Some((holds, words.into())),
        plots: study.linear.iter().flat_map(|linear| panels(study, linear)).collect(),
        facts: facts(study),
        tables: tables(study),
        texts: vec![("The study in words".into(), study.to_string())],
        ..Page::default()
    };
    page.write(folder)
}

fn facts(study: &Study) -> Vec<(&'static str, String)> {
    let mut facts = Vec::new();
    if let Some(linear) = &study.linear {
        facts.push(("Followers", format!("{} of {} particles", linear.followers, linear.particles)));
        facts.push(("Spectral radius of the sweep", format!("{:.9}", linear.radius)));
        if let Some([least, greatest]) = linear.ends {
            facts.push(("Eigenvalues", format!("from {least:.6} to {greatest:.6}")));
        }
    }
    facts.extend(study.refused.iter().map(|why| ("No thresholds", why.clone())));
    facts
}

fn tables(study: &Study) -> Vec<Table> {
    let mut tables = Vec::new();
    if let Some(linear) = &study.linear {
        let exact = |value: f64| format!("{value:.9}");
        let rows = linear.thresholds.iter().map(|threshold| {
            let predicted =
                threshold.predicted.as_ref().map_or(threshold.without_value().into(), |p| exact(p.value));
            let found = threshold.found.as_ref().map_or(threshold.without_value().into(), |f| exact(f.value));
            vec![threshold.name(), predicted, found, number(threshold.tolerance), threshold.verdict()]
        });
        let head = ["parameter", "predicted by the spectrum", "found by runs", "may differ by", ""];
        tables.push(Table::new("Thresholds", &head, rows));
    }
    let row = |case: &Case| {
        let words = case.outcome.to_string();
        let (word, how) = words.split_once(": ").unwrap_or_default();
        vec![case.name.clone(), case.body.clone(), word.into(), how.into()]
    };
    if !study.extremes.is_empty() {
        tables.push(Table::new("Extremes", &["what", "on", "", "how"], study.extremes.iter().map(row)));
    }
    tables
}
