//! The coarse grid and its operator, `P' K P`, by classes.
//!
//! A row of it depends on nothing but the classes of the particles within a node's reach, so every
//! different pattern of them is a class, and its row is computed once.

use std::collections::HashMap;
use std::ops::Range;

use super::sums::Sums;
use super::transfer::{Transfer, parents_of_place};
use crate::flock::block::Block;
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::solve::operator::{Columns, HELD, Matrix, Row, leads_to_outlier};

/// How much coarser the first grid is than the lattice, in particles per node.
const FIRST_RATIO: f64 = 4.0;

/// Most columns, and rows, to a node.
const MOST_STEPS: usize = 8;

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
    let most = MOST_STEPS as i32;
    let all = (1..=most).flat_map(|i| (1..=most).map(move |j| [i, j])).filter(|&[i, j]| i * j > 1);
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
    let parents = Parents::new(transfer.steps);
    let mut patterns = Patterns::new(transfer);
    let mut singles = Singles::new(fine, parents);
    let mut nodes: Vec<(Site, u32)> = Vec::new();
    let across = transfer.steps[0];
    let columns = fine.columns.range();
    let mut left = singles.nodes.iter().peekable();
    for column in columns.start.div_euclid(across)..=(columns.end - 1).div_euclid(across) + 1 {
        // Nodes are asked about in their order.
        let is_single = |row: i32| {
            while left.next_if(|(node, _)| *node < [column, row]).is_some() {}
            left.peek().is_some_and(|(node, _)| *node == [column, row])
        };
        patterns.column(fine, column, is_single, |row, number| nodes.push(([column, row], number)));
    }
    let mut sums = Sums::default();
    let patterns = patterns.by_class;
    let mut rows: Vec<Row> =
        patterns.iter().map(|pattern| galerkin(fine, &parents, pattern, &mut sums)).collect();
    if !singles.nodes.is_empty() {
        for (node, outliers) in std::mem::take(&mut singles.nodes) {
            nodes.push((node, rows.len() as u32));
            rows.push(singles.row(node, outliers, &mut sums));
        }
        nodes.sort_unstable();
    }
    let columns = Columns::new(nodes.iter().map(|&(site, _)| site), |_| true);
    Matrix::compile(columns, nodes.into_iter().map(|(_, class)| class).collect(), rows)
}

/// Nodes near particles that stand at no site, whose rows are summed one by one.
struct Singles<'a> {
    fine: &'a Matrix,
    parents: Parents,
    /// Nodes with a share in each particle at no site, shape \[outliers\].
    of_outliers: Vec<[(Site, f64); 4]>,
    /// Their sites, ascending, and where the particles at no site that have a share in each lie in `shares`.
    nodes: Vec<(Site, Range<usize>)>,
    shares: Vec<(usize, f64)>,
    /// Rows of `K P` by nodes, each computed when it is first asked for: up to four nodes have a share in one.
    halves: Vec<(Site, Block)>,
    /// Where that of each particle lies, shape \[count\].
    half: Vec<Range<u32>>,
    /// The one that is being summed.
    sums: Sums,
}

impl<'a> Singles<'a> {
    fn new(fine: &'a Matrix, parents: Parents) -> Self {
        let of_outlier = |&place: &[f64; 2]| parents_of_place(place, parents.steps);
        let of_outliers: Vec<_> = fine.outliers.places.iter().map(of_outlier).collect();
        let (mut nodes, mut shares, mut half) = (Vec::new(), Vec::new(), Vec::new());
        if !fine.outliers.places.is_empty() {
            half.resize(fine.count(), 0..0);
            let mut found: Vec<(Site, Option<usize>, f64)> = Vec::new();
            let leads = |row: &Row| row.entries.iter().any(|(offset, _)| leads_to_outlier(*offset));
            let leads: Vec<bool> = fine.rows.iter().map(leads).collect();
            for (column, segment) in fine.columns.iter() {
                for k in 0..segment.len as i32 {
                    let i = segment.start as usize + k as usize;
                    let site = [column, segment.row + fine.columns.step() * k];
                    match i.checked_sub(fine.outliers.first) {
                        Some(outlier) => {
                            let nodes = of_outliers[outlier].into_iter().filter(|(_, share)| *share > 0.0);
                            found.extend(nodes.map(|(node, share)| (node, Some(i), share)));
                        }
                        // Nodes with a share in a particle that feels one of these feel it through that.
                        None if leads[fine.class[i] as usize] => {
                            parents.each(site, 1.0, |node, _| found.push((node, None, 0.0)));
                        }
                        None => {}
                    }
                }
            }
            found.sort_unstable_by_key(|&(node, particle, _)| (node, particle));
            for of_node in found.chunk_by(|a, b| a.0 == b.0) {
                let begin = shares.len();
                shares.extend(of_node.iter().filter_map(|&(_, particle, share)| Some((particle?, share))));
                nodes.push((of_node[0].0, begin..shares.len()));
            }
        }
        let (halves, sums) = (Vec::new(), Sums::default());
        Self { fine, parents, of_outliers, nodes, shares, halves, half, sums }
    }

    /// The row of `P' K P` at a node.
    fn row(&mut self, node: Site, outliers: Range<usize>, sums: &mut Sums) -> Row {
        let [across, along] = self.parents.steps;
        let (first, step) = (self.fine.outliers.first, self.fine.columns.step());
        let near = |k: usize, step: i32| node[k] * step - step + 1..node[k] * step + step;
        for column in near(0, across) {
            for row in near(1, along) {
                let Some((i, _)) = self.fine.columns.find([column, row]) else { continue };
                let hat = |axis: usize, at: i32| self.parents.hat(axis, at);
                let share = hat(0, column - node[0] * across) * hat(1, row - node[1] * along);
                self.add_half(node, [column, row], (i, share), sums);
            }
        }
        for at in outliers {
            let (i, share) = self.shares[at];
            self.add_half(node, [Body::ALONG_OUTLINE, (i - first) as i32 * step], (i, share), sums);
        }
        sums.row()
    }

    /// Adds a particle's row of `K P` by offsets from a node that has a share in it.
    fn add_half(&mut self, node: Site, site: Site, (i, share): (usize, f64), sums: &mut Sums) {
        if self.half[i].is_empty() {
            self.find_half(node, site, i);
        }
        let Range { start, end } = self.half[i];
        for (other, block) in &self.halves[start as usize..end as usize] {
            sums.add([other[0] - node[0], other[1] - node[1]], share, block);
        }
    }

    /// Computes a particle's row of `K P`, summed by offsets from a node close to it.
    fn find_half(&mut self, near: Site, site: Site, i: usize) {
        let mut half = std::mem::take(&mut self.sums);
        let row = &self.fine.rows[self.fine.class[i] as usize];
        self.add_parents(near, site, (1.0, &row.diagonal), &mut half);
        for (offset, block) in &row.entries {
            self.add_parents(near, [site[0] + offset[0], site[1] + offset[1]], (-1.0, block), &mut half);
        }
        let begin = self.halves.len();
        let absolute = |(offset, block): (Site, Block)| ([offset[0] + near[0], offset[1] + near[1]], block);
        self.halves.extend(half.drain().map(absolute));
        self.half[i] = begin as u32..self.halves.len() as u32;
        self.sums = half;
    }

    /// Adds a block by the nodes that have a share in the particle at a site, as offsets from one of them.
    fn add_parents(&self, near: Site, site: Site, (sign, block): (f64, &Block), sums: &mut Sums) {
        let offset = |node: Site| [node[0] - near[0], node[1] - near[1]];
        if site[0] != Body::ALONG_OUTLINE {
            return self.parents.each(site, sign, |node, share| sums.add(offset(node), share, block));
        }
        let nodes = &self.of_outliers[(site[1] / self.fine.columns.step()) as usize];
        for &(node, share) in nodes.iter().filter(|(_, share)| *share > 0.0) {
            sums.add(offset(node), sign * share, block);
        }
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
        mut is_single: impl FnMut(i32) -> bool,
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
fn galerkin(fine: &Matrix, parents: &Parents, pattern: &[u32], sums: &mut Sums) -> Row {
    let [across, along] = parents.steps;
    let reach = 2 * along - 1;
    for (k, &class) in pattern.iter().enumerate().filter(|(_, class)| **class != HELD) {
        let own = [k as i32 / reach - across + 1, k as i32 % reach - along + 1];
        let share = parents.hat(0, own[0]) * parents.hat(1, own[1]);
        let row = &fine.rows[class as usize];
        let entries = row.entries.iter().map(|(offset, block)| (*offset, block, -share));
        for (offset, block, share) in std::iter::once(([0, 0], &row.diagonal, share)).chain(entries) {
            let there = [own[0] + offset[0], own[1] + offset[1]];
            parents.each(there, share, |node, share| sums.add(node, share, block));
        }
    }
    sums.row()
}

/// The nodes that have a share in a site of the fine grid, by columns and by rows.
#[derive(Clone, Copy)]
struct Parents {
    steps: [i32; 2],
    /// Share of a node in what lies this many columns, and rows, away.
    hats: [[f64; MOST_STEPS + 1]; 2],
}

impl Parents {
    fn new(steps: [i32; 2]) -> Self {
        let hat = |step: i32, at: usize| (1.0 - at as f64 / f64::from(step)).max(0.0);
        Self { steps, hats: steps.map(|step| std::array::from_fn(|at| hat(step, at))) }
    }

    /// Share of a node in what lies this far away along an axis.
    fn hat(&self, axis: usize, at: i32) -> f64 {
        self.hats[axis][at.unsigned_abs() as usize]
    }

    /// The one or two nodes around a column, or a row, with their shares; the second may have none.
    fn along(&self, axis: usize, at: i32) -> [(i32, f64); 2] {
        let step = self.steps[axis];
        let node = at.div_euclid(step);
        let beyond = at - node * step;
        [(node, self.hat(axis, beyond)), (node + 1, self.hat(axis, step - beyond))]
    }

    /// Hands out the nodes with a share in a site, each with `weight` times its share.
    fn each(&self, site: Site, weight: f64, mut take: impl FnMut(Site, f64)) {
        let rows = self.along(1, site[1]);
        for (column, share) in self.along(0, site[0]).into_iter().filter(|(_, share)| *share > 0.0) {
            for (row, other) in rows.into_iter().filter(|(_, share)| *share > 0.0) {
                take([column, row], weight * share * other);
            }
        }
    }
}
