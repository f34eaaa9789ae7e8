//! Bodies for tests: every lattice, ragged edges, holes, held particles, blocks of any kind.

use super::{Operator, Row};
use crate::flock::block::{Block, plus};
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::{Lattice, LatticeKind};
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
