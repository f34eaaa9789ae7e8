//! The head of a plot: title, subject, legend.

use std::borrow::Cow;

use super::letters::text_width;
use super::svg::{Anchor, INK, Path, Svg};

const TITLE_TEXT: f64 = 16.0;
const NOTE_TEXT: f64 = 13.0;
const KEY_TEXT: f64 = 13.0;
const MARGIN: f64 = 16.0;
const QUIET: &str = "#555555";

/// An entry of the legend.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    pub name: Cow<'static, str>,
    pub colour: &'static str,
    pub mark: Mark,
}

impl Key {
    pub fn new(name: impl Into<Cow<'static, str>>, colour: &'static str, mark: Mark) -> Self {
        Self { name: name.into(), colour, mark }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    Dot,
    Square,
    Diamond,
    Ring,
    Line,
    DashedLine,
}

#[derive(Clone, Debug, Default)]
pub struct Heading {
    pub title: String,
    pub note: String,
    pub legend: Vec<Key>,
    /// Least height \[px\]: the sheets of a film are alike, however long their notes are.
    pub least: f64,
}

impl Heading {
    /// Height on a sheet of this width, the space to the plot included \[px\].
    pub fn height(&self, width: f64) -> f64 {
        self.draw(&mut Svg::new(width, 1.0), width).max(self.least)
    }

    /// Draws at the top of a sheet of this width; returns where the plot may begin \[px\].
    pub fn draw(&self, svg: &mut Svg, width: f64) -> f64 {
        let room = width - 2.0 * MARGIN;
        let mut y = 6.0;
        for (text, size, colour) in [(&self.title, TITLE_TEXT, INK), (&self.note, NOTE_TEXT, QUIET)] {
            for line in wrapped(text, size, room) {
                y += 0.75 * size;
                svg.text([MARGIN, y], Anchor::Start, size, colour, &line);
                y += 0.65 * size;
            }
        }
        let mut x = MARGIN;
        for (n, key) in self.legend.iter().enumerate() {
            let takes = 21.0 + text_width(&key.name, KEY_TEXT) + 20.0;
            if n == 0 || x + takes - 20.0 > width - MARGIN {
                x = MARGIN;
                y += if n == 0 { 14.0 } else { 20.0 };
            }
            draw_key(svg, key, [x, y]);
            x += takes;
        }
        y + if self.legend.is_empty() { 8.0 } else { 18.0 }
    }
}

fn draw_key(svg: &mut Svg, key: &Key, [x, y]: [f64; 2]) {
    match key.mark {
        Mark::Dot => {
            svg.group(format_args!("fill=\"{}\" class=\"key\"", key.colour), |svg| {
                svg.rect([x + 3.0, y - 5.0], [10.0, 10.0], "rx=\"5\"");
            });
        }
        Mark::Square | Mark::Diamond => {
            let attributes = format!("fill=\"{}\" class=\"key\"", key.colour);
            svg.group(attributes, |svg| draw_mark(svg, key.mark, [x + 8.0, y], 5.0));
        }
        Mark::Ring => {
            let attributes = format!("fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"", key.colour);
            svg.group(attributes, |svg| svg.rect([x + 3.0, y - 5.0], [10.0, 10.0], "rx=\"5\""));
        }
        Mark::Line | Mark::DashedLine => {
            let dashes = if key.mark == Mark::DashedLine { " stroke-dasharray=\"4 2\"" } else { "" };
            let attributes = format!("stroke=\"{}\" stroke-width=\"1.5\"{dashes}", key.colour);
            svg.group(attributes, |svg| svg.line([x, y], [x + 16.0, y]));
        }
    }
    svg.text([x + 21.0, y], Anchor::Start, KEY_TEXT, INK, &key.name);
}

/// From a diamond's middle to its corners, in radii of a dot about as large.
pub const DIAMOND: f64 = 1.25;

/// Draws a mark about as large as a dot of this radius; anything but a square and a diamond as that dot \[px\].
pub fn draw_mark(svg: &mut Svg, mark: Mark, [x, y]: [f64; 2], radius: f64) {
    let mut polygon = |corners: [[f64; 2]; 4], half: f64| {
        let mut path = Path::default();
        path.polygon(corners.map(|[right, down]| [x + half * right, y + half * down]));
        svg.path(&path, "");
    };
    match mark {
        Mark::Square => polygon([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]], 0.9 * radius),
        Mark::Diamond => polygon([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]], DIAMOND * radius),
        _ => svg.circle([x, y], radius),
    }
}

/// Breaks a text between words so that no line is wider than `room` \[px\].
fn wrapped(text: &str, size: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let fits = |line: &str| text_width(line, size) <= room;
    for mut word in text.split_whitespace() {
        // A word longer than a line, as those of scripts without spaces are.
        while !fits(word) && word.chars().nth(1).is_some() {
            let ends = || word.char_indices().map(|(at, _)| at).skip(1);
            let end = ends().take_while(|&end| fits(&word[..end])).last().or_else(|| ends().next());
            let (line, rest) = word.split_at(end.unwrap_or(word.len()));
            lines.push(line.to_owned());
            word = rest;
        }
        match lines.last_mut() {
            Some(line) if fits(&format!("{line} {word}")) => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_title_wraps_and_pushes_the_plot_down() {
        let heading = |title: &str| Heading { title: title.into(), ..Heading::default() };
        let (short, long) = (heading("Tension"), heading(&"tension ".repeat(40)));
        assert_eq!(wrapped(&short.title, TITLE_TEXT, 768.0), ["Tension"]);
        assert_eq!(wrapped(&long.title, TITLE_TEXT, 768.0).concat().matches("tension").count(), 40);
        let word = "\u{10d}".repeat(400);
        let lines = wrapped(&word, TITLE_TEXT, 768.0);
        assert_eq!(lines.concat(), word);
        assert!(lines.iter().all(|line| text_width(line, TITLE_TEXT) <= 768.0), "{lines:?}");
        assert!(long.height(800.0) > short.height(800.0) + 50.0);
    }
}
