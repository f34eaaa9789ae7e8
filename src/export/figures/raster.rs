//! A coarse raster for bodies of very many particles: squares that keep the largest value in them.

use super::PNG_ZOOM;
use super::axes::Axes;
use super::svg::{Path, Svg};

/// Squares over a plot; those that nothing fell into stay empty.
#[derive(Clone, Debug)]
pub struct Raster {
    corner: [f64; 2],
    side: f64,
    columns: usize,
    largest: Vec<Option<f64>>,
}

impl Raster {
    /// Squares twice as wide as particles are apart, so that a deformed body keeps no holes. They begin and end with
    /// pixels of the enlarged sheet: between others seams would show.
    pub fn over(axes: &Axes, spacing: f64) -> Self {
        const PIXEL: f64 = 1.0 / PNG_ZOOM as f64;
        let side = ((2.0 * spacing * axes.scale()).max(2.0) / PIXEL).ceil() * PIXEL;
        let corner = axes.corner.map(|along| (along / PIXEL).floor() * PIXEL);
        let [columns, rows] = axes.size.map(|length| (length / side) as usize + 2);
        Self { corner, side, columns, largest: vec![None; columns * rows] }
    }

    /// Lets `value` fall onto the sheet at `place` \[px\].
    pub fn drop(&mut self, place: [f64; 2], value: f64) {
        self.drop_greater(place, value, |value| value);
    }

    /// The same where values have either sign: that which is larger in size stays.
    pub fn drop_largest_in_size(&mut self, place: [f64; 2], value: f64) {
        self.drop_greater(place, value, f64::abs);
    }

    fn drop_greater(&mut self, place: [f64; 2], value: f64, size: fn(f64) -> f64) {
        let [column, row] = [0, 1].map(|k| (place[k] - self.corner[k]) / self.side);
        if column >= 0.0
            && row >= 0.0
            && (column as usize) < self.columns
            && let Some(square) = self.largest.get_mut(row as usize * self.columns + column as usize)
        {
            *square = Some(square.filter(|&largest| size(largest) >= size(value)).unwrap_or(value));
        }
    }

    /// The squares of each class, neighbours in a row joined, as one path per class.
    pub fn paths(&self, classes: usize, class: impl Fn(f64) -> usize) -> Vec<Path> {
        let mut paths = vec![Path::default(); classes];
        for (row, squares) in self.largest.chunks(self.columns).enumerate() {
            let of_square: Vec<Option<usize>> = squares.iter().map(|value| value.map(&class)).collect();
            let mut column = 0;
            for run in of_square.chunk_by(|a, b| a == b) {
                if let Some(class) = run[0] {
                    let at = [column as f64, row as f64];
                    let corner = [0, 1].map(|k| self.corner[k] + at[k] * self.side);
                    paths[class].rectangle(corner, [run.len() as f64 * self.side, self.side]);
                }
                column += run.len();
            }
        }
        paths
    }

    /// Draws the squares of each class in its colour.
    pub fn draw(
        &self,
        svg: &mut Svg,
        classes: usize,
        class: impl Fn(f64) -> usize,
        colour: impl Fn(usize) -> String,
    ) {
        for (n, path) in self.paths(classes, class).iter().enumerate() {
            svg.path(path, format_args!("fill=\"{}\" shape-rendering=\"crispEdges\"", colour(n)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_keeps_its_largest_value_and_joins_its_like() {
        let axes = Axes { corner: [0.0; 2], size: [40.0, 10.0], low: [0.0; 2], high: [40.0, 10.0] };
        let mut raster = Raster::over(&axes, 5.0);
        for (place, value) in [([1.0, 1.0], 1.0), ([2.0, 2.0], 0.0), ([11.0, 1.0], 1.0), ([39.0, 1.0], 0.0)] {
            raster.drop(place, value);
        }
        let mut expected = [Path::default(), Path::default()];
        expected[0].rectangle([30.0, 0.0], [10.0, 10.0]);
        expected[1].rectangle([0.0, 0.0], [20.0, 10.0]);
        let paths = raster.paths(2, |value| value as usize);
        assert_eq!(format!("{paths:?}"), format!("{expected:?}"));
    }
}
