//! Fields of stress side by side: three panels of one body, with the scales of their colours.

use super::axes::{Axes, Measure};
use super::colour::{blue_to_red, viridis};
use super::heading::Heading;
use super::letters::text_width;
use super::raster::Raster;
use super::svg::{Anchor, INK, Svg};
use super::ticks::Ticks;
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::ranks::Team;

/// Shades of the colour bar: more than the eye distinguishes, and an odd number, so that one is in the middle.
const SHADES: usize = 97;
/// Stress above the scale: no colour of viridis.
const ABOVE: &str = "#ff8f7a";
/// Bodies of more cells are drawn as a raster in each panel.
pub const MOST_CELLS: usize = 20_000;

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

/// The plot of a panel, and whether the panels stand in a row or above each other, whichever suits the body; `window` fits
/// it into a room \[px\].
pub fn arranged(window: impl Fn([f64; 2]) -> Axes) -> (Axes, bool) {
    let row = window(IN_ROW);
    let is_row = row.size[0] < 1.6 * row.size[1];
    (if is_row { row } else { window(STACKED) }, is_row)
}

/// Where three panels lie beside or above each other, and how far they reach \[px\].
fn extent(axes: &Axes, is_row: bool) -> ([f64; 2], [f64; 2]) {
    let [width, height] = axes.size;
    let step = if is_row { [width + GAP, 0.0] } else { [0.0, height + NAME + 8.0] };
    (step, [width + 2.0 * step[0], height + 2.0 * step[1]])
}

/// Size of the sheet of three panels with so much room for bars and heading \[px\].
pub fn sheet_size(axes: &Axes, is_row: bool, [bars, heading]: [f64; 2]) -> [f64; 2] {
    let (_, block) = extent(axes, is_row);
    [axes.left_of_plot() + block[0] + bars, heading + NAME - 4.0 + block[1] + Axes::BELOW]
}

/// One body filled with one field.
pub struct Panel<'a> {
    pub name: &'static str,
    /// Shape \[cells\].
    pub stress: &'a [f64],
    pub places: &'a Vectors,
    /// Number of its scale.
    pub scale: usize,
}

/// From zero stress, or from as much pressure as there is tension, to the end of the scale.
pub struct Scale {
    name: &'static str,
    begin: f64,
    end: f64,
    /// The largest stress, if it lies above the end.
    above: Option<f64>,
    ticks: Ticks,
}

impl Scale {
    /// Of what is never negative, in about so many steps.
    pub fn from_zero(name: &'static str, end: f64, steps: f64) -> Self {
        Self::between(name, [0.0, positive(end)], steps)
    }

    /// Of what has either sign: zero has the colour in the middle.
    pub fn around_zero(name: &'static str, end: f64, steps: f64) -> Self {
        Self::between(name, [-positive(end), positive(end)], steps)
    }

    fn between(name: &'static str, [begin, end]: [f64; 2], steps: f64) -> Self {
        Self { name, begin, end, above: None, ticks: Ticks::within(begin, end, steps) }
    }

    /// Says how far values go that lie above the end.
    pub fn with_values_above(self, largest: f64) -> Self {
        Self { above: Some(largest).filter(|&largest| largest > self.end), ..self }
    }

    /// How far a value is on the way from the beginning to the end \[1\].
    fn share(&self, stress: f64) -> f64 {
        (stress - self.begin) / (self.end - self.begin)
    }

    fn shade(&self, stress: f64) -> usize {
        if stress > self.end { SHADES } else { (self.share(stress) * (SHADES - 1) as f64).round() as usize }
    }

    fn colour(&self, shade: usize) -> String {
        let share = shade as f64 / (SHADES - 1) as f64;
        match shade {
            SHADES => ABOVE.into(),
            _ if self.begin < 0.0 => blue_to_red(share),
            _ => viridis(share),
        }
    }

    fn widest_label(&self) -> f64 {
        let above = self.above.map_or(0.0, |largest| text_width(&self.up_to(largest), TICK_TEXT));
        self.ticks.widest_label(TICK_TEXT).max(above)
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
            svg.rect([left, top], [BAR_WIDTH, full], format_args!("fill=\"{}\"", self.colour(shade)));
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
            let y = top + height * (1.0 - self.share(value));
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

/// The end of a scale: one of nothing but zeros has to end somewhere.
fn positive(end: f64) -> f64 {
    if end > 0.0 { end } else { 1.0 }
}

/// Three panels in a row or stacked; beside them the bars of their scales, from the top down.
pub struct Sheet<'a> {
    pub axes: Axes,
    pub is_row: bool,
    /// One or two; of two the second is that of the last panel.
    pub scales: Vec<Scale>,
    pub heading: Heading,
    pub cells: &'a Cells,
    /// Whether cells are too many for each to be seen.
    pub is_raster: bool,
    /// The ranks that draw together, if each has a part of the body.
    pub team: Option<&'a Team>,
    /// Name of the unit of length.
    pub unit: &'a str,
    /// Name of the unit of stress; may be empty.
    pub stress_unit: &'a str,
    /// Distance of neighbours \[length\].
    pub spacing: f64,
}

impl Sheet<'_> {
    pub fn draw(mut self, panels: &[Panel<'_>; 3]) -> String {
        let left = self.axes.left_of_plot();
        let (step, block) = extent(&self.axes, self.is_row);
        let bars = self.scales.iter().map(Scale::room).fold(0.0, f64::max);
        let [sheet_width, _] = sheet_size(&self.axes, self.is_row, [bars, 0.0]);
        let heading = self.heading.height(sheet_width);
        let mut svg = Svg::new(sheet_width, sheet_size(&self.axes, self.is_row, [bars, heading])[1]);
        self.heading.draw(&mut svg, sheet_width);
        let top = heading + NAME - 4.0;
        for (n, panel) in panels.iter().enumerate() {
            self.axes.corner = [left + n as f64 * step[0], top + n as f64 * step[1]];
            self.draw_panel(&mut svg, panel, n);
        }
        let bar = [left + block[0] + BAR_GAP, top];
        match &self.scales[..] {
            [one, other] => {
                // Stacked panels are three, the last of them with the second scale.
                let share = if self.is_row { 0.5 } else { 2.0 / 3.0 };
                let first = share * (block[1] + BETWEEN_BARS) - BETWEEN_BARS;
                one.draw(&mut svg, bar, first, self.stress_unit);
                let below = [bar[0], top + first + BETWEEN_BARS];
                other.draw(&mut svg, below, block[1] - first - BETWEEN_BARS, self.stress_unit);
            }
            all => all.iter().for_each(|scale| scale.draw(&mut svg, bar, block[1], self.stress_unit)),
        }
        svg.finish()
    }

    fn draw_panel(&self, svg: &mut Svg, panel: &Panel<'_>, number: usize) {
        let (axes, unit) = (&self.axes, self.unit);
        let name_at = [axes.corner[0] + axes.size[0] / 2.0, axes.corner[1] - 0.6 * NAME_TEXT - 2.0];
        svg.text(name_at, Anchor::Middle, NAME_TEXT, INK, panel.name);
        let scale = &self.scales[panel.scale];
        let (shade, colour) = (|stress| scale.shade(stress), |shade| scale.colour(shade));
        match self.is_raster {
            true => self.squares(panel).draw(svg, SHADES + 1, shade, colour),
            false => svg.cells(self.shown(panel), SHADES + 1, shade, colour),
        }
        axes.draw_frame(svg);
        if number == 0 || !self.is_row {
            axes.draw_vertical(svg, Measure { quantity: "y", unit }, axes.left_of_plot());
        }
        if number == 2 || self.is_row {
            axes.draw_horizontal(svg, Measure { quantity: "x", unit });
        }
    }

    /// Places of the corners of each cell that has a stress, and that stress.
    fn shown<'p>(&'p self, panel: &'p Panel<'_>) -> impl Iterator<Item = (Vec<[f64; 2]>, f64)> + 'p {
        let corners = |cell: &[u32]| -> Vec<[f64; 2]> {
            cell.iter().map(|&i| self.axes.place(panel.places.get(i as usize))).collect()
        };
        let cells = self.cells.iter().zip(panel.stress);
        let placed = cells.map(move |(cell, &stress)| (corners(cell), stress));
        placed.filter(|(corners, stress)| {
            stress.is_finite() && corners.iter().flatten().all(|value| value.is_finite())
        })
    }

    fn squares(&self, panel: &Panel<'_>) -> Raster {
        let mut raster = Raster::of_size_over(&self.axes, self.spacing);
        for (corners, stress) in self.shown(panel) {
            let corners: Vectors = corners.into_iter().collect();
            raster.drop(corners.middle(), stress);
        }
        raster.of_all(self.team)
    }
}
