//! Bonds of a particle inside a body, summed over the cells around it.

use crate::flock::block::{Block, plus};
use crate::flock::lattice::{Lattice, Site};
use crate::geometry::lists::distinct;
use crate::geometry::point::area;
use crate::material::cells::templates;
use crate::material::stiffness::mean_gradients;

pub fn add(row: &mut Vec<(Site, Block)>, offset: Site, block: &Block) {
    match row.iter_mut().find(|(known, _)| *known == offset) {
        Some((_, sum)) => *sum = plus(sum, block),
        None => row.push((offset, *block)),
    }
}

/// Corners of the cells around a site of an infinite lattice.
fn cells_around(lattice: &Lattice, site: Site) -> Vec<Vec<Site>> {
    let mut cells = Vec::new();
    for template in templates(lattice) {
        for own in template.iter().filter(|own| lattice.sublattice(**own) == lattice.sublattice(site)) {
            cells.push(template.iter().map(|c| [c[0] + site[0] - own[0], c[1] + site[1] - own[1]]).collect());
        }
    }
    cells
}

/// Adds the averaged dilatations to the bonds of a site inside the body: see [`super::dilatation`].
pub fn add_averaged(lattice: &Lattice, lambda: f64, own: Site, row: &mut Vec<(Site, Block)>) {
    for middle in distinct(cells_around(lattice, own).concat()) {
        let (mut total, mut v) = (0.0, Vec::<(Site, [f64; 2])>::new());
        for corners in cells_around(lattice, middle) {
            let shape: Vec<[f64; 2]> = corners.iter().map(|&corner| lattice.vector(corner)).collect();
            let share = area(&shape) / shape.len() as f64;
            total += share;
            for (&corner, [x, y]) in corners.iter().zip(mean_gradients(&shape)) {
                let [x, y] = [share * x, share * y];
                match v.iter_mut().find(|(known, _)| *known == corner) {
                    Some((_, sum)) => *sum = [sum[0] + x, sum[1] + y],
                    None => v.push((corner, [x, y])),
                }
            }
        }
        let of_own = v.iter().find(|(site, _)| *site == own).map_or([0.0; 2], |(_, v)| *v);
        for (site, other) in v.into_iter().filter(|(site, _)| *site != own) {
            let block = of_own.map(|a| other.map(|b| -lambda / total * a * b));
            add(row, [site[0] - own[0], site[1] - own[1]], &block);
        }
    }
}
