//! A coarse raster for bodies of very many particles: squares that keep the largest value in them.

use super::PNG_ZOOM;
use super::axes::Axes;
use super::svg::{Path, Svg};
use crate::ranks::Team;

/// Squares over a plot; those that nothing fell into stay empty.
#[derive(Clone, Debug)]
pub struct Raster {
    corner: [f64; 2],
    side: f64,
    columns: usize,
    largest: Vec<Option<f64>>,
    /// The number by which one value is larger than another.
    size: fn(f64) -> f64,
}

impl Raster {
    /// Squares twice as wide as particles are apart, so that a deformed body keeps no holes. They begin and end with
    /// pixels of the enlarged sheet: between others seams would show.
    pub fn over(axes: &Axes, spacing: f64) -> Self {
        const PIXEL: f64 = 1.0 / PNG_ZOOM as f64;
        let side = ((2.0 * spacing * axes.scale()).max(2.0) / PIXEL).ceil() * PIXEL;
        let corner = axes.corner.map(|along| (along / PIXEL).floor() * PIXEL);
        let [columns, rows] = axes.size.map(|length| (length / side) as usize + 2);
        Self { corner, side, columns, largest: vec![None; columns * rows], size: |value| value }
    }

    /// The same for values of either sign: that which is larger in size stays, of two alike the positive one.
    pub fn of_size_over(axes: &Axes, spacing: f64) -> Self {
        Self { size: f64::abs, ..Self::over(axes, spacing) }
    }

    /// Lets `value` fall onto the sheet at `place` \[px\].
    pub fn drop(&mut self, place: [f64; 2], value: f64) {
        let [column, row] = [0, 1].map(|k| (place[k] - self.corner[k]) / self.side);
        if column >= 0.0 && row >= 0.0 && (column as usize) < self.columns {
            self.keep(row as usize * self.columns + column as usize, value);
        }
    }

    fn keep(&mut self, square: usize, value: f64) {
        let Self { largest, size, .. } = self;
        if let Some(square) = largest.get_mut(square) {
            let is_larger = |kept: &f64| (size(*kept), *kept) >= (size(value), value);
            *square = Some(square.filter(is_larger).unwrap_or(value));
        }
    }

    /// What fell onto the sheets of all ranks, for the first one, where each lets its own part of a body fall.
    pub fn of_all(mut self, team: Option<&Team>) -> Self {
        let Some(team) = team else { return self };
        let sent =
            (!team.is_first()).then(|| postcard::to_stdvec(&self.largest).expect("numbers can be written"));
        team.bring(sent, |theirs| {
            let theirs: Vec<Option<f64>> = postcard::from_bytes(theirs).expect("as they were sent");
            let fell = theirs.into_iter().enumerate().filter_map(|(square, value)| Some((square, value?)));
            fell.for_each(|(square, value)| self.keep(square, value));
        });
        self
    }

    /// The squares of each class, neighbours in a row joined, as one path per class.
    fn paths(&self, classes: usize, class: impl Fn(f64) -> usize) -> Vec<Path> {
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
        let paths = self.paths(classes, class);
        for (n, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
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
