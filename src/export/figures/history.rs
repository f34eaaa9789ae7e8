//! Displacement and PE1 of a few particles against the step.

use super::Subject;
use super::axes::{Axes, Measure};
use super::colour::SERIES;
use super::heading::Heading;
use super::page;
use super::svg::{Anchor, Path, Svg, text_width};
use crate::continuum::record::ProbeSeries;

const PANEL_HEIGHT: f64 = 190.0;
const PANEL_GAP: f64 = 16.0;
const LABEL_TEXT: f64 = 12.0;
const LABELS_APART: f64 = 14.0;
/// As many labels as stand below each other beside a panel.
const MOST_LINES: usize = SERIES.len();

/// One panel: a quantity of every probe.
struct Panel {
    quantity: &'static str,
    unit: String,
    /// By probe and step.
    values: Vec<Vec<f64>>,
    /// A range below this is rounding, and the panel then spans `span`.
    noise: f64,
    span: f64,
}

/// Displacement along x and y and PE1 of the probed particles, labelled with their ids.
pub fn probes(subject: &Subject<'_>, probes: &[ProbeSeries]) -> String {
    let shown = &probes[..probes.len().min(MOST_LINES)];
    let note = if shown.len() < probes.len() {
        format!("the first {} of {} probed particles, by id", shown.len(), probes.len())
    } else {
        "probed particles, by id".into()
    };
    let heading = Heading { title: subject.title.into(), note, ..Heading::default() };
    let ids: Vec<String> = shown.iter().map(|probe| subject.body.id(probe.particle).to_string()).collect();
    let panels = panels(subject, shown);
    let last = shown.iter().map(|probe| probe.positions.len()).max().unwrap_or(0).saturating_sub(1);
    let right = 14.0 + ids.iter().map(|id| text_width(id, LABEL_TEXT)).fold(0.0, f64::max) + 6.0;
    let mut plots: Vec<Axes> = panels.iter().map(|panel| window(panel, last)).collect();
    let left = plots.iter().map(Axes::left_of_plot).fold(0.0, f64::max);
    let top = heading.height(page::WIDTH);
    for (n, axes) in plots.iter_mut().enumerate() {
        axes.corner = [left, top + n as f64 * (PANEL_HEIGHT + PANEL_GAP)];
        axes.size[0] = page::WIDTH - left - right;
    }
    let height = top + panels.len() as f64 * (PANEL_HEIGHT + PANEL_GAP) - PANEL_GAP + Axes::BELOW;
    let mut svg = Svg::new(page::WIDTH, height);
    heading.draw(&mut svg, page::WIDTH);
    for (panel, axes) in panels.iter().zip(&plots) {
        draw_panel(&mut svg, axes, panel, &ids);
    }
    if let Some(lowest) = plots.last() {
        lowest.draw_horizontal(&mut svg, Measure { quantity: "step", unit: "" });
    }
    svg.finish()
}

/// A panel in which nothing happens is left out, unless nothing happens in any.
fn panels(subject: &Subject<'_>, shown: &[ProbeSeries]) -> Vec<Panel> {
    let (unit, spacing) = (subject.unit, subject.body.lattice.spacing());
    let reference = &subject.body.reference;
    let moved = |now: &[f64], initial: f64| now.iter().map(|value| value - initial).collect();
    let noise = 1e-10 * spacing;
    let displacement = |quantity, values| Panel { quantity, unit: unit.into(), values, noise, span: spacing };
    let mut panels = vec![
        displacement(
            "x displacement",
            shown.iter().map(|p| moved(&p.positions.x, reference.x[p.particle])).collect(),
        ),
        displacement(
            "y displacement",
            shown.iter().map(|p| moved(&p.positions.y, reference.y[p.particle])).collect(),
        ),
        Panel {
            quantity: "PE1",
            unit: format!("{unit}²"),
            values: shown.iter().map(|p| p.pe1.clone()).collect(),
            noise: noise * noise,
            span: spacing * spacing,
        },
    ];
    let happens = |panel: &Panel| panel.values.iter().flatten().any(|value| value.abs() > panel.noise);
    if panels.iter().any(happens) {
        panels.retain(happens);
    }
    panels
}

/// The axes of a panel, whose place on the sheet is still to be given.
fn window(panel: &Panel, last_step: usize) -> Axes {
    let finite = panel.values.iter().flatten().copied().filter(|value| value.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let (low, high) = if high - low > panel.noise {
        let margin = 0.06 * (high - low);
        (low - margin, high + margin)
    } else {
        let middle = if low.is_finite() { low } else { 0.0 };
        (middle - panel.span / 2.0, middle + panel.span / 2.0)
    };
    Axes {
        corner: [0.0; 2],
        size: [page::WIDTH, PANEL_HEIGHT],
        low: [0.0, low],
        high: [last_step.max(1) as f64, high],
    }
}

fn draw_panel(svg: &mut Svg, axes: &Axes, panel: &Panel, ids: &[String]) {
    axes.draw_vertical(svg, Measure { quantity: panel.quantity, unit: &panel.unit }, axes.corner[0]);
    let mut ends = Vec::new();
    for (n, values) in panel.values.iter().enumerate() {
        let finite = values.iter().enumerate().filter(|(_, value)| value.is_finite());
        let line: Vec<[f64; 2]> = finite.map(|(step, &value)| axes.place([step as f64, value])).collect();
        let mut path = Path::default();
        path.polyline(page::thinned(&line));
        let stroke = format!("stroke=\"{}\" stroke-width=\"1.6\" stroke-linejoin=\"round\"", SERIES[n]);
        svg.path(&path, format_args!("class=\"probe\" fill=\"none\" {stroke}"));
        ends.extend(line.last().map(|&[_, y]| (n, y)));
    }
    axes.draw_frame(svg);
    let right = axes.corner[0] + axes.size[0];
    let [top, bottom] = [axes.corner[1], axes.corner[1] + axes.size[1]].map(|y| y.round());
    for (n, y) in spread(ends, [top + LABELS_APART / 2.0, bottom - LABELS_APART / 2.0]) {
        svg.text([right + 6.0, y], Anchor::Start, LABEL_TEXT, SERIES[n], &ids[n]);
    }
}

/// Moves labels apart that would overlap, in the order of their heights.
fn spread(mut labels: Vec<(usize, f64)>, [top, bottom]: [f64; 2]) -> Vec<(usize, f64)> {
    labels.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut least = top;
    for (_, y) in &mut labels {
        *y = y.max(least);
        least = *y + LABELS_APART;
    }
    let mut most = bottom;
    for (_, y) in labels.iter_mut().rev() {
        *y = y.min(most);
        most = *y - LABELS_APART;
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_keep_their_distance_and_stay_beside_the_panel() {
        let labels = spread(vec![(0, 99.0), (1, 98.0), (2, 10.0), (3, 97.0)], [5.0, 100.0]);
        assert_eq!(labels.iter().map(|label| label.0).collect::<Vec<_>>(), [2, 3, 1, 0]);
        assert!(labels.windows(2).all(|pair| pair[1].1 - pair[0].1 >= LABELS_APART));
        assert_eq!(labels[3].1, 100.0);
    }
}
