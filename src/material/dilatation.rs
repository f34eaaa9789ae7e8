//! Dilatations averaged over the cells around a particle: what keeps a nearly incompressible material from locking.
//!
//! Cells resist their own strain with all of the stiffness but Lame's lambda. That resists, for each particle `p`, the mean
//! dilatation of the cells around it, each cell counting by the share `A_c / n_c` that a corner has of its area:
//!
//! ```text
//! W = sum_p lambda / (2 M_p) (sum_c A_c / n_c div_c u)^2      M_p = sum_c A_c / n_c
//! ```
//!
//! where `div_c u` is the trace of the cell's mean strain, or, of a cell that has turned, that of its stretch less 2. The
//! cells around a particle are averaged as far as they are of one material: across an interface the dilatation jumps.
//! See [`Elastic::averaged_dilatation`] for the source and for when this is done.

use super::cells::{Cells, Incidence};
use super::elastic::Elastic;
use super::stiffness::area;
use crate::flock::points::Points;

/// The cells around `particle` in groups of one stiffness `factor`, in the order of cells.
pub fn patches(incidence: &Incidence, factor: Option<&[f64]>, particle: usize) -> Vec<Vec<usize>> {
    let around = incidence.of(particle).iter().map(|&cell| cell as usize);
    let Some(factor) = factor else { return vec![around.collect()] };
    let mut patches: Vec<Vec<usize>> = Vec::new();
    for cell in around {
        match patches.iter_mut().find(|patch| factor[patch[0]] == factor[cell]) {
            Some(patch) => patch.push(cell),
            None => patches.push(vec![cell]),
        }
    }
    patches
}

/// The share that a corner of each kind of cell has of its area \[length^2\], shape \[kinds\].
pub fn shares(cells: &Cells) -> Vec<f64> {
    cells.shapes.iter().map(|shape| area(shape) / shape.len() as f64).collect()
}

/// Mean dilatation of the cells around each particle \[1\], and their shares of area \[length^2\], shape \[count\]; of one
/// material throughout.
fn at_particles(cells: &Cells, strains: &[[f64; 3]], count: usize) -> (Vec<f64>, Vec<f64>) {
    let shares = shares(cells);
    let (mut mean, mut measure) = (vec![0.0; count], vec![0.0; count]);
    for (cell, corners) in cells.iter().enumerate() {
        let share = shares[cells.kind[cell] as usize];
        for &corner in corners {
            mean[corner as usize] += share * (strains[cell][0] + strains[cell][1]);
            measure[corner as usize] += share;
        }
    }
    mean.iter_mut().zip(&measure).filter(|(_, m)| **m > 0.0).for_each(|(sum, m)| *sum /= m);
    (mean, measure)
}

/// Mean strain of each cell as [`Cells::strains`] has it; where the material averages dilatations, with the mean of those at
/// the cell's corners in place of its own, which means nothing there: the pressure would jump from cell to cell.
pub fn strains(cells: &Cells, elastic: &Elastic, displacement: &Points) -> Vec<[f64; 3]> {
    let mut strains = cells.strains(displacement);
    if elastic.averaged_dilatation().is_some() {
        let (mean, _) = at_particles(cells, &strains, displacement.len());
        for (strain, corners) in strains.iter_mut().zip(cells.iter()) {
            let averaged = corners.iter().map(|&i| mean[i as usize]).sum::<f64>() / corners.len() as f64;
            let add = 0.5 * (averaged - strain[0] - strain[1]);
            *strain = [strain[0] + add, strain[1] + add, strain[2]];
        }
    }
    strains
}

/// Energy of the averaged dilatations \[force length\]; zero where the material averages none.
pub fn energy(cells: &Cells, elastic: &Elastic, displacement: &Points) -> f64 {
    let Some(lambda) = elastic.averaged_dilatation() else { return 0.0 };
    let (mean, measure) = at_particles(cells, &cells.strains(displacement), displacement.len());
    0.5 * lambda * mean.iter().zip(&measure).map(|(mean, measure)| measure * mean * mean).sum::<f64>()
}
