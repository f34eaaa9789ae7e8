//! Blocks added up by where they lead: the rows of `P' K P` while they come into being.

use crate::flock::block::{Block, plus};
use crate::flock::lattice::Site;
use crate::solve::operator::Row;

/// Columns and rows around a node that a fresh window holds; rows of a regular lattice need no more.
const RADIUS: i32 = 3;

/// Blocks by offset. A window of all offsets that occur: looking one up is what setting up a cut outline does most.
pub struct Sums {
    radius: i32,
    /// By offset, column by column; zero where nothing was added.
    window: Vec<Block>,
    is_used: Vec<bool>,
    /// Places in the window that are used, in the order of their first addition.
    used: Vec<u32>,
}

impl Default for Sums {
    fn default() -> Self {
        let size = (2 * RADIUS as usize + 1).pow(2);
        Self {
            radius: RADIUS,
            window: vec![Block::default(); size],
            is_used: vec![false; size],
            used: Vec::new(),
        }
    }
}

impl Sums {
    /// Adds a share of a block at an offset.
    pub fn add(&mut self, offset: Site, share: f64, block: &Block) {
        let far = offset[0].abs().max(offset[1].abs());
        if far > self.radius {
            self.widen(far);
        }
        let at = ((offset[0] + self.radius) * self.width() + offset[1] + self.radius) as usize;
        let block = block.map(|row| row.map(|value| share * value));
        if std::mem::replace(&mut self.is_used[at], true) {
            self.window[at] = plus(&self.window[at], &block);
        } else {
            self.used.push(at as u32);
            self.window[at] = block;
        }
    }

    /// Takes out what has been added up, ordered by offset, so that it does not depend on how it was summed.
    pub fn drain(&mut self) -> impl Iterator<Item = (Site, Block)> + '_ {
        let (width, radius) = (self.width(), self.radius);
        let Self { window, is_used, used, .. } = self;
        used.sort_unstable();
        used.drain(..).map(move |at| {
            is_used[at as usize] = false;
            ([at as i32 / width - radius, at as i32 % width - radius], window[at as usize])
        })
    }

    /// The row that has been added up.
    pub fn row(&mut self) -> Row {
        let mut row = Row::default();
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
        let known: Vec<(Site, Block)> = self.drain().collect();
        self.radius = radius;
        let size = (self.width() as usize).pow(2);
        (self.window, self.is_used) = (vec![Block::default(); size], vec![false; size]);
        known.into_iter().for_each(|(offset, block)| self.add(offset, 1.0, &block));
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
