//! Stress at particles from the stress of the cells, where the outline and what acts on it are known.
//!
//! Cells of lowest order have one stress each, right to first order in the middle. At a free edge an average of those around
//! a particle is half a cell off, which at the crown of a hole is a tenth of the stress and more. Here the stresses of
//! the cells within a few spacings are fitted by fields that are in equilibrium and compatible by themselves, the
//! polynomials of Kolosov and Muskhelishvili (N. I. Muskhelishvili, *Some basic problems of the mathematical theory of
//! elasticity*, 1953, ch. 5), and that have on the outline the tractions which are known there (the idea of
//! equilibrated patch recovery: N.-E. Wiberg and F. Abdulwahab, Int. J. Numer. Meth. Eng. 36, 1993).
//!
//! Isotropic materials without body force only: for others an average is taken.

use nalgebra::{Complex, DMatrix, DVector};

/// Degree of the potentials: stresses are polynomials of this degree.
const DEGREE: usize = 3;
/// Cells within so many spacings take part.
pub const REACH: f64 = 3.5;
/// Weight of a known traction against that of a cell of average size.
const TRACTION_WEIGHT: f64 = 4.0;
/// Fewer cells than this say too little.
const FEWEST_CELLS: usize = 6;
/// Unknowns of the fit.
const UNKNOWNS: usize = 4 * DEGREE + 3;

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

/// Stress (xx, yy, xy) \[force / length^2\] at a point \[length\], from cells and tractions within [`REACH`] spacings of it;
/// `None` where they are too few.
pub fn stress_at(
    point: [f64; 2],
    spacing: f64,
    cells: &[CellStress],
    tractions: &[KnownTraction],
) -> Option<[f64; 3]> {
    if cells.len() < FEWEST_CELLS {
        return None;
    }
    let reach = REACH * spacing;
    let mean_area = cells.iter().map(|cell| cell.area).sum::<f64>() / cells.len() as f64;
    let rows = 3 * cells.len() + tractions.len();
    let (mut matrix, mut right) = (DMatrix::zeros(rows, UNKNOWNS), DVector::zeros(rows));
    let relative = |p: [f64; 2]| Complex::new(p[0] - point[0], p[1] - point[1]) / reach;
    for (k, cell) in cells.iter().enumerate() {
        let weight = (cell.area / mean_area).sqrt();
        for (column, stress) in fields(relative(cell.centroid)).into_iter().enumerate() {
            (0..3).for_each(|c| matrix[(3 * k + c, column)] = weight * stress[c]);
        }
        (0..3).for_each(|c| right[3 * k + c] = weight * cell.stress[c]);
    }
    for (k, known) in tractions.iter().enumerate() {
        let (row, [nx, ny], [dx, dy]) = (3 * cells.len() + k, known.normal, known.direction);
        for (column, [xx, yy, xy]) in fields(relative(known.point)).into_iter().enumerate() {
            matrix[(row, column)] =
                TRACTION_WEIGHT * (nx * dx * xx + ny * dy * yy + (nx * dy + ny * dx) * xy);
        }
        right[row] = TRACTION_WEIGHT * known.value;
    }
    let fit = matrix.svd(true, true).solve(&right, 1e-10).ok()?;
    let here = fields(Complex::new(0.0, 0.0));
    let stress: [f64; 3] = std::array::from_fn(|c| (0..UNKNOWNS).map(|k| fit[k] * here[k][c]).sum());
    stress.iter().all(|s| s.is_finite()).then_some(stress)
}

/// Stresses (xx, yy, xy) at `z` of each potential: `xx + yy = 4 Re phi'`, `yy - xx + 2 i xy = 2 (conj(z) phi'' + psi')`.
fn fields(z: Complex<f64>) -> [[f64; 3]; UNKNOWNS] {
    let mut columns = [[0.0; 3]; UNKNOWNS];
    let mut next = 0;
    let mut push = |trace: f64, deviator: Complex<f64>| {
        columns[next] = [(trace - deviator.re) / 2.0, (trace + deviator.re) / 2.0, deviator.im / 2.0];
        next += 1;
    };
    for degree in 0..=DEGREE as i32 {
        for unit in [Complex::new(1.0, 0.0), Complex::new(0.0, 1.0)] {
            // The imaginary constant is a rotation.
            if degree > 0 || unit.im == 0.0 {
                let slope = if degree == 0 {
                    Complex::new(0.0, 0.0)
                } else {
                    unit * z.powi(degree - 1) * f64::from(degree)
                };
                push(4.0 * (unit * z.powi(degree)).re, 2.0 * z.conj() * slope);
            }
            push(0.0, 2.0 * unit * z.powi(degree));
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let found = stress_at([0.0, 1.0], 0.1, &around([0.0, 1.0], 0.1, bending), &[]).expect("enough cells");
        let exact = bending([0.0, 1.0]);
        assert!((0..3).all(|c| (found[c] - exact[c]).abs() < 1e-9), "{found:?}");
        assert_eq!(stress_at([0.0, 1.0], 0.1, &[], &[]), None);
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
            let found = stress_at([0.0, 1.0], spacing, &cells, &tractions).expect("enough cells");
            assert!((found[0] / 3.0 - 1.0).abs() < bound, "{spacing}: {found:?}");
            let without = stress_at([0.0, 1.0], spacing, &cells, &[]).expect("enough cells");
            assert!((found[0] - 3.0).abs() <= (without[0] - 3.0).abs() + 1e-3);
        }
    }
}
