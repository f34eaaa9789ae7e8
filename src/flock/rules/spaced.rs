//! Cohesion with separation, for neighbourhoods that are recomputed every step:
//! `x_j = sum_k w_k (x_k + a n_kj) / sum_k w_k`, `n_kj` being the unit vector from `k` to `j`.
//!
//! Not in the paper. Its barycentre has no distance that particles keep, so a drop whose neighbours
//! are whoever is near contracts to a point; here every neighbour proposes the place at distance `a`
//! from itself, as in flocking models (cohesion, separation) and position-based dynamics.

use super::{Neighbour, barycentre};
use crate::flock::points::distance;

/// Mean of the places at `spacing` from each neighbour; a neighbour that coincides with the particle
/// proposes the present place, having no direction to push it in.
pub fn mean(
    spacing: f64,
    present: [f64; 2],
    neighbours: impl Iterator<Item = Neighbour> + Clone,
) -> Option<[f64; 2]> {
    barycentre::mean(neighbours.map(|n| {
        let apart = distance(present, n.position);
        let away =
            |k: usize| if apart > 0.0 { spacing * ((present[k] - n.position[k]) / apart) } else { 0.0 };
        Neighbour { position: [n.position[0] + away(0), n.position[1] + away(1)], ..n }
    }))
}

#[cfg(test)]
mod tests {
    use super::super::tests::at;
    use super::*;

    #[test]
    fn too_near_is_pushed_and_too_far_is_pulled() {
        assert_eq!(mean(1.0, [0.5, 0.0], at(&[[0.0, 0.0]])), Some([1.0, 0.0]));
        assert_eq!(mean(1.0, [3.0, 0.0], at(&[[0.0, 0.0]])), Some([1.0, 0.0]));
    }
}
