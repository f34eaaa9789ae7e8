//! The outputs of a benchmark of ranks: `scale.json` with everything, `scale.csv` with what was measured, and the figure
//! `scale`, efficiency against ranks, measured and predicted.

use std::path::PathBuf;

use serde::Serialize;

use super::csv::row;
use super::error::ExportError;
use super::figures::SERIES;
use super::figures::chart::{Axis, Chart, Series, Style, draw_below_each_other};
use super::{OutputFolder, write_study};
use crate::bench::scale::large::AtRest;
use crate::bench::scale::model::Link;
use crate::bench::scale::{Case, Predicted, Report};

/// Writes everything; times in \[s\].
///
/// # Errors
/// The first file that cannot be written.
pub fn write_scale(folder: &OutputFolder, report: &Report) -> Result<Vec<PathBuf>, ExportError> {
    let cases = [("strong", &report.strong), ("weak", &report.weak)];
    let rows =
        cases.into_iter().flat_map(|(scaling, cases)| cases.iter().map(move |case| row(scaling, case)));
    write_study(folder, "scale", rows, &figure(report), report)
}

fn row(scaling: &'static str, case: &Case) -> impl Serialize {
    row! {
        scaling,
        ranks: case.ranks,
        columns: case.body[0],
        rows: case.body[1],
        seconds_per_step: case.seconds_per_step,
        alone_seconds_per_step: case.alone_seconds_per_step,
        efficiency: case.efficiency,
        share_in_exchange: case.share_in_exchange,
        predicted_seconds_per_step: case.predicted_seconds_per_step,
    }
}

/// Efficiency against ranks: one chart for the same body, and one for as much of a body each.
pub fn figure(report: &Report) -> String {
    let [[columns, rows], [each, high]] = [report.predicted_body, report.predicted_part];
    let strong = chart(
        report,
        ("The same body on more ranks", format!("predicted: {columns} x {rows} particles")),
        (&report.strong, [|one| one.strong_efficiency, |one| one.strong_efficiency_on_network]),
    );
    let weak = chart(
        report,
        ("As much of a body for each rank", format!("predicted: {each} x {high} particles each")),
        (&report.weak, [|one| one.weak_efficiency, |one| one.weak_efficiency_on_network]),
    );
    let beads = |name: &str, colour: usize, of: fn(&AtRest) -> f64| {
        let points = report.at_rest.iter().map(|one| [one.ranks as f64, of(one)]).collect();
        Series::new(name, SERIES[colour], Style::Beads, points)
    };
    let at_rest = Chart::new(
        "An equilibrium by multigrid on more ranks",
        format!("measured here, ranks are {}", report.ranks_are),
        [Axis::log("ranks", ""), Axis::new("times as fast as one rank", "")],
        vec![
            beads("measured", 0, |one| one.speed_up),
            beads("as many times as there are ranks", 1, |one| one.ranks as f64),
        ],
    );
    draw_below_each_other(&[strong, weak, at_rest])
}

type Efficiency = fn(&Predicted) -> f64;

fn chart(
    report: &Report,
    (title, body): (&str, String),
    (cases, predicted): (&[Case], [Efficiency; 2]),
) -> Chart {
    let measured = cases.iter().map(|case| [case.ranks as f64, case.efficiency]).collect();
    let Link { latency_seconds, bytes_per_second } = Link::NETWORK;
    let network = format!(
        "predicted, a network assumed to take {:.0} us a message and carry {:.0} GB/s",
        1e6 * latency_seconds,
        1e-9 * bytes_per_second
    );
    let line = |name: String, n: usize, of: Efficiency| {
        let points = report.predicted.iter().map(|one| [one.ranks as f64, of(one)]).collect();
        Series::new(name, SERIES[n], Style::Line, points)
    };
    let what = format!("measured here, ranks are {}", report.ranks_are);
    Chart::new(
        title,
        format!("{}; {body}", report.processor.as_deref().unwrap_or("a processor without name")),
        [Axis::log("ranks", ""), Axis::new("efficiency", "")],
        vec![
            line("predicted, messages as measured here".into(), 1, predicted[0]),
            line(network, 2, predicted[1]),
            Series::new(what, SERIES[0], Style::Beads, measured),
        ],
    )
}
