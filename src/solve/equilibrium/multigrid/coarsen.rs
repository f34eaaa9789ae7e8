//! The coarse grid and its operator, `P' K P`, by classes.
//!
//! A row of it depends on nothing but the classes of the particles within a node's reach, so every
//! different pattern of them is a class, and its row is computed once.

use std::collections::{BTreeMap, HashMap};

use super::transfer::{Transfer, parents_of_place};
use crate::flock::block::{Block, plus};
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::solve::operator::{Columns, HELD, Matrix, Row, leads_to_outlier};

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
    let singles = Singles::new(fine, transfer);
    let mut nodes: Vec<(Site, u32)> = Vec::new();
    let across = transfer.steps[0];
    let columns = fine.columns.range();
    for column in columns.start.div_euclid(across)..=(columns.end - 1).div_euclid(across) + 1 {
        let is_single = |row: i32| singles.nodes.contains_key(&[column, row]);
        patterns.column(fine, column, is_single, |row, number| nodes.push(([column, row], number)));
    }
    let patterns = patterns.by_class;
    let mut rows: Vec<Row> = patterns.iter().map(|pattern| galerkin(fine, transfer, pattern)).collect();
    if !singles.nodes.is_empty() {
        for &node in singles.nodes.keys() {
            nodes.push((node, rows.len() as u32));
            rows.push(singles.row(node));
        }
        nodes.sort_unstable();
    }
    let columns = Columns::new(nodes.iter().map(|&(site, _)| site), |_| true);
    Matrix::compile(columns, nodes.into_iter().map(|(_, class)| class).collect(), rows)
}

/// Nodes near particles that stand at no site, whose rows are summed one by one.
struct Singles<'a> {
    fine: &'a Matrix,
    transfer: Transfer,
    /// The particles at no site that have a share in each node.
    nodes: BTreeMap<Site, Vec<(usize, f64)>>,
}

impl<'a> Singles<'a> {
    fn new(fine: &'a Matrix, transfer: Transfer) -> Self {
        let mut nodes: BTreeMap<Site, Vec<(usize, f64)>> = BTreeMap::new();
        let first = fine.outliers.first;
        for (k, &place) in fine.outliers.places.iter().enumerate() {
            if fine.class[first + k] == HELD {
                continue;
            }
            for (node, share) in parents_of_place(place, transfer.steps).into_iter().filter(|(_, s)| *s > 0.0)
            {
                nodes.entry(node).or_default().push((first + k, share));
            }
        }
        // Nodes with a share in a particle that feels one of these feel it through that.
        if !nodes.is_empty() {
            let leads: Vec<bool> = fine
                .rows
                .iter()
                .map(|row| row.entries.iter().any(|(offset, _)| leads_to_outlier(*offset)))
                .collect();
            for site in fine.columns.sites().filter(|[column, _]| *column != Body::ALONG_OUTLINE) {
                let Some((i, _)) = fine.columns.find(site) else { continue };
                if leads[fine.class[i] as usize] {
                    parents(site, transfer.steps).for_each(|node| {
                        nodes.entry(node).or_default();
                    });
                }
            }
        }
        Self { fine, transfer, nodes }
    }

    /// Shares of the nodes in a particle that stands at a site or at none.
    fn parents(&self, site: Site, i: usize) -> Vec<(Site, f64)> {
        let [across, along] = self.transfer.steps;
        match i.checked_sub(self.fine.outliers.first) {
            Some(k) => {
                let shares = parents_of_place(self.fine.outliers.places[k], self.transfer.steps);
                shares.into_iter().filter(|(_, share)| *share > 0.0).collect()
            }
            None => parents(site, self.transfer.steps)
                .map(|node| {
                    let at = [site[0] - node[0] * across, site[1] - node[1] * along];
                    (node, hat(at[0], across) * hat(at[1], along))
                })
                .collect(),
        }
    }

    /// The row of `P' K P` at a node.
    fn row(&self, node: Site) -> Row {
        let [across, along] = self.transfer.steps;
        let columns = &self.fine.columns;
        let (first, step) = (self.fine.outliers.first, columns.step());
        let near = |k: usize, step: i32| node[k] * step - step + 1..node[k] * step + step;
        let window = near(0, across).flat_map(|i| near(1, along).map(move |j| [i, j]));
        let at_sites = window.filter_map(|site| {
            let (i, _) = columns.find(site)?;
            let at = [site[0] - node[0] * across, site[1] - node[1] * along];
            Some((site, i, hat(at[0], across) * hat(at[1], along)))
        });
        let outliers = self.nodes[&node].iter();
        let outliers =
            outliers.map(|&(i, share)| ([Body::ALONG_OUTLINE, (i - first) as i32 * step], i, share));
        let mut sums: BTreeMap<Site, Block> = BTreeMap::new();
        for (site, i, share) in at_sites.chain(outliers) {
            let row = &self.fine.rows[self.fine.class[i] as usize];
            let negative = |block: &Block| block.map(|row| row.map(|value| -value));
            let entries = row.entries.iter().map(|(offset, block)| (*offset, negative(block)));
            for (offset, block) in std::iter::once(([0, 0], row.diagonal)).chain(entries) {
                let there = [site[0] + offset[0], site[1] + offset[1]];
                let Some((j, _)) = columns.find(there) else { continue };
                for (other, part) in self.parents(there, j) {
                    let sum = sums.entry([other[0] - node[0], other[1] - node[1]]).or_default();
                    *sum = plus(sum, &block.map(|row| row.map(|value| share * part * value)));
                }
            }
        }
        into_row(sums)
    }
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
    fn column(
        &mut self,
        fine: &Matrix,
        number: i32,
        is_single: impl Fn(i32) -> bool,
        mut node: impl FnMut(i32, u32),
    ) {
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
            if is_single(row) {
                before = HELD;
                continue;
            }
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
    let mut sums: BTreeMap<Site, Block> = BTreeMap::new();
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
    into_row(sums)
}

fn into_row(mut sums: BTreeMap<Site, Block>) -> Row {
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
