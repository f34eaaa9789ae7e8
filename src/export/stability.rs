//! A stability study's outputs: `stability.json`, everything; `growth.csv`, every spectrum and every run; the
//! figure `growth`, growth per step against each parameter with the thresholds.

use std::path::PathBuf;

use serde::Serialize;

use super::OutputFolder;
use super::csv::{row, write};
use super::error::ExportError;
use super::figures::chart::{Axis, Chart, Landmark, Series, Style, draw_below_each_other};
use super::figures::{self, SERIES};
use super::summary::{Signed, write_signed};
use crate::study::stability::bisection::Growth;
use crate::study::stability::study::{Linear, Study, Sweep, Threshold};

/// The file of a stability study, in place of a summary.
const FILE: &str = "stability.json";

#[derive(Serialize)]
struct Report<'a> {
    /// Whether predictions and runs agree and no extreme is wrong.
    holds: bool,
    #[serde(flatten)]
    study: &'a Study,
}

/// Writes everything; without thresholds there is no growth to write.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_stability(folder: &OutputFolder, study: &Study) -> Result<Vec<PathBuf>, ExportError> {
    let mut written = Vec::new();
    if let Some(linear) = &study.linear {
        written.push(write(folder, "growth.csv", rows(linear))?);
        written.extend(figures::write(&figure(study, linear), folder, "growth")?);
    }
    written.push(write_signed(folder, FILE, &Report::of(study))?);
    Ok(written)
}

/// The content of `stability.json`.
pub fn json(study: &Study) -> serde_json::Value {
    serde_json::json!(Signed::new(&Report::of(study)))
}

impl<'a> Report<'a> {
    fn of(study: &'a Study) -> Self {
        Self { holds: study.holds(), study }
    }
}

fn rows(linear: &Linear) -> impl Iterator<Item = impl Serialize> {
    // Of a spectrum, a run or a bisection; the first takes no steps.
    let row =
        |parameter: &'static str, source: &'static str, [value, growth]: [f64; 2], run: Option<&Growth>| {
            let (steps, settled) = (run.map(|run| run.steps), run.map(|run| run.settled));
            row! { parameter, value, source, growth_per_step: growth, steps, settled }
        };
    let run = |parameter, source, run: &Growth| row(parameter, source, [run.value, run.per_step], Some(run));
    let mut rows = Vec::new();
    for sweep in &linear.sweeps {
        let name = sweep.parameter.name();
        let spectrum = sweep.spectrum.iter();
        rows.extend(spectrum.map(|point| row(name, "spectrum", [point.value, point.radius], None)));
        rows.extend(sweep.runs.iter().map(|one| run(name, "run", one)));
    }
    for threshold in &linear.thresholds {
        let runs = threshold.found.iter().flat_map(|found| &found.runs);
        rows.extend(runs.map(|one| run(threshold.parameter.name(), "bisection", one)));
    }
    rows.into_iter()
}

const THRESHOLD: &str = "#a33b2a";

/// A panel for each parameter.
pub fn figure(study: &Study, linear: &Linear) -> String {
    draw_below_each_other(&panels(study, linear))
}

pub(super) fn panels(study: &Study, linear: &Linear) -> Vec<Chart> {
    linear.sweeps.iter().map(|sweep| panel(study, linear, sweep)).collect()
}

fn panel(study: &Study, linear: &Linear, sweep: &Sweep) -> Chart {
    let ends = [sweep.spectrum.first(), sweep.spectrum.last()].map(|end| end.map_or(0.0, |end| end.value));
    let thresholds = || linear.thresholds.iter().filter(|t| t.parameter == sweep.parameter);
    let series = vec![
        Series::new("no growth", "#8a8f98", Style::Line, ends.map(|value| [value, 1.0]).to_vec()),
        Series::new(
            "predicted (spectral radius)",
            SERIES[0],
            Style::Line,
            sweep.spectrum.iter().map(|point| [point.value, point.radius]).collect(),
        ),
        Series::new(
            "runs",
            SERIES[1],
            Style::Dots,
            sweep.runs.iter().map(|run| [run.value, run.per_step]).collect(),
        ),
        Series::new(
            "threshold found by runs",
            THRESHOLD,
            Style::Beads,
            thresholds().filter_map(|t| Some([t.found.as_ref()?.value, 1.0])).collect(),
        ),
    ];
    let title = format!("Growth against the {}", sweep.parameter.name());
    let note = format!(
        "{}; {} followers, the scene's value is {}",
        study.title,
        linear.followers,
        rounded(sweep.present).trim_end_matches('0').trim_end_matches('.')
    );
    let axes = [Axis::new(sweep.parameter.name(), ""), Axis::new("growth per step", "")];
    let landmarks = thresholds().filter_map(landmark).collect();
    Chart { landmarks, ..Chart::new(title, note, axes, series) }
}

fn landmark(threshold: &Threshold) -> Option<Landmark> {
    let predicted = threshold.predicted.as_ref()?.value;
    let runs = match &threshold.found {
        Some(found) => format!("by runs {}", rounded(found.value)),
        None => "no run grows".into(),
    };
    let name = format!("predicted {}\n{runs}", rounded(predicted));
    Some(Landmark { x: predicted, name, colour: THRESHOLD })
}

/// To six decimals, with a minus sign.
fn rounded(value: f64) -> String {
    format!("{value:.6}").replace('-', "\u{2212}")
}
