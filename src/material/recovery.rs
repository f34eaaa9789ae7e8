//! Stress at particles from the stress of the cells, where the outline and what acts on it are known.
//!
//! Cells of lowest order have one stress each, right to first order in the middle. At a free edge an average of those around
//! a particle is half a cell off, which at the crown of a hole is a tenth of the stress and more. Here the stresses of
//! the cells within a few spacings are fitted by fields that are in equilibrium and compatible by themselves, polynomials
//! of G. B. Airy's stress function that obey the equation which it has in an anisotropic material (S. G. Lekhnitskii,
//! *Anisotropic Plates*, 1968, section 5; in an isotropic one the biharmonic equation), and that have on the outline
//! the tractions which are known there (the idea of equilibrated patch recovery: N.-E. Wiberg and F. Abdulwahab, Int. J.
//! Numer. Meth. Eng. 36, 1993).
//!
//! In a material soft in shear what falls off from an edge within less than a cell is felt by the cells beside it, and is nothing that
//! such fields follow: as compatibility makes a stress along the fibres of a slope of the shear stress, times the ratio of the moduli,
//! tractions would come out of errors. There the fields are in equilibrium alone, one degree lower.
//!
//! The fields balance no body force: the caller takes a stress that balances it off cells and tractions beforehand.

use std::f64::consts::SQRT_2;

use nalgebra::{DMatrix, DVector};

use super::elastic::Elastic;

/// Stresses are polynomials of this degree.
const DEGREE: usize = 3;
/// Cells within so many spacings take part.
pub const REACH: f64 = 3.5;
/// Weight of a known traction against that of a cell of average size.
const TRACTION_WEIGHT: f64 = 4.0;
/// Fewer cells than this say too little.
pub const FEWEST_CELLS: usize = 6;
/// Softness in shear ([`Elastic::softness_in_shear`]) from which on fields need not be compatible: where both kinds are about as far from
/// finite elements, one spacing from the clamped end of a strip that is pulled \[1\].
const SOFT: f64 = 15.0;
/// Degree of the stress functions.
const HIGHEST: usize = DEGREE + 2;

/// A cell as the fit sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellStress {
    /// \[length\]
    pub centroid: [f64; 2],
    /// \[length^2\]
    pub area: f64,
    /// In-plane stress (xx, yy, xy) \[force / length^2\].
    pub stress: [f64; 3],
}

/// A place of the outline where a component of the traction is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownTraction {
    /// \[length\]
    pub point: [f64; 2],
    /// Outward normal, of length 1.
    pub normal: [f64; 2],
    /// Direction of the component, of length 1.
    pub direction: [f64; 2],
    /// \[force / length^2\]
    pub value: f64,
}

/// The stress functions of a material, each the sum of `factors[p] x^(degree - p) y^p`.
#[derive(Clone, Debug)]
pub struct Fields(Vec<(usize, [f64; HIGHEST + 1])>);

impl Fields {
    /// Of degrees 2 to 5. Compatible strains need `sum_r c_r d^4 f / dx^(4-r) dy^r = 0`: powers of y up to the third are
    /// free, each further one is what that leaves. In a material soft in shear all of degrees 2 to 4 are free.
    pub fn of(elastic: &Elastic) -> Self {
        let [a, b, c] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|s| elastic.strain(s));
        let operator = [b[1], -2.0 * c[1], 2.0 * b[0] + c[2], -2.0 * c[0], a[0]];
        let mut fields = Vec::new();
        let is_soft = elastic.softness_in_shear() > SOFT;
        let (highest, most_free) = if is_soft { (HIGHEST - 1, HIGHEST) } else { (HIGHEST, 3) };
        for (degree, free) in (2..=highest).flat_map(|m| (0..=m.min(most_free)).map(move |free| (m, free))) {
            let mut factors = [0.0; HIGHEST + 1];
            factors[free] = 1.0;
            for q in (0..(degree + 1).saturating_sub(4)).filter(|_| !is_soft) {
                let of = |r: usize| operator[r] * falling(degree - q - r, 4 - r) * falling(q + r, r);
                let left: f64 = (0..4).map(|r| of(r) * factors[q + r]).sum();
                factors[q + 4] = -left / of(4);
            }
            fields.push((degree, factors));
        }
        Self(fields)
    }

    /// Stresses (xx, yy, xy) of each at a place.
    fn at(&self, [x, y]: [f64; 2]) -> impl Iterator<Item = [f64; 3]> {
        let powers = |v: f64| std::array::from_fn::<f64, HIGHEST, _>(|k| v.powi(k as i32));
        let (x, y) = (powers(x), powers(y));
        self.0.iter().map(move |(degree, factors)| {
            let mut stress = [0.0; 3];
            for p in 0..=*degree {
                let (factor, q) = (factors[p], degree - p);
                if p >= 2 {
                    stress[0] += factor * falling(p, 2) * x[q] * y[p - 2];
                }
                if q >= 2 {
                    stress[1] += factor * falling(q, 2) * x[q - 2] * y[p];
                }
                if p >= 1 && q >= 1 {
                    stress[2] -= factor * (p * q) as f64 * x[q - 1] * y[p - 1];
                }
            }
            stress
        })
    }
}

/// `n (n - 1) ... (n - k + 1)`: what k derivatives of the n-th power leave.
fn falling(n: usize, k: usize) -> f64 {
    (0..k).map(|i| n as f64 - i as f64).product()
}

/// Stress (xx, yy, xy) \[force / length^2\] at a point \[length\], from cells and tractions within [`REACH`] spacings of it;
/// `None` where they are too few.
pub fn stress_at(
    (point, spacing): ([f64; 2], f64),
    fields: &Fields,
    cells: &[CellStress],
    tractions: &[KnownTraction],
) -> Option<[f64; 3]> {
    if cells.len() < FEWEST_CELLS {
        return None;
    }
    let reach = REACH * spacing;
    let mean_area = cells.iter().map(|cell| cell.area).sum::<f64>() / cells.len() as f64;
    let rows = 3 * cells.len() + tractions.len();
    let unknowns = fields.0.len();
    let (mut matrix, mut right) = (DMatrix::zeros(rows, unknowns), DVector::zeros(rows));
    let relative = |p: [f64; 2]| [0, 1].map(|k| (p[k] - point[k]) / reach);
    for (k, cell) in cells.iter().enumerate() {
        let weight = (cell.area / mean_area).sqrt();
        // The square of a tensor has its shear twice: weighed otherwise, the fit would depend on how the axes are turned.
        let weight = [weight, weight, weight * SQRT_2];
        for (column, stress) in fields.at(relative(cell.centroid)).enumerate() {
            (0..3).for_each(|c| matrix[(3 * k + c, column)] = weight[c] * stress[c]);
        }
        (0..3).for_each(|c| right[3 * k + c] = weight[c] * cell.stress[c]);
    }
    for (k, known) in tractions.iter().enumerate() {
        let (row, [nx, ny], [dx, dy]) = (3 * cells.len() + k, known.normal, known.direction);
        for (column, [xx, yy, xy]) in fields.at(relative(known.point)).enumerate() {
            matrix[(row, column)] =
                TRACTION_WEIGHT * (nx * dx * xx + ny * dy * yy + (nx * dy + ny * dx) * xy);
        }
        right[row] = TRACTION_WEIGHT * known.value;
    }
    let fit = matrix.svd(true, true).solve(&right, 1e-10).ok()?;
    let here: Vec<[f64; 3]> = fields.at([0.0; 2]).collect();
    let stress: [f64; 3] = std::array::from_fn(|c| fit.iter().zip(&here).map(|(k, of)| k * of[c]).sum());
    stress.iter().all(|s| s.is_finite()).then_some(stress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::elastic::{Constants, Plane};

    fn sheet() -> Elastic {
        let constants = Constants::Isotropic { young: 1.0, poisson: 0.3, plane: Plane::Stress };
        Elastic::new(constants, 1.0).expect("admissible")
    }

    fn fibres(angle: f64) -> Elastic {
        let constants = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle };
        Elastic::new(constants, 0.5).expect("admissible")
    }

    fn fabric() -> Elastic {
        let constants = Constants::Orthotropic { young: [9.0, 9.0], poisson_12: 0.3, shear: 0.1, angle: 0.4 };
        Elastic::new(constants, 1.0).expect("admissible")
    }

    #[test]
    fn every_field_is_in_equilibrium_and_its_strains_fit_together() {
        for elastic in [sheet(), fibres(0.0), fibres(0.5), fabric()] {
            let (fields, h, place) = (Fields::of(&elastic), 0.1, [0.3, -0.7]);
            let stress = |n: usize, i: i32, j: i32| {
                let at = [place[0] + h * f64::from(i), place[1] + h * f64::from(j)];
                fields.at(at).nth(n).expect("a field")
            };
            for n in 0..fields.0.len() {
                // Central differences are exact for quadratics; of cubics the divergence needs the wider ones.
                let slope = |c: usize, [i, j]: [i32; 2]| {
                    let by = |k: i32| stress(n, k * i, k * j)[c] - stress(n, -k * i, -k * j)[c];
                    (8.0 * by(1) - by(2)) / (12.0 * h)
                };
                let left = [slope(0, [1, 0]) + slope(2, [0, 1]), slope(2, [1, 0]) + slope(1, [0, 1])];
                assert!(left.iter().all(|f| f.abs() < 1e-10), "{n}: {left:?}");
                if elastic == fabric() {
                    continue;
                }
                let strain = |i: i32, j: i32| elastic.strain(stress(n, i, j));
                let second = |c: usize, [i, j]: [i32; 2]| {
                    (strain(i, j)[c] - 2.0 * strain(0, 0)[c] + strain(-i, -j)[c]) / (h * h)
                };
                let mixed = strain(1, 1)[2] - strain(1, -1)[2] - strain(-1, 1)[2] + strain(-1, -1)[2];
                let unfit = second(0, [0, 1]) + second(1, [1, 0]) - mixed / (4.0 * h * h);
                assert!(unfit.abs() < 1e-10, "{n}: {unfit}");
            }
        }
    }

    /// Around a hole of radius 1 under tension along x (G. Kirsch, 1898).
    fn kirsch([x, y]: [f64; 2]) -> [f64; 3] {
        let (r2, t) = (x * x + y * y, y.atan2(x));
        let (a, b) = (1.0 / r2, 1.5 / (r2 * r2));
        let xx = 1.0 - a * (1.5 * (2.0 * t).cos() + (4.0 * t).cos()) + b * (4.0 * t).cos();
        let yy = -a * (0.5 * (2.0 * t).cos() - (4.0 * t).cos()) - b * (4.0 * t).cos();
        let xy = -a * (0.5 * (2.0 * t).sin() + (4.0 * t).sin()) + b * (4.0 * t).sin();
        [xx, yy, xy]
    }

    fn around(point: [f64; 2], spacing: f64, field: impl Fn([f64; 2]) -> [f64; 3]) -> Vec<CellStress> {
        let cells = (-30..30).flat_map(|i| (-30..30).map(move |j| [i, j]));
        let centroid =
            |[i, j]: [i32; 2]| [(f64::from(i) + 0.3) * spacing, 1.0 + (f64::from(j) + 0.4) * spacing];
        cells
            .map(centroid)
            .filter(|p| p[0].hypot(p[1]) > 1.0 + 0.3 * spacing)
            .filter(|p| (p[0] - point[0]).hypot(p[1] - point[1]) < REACH * spacing)
            .map(|p| CellStress { centroid: p, area: spacing * spacing, stress: field(p) })
            .collect()
    }

    #[test]
    fn a_bent_beam_s_stress_is_recovered_exactly() {
        let bending = |[x, y]: [f64; 2]| [3.0 * y + 0.5 * x * y, 0.0, 0.25 * (1.0 - y * y)];
        let (here, cells) = (([0.0, 1.0], 0.1), around([0.0, 1.0], 0.1, bending));
        for elastic in [sheet(), fibres(0.0)] {
            let found = stress_at(here, &Fields::of(&elastic), &cells, &[]).expect("enough cells");
            let exact = bending([0.0, 1.0]);
            assert!((0..3).all(|c| (found[c] - exact[c]).abs() < 1e-9), "{found:?}");
        }
        assert_eq!(stress_at(here, &Fields::of(&sheet()), &[], &[]), None);
    }

    #[test]
    fn the_crown_of_a_hole_has_three_times_the_tension() {
        for (spacing, bound) in [(0.125, 0.035), (0.0625, 0.008)] {
            let cells = around([0.0, 1.0], spacing, kirsch);
            let free = |k: i32| {
                let angle = std::f64::consts::FRAC_PI_2 + f64::from(k) * spacing;
                let normal = [-angle.cos(), -angle.sin()];
                let point = normal.map(|n| -n);
                [normal, [-normal[1], normal[0]]].map(|direction| KnownTraction {
                    point,
                    normal,
                    direction,
                    value: 0.0,
                })
            };
            let tractions: Vec<KnownTraction> = (-3..=3).flat_map(free).collect();
            let (here, fields) = (([0.0, 1.0], spacing), Fields::of(&sheet()));
            let found = stress_at(here, &fields, &cells, &tractions).expect("enough cells");
            assert!((found[0] / 3.0 - 1.0).abs() < bound, "{spacing}: {found:?}");
            let without = stress_at(here, &fields, &cells, &[]).expect("enough cells");
            assert!((found[0] - 3.0).abs() <= (without[0] - 3.0).abs() + 1e-3);
        }
    }
}
