//! How much a synchronous update of a fitted body must be damped.
//!
//! Inside, the waves on the lattice say how far an update may go. Along the outline cells have other shapes, and the
//! largest eigenvalue of `D^-1 K` may be larger: it belongs to a motion of a few particles there, which a power
//! iteration over the particles near the outline finds.

use crate::flock::block::apply;
use crate::flock::body::Body;
use crate::flock::law::MatrixWeights;
use crate::flock::neighbourhood::Neighbours;

/// Rings of neighbours around the particles along the outline that the iteration covers.
const RINGS: usize = 2;
const ITERATIONS: usize = 60;
/// Factor on the result of the iteration, which approaches the eigenvalue from below.
const SAFETY: f64 = 1.03;
/// Part of the largest damping at which nothing grows.
const OF_LIMIT: f64 = 0.9;

/// The damping of a synchronous update, at most `inside` \[1\], which suits the inside of the body.
pub fn along_outline(body: &Body, neighbours: &Neighbours, weights: &MatrixWeights, inside: f64) -> f64 {
    let Some(outline) = &body.outline else { return inside };
    let mut is_member = vec![false; body.count()];
    let mut members: Vec<usize> = (outline.regular..body.count()).collect();
    members.iter().for_each(|&i| is_member[i] = true);
    let mut fresh = members.clone();
    for _ in 0..RINGS {
        let around: Vec<usize> = fresh.iter().flat_map(|&i| neighbours.of(i)).map(|&j| j as usize).collect();
        fresh.clear();
        for j in around {
            if !std::mem::replace(&mut is_member[j], true) {
                fresh.push(j);
            }
        }
        members.extend(&fresh);
    }
    if members.is_empty() {
        return inside;
    }
    let start = |i: usize| [(7.1 * i as f64).sin(), (3.7 * i as f64 + 1.0).sin()];
    let mut moved = vec![[0.0; 2]; body.count()];
    members.iter().for_each(|&i| moved[i] = start(i));
    let mut largest = 0.0;
    for _ in 0..ITERATIONS {
        let next: Vec<[f64; 2]> = members
            .iter()
            .map(|&i| {
                let pairs = weights.of(i).iter().zip(neighbours.of(i));
                pairs.fold(moved[i], |[x, y], (block, &j)| {
                    let [wx, wy] = apply(block, moved[j as usize]);
                    [x - wx, y - wy]
                })
            })
            .collect();
        let size = |values: &mut dyn Iterator<Item = [f64; 2]>| {
            values.map(|[x, y]| x * x + y * y).sum::<f64>().sqrt()
        };
        let before = size(&mut members.iter().map(|&i| moved[i]));
        let after = size(&mut next.iter().copied());
        largest = after / before;
        members.iter().zip(&next).for_each(|(&i, v)| moved[i] = v.map(|v| v / after));
    }
    inside.min(OF_LIMIT * 2.0 / (SAFETY * largest)).min(1.0)
}
