//! Where rounding ends a solve before its tolerance does, and how far the displacements are known there.
//!
//! No displacement in doubles leaves less of the load than about `eps (|K| |u| + |f|)`: on a beam a thousand times as
//! long as high that is some 1e-5 of it, and a tolerance below cannot be met. It says nothing of the
//! displacements either, which may be known to as many digits or to none. The error of the
//! displacements is estimated by solving `K e = r`, `e` being about as large as the error, since at this
//! level a residual is mostly rounding itself.

use super::system::Prepared;
use super::{Request, Solver, System, by, steps};
use crate::flock::vectors::Vectors;

/// Roundings of a row, as far as they do not cancel.
const ROUNDINGS: f64 = 4.0;

/// Tolerance of the solve for the error, and what it may end with.
const ASKED: f64 = 1e-4;
const ENOUGH: f64 = 1e-2;

/// Relative L2 error that the displacements are estimated to have; `None` where the residual is more than
/// rounding leaves.
pub(super) fn known_to(
    prepared: &mut Prepared,
    system: &System,
    request: &Request,
    (solver, found): (Solver, &Vectors<f64>),
) -> Option<f64> {
    let right = prepared.scaled_right(system);
    let mut r = Vectors::zeros(right.len());
    let left = steps::residual(&prepared.matrix, prepared.stencils(), (found, &right), &mut r).sqrt();
    if left > ROUNDINGS * f64::EPSILON * magnitude(prepared, found, &right) {
        return None;
    }
    if left == 0.0 {
        return Some(0.0);
    }
    (prepared.right, prepared.size) = (r, left);
    let request = Request { tolerance: ASKED, ..*request };
    let error = by(solver, prepared, &request).ok()?;
    let solved = error.residuals.last().is_some_and(|last| *last <= ENOUGH);
    let [of_error, of_found] = [&error.displacement, found].map(|field| prepared.matrix.square(field).sqrt());
    Some(of_error / of_found).filter(|part| solved && part.is_finite())
}

/// `| |K| |u| + |f| |`: what the terms of a residual add up to before they cancel.
fn magnitude(prepared: &Prepared, found: &Vectors<f64>, right: &Vectors<f64>) -> f64 {
    let stencils = prepared.stencils().clone().absolute();
    let part = |values: &[f64], sign: f64| values.iter().map(|v| sign * v.abs()).collect();
    let u = Vectors { x: part(&found.x, 1.0), y: part(&found.y, 1.0) };
    let f = Vectors { x: part(&right.x, -1.0), y: part(&right.y, -1.0) };
    let mut sum = Vectors::zeros(found.len());
    steps::residual(&prepared.matrix, &stencils, (&u, &f), &mut sum).sqrt()
}
