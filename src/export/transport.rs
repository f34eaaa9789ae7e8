//! A transport benchmark's outputs: `transport.json` and `transport.csv`, every way and size; the figure `transport`,
//! the median round trip against the size of the message.

use std::path::PathBuf;

use serde::Serialize;

use super::csv::row;
use super::error::ExportError;
use super::figures::SERIES;
use super::figures::chart::{Axis, Chart, Series, Style, draw_below_each_other};
use super::{OutputFolder, write_study};
use crate::bench::transport::Report;
use crate::bench::transport::measure::{Case, Work};

/// Writes everything; times in \[s\].
///
/// # Errors
/// The first file that cannot be written.
pub fn write_transport(folder: &OutputFolder, report: &Report) -> Result<Vec<PathBuf>, ExportError> {
    write_study(folder, "transport", report.cases.iter().map(row), &figure(report), report)
}

fn row(case: &Case) -> impl Serialize {
    let (there, one) = (&case.round_trip, &case.one_way);
    row! {
        transport: case.transport,
        work: case.work.name(),
        poses: case.poses,
        samples: case.samples,
        lost: case.lost,
        round_trip_p50: there.p50_seconds,
        round_trip_p90: there.p90_seconds,
        round_trip_p99: there.p99_seconds,
        round_trip_p999: there.p999_seconds,
        one_way_p50: one.p50_seconds,
        one_way_p90: one.p90_seconds,
        one_way_p99: one.p99_seconds,
        one_way_p999: one.p999_seconds,
        cpu_per_message: case.cpu_seconds_per_message,
    }
}

/// Median round trip against poses, a line for each way, both axes logarithmic; one chart for each kind of work.
pub fn figure(report: &Report) -> String {
    let mut names: Vec<&'static str> = Vec::new();
    report.cases.iter().map(|case| case.transport).for_each(|name| {
        if !names.contains(&name) {
            names.push(name);
        }
    });
    let charts = Work::ALL.map(|work| {
        let series = names.iter().enumerate().map(|(n, &name)| {
            let of = report.cases.iter().filter(|case| case.work == work && case.transport == name);
            let point = |case: &Case| Some([case.poses as f64, 1e6 * case.round_trip.p50_seconds?]);
            let points = of.filter_map(point).collect();
            Series::new(name, SERIES[n % SERIES.len()], Style::Front, points)
        });
        let note = format!("median round trip between two threads; {} bytes a pose", report.bytes_per_pose);
        let axes = [Axis::log("poses", ""), Axis::log("round trip", "us")];
        Chart::new(work.words(), note, axes, series.filter(|series| !series.points.is_empty()).collect())
    });
    draw_below_each_other(&charts)
}
