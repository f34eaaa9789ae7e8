//! Charts as data: the page draws them.

use serde::Serialize;

use super::super::figures::SERIES;
use super::super::figures::chart::{Axis, Chart, Series, Style};
use crate::continuum::record::ProbeSeries;
use crate::flock::body::Body;

/// Points of a line that a page can show; a longer one keeps the extremes of each stretch.
const MOST_POINTS: usize = 1500;
/// Probes in one chart: more lines than this cannot be distinguished.
const MOST_LINES: usize = SERIES.len();

#[derive(Clone, Debug, Serialize)]
pub struct Plot {
    pub title: String,
    pub note: String,
    pub x: PlotAxis,
    pub y: PlotAxis,
    pub series: Vec<PlotSeries>,
    pub landmarks: Vec<PlotLandmark>,
    /// Whether the horizontal axis is the clock of the page's animation.
    pub follows_clock: bool,
}

#[derive(Clone, Debug, Serialize)]
pub struct PlotAxis {
    pub quantity: String,
    pub unit: String,
    pub log: bool,
}

#[derive(Clone, Debug, Serialize)]
pub struct PlotSeries {
    pub name: String,
    pub colour: String,
    /// `line`, `dots`, `rings`, `front` or `beads`.
    pub style: &'static str,
    pub points: Vec<[f64; 2]>,
    /// A label of each point; empty where its coordinates suffice.
    pub labels: Vec<String>,
}

#[derive(Clone, Debug, Serialize)]
pub struct PlotLandmark {
    pub x: f64,
    pub name: String,
}

impl PlotAxis {
    pub fn of(axis: Axis<'_>) -> Self {
        Self { quantity: axis.quantity.into(), unit: axis.unit.into(), log: axis.is_log }
    }
}

impl PlotSeries {
    pub fn of(series: &Series) -> Self {
        let style = match series.style {
            Style::Line => "line",
            Style::Dots => "dots",
            Style::Rings => "rings",
            Style::Front => "front",
            Style::Beads => "beads",
        };
        let (name, colour) = (series.name.clone(), series.colour.into());
        let points = if style == "line" { thinned(&series.points) } else { series.points.clone() };
        Self { name, colour, style, points, labels: Vec::new() }
    }
}

impl Plot {
    /// The same chart as the figure's.
    pub fn of(chart: &Chart<'_>, follows_clock: bool) -> Self {
        let landmark = |mark: &super::super::figures::chart::Landmark| PlotLandmark {
            x: mark.x,
            name: mark.name.replace('\n', ", "),
        };
        Self {
            title: chart.title.clone(),
            note: chart.note.clone(),
            x: PlotAxis::of(chart.axes[0]),
            y: PlotAxis::of(chart.axes[1]),
            series: chart.series.iter().map(PlotSeries::of).collect(),
            landmarks: chart.landmarks.iter().map(landmark).collect(),
            follows_clock,
        }
    }
}

/// Displacements and PE1 of the probed particles against the step; a chart in which nothing happens is left
/// out.
pub fn of_probes(probes: &[ProbeSeries], body: &Body, unit: &str) -> Vec<Plot> {
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
    let plot = |(quantity, unit, values): (&str, &str, Values<'_>)| Plot {
        title: quantity.into(),
        note: note.clone(),
        x: PlotAxis { quantity: "step".into(), unit: String::new(), log: false },
        y: PlotAxis { quantity: quantity.into(), unit: unit.into(), log: false },
        series: (shown.iter().zip(SERIES))
            .map(|(probe, colour)| probe_line(body.id(probe.particle), colour, &values(probe)))
            .collect(),
        landmarks: Vec::new(),
        follows_clock: true,
    };
    let happens = |plot: &Plot| {
        let sizes = plot.series.iter().flat_map(|series| &series.points).map(|point| point[1].abs());
        sizes.fold(0.0, f64::max) > 0.0
    };
    quantities.into_iter().map(plot).filter(happens).collect()
}

fn probe_line(id: usize, colour: &str, values: &[f64]) -> PlotSeries {
    let line: Vec<[f64; 2]> = values.iter().enumerate().map(|(step, &value)| [step as f64, value]).collect();
    let (name, points) = (id.to_string(), thinned(&line));
    PlotSeries { name, colour: colour.into(), style: "line", points, labels: Vec::new() }
}

/// Of a long line, the ends and extremes of each stretch.
fn thinned(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let finite: Vec<[f64; 2]> = line.iter().copied().filter(|point| point[1].is_finite()).collect();
    if finite.len() <= MOST_POINTS {
        return finite;
    }
    let mut kept = vec![finite[0]];
    for run in finite.chunks(finite.len().div_ceil(MOST_POINTS / 2)) {
        let by_height = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let mut extremes: Vec<[f64; 2]> = [run.iter().min_by(by_height), run.iter().max_by(by_height)]
            .into_iter()
            .flatten()
            .copied()
            .collect();
        extremes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        kept.extend(extremes);
    }
    kept.extend(finite.last());
    kept.dedup();
    kept
}

/// A chart for tests of the page.
#[cfg(test)]
pub(super) fn tests_plot() -> Plot {
    let axis = || PlotAxis { quantity: "x".into(), unit: String::new(), log: false };
    Plot {
        title: String::new(),
        note: String::new(),
        x: axis(),
        y: axis(),
        series: Vec::new(),
        landmarks: Vec::new(),
        follows_clock: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_line_keeps_its_ends_and_its_peaks() {
        let mut line: Vec<[f64; 2]> = (0..100_000).map(|n| [f64::from(n), 0.0]).collect();
        line[54_321][1] = -3.0;
        let kept = thinned(&line);
        assert!(kept.len() <= MOST_POINTS + 2, "{}", kept.len());
        assert!(kept.contains(&[54_321.0, -3.0]));
        assert_eq!([kept[0][0], kept[kept.len() - 1][0]], [0.0, 99_999.0]);
    }
}
