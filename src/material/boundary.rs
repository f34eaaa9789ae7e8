//! The edge of a body's cells: sides that belong to one cell alone.

use std::collections::BTreeMap;

use super::cells::Cells;
use crate::flock::vectors::Vectors;
use crate::geometry::Point;
use crate::geometry::outline::{Outline, OutlineError};
use crate::geometry::point::area;

/// Sides in the order of their cells, the body to the left of each. Those of a body of which each rank has a part are the same for
/// all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Boundary {
    /// The particles at both ends, by their index in the whole body, shape \[sides\].
    pub ends: Vec<[usize; 2]>,
    /// Where these stand in the reference configuration \[length\], shape \[sides\].
    pub places: Vec<[Point; 2]>,
}

impl Boundary {
    /// Of a whole body.
    pub fn of(cells: &Cells, reference: &Vectors) -> Self {
        let sides = cells.boundary_sides(&cells.incidence(reference.len()));
        let ends: Vec<_> = sides.iter().map(|side| side.map(|i| i as usize)).collect();
        let places = ends.iter().map(|side| side.map(|i| reference.get(i))).collect();
        Self { ends, places }
    }

    /// The outline of the cells, sides in one line taken for one edge.
    ///
    /// # Errors
    /// Cells that hang together by a corner, or in several parts, have no outline.
    pub fn outline(&self) -> Result<Outline, OutlineError> {
        let straight = |way: &Vec<usize>| {
            let at = |k: usize| self.places[way[k % way.len()]][0];
            let turns = |&k: &usize| {
                let (a, b, c) = (at(k + way.len() - 1), at(k), at(k + 1));
                let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
                let turn = u[0] * v[1] - u[1] * v[0];
                turn.abs() > 1e-9 * u[0].hypot(u[1]) * v[0].hypot(v[1])
            };
            (0..way.len()).filter(turns).map(at).collect::<Vec<_>>()
        };
        let mut polygons: Vec<Vec<Point>> = ways(self.ends.iter().copied()).iter().map(straight).collect();
        // The outer one is the largest, which bounds all others.
        let size = |polygon: &Vec<Point>| area(polygon).abs();
        let outer = (0..polygons.len()).max_by(|&a, &b| size(&polygons[a]).total_cmp(&size(&polygons[b])));
        if polygons.is_empty() {
            return Err(OutlineError::NoArea { ring: 0, place: [0.0; 2] });
        }
        polygons.swap(0, outer.unwrap_or(0));
        Outline::of_polygons(&polygons)
    }
}

/// The ways around the body and its holes, each by the numbers of its sides, shape \[ways\]\[sides\].
pub fn ways(sides: impl Iterator<Item = [usize; 2]> + Clone) -> Vec<Vec<usize>> {
    let mut onwards: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
    for (number, [a, b]) in sides.enumerate() {
        onwards.entry(a).or_default().push((number, b));
    }
    let starts: Vec<usize> = onwards.keys().copied().collect();
    let mut ways = Vec::new();
    for start in starts {
        let mut next = |here: usize| onwards.get_mut(&here).and_then(Vec::pop);
        while let Some((number, mut here)) = next(start) {
            let mut way = vec![number];
            while let Some((number, there)) = next(here) {
                way.push(number);
                here = there;
            }
            ways.push(way);
        }
    }
    ways
}
