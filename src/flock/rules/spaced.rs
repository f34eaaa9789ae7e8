//! Cohesion with separation, for neighbourhoods that are recomputed every step:
//! `x_j = sum_k w_k (x_k + a n_kj) / sum_k w_k`, `n_kj` being the unit vector from `k` to `j` and
//! `w_k = d(k,j)^p`.
//!
//! Not in the paper. Its barycentre has no distance that particles keep, so a drop whose neighbours
//! are all particles in range contracts to a point; here every neighbour proposes the place at distance `a`
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
    let squared = |n: &Neighbour| {
        let [x, y] = [present[0] - n.position[0], present[1] - n.position[1]];
        x * x + y * y
    };
    let (least, most) = neighbours
        .clone()
        .map(|n| squared(&n))
        .fold((f64::INFINITY, 0.0f64), |(least, most), d| (least.min(d), most.max(d)));
    // Squares of distances near the ends of a double's range are no numbers, and coincident points have no direction.
    if !(least > f64::MIN_POSITIVE && most < f64::MAX) {
        return mean_at_extremes(spacing, power, present, neighbours);
    }
    let scale = if power >= 0.0 { most } else { least };
    barycentre::mean(neighbours.map(|n| {
        let d = squared(&n);
        let away = spacing / d.sqrt();
        let place = |k: usize| n.position[k] + away * (present[k] - n.position[k]);
        Neighbour { position: [place(0), place(1)], weight: n.weight * raised(d / scale, 0.5 * power), ..n }
    }))
}

/// A power of a positive number: few multiplications where the exponent is a small whole number, which is what scenes
/// have.
#[inline]
fn raised(base: f64, exponent: f64) -> f64 {
    let size = exponent.abs();
    if size > 8.0 || size != size.trunc() {
        return base.powf(exponent);
    }
    let product = (0..size as u32).fold(1.0, |product, _| product * base);
    if exponent < 0.0 { 1.0 / product } else { product }
}

/// The same for distances of any size, none included.
fn mean_at_extremes(
    spacing: f64,
    power: f64,
    present: [f64; 2],
    neighbours: impl Iterator<Item = Neighbour> + Clone,
) -> Option<[f64; 2]> {
    barycentre::mean(distance::weighted(power, present, neighbours).map(|n| {
        let apart = crate::flock::vectors::distance(present, n.position);
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
    fn near_the_ends_of_the_range_and_in_it_the_mean_is_the_same() {
        let around = [[0.3, 0.4], [-1.2, 0.1], [0.2, -2.5]];
        for power in [-4.0, -3.0, 0.0, 1.0, 2.0, 20.0] {
            let here = [0.1, -0.2];
            let fast = mean(1.0, power, here, at(&around)).expect("has neighbours");
            let slow = mean_at_extremes(1.0, power, here, at(&around)).expect("has neighbours");
            let off = (fast[0] - slow[0]).hypot(fast[1] - slow[1]);
            assert!(off < 1e-14, "{power}: {off:e}");
            for unit in [1e-200, 1e200] {
                let scaled = around.map(|p| p.map(|v| v * unit));
                let found = mean(unit, power, here.map(|v| v * unit), at(&scaled)).expect("has neighbours");
                let off = (found[0] / unit - slow[0]).hypot(found[1] / unit - slow[1]);
                assert!(off < 1e-13, "{power} {unit:e}: {off:e}");
            }
        }
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
