//! SVG elements, as text.

use std::borrow::Cow;
use std::fmt::{self, Display, Formatter, Write};

/// First choice and fallback; the PNG is rendered with the first, which the program carries.
pub const FONT: &str = "DejaVu Sans, Verdana, sans-serif";

/// Ink of axes and text.
pub const INK: &str = "#222222";

/// A drawing under way; coordinates in \[px\] from the top left corner.
#[derive(Debug)]
pub struct Svg {
    text: String,
}

/// The alignment of a text at its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

impl Svg {
    /// An empty white sheet.
    pub fn new(width: f64, height: f64) -> Self {
        let mut svg = Self { text: String::new() };
        svg.push(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"{FONT}\">"
        ));
        svg.push("<rect width=\"100%\" height=\"100%\" fill=\"white\"/>");
        svg
    }

    pub fn finish(mut self) -> String {
        self.push("</svg>");
        self.text
    }

    /// Elements that share `attributes`.
    pub fn group(&mut self, attributes: impl Display, draw: impl FnOnce(&mut Self)) {
        self.group_of("g", attributes, draw);
    }

    fn group_of(&mut self, element: &str, attributes: impl Display, draw: impl FnOnce(&mut Self)) {
        self.push(format_args!("<{element} {attributes}>"));
        draw(self);
        self.push(format_args!("</{element}>"));
    }

    /// Elements of which only the part inside a rectangle shows. `name` is the rectangle's, one on a sheet.
    #[cfg(feature = "swarm")]
    pub fn clipped(&mut self, name: &str, corner: [f64; 2], size: [f64; 2], draw: impl FnOnce(&mut Self)) {
        self.group_of("clipPath", format_args!("id=\"{name}\""), |svg| svg.rect(corner, size, ""));
        self.group(format_args!("clip-path=\"url(#{name})\""), draw);
    }

    pub fn circle(&mut self, [x, y]: [f64; 2], radius: f64) {
        self.push(format_args!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\"/>"));
    }

    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        self.push(format_args!("<line x1=\"{x1:.2}\" y1=\"{y1:.2}\" x2=\"{x2:.2}\" y2=\"{y2:.2}\"/>"));
    }

    pub fn rect(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], attributes: impl Display) {
        self.push(format_args!(
            "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" {attributes}/>"
        ));
    }

    pub fn path(&mut self, path: &Path, attributes: impl Display) {
        self.push(format_args!("<path {attributes} d=\"{}\"/>", path.0));
    }

    /// Draws the cells of each class in its colour: the corners of each \[px\], and the value that it is classed by. A hairline of
    /// its own colour around each covers the seams between them.
    pub fn cells(
        &mut self,
        cells: impl Iterator<Item = (Vec<[f64; 2]>, f64)>,
        classes: usize,
        class: impl Fn(f64) -> usize,
        colour: impl Fn(usize) -> String,
    ) {
        let mut paths = vec![Path::default(); classes];
        cells.for_each(|(corners, value)| paths[class(value)].polygon(corners));
        for (class, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
            let colour = colour(class);
            let line = "stroke-width=\"0.4\" stroke-linejoin=\"round\"";
            self.path(path, format_args!("class=\"cells\" fill=\"{colour}\" stroke=\"{colour}\" {line}"));
        }
    }

    /// One line of text, centred on the height of `at`.
    pub fn text(&mut self, at: [f64; 2], anchor: Anchor, size: f64, colour: &str, content: &str) {
        let content = content.into();
        self.push(Text { at, anchor, size, colour, reads_upwards: false, content });
    }

    /// Text that reads upwards, centred on `at`.
    pub fn upward_text(&mut self, at: [f64; 2], size: f64, content: &str) {
        let content = content.into();
        self.push(Text { at, anchor: Anchor::Middle, size, colour: INK, reads_upwards: true, content });
    }

    fn push(&mut self, element: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{element}");
    }
}

/// One line of text on a sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Text<'a> {
    /// The middle of its height \[px\].
    pub at: [f64; 2],
    pub anchor: Anchor,
    /// \[px\]
    pub size: f64,
    pub colour: &'a str,
    pub reads_upwards: bool,
    pub content: Cow<'a, str>,
}

impl<'a> Text<'a> {
    /// The text of a line of a sheet, if it is one.
    pub fn read(line: &'a str) -> Option<Self> {
        let (attributes, content) = line.strip_prefix("<text ")?.strip_suffix("</text>")?.split_once('>')?;
        let attribute = |name: &str| {
            let mut pairs = attributes.split_inclusive("\" ").filter_map(|pair| pair.split_once("=\""));
            pairs.find(|pair| pair.0 == name).map(|(_, value)| value.trim_end_matches(['"', ' ']))
        };
        let number = |name| attribute(name)?.parse().ok();
        let anchors = [Anchor::Start, Anchor::Middle, Anchor::End];
        Some(Self {
            at: [number("x")?, number("y")?],
            anchor: anchors.into_iter().find(|anchor| attribute("text-anchor") == Some(anchor.name()))?,
            size: number("font-size")?,
            colour: attribute("fill")?,
            reads_upwards: attribute("transform").is_some(),
            content: unescaped(content).into(),
        })
    }

    /// From the middle of its height down to its base line \[px\]: half the height of a capital, since renderers disagree on
    /// `dominant-baseline`.
    pub fn rise(&self) -> f64 {
        0.36 * self.size
    }

    /// The attribute that turns it.
    pub fn turn(&self) -> String {
        let [x, y] = self.at;
        if self.reads_upwards { format!(" transform=\"rotate(-90 {x:.2} {y:.2})\"") } else { String::new() }
    }
}

impl Display for Text<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { at: [x, y], anchor, size, colour, content, .. } = self;
        // XML 1.0 has no place for control characters and these two, not even as references.
        let is_none = |c: char| c.is_control() || ('\u{fffe}'..='\u{ffff}').contains(&c);
        write!(
            f,
            "<text x=\"{x:.2}\" y=\"{y:.2}\" dy=\"{:.2}\" text-anchor=\"{}\" font-size=\"{size}\" \
             fill=\"{colour}\"{}>{}</text>",
            self.rise(),
            anchor.name(),
            self.turn(),
            escaped(&content.replace(is_none, " "))
        )
    }
}

/// The `d` of a path.
#[derive(Clone, Debug, Default)]
pub struct Path(String);

impl Path {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn polyline(&mut self, points: impl IntoIterator<Item = [f64; 2]>) {
        for (n, [x, y]) in points.into_iter().enumerate() {
            let command = if n == 0 { 'M' } else { 'L' };
            let _ = write!(self.0, "{command}{x:.2} {y:.2}");
        }
    }

    pub fn polygon(&mut self, points: impl IntoIterator<Item = [f64; 2]>) {
        self.polyline(points);
        self.0.push('Z');
    }

    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        let _ = write!(self.0, "M{x:.2} {y:.2}h{width:.2}v{height:.2}h-{width:.2}Z");
    }
}

/// A text within markup or a quoted attribute.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn unescaped(text: &str) -> String {
    text.replace("&quot;", "\"").replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_break_out_of_its_element() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.text([1.0, 2.0], Anchor::Start, 12.0, INK, "a < b & \u{1} </text>");
        assert!(svg.finish().contains(">a &lt; b &amp;   &lt;/text&gt;</text>"));
    }

    #[test]
    fn a_text_is_read_as_it_was_written() {
        let text = Text {
            at: [1.25, -2.5],
            anchor: Anchor::End,
            size: 11.5,
            colour: INK,
            reads_upwards: true,
            content: "&lt; fill=\"x\" > x=\"9\" </text>".into(),
        };
        for text in [text.clone(), Text { reads_upwards: false, ..text }] {
            assert_eq!(Text::read(&text.to_string()), Some(text));
        }
        assert_eq!(Text::read("<rect x=\"1\"/>"), None);
    }
}
