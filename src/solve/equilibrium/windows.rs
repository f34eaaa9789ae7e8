//! The matrices of a system of which each rank has a part: of every level the columns that it iterates with, and what they read.
//!
//! A rank sets up as many columns of each level as it has of the body, and asks those that have set up the others for what it
//! iterates with: groups of columns are cut by what all columns cost. Where a level has too few groups for all ranks, it is
//! the first one's alone.

use std::ops::Range;
use std::sync::Arc;

use super::multigrid::coarsen::{self, coarsen_columns, columns_of_nodes};
use super::multigrid::descent::Descent;
use super::multigrid::transfer::Transfer;
use crate::ranks::Team;
use crate::solve::operator::{Census, Matrix, fetched};
use crate::solve::part::{Cuts, Part};
use crate::solve::shared::SystemPart;

/// A level that ranks share: what this one has set up of it, and what all know of it.
struct Level {
    matrix: Matrix,
    /// Columns that each rank has set up.
    shares: Vec<Range<i32>>,
    census: Arc<Census>,
    /// Columns that a row leads to on either side.
    reach: i32,
    cuts: Cuts,
    /// Columns that each rank iterates with.
    own: Vec<Range<i32>>,
}

/// The way between two levels, and the other one.
type Way<'a> = (&'a Transfer, &'a Level);

impl Level {
    fn new(team: &Team, matrix: Matrix, shares: Vec<Range<i32>>, step: i32) -> Self {
        let census = Arc::new(Census::among(team, &matrix, &shares, step));
        let reach = team.each([matrix.reach_across() as u64]).into_iter().flatten().max().unwrap_or(0) as i32;
        let cuts = Cuts::new(&census.groups().0, team.count());
        let mut level = Self { matrix, shares, census, reach, cuts, own: Vec::new() };
        level.cut(team);
        level
    }

    fn cut(&mut self, team: &Team) {
        let (_, columns) = self.census.groups();
        let own = |rank: usize| {
            let groups = self.cuts.groups_of(rank);
            columns[groups.start]..columns[groups.end]
        };
        self.own = (0..team.count()).map(own).collect();
    }

    /// Leaves all to the first rank.
    fn leave_to_one(&mut self, team: &Team) {
        self.cuts = Cuts::of_one(&self.census.groups().0, team.count());
        self.cut(team);
    }

    fn fetched(&self, team: &Team, wants: &[Range<i32>]) -> Matrix {
        let all = self.census.range();
        let within = |of: &Range<i32>| {
            let start = of.start.clamp(all.start, all.end);
            start..of.end.clamp(start, all.end)
        };
        let wants: Vec<_> = wants.iter().map(within).collect();
        fetched(team, &self.matrix, (&self.shares, self.census.step), &wants)
    }

    /// The columns of this one that some of the next coarser one are computed from.
    fn below(&self, way: Transfer, coarse: &Range<i32>) -> Range<i32> {
        way.columns_below(coarse, &self.matrix.outliers)
    }

    /// The columns that a rank iterates with, if there are any.
    fn own_of(&self, rank: usize) -> Option<&Range<i32>> {
        Some(&self.own[rank]).filter(|own| !own.is_empty())
    }

    /// The columns that the rows of a rank lead to.
    fn read_by(&self, rank: usize) -> Option<Range<i32>> {
        self.own_of(rank).map(|own| own.start - self.reach..own.end + self.reach)
    }

    /// What this rank needs of it, with the ways from the level above and to the one below.
    fn window(&self, team: &Team, (above, below): (Option<Way<'_>>, Option<Way<'_>>)) -> Matrix {
        let wants = |rank: usize| {
            let down = below.and_then(|(way, level)| Some(self.below(*way, level.own_of(rank)?)));
            let up = above.and_then(|(way, level)| {
                Some(way.columns_above(level.own_of(rank)?, &level.matrix.outliers))
            });
            let all = [self.read_by(rank), down, up].into_iter().flatten();
            all.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end)).unwrap_or(0..0)
        };
        let fetched = self.fetched(team, &(0..team.count()).map(wants).collect::<Vec<_>>());
        let read = |rank: usize| self.read_by(rank).map_or(0..0, |columns| self.census.particles(columns));
        fetched.in_window(&self.census, |first| Part::in_window(team, self.cuts.clone(), first, read))
    }

    /// The next coarser one.
    fn coarser(&self, team: &Team, transfer: Transfer) -> Self {
        let across = transfer.steps[0];
        let Range { start: first, end } =
            columns_of_nodes(self.census.range(), transfer, &self.matrix.outliers);
        let begin = |rank: usize| match rank {
            0 => first,
            _ if rank == team.count() => end,
            _ => (self.shares[rank].start + across - 1).div_euclid(across).clamp(first, end),
        };
        let shares: Vec<_> = (0..team.count()).map(|rank| begin(rank)..begin(rank + 1)).collect();
        let below = |share: &Range<i32>| if share.is_empty() { 0..0 } else { self.below(transfer, share) };
        let fine = self.fetched(team, &shares.iter().map(below).collect::<Vec<_>>());
        let matrix = coarsen_columns(&fine, transfer, shares[team.rank()].clone());
        Self::new(team, matrix, shares, coarsen::STEP)
    }
}

/// The matrix of the body and, if they are to be `coarsened`, those of the coarser grids down to the first that ranks do not
/// share, each with the way to it; `grid` are the vectors of one column and one row.
pub(super) fn of_part(
    part: &SystemPart,
    matrix: Matrix,
    (coarsened, grid): (bool, [[f64; 2]; 2]),
) -> (Matrix, Vec<(Transfer, Arc<Matrix>)>) {
    let team = &part.team;
    let (shares, step) = part.columns(&matrix.columns);
    let mut descent = Descent::new(grid);
    let mut levels = vec![Level::new(team, matrix, shares, step)];
    let mut ways: Vec<Transfer> = Vec::new();
    loop {
        let level = &levels[ways.len()];
        let census = &level.census;
        if !coarsened || !level.cuts.is_shared() {
            break;
        }
        let way = descent.next((census.count(), census.extent()), || census.particles_per_site());
        let Some(way) = way else { break };
        let next = level.coarser(team, way);
        if next.census.count() >= census.count() {
            break;
        }
        descent.go(way);
        ways.push(way);
        levels.push(next);
    }
    if coarsened {
        levels[ways.len()].leave_to_one(team);
    }
    let window = |at: usize| {
        let level = &levels[at];
        let below = ways.get(at).map(|way| (way, &levels[at + 1]));
        let above = at.checked_sub(1).map(|above| (&ways[above], &levels[above]));
        level.window(team, (above, below))
    };
    let finest = window(0).with_largest(team);
    (finest, (0..).zip(&ways).map(|(above, way)| (*way, Arc::new(window(above + 1)))).collect())
}

/// The matrix of the body, on every rank.
pub(super) fn whole_of_part(part: &SystemPart, matrix: Matrix) -> Matrix {
    let team = &part.team;
    let (shares, step) = part.columns(&matrix.columns);
    let all = shares[0].start..shares[shares.len() - 1].end;
    let Matrix { columns, class, rows, outliers, .. } =
        fetched(team, &matrix, (&shares, step), &vec![all; team.count()]);
    Matrix::compile(columns, class, rows).with_outliers(outliers)
}

#[cfg(test)]
mod tests;
