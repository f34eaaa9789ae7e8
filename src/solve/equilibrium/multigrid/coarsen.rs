//! The coarse grid and its operator, `P' K P`, by classes.
//!
//! A row of it depends on nothing but the classes of the particles within a node's reach, so every
//! different pattern of them is a class, and its row is computed once.

use std::collections::HashMap;

use super::transfer::Transfer;
use crate::flock::block::{Block, plus};
use crate::flock::lattice::Site;
use crate::solve::operator::{Columns, HELD, Matrix, Row};

/// How much coarser the first grid is than the lattice, in particles per node.
const FIRST_RATIO: f64 = 4.0;

/// Columns and rows to a node of the first coarse grid: about four particles each, the nodes about as far
/// apart both ways. `grid` are the vectors of one column and one row \[length\].
pub fn first_steps(grid: [[f64; 2]; 2], particles_per_site: f64) -> [i32; 2] {
    let length = |v: [f64; 2]| v[0].hypot(v[1]);
    let spacing = grid.map(length);
    let cost = |[i, j]: [i32; 2]| {
        let ratio = f64::from(i * j) * particles_per_site / FIRST_RATIO;
        let aspect = f64::from(i) * spacing[0] / (f64::from(j) * spacing[1]);
        // A grid that is too coarse costs iterations, one that is too fine costs memory.
        ratio.ln().abs() + 1.5 * aspect.ln().abs()
    };
    let all = (1..=8).flat_map(|i| (1..=8).map(move |j| [i, j])).filter(|&[i, j]| i * j > 1);
    all.min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or([2, 2])
}

/// Columns and rows to a node of the next coarser grid: two each way, but only along the denser direction
/// where nodes lie farther apart along the other. `spacing` is that of the present nodes \[length\].
pub fn next_steps(spacing: [f64; 2]) -> [i32; 2] {
    let aspect = spacing[0] / spacing[1];
    if aspect > 1.6 {
        [1, 2]
    } else if aspect < 1.0 / 1.6 {
        [2, 1]
    } else {
        [2, 2]
    }
}

/// The matrix of the coarse grid.
pub fn coarsen(fine: &Matrix, transfer: Transfer) -> Matrix {
    let mut patterns = Patterns::new(transfer);
    let (mut sites, mut class) = (Vec::new(), Vec::new());
    let across = transfer.steps[0];
    let columns = fine.columns.range();
    for column in columns.start.div_euclid(across)..=(columns.end - 1).div_euclid(across) + 1 {
        patterns.column(fine, column, |row, number| {
            sites.push([column, row]);
            class.push(number);
        });
    }
    let rows = patterns.by_class.iter().map(|pattern| galerkin(fine, transfer, pattern)).collect();
    let columns = Columns::new(sites.iter().copied(), |_| true);
    Matrix::compile(columns, class, rows)
}

/// The different surroundings of nodes: classes of the fine particles within reach, column by column.
struct Patterns {
    transfer: Transfer,
    known: HashMap<Vec<u32>, u32>,
    by_class: Vec<Vec<u32>>,
    /// Classes of the fine columns within reach of a coarse one, row by row.
    around: Vec<Vec<u32>>,
}

impl Patterns {
    fn new(transfer: Transfer) -> Self {
        let width = 2 * transfer.steps[0] as usize - 1;
        Self { transfer, known: HashMap::new(), by_class: Vec::new(), around: vec![Vec::new(); width] }
    }

    /// Hands out the row and the class of each node of a coarse column.
    fn column(&mut self, fine: &Matrix, number: i32, mut node: impl FnMut(i32, u32)) {
        let [across, along] = self.transfer.steps;
        let within = number * across - across + 1..number * across + across;
        let bounds = within.clone().filter_map(|i| fine.columns.rows_of(i));
        let Some([low, high]) = bounds.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else { return };
        let (first, last) = (low.div_euclid(along), (high - 1).div_euclid(along) + 1);
        let floor = first * along - along + 1;
        let len = ((last - first + 2) * along - 1) as usize;
        for (rows, i) in self.around.iter_mut().zip(within) {
            rows.clear();
            rows.resize(len, HELD);
            for segment in fine.columns.of(i) {
                let classes = &fine.class[segment.start as usize..][..segment.len as usize];
                let rows = rows[(segment.row - floor) as usize..].iter_mut();
                rows.step_by(fine.columns.step() as usize).zip(classes).for_each(|(to, &class)| *to = class);
            }
        }
        let reach = 2 * along as usize - 1;
        let (mut pattern, mut before) = (Vec::new(), HELD);
        for row in first..=last {
            let at = ((row - first) * along) as usize;
            let alike = before != HELD && {
                let known = self.by_class[before as usize].chunks_exact(reach);
                self.around.iter().zip(known).all(|(rows, known)| &rows[at..at + reach] == known)
            };
            if !alike {
                pattern.clear();
                self.around.iter().for_each(|rows| pattern.extend(&rows[at..at + reach]));
                if pattern.iter().all(|&class| class == HELD) {
                    before = HELD;
                    continue;
                }
                before = match self.known.get(&pattern) {
                    Some(&class) => class,
                    None => {
                        self.by_class.push(pattern.clone());
                        self.known.insert(pattern.clone(), self.by_class.len() as u32 - 1);
                        self.by_class.len() as u32 - 1
                    }
                };
            }
            node(row, before);
        }
    }
}

/// The row of `P' K P` at a node with these surroundings.
fn galerkin(fine: &Matrix, transfer: Transfer, pattern: &[u32]) -> Row {
    let [across, along] = transfer.steps;
    let reach = 2 * along - 1;
    // Ordered by offset, so that the row does not depend on how it was summed.
    let mut sums: std::collections::BTreeMap<Site, Block> = std::collections::BTreeMap::new();
    for (k, &class) in pattern.iter().enumerate().filter(|(_, class)| **class != HELD) {
        let own = [k as i32 / reach - across + 1, k as i32 % reach - along + 1];
        let share = hat(own[0], across) * hat(own[1], along);
        let row = &fine.rows[class as usize];
        let negative = |block: &Block| block.map(|row| row.map(|value| -value));
        let entries = row.entries.iter().map(|(offset, block)| (*offset, negative(block)));
        for (offset, block) in std::iter::once(([0, 0], row.diagonal)).chain(entries) {
            let there = [own[0] + offset[0], own[1] + offset[1]];
            for node in parents(there, transfer.steps) {
                let at = [there[0] - node[0] * across, there[1] - node[1] * along];
                let weight = share * hat(at[0], across) * hat(at[1], along);
                let sum = sums.entry(node).or_default();
                *sum = plus(sum, &block.map(|row| row.map(|value| weight * value)));
            }
        }
    }
    let diagonal = sums.remove(&[0, 0]).unwrap_or_default();
    let entries = sums.into_iter().map(|(offset, block)| (offset, block.map(|row| row.map(|v| -v))));
    Row { diagonal, entries: entries.filter(|(_, block)| *block != Block::default()).collect() }
}

/// Value at `at` of the piecewise linear function that is 1 at 0 and 0 from `step` on.
fn hat(at: i32, step: i32) -> f64 {
    1.0 - f64::from(at.abs()) / f64::from(step)
}

/// The nodes that have a share in a place of the fine grid.
fn parents([i, j]: Site, [across, along]: [i32; 2]) -> impl Iterator<Item = Site> {
    let near = |at: i32, step: i32| {
        let node = at.div_euclid(step);
        node..=node + i32::from(at.rem_euclid(step) > 0)
    };
    near(i, across).flat_map(move |column| near(j, along).map(move |row| [column, row]))
}
