//! The matrices of a system of which each rank has a part: of every level the columns that it iterates with, and what they read.
//!
//! A rank sets up as many columns of each level as it has of the body, and asks those that have set up the others for what it
//! iterates with: groups of columns are cut by what all columns cost. Where a level has too few groups for all ranks, it is
//! the first one's alone.

use std::ops::Range;
use std::sync::Arc;

use super::multigrid::coarsen::{self, coarsen_columns, first_steps, next_steps};
use super::multigrid::transfer::Transfer;
use super::multigrid::{is_coarse_enough, spacing_of};
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

impl Level {
    fn new(team: &Team, matrix: Matrix, shares: Vec<Range<i32>>, step: i32) -> Self {
        let census = Arc::new(Census::among(team, &matrix, &shares, step));
        let reach = team.each([matrix.reach()[0] as u64]).into_iter().flatten().max().unwrap_or(0) as i32;
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

    /// The next coarser one.
    fn coarser(&self, team: &Team, transfer: Transfer) -> Self {
        let [across, all] = [transfer.steps[0], self.census.range().end];
        let begin = |rank: usize| match rank {
            0 => self.census.range().start.div_euclid(across),
            _ if rank == team.count() => (all - 1).div_euclid(across) + 2,
            _ => (self.shares[rank].start + across - 1).div_euclid(across),
        };
        let shares: Vec<_> = (0..team.count()).map(|rank| begin(rank)..begin(rank + 1)).collect();
        let below = |share: &Range<i32>| if share.is_empty() { 0..0 } else { transfer.columns_below(share) };
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
    let mut level = Level::new(team, matrix, shares, step);
    let (mut spacing, mut above): (_, Option<(Transfer, Vec<Range<i32>>)>) = (spacing_of(grid), None);
    let (mut finest, mut coarser) = (None, Vec::new());
    loop {
        let is_finest = finest.is_none();
        let census = &level.census;
        let goes_on = coarsened
            && level.cuts.is_shared()
            && !is_coarse_enough((census.count(), census.extent()), is_finest);
        let steps = match is_finest {
            true => first_steps(grid, census.particles_per_site()),
            false => next_steps(spacing),
        };
        let transfer = Transfer { steps };
        let next = goes_on.then(|| level.coarser(team, transfer));
        let next = next.filter(|next| next.census.count() < level.census.count());
        if coarsened && next.is_none() {
            level.leave_to_one(team);
        }
        let wants = |rank: usize| {
            let own = &level.own[rank];
            let read = (!own.is_empty()).then(|| own.start - level.reach..own.end + level.reach);
            let down = next.iter().map(|next| &next.own[rank]).filter(|own| !own.is_empty());
            let up =
                above.iter().map(|(transfer, own)| (transfer, &own[rank])).filter(|(_, own)| !own.is_empty());
            let wanted = read.into_iter();
            let wanted = wanted.chain(down.map(|own| transfer.columns_below(own)));
            let wanted = wanted.chain(up.map(|(transfer, own)| transfer.columns_above(own)));
            wanted.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end)).unwrap_or(0..0)
        };
        let wants: Vec<_> = (0..team.count()).map(wants).collect();
        let window = level.fetched(team, &wants);
        let read = |rank: usize| match &level.own[rank] {
            own if own.is_empty() => 0..0,
            own => level.census.particles(own.start - level.reach..own.end + level.reach),
        };
        let of_rank = |first| Part::in_window(team, level.cuts.clone(), first, read);
        let window = window.in_window(&level.census, of_rank);
        match above.take() {
            None => finest = Some(window.with_largest(team)),
            Some((way, _)) => coarser.push((way, Arc::new(window))),
        }
        above = Some((transfer, level.own));
        let Some(next) = next else { break };
        spacing = [0, 1].map(|k| spacing[k] * f64::from(steps[k]));
        level = next;
    }
    (finest.expect("the body's own"), coarser)
}

/// The matrix of the body, on every rank.
pub(super) fn whole_of_part(part: &SystemPart, matrix: Matrix) -> Matrix {
    let team = &part.team;
    let (shares, step) = part.columns(&matrix.columns);
    let all = shares[0].start..shares[shares.len() - 1].end;
    let Matrix { columns, class, rows, .. } =
        fetched(team, &matrix, (&shares, step), &vec![all; team.count()]);
    Matrix::compile(columns, class, rows)
}

#[cfg(test)]
mod tests;
