//! Strain from the gradient of the displacement, and its derivatives.
//!
//! The gradient F = 1 + h is a turn R times a stretch U; in the plane the angle of R obeys
//! tan t = (F_yx - F_xy) / (F_xx + F_yy). Where bodies turn far the strain is U - 1 (M. A. Biot, *Mechanics of Incremental
//! Deformations*, 1965): no turn is a strain, and the energy is half of strain times D times strain as at small turns.
//! Gradients are given as (xx, xy, yx, yy), the displacement's component first.

/// The measure of strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Strain {
    /// The symmetric part of the gradient: right as long as nothing turns by more than some degrees.
    #[default]
    Small,
    /// The stretch less one.
    Stretch,
}

/// The turn at a point and its first two derivatives by the gradient.
struct Turn {
    cos: f64,
    sin: f64,
    slope: [f64; 4],
    bend: [[f64; 4]; 4],
}

impl Turn {
    fn of(h: [f64; 4]) -> Self {
        let (trace, skew) = (2.0 + h[0] + h[3], h[2] - h[1]);
        let square = trace * trace + skew * skew;
        let (cos, sin) = (trace / square.sqrt(), skew / square.sqrt());
        let (by_trace, by_skew) = (-skew / square, trace / square);
        let (twice, mixed) =
            (2.0 * trace * skew / (square * square), (skew * skew - trace * trace) / (square * square));
        let (a, b) = ([1.0, 0.0, 0.0, 1.0], [0.0, -1.0, 1.0, 0.0]);
        let slope = std::array::from_fn(|i| by_trace * a[i] + by_skew * b[i]);
        let bend =
            |i: usize, j: usize| twice * (a[i] * a[j] - b[i] * b[j]) + mixed * (a[i] * b[j] + b[i] * a[j]);
        let bend = std::array::from_fn(|i| std::array::from_fn(|j| bend(i, j)));
        Self { cos, sin, slope, bend }
    }

    /// The stretch less one: (xx, yy, twice xy).
    fn strain(&self, h: [f64; 4]) -> [f64; 3] {
        let (c, s) = (self.cos, self.sin);
        // cos t - 1 to all its digits.
        let fall = if c > 0.0 { -s * s / (1.0 + c) } else { c - 1.0 };
        [c * h[0] + s * h[2] + fall, c * h[3] - s * h[1] + fall, c * (h[1] + h[2]) + s * (h[3] - h[0])]
    }

    /// Derivative of each strain by the gradient at a turn that stays, and that by the turn.
    fn partial(&self, [xx, yy, xy]: [f64; 3]) -> ([[f64; 4]; 3], [f64; 3]) {
        let (c, s) = (self.cos, self.sin);
        ([[c, 0.0, s, 0.0], [0.0, -s, 0.0, c], [-s, c, c, s]], [0.5 * xy, -0.5 * xy, yy - xx])
    }
}

impl Strain {
    /// How far the surroundings of a point are turned \[rad\].
    pub(crate) fn turn(h: [f64; 4]) -> f64 {
        (h[2] - h[1]).atan2(2.0 + h[0] + h[3])
    }

    /// (xx, yy, engineering xy) \[1\].
    pub(crate) fn of(self, h: [f64; 4]) -> [f64; 3] {
        match self {
            Strain::Small => [h[0], h[3], h[1] + h[2]],
            Strain::Stretch => Turn::of(h).strain(h),
        }
    }

    /// Derivatives of the strain by the gradient.
    pub(crate) fn slope(self, h: [f64; 4]) -> [[f64; 4]; 3] {
        match self {
            Strain::Small => [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]],
            Strain::Stretch => {
                let turn = Turn::of(h);
                let (at_rest, by_turn) = turn.partial(turn.strain(h));
                std::array::from_fn(|k| std::array::from_fn(|i| at_rest[k][i] + by_turn[k] * turn.slope[i]))
            }
        }
    }

    /// Second derivatives of the energy density by the gradient, `d` being the material's stiffness [N/m2].
    pub(crate) fn tangent(self, h: [f64; 4], d: &[[f64; 3]; 3]) -> [[f64; 4]; 4] {
        let slope = self.slope(h);
        let stressed = |k: usize, j: usize| (0..3).map(|l| d[k][l] * slope[l][j]).sum::<f64>();
        let product = |i: usize, j: usize| (0..3).map(|k| slope[k][i] * stressed(k, j)).sum();
        let mut tangent: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)));
        if self == Strain::Stretch {
            let turn = Turn::of(h);
            let strain = turn.strain(h);
            let [xx, yy, xy] = strain;
            let (c, s) = (turn.cos, turn.sin);
            let (_, by_turn) = turn.partial(strain);
            let mixed = [[-s, 0.0, c, 0.0], [0.0, -c, 0.0, -s], [-c, -s, -s, c]];
            let twice = [-1.0 - xx, -1.0 - yy, -xy];
            for k in 0..3 {
                let stress: f64 = (0..3).map(|l| d[k][l] * strain[l]).sum();
                for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
                    let t = &turn.slope;
                    let crossed = mixed[k][i] * t[j] + mixed[k][j] * t[i] + twice[k] * t[i] * t[j];
                    tangent[i][j] += stress * (crossed + by_turn[k] * turn.bend[i][j]);
                }
            }
        }
        tangent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: [[f64; 3]; 3] = [[3.0, 0.8, 0.2], [0.8, 1.5, -0.1], [0.2, -0.1, 0.7]];

    fn turned(angle: f64, u: [f64; 3]) -> [f64; 4] {
        let ([c, s], [a, b, half]) = ([angle.cos(), angle.sin()], [1.0 + u[0], 1.0 + u[1], 0.5 * u[2]]);
        [c * a - s * half - 1.0, c * half - s * b, s * a + c * half, s * half + c * b - 1.0]
    }

    #[test]
    fn the_stretch_less_one_does_not_know_the_turn() {
        let stretch = [0.1, -0.05, 0.08];
        for angle in [0.0, 1e-9, 0.4, -2.0, 3.1] {
            let found = Strain::Stretch.of(turned(angle, stretch));
            assert!((0..3).all(|k| (found[k] - stretch[k]).abs() < 1e-15), "{angle}: {found:?}");
            assert!((Strain::turn(turned(angle, stretch)) - angle).abs() < 1e-14);
        }
        let tiny = [1e-12, -2e-12, 3e-12];
        let found = Strain::Stretch.of(turned(0.0, tiny));
        assert!((0..3).all(|k| (found[k] - tiny[k]).abs() < 1e-16), "{found:?}");
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let (h, step) = (turned(0.7, [0.1, -0.05, 0.08]), 1e-5);
        for strain in [Strain::Small, Strain::Stretch] {
            let force = |h: [f64; 4]| -> [f64; 4] {
                let (e, slope) = (strain.of(h), strain.slope(h));
                std::array::from_fn(|i| {
                    (0..3).map(|k| slope[k][i] * (0..3).map(|l| D[k][l] * e[l]).sum::<f64>()).sum()
                })
            };
            let tangent = strain.tangent(h, &D);
            for j in 0..4 {
                let moved = |by: f64| std::array::from_fn(|i| if i == j { h[i] + by } else { h[i] });
                let (a, b) = (strain.of(moved(-step)), strain.of(moved(step)));
                for (k, slope) in strain.slope(h).iter().enumerate() {
                    assert!((slope[j] - (b[k] - a[k]) / (2.0 * step)).abs() < 1e-9, "{strain:?} {k} {j}");
                }
                let (a, b) = (force(moved(-step)), force(moved(step)));
                for (i, row) in tangent.iter().enumerate() {
                    let difference = (b[i] - a[i]) / (2.0 * step);
                    assert!(
                        (row[j] - difference).abs() < 1e-8,
                        "{strain:?} {i} {j}: {} {difference}",
                        row[j]
                    );
                }
            }
        }
    }
}
