//! Geometric and power means (the paper: "possible generalizations of Eq. 1 are geometric, power
//! and weighted mean"): `x_j = o + (sum_k w_k (x_k - o)^p / sum_k w_k)^(1/p)` for each coordinate,
//! and its limit `o + exp(sum_k w_k ln(x_k - o) / sum_k w_k)` for `p = 0`.
//!
//! The literal formulas have `o = 0`. They depend on where the axes are: a body that is moved as a
//! whole deforms differently, and a negative coordinate has no geometric mean. With an origin that
//! moves with the neighbours the mean is invariant under translation. No choice makes it invariant
//! under rotation, since it acts on each coordinate alone.

use super::Neighbour;

/// The origin from which coordinates are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// `margin` \[length\] below the lowest neighbour, on each axis: translation-invariant.
    Moving {
        /// Distance below the lowest neighbour, greater than 0.
        margin: f64,
    },
    /// The axes' own zero: the literal formula. A particle with a neighbour at a coordinate that
    /// is not positive has no mean and stays.
    World,
}

/// Power mean of each coordinate; `None` without neighbours or without any weight.
pub fn mean(
    exponent: f64,
    origin: Origin,
    neighbours: impl Iterator<Item = Neighbour> + Clone,
) -> Option<[f64; 2]> {
    Some([axis(exponent, origin, neighbours.clone(), 0)?, axis(exponent, origin, neighbours, 1)?])
}

fn axis(
    exponent: f64,
    origin: Origin,
    neighbours: impl Iterator<Item = Neighbour> + Clone,
    k: usize,
) -> Option<f64> {
    let values = neighbours.clone().map(|n| n.position[k]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let zero = match origin {
        Origin::Moving { margin } => low - margin,
        Origin::World => 0.0,
    };
    // Relative to the largest, so that no power of a coordinate overflows.
    let scale = high - zero;
    let (mut sum, mut total) = (0.0, 0.0);
    for n in neighbours {
        let value = (n.position[k] - zero) / scale;
        sum += n.weight * if exponent == 0.0 { value.ln() } else { value.powf(exponent) };
        total += n.weight;
    }
    if total == 0.0 || low - zero <= 0.0 {
        return None;
    }
    let relative = sum / total;
    Some(zero + scale * if exponent == 0.0 { relative.exp() } else { relative.powf(1.0 / exponent) })
}

#[cfg(test)]
mod tests {
    use super::super::tests::at;
    use super::*;

    #[test]
    fn the_literal_geometric_mean_of_two_and_eight_is_four() {
        let x = mean(0.0, Origin::World, at(&[[2.0, 1.0], [8.0, 1.0]])).expect("positive coordinates")[0];
        assert!((x - 4.0).abs() < 1e-14);
    }

    #[test]
    fn the_quadratic_mean_of_one_and_seven_is_five() {
        let x = mean(2.0, Origin::World, at(&[[1.0, 1.0], [7.0, 1.0]])).expect("positive coordinates")[0];
        assert!((x - 5.0).abs() < 1e-14);
    }

    #[test]
    fn the_moving_origin_moves_the_mean_with_the_body_and_the_literal_one_does_not() {
        let here = [[0.25, 3.0], [2.5, 1.0], [1.0, 2.0]];
        let moved = here.map(|[x, y]| [x + 64.0, y + 32.0]);
        for exponent in [0.0, 2.0, -1.0] {
            let shift = |origin| {
                let (a, b) = (mean(exponent, origin, at(&here)), mean(exponent, origin, at(&moved)));
                b.expect("positive")[0] - a.expect("positive")[0]
            };
            assert!((shift(Origin::Moving { margin: 1.0 }) - 64.0).abs() < 1e-13);
            assert!((shift(Origin::World) - 64.0).abs() > 1e-3);
        }
    }

    #[test]
    fn a_coordinate_that_is_not_positive_has_no_literal_mean() {
        assert_eq!(mean(0.0, Origin::World, at(&[[-1.0, 1.0], [8.0, 1.0]])), None);
    }
}
