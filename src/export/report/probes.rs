//! The charts of probed particles.

use super::super::figures::SERIES;
use super::super::figures::chart::{Axis, Chart, Series, Style};
use crate::continuum::record::ProbeSeries;
use crate::flock::body::Body;

/// Probes in one chart: more lines than this cannot be distinguished.
const MOST_LINES: usize = SERIES.len();

/// Displacements and PE1 of the probed particles against the step; a chart in which nothing happens is left
/// out.
pub fn charts(probes: &[ProbeSeries], body: &Body, unit: &str) -> Vec<Chart> {
    let (shown, reference) = (&probes[..probes.len().min(MOST_LINES)], &body.reference);
    let mut note = "probed particles, by id".to_owned();
    if shown.len() < probes.len() {
        note = format!("the first {} of {} {note}", shown.len(), probes.len());
    }
    let squared = format!("{unit}²");
    let displaced = |values: &[f64], initial: f64| values.iter().map(|value| value - initial).collect();
    type Values<'a> = &'a dyn Fn(&ProbeSeries) -> Vec<f64>;
    let quantities: [(&str, &str, Values<'_>); 4] = [
        ("x displacement", unit, &|probe| displaced(&probe.positions.x, reference.x[probe.particle])),
        ("y displacement", unit, &|probe| displaced(&probe.positions.y, reference.y[probe.particle])),
        ("PE1", &squared, &|probe| probe.pe1.clone()),
        ("PE2", unit, &|probe| probe.pe2.clone()),
    ];
    let chart = |(quantity, unit, values): (&str, &str, Values<'_>)| {
        let line = |(probe, colour): (&ProbeSeries, &'static str)| {
            let points = values(probe).into_iter().enumerate().map(|(step, value)| [step as f64, value]);
            Series::new(body.id(probe.particle).to_string(), colour, Style::Line, points.collect())
        };
        let axes = [Axis::new("step", ""), Axis::new(quantity, unit)];
        let series = shown.iter().zip(SERIES).map(line).collect();
        Chart { follows_clock: true, ..Chart::new(quantity, note.clone(), axes, series) }
    };
    let happens = |chart: &Chart| {
        let sizes = chart.series.iter().flat_map(|series| &series.points).map(|point| point[1].abs());
        sizes.fold(0.0, f64::max) > 0.0
    };
    quantities.into_iter().map(chart).filter(happens).collect()
}
