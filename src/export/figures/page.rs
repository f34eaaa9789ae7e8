//! A sheet with one plot of the body on it.

use super::Subject;
use super::axes::{Axes, Measure};
use super::heading::Heading;
use super::svg::Svg;
use crate::continuum::record::Snapshot;
use crate::flock::vectors::Vectors;

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
    let width = width_of(&axes, beside);
    let top = heading.height(width);
    axes.corner = [left + (width - needed) / 2.0, top];
    let mut svg = Svg::new(width, top + axes.size[1] + Axes::BELOW);
    heading.draw(&mut svg, width);
    axes.draw(&mut svg, [Measure { quantity: "x", unit }, Measure { quantity: "y", unit }]);
    draw(&mut svg, &axes);
    svg.finish()
}

/// Width of the sheet of a body's plot with `beside` px of room to its right \[px\].
pub fn width_of(axes: &Axes, beside: f64) -> f64 {
    (axes.left_of_plot() + axes.size[0] + beside).max(NARROWEST)
}

/// Lowest and highest place.
pub type Bounds = [[f64; 2]; 2];

/// The bounds of those drawn, as far as they are anywhere.
pub fn bounds(positions: &Vectors, drawn: impl Iterator<Item = usize>) -> Option<Bounds> {
    let finite = |&i: &usize| positions.get(i).iter().all(|value| value.is_finite());
    positions.bounds(drawn.filter(finite)).map(|(low, high)| [low, high])
}

/// The bounds of what lies within either.
pub fn around_both(one: Option<Bounds>, other: Option<Bounds>) -> Option<Bounds> {
    let (Some([low, high]), Some([lower, higher])) = (one, other) else { return one.or(other) };
    Some([[0, 1].map(|k| f64::min(low[k], lower[k])), [0, 1].map(|k| f64::max(high[k], higher[k]))])
}

/// The window that shows what lies within these bounds.
pub fn around(bounds: Option<Bounds>, spacing: f64) -> Axes {
    let ([low, high], margin) = with_margin(bounds, spacing);
    Axes::equal(low, high, margin)
}

/// The same in a room of this size \[px\].
pub fn within(bounds: Option<Bounds>, spacing: f64, room: [f64; 2]) -> Axes {
    let ([low, high], margin) = with_margin(bounds, spacing);
    Axes::fitted(low, high, margin, room)
}

/// The same in a film, which is shown whole: a sheet that is higher than a screen would be made small, and its letters
/// with it.
pub fn around_in_film(bounds: Option<Bounds>, spacing: f64) -> Axes {
    /// Room for the plot \[px\].
    const ROOM: [f64; 2] = [680.0, 560.0];
    within(bounds, spacing, ROOM)
}

/// The bounds, of nothing those of a unit, and the room around them.
fn with_margin(bounds: Option<Bounds>, spacing: f64) -> (Bounds, f64) {
    let [low, high] = bounds.unwrap_or([[0.0; 2], [1.0; 2]]);
    let longest = (high[0] - low[0]).max(high[1] - low[1]);
    ([low, high], (0.02 * longest).max(0.6 * spacing))
}

/// `step 20`, and how many bonds are broken.
pub fn note(subject: &Subject<'_>, snapshot: &Snapshot) -> String {
    // The step of an equilibrium says no more than which leaders hold there.
    let clock = match subject.is_solved_at_once {
        true => "solved for equilibrium".to_owned(),
        false => format!("{} {}", subject.counts, snapshot.step),
    };
    note_at(&clock, snapshot.broken.len())
}

/// The time in words, and how many bonds are broken.
pub fn note_at(clock: &str, broken: usize) -> String {
    let broken = match broken {
        0 => String::new(),
        1 => ", 1 broken bond".into(),
        count => format!(", {count} broken bonds"),
    };
    format!("{clock}{broken}")
}
