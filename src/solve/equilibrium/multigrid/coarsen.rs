//! The coarse grid and its operator, `P' K P`, by classes.
//!
//! A row of it depends on nothing but the classes of the particles within a node's reach, so every
//! different pattern of them is a class, and its row is computed once.

use std::collections::HashMap;
use std::ops::Range;

use super::descent::MOST_STEPS;
use super::sums::{Sums, add};
use super::transfer::{OutlierShares, Transfer, parents_of_place};
use crate::flock::block::Block;
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::solve::equilibrium::steps::in_pieces;
use crate::solve::operator::{
    Columns, HELD, Matrix, Name, Outliers, RowRef, Rows, leads_to_outlier, name_of,
};

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
    let product = |list: usize| Product::new(fine, &parents, of_outliers, list);
    let mut pieces = in_pieces(&singles, PIECE, |singles| {
        let mut product = product(singles.len());
        singles.iter().for_each(|&(node, of_node)| product.push_row_at(node, of_node));
        product.rows
    });
    pieces.extend(in_pieces(&patterns, PIECE, |patterns| {
        let mut product = product(patterns.len());
        patterns.iter().for_each(|pattern| product.push_row_among(pattern));
        product.rows
    }));
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

/// Rows of `P' K P`, each summed in two steps: of `P' K` by particles, and these by the nodes that have a share in them.
struct Product<'a> {
    fine: &'a Matrix,
    parents: &'a Parents,
    of_outliers: &'a OutlierParents,
    /// Of the row of `P' K` that is being summed: by offsets from the site of the node, ...
    of_sites: Sums,
    /// ... and by the rows of particles at no site in their column.
    of_others: Vec<(i32, Block)>,
    /// Of the row of `P' K P`, by offsets from the node.
    of_nodes: Sums,
    rows: Rows,
}

impl<'a> Product<'a> {
    fn new(fine: &'a Matrix, parents: &'a Parents, of_outliers: &'a OutlierParents, rows: usize) -> Self {
        Self {
            fine,
            parents,
            of_outliers,
            of_sites: Sums::default(),
            of_others: Vec::new(),
            of_nodes: Sums::default(),
            rows: Rows::with_capacity(rows, NEIGHBOURS),
        }
    }

    /// Adds the row of a node, and of the particles at no site that it has a share in.
    fn push_row_at(&mut self, node: Site, outliers: &[Child]) {
        let steps = self.parents.steps;
        let near = |k: usize| node[k] * steps[k] - steps[k] + 1..node[k] * steps[k] + steps[k];
        let step = self.fine.columns.step();
        for column in near(0) {
            let Range { start: mut row, end } = near(1);
            while row < end {
                let Some((first, room)) = self.fine.columns.find([column, row]) else {
                    row += 1;
                    continue;
                };
                for class in &self.fine.class[first..first + room] {
                    let at = [column - node[0] * steps[0], row - node[1] * steps[1]];
                    self.add_particle(node, [column, row], (*class, self.parents.share(at)));
                    row += step;
                    if row >= end {
                        break;
                    }
                }
            }
        }
        for &Child { particle, row, share, .. } in outliers {
            self.add_particle(node, [Body::ALONG_OUTLINE, row], (self.fine.class[particle], share));
        }
        self.end_row(node);
    }

    /// The same of a node with these surroundings, from which no row leads to a particle at no site.
    fn push_row_among(&mut self, pattern: &[u32]) {
        let [across, along] = self.parents.steps;
        let reach = 2 * along - 1;
        for (k, &class) in pattern.iter().enumerate().filter(|(_, class)| **class != HELD) {
            let at = [k as i32 / reach - across + 1, k as i32 % reach - along + 1];
            self.add_particle([0, 0], at, (class, self.parents.share(at)));
        }
        self.end_row([0, 0]);
    }

    /// Adds what a node's share in a particle at a site brings to the row of `P' K`.
    fn add_particle(&mut self, node: Site, site: Site, (class, share): (u32, f64)) {
        let row = self.fine.rows.of(class);
        let entries = row.entries.iter().map(|(offset, block)| (*offset, block, -share));
        let [across, along] = self.parents.steps;
        for (offset, block, share) in std::iter::once(([0, 0], row.diagonal, share)).chain(entries) {
            let [column, row] = [site[0] + offset[0], site[1] + offset[1]];
            if column != Body::ALONG_OUTLINE {
                self.of_sites.add([column - node[0] * across, row - node[1] * along], share, block);
                continue;
            }
            let at = self.of_others.iter().position(|(other, _)| *other == row).unwrap_or_else(|| {
                self.of_others.push((row, Block::default()));
                self.of_others.len() - 1
            });
            add(&mut self.of_others[at].1, share, block);
        }
    }

    /// Ends the row of a node.
    fn end_row(&mut self, node: Site) {
        let of_nodes = &mut self.of_nodes;
        for (offset, block) in self.of_sites.drain() {
            let (first, shares) = self.parents.around(offset);
            of_nodes.add_around(first, shares, &block);
        }
        for (row, block) in self.of_others.drain(..) {
            let around = &self.of_outliers.nodes[row as usize];
            let first = around[0].0;
            let from_node = [first[0] - node[0], first[1] - node[1]];
            of_nodes.add_around(from_node, around.map(|(_, share)| share), &block);
        }
        self.rows.push_blocks(of_nodes.drain());
    }
}

/// The different surroundings of nodes: classes of the fine particles within reach, column by column.
struct Patterns {
    transfer: Transfer,
    known: HashMap<Name, u32>,
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
                let next = self.known.len() as u32;
                before = *self
                    .known
                    .entry(name_of(pattern.iter().map(|&class: &u32| class.into())))
                    .or_insert(next);
                if before == next {
                    self.all.extend(&pattern);
                }
            }
            node(row, Some(before));
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

    /// Share of a node in what lies so many columns and rows away.
    fn share(&self, at: Site) -> f64 {
        self.hat(0, at[0]) * self.hat(1, at[1])
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

    /// The node at a site or before it both ways, and the shares of this one, of the next along the column, of that in the
    /// next column and of the one beyond both.
    #[inline(always)]
    fn around(&self, site: Site) -> (Site, [f64; 4]) {
        let (columns, rows) = (self.along(0, site[0]), self.along(1, site[1]));
        let ([near, far], [below, above]) = (columns.shares, rows.shares);
        ([columns.node, rows.node], [near * below, near * above, far * below, far * above])
    }
}
