//! The element stiffness of one cell.
//!
//! Degrees of freedom are the displacements of the corners, x and y of the first, then of the second,
//! and so on. A stiffness in the plane does not change when the cell is scaled, so every cell is
//! brought to unit size (by a power of two, which rounds nothing) before anything is computed from it.
//!
//! * Triangle: constant strain (M. J. Turner et al., 1956).
//! * Quadrilateral: bilinear, 2x2 Gauss points (O. C. Zienkiewicz and R. L. Taylor, *The Finite
//!   Element Method*, vol. 1). Plane strain near nu = 1/2 would lock it, as it would the triangle:
//!   see [`super::dilatation`]. A parallelogram without right angles, and a rectangle of a material that is far too stiff in
//!   bending if its displacement is bilinear ([`Elastic::locks_bilinear`]): assumed stress
//!   (T. H. H. Pian and K. Sumihara, *Rational approach for assumed stress finite elements*, IJNME 20, 1984).
//! * Any other polygon: the virtual element of lowest order (L. Beirao da Veiga, F. Brezzi and
//!   L. D. Marini, *Virtual elements for linear elasticity problems*, SIAM J. Numer. Anal. 51, 2013; in the
//!   form of A. L. Gain, C. Talischi and G. H. Paulino, CMAME 282, 2014). See [`polygon`].
//! * A cell that an outline has cut, of any number of corners: the same virtual element with a stabilisation that
//!   knows how slender the cell is. See [`cut_cell`].

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{DMatrix, DVector, Matrix2, SMatrix, Vector2, Vector3};

use super::elastic::{Elastic, Voigt};
use crate::geometry::point::area;

/// Why a polygon is no cell.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A polygon of one or two corners, or none.
    #[error("a cell needs at least 3 corners, but this one has {corners}")]
    TooFew {
        /// How many it has.
        corners: usize,
    },
    /// A cell of no area, or with its area to the right.
    #[error("the cell has no area to its left: its corners coincide, lie on a line or run clockwise")]
    NoArea,
    /// A quadrilateral that is not convex.
    #[error("the quadrilateral is not convex: it folds over at corner {corner}")]
    Folded {
        /// Number of the corner where it folds over, from 0.
        corner: usize,
    },
}

/// Stiffness of a whole cell of a lattice \[force / length\], shape \[2 corners, 2 corners\], symmetric to the bit: a
/// triangle, a quadrilateral or a virtual element by the number of corners. `corners` \[length\] run
/// counter-clockwise.
pub fn element(corners: &[[f64; 2]], stiffness: &Voigt) -> Result<DMatrix<f64>, ShapeError> {
    whole_cell(corners, [stiffness; 2], (is_oblique(corners), false))
}

/// Stiffness of a cell of a material of which a strain is averaged over several cells: what each cell has to itself
/// ([`Elastic::stiffness_of_cells`]). `cut` asks for [`cut_cell`] instead of [`element`].
///
/// The stabilisation, beside the mean strain, is that of the whole material, which stays bounded as nu goes to 1/2;
/// rectangles are then stabilised as cut cells are, with fibres as parallelograms, which is the same where there are none.
///
/// # Errors
/// As [`element`].
pub fn element_of(corners: &[[f64; 2]], elastic: &Elastic, cut: bool) -> Result<DMatrix<f64>, ShapeError> {
    let (own, whole) = (elastic.stiffness_of_cells(), elastic.stiffness());
    if cut {
        return resistance(corners, &own, |corners| cut_stabilisation(corners, whole));
    }
    let ways = (assumes_stress(corners, elastic), elastic.averaged().is_some());
    whole_cell(corners, [&own, whole], ways)
}

/// Whether the cell has the energy of a displacement that is continuous from cell to cell, as Galerkin's method has it, and no
/// other: triangles and whole rectangles, where no strain is averaged and no stress assumed.
pub fn is_conforming(corners: &[[f64; 2]], elastic: &Elastic, cut: bool) -> bool {
    let is_bilinear = corners.len() == 4 && !cut && !assumes_stress(corners, elastic);
    elastic.averaged().is_none() && (corners.len() == 3 || is_bilinear)
}

/// Whether a whole cell is one of assumed stress.
fn assumes_stress(corners: &[[f64; 2]], elastic: &Elastic) -> bool {
    let Some([along, _]) = sides_of_parallelogram(corners) else { return false };
    let is_rectangle_too = match elastic.averaged() {
        Some(_) => elastic.fibres().is_some(),
        None => elastic.locks_bilinear(along.y.atan2(along.x)),
    };
    is_oblique(corners) || is_rectangle_too
}

/// The cell by what it has to itself, and by the whole material where that is not all of it.
fn whole_cell(
    corners: &[[f64; 2]],
    [own, whole]: [&Voigt; 2],
    (assumes_stress, is_averaged): (bool, bool),
) -> Result<DMatrix<f64>, ShapeError> {
    match corners.len() {
        3 => triangle(corners, own),
        4 if assumes_stress => resistance(corners, own, |corners| bending_of_sides(corners, whole)),
        4 if is_averaged => resistance(corners, own, |corners| cut_stabilisation(corners, whole)),
        4 => quadrilateral(corners, own),
        _ => resistance(corners, own, |corners| stabilisation(corners, whole)),
    }
}

/// The constant-strain triangle.
pub fn triangle(corners: &[[f64; 2]], stiffness: &Voigt) -> Result<DMatrix<f64>, ShapeError> {
    let corners = unit_size(corners)?;
    Ok(symmetric(consistent(&corners, stiffness)))
}

/// The bilinear quadrilateral with 2x2 Gauss points.
pub fn quadrilateral(corners: &[[f64; 2]], stiffness: &Voigt) -> Result<DMatrix<f64>, ShapeError> {
    let corners = unit_size(corners)?;
    let folded = |&k: &usize| cross(corners[k], corners[(k + 1) % 4], corners[(k + 3) % 4]) <= 0.0;
    if let Some(corner) = (0..4).find(folded) {
        return Err(ShapeError::Folded { corner });
    }
    let mut sum = DMatrix::zeros(8, 8);
    for point in gauss_points() {
        let (gradients, area) = bilinear_gradients(&corners, point);
        let b = strain_matrix(&gradients);
        sum += b.transpose() * stiffness * b * area;
    }
    Ok(symmetric(sum))
}

/// The virtual element of lowest order: exact for every affine displacement, on any simple polygon.
///
/// The stiffness is `A B' C B`, `B` the mean strain, plus `alpha (I - P)' (I - P)`, `P` the projection
/// of corner displacements on affine ones. The second term does not touch affine displacements (so
/// the patch test is exact) and resists all others (so only the three rigid motions are free).
///
/// The only choice left is `alpha`. Here it is the value for which *pure bending*, the simplest
/// displacement that is not affine, costs what it costs in the continuum: energies of bending about
/// four axes half a right angle apart are summed, cell and continuum, and made equal. Bending costs
/// Young's modulus, so `alpha` stays finite where the bulk modulus grows without bound (plane
/// strain towards nu = 1/2) and such cells do not lock; four axes are enough for the sum not to
/// depend on how the axes are turned. It is bounded: see `least_residual`.
pub fn polygon(corners: &[[f64; 2]], stiffness: &Voigt) -> Result<DMatrix<f64>, ShapeError> {
    resistance(corners, stiffness, |corners| stabilisation(corners, stiffness))
}

/// Stiffness of the mean strain, and what resists the rest.
fn resistance(
    corners: &[[f64; 2]],
    stiffness: &Voigt,
    rest: impl Fn(&[[f64; 2]]) -> DMatrix<f64>,
) -> Result<DMatrix<f64>, ShapeError> {
    let corners = unit_size(corners)?;
    Ok(symmetric(consistent(&corners, stiffness) + rest(&corners)))
}

/// The second term of [`polygon`].
fn stabilisation(corners: &[[f64; 2]], stiffness: &Voigt) -> DMatrix<f64> {
    let affine = affine_projection(corners).kronecker(&Matrix2::identity());
    let rest = DMatrix::identity(affine.nrows(), affine.ncols()) - affine;
    let alpha = bending_stiffness(corners, stiffness, &rest).min(greatest_stabilisation(corners, stiffness));
    rest.transpose() * rest * alpha
}

/// The virtual element of lowest order of a cell cut by an outline: any simple polygon of at least 3 corners, convex or
/// not, some of them in the middle of a straight side.
///
/// As [`polygon`], but what is not affine is resisted by a tensor for each corner, `T = E (tr J - J) / q`: `J` are the
/// second moments of the cell's area, `q` is the larger of the two ways in which the residuals of the harmonic
/// quadratics `xy` and `(x^2 - y^2) / 2` at the corners add up (see `least_residual` for its bound), `E` is
/// `bending_modulus`. A rectangle bent about its own axes, up to 3.6 times as long as wide, then
/// stores exactly what it does in the continuum; triangles have no residual and are those of constant strain.
///
/// # Errors
/// As [`element`].
pub fn cut_cell(corners: &[[f64; 2]], stiffness: &Voigt) -> Result<DMatrix<f64>, ShapeError> {
    resistance(corners, stiffness, |corners| cut_stabilisation(corners, stiffness))
}

/// The second term of [`cut_cell`].
fn cut_stabilisation(corners: &[[f64; 2]], stiffness: &Voigt) -> DMatrix<f64> {
    let count = corners.len();
    if count == 3 {
        return DMatrix::zeros(6, 6);
    }
    let rest = DMatrix::identity(count, count) - affine_projection(corners);
    (rest.transpose() * rest).kronecker(&bending_tensor(corners, bending_modulus(&AXES, stiffness)))
}

/// The sides of a parallelogram from its first corner \[length\]; `None` of any other polygon.
fn sides_of_parallelogram(corners: &[[f64; 2]]) -> Option<[Vector2<f64>; 2]> {
    let &[a, b, c, d] = corners else { return None };
    let [a, b, c, d] = [a, b, c, d].map(Vector2::from);
    let (along, up) = (b - a, d - a);
    ((a - b + c - d).norm() <= 1e-9 * (along.norm() * up.norm()).sqrt()).then_some([along, up])
}

/// Whether a polygon is a parallelogram without right angles.
fn is_oblique(corners: &[[f64; 2]]) -> bool {
    sides_of_parallelogram(corners)
        .is_some_and(|[along, up]| along.dot(&up).abs() > 1e-9 * (along.norm() * up.norm()))
}

/// The rest of a parallelogram of assumed stress: stress along either pair of sides that grows from one of them to the other
/// is uniaxial, so `T = A / 3 sum E_t t t' / l^2` over the two directions `t`, `l` the length of sides along `t`, `E_t` the modulus of tension
/// along `t`. Bilinear cells resist bending by its direction: with them the error on a ring of cells of 70 degrees falls by
/// order 1.88 from spacing 1/2 to 1/4, with these by 2.03.
fn bending_of_sides(corners: &[[f64; 2]], stiffness: &Voigt) -> DMatrix<f64> {
    let rest = DMatrix::identity(4, 4) - affine_projection(corners);
    let [a, b, d] = [0, 1, 3].map(|k| Vector2::from(corners[k]));
    let tensor: Matrix2<f64> = [b - a, d - a]
        .map(|side| {
            let t = side.normalize();
            t * t.transpose() * (bending_modulus(&[t.into()], stiffness) / side.norm_squared())
        })
        .iter()
        .sum();
    (rest.transpose() * rest).kronecker(&(tensor * (area(corners) / 3.0)))
}

/// The part of a load per area that falls to each corner \[length^2\], shape \[corners\]: the integral of
/// the corner's shape function, on a virtual element of its affine projection. The parts add up to
/// the area, and their centre is the cell's.
pub fn load_shares(corners: &[[f64; 2]]) -> Vec<f64> {
    if corners.len() == 4 {
        let at_point = |point: [f64; 2]| {
            let (_, area) = bilinear_gradients(corners, point);
            bilinear(point).map(|n| n * area)
        };
        let parts = gauss_points().map(at_point);
        return (0..4).map(|k| parts.iter().map(|part| part[k]).sum()).collect();
    }
    cut_load_shares(corners)
}

/// The same of any polygon: on a virtual element the integral of the affine projection of the corner's shape function.
pub fn cut_load_shares(corners: &[[f64; 2]]) -> Vec<f64> {
    let (count, area) = (corners.len() as f64, area(corners));
    let (centre, middle) = (centroid(corners), mean(corners));
    let off = [centre[0] - middle[0], centre[1] - middle[1]];
    mean_gradients(corners).iter().map(|g| area * (1.0 / count + g[0] * off[0] + g[1] * off[1])).collect()
}

/// Mean strain (xx, yy, engineering xy) \[1\] of a cell whose corner `k` moves by `displacement(k)`
/// \[length\].
pub fn mean_strain(corners: &[[f64; 2]], displacement: impl Fn(usize) -> [f64; 2]) -> [f64; 3] {
    // Relative to the first corner: a translation must not cost digits.
    let first = displacement(0);
    mean_gradients(corners).iter().enumerate().fold([0.0; 3], |[xx, yy, xy], (k, g)| {
        let [u, v] = displacement(k);
        let (u, v) = (u - first[0], v - first[1]);
        [xx + g[0] * u, yy + g[1] * v, xy + g[1] * u + g[0] * v]
    })
}

/// The polygon with its first corner at the origin and scaled by a power of two to about unit size.
fn unit_size(corners: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, ShapeError> {
    if corners.len() < 3 {
        return Err(ShapeError::TooFew { corners: corners.len() });
    }
    let [x0, y0] = corners[0];
    let relative: Vec<[f64; 2]> = corners.iter().map(|[x, y]| [x - x0, y - y0]).collect();
    let size = relative.iter().flatten().fold(0f64, |size, x| size.max(x.abs()));
    let scale = (-size.log2().floor()).exp2();
    let scaled: Vec<[f64; 2]> = relative.iter().map(|p| p.map(|x| x * scale)).collect();
    // Cells of aspect ratio 1e12 are still cells; below that rounding decides what is left of a line.
    if area(&scaled) > 1e-12 { Ok(scaled) } else { Err(ShapeError::NoArea) }
}

/// Twice the area of the triangle a, b, c.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn symmetric(matrix: DMatrix<f64>) -> DMatrix<f64> {
    (&matrix + matrix.transpose()) * 0.5
}

fn mean(corners: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / corners.len() as f64)
}

/// Mean over the cell of the gradient of each corner's shape function \[1/length\]: by the divergence
/// theorem an integral over the sides, on which every element here is linear.
pub fn mean_gradients(corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (m, twice) = (corners.len(), 2.0 * area(corners));
    (0..m)
        .map(|k| {
            let ([x0, y0], [x1, y1]) = (corners[(k + m - 1) % m], corners[(k + 1) % m]);
            [(y1 - y0) / twice, (x0 - x1) / twice]
        })
        .collect()
}

fn strain_matrix(gradients: &[[f64; 2]]) -> DMatrix<f64> {
    let mut b = DMatrix::zeros(3, 2 * gradients.len());
    for (k, &[gx, gy]) in gradients.iter().enumerate() {
        (b[(0, 2 * k)], b[(1, 2 * k + 1)]) = (gx, gy);
        (b[(2, 2 * k)], b[(2, 2 * k + 1)]) = (gy, gx);
    }
    b
}

/// Stiffness of the mean strain.
fn consistent(corners: &[[f64; 2]], stiffness: &Voigt) -> DMatrix<f64> {
    let b = strain_matrix(&mean_gradients(corners));
    b.transpose() * stiffness * b * area(corners)
}

fn gauss_points() -> [[f64; 2]; 4] {
    let g = 1.0 / 3f64.sqrt();
    [[-g, -g], [g, -g], [g, g], [-g, g]]
}

const QUADRANTS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

fn bilinear([s, t]: [f64; 2]) -> [f64; 4] {
    QUADRANTS.map(|[a, b]| 0.25 * (1.0 + a * s) * (1.0 + b * t))
}

/// Gradients of the bilinear functions at a point of the unit square and the area that a Gauss point
/// there stands for.
fn bilinear_gradients(corners: &[[f64; 2]], [s, t]: [f64; 2]) -> (Vec<[f64; 2]>, f64) {
    let local = QUADRANTS.map(|[a, b]| Vector2::new(0.25 * a * (1.0 + b * t), 0.25 * b * (1.0 + a * s)));
    let mut jacobian = Matrix2::zeros();
    for (corner, gradient) in corners.iter().zip(&local) {
        jacobian += Vector2::from(*corner) * gradient.transpose();
    }
    let area = jacobian.determinant();
    let adjugate =
        Matrix2::new(jacobian[(1, 1)], -jacobian[(0, 1)], -jacobian[(1, 0)], jacobian[(0, 0)]) / area;
    (local.iter().map(|gradient| (adjugate.transpose() * gradient).into()).collect(), area)
}

/// Projection of one component of corner displacements on affine ones, shape \[corners, corners\]: the mean gradient
/// about the mean of the corners.
fn affine_projection(corners: &[[f64; 2]]) -> DMatrix<f64> {
    let (count, middle, gradients) = (corners.len(), mean(corners), mean_gradients(corners));
    DMatrix::from_fn(count, count, |i, j| {
        let ([x, y], g) = (corners[i], gradients[j]);
        1.0 / count as f64 + g[0] * (x - middle[0]) + g[1] * (y - middle[1])
    })
}

/// The modulus of bending \[force / length\]: stress over strain under tension along an axis, the harmonic mean over some.
/// Young's modulus times the thickness for an isotropic sheet in plane stress; stays finite where the bulk modulus grows
/// without bound.
fn bending_modulus(axes: &[[f64; 2]], stiffness: &Voigt) -> f64 {
    // An admissible stiffness is positive definite.
    let Some(compliance) = stiffness.try_inverse() else { return 0.5 * stiffness.trace() };
    let along = axes.iter().map(|[nx, ny]| {
        let tension = Vector3::new(nx * nx, ny * ny, nx * ny);
        tension.dot(&(compliance * tension))
    });
    axes.len() as f64 / along.sum::<f64>()
}

/// The tensor `T` of [`cut_cell`] \[force / length\].
fn bending_tensor(corners: &[[f64; 2]], modulus: f64) -> Matrix2<f64> {
    let (centre, moments) = (centroid(corners), second_moments(corners));
    let harmonic = DMatrix::from_fn(corners.len(), 2, |k, which| {
        let (x, y) = (corners[k][0] - centre[0], corners[k][1] - centre[1]);
        if which == 0 { x * y } else { 0.5 * (x * x - y * y) }
    });
    let residual = &harmonic - affine_projection(corners) * &harmonic;
    let [xx, xy, yy] = [(0, 0), (0, 1), (1, 1)].map(|(a, b)| residual.column(a).dot(&residual.column(b)));
    let largest = 0.5 * (xx + yy) + f64::hypot(0.5 * (xx - yy), xy);
    let shape = Matrix2::identity() * moments.trace() - moments;
    shape * (modulus / largest.max(least_residual(&moments)))
}

/// Least residual of bending that a stabilisation is made for \[length^4\], `0.2 (tr J)^2 / sqrt(det J)`, `J` the second
/// moments of the cell: without it a polygon that is almost a triangle, whose corners hardly see bending, would be
/// resisted without bound (on bodies cut from outlines 24 times the condition number). A square has 3.75 times the
/// bound, a hexagon 1.7 times.
fn least_residual(moments: &Matrix2<f64>) -> f64 {
    0.2 * moments.trace().powi(2) / moments.determinant().sqrt()
}

/// The bound of the `alpha` of [`polygon`]: half the trace of the tensor of [`cut_cell`] at its own bound.
fn greatest_stabilisation(corners: &[[f64; 2]], stiffness: &Voigt) -> f64 {
    let moments = second_moments(corners);
    0.5 * bending_modulus(&AXES, stiffness) * moments.trace() / least_residual(&moments)
}

/// Axes along which bending is averaged.
const AXES: [[f64; 2]; 4] =
    [[1.0, 0.0], [FRAC_1_SQRT_2, FRAC_1_SQRT_2], [0.0, 1.0], [-FRAC_1_SQRT_2, FRAC_1_SQRT_2]];

/// The `alpha` of [`polygon`]; `rest` takes what is not affine from corner displacements.
fn bending_stiffness(corners: &[[f64; 2]], stiffness: &Voigt, rest: &DMatrix<f64>) -> f64 {
    // An admissible stiffness is positive definite.
    let Some(compliance) = stiffness.try_inverse() else { return 0.5 * stiffness.trace() };
    let (centre, moments) = (centroid(corners), second_moments(corners));
    let (mut continuum, mut cell) = (0.0, 0.0);
    for [nx, ny] in AXES {
        // Tension along the axis that grows in the direction t across it.
        let tension = Vector3::new(nx * nx, ny * ny, nx * ny);
        let strain = compliance * tension;
        let tensor = Matrix2::new(strain[0], strain[2] / 2.0, strain[2] / 2.0, strain[1]);
        let t = Vector2::new(-ny, nx);
        continuum += tension.dot(&strain) * (t.transpose() * moments * t)[0];
        let bent = corners.iter().flat_map(|corner| {
            let x = Vector2::new(corner[0] - centre[0], corner[1] - centre[1]);
            let e_x = tensor * x;
            let u = e_x * x.dot(&t) - t * (0.5 * x.dot(&e_x));
            [u[0], u[1]]
        });
        cell += (rest * DVector::from_iterator(rest.ncols(), bent)).norm_squared();
    }
    continuum / cell
}

/// Centre of gravity of a polygon \[length\].
pub fn centroid(corners: &[[f64; 2]]) -> [f64; 2] {
    let o = corners[0];
    let sum = (1..corners.len() - 1).fold([0.0; 2], |sum, k| {
        let (a, b) = (corners[k], corners[k + 1]);
        let third = cross(o, a, b) / 6.0;
        [0, 1].map(|d| sum[d] + third * (a[d] - o[d] + b[d] - o[d]))
    });
    let area = area(corners);
    [o[0] + sum[0] / area, o[1] + sum[1] / area]
}

/// Integral of `(x - centroid) (x - centroid)'` over the polygon \[length^4\].
fn second_moments(corners: &[[f64; 2]]) -> Matrix2<f64> {
    let centre = centroid(corners);
    let from_centre = |k: usize| {
        let [x, y] = corners[k % corners.len()];
        Vector2::new(x - centre[0], y - centre[1])
    };
    let mut sum = SMatrix::zeros();
    for k in 0..corners.len() {
        let (a, b) = (from_centre(k), from_centre(k + 1));
        // Over the triangle centre, a, b: area / 12 (a a' + b b' + (a + b)(a + b)').
        let (area, c) = (0.5 * a.perp(&b), a + b);
        sum += (a * a.transpose() + b * b.transpose() + c * c.transpose()) * (area / 12.0);
    }
    sum
}

#[cfg(test)]
mod tests;
