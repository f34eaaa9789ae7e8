//! Displacements and pseudo-energies of a few particles against the step.

use super::Subject;
use super::chart::{Axis, Chart, Series, Style, draw_panels};
use super::colour::SERIES;
use crate::continuum::record::ProbeSeries;
use crate::flock::body::Body;

/// Probes in one chart: more lines than this cannot be distinguished.
const MOST_LINES: usize = SERIES.len();

/// The charts of probed particles on one sheet.
pub fn probes(subject: &Subject<'_>, probes: &[ProbeSeries]) -> String {
    draw_panels(subject.title, &charts(probes, subject.body, [subject.unit, subject.counts]))
}

/// Displacements and pseudo-energies of the probed particles against what the run `counts`; a chart in which nothing happens is left
/// out, unless nothing happens in any.
pub fn charts(probes: &[ProbeSeries], body: &Body, [unit, counts]: [&str; 2]) -> Vec<Chart> {
    if probes.is_empty() {
        return Vec::new();
    }
    let shown = &probes[..probes.len().min(MOST_LINES)];
    let mut note = "probed particles, by id".to_owned();
    if shown.len() < probes.len() {
        note = format!("the first {} of {} {note}", shown.len(), probes.len());
    }
    let squared = format!("{unit}²");
    // A history begins before the body has moved.
    let displaced = |values: &[f64]| values.iter().map(|value| value - values[0]).collect();
    type Values<'a> = &'a dyn Fn(&ProbeSeries) -> Vec<f64>;
    let quantities: [(&str, &str, Values<'_>); 4] = [
        ("x displacement", unit, &|probe| displaced(&probe.positions.x)),
        ("y displacement", unit, &|probe| displaced(&probe.positions.y)),
        ("PE1", &squared, &|probe| probe.pe1.clone()),
        ("PE2", unit, &|probe| probe.pe2.clone()),
    ];
    let chart = |(quantity, unit, values): (&str, &str, Values<'_>)| {
        let line = |(probe, colour): (&ProbeSeries, &'static str)| {
            let points = values(probe).into_iter().enumerate().map(|(step, value)| [step as f64, value]);
            Series::new(body.id_of(probe.particle).to_string(), colour, Style::Line, points.collect())
        };
        let axes = [Axis::new(counts, ""), Axis::new(quantity, unit)];
        let series = shown.iter().zip(SERIES).map(line).collect();
        Chart { follows_clock: true, ..Chart::new(quantity, note.clone(), axes, series) }
    };
    let happens = |chart: &Chart| {
        // Less is rounding.
        let length = 1e-10 * body.lattice.spacing();
        let least = if chart.y.unit == squared { length * length } else { length };
        chart.series.iter().flat_map(|series| &series.points).any(|point| point[1].abs() > least)
    };
    let (happening, still): (Vec<_>, Vec<_>) = quantities.into_iter().map(chart).partition(happens);
    if happening.is_empty() { still } else { happening }
}
