//! How much a synchronous update must be damped where weights that are solved for extrapolate.
//!
//! A follower outside the hull of its neighbours has weights of both signs. Several of them side by side overshoot together: the least
//! eigenvalue of their sweep is below -1, which no mean with positive weights has. That motion dies out towards the inside of the body,
//! so that those around them are enough to find it.

use std::collections::{BTreeMap, BTreeSet};

use crate::flock::body::Body;
use crate::flock::law::{Flock, Weights};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::role::Role;
use crate::flock::rules::Rule;
use crate::flock::vectors::Vectors;
use crate::ranks::{Team, gathered};
use crate::solve::spectrum::LinearSweep;
use crate::sweep::Update;

/// Rings of neighbours around those that extrapolate which move with them.
const RINGS: usize = 5;
/// Sweeps in which the least eigenvalue is sought.
const SWEEPS: usize = 100;
/// Part of the largest damping at which nothing grows.
const OF_LIMIT: f64 = 0.9;

/// The weights of the neighbours of a follower, all named by their indices in the whole body.
type Row = (usize, Vec<(usize, f64)>);

/// The damping that keeps followers with weights of both signs from growing \[1\]; `None` where none has any. `follows`, shape \[count\], are
/// those that follow at any time. Of a body of which each rank has a part all find it together.
pub fn damping(
    body: &Body,
    (neighbours, weights): (&Neighbours, &[f64]),
    follows: &[bool],
    team: Option<&Team>,
) -> Option<f64> {
    let owned = body.owned();
    let extrapolates = |&i: &usize| follows[i] && neighbours.bonds(i).any(|bond| weights[bond] < 0.0);
    let row = |&index: &usize| -> Option<Row> {
        let i = body.exact_particle(index).filter(|i| owned.contains(i) && follows[*i])?;
        let seen = neighbours.of(i).iter().map(|&k| body.index(k as usize));
        Some((index, seen.zip(weights[neighbours.bonds(i)].iter().copied()).collect()))
    };
    let own = owned.clone().filter(extrapolates).map(|i| body.index(i)).collect();
    let mut fresh: BTreeSet<usize> = gathered(team, own).into_iter().collect();
    let mut rows: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
    for _ in 0..=RINGS {
        let found = gathered(team, fresh.iter().filter_map(row).collect());
        fresh = found.iter().flat_map(|(_, seen)| seen.iter().map(|(other, _)| *other)).collect();
        rows.extend(found);
        fresh.retain(|index| !rows.contains_key(index));
    }
    let members = rows.iter().flat_map(|(&index, seen)| seen.iter().map(|(other, _)| *other).chain([index]));
    let members: BTreeSet<usize> = members.collect();
    let number: BTreeMap<usize, u32> = members.iter().copied().zip(0..).collect();
    let seen = |index: &usize| rows.get(index).into_iter().flatten();
    let neighbours =
        Neighbours::from_lists(members.iter().map(|index| seen(index).map(|(other, _)| number[other])));
    let weights = members.iter().flat_map(|index| seen(index).map(|(_, weight)| *weight)).collect();
    let role = |index| if rows.contains_key(index) { Role::Follower } else { Role::Leader };
    let roles: Vec<Role> = members.iter().map(role).collect();
    let places = Vectors::zeros(roles.len()).into();
    let flock = Flock::new(Rule::BARYCENTRE, places, neighbours, Weights::Scalar(weights));
    let lowest = LinearSweep::new(&flock, None, &roles, Update::default(), SWEEPS)?.ends().lowest;
    Some(OF_LIMIT * 2.0 / (1.0 - lowest))
}
