//! Texts of a sheet become outlines of letters, in the font that the program carries: what a picture is painted from.
//!
//! Letters stand one after the other, from left to right, closer where the font says so. Those of scripts that run the other way are
//! boxes, as are those that the font has not: a word that is drawn backwards looks right to a reader of other scripts.

use std::fmt::Write;
use std::sync::LazyLock;

use ttf_parser::{Face, GlyphId, OutlineBuilder};
use unicode_normalization::UnicodeNormalization;

use super::svg::{Anchor, Text};

/// The letters of DejaVu Sans.
pub struct Letters {
    face: Face<'static>,
}

/// Width of a text \[px\].
pub fn text_width(content: &str, size: f64) -> f64 {
    LETTERS.width(&LETTERS.letters(content)) * LETTERS.scale(size)
}

/// Those of the program.
pub static LETTERS: LazyLock<Letters> = LazyLock::new(|| Letters {
    face: Face::parse(dejavu::sans::regular(), 0).expect("the font that is carried can be read"),
});

impl Letters {
    /// Of a unit of the font, for text of this size \[px\].
    fn scale(&self, size: f64) -> f64 {
        size / f64::from(self.face.units_per_em())
    }

    /// In units of the font.
    fn width(&self, letters: &[(GlyphId, f64)]) -> f64 {
        letters.last().map_or(0.0, |&(letter, at)| at + self.advance(letter))
    }

    /// The sheet with the outline of each text in its place.
    pub fn outlined(&self, sheet: &str) -> String {
        let mut outlined = String::with_capacity(2 * sheet.len());
        for line in sheet.lines() {
            match Text::read(line) {
                Some(text) => outlined.push_str(&self.outline(&text)),
                None => outlined.push_str(line),
            }
            outlined.push('\n');
        }
        outlined
    }

    fn outline(&self, text: &Text<'_>) -> String {
        let (scale, letters) = (self.scale(text.size), self.letters(&text.content));
        let width = self.width(&letters) * scale;
        let before = match text.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * width,
            Anchor::End => width,
        };
        let corner = [text.at[0] - before, text.at[1] + text.rise()];
        let mut outline = Outline { scale, corner, path: String::new() };
        for (letter, at) in letters {
            outline.corner[0] = corner[0] + at * scale;
            // A space has none.
            let _ = self.face.outline_glyph(letter, &mut outline);
        }
        format!("<path fill=\"{}\"{} d=\"{}\"/>", text.colour, text.turn(), outline.path)
    }

    /// Each with where it begins, in units of the font; a letter and its accent are one.
    fn letters(&self, content: &str) -> Vec<(GlyphId, f64)> {
        let mut letters: Vec<(GlyphId, f64)> = Vec::new();
        for c in content.nfc() {
            let letter = self.face.glyph_index(c).filter(|_| !runs_leftwards(c)).unwrap_or_default();
            let at = letters
                .last()
                .map_or(0.0, |&(last, at)| at + self.advance(last) + self.kerning(last, letter));
            letters.push((letter, at));
        }
        letters
    }

    fn advance(&self, letter: GlyphId) -> f64 {
        self.face.glyph_hor_advance(letter).map_or(0.0, f64::from)
    }

    fn kerning(&self, left: GlyphId, right: GlyphId) -> f64 {
        let tables = self.face.tables().kern.into_iter().flat_map(|kern| kern.subtables);
        tables.filter_map(|table| table.glyphs_kerning(left, right)).map(f64::from).sum()
    }
}

/// Whether it is of Hebrew, Arabic or another script that runs from right to left.
fn runs_leftwards(c: char) -> bool {
    matches!(c, '\u{590}'..='\u{8ff}' | '\u{fb1d}'..='\u{fdff}' | '\u{fe70}'..='\u{fefc}' | '\u{10800}'..='\u{10fff}')
}

/// The `d` of letters; the font's y points up.
struct Outline {
    /// Of a unit of the font \[px\].
    scale: f64,
    /// Where the letter begins on its base line \[px\].
    corner: [f64; 2],
    path: String,
}

impl Outline {
    fn push(&mut self, command: char, points: &[[f32; 2]]) {
        self.path.push(command);
        for &[x, y] in points {
            let [x, y] =
                [self.corner[0] + self.scale * f64::from(x), self.corner[1] - self.scale * f64::from(y)];
            // Writing to a string cannot fail.
            let _ = write!(self.path, "{x:.3} {y:.3} ");
        }
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.push('M', &[[x, y]]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.push('L', &[[x, y]]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.push('Q', &[[x1, y1], [x, y]]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.push('C', &[[x1, y1], [x2, y2], [x, y]]);
    }

    fn close(&mut self) {
        self.push('Z', &[]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::figures::svg::{INK, Svg};

    #[test]
    fn texts_are_outlines_where_they_stood_and_all_else_is_left_as_it_is() {
        const TEXT: &str = "<Ho> & \"nail\"";
        let sheet = |anchor| {
            let mut svg = Svg::new(200.0, 40.0);
            svg.circle([5.0, 5.0], 1.0);
            svg.text([100.0, 20.0], anchor, 12.0, INK, TEXT);
            svg.finish()
        };
        // The least and the greatest x of the outline.
        let ends = |anchor| {
            let outlined = LETTERS.outlined(&sheet(anchor));
            assert!(!outlined.contains("<text") && outlined.contains("<circle"), "{outlined}");
            let path =
                outlined.split(" d=\"").nth(1).expect("a path").split('"').next().expect("its d").to_owned();
            let numbers: Vec<f64> =
                path.split(|c: char| !"-.0123456789".contains(c)).filter_map(|n| n.parse().ok()).collect();
            let x = || numbers.iter().step_by(2).copied();
            [x().fold(f64::MAX, f64::min), x().fold(f64::MIN, f64::max)]
        };
        let [start, middle, end] = [Anchor::Start, Anchor::Middle, Anchor::End].map(ends);
        let width = text_width(TEXT, 12.0);
        assert!((start[0] - 100.0).abs() < 2.0 && (end[1] - 100.0).abs() < 2.0, "{start:?} {end:?}");
        assert!((middle[0] + middle[1] - 200.0).abs() < 2.0, "{middle:?}");
        // Within the room around the first letter and the last.
        assert!((start[1] - start[0] - width).abs() < 3.0, "{start:?} {width}");
    }

    #[test]
    fn letters_stand_closer_where_the_font_says_so() {
        let second = |content| LETTERS.letters(content)[1].1;
        assert!(second("AV") < second("AH"));
    }

    #[test]
    fn accents_are_of_their_letters_and_what_would_be_drawn_backwards_is_boxes() {
        assert_eq!(LETTERS.letters("U\u{308}ber E\u{301}"), LETTERS.letters("\u{dc}ber \u{c9}"));
        let of =
            |content| LETTERS.letters(content).into_iter().map(|(letter, _)| letter.0).collect::<Vec<_>>();
        assert_eq!(of("\u{5e9}\u{644}"), [0, 0]);
        assert!(!of("\u{416}\u{3a9}\u{dc}").contains(&0));
        assert!(text_width("\u{416}", 100.0) > 100.0, "wider than any that is written in English");
    }
}
