//! Gauss-Seidel: each follower is moved to where its neighbours' newest places leave it, by colours.
//!
//! No two particles of a colour feel each other, so within a colour the order does not matter, and the
//! colours follow from column and row alone: the result depends neither on the numbering nor on threads.
//! For a positive operator it always converges (A. M. Ostrowski 1954), whatever the largest eigenvalue.

use super::history::History;
use super::system::Prepared;
use super::{Found, Request, SolveError, Solver, steps};
use crate::flock::body::Body;
use crate::flock::vectors::Vectors;
use crate::solve::operator::{Matrix, RowCoefficients, product};
use crate::solve::stopwatch::Stopwatch;

pub(super) fn solve(prepared: &mut Prepared, request: &Request) -> Result<Found, SolveError> {
    let begin = Stopwatch::start();
    let Prepared { matrix, right, size, .. } = &*prepared;
    let stencils = prepared.stencils();
    let colours = colours(matrix);
    let mut u = Vectors::zeros(matrix.count());
    let mut r = Vectors::zeros(matrix.count());
    let set_up = begin.elapsed();
    let mut history = History::new(request);
    while history.goes_on(request) {
        for colour in &colours {
            sweep(matrix, stencils, colour, right, &mut u);
        }
        let residual = steps::residual(matrix, stencils, (&u, right), &mut r).sqrt() / *size;
        history.push(Solver::GaussSeidel, residual)?;
    }
    Ok(Found { displacement: u, residuals: history.residuals, set_up })
}

/// A particle of a colour and the run that it belongs to.
type Coloured = (u32, u32);

/// The particles of each colour. Columns that lie closer than any particle reaches differ in colour, and so do
/// rows.
fn colours(matrix: &Matrix) -> Vec<Vec<Coloured>> {
    let [across, along] = matrix.reach().map(|reach| reach + 1);
    let lattice_colours = (across * along) as usize;
    let mut colours = vec![Vec::new(); lattice_colours];
    // Particles along an outline get colours of their own, each the first that none of those it feels has.
    let mut taken = vec![usize::MAX; if matrix.outliers.is_empty() { 0 } else { matrix.count() }];
    let mut sites = matrix.columns.sites();
    for (number, run) in matrix.runs().iter().enumerate() {
        for particle in run.start..run.start + run.len {
            // Runs and sites both go through the followers in their numbering.
            let [column, row] = sites.next().expect("a site for each follower");
            if column == Body::ALONG_OUTLINE {
                let felt = matrix.distances(run)[1..].iter();
                let felt = felt.map(|&d| taken[(particle as usize).wrapping_add_signed(d as isize)]);
                let known: Vec<usize> = felt.collect();
                let colour = (lattice_colours..).find(|colour| !known.contains(colour)).unwrap_or_default();
                taken[particle as usize] = colour;
                colours.resize(colours.len().max(colour + 1), Vec::new());
                colours[colour].push((particle, number as u32));
                continue;
            }
            let colour = column.rem_euclid(across) * along + row.rem_euclid(along);
            colours[colour as usize].push((particle, number as u32));
        }
    }
    colours.retain(|colour| !colour.is_empty());
    colours
}

fn sweep(
    matrix: &Matrix,
    stencils: &RowCoefficients<f64>,
    colour: &[Coloured],
    f: &Vectors<f64>,
    u: &mut Vectors<f64>,
) {
    for &(particle, run) in colour {
        let (i, run) = (particle as usize, &matrix.runs()[run as usize]);
        let [load, felt] = [f.get(i), product(matrix.rows.of(run.class), matrix.distances(run), i, u.view())];
        let [x, y] = [load[0] - felt[0], load[1] - felt[1]];
        let [xx, xy, yx, yy] = stencils.inverse(run.class);
        u.x[i] += xx * x + xy * y;
        u.y[i] += yx * x + yy * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::lattice::LatticeKind;
    use crate::solve::operator::samples::operator;

    #[test]
    fn every_follower_has_one_colour_and_no_neighbour_of_the_same() {
        for kind in LatticeKind::SAMPLES {
            let operator = operator(kind, 14, 11, |i| i % 9 == 0);
            let matrix = Matrix::of_followers(&operator);
            let colours = colours(&matrix);
            let mut colour_of = vec![None; matrix.count()];
            for (colour, particles) in colours.iter().enumerate() {
                for &(particle, _) in particles {
                    assert_eq!(colour_of[particle as usize].replace(colour), None, "{kind:?}");
                }
            }
            assert_eq!(colour_of.iter().flatten().count(), operator.followers(), "{kind:?}");
            for &(particle, run) in colours.iter().flatten() {
                // The first distance is the particle's own.
                for &distance in &matrix.distances(&matrix.runs()[run as usize])[1..] {
                    let other = (particle as usize).wrapping_add_signed(distance as isize);
                    assert_ne!(colour_of[particle as usize], colour_of[other], "{kind:?}");
                }
            }
        }
    }
}
