//! How much a synchronous update must be damped along the edges of a body.
//!
//! Inside, the waves on the lattice say how far an update may go. Along the outline of a fitted body cells have other shapes, and
//! along any edge a particle has fewer of them, or fewer that share a mean dilatation: the largest eigenvalue of `D^-1 K` may be
//! larger. It belongs to a motion of a few particles there, which a power iteration over those near the edges finds.

use std::collections::{BTreeMap, HashMap, HashSet};

use serde::{Deserialize, Serialize};

use crate::flock::block::{Block, apply};
use crate::flock::body::Body;
use crate::flock::law::MatrixWeights;
use crate::flock::neighbourhood::Neighbours;
use crate::ranks::{Team, gathered};

/// Rings of neighbours around the particles along the edges that the iteration covers.
const RINGS: usize = 2;
const ITERATIONS: usize = 60;
/// Factor on the result of the iteration, which approaches the eigenvalue from below.
const SAFETY: f64 = 1.03;
/// Part of the largest damping at which nothing grows.
const OF_LIMIT: f64 = 0.9;

/// The damping of a synchronous update, at most `inside` \[1\], which suits the inside of the body, where a particle has `all`
/// neighbours. Of a body of which each rank has a part all find it together.
pub fn along_edges(
    body: &Body,
    neighbours: &Neighbours,
    weights: &MatrixWeights,
    (inside, all): (f64, usize),
    team: Option<&Team>,
) -> f64 {
    let is_along = |i: usize| body.sites[i][0] == Body::ALONG_OUTLINE || neighbours.of(i).len() < all;
    let here = rings((0..body.count()).filter(|&i| is_along(i)), |i| {
        Some(neighbours.of(i).iter().map(|&j| j as usize))
    });
    let owned = body.owned();
    let row = |i: usize| {
        let blocks = weights.of(i).iter().zip(neighbours.of(i));
        let blocks = blocks.map(|(block, &j)| (body.index(j as usize), *block)).collect();
        (body.index(i), Row { is_along: is_along(i), blocks })
    };
    let own = here.into_iter().filter(|i| owned.contains(i)).map(row);
    let rows: BTreeMap<usize, Row> = gathered(team, own.collect()).into_iter().collect();
    let along = rows.iter().filter(|(_, row)| row.is_along).map(|(&index, _)| index);
    let members = rings(along, |index| Some(rows.get(&index)?.blocks.iter().map(|(other, _)| *other)));
    if members.is_empty() {
        return inside;
    }
    let number: HashMap<usize, usize> = members.iter().zip(0..).map(|(&index, k)| (index, k)).collect();
    let rows: Vec<Vec<(Option<usize>, Block)>> = members
        .iter()
        .map(|index| {
            let blocks = rows.get(index).into_iter().flat_map(|row| &row.blocks);
            blocks.map(|(other, block)| (number.get(other).copied(), *block)).collect()
        })
        .collect();
    let start = |&i: &usize| [(7.1 * i as f64).sin(), (3.7 * i as f64 + 1.0).sin()];
    let mut moved: Vec<[f64; 2]> = members.iter().map(start).collect();
    let mut largest = 0.0;
    for _ in 0..ITERATIONS {
        let next = rows.iter().zip(&moved).map(|(row, &here)| {
            row.iter().fold(here, |[x, y], (other, block)| {
                let [wx, wy] = apply(block, other.map_or([0.0; 2], |other| moved[other]));
                [x - wx, y - wy]
            })
        });
        let next: Vec<[f64; 2]> = next.collect();
        let size = |values: &[[f64; 2]]| values.iter().map(|[x, y]| x * x + y * y).sum::<f64>().sqrt();
        let after = size(&next);
        largest = after / size(&moved);
        moved = next.into_iter().map(|v| v.map(|v| v / after)).collect();
    }
    // What is no more than inside leaves that as it is.
    if OF_LIMIT * 2.0 / largest < inside { OF_LIMIT * 2.0 / (SAFETY * largest) } else { inside }
}

/// The weights of the neighbours of a particle, which are named by their indices in the whole body.
#[derive(Serialize, Deserialize)]
struct Row {
    is_along: bool,
    blocks: Vec<(usize, Block)>,
}

/// Particles, then those that they see, then those that these see, in the order in which they are found.
fn rings<I: Iterator<Item = usize>>(
    first: impl Iterator<Item = usize>,
    seen: impl Fn(usize) -> Option<I>,
) -> Vec<usize> {
    let mut members: Vec<usize> = first.collect();
    let mut known: HashSet<usize> = members.iter().copied().collect();
    let mut fresh = members.clone();
    for _ in 0..RINGS {
        let around: Vec<usize> = fresh.iter().filter_map(|&i| seen(i)).flatten().collect();
        fresh = around.into_iter().filter(|&j| known.insert(j)).collect();
        members.extend(&fresh);
    }
    members
}
