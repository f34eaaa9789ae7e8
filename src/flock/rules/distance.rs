//! Weights that depend on the present distance, the paper's Eq. 3:
//! `x_j = sum_k d(k,j)^p x_k / sum_k d(k,j)^p`, the paper's power `p` being 1.
//!
//! With `p > 0` far neighbours pull more, "like Hooke's law". Updated synchronously that overshoots: with `p = 1` and
//! two fixed neighbours midpoint + e is mapped to midpoint - e, and on a square lattice the shortest waves change by
//! `-(1 + p)` at each step, so that it takes the sequential update, or one that is damped below `2 / (2 + p)`, to settle.

use super::{Neighbour, barycentre};
use crate::flock::vectors::distance;

/// Weighted mean; where every neighbour coincides with the particle, their barycentre. For `p < 0`
/// and neighbours that coincide with the particle it is the limit: the mean of those alone.
pub fn mean(
    power: f64,
    present: [f64; 2],
    neighbours: impl Iterator<Item = Neighbour> + Clone,
) -> Option<[f64; 2]> {
    barycentre::mean(weighted(power, present, neighbours))
}

/// The neighbours, their weights multiplied by `d^p` up to a common factor.
pub fn weighted(
    power: f64,
    present: [f64; 2],
    neighbours: impl Iterator<Item = Neighbour> + Clone,
) -> impl Iterator<Item = Neighbour> + Clone {
    let distances = neighbours.clone().map(move |n| distance(n.position, present));
    // Relative to the largest weight, so that no power of a distance overflows.
    let scale =
        if power >= 0.0 { distances.fold(0.0, f64::max) } else { distances.fold(f64::INFINITY, f64::min) };
    neighbours.map(move |n| {
        let d = distance(n.position, present);
        let relative = if d == scale { 1.0 } else { (d / scale).powf(power) };
        Neighbour { weight: n.weight * if relative.is_finite() { relative } else { 0.0 }, ..n }
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::at;
    use super::*;

    #[test]
    fn the_paper_s_weight_is_the_distance_itself() {
        // d = 1 and 3: (1*0 + 3*4) / 4.
        assert_eq!(mean(1.0, [1.0, 0.0], at(&[[0.0, 0.0], [4.0, 0.0]])), Some([3.0, 0.0]));
    }

    #[test]
    fn the_update_between_two_fixed_neighbours_is_marginal() {
        let x = mean(1.0, [2.0 + 0.3, 0.0], at(&[[0.0, 0.0], [4.0, 0.0]])).expect("has neighbours")[0];
        assert!((x - (2.0 - 0.3)).abs() < 1e-15);
    }

    #[test]
    fn a_negative_power_follows_the_nearest_and_extremes_stay_finite() {
        let near = mean(-40.0, [0.1, 0.0], at(&[[0.0, 0.0], [4.0, 0.0]])).expect("has neighbours");
        assert!(near[0].abs() < 1e-12);
        assert_eq!(mean(-1.0, [0.0, 0.0], at(&[[0.0, 0.0], [4.0, 0.0]])), Some([0.0, 0.0]));
        let huge = mean(40.0, [0.0, 0.0], at(&[[1e150, 0.0], [2e150, 0.0]])).expect("has neighbours");
        assert!((huge[0] / 2e150 - 1.0).abs() < 1e-9);
    }
}
