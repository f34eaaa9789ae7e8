//! The rows of a matrix, one after the other.
//!
//! A body that fits its outline has thousands of them on every level of multigrid: to allocate each by itself takes longer
//! than to add it up.

use std::sync::Arc;

use super::Row;
use crate::flock::block::Block;
use crate::flock::lattice::Site;

/// One of them; what its numbers mean says [`Row`].
#[derive(Clone, Copy, Debug)]
pub struct RowRef<'a> {
    pub diagonal: &'a Block,
    pub entries: &'a [(Site, Block)],
}

#[cfg(test)]
impl RowRef<'_> {
    pub fn to_row(self) -> Row {
        Row { diagonal: *self.diagonal, entries: self.entries.to_vec() }
    }
}

/// Rows by class.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Those that come first and are another's as well.
    shared: Option<Arc<Rows>>,
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
    /// Those of another, to which more may be added.
    pub fn sharing(rows: &Arc<Rows>) -> Self {
        Self { shared: Some(rows.clone()), ..Self::default() }
    }

    fn shared(&self) -> usize {
        self.shared.as_ref().map_or(0, |rows| rows.len())
    }

    pub fn len(&self) -> usize {
        self.shared() + self.diagonals.len()
    }

    /// The row of a class.
    pub fn of(&self, class: u32) -> RowRef<'_> {
        if let Some(rows) = self.shared.as_ref().filter(|rows| (class as usize) < rows.len()) {
            return rows.of(class);
        }
        let class = class as usize - self.shared();
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
            ..Self::default()
        }
    }

    /// All rows of these, one after the other; the first ones stay where they are if there is room.
    pub fn joined(pieces: Vec<Self>) -> Self {
        let entries: usize = pieces.iter().map(|piece| piece.entries.len()).sum();
        let mut pieces = pieces.into_iter();
        let mut all = pieces.next().unwrap_or_default();
        all.entries.reserve_exact(entries - all.entries.len());
        for piece in pieces {
            let before = all.entries.len() as u32;
            all.diagonals.extend_from_slice(&piece.diagonals);
            all.ends.extend(piece.ends.iter().map(|end| before + end));
            all.entries.extend_from_slice(&piece.entries);
        }
        all
    }
}
