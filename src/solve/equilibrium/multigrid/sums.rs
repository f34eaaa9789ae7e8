//! Blocks added up by where they lead: the rows of `P' K P` while they come into being.

use crate::flock::block::Block;
use crate::flock::lattice::Site;
use crate::solve::operator::Row;

/// Columns and rows around a node that a fresh window holds; rows of a regular lattice need no more.
const RADIUS: i32 = 3;

/// Blocks by offset. A window of all offsets that occur: looking one up is what setting up a cut outline does most.
pub struct Sums {
    radius: i32,
    /// By offset, column by column; zero where nothing was added.
    window: Vec<Block>,
    /// Places in the window that something was added to, by bits.
    used: Vec<u64>,
}

impl Default for Sums {
    fn default() -> Self {
        Self::of_radius(RADIUS)
    }
}

impl Sums {
    fn of_radius(radius: i32) -> Self {
        let size = (2 * radius as usize + 1).pow(2);
        Self { radius, window: vec![Block::default(); size], used: vec![0; size.div_ceil(64)] }
    }

    /// Adds a share of a block at an offset.
    #[inline]
    pub fn add(&mut self, offset: Site, share: f64, block: &Block) {
        let far = offset[0].abs().max(offset[1].abs());
        if far > self.radius {
            self.widen(far);
        }
        let at = ((offset[0] + self.radius) * self.width() + offset[1] + self.radius) as usize;
        self.used[at / 64] |= 1 << (at % 64);
        let sum = self.window[at].as_flattened_mut();
        sum.iter_mut().zip(block.as_flattened()).for_each(|(sum, value)| *sum += share * value);
    }

    /// Takes out what has been added up, ordered by offset, so that it does not depend on how it was summed.
    pub fn drain(&mut self) -> impl Iterator<Item = (Site, Block)> + '_ {
        let (width, radius) = (self.width(), self.radius);
        let Self { window, used, .. } = self;
        let places = used.iter_mut().enumerate().flat_map(|(word, bits)| {
            std::iter::from_fn(move || {
                let bit = bits.trailing_zeros();
                (bit < 64).then(|| {
                    *bits &= *bits - 1;
                    word * 64 + bit as usize
                })
            })
        });
        places.map(move |at| {
            let block = std::mem::take(&mut window[at]);
            ([at as i32 / width - radius, at as i32 % width - radius], block)
        })
    }

    /// The row that has been added up.
    pub fn row(&mut self) -> Row {
        let blocks = self.used.iter().map(|word| word.count_ones() as usize).sum();
        let mut row = Row { entries: Vec::with_capacity(blocks), ..Row::default() };
        for (offset, block) in self.drain().filter(|(_, block)| *block != Block::default()) {
            match offset {
                [0, 0] => row.diagonal = block,
                _ => row.entries.push((offset, block.map(|row| row.map(|v| -v)))),
            }
        }
        row
    }

    fn width(&self) -> i32 {
        2 * self.radius + 1
    }

    fn widen(&mut self, radius: i32) {
        let mut narrow = std::mem::replace(self, Self::of_radius(radius));
        narrow.drain().for_each(|(offset, block)| self.add(offset, 1.0, &block));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_added_up_by_offset_and_come_out_in_order() {
        let block = |value: f64| [[value, 0.0], [0.0, -value]];
        let mut sums = Sums::default();
        // The second time in a window that others have widened and left empty.
        for _ in 0..2 {
            for (offset, share) in
                [([0, 1], 1.0), ([9, -4], 0.5), ([0, 0], 2.0), ([0, 1], 3.0), ([-1, 2], 0.0)]
            {
                sums.add(offset, share, &block(1.0));
            }
            let row = sums.row();
            assert_eq!(row.diagonal, block(2.0));
            assert_eq!(row.entries, [([0, 1], block(-4.0)), ([9, -4], block(-0.5))]);
        }
    }
}
