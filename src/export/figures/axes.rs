//! A framed plot with ticks: where a point of the data comes to lie on the sheet.

use super::svg::{Anchor, INK, Svg};
use super::ticks::Ticks;

/// Size of tick labels and of axis names \[px\].
const TICK_TEXT: f64 = 12.0;
const NAME_TEXT: f64 = 13.0;
const TICK: f64 = 5.0;

/// A window on the data and its place on the sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Axes {
    /// Top left corner and size \[px\].
    pub corner: [f64; 2],
    pub size: [f64; 2],
    /// Lowest and highest value on each axis.
    pub low: [f64; 2],
    pub high: [f64; 2],
}

/// The quantity of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Measure<'a> {
    pub quantity: &'a str,
    pub unit: &'a str,
}

impl Axes {
    /// Room below the plot for ticks and name \[px\].
    pub const BELOW: f64 = 52.0;

    /// A plot in which a unit is as long in y as it is in x, around a body within `low` to `high`
    /// with `margin` to every side; its corner is at the origin.
    pub fn equal(low: [f64; 2], high: [f64; 2], margin: f64) -> Self {
        let [width, height] = [0, 1].map(|k| (high[k] - low[k] + 2.0 * margin).max(f64::MIN_POSITIVE));
        // A slender body that stands gets a taller sheet, so that it is more than a line.
        Self::fitted(low, high, margin, [680.0, 680.0 * (height / width / 2.0).clamp(1.0, 1.6)])
    }

    /// Such a plot that takes no more than `room` \[px\], unless its ticks would overlap there.
    pub fn fitted(low: [f64; 2], high: [f64; 2], margin: f64, room: [f64; 2]) -> Self {
        let extent = [0, 1].map(|k| (high[k] - low[k] + 2.0 * margin).max(f64::MIN_POSITIVE));
        let scale = (room[0] / extent[0]).min(room[1] / extent[1]);
        let least = [150.0, 110.0];
        let size = [0, 1].map(|k| (extent[k] * scale).max(least[k]));
        let centre = [0, 1].map(|k| low[k] / 2.0 + high[k] / 2.0);
        Self {
            corner: [0.0, 0.0],
            size,
            low: [0, 1].map(|k| centre[k] - size[k] / scale / 2.0),
            high: [0, 1].map(|k| centre[k] + size[k] / scale / 2.0),
        }
    }

    /// Length of a unit along x \[px\].
    pub fn scale(&self) -> f64 {
        self.size[0] / (self.high[0] - self.low[0])
    }

    /// The place of a data point on the sheet \[px\].
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let along =
            |k: usize, value: f64| (value - self.low[k]) / (self.high[k] - self.low[k]) * self.size[k];
        [self.corner[0] + along(0, x), self.corner[1] + self.size[1] - along(1, y)]
    }

    pub fn ticks(&self) -> [Ticks; 2] {
        // More would be read no better, however tall the plot is.
        const MOST: f64 = 12.0;
        let ticks =
            |k: usize, apart: f64| Ticks::within(self.low[k], self.high[k], (self.size[k] / apart).min(MOST));
        let mut horizontal = ticks(0, 44.0);
        // Long labels need more room, and fewer ticks may have shorter labels.
        for _ in 0..3 {
            horizontal = ticks(0, (horizontal.widest_label(TICK_TEXT) + 16.0).max(44.0));
        }
        [horizontal, ticks(1, 34.0)]
    }

    /// Room that the labels of the vertical axis take to the left of the plot \[px\].
    pub fn left_of_plot(&self) -> f64 {
        let [_, ticks] = self.ticks();
        ticks.widest_label(TICK_TEXT) + TICK + 34.0
    }

    pub fn draw(&self, svg: &mut Svg, [x, y]: [Measure<'_>; 2]) {
        self.draw_vertical(svg, y, self.left_of_plot());
        self.draw_frame(svg);
        self.draw_horizontal(svg, x);
    }

    /// The box around the plot.
    pub fn draw_frame(&self, svg: &mut Svg) {
        svg.rect(self.corner, self.size, format_args!("fill=\"none\" stroke=\"{INK}\""));
    }

    pub fn draw_horizontal(&self, svg: &mut Svg, measure: Measure<'_>) {
        let [ticks, _] = self.ticks();
        let bottom = self.corner[1] + self.size[1];
        let at = |value: f64| self.place([value, self.low[1]])[0];
        svg.group(format_args!("stroke=\"{INK}\""), |svg| {
            ticks.values.iter().for_each(|&v| svg.line([at(v), bottom], [at(v), bottom + TICK]));
        });
        for &value in &ticks.values {
            svg.text([at(value), bottom + 15.0], Anchor::Middle, TICK_TEXT, INK, &ticks.label(value));
        }
        let name = ticks.axis_name(measure.quantity, measure.unit);
        let middle = self.corner[0] + self.size[0] / 2.0;
        svg.text([middle, bottom + 37.0], Anchor::Middle, NAME_TEXT, INK, &name);
    }

    /// `room` is how far to the left of the plot the name stands \[px\].
    pub fn draw_vertical(&self, svg: &mut Svg, measure: Measure<'_>, room: f64) {
        let [_, ticks] = self.ticks();
        let left = self.corner[0];
        let at = |value: f64| self.place([self.low[0], value])[1];
        svg.group(format_args!("stroke=\"{INK}\""), |svg| {
            ticks.values.iter().for_each(|&v| svg.line([left - TICK, at(v)], [left, at(v)]));
        });
        for &value in &ticks.values {
            svg.text([left - TICK - 4.0, at(value)], Anchor::End, TICK_TEXT, INK, &ticks.label(value));
        }
        let name = ticks.axis_name(measure.quantity, measure.unit);
        let at = [left - room + 14.0, self.corner[1] + self.size[1] / 2.0];
        svg.upward_text(at, NAME_TEXT, &name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_as_long_in_y_as_in_x_for_slender_bodies_too() {
        for high in [[10.0, 10.0], [100.0, 1000.0], [1000.0, 100.0], [0.0, 0.0]] {
            let axes = Axes::equal([0.0, 0.0], high, 1.0);
            let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|point| axes.place(point));
            assert!((b[0] - a[0] - (a[1] - c[1])).abs() < 1e-9, "{high:?}");
            assert!(axes.size[0] <= 680.1 && axes.size[1] <= 1088.1, "{high:?}: {:?}", axes.size);
        }
    }
}
