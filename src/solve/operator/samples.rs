//! Bodies for tests: every lattice, ragged edges, holes, held particles, blocks of any kind.

use super::{Operator, Outliers, Row};
use crate::flock::block::{Block, plus};
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::{Lattice, LatticeKind, Site};
use crate::flock::neighbourhood::Neighbourhood;

/// Symmetric as a whole and positive, though its blocks are not symmetric: springs along and across each
/// bond, a coupling that changes its sign with the direction, and something that holds every particle.
pub fn operator(kind: LatticeKind, columns: u32, rows: u32, held: impl Fn(usize) -> bool) -> Operator {
    let lattice = Lattice::new(kind, [0.0; 2], 0.2);
    let near = Neighbourhood::First { keep: None };
    let cut = Cut::Count { columns, rows };
    let (body, _) = Body::build(lattice, &cut, &near, None).expect("fits");
    let offsets = near.offsets(&body.lattice).expect("fits");
    // A hole that is no multiple of anything.
    let sites: Vec<_> =
        body.sites.iter().copied().filter(|&[i, j]| !(5..8).contains(&i) || !(4..7).contains(&j)).collect();
    let row = |i: usize| {
        let mut row = Row { diagonal: [[0.1, 0.0], [0.0, 0.1]], entries: Vec::new() };
        for &offset in &offsets[body.lattice.sublattice(sites[i])] {
            let there = [sites[i][0] + offset[0], sites[i][1] + offset[1]];
            if sites.binary_search(&there).is_ok() {
                let spring = spring(body.lattice.vector(offset));
                row.diagonal = plus(&row.diagonal, &spring);
                let turn = if offset > [0, 0] { 0.05 } else { -0.05 };
                row.entries.push((offset, plus(&spring, &[[0.0, turn], [-turn, 0.0]])));
            }
        }
        row
    };
    let grid = [body.lattice.vector([1, 0]), body.lattice.vector([0, 1])];
    let follows = (0..sites.len()).map(|i| !held(i)).collect();
    Operator::from_rows(&sites, grid, follows, row).expect("an operator")
}

fn spring([x, y]: [f64; 2]) -> Block {
    let square = x * x + y * y;
    let (along, across) = (1.0 / square, 0.3 / square);
    [
        [along * x * x + across * y * y, (along - across) * x * y],
        [(along - across) * x * y, along * y * y + across * x * x],
    ]
}

/// The same operator with a row of its own for each particle, some of which lead to each of their neighbours twice.
pub fn with_own_rows(operator: &Operator) -> Operator {
    let sites: Vec<Site> = operator.columns.sites().collect();
    let row = |i: usize| {
        let times = |block: Block, factor: f64| block.map(|row| row.map(|value| factor * value));
        let (Row { diagonal, entries }, factor) = (operator.row(i), 1.0 + i as f64 / 1e5);
        let shares: &[f64] = if i.is_multiple_of(5) { &[0.25, 0.75] } else { &[1.0] };
        let entry = |&(offset, block): &(Site, Block)| {
            shares.iter().map(move |share| (offset, times(block, factor * share)))
        };
        Row { diagonal: times(diagonal, factor), entries: entries.iter().flat_map(entry).collect() }
    };
    let made = Operator::from_rows(&sites, operator.grid, operator.follows().to_vec(), row);
    made.expect("an operator")
}

/// The same operator with some of its particles along an outline: after the others of their column, at no site, somewhat beside
/// where they were; of some of the others one component is held.
pub fn with_outliers(operator: &Operator) -> Operator {
    let sites: Vec<Site> = operator.columns.sites().collect();
    let is_outlier = |i: usize| i % 7 == 3;
    let step = operator.columns.step();
    // Along the outline forth through the body and back again.
    let along: Vec<usize> = (0..sites.len()).filter(|&i| is_outlier(i)).collect();
    let along: Vec<usize> =
        along.iter().step_by(2).chain(along.iter().skip(1).step_by(2).rev()).copied().collect();
    let mut new_sites = sites.clone();
    along.iter().zip(0..).for_each(|(&i, k)| new_sites[i] = [Body::ALONG_OUTLINE, k * step]);
    let mut order: Vec<usize> = (0..sites.len()).collect();
    order.sort_by_key(|&i| (sites[i][0], new_sites[i]));
    let row = |new: usize| {
        let old = order[new];
        let offset = |offset: Site| {
            let there = new_sites[operator.index_of(sites[old], offset)];
            [there[0] - new_sites[old][0], there[1] - new_sites[old][1]]
        };
        let row = operator.row(old);
        Row { diagonal: row.diagonal, entries: row.entries.iter().map(|&(o, b)| (offset(o), b)).collect() }
    };
    let follows = order.iter().map(|&old| operator.follows()[old]).collect();
    let beside = |k: usize| 0.3 * (k as f64 * 0.618).fract() - 0.1;
    let place =
        |old: usize| [f64::from(sites[old][0]) + beside(old), f64::from(sites[old][1]) - beside(3 * old)];
    let places = along.iter().map(|&old| (new_sites[old][1], place(old)));
    let held = (0..sites.len()).map(|new| [new % 23 == 11, new % 31 == 5]).collect();
    let ordered: Vec<Site> = order.iter().map(|&old| new_sites[old]).collect();
    let outliers = Outliers::new(places);
    let made = Operator::from_rows_along_outline((&ordered, outliers), operator.grid, follows, row);
    made.expect("an operator").with_held_axes(held)
}
