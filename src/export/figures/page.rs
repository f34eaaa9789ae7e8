//! A sheet with one plot of the body on it.

use super::axes::{Axes, Measure};
use super::heading::Heading;
use super::svg::Svg;
use crate::continuum::record::Snapshot;
use crate::flock::points::Points;

/// Every figure is this wide unless its body is slender \[px\].
pub const WIDTH: f64 = 800.0;
/// The narrowest sheet that still holds a title \[px\].
const NARROWEST: f64 = 430.0;

/// Draws a body's plot under its heading, with `beside` px of room to its right.
pub fn with_body(
    heading: &Heading,
    mut axes: Axes,
    unit: &str,
    beside: f64,
    draw: impl FnOnce(&mut Svg, &Axes),
) -> String {
    let left = axes.left_of_plot();
    let needed = left + axes.size[0] + beside;
    let width = needed.max(NARROWEST);
    let top = heading.height(width);
    axes.corner = [left + (width - needed) / 2.0, top];
    let mut svg = Svg::new(width, top + axes.size[1] + Axes::BELOW);
    heading.draw(&mut svg, width);
    axes.draw(&mut svg, [Measure { quantity: "x", unit }, Measure { quantity: "y", unit }]);
    draw(&mut svg, &axes);
    svg.finish()
}

/// The window that shows every particle that is drawn.
pub fn window(positions: &Points, drawn: impl Iterator<Item = usize>, spacing: f64) -> Axes {
    let finite = |&i: &usize| positions.get(i).iter().all(|value| value.is_finite());
    let (low, high) = positions.bounds(drawn.filter(finite)).unwrap_or(([0.0; 2], [1.0; 2]));
    let longest = (high[0] - low[0]).max(high[1] - low[1]);
    Axes::equal(low, high, (0.02 * longest).max(0.6 * spacing))
}

/// `step 20`, and how many bonds are broken.
pub fn note(snapshot: &Snapshot) -> String {
    let broken = match snapshot.broken.len() {
        0 => String::new(),
        1 => ", 1 broken bond".into(),
        count => format!(", {count} broken bonds"),
    };
    format!("step {}{broken}", snapshot.step)
}
