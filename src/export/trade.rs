//! A trade study's outputs: `trade.json` and `trade.csv`, every setting; the figure `trade`, error against
//! time with the settings that no other beats.

use std::path::PathBuf;

use serde::Serialize;

use super::csv::row;
use super::error::ExportError;
use super::figures::chart::{Axis, Chart, Landmark, Series, Style, draw};
use super::figures::{INK, SERIES};
use super::{OutputFolder, write_study};
use crate::scene::text::counted;
use crate::solve::equilibrium::Solver;
use crate::study::trade::{Outcome, Point, RuleChoice, Study};

/// Writes everything.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_trade(folder: &OutputFolder, study: &Study) -> Result<Vec<PathBuf>, ExportError> {
    let front = study.front();
    let rows = study.points.iter().map(|point| row(point, front.contains(&point)));
    write_study(folder, "trade", rows, &figure(study), study)
}

fn row(point: &Point, on_the_front: bool) -> impl Serialize {
    let (outcome, reason) = point.outcome.words();
    row! {
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
/// the material rule, and the front; each point by its setting.
pub(super) fn chart(study: &Study) -> Chart {
    let settled = || study.points.iter().filter(|point| point.outcome == Outcome::Settled);
    let mut all = Vec::new();
    for (solver, colour) in Solver::ALL.into_iter().zip(SERIES) {
        for (rule, style) in [(RuleChoice::Paper, Style::Rings), (RuleChoice::Material, Style::Dots)] {
            let of = settled().filter(|p| p.setting.solver == solver.name() && p.setting.rule == rule);
            all.push(series(format!("{}, {} rule", solver.name(), rule.name()), colour, style, of));
        }
    }
    all.retain(|series| !series.points.is_empty());
    all.push(series("Pareto-optimal".into(), "ink", Style::Front, study.front().into_iter()));
    let note = format!(
        "{} settings, median of {} each, from the scene to rest; error against finite elements on {} nodes",
        study.points.len(),
        counted(study.repeats, "run"),
        study.truth_nodes
    );
    let axes = [Axis::log("time", "s"), Axis::log("relative L2 error of the displacement", "")];
    let truth =
        Landmark { x: study.truth_seconds, name: "the finite elements themselves".into(), colour: "#8a8f98" };
    Chart { landmarks: vec![truth], ..Chart::new("What accuracy costs", note, axes, all) }
}

fn series<'a>(
    name: String,
    colour: &'static str,
    style: Style,
    of: impl Iterator<Item = &'a Point>,
) -> Series {
    let placed = of.filter_map(|point| Some(([point.seconds?, point.error?], label(point))));
    let (points, labels) = placed.unzip();
    Series { labels, ..Series::new(name, colour, style, points) }
}

fn label(point: &Point) -> String {
    let (error, seconds) = (point.error.unwrap_or(f64::NAN), point.seconds.unwrap_or(f64::NAN));
    let iterations =
        point.iterations.map_or_else(String::new, |count| format!(", {}", counted(count, "iteration")));
    format!(
        "{}\n{} particles{iterations}\nerror {:.3} %, {:.3} ms",
        point.setting,
        point.particles,
        100.0 * error,
        1e3 * seconds
    )
}

/// The same as a figure, whose legend names a solver once, whichever rule it was used with.
pub fn figure(study: &Study) -> String {
    let mut chart = chart(study);
    chart.title.clone_from(&study.title);
    chart.note = format!("rings: the paper's rule, dots: the material rule; {}", chart.note);
    let mut last = "";
    for series in chart.series.iter_mut().rev() {
        let solver = Solver::ALL
            .into_iter()
            .map(Solver::name)
            .find(|name| series.name.starts_with(&format!("{name}, ")));
        series.name = match solver {
            None => continue,
            Some(solver) if solver == last => String::new(),
            Some(solver) => solver.to_owned(),
        };
        last = solver.unwrap_or_default();
    }
    chart.series.iter_mut().filter(|series| series.colour == "ink").for_each(|series| series.colour = INK);
    draw(&chart)
}
