//! A trade study's outputs: `trade.json` and `trade.csv`, every setting; the figure `trade`, error against
//! time with the settings that no other beats.

use std::path::PathBuf;

use serde::Serialize;

use super::OutputFolder;
use super::csv::write;
use super::error::ExportError;
use super::figures::chart::{Axis, Chart, Landmark, Series, Style, draw};
use super::figures::{self, INK, SERIES};
use super::summary::write_signed;
use crate::solve::equilibrium::Solver;
use crate::study::trade::{Outcome, Point, RuleChoice, Study};

/// The file of a trade study, in place of a summary.
const FILE: &str = "trade.json";

#[derive(Serialize)]
struct Row<'a> {
    rule: &'static str,
    spacing: f64,
    particles: usize,
    solver: &'static str,
    tolerance: f64,
    bits: u32,
    outcome: &'static str,
    error: Option<f64>,
    seconds: Option<f64>,
    iterations: Option<usize>,
    on_the_front: bool,
    reason: &'a str,
}

/// Writes everything.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_trade(folder: &OutputFolder, study: &Study) -> Result<Vec<PathBuf>, ExportError> {
    let front = study.front();
    let rows = study.points.iter().map(|point| row(point, front.contains(&point)));
    let mut written = vec![write(folder, "trade.csv", rows)?];
    written.extend(figures::write(&figure(study), folder, "trade")?);
    written.push(write_signed(folder, FILE, study)?);
    Ok(written)
}

fn row(point: &Point, on_the_front: bool) -> Row<'_> {
    let (outcome, reason) = match &point.outcome {
        Outcome::Settled => ("settled", ""),
        Outcome::Unsettled => ("unsettled", ""),
        Outcome::Refused { reason } => ("refused", reason.as_str()),
    };
    Row {
        rule: point.setting.rule.name(),
        spacing: point.setting.spacing,
        particles: point.particles,
        solver: point.setting.solver,
        tolerance: point.setting.tolerance,
        bits: point.setting.bits,
        outcome,
        error: point.error,
        seconds: point.seconds,
        iterations: point.iterations,
        on_the_front,
        reason,
    }
}

/// Error against time, both logarithmic: a colour for each solver, rings for the paper's rule and dots for
/// the material rule, and the front.
pub fn figure(study: &Study) -> String {
    let front = study.front().into_iter().filter_map(place).collect();
    let mut series = Vec::new();
    for (n, solver) in Solver::ALL.into_iter().enumerate() {
        let of = |rule: RuleChoice| {
            let is_one = |point: &&Point| point.setting.solver == solver.name() && point.setting.rule == rule;
            let settled = study.points.iter().filter(|point| point.outcome == Outcome::Settled);
            settled.filter(is_one).filter_map(place).collect::<Vec<_>>()
        };
        let (colour, [paper, material]) = (SERIES[n], RuleChoice::ALL.map(of));
        // The legend names a solver once, whichever rule it was used with.
        let unnamed = if material.is_empty() { solver.name().to_owned() } else { String::new() };
        series.push(Series { name: unnamed, colour, style: Style::Rings, points: paper });
        series.push(Series { name: solver.name().into(), colour, style: Style::Dots, points: material });
    }
    series.retain(|series| !series.points.is_empty());
    series.push(Series { name: "Pareto-optimal".into(), colour: INK, style: Style::Front, points: front });
    draw(&Chart {
        title: study.title.clone(),
        note: format!(
            "rings: the paper's rule, dots: the material rule; {} settings, median of {} runs each, from the scene to \
             rest; error against finite elements on {} nodes",
            study.points.len(),
            study.repeats,
            study.truth_nodes
        ),
        axes: [
            Axis { quantity: "time", unit: "s", is_log: true },
            Axis { quantity: "relative L2 error of the displacement", unit: "", is_log: true },
        ],
        landmarks: vec![Landmark {
            x: study.truth_seconds,
            name: "the truth itself".into(),
            colour: "#8a8f98",
        }],
        series,
    })
}

fn place(point: &Point) -> Option<[f64; 2]> {
    Some([point.seconds?, point.error?])
}
