//! The bands of a filled contour plot: their levels, colours and outlines.

use super::axes::Axes;
use super::colour::viridis;
use super::raster::Raster;
use super::svg::{Anchor, INK, Svg};
use super::ticks::Ticks;
use crate::ranks::Team;

const LABEL_TEXT: f64 = 12.0;
const NAME_TEXT: f64 = 13.0;
const BAR_WIDTH: f64 = 16.0;
const BAR_GAP: f64 = 18.0;

/// A point of the sheet \[px\] and the field's value there.
pub type Sample = ([f64; 2], f64);

/// Levels at round values around the range of a quantity, which has a name in the end.
#[derive(Clone, Debug)]
pub struct Bands {
    levels: Ticks,
    quantity: String,
    unit: String,
}

impl Bands {
    /// Bands for values from `low` to `high`; one band if they differ by no more than `noise`.
    pub fn around(low: f64, high: f64, noise: f64) -> Self {
        Self::of_most(14.0, low, high, noise)
    }

    /// Narrower ones, for a field with a peak far above the rest.
    pub fn fine(low: f64, high: f64, noise: f64) -> Self {
        Self::of_most(20.0, low, high, noise)
    }

    fn of_most(most: f64, low: f64, high: f64, noise: f64) -> Self {
        let value = if high.abs() <= noise || !high.is_finite() { 0.0 } else { high };
        let varies = high - low > noise.max(1e-9 * high.abs());
        let levels = if varies { Ticks::around(low, high, most) } else { Ticks::single(value) };
        Self { levels, quantity: String::new(), unit: String::new() }
    }

    /// The same of this quantity.
    pub fn named(self, quantity: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { quantity: quantity.into(), unit: unit.into(), ..self }
    }

    pub fn count(&self) -> usize {
        (self.levels.values.len() - 1).max(1)
    }

    /// Lowest value of a band: by so little below its level that what rounding leaves there is in one band.
    pub fn level(&self, band: usize) -> f64 {
        /// Part of a band's width.
        const ROUNDING: f64 = 1e-6;
        let width = match self.levels.values[..] {
            [first, second, ..] => second - first,
            _ => 0.0,
        };
        self.levels.values[band] - ROUNDING * width
    }

    /// The band that a value falls into.
    pub fn of(&self, value: f64) -> usize {
        (1..self.count()).take_while(|&band| self.level(band) <= value).count()
    }

    pub fn colour(&self, band: usize) -> String {
        match self.count() {
            1 => viridis(0.0),
            count => viridis(band as f64 / (count - 1) as f64),
        }
    }

    /// Draws values at their places \[px\] as squares of the largest ones, of particles so far apart \[length\]; each rank has
    /// those of its part of a body.
    pub fn draw_raster(
        &self,
        svg: &mut Svg,
        (axes, spacing): (&Axes, f64),
        values: impl Iterator<Item = Sample>,
        team: Option<&Team>,
    ) {
        let mut raster = Raster::over(axes, spacing);
        values.for_each(|(place, value)| raster.drop(place, value));
        raster.of_all(team).draw(svg, self.count(), |value| self.of(value), |band| self.colour(band));
    }

    /// Room that the bar takes beside a plot \[px\].
    pub fn bar_room(&self) -> f64 {
        BAR_GAP + BAR_WIDTH + 8.0 + self.levels.widest_label(LABEL_TEXT) + 30.0
    }

    /// Draws the colour bar to the right of a plot.
    pub fn draw_bar(&self, svg: &mut Svg, axes: &Axes) {
        let (left, top) = (axes.corner[0] + axes.size[0] + BAR_GAP, axes.corner[1]);
        let (height, count) = (axes.size[1], self.count());
        let part = height / count as f64;
        for band in 0..count {
            let corner = [left, top + height - (band + 1) as f64 * part];
            svg.rect(corner, [BAR_WIDTH, part], format_args!("fill=\"{}\"", self.colour(band)));
        }
        svg.rect([left, top], [BAR_WIDTH, height], format_args!("fill=\"none\" stroke=\"{INK}\""));
        let every = (1.4 * LABEL_TEXT / part).ceil() as usize;
        let is_uniform = self.levels.values.len() == 1;
        for (n, &value) in self.levels.values.iter().enumerate().step_by(every.max(1)) {
            let y = if is_uniform { top + height / 2.0 } else { top + height - n as f64 * part };
            let label = self.levels.label(value);
            svg.text([left + BAR_WIDTH + 7.0, y], Anchor::Start, LABEL_TEXT, INK, &label);
        }
        let name_x = left + BAR_WIDTH + 8.0 + self.levels.widest_label(LABEL_TEXT) + 14.0;
        let name = self.levels.axis_name(&self.quantity, &self.unit);
        svg.upward_text([name_x, top + height / 2.0], NAME_TEXT, &name);
    }
}

/// Values of particles or robots, and their colours.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    pub bands: &'a Bands,
    /// Shape \[count\]; NaN where there is none.
    pub values: &'a [f64],
}

/// Colour of what has no value.
const NO_VALUE: &str = "#c9ccd1";

impl Field<'_> {
    /// The band of a particle; after the last one where it has no value.
    pub fn band(&self, particle: usize) -> usize {
        let value = self.values[particle];
        if value.is_finite() { self.bands.of(value) } else { self.bands.count() }
    }

    pub fn colour(&self, band: usize) -> String {
        if band < self.bands.count() { self.bands.colour(band) } else { NO_VALUE.into() }
    }
}

/// The part of a triangle in which the linear field through its corners is at least `level`.
pub fn at_least(level: f64, triangle: [Sample; 3]) -> Vec<[f64; 2]> {
    let mut part = Vec::with_capacity(4);
    for n in 0..3 {
        let ((a, at_a), (b, at_b)) = (triangle[n], triangle[(n + 1) % 3]);
        if at_a >= level {
            part.push(a);
        }
        if (at_a >= level) != (at_b >= level) {
            let fraction = (level - at_a) / (at_b - at_a);
            part.push([0, 1].map(|k| a[k] + fraction * (b[k] - a[k])));
        }
    }
    part
}

/// Cuts a face into triangles on which a linear field is defined: itself, or a fan around its middle.
pub fn triangles(face: &[Sample]) -> Vec<[Sample; 3]> {
    if let [a, b, c] = *face {
        return vec![[a, b, c]];
    }
    let share = 1.0 / face.len() as f64;
    let middle = face.iter().fold(([0.0, 0.0], 0.0), |(at, sum), &(point, value)| {
        ([at[0] + share * point[0], at[1] + share * point[1]], sum + share * value)
    });
    (0..face.len()).map(|n| [face[n], face[(n + 1) % face.len()], middle]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_field_is_cut_along_its_level() {
        let field = |[x, y]: [f64; 2]| ([x, y], 2.0 * x + y);
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(field);
        let mut area = 0.0;
        for triangle in triangles(&square) {
            let part = at_least(2.0, triangle);
            for &[x, y] in &part {
                assert!(2.0 * x + y >= 2.0 - 1e-12, "[{x}, {y}]");
            }
            area += crate::geometry::point::area(&part);
        }
        // 2x + y >= 2 within the unit square is the triangle (1, 0), (1, 1), (1/2, 1).
        assert!((area - 0.25).abs() < 1e-12, "{area}");
    }

    #[test]
    fn values_fall_into_the_band_between_their_levels() {
        let bands = Bands::around(0.0, 1.0, 0.0);
        assert_eq!((bands.count(), bands.of(0.0), bands.of(0.25), bands.of(1.0)), (10, 0, 2, 9));
        assert_eq!([bands.colour(0), bands.colour(9)], ["#440154", "#fde725"]);
    }

    #[test]
    fn what_rounding_leaves_at_a_level_is_in_the_band_above_it() {
        let bands = Bands::around(0.0, 1.0, 0.0);
        let [low, high] = [-1.0, 1.0].map(|sign| 0.5 + sign * 1e-9);
        assert_eq!(([low, 0.5, high].map(|value| bands.of(value)), bands.of(0.5 - 1e-5)), ([5; 3], 4));
        assert!(low >= bands.level(5) && bands.level(0) < 0.0);
        // Of reactions of either sign, which are none.
        let bands = Bands::around(-550.0, 550.0, 0.0);
        assert_eq!(bands.of(-1.1e-13), bands.of(1.2e-13));
    }

    #[test]
    fn a_uniform_field_has_one_band_and_noise_is_uniform() {
        for (low, high) in [(0.0, 0.0), (3.0, 3.0), (0.0, 1e-25), (f64::NAN, f64::NAN)] {
            let bands = Bands::around(low, high, 1e-20);
            assert_eq!((bands.count(), bands.of(high)), (1, 0), "{low} to {high}");
        }
    }
}
