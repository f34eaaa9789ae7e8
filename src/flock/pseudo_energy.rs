//! The paper's pseudo-energies, "a graphic utility for a better understanding of the deformation".

use super::law::Flock;
use super::vectors::{Vectors, distance};

/// `PE1(j) = sum_k (d(k,j) - d0(k,j))^2` over the live bonds of `particle` \[length^2\].
pub fn pe1(flock: &Flock, particle: usize, present: &Vectors) -> f64 {
    pe1_among(flock, particle, flock.live_neighbours(particle), present)
}

/// The same over these neighbours, as those that were bonded at an earlier step.
pub(crate) fn pe1_among(
    flock: &Flock,
    particle: usize,
    neighbours: impl Iterator<Item = usize>,
    present: &Vectors,
) -> f64 {
    let reference = &flock.reference;
    neighbours.fold(0.0, |sum, k| {
        let now = distance(present.get(particle), present.get(k));
        let initial = distance(reference.get(particle), reference.get(k));
        sum + (now - initial) * (now - initial)
    })
}

/// `PE2(j) = |x_j(t) - x_j(t-1)|`, the length of the particle's last move \[length\].
pub fn pe2(particle: usize, present: &Vectors, previous: &Vectors) -> f64 {
    distance(present.get(particle), previous.get(particle))
}
