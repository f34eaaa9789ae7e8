//! A window of the integer grid of sites, numbered column by column from the bottom.

use super::lattice::Site;

/// Sites `low` to `low + [columns, rows] - 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Lowest column and row.
    pub low: Site,
    /// Number of columns.
    pub columns: i64,
    /// Number of rows.
    pub rows: i64,
}

impl Window {
    /// From one site to another, both included.
    pub fn new(low: Site, high: Site) -> Self {
        let [columns, rows] = [0, 1].map(|k| i64::from(high[k]) - i64::from(low[k]) + 1);
        Self { low, columns, rows }
    }

    /// How many sites it has.
    pub fn count(&self) -> u64 {
        self.columns as u64 * self.rows as u64
    }

    /// The site of a number.
    pub fn site(&self, number: usize) -> Site {
        let (column, row) = (number as i64 / self.rows, number as i64 % self.rows);
        [self.low[0] + column as i32, self.low[1] + row as i32]
    }

    /// The number of a site; `None` outside.
    pub fn number(&self, [i, j]: Site) -> Option<usize> {
        let (column, row) = (i64::from(i) - i64::from(self.low[0]), i64::from(j) - i64::from(self.low[1]));
        let inside = (0..self.columns).contains(&column) && (0..self.rows).contains(&row);
        inside.then_some((column * self.rows + row) as usize)
    }
}
