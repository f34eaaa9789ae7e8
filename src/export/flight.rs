//! A flight's outputs: `flight.json`, how it went; `samples.csv`, every period; `robots.csv`, every robot at the
//! end; `tracks.csv`, every robot at the recorded periods; the figures `flight` (the ways on a map) and
//! `errors` (shape and clearance against time).

use std::path::PathBuf;

use serde::Serialize;

use super::OutputFolder;
use super::csv::{row, write};
use super::error::ExportError;
use super::figures::chart::{Axis, Chart, Series, Style, draw_below_each_other};
use super::figures::{self, SERIES, flight_map};
use super::summary::write_signed;
use crate::scene::swarm::Swarm;
use crate::swarm::flight::{FlightReport, Record, Sample, Verdict};

/// The file of a flight, in place of a summary.
const FILE: &str = "flight.json";

#[derive(Serialize)]
struct Report<'a> {
    /// Whether every declared bound held.
    holds: bool,
    #[serde(flatten)]
    report: &'a FlightReport,
    swarm: &'a crate::scene::swarm::raw::RawSwarm,
}

/// Writes everything.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_flight(
    folder: &OutputFolder,
    swarm: &Swarm,
    record: &Record,
    report: &FlightReport,
) -> Result<Vec<PathBuf>, ExportError> {
    let mut written = write_flight_tables(folder, swarm, record, report)?;
    written.extend(figures::write(&flight_map::flight(swarm, record, report), folder, "flight")?);
    let errors = draw_below_each_other(&charts(record, report));
    written.extend(figures::write(&errors, folder, "errors")?);
    Ok(written)
}

/// Writes everything but the figures.
///
/// # Errors
/// The first file that cannot be written.
pub fn write_flight_tables(
    folder: &OutputFolder,
    swarm: &Swarm,
    record: &Record,
    report: &FlightReport,
) -> Result<Vec<PathBuf>, ExportError> {
    let tracks = record.times.iter().zip(&record.tracks).flat_map(|(&time, places)| {
        let named = report.per_robot.iter().zip(places.iter());
        named.map(move |(robot, [x, y])| row! { time, name: &robot.name, x, y })
    });
    let whole = Report { holds: report.holds(), report, swarm: &swarm.raw };
    Ok(vec![
        write(folder, "samples.csv", record.samples.iter())?,
        write(folder, "robots.csv", report.per_robot.iter())?,
        write(folder, "tracks.csv", tracks)?,
        write_signed(folder, FILE, &whole)?,
    ])
}

/// Of the lines of declared bounds.
const BOUND: &str = "#444444";

/// Shape and clearance against time, with what is declared of them.
pub(super) fn charts(record: &Record, report: &FlightReport) -> Vec<Chart> {
    let series = |name: &str, colour, of: &dyn Fn(&Sample) -> Option<f64>| {
        let points = record.samples.iter().map(|s| [s.time, of(s).unwrap_or(f64::NAN)]).collect();
        Series::new(name, colour, Style::Line, points)
    };
    let time = || Axis::new("time", "s");
    let shape = [
        series("from the leaders' affine motion", SERIES[0], &|s| s.affine_error),
        series("from where the rule comes to rest", SERIES[1], &|s| s.formation_error),
        series("from the continuum run", SERIES[2], &|s| s.continuum_error),
    ];
    let clearance = series("", SERIES[4], &|s| s.clearance.is_finite().then_some(s.clearance));
    let end = record.samples.last().map_or(0.0, |sample| sample.time);
    let declared = |bounds: &[&str]| -> Vec<Series> {
        let those = report.bounds.iter().filter(|verdict| bounds.contains(&verdict.bound));
        let line = |verdict: &Verdict| {
            let name = format!("declared {}", verdict.bound.replace('_', " "));
            Series::new(name, BOUND, Style::Line, vec![[0.0, verdict.declared], [end, verdict.declared]])
        };
        those.map(line).collect()
    };
    let errors = match report.faulty.is_empty() {
        true => "largest distance of a robot from its place",
        false => "largest distance of a robot without a fault from its place",
    };
    let mut charts = Vec::new();
    // An ideal flight has errors of rounding, which no axis in metres would show.
    let visible = |s: &Series| s.points.iter().any(|point| point[1] > 0.0);
    if shape.iter().any(visible) {
        let bounds = declared(&["affine_error", "final_error", "continuum_error"]);
        charts.push(Chart::new(
            &report.title,
            errors,
            [time(), Axis::log("distance", "m")],
            shape.iter().cloned().chain(bounds).filter(visible).collect(),
        ));
    }
    let is_known = |s: &Series| s.points.iter().any(|point| point[1].is_finite());
    if is_known(&clearance) {
        charts.push(Chart::new(
            "Smallest free space",
            "between two robots' rims, or a rim and an obstacle",
            [time(), Axis::new("clearance", "m")],
            [vec![clearance], declared(&["clearance"])].concat(),
        ));
    }
    if charts.is_empty() {
        // A robot alone, which is where it should be.
        charts.push(Chart::new(
            &report.title,
            errors,
            [time(), Axis::new("distance", "m")],
            shape.into_iter().filter(is_known).collect(),
        ));
    }
    charts
}
