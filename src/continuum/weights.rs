//! Fixed weights of the neighbours, from what the scene says of them and of its material.

use super::bulk_response::{self, gradient};
use super::pieces::require_connected;
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::flock::law::Weights;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::rules::Mean;
use crate::flock::vectors::distance;
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::material::weights::{WeightsError, assemble};
use crate::ranks::Team;
use crate::scene::{Scene, SceneError, Weights as FixedWeights};
use crate::solve::affine_weights;

/// Weights of the body's bonds; of a material those of its cells.
///
/// # Errors
/// Names the key of weights that do not fit the neighbourhood or that no update can carry, or what in the
/// body cannot carry a material.
pub fn of_body(
    scene: &Scene,
    body: &Body,
    neighbours: &Neighbours,
    cells: Option<&Cells>,
    follows: &[bool],
) -> Result<Weights, SceneError> {
    if let (Mean::Material { .. }, Some(cells), Some(elastic)) = (scene.mean, cells, &scene.material) {
        return of_material(scene, body, neighbours, cells, elastic);
    }
    match &scene.weights {
        None => Ok(Weights::Equal),
        Some(FixedWeights::Distance { power }) => {
            let spacing = body.lattice.spacing();
            let weight = |j: usize, k: u32| {
                (distance(body.reference.get(j), body.reference.get(k as usize)) / spacing).powf(*power)
            };
            let weights: Vec<f64> =
                (0..body.count()).flat_map(|j| neighbours.of(j).iter().map(move |&k| weight(j, k))).collect();
            let sums = |i: usize| weights[neighbours.bonds(i)].iter().sum::<f64>();
            let is_lost =
                |&i: &usize| !(neighbours.of(i).is_empty() || (sums(i) > 0.0 && sums(i).is_finite()));
            if let Some(i) = body.exact().find(is_lost) {
                let message =
                    format!("the weights of the neighbours of particle {} add up to {}", body.id(i), sums(i));
                return Err(scene.refuse("rule.weights.power", message, "give a power nearer to 0"));
            }
            Ok(Weights::Scalar(weights))
        }
        Some(FixedWeights::List(values)) => {
            let offsets = scene.neighbourhood.offsets(&scene.lattice).unwrap_or_default();
            bulk_response::check_count(scene, values, &offsets)?;
            Ok(Weights::Scalar(listed_weights(values, &offsets, body, neighbours)))
        }
        Some(FixedWeights::Solved) => {
            // Those at the ends of a part see too few.
            let exact = body.exact();
            let follows = follows.iter().enumerate().map(|(i, follows)| *follows && exact.contains(&i));
            let follows: Vec<bool> = follows.collect();
            let solved = affine_weights::solve(&body.reference, neighbours, &follows).map_err(|error| {
                let help = "use a wider neighbourhood or a frame, or let a leader have this place";
                scene.refuse("rule.weights", error.described(|i| format!("particle {}", body.id(i))), help)
            })?;
            Ok(Weights::Scalar(solved.weights))
        }
        Some(FixedWeights::Gradient { length }) => {
            let gradient = gradient(scene, *length)?;
            bulk_response::require_damped(scene, &gradient)?;
            let weights = Weights::Scalar(gradient.of_body(body, neighbours));
            // For all parts to find out.
            if body.part.is_none() {
                require_joined(scene, (body, neighbours, &weights), None)?;
            }
            Ok(weights)
        }
    }
}

fn of_material(
    scene: &Scene,
    body: &Body,
    neighbours: &Neighbours,
    cells: &Cells,
    elastic: &Elastic,
) -> Result<Weights, SceneError> {
    let weights = assemble(cells, body, neighbours, elastic, scene.mean.rotation());
    weights.map(Weights::Matrix).map_err(|error| match &body.part {
        Some(part) => refuse(scene, &error.in_whole(body, part.whole.neighbours)),
        None => refuse(scene, &error),
    })
}

pub(super) fn refuse(scene: &Scene, error: &WeightsError) -> SceneError {
    let (key, help) = match error {
        WeightsError::MissingNeighbour { .. } | WeightsError::MissingMate { .. } => (
            "neighbours",
            "use kind = \"cells\", or leave the neighbours out: the rule takes those that it needs",
        ),
        WeightsError::Mechanism(_) => ("body.shape", "use a smaller spacing or a larger shape"),
        _ => ("material", "use constants and a lattice less far apart"),
    };
    scene.refuse(key, error.to_string(), help)
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

/// Refuses a body that hangs together by neighbours of no weight alone: those across a gap that a second gradient sees over. Of a
/// part all ranks find it together.
pub(super) fn require_joined(
    scene: &Scene,
    (body, neighbours, weights): (&Body, &Neighbours, &Weights),
    team: Option<&Team>,
) -> Result<(), SceneError> {
    let (Some(FixedWeights::Gradient { .. }), Weights::Scalar(weights)) = (&scene.weights, weights) else {
        return Ok(());
    };
    let joined = |i: usize| neighbours.bonds(i).filter(|&b| weights[b] != 0.0).map(|b| neighbours.index[b]);
    let joined = Neighbours::from_lists((0..body.count()).map(joined));
    let connected = match team {
        None => body.require_connected(&joined),
        Some(team) => require_connected(body, &joined, team),
    };
    connected.map_err(|error| {
        scene.refuse(
            "body.shape",
            error.to_string(),
            "close the gap, or run the parts as scenes of their own",
        )
    })
}
