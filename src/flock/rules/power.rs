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
    /// The axes' own zero: the literal formula. Along an axis on which a neighbour has a negative coordinate there is
    /// no mean, and the particle stays.
    World,
}

/// Power mean of each coordinate; `None` for one that has none, without neighbours and without any weight.
pub fn means(
    exponent: f64,
    origin: Origin,
    neighbours: impl Iterator<Item = Neighbour> + Clone,
) -> [Option<f64>; 2] {
    [0, 1].map(|k| axis(exponent, origin, neighbours.clone(), k))
}

/// Exponents nearer to 0 are those of the geometric mean, from which no double differs.
const GEOMETRIC: f64 = 1e-20;

/// Below this size of the exponent powers are near 1, and the mean is in what they differ from it.
const NEAR_GEOMETRIC: f64 = 0.1;

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
    let [low, high] = [low - zero, high - zero];
    let exponent = if exponent.abs() < GEOMETRIC { 0.0 } else { exponent };
    let total: f64 = neighbours.clone().map(|n| n.weight).sum();
    if total == 0.0 || low < 0.0 {
        return None;
    }
    if low == 0.0 && (exponent <= 0.0 || high == 0.0) {
        // The limit, where nothing pulls the other way.
        return neighbours.map(|n| n.weight).all(|weight| weight > 0.0).then_some(zero);
    }
    // Relative to the one whose power is the largest, so that none overflows and not all vanish.
    let scale = if exponent < 0.0 { low } else { high };
    let sum_of = |of: &dyn Fn(f64) -> f64| {
        neighbours.clone().fold(0.0, |sum, n| sum + n.weight * of((n.position[k] - zero) / scale))
    };
    let relative = if exponent == 0.0 {
        (sum_of(&f64::ln) / total).exp()
    } else if exponent.abs() < NEAR_GEOMETRIC {
        let beyond_one = sum_of(&|value| (exponent * value.ln()).exp_m1()) / total;
        (beyond_one.ln_1p() / exponent).exp()
    } else {
        (sum_of(&|value| value.powf(exponent)) / total).powf(1.0 / exponent)
    };
    Some(zero + scale * relative)
}

#[cfg(test)]
mod tests {
    use super::super::tests::at;
    use super::*;

    #[test]
    fn the_literal_geometric_mean_of_two_and_eight_is_four() {
        let x = means(0.0, Origin::World, at(&[[2.0, 1.0], [8.0, 1.0]]))[0].expect("positive coordinates");
        assert!((x - 4.0).abs() < 1e-14);
    }

    #[test]
    fn the_quadratic_mean_of_one_and_seven_is_five() {
        let x = means(2.0, Origin::World, at(&[[1.0, 1.0], [7.0, 1.0]]))[0].expect("positive coordinates");
        assert!((x - 5.0).abs() < 1e-14);
    }

    #[test]
    fn the_moving_origin_moves_the_mean_with_the_body_and_the_literal_one_does_not() {
        let here = [[0.25, 3.0], [2.5, 1.0], [1.0, 2.0]];
        let moved = here.map(|[x, y]| [x + 64.0, y + 32.0]);
        for exponent in [0.0, 2.0, -1.0] {
            let shift = |origin| {
                let (a, b) = (means(exponent, origin, at(&here)), means(exponent, origin, at(&moved)));
                b[0].expect("positive") - a[0].expect("positive")
            };
            assert!((shift(Origin::Moving { margin: 1.0 }) - 64.0).abs() < 1e-13);
            assert!((shift(Origin::World) - 64.0).abs() > 1e-3);
        }
    }

    #[test]
    fn a_negative_coordinate_has_no_literal_mean_and_zero_has_its_limit() {
        let of = |exponent, x| means(exponent, Origin::World, at(&[[x, 1.0], [8.0, 1.0]]));
        assert_eq!(of(0.0, -1.0), [None, Some(1.0)]);
        assert_eq!([of(0.0, 0.0), of(-2.0, 0.0)], [[Some(0.0), Some(1.0)]; 2]);
        assert_eq!(of(1.0, 0.0), [Some(4.0), Some(1.0)]);
        assert_eq!(means(1.0, Origin::World, at(&[[0.0, 0.0]])), [Some(0.0); 2]);
    }

    #[test]
    fn the_mean_is_accurate_at_every_exponent() {
        // Of 1, 2, 2, 3 by arithmetic of fifty digits.
        let geometric = 1.861_209_718_204_199_2;
        for (exponent, expected) in [
            (-700.0, 1.001_982_382_843_793),
            (700.0, 2.994_064_617_668_722_6),
            (1e-17, geometric),
            (-1e-17, geometric),
            (1e-6, 1.861_209_863_416_876),
            (-0.05, 1.853_938_305_802_361),
        ] {
            for origin in [Origin::World, Origin::Moving { margin: 1.0 }] {
                let all = [[1.0, 1.0], [2.0, 2.0], [2.0, 2.0], [3.0, 3.0]];
                let x = means(exponent, origin, at(&all))[0].expect("positive coordinates");
                assert!((x - expected).abs() < 1e-12, "{exponent}: {x}");
            }
        }
    }
}
