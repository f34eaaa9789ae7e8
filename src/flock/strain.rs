//! Strain and rotation of a particle's surroundings, from its neighbours' displacements.
//!
//! The deformation gradient `F` is the one that takes the neighbours' places about the particle nearest to
//! their present ones (least squares; M. L. Falk and J. S. Langer, *Dynamics of viscoplastic deformation in
//! amorphous solids*, 1998, Eq. 2.11-2.14). With `F = R U` the rotation is that of `R`, the strain `U - 1`: a
//! body or a formation turned by any angle is not strained.

use super::law::Flock;
use super::vectors::Vectors;

/// Strain and rotation of a particle's surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strain {
    /// `xx, yy, xy` of the right stretch less one, in the axes of the reference configuration \[1\].
    pub components: [f64; 3],
    /// \[rad\], counter-clockwise, from -pi to pi.
    pub rotation: f64,
}

impl Strain {
    /// The principal strain largest in size \[1\].
    pub fn largest(&self) -> f64 {
        let [xx, yy, xy] = self.components;
        let (middle, radius) = (0.5 * (xx + yy), f64::hypot(0.5 * (xx - yy), xy));
        middle.abs() + radius
    }
}

/// Of one particle over its live neighbours; `None` where these lie on a line, or are fewer than two.
pub fn strain(flock: &Flock, particle: usize, present: &Vectors) -> Option<Strain> {
    strain_among(flock, particle, flock.live_neighbours(particle), present)
}

/// The same over these neighbours, as those that were bonded at an earlier step.
pub(crate) fn strain_among(
    flock: &Flock,
    particle: usize,
    neighbours: impl Iterator<Item = usize>,
    present: &Vectors,
) -> Option<Strain> {
    let pairs = neighbours.map(|k| (flock.reference.get(k), present.get(k)));
    of_pairs((flock.reference.get(particle), present.get(particle)), pairs)
}

/// From places in the reference configuration and at present, of the particle and of its neighbours.
fn of_pairs(own: ([f64; 2], [f64; 2]), pairs: impl Iterator<Item = ([f64; 2], [f64; 2])>) -> Option<Strain> {
    let (mut then_then, mut now_then) = ([0.0; 3], [[0.0; 2]; 2]);
    let mut unit = None;
    for (reference, present) in pairs {
        let then = [reference[0] - own.0[0], reference[1] - own.0[1]];
        let now = [present[0] - own.1[0], present[1] - own.1[1]];
        // Products of four distances stay in range in a unit of their size.
        let unit = *unit.get_or_insert_with(|| inverse_size(then));
        let [then, now] = [then, now].map(|[x, y]| [unit * x, unit * y]);
        then_then[0] += then[0] * then[0];
        then_then[1] += then[1] * then[1];
        then_then[2] += then[0] * then[1];
        for a in 0..2 {
            for b in 0..2 {
                now_then[a][b] += now[a] * then[b];
            }
        }
    }
    let [xx, yy, xy] = then_then;
    let determinant = xx * yy - xy * xy;
    // Neighbours on a line leave one direction unknown, also where rounding has moved them off it.
    if determinant.is_nan() || determinant <= 1e-13 * xx.max(yy) * xx.max(yy) {
        return None;
    }
    let inverse = [[yy / determinant, -xy / determinant], [-xy / determinant, xx / determinant]];
    let f = super::block::product(&now_then, &inverse);
    let rotation = f64::atan2(f[1][0] - f[0][1], f[0][0] + f[1][1]);
    let (sin, cos) = rotation.sin_cos();
    let u = super::block::product(&[[cos, sin], [-sin, cos]], &f);
    let components = [u[0][0] - 1.0, u[1][1] - 1.0, 0.5 * (u[0][1] + u[1][0])];
    components.iter().all(|c| c.is_finite()).then_some(Strain { components, rotation })
}

/// The inverse of a vector's size, roughly: a power of two, by which a product keeps its digits.
fn inverse_size([x, y]: [f64; 2]) -> f64 {
    let exponent = x.abs().max(y.abs()).to_bits() >> 52;
    // The largest exponents have no inverse that is a normal number.
    f64::from_bits((2046 - exponent.clamp(1, 2045)) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    const AROUND: [[f64; 2]; 3] = [[3.0, 2.0], [1.5, 3.5], [2.5, 1.0]];

    fn of(map: impl Fn([f64; 2]) -> [f64; 2]) -> Option<Strain> {
        let own = [2.0, 2.0];
        of_pairs((own, map(own)), AROUND.into_iter().map(|at| (at, map(at))))
    }

    #[test]
    fn a_turned_and_moved_body_is_not_strained() {
        let (sin, cos) = 2.5_f64.sin_cos();
        let found = of(|[x, y]| [7.0 + cos * x - sin * y, sin * x + cos * y]).expect("spanned");
        assert!(found.components.iter().all(|c| c.abs() < 1e-14), "{found:?}");
        assert!((found.rotation - 2.5).abs() < 1e-14);
    }

    #[test]
    fn stretch_and_shear_are_distinguished() {
        let found = of(|[x, y]| [1.1 * x, 0.8 * y]).expect("spanned");
        assert!((found.components[0] - 0.1).abs() < 1e-14 && (found.components[1] + 0.2).abs() < 1e-14);
        assert!((found.largest() - 0.2).abs() < 1e-14);
        let sheared = of(|[x, y]| [x + 0.02 * y, y]).expect("spanned");
        assert!((sheared.components[2] - 0.01).abs() < 1e-4 && (sheared.rotation + 0.01).abs() < 1e-4);
    }

    #[test]
    fn the_unit_of_lengths_is_of_no_account_to_the_last_bit() {
        let own = [2.0, 2.0];
        let in_units = |unit: f64, around: &[[f64; 2]]| {
            let sheared = |[x, y]: [f64; 2]| [1.1 * x + 0.02 * y, 0.8 * y];
            let pair = |at: [f64; 2]| (at.map(|x| unit * x), sheared(at).map(|x| unit * x));
            of_pairs(pair(own), around.iter().map(|&at| pair(at)))
        };
        let ordinary = in_units(1.0, &AROUND).expect("spanned");
        for exponent in [-498, -280, 1, 259, 498] {
            let unit = 2.0_f64.powi(exponent);
            assert_eq!(in_units(unit, &AROUND), Some(ordinary), "1e{:.0}", unit.log10());
            assert_eq!(in_units(unit, &[[3.0, 3.0], [1.0, 1.0]]), None);
        }
        for unit in [1e-152, 1e-150, 1e-82, 1e78, 1e80, 1e150, 1e152] {
            let found = in_units(unit, &AROUND).expect("spanned");
            let apart = (0..3).map(|k| (found.components[k] - ordinary.components[k]).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-14, "{unit:e}: {found:?}");
        }
    }

    #[test]
    fn neighbours_may_be_far_farther_along_one_axis_than_along_the_other() {
        for apart in [1e5, 1e-6] {
            let around = [[apart, 0.0], [-apart, 0.0], [0.0, 1.0]];
            let pairs = around.map(|[x, y]| ([x, y], [1.1 * x + 0.2 * y, 0.8 * y]));
            let found = of_pairs(([0.0; 2], [0.0; 2]), pairs.into_iter()).expect("spanned");
            let [c, s] = [found.rotation.cos(), found.rotation.sin()];
            assert!((found.components[0] - (1.1 * c - 1.0)).abs() < 1e-12, "{found:?}");
            assert!((found.rotation - f64::atan2(-0.2, 1.9)).abs() < 1e-12 && s < 0.0, "{found:?}");
        }
    }

    #[test]
    fn neighbours_on_a_line_say_nothing() {
        let line = [[1.0, 1.0], [3.0, 3.0]].map(|at| (at, at));
        assert_eq!(of_pairs(([2.0, 2.0], [2.0, 2.0]), line.into_iter()), None);
        assert_eq!(of_pairs(([2.0, 2.0], [2.0, 2.0]), std::iter::empty()), None);
        // Of rounding no direction can be known.
        let level = [[1.0, 0.3], [3.0, 0.1 + 0.2]].map(|at| (at, at));
        assert_eq!(of_pairs(([2.0, 0.3], [2.0, 0.3]), level.into_iter()), None);
    }
}
