//! The coarse grid and its operator, `P' K P`, by classes.
//!
//! A row of it depends on nothing but the classes of the particles within a node's reach, so every
//! different pattern of them is a class, and its row is computed once.

use std::collections::HashMap;
use std::ops::Range;

use super::descent::MOST_STEPS;
use super::sums::Sums;
use super::transfer::{OutlierShares, Transfer, parents_of_place};
use crate::flock::block::Block;
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::solve::equilibrium::steps::in_pieces;
use crate::solve::operator::{Columns, HELD, Matrix, Outliers, RowRef, Rows, leads_to_outlier, name_of};

/// Fewest rows of a coarse grid that a thread sums: what two threads share of their surroundings each computes for itself.
const PIECE: usize = 64;

/// About how many others a node feels; more of memory that is not written to costs nothing.
const NEIGHBOURS: usize = 16;

/// The matrix of the coarse grid, and the shares of particles at no site in its nodes.
pub fn coarsen(fine: &Matrix, transfer: Transfer) -> (Matrix, OutlierShares) {
    let of_outliers = OutlierParents::new(fine, transfer.steps);
    let columns = columns_of_nodes(fine.columns.range(), transfer, &fine.outliers);
    let Matrix { columns, class, rows, .. } = nodes_of(fine, transfer, &of_outliers, columns);
    let coarse = Matrix::compile(columns, class, rows);
    let shares = of_outliers.shares(&coarse.columns);
    (coarse, shares)
}

/// The shares of particles at no site in the nodes of a coarse grid, as far as either are here.
pub fn outlier_shares(fine: &Matrix, transfer: Transfer, coarse: &Matrix) -> OutlierShares {
    OutlierParents::new(fine, transfer.steps).shares(&coarse.columns)
}

/// Some columns of the coarse grid, not compiled, with what they need of the fine one at hand.
pub fn coarsen_columns(fine: &Matrix, transfer: Transfer, columns: Range<i32>) -> Matrix {
    nodes_of(fine, transfer, &OutlierParents::new(fine, transfer.steps), columns)
}

/// Rows of a column from one node to the next.
pub const STEP: i32 = 1;

/// The columns in which nodes may stand that particles of these fine ones have a share in.
pub fn columns_of_nodes(fine: Range<i32>, transfer: Transfer, outliers: &Outliers) -> Range<i32> {
    if fine.is_empty() { 0..0 } else { transfer.columns_above(&fine, outliers) }
}

/// First word of the names of rows that are of one node each.
const SINGLE: u64 = u64::MAX;

fn nodes_of(fine: &Matrix, transfer: Transfer, of_outliers: &OutlierParents, columns: Range<i32>) -> Matrix {
    let parents = Parents::new(transfer.steps);
    let mut patterns = Patterns::new(fine, transfer);
    let mut nodes: Vec<(Site, u32)> = Vec::new();
    // Nodes whose rows are summed one by one, and the particles at no site that have a share in each.
    let mut singles: Vec<(Site, &[Child])> = of_outliers
        .children
        .chunk_by(|a, b| a.node == b.node)
        .map(|of_node| (of_node[0].node, of_node))
        .filter(|([column, _], _)| columns.contains(column))
        .collect();
    let mut beside = Vec::new();
    let mut left = singles.iter().peekable();
    for column in columns {
        // Nodes are asked about in their order.
        let has_outlier = |row: i32| {
            while left.next_if(|(node, _)| *node < [column, row]).is_some() {}
            left.peek().is_some_and(|(node, _)| *node == [column, row])
        };
        patterns.column(fine, column, has_outlier, |row, class| match class {
            Some(class) => nodes.push(([column, row], class)),
            None => beside.push(([column, row], &[][..])),
        });
    }
    singles.extend(beside);
    // Neighbours share halves: those that are summed one after the other are to lie side by side.
    singles.sort_by_key(|(node, _)| *node);
    let patterns: Vec<&[u32]> = patterns.iter().collect();
    // Those along an outline are most of the rows: the others come after them.
    nodes.iter_mut().for_each(|(_, class)| *class += singles.len() as u32);
    nodes.extend(singles.iter().zip(0..).map(|((node, _), class)| (*node, class)));
    let mut pieces = in_pieces(&singles, PIECE, |singles| {
        let (mut rows, mut sums) = (Rows::with_capacity(singles.len(), NEIGHBOURS), Sums::default());
        let mut halves = Halves::new(fine, &parents, of_outliers);
        for (node, of_node) in singles {
            halves.add_row(*node, of_node, &mut sums);
            rows.push_blocks(sums.drain());
        }
        rows
    });
    pieces.extend(rows_of(fine, &parents, &patterns));
    // Of the rows of a grid that one rank has whole nothing is asked by name.
    let names = match fine.names.is_empty() {
        true => Vec::new(),
        false => {
            let name = |class: &u32| fine.names.get(*class as usize).copied().unwrap_or_default();
            let of_pattern = |pattern: &&[u32]| name_of(pattern.iter().flat_map(name));
            let of_single = |(node, _): &(Site, &[Child])| {
                name_of([SINGLE].into_iter().chain(node.map(|at| i64::from(at) as u64)))
            };
            singles.iter().map(of_single).chain(patterns.iter().map(of_pattern)).collect()
        }
    };
    // Ascending lists one after the other, which a stable sort joins.
    nodes.sort();
    let columns = Columns::with_step(STEP, nodes.iter().map(|&(site, _)| site));
    let class = nodes.into_iter().map(|(_, class)| class).collect();
    Matrix::uncompiled(columns, class, (Rows::joined(pieces), names))
}

/// The rows of nodes with these surroundings, piece by piece.
fn rows_of(fine: &Matrix, parents: &Parents, patterns: &[&[u32]]) -> Vec<Rows> {
    in_pieces(patterns, PIECE, |patterns| {
        let (mut rows, mut sums) = (Rows::with_capacity(patterns.len(), NEIGHBOURS), Sums::default());
        for pattern in patterns {
            galerkin(fine, parents, pattern, &mut sums);
            rows.push_blocks(sums.drain());
        }
        rows
    })
}

/// The nodes around the particles that stand at no site.
struct OutlierParents {
    /// Nodes and shares, by the rows of these particles in their column.
    nodes: Vec<[(Site, f64); 4]>,
    /// The same by nodes, of those that follow here, ascending.
    children: Vec<Child>,
}

/// Share of a node in a particle that stands at no site.
#[derive(Clone, Copy)]
struct Child {
    node: Site,
    particle: usize,
    /// Of the particle in its column.
    row: i32,
    share: f64,
}

impl OutlierParents {
    fn new(fine: &Matrix, steps: [i32; 2]) -> Self {
        let places = fine.outliers.places().iter();
        let nodes: Vec<_> = places.map(|&place| parents_of_place(place, steps)).collect();
        let all = fine.columns.along().flat_map(|(row, particle)| {
            nodes[row as usize].iter().map(move |&(node, share)| Child { node, particle, row, share })
        });
        let mut children: Vec<Child> = all.filter(|child| child.share > 0.0).collect();
        children.sort_unstable_by_key(|child| (child.node, child.particle));
        Self { nodes, children }
    }

    /// The same by the indices of the nodes that are here.
    fn shares(&self, nodes: &Columns) -> OutlierShares {
        let share = |&Child { node, particle, share, .. }: &Child| {
            nodes.find(node).map(|(node, _)| (node as u32, particle as u32, share as f32))
        };
        OutlierShares::new(self.children.iter().filter_map(share).collect())
    }
}

/// Where a particle's row of `K P` lies.
#[derive(Clone, Copy, Default)]
struct Half {
    /// Coarse column in which it was asked for.
    column: i32,
    start: u32,
    len: u32,
}

/// Which of two lists is a column's.
fn parity(column: i32) -> usize {
    column.rem_euclid(2) as usize
}

/// Rows of `K P`, each computed when it is first asked for: up to four nodes have a share in a particle.
struct Halves<'a> {
    fine: &'a Matrix,
    parents: &'a Parents,
    of_outliers: &'a OutlierParents,
    /// Rows one after the other, by nodes: those that were asked for in this coarse column, and in the one before, lie in turn
    /// in either list. Later ones do not ask for them again, or if they do they are computed anew.
    lists: [Vec<(Site, Block)>; 2],
    /// Where that of each particle lies, shape \[count\].
    of_particle: Vec<Half>,
    /// The column that is being summed.
    column: i32,
    /// The one that is being summed.
    sums: Sums,
}

impl<'a> Halves<'a> {
    fn new(fine: &'a Matrix, parents: &'a Parents, of_outliers: &'a OutlierParents) -> Self {
        Self {
            fine,
            parents,
            of_outliers,
            lists: Default::default(),
            of_particle: vec![Half::default(); fine.count()],
            column: i32::MIN,
            sums: Sums::default(),
        }
    }

    /// Adds up the row of `P' K P` at a node.
    fn add_row(&mut self, node: Site, outliers: &[Child], sums: &mut Sums) {
        if self.column != node[0] {
            self.column = node[0];
            self.lists[parity(node[0])].clear();
        }
        let [across, along] = self.parents.steps;
        let near = |k: usize, step: i32| node[k] * step - step + 1..node[k] * step + step;
        for column in near(0, across) {
            for row in near(1, along) {
                let Some((i, _)) = self.fine.columns.find([column, row]) else { continue };
                let hat = |axis: usize, at: i32| self.parents.hat(axis, at);
                let share = hat(0, column - node[0] * across) * hat(1, row - node[1] * along);
                self.add_half(node, [column, row], (i, share), sums);
            }
        }
        for &Child { particle, row, share, .. } in outliers {
            self.add_half(node, [Body::ALONG_OUTLINE, row], (particle, share), sums);
        }
    }

    /// Adds a particle's row of `K P` by offsets from a node that has a share in it.
    fn add_half(&mut self, node: Site, site: Site, (i, share): (usize, f64), sums: &mut Sums) {
        let mut half = self.of_particle[i];
        if half.len == 0 || half.column < self.column - 1 {
            half = self.find(node, site, i);
            self.of_particle[i] = half;
        }
        let Half { column, start, len } = half;
        for (other, block) in &self.lists[parity(column)][start as usize..][..len as usize] {
            sums.add([other[0] - node[0], other[1] - node[1]], share, block);
        }
    }

    /// Computes a particle's row of `K P`, summed by offsets from a node close to it.
    fn find(&mut self, near: Site, site: Site, i: usize) -> Half {
        let row = self.fine.rows.of(self.fine.class[i]);
        self.add_parents(near, site, (1.0, row.diagonal));
        for (offset, block) in row.entries {
            self.add_parents(near, [site[0] + offset[0], site[1] + offset[1]], (-1.0, block));
        }
        let list = &mut self.lists[parity(self.column)];
        let start = list.len() as u32;
        let absolute = |(offset, block): (Site, Block)| ([offset[0] + near[0], offset[1] + near[1]], block);
        list.extend(self.sums.drain().map(absolute));
        Half { column: self.column, start, len: list.len() as u32 - start }
    }

    /// Adds a block by the nodes that have a share in the particle at a site, as offsets from one of them.
    fn add_parents(&mut self, near: Site, site: Site, (sign, block): (f64, &Block)) {
        let sums = &mut self.sums;
        if site[0] != Body::ALONG_OUTLINE {
            let steps = self.parents.steps;
            let from_near = [0, 1].map(|axis| site[axis] - near[axis] * steps[axis]);
            let (node, shares) = self.parents.around(from_near, sign);
            return sums.add_around(node, shares, block);
        }
        let nodes = &self.of_outliers.nodes[site[1] as usize];
        let first = nodes[0].0;
        sums.add_around(
            [first[0] - near[0], first[1] - near[1]],
            nodes.map(|(_, share)| sign * share),
            block,
        );
    }
}

/// The different surroundings of nodes: classes of the fine particles within reach, column by column.
struct Patterns {
    transfer: Transfer,
    known: HashMap<Vec<u32>, u32>,
    /// One after the other.
    all: Vec<u32>,
    /// Classes of the fine columns within reach of a coarse one, row by row.
    around: Vec<Vec<u32>>,
    /// Of each row of the fine matrix, whether it leads to a particle at no site; empty where there is none.
    leads: Vec<bool>,
}

impl Patterns {
    fn new(fine: &Matrix, transfer: Transfer) -> Self {
        let width = 2 * transfer.steps[0] as usize - 1;
        let leads = |row: RowRef<'_>| row.entries.iter().any(|(offset, _)| leads_to_outlier(*offset));
        let rows = if fine.outliers.is_empty() { 0 } else { fine.rows.len() };
        Self {
            transfer,
            known: HashMap::new(),
            all: Vec::new(),
            around: vec![Vec::new(); width],
            leads: fine.rows.iter().take(rows).map(leads).collect(),
        }
    }

    /// Particles within reach of a node.
    fn size(&self) -> usize {
        self.around.len() * (2 * self.transfer.steps[1] as usize - 1)
    }

    /// The patterns by class.
    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.all.chunks_exact(self.size())
    }

    /// Hands out the row and the class of each node of a coarse column; none of those that feel a particle at no site
    /// through others. Nodes for which `has_outlier` holds are left out.
    fn column(
        &mut self,
        fine: &Matrix,
        number: i32,
        mut has_outlier: impl FnMut(i32) -> bool,
        mut node: impl FnMut(i32, Option<u32>),
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
        let size = self.size();
        let (mut pattern, mut before) = (Vec::with_capacity(size), HELD);
        for row in first..=last {
            if has_outlier(row) {
                before = HELD;
                continue;
            }
            let at = ((row - first) * along) as usize;
            let alike = before != HELD && {
                let known = self.all[before as usize * size..].chunks_exact(reach);
                self.around.iter().zip(known).all(|(rows, known)| &rows[at..at + reach] == known)
            };
            if !alike {
                pattern.clear();
                self.around.iter().for_each(|rows| pattern.extend(&rows[at..at + reach]));
                before = HELD;
                if pattern.iter().all(|&class| class == HELD) {
                    continue;
                }
                if pattern.iter().any(|&class| self.leads.get(class as usize) == Some(&true)) {
                    node(row, None);
                    continue;
                }
                before = match self.known.get(&pattern) {
                    Some(&class) => class,
                    None => {
                        let class = self.known.len() as u32;
                        self.all.extend(&pattern);
                        self.known.insert(pattern.clone(), class);
                        class
                    }
                };
            }
            node(row, Some(before));
        }
    }
}

/// Adds up the row of `P' K P` at a node with these surroundings.
fn galerkin(fine: &Matrix, parents: &Parents, pattern: &[u32], sums: &mut Sums) {
    let [across, along] = parents.steps;
    let reach = 2 * along - 1;
    for (k, &class) in pattern.iter().enumerate().filter(|(_, class)| **class != HELD) {
        let own = [k as i32 / reach - across + 1, k as i32 % reach - along + 1];
        let share = parents.hat(0, own[0]) * parents.hat(1, own[1]);
        let row = fine.rows.of(class);
        let entries = row.entries.iter().map(|(offset, block)| (*offset, block, -share));
        for (offset, block, share) in std::iter::once(([0, 0], row.diagonal, share)).chain(entries) {
            let there = [own[0] + offset[0], own[1] + offset[1]];
            let (node, shares) = parents.around(there, share);
            sums.add_around(node, shares, block);
        }
    }
}

/// The nodes that have a share in a site of the fine grid, by columns and by rows.
struct Parents {
    steps: [i32; 2],
    /// Share of a node in what lies this many columns, and rows, away.
    hats: [[f64; MOST_STEPS + 1]; 2],
    /// Nodes around columns, and rows, from `-NEAR` to `NEAR`: setting up a cut outline asks for little else.
    near: [Vec<Beside>; 2],
}

/// Farthest from a node that sites are asked about often.
const NEAR: i32 = 2 * MOST_STEPS as i32;

/// The node at a column, or a row, or before it, and the shares of that one and of the next.
#[derive(Clone, Copy)]
struct Beside {
    node: i32,
    shares: [f64; 2],
}

impl Parents {
    fn new(steps: [i32; 2]) -> Self {
        let hat = |step: i32, at: usize| (1.0 - at as f64 / f64::from(step)).max(0.0);
        let hats = steps.map(|step| std::array::from_fn(|at| hat(step, at)));
        let mut parents = Self { steps, hats, near: Default::default() };
        parents.near = [0, 1].map(|axis| (-NEAR..=NEAR).map(|at| parents.find(axis, at)).collect());
        parents
    }

    /// Share of a node in what lies this far away along an axis.
    fn hat(&self, axis: usize, at: i32) -> f64 {
        self.hats[axis][at.unsigned_abs() as usize]
    }

    fn find(&self, axis: usize, at: i32) -> Beside {
        let step = self.steps[axis];
        let (node, beyond) = (at.div_euclid(step), at.rem_euclid(step));
        Beside { node, shares: [self.hat(axis, beyond), self.hat(axis, step - beyond)] }
    }

    fn along(&self, axis: usize, at: i32) -> Beside {
        let known = self.near[axis].get((at + NEAR) as usize);
        known.copied().unwrap_or_else(|| self.find(axis, at))
    }

    /// The node at a site or before it both ways, and `weight` times the shares of this one, of the next along the column, of
    /// that in the next column and of the one beyond both.
    #[inline(always)]
    fn around(&self, site: Site, weight: f64) -> (Site, [f64; 4]) {
        let (columns, rows) = (self.along(0, site[0]), self.along(1, site[1]));
        let [near, far] = columns.shares.map(|share| weight * share);
        let [below, above] = rows.shares;
        ([columns.node, rows.node], [near * below, near * above, far * below, far * above])
    }
}
