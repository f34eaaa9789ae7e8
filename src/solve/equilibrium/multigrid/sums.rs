//! Blocks added up by where they lead: the rows of `P' K P` while they come into being.

use crate::flock::block::Block;
use crate::flock::lattice::Site;

/// Columns and rows around a node that a fresh window holds; most rows need no more.
const RADIUS: i32 = 2;

/// Blocks by offset. A window of all offsets that occur: looking one up is what setting up a cut outline does most.
pub struct Sums {
    radius: i32,
    /// By offset, column by column; zero where nothing was added.
    window: Vec<Block>,
}

impl Default for Sums {
    fn default() -> Self {
        Self::of_radius(RADIUS)
    }
}

impl Sums {
    fn of_radius(radius: i32) -> Self {
        Self { radius, window: vec![Block::default(); (2 * radius as usize + 1).pow(2)] }
    }

    /// Adds a share of a block at an offset.
    #[inline]
    pub fn add(&mut self, offset: Site, share: f64, block: &Block) {
        let at = self.at(offset, offset[0].abs().max(offset[1].abs()));
        add(&mut self.window[at], share, block);
    }

    /// Adds shares of a block at an offset, one row on, one column on and one of both on.
    #[inline(always)]
    pub fn add_around(&mut self, offset: Site, shares: [f64; 4], block: &Block) {
        let far = |at: i32| (-at).max(at + 1);
        let at = self.at(offset, far(offset[0]).max(far(offset[1])));
        let width = self.width() as usize;
        let (column, next) = self.window[at..at + width + 2].split_at_mut(width);
        // Most sites lie in a line with nodes, and those that are asked for one after the other in the same turn.
        for (share, sum) in shares.into_iter().zip(column[..2].iter_mut().chain(next)) {
            if share != 0.0 {
                add(sum, share, block);
            }
        }
    }

    /// Takes out what has been added up and is not zero, ordered by offset, so that it does not depend on how it was summed.
    pub fn drain(&mut self) -> impl Iterator<Item = (Site, Block)> + '_ {
        let (width, radius) = (self.width() as usize, self.radius);
        let columns = (-radius..).zip(self.window.chunks_exact_mut(width));
        columns.flat_map(move |(column, blocks)| {
            let added = (-radius..).zip(blocks).filter(|(_, block)| !is_zero(block));
            added.map(move |(row, block)| ([column, row], std::mem::take(block)))
        })
    }

    /// Where an offset lies in the window, which reaches `far` at least.
    #[inline]
    fn at(&mut self, offset: Site, far: i32) -> usize {
        if far > self.radius {
            self.widen(far);
        }
        ((offset[0] + self.radius) * self.width() + offset[1] + self.radius) as usize
    }

    fn width(&self) -> i32 {
        2 * self.radius + 1
    }

    #[cold]
    fn widen(&mut self, radius: i32) {
        let mut narrow = std::mem::replace(self, Self::of_radius(radius));
        narrow.drain().for_each(|(offset, block)| self.add(offset, 1.0, &block));
    }
}

/// Adds a share of a block to another.
#[inline(always)]
pub fn add(sum: &mut Block, share: f64, block: &Block) {
    sum.as_flattened_mut()
        .iter_mut()
        .zip(block.as_flattened())
        .for_each(|(sum, value)| *sum += share * value);
}

/// Looks at all four entries, which is faster than to leave at the first.
fn is_zero(block: &Block) -> bool {
    block.as_flattened().iter().fold(true, |zero, value| zero & (*value == 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::operator::Rows;

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
            let mut rows = Rows::default();
            rows.push_blocks(sums.drain());
            let row = rows.of(0);
            assert_eq!(*row.diagonal, block(2.0));
            assert_eq!(row.entries, [([0, 1], block(-4.0)), ([9, -4], block(-0.5))]);
        }
    }
}
