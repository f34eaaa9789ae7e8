//! To the coarse grid and back: linear interpolation along columns and along rows.
//!
//! A node of the coarse grid stands at every `steps` columns and rows of the fine one, whether there is a
//! particle or not. Places are affine in column and row on every lattice, so displacements that are
//! affine, rotations among them, are reproduced to rounding.

use std::ops::Range;

use crate::flock::lattice::Site;
use crate::flock::vectors::Vectors;
use crate::solve::equilibrium::steps::for_own_groups;
use crate::solve::field::{VectorsMut, VectorsRef};
use crate::solve::operator::{Columns, Matrix, Outliers, Segment};

/// Between the particles of one matrix and the nodes of the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transfer {
    /// Columns and rows of the fine grid to a column and a row of the coarse one.
    pub steps: [i32; 2],
}

/// Rows of one column, whether a particle is there or not.
struct Column {
    low: i32,
    x: Vec<f32>,
    y: Vec<f32>,
}

impl Column {
    fn new() -> Self {
        Self { low: 0, x: Vec::new(), y: Vec::new() }
    }

    fn clear(&mut self, low: i32, high: i32) {
        self.low = low;
        let len = (high - low + 1).max(0) as usize;
        for values in [&mut self.x, &mut self.y] {
            values.clear();
            values.resize(len, 0.0);
        }
    }

    /// Adds a weighted segment, as far as its rows lie within.
    fn add(&mut self, segment: &Segment, step: i32, weight: f32, from: VectorsRef<'_, f32>) {
        let skip = if segment.row < self.low { (self.low - segment.row + step - 1) / step } else { 0 };
        let row = segment.row + skip * step;
        let room = (self.low + self.x.len() as i32 - row + step - 1) / step;
        let len = (segment.len as i32 - skip).min(room);
        if len <= 0 {
            return;
        }
        let begin = (segment.start as i32 + skip) as usize;
        let from = from.range(begin..begin + len as usize);
        let at = (row - self.low) as usize;
        for (to, from) in [(&mut self.x, from.x), (&mut self.y, from.y)] {
            if step == 1 {
                to[at..].iter_mut().zip(from).for_each(|(to, from)| *to += weight * from);
            } else {
                let to = to[at..].iter_mut().step_by(step as usize);
                to.zip(from).for_each(|(to, from)| *to += weight * from);
            }
        }
    }
}

/// Shares of the particles along an outline, which stand at no site, in the coarse nodes around their places.
#[derive(Clone, Debug, Default)]
pub struct OutlierShares {
    /// Node, particle, share; ascending.
    by_node: Vec<(u32, u32, f32)>,
    /// Particle, node, share; ascending.
    by_particle: Vec<(u32, u32, f32)>,
}

impl OutlierShares {
    /// From nodes, particles and shares, ascending.
    pub fn new(by_node: Vec<(u32, u32, f32)>) -> Self {
        let turned = by_node.iter().map(|&(node, particle, share)| (particle, node, share));
        let mut by_particle: Vec<_> = turned.collect();
        by_particle.sort_unstable_by_key(|&(particle, node, _)| (particle, node));
        Self { by_node, by_particle }
    }
}

/// Adds shares, listed by what they are added to.
fn add_shares(shares: &[(u32, u32, f32)], from: &Vectors<f32>, to: &mut VectorsMut<'_, f32>) {
    let range = to.range();
    let begin = shares.partition_point(|&(at, ..)| (at as usize) < range.start);
    for &(at, other, share) in shares[begin..].iter().take_while(|(at, ..)| (*at as usize) < range.end) {
        let at = at as usize - range.start;
        to.x[at] += share * from.x[other as usize];
        to.y[at] += share * from.y[other as usize];
    }
}

/// Share in a place below which a node has none: single precision hardly knows less.
const NO_SHARE: f64 = 1e-6;

/// The coarse nodes around a place in fine columns and rows, and its shares of them, which are linear both ways.
pub fn parents_of_place(place: [f64; 2], steps: [i32; 2]) -> [(Site, f64); 4] {
    // A node that had but the rounding of a place would be one that nothing but rounding holds.
    let near = |at: f64| if (at - at.round()).abs() < NO_SHARE { at.round() } else { at };
    let at = [0, 1].map(|k| near(place[k] / f64::from(steps[k])));
    let node = at.map(f64::floor);
    let beyond = [0, 1].map(|k| at[k] - node[k]);
    [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]: [i32; 2]| {
        let share = |k: usize, up: i32| if up == 1 { beyond[k] } else { 1.0 - beyond[k] };
        ([node[0] as i32 + i, node[1] as i32 + j], share(0, i) * share(1, j))
    })
}

impl Transfer {
    /// Share of the node `steps` away that a place `at` away from the other has.
    fn weight(self, axis: usize, at: i32) -> f32 {
        1.0 - at.abs() as f32 / self.steps[axis] as f32
    }

    /// `coarse = P' fine`.
    pub fn restrict(
        self,
        (fine, coarse): (&Matrix, &Matrix),
        outliers: &OutlierShares,
        from: &Vectors<f32>,
        to: &mut Vectors<f32>,
    ) {
        for_own_groups(coarse, coarse.own_parts(to), |group, mut to| {
            let mut column = Column::new();
            for number in coarse.group_columns[group]..coarse.group_columns[group + 1] {
                self.gather(&fine.columns, (&coarse.columns, number), from.view(), &mut column);
                for segment in coarse.columns.of(number) {
                    self.contract(segment, &column, &mut to);
                }
            }
            add_shares(&outliers.by_node, from, &mut to);
        });
    }

    /// Columns of the fine grid that have a share in these of the coarse one.
    pub fn columns_below(self, coarse: &Range<i32>, outliers: &Outliers) -> Range<i32> {
        let (across, beside) = (self.steps[0], outliers.beside());
        coarse.start * across - across + 1 - beside..(coarse.end - 1) * across + across + beside
    }

    /// Columns of the coarse grid that have a share in these of the fine one.
    pub fn columns_above(self, fine: &Range<i32>, outliers: &Outliers) -> Range<i32> {
        let (across, beside) = (self.steps[0], outliers.beside());
        (fine.start - beside).div_euclid(across)..(fine.end - 1 + beside).div_euclid(across) + 2
    }

    /// What [`Transfer::restrict`] to these groups of nodes reads of the fine particles.
    pub fn restricted_from(self, (fine, coarse): (&Matrix, &Matrix), groups: &Range<usize>) -> Range<usize> {
        let [first, end] = [groups.start, groups.end].map(|group| coarse.group_columns[group]);
        let columns = || self.columns_below(&(first..end), &fine.outliers);
        if first < end { fine.particles_of(columns()) } else { 0..0 }
    }

    /// What [`Transfer::prolong`] to these groups of particles reads of the coarse nodes.
    pub fn prolonged_from(self, (fine, coarse): (&Matrix, &Matrix), groups: &Range<usize>) -> Range<usize> {
        let [first, end] = [groups.start, groups.end].map(|group| fine.group_columns[group]);
        let columns = || self.columns_above(&(first..end), &fine.outliers);
        if first < end { coarse.particles_of(columns()) } else { 0..0 }
    }

    /// The fine columns that have a share in a coarse one, weighted and added up row by row.
    fn gather(
        self,
        fine: &Columns,
        (coarse, number): (&Columns, i32),
        from: VectorsRef<'_, f32>,
        column: &mut Column,
    ) {
        let [across, along] = self.steps;
        let Some([low, high]) = coarse.rows_of(number) else { return };
        column.clear(low * along - along + 1, high * along + along - 1);
        for i in number * across - across + 1..number * across + across {
            let weight = self.weight(0, i - number * across);
            fine.of(i).iter().for_each(|segment| column.add(segment, fine.step(), weight, from));
        }
    }

    /// The rows of a column that have a share in each node of a segment, weighted and added up.
    fn contract(self, segment: &Segment, column: &Column, to: &mut VectorsMut<'_, f32>) {
        let along = self.steps[1];
        let at = segment.start as usize - to.begin;
        let begin = (segment.row * along - (along - 1) - column.low) as usize;
        let len = segment.len as usize;
        for (to, from) in [(&mut to.x[at..at + len], &column.x), (&mut to.y[at..at + len], &column.y)] {
            match along {
                1 => to.copy_from_slice(&from[begin..begin + len]),
                2 => {
                    let from = &from[begin..begin + 2 * len + 1];
                    for (k, to) in to.iter_mut().enumerate() {
                        *to = from[2 * k + 1] + 0.5 * (from[2 * k] + from[2 * k + 2]);
                    }
                }
                _ => {
                    let width = 2 * along as usize - 1;
                    for (k, to) in to.iter_mut().enumerate() {
                        let window = &from[begin + k * along as usize..][..width];
                        let shares = (1 - along..along).map(|d| self.weight(1, d));
                        *to = window.iter().zip(shares).map(|(value, share)| share * value).sum();
                    }
                }
            }
        }
    }

    /// `fine += P coarse`.
    pub fn prolong(
        self,
        (fine, coarse): (&Matrix, &Matrix),
        outliers: &OutlierShares,
        from: &Vectors<f32>,
        to: &mut Vectors<f32>,
    ) {
        for_own_groups(fine, fine.own_parts(to), |group, mut to| {
            let mut column = Column::new();
            for number in fine.group_columns[group]..fine.group_columns[group + 1] {
                let Some([low, high]) = fine.columns.rows_of(number) else { continue };
                let [across, along] = self.steps;
                column.clear(low.div_euclid(along), high.div_euclid(along) + 1);
                let (left, beyond) = (number.div_euclid(across), number.rem_euclid(across));
                for (node, at) in [(left, beyond), (left + 1, across - beyond)] {
                    let weight = self.weight(0, at);
                    if weight > 0.0 {
                        let segments = coarse.columns.of(node).iter();
                        segments.for_each(|segment| column.add(segment, 1, weight, from.view()));
                    }
                }
                for segment in fine.columns.of(number) {
                    self.expand(segment, fine.columns.step(), &column, &mut to);
                }
            }
            add_shares(&outliers.by_particle, from, &mut to);
        });
    }

    /// Adds what a column of nodes gives to the particles of a segment.
    fn expand(self, segment: &Segment, step: i32, column: &Column, to: &mut VectorsMut<'_, f32>) {
        let along = self.steps[1];
        let at = segment.start as usize - to.begin;
        let len = segment.len as usize;
        for (to, from) in [(&mut to.x[at..at + len], &column.x), (&mut to.y[at..at + len], &column.y)] {
            let node = (segment.row.div_euclid(along) - column.low) as usize;
            let beyond = segment.row.rem_euclid(along);
            match (along, step) {
                (2, 1) => expand_halves(beyond == 1, &from[node..], to),
                _ if along == step => {
                    let (near, far) = (self.weight(1, beyond), self.weight(1, along - beyond));
                    let pairs = from[node..].iter().zip(&from[node + 1..]);
                    to.iter_mut().zip(pairs).for_each(|(to, (a, b))| *to += near * a + far * b);
                }
                _ => {
                    let (mut node, mut beyond) = (node, beyond);
                    for to in to {
                        let (near, far) = (self.weight(1, beyond), self.weight(1, along - beyond));
                        *to += near * from[node] + far * from[node + 1];
                        beyond += step;
                        while beyond >= along {
                            (node, beyond) = (node + 1, beyond - along);
                        }
                    }
                }
            }
        }
    }
}

/// Every second particle stands at a node, beginning with the first or, if `between`, with the second.
fn expand_halves(between: bool, mut from: &[f32], mut to: &mut [f32]) {
    if between && let [first, rest @ ..] = to {
        *first += 0.5 * (from[0] + from[1]);
        (from, to) = (&from[1..], rest);
    }
    let (pairs, last) = to.as_chunks_mut::<2>();
    for (to, from) in pairs.iter_mut().zip(from.windows(2)) {
        to[0] += from[0];
        to[1] += 0.5 * (from[0] + from[1]);
    }
    if let [last] = last {
        *last += from[pairs.len()];
    }
}
