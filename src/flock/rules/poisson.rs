//! The Poisson term, the paper's Eq. 2: `y_j(t) = K (x_j(t) - x_j(t0)) da + mean`, which lets a
//! displacement along the axis of pull move particles across it.
//!
//! `da` is a function of the distance `s` from the central axis: here `sign(s) |s/h|^exponent` with
//! `h` the half width, so that `K` has no unit and its sign alone says whether the sides come
//! together. The term is added at every step and the mean only spreads it, so the response grows
//! with the square of the body's size in particles: choose `K` for the body at hand.

use super::ParticleState;

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate.
    Y,
}

/// Eq. 2 with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Poisson {
    /// `K` \[1\]: response per unit of displacement along `axis`; negative draws the sides together where that is positive.
    pub k: f64,
    /// The axis whose displacement acts (the paper's x).
    pub axis: Axis,
    /// Coordinate of the central axis, across `axis` \[length\].
    pub centre: f64,
    /// Half width of the body across `axis` \[length\], greater than 0.
    pub half_width: f64,
    /// Exponent of the distance function: 1 linear, 0 its sign alone.
    pub exponent: f64,
}

/// How near the axis a particle is on it, over the half width or the distance of the axis from zero, whichever is more.
const ON_AXIS: f64 = 1e-12;

impl Poisson {
    /// Distance function `da` \[1\] at a reference position \[length\].
    pub(crate) fn distance_from_axis(&self, reference: [f64; 2]) -> f64 {
        let across = match self.axis {
            Axis::X => reference[1],
            Axis::Y => reference[0],
        };
        let s = (across - self.centre) / self.half_width;
        // On the axis but for rounding, which a small exponent would blow up.
        let rounding = ON_AXIS * f64::max(1.0, (self.centre / self.half_width).abs());
        if s == 0.0 || self.exponent < 1.0 && s.abs() <= rounding {
            return 0.0;
        }
        s.signum() * s.abs().powf(self.exponent)
    }

    /// Adds the term to a target whose coordinate along `axis` is the new one already.
    pub fn add(&self, own: &ParticleState, target: &mut [f64; 2]) {
        let (along, across) = match self.axis {
            Axis::X => (0, 1),
            Axis::Y => (1, 0),
        };
        target[across] +=
            self.k * (target[along] - own.reference[along]) * self.distance_from_axis(own.reference);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pull_along_x_draws_both_sides_towards_the_axis() {
        let poisson = Poisson { k: -0.1, axis: Axis::X, centre: 2.0, half_width: 2.0, exponent: 1.0 };
        let moved = |y: f64| {
            let own = ParticleState { present: [0.0, y], reference: [0.0, y], rest: [0.0; 2], load: None };
            let mut target = [1.0, y];
            poisson.add(&own, &mut target);
            target[1] - y
        };
        assert!((moved(4.0) + 0.1).abs() < 1e-15);
        assert!((moved(0.0) - 0.1).abs() < 1e-15);
        assert_eq!(moved(2.0), 0.0);
    }

    #[test]
    fn rounding_puts_no_particle_off_the_axis() {
        let on = |centre: f64, exponent: f64| {
            Poisson { k: 1.0, axis: Axis::X, centre, half_width: 0.2, exponent }
                .distance_from_axis([0.0, 0.1 + 0.2])
        };
        assert_eq!([on(0.3, 0.0), on(0.3, 0.5), on(0.2, 0.0), on(0.4, 0.0)], [0.0, 0.0, 1.0, -1.0]);
    }
}
