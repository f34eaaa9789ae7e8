//! The rows of a matrix, one after the other.
//!
//! A body that fits its outline has thousands of them on every level of multigrid: to allocate each by itself takes longer
//! than to add it up.

use super::Row;
use crate::flock::block::Block;
use crate::flock::lattice::Site;

/// One of them; what its numbers mean says [`Row`](super::Row).
#[derive(Clone, Copy, Debug)]
pub struct RowRef<'a> {
    pub diagonal: &'a Block,
    pub entries: &'a [(Site, Block)],
}

/// Rows by class.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    diagonals: Vec<Block>,
    /// Where the entries of each end.
    ends: Vec<u32>,
    entries: Vec<(Site, Block)>,
}

impl From<Vec<Row>> for Rows {
    fn from(list: Vec<Row>) -> Self {
        let mut rows = Self::default();
        list.into_iter().for_each(|row| rows.push(row.diagonal, row.entries));
        rows
    }
}

impl Rows {
    pub fn len(&self) -> usize {
        self.diagonals.len()
    }

    /// The row of a class.
    pub fn of(&self, class: u32) -> RowRef<'_> {
        let class = class as usize;
        let start = class.checked_sub(1).map_or(0, |before| self.ends[before]);
        let entries = &self.entries[start as usize..self.ends[class] as usize];
        RowRef { diagonal: &self.diagonals[class], entries }
    }

    pub fn iter(&self) -> impl ExactSizeIterator<Item = RowRef<'_>> {
        (0..self.len() as u32).map(|class| self.of(class))
    }

    pub fn push(&mut self, diagonal: Block, entries: impl IntoIterator<Item = (Site, Block)>) {
        self.entries.extend(entries);
        self.diagonals.push(diagonal);
        self.ends.push(self.entries.len() as u32);
    }

    /// Adds a row by the blocks of `K`: that at no offset is its diagonal, and the others pull.
    pub fn push_blocks(&mut self, blocks: impl IntoIterator<Item = (Site, Block)>) {
        let mut diagonal = Block::default();
        for (offset, block) in blocks {
            match offset {
                [0, 0] => diagonal = block,
                _ => self.entries.push((offset, block.map(|row| row.map(|v| -v)))),
            }
        }
        self.push(diagonal, []);
    }

    /// None yet, with memory for so many of about `entries` each.
    pub fn with_capacity(rows: usize, entries: usize) -> Self {
        Self {
            diagonals: Vec::with_capacity(rows),
            ends: Vec::with_capacity(rows),
            entries: Vec::with_capacity(rows * entries),
        }
    }

    /// All rows of these, one after the other; the first ones stay where they are if there is room.
    pub fn joined(pieces: Vec<Self>) -> Self {
        let entries: usize = pieces.iter().map(|piece| piece.entries.len()).sum();
        let mut pieces = pieces.into_iter();
        let mut all = pieces.next().unwrap_or_default();
        all.entries.reserve_exact(entries - all.entries.len());
        pieces.for_each(|piece| all.extend(&piece));
        all
    }

    /// Adds all rows of these.
    pub fn extend(&mut self, others: &Self) {
        let before = self.entries.len() as u32;
        self.diagonals.extend_from_slice(&others.diagonals);
        self.ends.extend(others.ends.iter().map(|end| before + end));
        self.entries.extend_from_slice(&others.entries);
    }

    /// Most entries of a row.
    pub fn longest(&self) -> usize {
        self.iter().map(|row| row.entries.len()).max().unwrap_or_default()
    }

    /// The blocks of all rows, to be changed.
    pub fn blocks_mut(&mut self) -> impl Iterator<Item = &mut Block> {
        self.diagonals.iter_mut().chain(self.entries.iter_mut().map(|(_, block)| block))
    }

    pub fn diagonals(&self) -> &[Block] {
        &self.diagonals
    }
}
