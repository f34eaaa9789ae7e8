//! Fixed weights of the neighbours, from what the scene says of them.

use super::interior::{self, gradient};
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::points::distance;
use crate::scene::{Scene, SceneError, Weights};

/// Weights parallel to the neighbours' index list \[1\], shape \[bonds\]; none where all are 1.
///
/// # Errors
/// Names the key of weights that do not fit the neighbourhood or that no update can carry.
pub fn of_body(scene: &Scene, body: &Body, neighbours: &Neighbours) -> Result<Option<Vec<f64>>, SceneError> {
    match &scene.weights {
        None => Ok(None),
        Some(Weights::Distance { power }) => {
            let spacing = body.lattice.spacing();
            let weight = |j: usize, k: u32| {
                (distance(body.reference.get(j), body.reference.get(k as usize)) / spacing).powf(*power)
            };
            let all = (0..body.count()).flat_map(|j| neighbours.of(j).iter().map(move |&k| weight(j, k)));
            Ok(Some(all.collect()))
        }
        Some(Weights::List(values)) => {
            let offsets = scene.neighbourhood.offsets(&scene.lattice).unwrap_or_default();
            interior::check_count(scene, values, &offsets)?;
            Ok(Some(listed_weights(values, &offsets, body, neighbours)))
        }
        Some(Weights::Gradient { length }) => {
            let gradient = gradient(scene, *length)?;
            interior::require_damped(scene, &gradient)?;
            let weights = gradient.of_body(body, neighbours);
            require_joined(scene, body, neighbours, &weights)?;
            Ok(Some(weights))
        }
    }
}

/// Weights follow the offsets; a particle that lacks a neighbour lacks its weight.
fn listed_weights(values: &[f64], offsets: &[Vec<Site>], body: &Body, neighbours: &Neighbours) -> Vec<f64> {
    let mut all = Vec::with_capacity(neighbours.index.len());
    for j in 0..body.count() {
        let mut next = neighbours.of(j).iter().map(|&k| body.sites[k as usize]).peekable();
        for (offset, &value) in offsets[body.lattice.sublattice(body.sites[j])].iter().zip(values) {
            let there = [body.sites[j][0] + offset[0], body.sites[j][1] + offset[1]];
            if next.next_if_eq(&there).is_some() {
                all.push(value);
            }
        }
    }
    all
}

/// Refuses a body that hangs together by neighbours of no weight alone: those across a gap.
fn require_joined(
    scene: &Scene,
    body: &Body,
    neighbours: &Neighbours,
    weights: &[f64],
) -> Result<(), SceneError> {
    let joined = |i: usize| neighbours.bonds(i).filter(|&b| weights[b] != 0.0).map(|b| neighbours.index[b]);
    body.require_connected(&Neighbours::from_lists((0..body.count()).map(joined))).map_err(|error| {
        scene.refuse(
            "body.shape",
            error.to_string(),
            "close the gap, or run the parts as scenes of their own",
        )
    })
}
