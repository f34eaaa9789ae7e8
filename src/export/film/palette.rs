//! The 255 colours of a GIF: every colour that a figure names, and the most frequent of those between them.

use std::collections::{HashMap, HashSet};

use super::Picture;

/// Colours at most; one more number means that a pixel stays as it was.
const MOST: usize = 255;

/// Colours by number, and the number of every colour met.
#[derive(Debug)]
pub struct Palette {
    colours: Vec<[u8; 3]>,
    numbers: HashMap<[u8; 3], u8>,
}

impl Palette {
    /// The number of a pixel that stays as it was.
    pub const SAME: u8 = MOST as u8;

    /// The colours that most pixels of these pictures have. A figure is made of areas of one colour, which all are
    /// among them, and of edges between these, which are the rest.
    pub fn of(pictures: &[Picture]) -> Self {
        let mut pixels: HashMap<[u8; 3], usize> = HashMap::new();
        for colour in pictures.iter().flat_map(colours_of) {
            *pixels.entry(colour).or_default() += 1;
        }
        let mut by_number: Vec<([u8; 3], usize)> = pixels.into_iter().collect();
        by_number.sort_unstable_by_key(|&(colour, count)| (std::cmp::Reverse(count), colour));
        let mut colours: Vec<[u8; 3]> = Vec::new();
        let mut near: HashSet<[u8; 3]> = HashSet::new();
        // First one of each group of colours that look alike, then the others.
        for (colour, _) in &by_number {
            if colours.len() < MOST && near.insert(colour.map(|channel| channel >> 4)) {
                colours.push(*colour);
            }
        }
        let taken: HashSet<[u8; 3]> = colours.iter().copied().collect();
        let others = by_number.iter().map(|(colour, _)| *colour).filter(|colour| !taken.contains(colour));
        colours.extend(others.take(MOST - colours.len().min(MOST)));
        let numbers = colours.iter().enumerate().map(|(n, &colour)| (colour, n as u8)).collect();
        Self { colours, numbers }
    }

    /// Red, green and blue of each colour, of 256.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.colours.concat();
        bytes.resize(3 * (MOST + 1), 0);
        bytes
    }

    /// The number of the nearest colour, for each pixel.
    pub fn numbers(&mut self, picture: &Picture) -> Vec<u8> {
        colours_of(picture).map(|colour| self.number(colour)).collect()
    }

    fn number(&mut self, colour: [u8; 3]) -> u8 {
        if let Some(&number) = self.numbers.get(&colour) {
            return number;
        }
        let apart = |other: &[u8; 3]| -> u32 {
            colour.iter().zip(other).map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2)).sum()
        };
        let nearest = (0..self.colours.len()).min_by_key(|&n| apart(&self.colours[n]));
        let number = nearest.map_or(0, |n| n as u8);
        self.numbers.insert(colour, number);
        number
    }
}

fn colours_of(picture: &Picture) -> impl Iterator<Item = [u8; 3]> + '_ {
    picture.rgba.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_of_areas_are_exact_and_any_other_is_shown_by_its_nearest() {
        let mut rgba = [0xfd, 0xe7, 0x25, 255].repeat(1000);
        for shade in 0..600_usize {
            rgba.extend([(shade % 256) as u8, (shade / 3) as u8, 7, 255]);
        }
        let picture = Picture { size: [1600, 1], rgba };
        let mut palette = Palette::of(std::slice::from_ref(&picture));
        let (bytes, numbers) = (palette.bytes(), palette.numbers(&picture));
        assert_eq!(bytes.len(), 768);
        for (&number, wanted) in numbers.iter().zip(colours_of(&picture)) {
            assert_ne!(number, Palette::SAME);
            let shown = &bytes[3 * usize::from(number)..][..3];
            let off = shown.iter().zip(wanted).map(|(&a, b)| a.abs_diff(b)).max().expect("three");
            assert!(off <= if wanted == [0xfd, 0xe7, 0x25] { 0 } else { 24 }, "{wanted:?}: {shown:?}");
        }
    }
}
