//! Cohesion with separation, for neighbourhoods that are recomputed every step:
//! `x_j = sum_k w_k (x_k + a n_kj) / sum_k w_k`, `n_kj` being the unit vector from `k` to `j` and
//! `w_k = d(k,j)^p`.
//!
//! Not in the paper. Its barycentre has no distance that particles keep, so a drop whose neighbours
//! are whoever is near contracts to a point; here every neighbour proposes the place at distance `a`
//! from itself, as in flocking models (cohesion, separation) and position-based dynamics. With `p`
//! well below 0 the nearest have the say, and particles do not crowd.

use super::{Neighbour, barycentre, distance};

/// Mean of the places at `spacing` from each neighbour, weighted by this power of the present
/// distance; a neighbour that coincides with the particle proposes the present place, having no
/// direction to push it in.
pub fn mean(
    spacing: f64,
    power: f64,
    present: [f64; 2],
    neighbours: impl Iterator<Item = Neighbour> + Clone,
) -> Option<[f64; 2]> {
    barycentre::mean(distance::weighted(power, present, neighbours).map(|n| {
        let apart = crate::flock::points::distance(present, n.position);
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
        assert_eq!(mean(1.0, 0.0, [0.5, 0.0], at(&[[0.0, 0.0]])), Some([1.0, 0.0]));
        assert_eq!(mean(1.0, 0.0, [3.0, 0.0], at(&[[0.0, 0.0]])), Some([1.0, 0.0]));
    }

    #[test]
    fn the_nearest_has_the_say_when_the_power_is_negative() {
        let pair = [[0.0, 0.0], [1.5, 0.0]];
        let x = |power| mean(1.0, power, [0.5, 0.0], at(&pair)).expect("has neighbours")[0];
        // Pushed to 1 by the near one, already at the right distance from the far one.
        assert!((x(0.0) - 0.75).abs() < 1e-15);
        assert!((x(-4.0) - (1.0 * 16.0 + 0.5) / 17.0).abs() < 1e-15);
    }
}
