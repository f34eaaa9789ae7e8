//! The von Mises stress by a rule beside the true one, as in the paper's figures 12, 14, 16 and 18.

use super::axes::{Axes, Measure};
use super::colour::viridis;
use super::comparison::{Pair, scale_note};
use super::heading::Heading;
use super::svg::{Anchor, INK, Path, Svg, text_width};
use super::ticks::Ticks;
use crate::flock::vectors::Vectors;

/// Name of the third panel and of its scale.
const DIFFERENCE: &str = "|rule \u{2212} truth|";
/// Shades of the colour bar: more than the eye distinguishes.
const SHADES: usize = 96;
/// Stress above the scale: no colour of viridis.
const ABOVE: &str = "#ff8f7a";
/// The scale ends at the largest true stress times this if the rule has more.
const HEADROOM: f64 = 1.25;

/// Room for a panel in a row of three, and for one of three stacked \[px\].
const IN_ROW: [f64; 2] = [310.0, 400.0];
const STACKED: [f64; 2] = [680.0, 300.0];
/// Between panels; above each stands its name \[px\].
const GAP: f64 = 22.0;
const NAME: f64 = 26.0;
const NAME_TEXT: f64 = 13.0;
const TICK_TEXT: f64 = 12.0;
/// From one line of a bar's name to the next \[px\].
const LINE: f64 = 17.0;
const BAR_WIDTH: f64 = 16.0;
const BAR_GAP: f64 = 20.0;
const BETWEEN_BARS: f64 = 26.0;

/// Rule and truth at the centres of the cells on one scale, and the size of their difference on its own; `rule` and
/// `truth` are \[force / length^2\], shape \[cells\].
pub fn von_mises(pair: &Pair<'_>, rule: &[f64], truth: &[f64]) -> String {
    let factor = pair.factor();
    let [by_rule, in_truth] = [pair.rule, pair.truth].map(|u| pair.displaced(u, factor));
    let apart: Vec<f64> = rule.iter().zip(truth).map(|(rule, truth)| (rule - truth).abs()).collect();
    let panels = [
        Panel { name: "rule", stress: rule, places: &by_rule },
        Panel { name: "truth", stress: truth, places: &in_truth },
        Panel { name: DIFFERENCE, stress: &apart, places: &in_truth },
    ];
    let scales = [Scale::of(rule, truth), Scale::of_difference(&apart)];
    let places = || [&by_rule, &in_truth];
    let row = pair.window(places(), |low, high, margin| Axes::fitted(low, high, margin, IN_ROW));
    let is_row = row.size[0] < 1.6 * row.size[1];
    let axes = if is_row {
        row
    } else {
        pair.window(places(), |low, high, margin| Axes::fitted(low, high, margin, STACKED))
    };
    let heading = Heading {
        title: pair.title.into(),
        note: format!("von Mises stress at the centres of the cells{}", scale_note(factor)),
        ..Heading::default()
    };
    Sheet { axes, is_row, scales, heading }.draw(pair, &panels)
}

/// One body filled with one field.
struct Panel<'a> {
    name: &'static str,
    /// Shape \[cells\].
    stress: &'a [f64],
    places: &'a Vectors,
}

/// From zero stress to the end of the scale.
struct Scale {
    name: &'static str,
    end: f64,
    /// The largest stress, if it lies above the end.
    above: Option<f64>,
    ticks: Ticks,
}

impl Scale {
    fn of(rule: &[f64], truth: &[f64]) -> Self {
        let largest = |stress: &[f64]| stress.iter().copied().filter(|s| s.is_finite()).fold(0.0, f64::max);
        let (by_rule, in_truth) = (largest(rule), largest(truth));
        let end = if in_truth == 0.0 { by_rule } else { by_rule.min(HEADROOM * in_truth).max(in_truth) };
        let end = if end > 0.0 { end } else { 1.0 };
        Self {
            name: "von Mises stress",
            end,
            above: Some(by_rule).filter(|&largest| largest > end),
            ticks: Ticks::within(0.0, end, 10.0),
        }
    }

    fn of_difference(apart: &[f64]) -> Self {
        let largest = apart.iter().copied().filter(|s| s.is_finite()).fold(0.0, f64::max);
        let end = if largest > 0.0 { largest } else { 1.0 };
        Self { name: DIFFERENCE, end, above: None, ticks: Ticks::within(0.0, end, 5.0) }
    }

    fn shade(&self, stress: f64) -> usize {
        if stress > self.end { SHADES } else { ((stress / self.end) * (SHADES - 1) as f64).round() as usize }
    }

    fn colour(shade: usize) -> String {
        if shade == SHADES { ABOVE.into() } else { viridis(shade as f64 / (SHADES - 1) as f64) }
    }

    fn widest_label(&self) -> f64 {
        let width = |&value: &f64| text_width(&self.ticks.label(value), TICK_TEXT);
        let above = self.above.map_or(0.0, |largest| text_width(&self.up_to(largest), TICK_TEXT));
        self.ticks.values.iter().map(width).fold(above, f64::max)
    }

    fn up_to(&self, largest: f64) -> String {
        format!("up to {}", self.ticks.label(largest))
    }

    /// Room beside the panels \[px\].
    fn room(&self) -> f64 {
        BAR_GAP + BAR_WIDTH + 8.0 + self.widest_label() + 34.0 + LINE
    }

    fn draw(&self, svg: &mut Svg, [left, top]: [f64; 2], height: f64, unit: &str) {
        let above = if self.above.is_some() { 18.0 } else { 0.0 };
        let (top, height) = (top + above, height - above);
        // Each shade reaches under the next, so that no seam shows between them.
        for shade in 0..SHADES {
            let full = height * (SHADES - shade) as f64 / SHADES as f64;
            svg.rect([left, top], [BAR_WIDTH, full], format_args!("fill=\"{}\"", Self::colour(shade)));
        }
        svg.rect([left, top], [BAR_WIDTH, height], format_args!("fill=\"none\" stroke=\"{INK}\""));
        let text = left + BAR_WIDTH + 8.0;
        if let Some(largest) = self.above {
            let corner = [left, top - above];
            svg.rect(corner, [BAR_WIDTH, above - 4.0], format_args!("fill=\"{ABOVE}\" stroke=\"{INK}\""));
            let at = [text, top - above + 7.0];
            svg.text(at, Anchor::Start, TICK_TEXT, INK, &self.up_to(largest));
        }
        for &value in &self.ticks.values {
            let y = top + height * (1.0 - value / self.end);
            svg.group(format_args!("stroke=\"{INK}\""), |svg| {
                svg.line([left + BAR_WIDTH, y], [left + BAR_WIDTH + 4.0, y]);
            });
            svg.text([text, y], Anchor::Start, TICK_TEXT, INK, &self.ticks.label(value));
        }
        let name_x = text + self.widest_label() + 16.0;
        let name = self.ticks.axis_name(self.name, unit);
        // What is longer than the bar would run into the next one: its unit has a line of its own.
        let lines = match name.split_once(" [") {
            Some((quantity, unit)) if text_width(&name, NAME_TEXT) > height => {
                vec![quantity.to_owned(), format!("[{unit}")]
            }
            _ => vec![name],
        };
        for (n, line) in lines.iter().enumerate() {
            svg.upward_text([name_x + n as f64 * LINE, top + height / 2.0], NAME_TEXT, line);
        }
    }
}

/// Three panels in a row or stacked; beside them the bar of the first two, and below it that of the third.
struct Sheet {
    axes: Axes,
    is_row: bool,
    scales: [Scale; 2],
    heading: Heading,
}

impl Sheet {
    fn draw(mut self, pair: &Pair<'_>, panels: &[Panel<'_>; 3]) -> String {
        let left = self.axes.left_of_plot();
        let [width, height] = self.axes.size;
        let step = if self.is_row { [width + GAP, 0.0] } else { [0.0, height + NAME + 8.0] };
        let block = [width + 2.0 * step[0], height + 2.0 * step[1]];
        let sheet_width = left + block[0] + self.scales[0].room().max(self.scales[1].room());
        let top = self.heading.height(sheet_width) + NAME - 4.0;
        let mut svg = Svg::new(sheet_width, top + block[1] + Axes::BELOW);
        self.heading.draw(&mut svg, sheet_width);
        for (n, panel) in panels.iter().enumerate() {
            self.axes.corner = [left + n as f64 * step[0], top + n as f64 * step[1]];
            self.draw_panel(&mut svg, pair, panel, n);
        }
        // Stacked panels are three, the last of them the difference.
        let share = if self.is_row { 0.5 } else { 2.0 / 3.0 };
        let first = share * (block[1] + BETWEEN_BARS) - BETWEEN_BARS;
        let bar = [left + block[0] + BAR_GAP, top];
        self.scales[0].draw(&mut svg, bar, first, pair.stress_unit);
        let below = [bar[0], top + first + BETWEEN_BARS];
        self.scales[1].draw(&mut svg, below, block[1] - first - BETWEEN_BARS, pair.stress_unit);
        svg.finish()
    }

    fn draw_panel(&self, svg: &mut Svg, pair: &Pair<'_>, panel: &Panel<'_>, number: usize) {
        let (axes, unit) = (&self.axes, pair.unit);
        let name_at = [axes.corner[0] + axes.size[0] / 2.0, axes.corner[1] - 0.6 * NAME_TEXT - 2.0];
        svg.text(name_at, Anchor::Middle, NAME_TEXT, INK, panel.name);
        let mut paths = vec![Path::default(); SHADES + 1];
        for (cell, &stress) in pair.cells.iter().zip(panel.stress) {
            let corners: Vec<[f64; 2]> =
                cell.iter().map(|&i| axes.place(panel.places.get(i as usize))).collect();
            if stress.is_finite() && corners.iter().flatten().all(|value| value.is_finite()) {
                paths[self.scales[usize::from(number == 2)].shade(stress)].polygon(corners);
            }
        }
        // A hairline of its own colour around each cell covers the seams between cells.
        for (shade, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
            let colour = Scale::colour(shade);
            let line = "stroke-width=\"0.4\" stroke-linejoin=\"round\"";
            svg.path(path, format_args!("class=\"cells\" fill=\"{colour}\" stroke=\"{colour}\" {line}"));
        }
        axes.draw_frame(svg);
        if number == 0 || !self.is_row {
            axes.draw_vertical(svg, Measure { quantity: "y", unit }, axes.left_of_plot());
        }
        if number == 2 || self.is_row {
            axes.draw_horizontal(svg, Measure { quantity: "x", unit });
        }
    }
}
