//! The cells between the particles of a body: what the material fills.
//!
//! A square or rectangular lattice has rectangles, a centred rectangular one rhombs, an oblique one parallelograms, a
//! hexagonal one triangles, the honeycomb its hexagons. A cell exists where all its
//! corners are particles of the body; the frame, which stands for the world outside, has no cells.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::flock::body::Body;
use crate::flock::lattice::{Lattice, LatticeKind, Site, ring};
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::vectors::Vectors;

use super::boundary::{Boundary, ways};
use super::elastic::Elastic;
use super::stiffness::{ShapeError, centroid, cut_load_shares, element_of, is_conforming, load_shares};
use crate::geometry::lists::{self, Lists, distinct};
use crate::geometry::outline::{Outline, OutlineError};

/// Cells of any polygons, in compressed form. Corners run counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    /// Where the corners of each cell begin in `index`, shape \[count + 1\].
    pub starts: Vec<u32>,
    /// Particles at the corners, cell by cell.
    pub index: Vec<u32>,
    /// Which of `shapes` each cell has, shape \[count\].
    pub kind: Vec<u32>,
    /// Corners relative to the first \[length\], shape \[kinds, corners of the kind\]. A lattice has one or two;
    /// they come from the lattice's vectors, not from differences of positions, so a body far from the origin
    /// loses no digits. Cells that an outline has cut follow them, one shape each.
    pub shapes: Vec<Vec<[f64; 2]>>,
    /// How many of the shapes are whole cells; those after them are polygons that an outline has cut.
    pub whole: usize,
    /// Which region of the body the cells of each kind lie in, shape \[kinds\]: 0 is of the body's own material, those after
    /// it are of `inclusions`.
    pub region: Vec<u32>,
    /// Materials of regions 1 and on, shape \[regions - 1\].
    pub inclusions: Vec<Elastic>,
}

/// Of each particle the cells that have it as a corner, ascending.
pub type Incidence = Lists;

impl Cells {
    /// All cells whose corners are particles of the body and not of its frame, in the order of their
    /// first corner's particle.
    pub fn of_body(body: &Body) -> Self {
        let templates = templates(&body.lattice);
        Self::of_sites(&body.lattice, &templates, &body.sites, |i| !body.is_frame[i])
    }

    /// All cells like these [`templates`] whose corners are at sites that take part, in the order of `sites`, which is
    /// lexicographic.
    pub fn of_sites(
        lattice: &Lattice,
        templates: &[Vec<Site>],
        sites: &[Site],
        takes_part: impl Fn(usize) -> bool,
    ) -> Self {
        let mut cells = Self::of_kinds(shapes(lattice, templates));
        // Corners ascend as the sites do that they belong to: each is looked for from where it was last.
        let mut last: Vec<Vec<usize>> = templates.iter().map(|template| vec![0; template.len()]).collect();
        let mut found = Vec::new();
        for &[i, j] in sites.iter().filter(|&&site| lattice.sublattice(site) == 0) {
            for (kind, (template, last)) in templates.iter().zip(&mut last).enumerate() {
                found.clear();
                found.extend(template.iter().zip(last).map_while(|(corner, last)| {
                    let site = [i + corner[0], j + corner[1]];
                    while sites.get(*last).is_some_and(|&before| before < site) {
                        *last += 1;
                    }
                    let is_there = sites.get(*last) == Some(&site) && takes_part(*last);
                    is_there.then_some(*last as u32)
                }));
                if found.len() == template.len() {
                    cells.push(&found, kind as u32);
                }
            }
        }
        cells
    }

    /// The same cells with their corners at these points \[length\], each with a shape of its own.
    pub fn on_points(&self, points: &Vectors) -> Self {
        let shapes: Vec<Vec<[f64; 2]>> = self
            .iter()
            .map(|cell| {
                let [x0, y0] = points.get(cell[0] as usize);
                let relative = |&i: &u32| [points.x[i as usize] - x0, points.y[i as usize] - y0];
                cell.iter().map(relative).collect()
            })
            .collect();
        let region = self.kind.iter().map(|&kind| self.region[kind as usize]).collect();
        Self { kind: (0..self.count() as u32).collect(), whole: shapes.len(), shapes, region, ..self.clone() }
    }

    /// No cells yet, of the kinds that a lattice has: the cells that belong to a site, in each of so many regions.
    pub fn of_lattice(lattice: &Lattice, regions: usize) -> Self {
        Self::of_kinds(shapes(lattice, &templates(lattice))).in_regions(regions)
    }

    /// The same with each kind in so many regions, those of the first one first.
    fn in_regions(self, regions: usize) -> Self {
        let region = (0..regions as u32).flat_map(|region| vec![region; self.shapes.len()]).collect();
        let shapes: Vec<_> = (0..regions).flat_map(|_| self.shapes.clone()).collect();
        Self { region, whole: shapes.len(), shapes, ..self }
    }

    /// A kind of cells that an outline has cut: corners relative to the first \[length\].
    pub fn add_kind(&mut self, shape: Vec<[f64; 2]>, region: usize) -> u32 {
        self.shapes.push(shape);
        self.region.push(region as u32);
        self.shapes.len() as u32 - 1
    }

    /// No cells yet, of these kinds: corners relative to the first \[length\], shape \[kinds, corners of the kind\].
    pub fn of_kinds(shapes: Vec<Vec<[f64; 2]>>) -> Self {
        let region = vec![0; shapes.len()];
        Self {
            starts: vec![0],
            index: Vec::new(),
            kind: Vec::new(),
            whole: shapes.len(),
            shapes,
            region,
            inclusions: Vec::new(),
        }
    }

    /// Stiffness of the cells of a kind \[force / length\]: what each has to itself in this material; see
    /// [`element_of`] and [`super::dilatation`].
    ///
    /// # Errors
    /// As [`element`](super::stiffness::element).
    pub fn element(&self, kind: usize, elastic: &Elastic) -> Result<DMatrix<f64>, ShapeError> {
        element_of(&self.shapes[kind], self.material(kind, elastic), kind >= self.whole)
    }

    /// Whether all cells have the energy of one continuous displacement; see [`is_conforming`].
    pub fn are_conforming(&self, elastic: &Elastic) -> bool {
        let used = distinct(self.kind.iter().map(|&kind| kind as usize));
        let conforms = |&kind: &usize| {
            is_conforming(&self.shapes[kind], self.material(kind, elastic), kind >= self.whole)
        };
        used.iter().all(conforms)
    }

    /// The material of the cells of a kind, where `body` is that of the body outside its inclusions.
    pub fn material<'a>(&'a self, kind: usize, body: &'a Elastic) -> &'a Elastic {
        self.material_of_region(self.region[kind], body)
    }

    /// The material of a region.
    pub fn material_of_region<'a>(&'a self, region: u32, body: &'a Elastic) -> &'a Elastic {
        region.checked_sub(1).map_or(body, |k| &self.inclusions[k as usize])
    }

    /// The region that a cell lies in.
    pub fn region_of(&self, cell: usize) -> u32 {
        self.region[self.kind[cell] as usize]
    }

    /// The material of a cell.
    pub fn material_of<'a>(&'a self, cell: usize, body: &'a Elastic) -> &'a Elastic {
        self.material(self.kind[cell] as usize, body)
    }

    /// Whether dilatations are averaged over cells anywhere ([`Elastic::averaged`]).
    pub fn average_dilatations(&self, body: &Elastic) -> bool {
        std::iter::once(body).chain(&self.inclusions).any(|part| part.averaged().is_some())
    }

    /// Divides whole cells of a lattice into regions, by the middle of each \[length\].
    pub fn divide(&mut self, reference: &Vectors, regions: usize, region: impl Fn([f64; 2]) -> usize) {
        let kinds = self.shapes.len();
        let centres: Vectors = self.centroids(reference).collect();
        for (kind, centre) in self.kind.iter_mut().zip(centres.iter()) {
            *kind += (region(centre) * kinds) as u32;
        }
        *self = std::mem::replace(self, Self::of_kinds(Vec::new())).in_regions(regions);
    }

    /// The part of a load per area that falls to each corner of the cells of a kind \[length^2\]; see [`load_shares`].
    pub fn load_shares(&self, kind: usize) -> Vec<f64> {
        let shape = &self.shapes[kind];
        if kind < self.whole { load_shares(shape) } else { cut_load_shares(shape) }
    }

    /// Adds a cell with these particles at its corners, of one of the kinds in `shapes`.
    pub fn push(&mut self, corners: &[u32], kind: u32) {
        self.index.extend(corners);
        self.starts.push(self.index.len() as u32);
        self.kind.push(kind);
    }

    /// How many whole cells have their first corner before a particle, where they are in the order of these.
    pub fn before(&self, particle: usize) -> usize {
        let starts = &self.starts[..self.count_whole()];
        starts.partition_point(|&start| (self.index[start as usize] as usize) < particle)
    }

    /// The cells that belong to this part of a body, as their first corners do, ascending in stretches; all of a whole one.
    pub fn owned(&self, body: &Body) -> Vec<Range<usize>> {
        if body.part.is_none() {
            return std::iter::once(0..self.count()).collect();
        }
        let owned = body.owned();
        let is_own = |cell: &usize| owned.contains(&(self.of(*cell)[0] as usize));
        let cut = (self.count_whole()..self.count()).filter(is_own).map(|cell| cell..cell + 1);
        std::iter::once(self.before(owned.start)..self.before(owned.end)).chain(cut).collect()
    }

    /// How many cells are whole: the first ones.
    pub fn count_whole(&self) -> usize {
        self.kind.partition_point(|&kind| (kind as usize) < self.whole)
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.kind.len()
    }

    /// Most corners of a cell; 0 without cells.
    pub fn most_corners(&self) -> usize {
        self.iter().map(<[u32]>::len).max().unwrap_or(0)
    }

    /// Particles at the corners of a cell, counter-clockwise, shape \[corners\].
    pub fn of(&self, cell: usize) -> &[u32] {
        &self.index[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Particles at the corners of each cell, counter-clockwise, in the order of the cells.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        self.starts.windows(2).map(|ends| &self.index[ends[0] as usize..ends[1] as usize])
    }

    /// Corners of a cell relative to the first \[length\], shape \[corners\].
    pub fn shape(&self, cell: usize) -> &[[f64; 2]] {
        &self.shapes[self.kind[cell] as usize]
    }

    /// Which cells each of `particles` particles is a corner of.
    pub fn incidence(&self, particles: usize) -> Incidence {
        let corners =
            || (0..).zip(self.iter()).flat_map(|(cell, corners)| corners.iter().map(move |&i| (i, cell)));
        Lists::sorted(particles, corners)
    }

    /// For each of `particles` particles those that it feels in this material, in order of index: those it shares a cell
    /// with, and where dilatations are averaged over cells ([`Elastic::averaged`]) their cell_neighbours as well.
    pub fn neighbours(&self, particles: usize, elastic: &Elastic) -> Neighbours {
        let cell_neighbours = self.cell_neighbours(particles);
        if !self.average_dilatations(elastic) {
            return cell_neighbours;
        }
        Neighbours::from_lists((0..particles).map(|i| {
            let near = cell_neighbours.of(i);
            let all = near.iter().flat_map(|&j| cell_neighbours.of(j as usize)).chain(near).copied();
            distinct(all.filter(|&j| j as usize != i))
        }))
    }

    /// For each of `particles` particles those it shares a cell with, in order of index: the fewest
    /// neighbours that carry a material.
    pub fn cell_neighbours(&self, particles: usize) -> Neighbours {
        let incidence = self.incidence(particles);
        Neighbours::from_lists((0..particles).map(|i| {
            let cells = incidence.of(i).iter();
            distinct(cells.flat_map(|&c| self.of(c as usize)).copied().filter(|&mate| mate as usize != i))
        }))
    }

    /// The cell on the other side of the side that runs from `a` to `b` in the cell at hand.
    pub fn across(&self, incidence: &Incidence, [a, b]: [u32; 2]) -> Option<usize> {
        let sees = |&&cell: &&u32| self.sides(cell as usize).any(|side| side == [b, a]);
        incidence.of(a as usize).iter().find(sees).map(|&cell| cell as usize)
    }

    /// Sides of a cell, counter-clockwise.
    pub fn sides(&self, cell: usize) -> impl Iterator<Item = [u32; 2]> {
        lists::sides(self.of(cell))
    }

    /// Sides that belong to one cell only, the body to the left of each, in the order of cells.
    pub fn boundary_sides(&self, incidence: &Incidence) -> Vec<[u32; 2]> {
        self.boundary_sides_of(0..self.count(), incidence)
    }

    /// The same of some cells.
    pub fn boundary_sides_of(&self, cells: Range<usize>, incidence: &Incidence) -> Vec<[u32; 2]> {
        let sides = cells.flat_map(|cell| self.sides(cell));
        sides.filter(|&side| self.across(incidence, side).is_none()).collect()
    }

    /// The ways around the body and its holes, each from a particle back to it, the body to the left, shape
    /// \[ways\]\[particles + 1\].
    pub fn boundary_ways(&self, particles: usize) -> Vec<Vec<u32>> {
        let sides = self.boundary_sides(&self.incidence(particles));
        let ways = ways(sides.iter().map(|side| side.map(|i| i as usize)));
        let start = |way: &Vec<usize>| way.first().map(|&side| sides[side][0]);
        let particles =
            |way: &Vec<usize>| start(way).into_iter().chain(way.iter().map(|&side| sides[side][1])).collect();
        ways.iter().map(particles).collect()
    }

    /// The outline of the cells, sides in one line taken for one edge.
    ///
    /// # Errors
    /// Cells that hang together by a corner, or in several parts, have no outline.
    pub fn outline(&self, reference: &Vectors) -> Result<Outline, OutlineError> {
        Boundary::of(self, reference).outline()
    }

    /// Centre of gravity of each cell \[length\], shape \[count\].
    pub fn centroids<'a>(&'a self, reference: &'a Vectors) -> impl Iterator<Item = [f64; 2]> + 'a {
        let of_kind: Vec<[f64; 2]> = self.shapes.iter().map(|shape| centroid(shape)).collect();
        let place = move |(cell, &kind): (&[u32], &u32)| {
            let ([x, y], [dx, dy]) = (reference.get(cell[0] as usize), of_kind[kind as usize]);
            [x + dx, y + dy]
        };
        self.iter().zip(&self.kind).map(place)
    }

    /// The same as an array.
    pub fn centres(&self, reference: &Vectors) -> Vectors {
        self.centroids(reference).collect()
    }
}

/// The neighbourhood that a material needs: for each particle, all those that share a cell with it.
pub fn neighbourhood(lattice: &Lattice) -> Neighbourhood {
    cells_away(lattice, 1)
}

/// The neighbourhood that this material needs: [`neighbourhood`], and the cell_neighbours of those as well where dilatations are
/// averaged over cells ([`Elastic::averaged`]).
pub fn neighbourhood_of(lattice: &Lattice, elastic: &Elastic) -> Neighbourhood {
    cells_away(lattice, if elastic.averaged().is_some() { 2 } else { 1 })
}

/// Those that are one cell away, or two.
fn cells_away(lattice: &Lattice, cells: i32) -> Neighbourhood {
    match (lattice.kind(), cells) {
        (LatticeKind::Square { .. } | LatticeKind::Rectangular { .. }, _) => {
            Neighbourhood::Chebyshev { radius: cells }
        }
        (LatticeKind::Honeycomb { spacing }, 1) => Neighbourhood::Within { radius: 2.0 * spacing },
        // The farthest are sqrt(13) spacings away, those after them 4.
        (LatticeKind::Honeycomb { spacing }, _) => Neighbourhood::Within { radius: 3.7 * spacing },
        (LatticeKind::Hexagonal { .. }, 1) => Neighbourhood::First { keep: None },
        (LatticeKind::Hexagonal { .. }, _) => Neighbourhood::Second,
        (LatticeKind::CentredRectangular { .. } | LatticeKind::Oblique { .. }, _) => {
            let mut offsets = ring(&shortest_translations(lattice), cells);
            lattice.sort_nearest_first(&mut offsets);
            Neighbourhood::Offsets(offsets)
        }
    }
}

/// Two translations of the lattice that span its cells, as short as can be; the shorter first.
fn shortest_translations(lattice: &Lattice) -> [Site; 2] {
    let near = lattice.first_neighbours(0);
    let length = |&site: &Site| {
        let [x, y] = lattice.vector(site);
        x.hypot(y)
    };
    // Opposite neighbours come in pairs, nearest first; on a rhombic lattice its sides, not the diagonal, span a cell.
    let mut pairs: Vec<Site> = near.iter().copied().filter(|site| *site > [0, 0]).collect();
    pairs.sort_by(|a, b| length(a).total_cmp(&length(b)));
    if let LatticeKind::CentredRectangular { .. } = lattice.kind() {
        return [[1, -1], [1, 1]];
    }
    [pairs[0], pairs[1]]
}

/// The cells that belong to a site of sublattice 0: corners as offsets from that site, the site itself
/// first, counter-clockwise in the plane. Every cell of the lattice belongs to one site.
pub fn templates(lattice: &Lattice) -> Vec<Vec<Site>> {
    let mut templates = match lattice.kind() {
        LatticeKind::Square { .. } | LatticeKind::Rectangular { .. } => {
            vec![vec![[0, 0], [1, 0], [1, 1], [0, 1]]]
        }
        LatticeKind::Honeycomb { .. } => {
            // The hexagon whose centre is the missing site two columns to the left.
            let hexagon = [[2, 0], [1, 1], [-1, 1], [-2, 0], [-1, -1], [1, -1]];
            vec![hexagon.map(|[i, j]| [i - 2, j]).to_vec()]
        }
        LatticeKind::CentredRectangular { .. } | LatticeKind::Oblique { .. } => {
            let [p, q] = shortest_translations(lattice);
            vec![vec![[0, 0], p, [p[0] + q[0], p[1] + q[1]], q]]
        }
        LatticeKind::Hexagonal { .. } => triangles(lattice).to_vec(),
    };
    for template in &mut templates {
        let [a, b] = [1, 2].map(|k| lattice.vector(template[k]));
        if a[0] * b[1] < a[1] * b[0] {
            template[1..].reverse();
        }
    }
    templates
}

/// The triangles between first neighbours that belong to a site, where there are six of these; as [`templates`].
pub fn triangles(lattice: &Lattice) -> [Vec<Site>; 2] {
    let mut around = lattice.first_neighbours(0);
    around.sort_by(|&a, &b| angle(lattice, a).total_cmp(&angle(lattice, b)));
    [0, 1].map(|k| vec![[0, 0], around[k], around[k + 1]])
}

/// Corners of these templates relative to the first \[length\], shape \[kinds, corners of the kind\].
fn shapes(lattice: &Lattice, templates: &[Vec<Site>]) -> Vec<Vec<[f64; 2]>> {
    templates.iter().map(|t| t.iter().map(|&corner| lattice.vector(corner)).collect()).collect()
}

fn angle(lattice: &Lattice, offset: Site) -> f64 {
    let [x, y] = lattice.vector(offset);
    y.atan2(x)
}

#[cfg(test)]
mod tests;
