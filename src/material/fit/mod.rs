//! Bodies whose outline is kept: a lattice inside, cells cut by the shape along its outline.
//!
//! 1. `sites`: lattice points nearer to the outline than [`SNAP`] move onto it, to a corner if one is as near.
//! 2. `cut`: the outline cuts the cells that it passes; corners, and where it crosses the sides of cells, are
//!    particles too. Arcs become chords between particles that lie on the arc.
//! 3. `tidy`: a part of a cell smaller than [`LEAST_AREA`], narrower than [`LEAST_WIDTH`] or dented joins the neighbour that makes
//!    the most compact cell with it, and a side along the outline shorter than [`LEAST_SIDE`] shrinks to one particle.
//!
//! Everything else stays lattice. Distances are measured in the least altitude `w` over all triples of corners of a
//! cell: since twice [`SNAP`] is less than 1, no triple changes its orientation when its corners move, so that
//! every moved cell stays convex and no two particles meet. Moving points rather than cutting near them is the idea
//! of isosurface stuffing (F. Labelle and J. R. Shewchuk, ACM Transactions on Graphics 26, 2007).
//!
//! The bounds on area and side hold as long as the shape allows: two true corners nearer to each other than the
//! bound are kept as they are, and a shape narrower than the spacing is refused.

mod cut;
mod faces;
mod narrow;
mod near;
mod sites;
#[cfg(test)]
mod tests;
mod tidy;

use std::ops::Range;
use std::sync::Arc;

use self::faces::{Face, Faces};
use self::near::NearPieces;
use self::sites::{Columns, Sites};
use super::cells::{Cells, templates};
use crate::flock::body::{Body, OutlineParticles};
use crate::flock::lattice::{Lattice, Site};
use crate::flock::outlay::{Census, cell_width};
use crate::flock::part::Extent;
use crate::flock::vectors::{Vectors, distance};
use crate::flock::window::Window;
use crate::geometry::lists::sides;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::partition::Partition;
use crate::geometry::point::area;

/// Lattice points this near to the outline move onto it, in least altitudes of a cell.
pub const SNAP: f64 = 0.4;
/// Least area of a cell that the outline cuts, in areas of a whole one.
pub const LEAST_AREA: f64 = 0.4;
/// Least extent of a cell that the outline cuts, across one of its sides, in least altitudes of a whole one.
pub const LEAST_WIDTH: f64 = 0.3;
/// Least distance of two particles along the outline, in least altitudes of a cell.
pub const LEAST_SIDE: f64 = 0.4;

/// Distances below this part of the spacing are rounding.
const ROUNDING: f64 = 1e-7;
/// A lattice point this near to the outline, in spacings, lies on it and stays where the lattice has it.
const STAYS: f64 = 1e-11;

/// Why a lattice cannot be fitted to an outline.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The shape is narrower than the spacing of the lattice.
    #[error(
        "what is between its sides, or between it and another outline, is {width:.6} wide near ({:.6}, {:.6}), less than the spacing of the lattice, which is {spacing:.6}",
        .place[0], .place[1]
    )]
    Narrow {
        /// Distance of the opposite side of the outline \[length\].
        width: f64,
        /// Spacing of the lattice \[length\].
        spacing: f64,
        /// Where on the outline \[length\].
        place: [f64; 2],
        /// What bounds the body there, and could lie elsewhere.
        part: Part,
    },
    /// The outline turns more often within a cell than cells can follow.
    #[error(
        "near ({:.6}, {:.6}) the outline has details that cells of the lattice, {spacing:.6} apart, cannot follow",
        .place[0], .place[1]
    )]
    Detail {
        /// Spacing of the lattice \[length\].
        spacing: f64,
        /// Near the detail \[length\].
        place: [f64; 2],
    },
    /// A hole is smaller than the spacing of the lattice.
    #[error(
        "hole {hole} is {width:.6} across, less than the spacing of the lattice, which is {spacing:.6}; it is near ({:.6}, {:.6})",
        .place[0], .place[1]
    )]
    SmallHole {
        /// Number of the hole, from 1.
        hole: usize,
        /// Greater side of its bounds \[length\].
        width: f64,
        /// Spacing of the lattice \[length\].
        spacing: f64,
        /// Where its first piece begins \[length\].
        place: [f64; 2],
    },
    /// The bounds of the shape hold more sites than a body may have.
    #[error("the shape has more than {limit} lattice sites in its bounds")]
    TooLarge {
        /// Most sites that they may hold.
        limit: u64,
    },
}

/// A part of what bounds a body and its regions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// The outer outline.
    Outer,
    /// A hole by its number, from 1.
    Hole(usize),
    /// The edge of a region by its number, from 1.
    Region(usize),
}

impl Part {
    /// The part that a loop or a line is.
    fn of(outline: &Partition, ring: usize) -> Self {
        match (outline.is_bounding(ring), ring) {
            (false, line) => Self::Region(outline.region_along(line)),
            (true, 0) => Self::Outer,
            (true, hole) => Self::Hole(hole),
        }
    }
}

/// A body with its outline and its cells.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Particles at lattice sites in the order of sites, then those along the outline that stand at none.
    pub body: Body,
    /// Whole cells of the lattice, then those that the outline has cut or bent.
    pub cells: Cells,
}

/// How well cells keep to the lattice's: the least over all cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Area over that of a whole cell \[1\].
    pub area: f64,
    /// Length of a side over the least altitude of a whole cell \[1\].
    pub side: f64,
    /// Least extent over the least altitude of a whole cell \[1\].
    pub width: f64,
}

/// The measures of a lattice's cells.
#[derive(Clone, Debug)]
struct Scale {
    templates: Vec<Vec<Site>>,
    /// Least altitude over all triples of corners \[length\].
    altitude: f64,
    /// Largest distance of two corners \[length\].
    diameter: f64,
    /// \[length^2\]
    area: f64,
    /// \[length\]
    spacing: f64,
}

impl Scale {
    fn of(lattice: &Lattice) -> Self {
        let templates = templates(lattice);
        let corners: Vec<[f64; 2]> = templates[0].iter().map(|&site| lattice.vector(site)).collect();
        let pairs = || (0..corners.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let apart = |(a, b): (usize, usize)| distance(corners[a], corners[b]);
        let altitude = |(a, b, c): (usize, usize, usize)| {
            let twice = 2.0 * area(&[corners[a], corners[b], corners[c]]).abs();
            twice / apart((a, b)).max(apart((b, c))).max(apart((a, c)))
        };
        let triples = pairs().flat_map(|(a, b)| (0..b).map(move |c| (a, b, c)));
        Self {
            altitude: triples.map(altitude).fold(f64::INFINITY, f64::min),
            diameter: pairs().map(apart).fold(0.0, f64::max),
            area: area(&corners),
            spacing: lattice.spacing(),
            templates,
        }
    }
}

/// Turn \[rad\] below which a corner between pieces shorter than cells may be is one of the many of a curve.
const FLAT: f64 = 0.35;

/// Whether a particle has to stand on a corner: one that turns sharply, or that lies between pieces of some length, or
/// where a line ends. The vertices of a curve drawn with finer edges than the lattice has are none.
fn is_kept_corner(outline: &Partition, scale: &Scale, corner: [usize; 2]) -> bool {
    if outline.is_junction(corner) {
        return true;
    }
    let [ring, piece] = corner;
    let pieces = outline.ring(ring);
    let (before, after) = (&pieces[(piece + pieces.len() - 1) % pieces.len()], &pieces[piece]);
    let (a, b) = (before.tangent(1.0), after.tangent(0.0));
    let turn = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]).abs();
    let is_long = before.length().min(after.length()) >= LEAST_SIDE * scale.altitude;
    after.begins_at_corner && (turn > FLAT || is_long)
}

/// Fits a lattice to the outline of a body.
///
/// # Errors
/// A shape, or a detail of it, that is too narrow for the spacing, with its place.
pub fn fit(lattice: &Lattice, outline: &Outline) -> Result<Fitted, FitError> {
    fit_regions(lattice, &Partition::whole(outline))
}

/// Fits a lattice to the outline of a body and to the lines inside along which its regions meet. The materials of the
/// regions are for [`Cells::inclusions`].
///
/// # Errors
/// As [`fit`].
pub fn fit_regions(lattice: &Lattice, outline: &Partition) -> Result<Fitted, FitError> {
    sites::require_few(lattice, outline.outline())?;
    Band::of(lattice, outline)?.body()
}

impl Fitted {
    /// The least of each measure over all cells.
    pub fn quality(&self) -> Quality {
        let scale = Scale::of(&self.body.lattice);
        let mut least = Quality { area: f64::INFINITY, side: f64::INFINITY, width: f64::INFINITY };
        // Shapes that no cell has any more are no part of it.
        let mut used = vec![false; self.cells.shapes.len()];
        self.cells.kind.iter().for_each(|&kind| used[kind as usize] = true);
        for shape in self.cells.shapes.iter().zip(used).filter_map(|(shape, used)| used.then_some(shape)) {
            least.area = least.area.min(area(shape) / scale.area);
            for [a, b] in sides(shape) {
                let length = distance(a, b);
                let normal = [(b[1] - a[1]) / length, (a[0] - b[0]) / length];
                let along = shape.iter().map(|p| normal[0] * p[0] + normal[1] * p[1]);
                let (low, high) =
                    along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
                least.side = least.side.min(length / scale.altitude);
                least.width = least.width.min((high - low) / scale.altitude);
            }
        }
        least
    }
}

/// What an outline decides on: the sites and cells near it. All that is farther inside is lattice.
#[derive(Debug)]
pub struct Band {
    lattice: Lattice,
    outline: Partition,
    scale: Scale,
    sites: Sites,
    faces: Faces,
    /// Whether each node is a particle, shape \[nodes\].
    used: Vec<bool>,
    /// The nodes that are particles and stand at no site, in their order along the outline.
    along: Vec<u32>,
    /// Number of each node in `along`, shape \[nodes\]; [`u32::MAX`] of all others.
    number_along: Vec<u32>,
}

impl Band {
    /// Fits the cells near an outline.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn of(lattice: &Lattice, outline: &Partition) -> Result<Self, FitError> {
        let scale = Scale::of(lattice);
        let near = NearPieces::new(outline, scale.diameter);
        narrow::require_wide(outline, &near, scale.spacing)?;
        let sites = Sites::find(lattice, outline, &scale)?;
        let mut faces = cut::cut((lattice, outline, &near), &scale, &sites)?;
        tidy::tidy(&mut faces, &scale);
        let (lattice, outline) = (lattice.clone(), outline.clone());
        let (used, number_along) = (vec![false; faces.nodes.len()], vec![u32::MAX; faces.nodes.len()]);
        let mut band = Self { lattice, outline, scale, sites, faces, used, along: Vec::new(), number_along };
        band.find_particles();
        Ok(band)
    }

    fn find_particles(&mut self) {
        for &node in self.faces.cells().flat_map(|face| &face.corners) {
            self.used[node as usize] = true;
        }
        for (number, near) in self.sites.near().iter().enumerate() {
            self.used[number] |= self.is_in_far_cell(near.site);
        }
        let mut along: Vec<(Place, u32)> = Vec::new();
        for (number, node) in (0..).zip(&self.faces.nodes).filter(|(number, _)| self.used[*number as usize]) {
            match (node.site, node.place) {
                (Some(_), _) => {}
                (None, Some(place)) => along.push((place, number)),
                (None, None) => unreachable!("a node stands at a site or on the outline"),
            }
        }
        along.sort_by(|(a, _), (b, _)| order(a, b));
        self.along = along.into_iter().map(|(_, node)| node).collect();
        (0..).zip(&self.along).for_each(|(k, &node)| self.number_along[node as usize] = k);
    }

    /// Whether no cell is cut: then the body is that of the lattice.
    pub fn is_whole(&self) -> bool {
        self.faces.cells().all(|face| face.whole.is_some())
    }

    /// Particles that stand at no site, by their number, and the place of each \[length\].
    pub fn along(&self) -> impl ExactSizeIterator<Item = [f64; 2]> {
        self.along.iter().map(|&node| self.faces.nodes[node as usize].point)
    }

    /// Places \[length\] of all particles near the outline.
    pub fn places(&self) -> impl Iterator<Item = [f64; 2]> {
        self.faces.nodes.iter().zip(&self.used).filter(|(_, used)| **used).map(|(node, _)| node.point)
    }

    /// Where on the outline the particles at these sites are.
    pub fn outline_of(&self, sites: &[Site]) -> OutlineParticles {
        let of = |&site: &Site| {
            let number = self.sites.number(site)? as usize;
            let node = &self.faces.nodes[number];
            node.place.filter(|place| self.used[number] && self.outline.is_bounding(place.ring))
        };
        OutlineParticles { regular: sites.len(), places: sites.iter().map(of).collect() }
    }

    /// The sites of some columns at which particles stand, ascending.
    ///
    /// # Errors
    /// More columns than can be looked at together.
    pub fn sites(&self, columns: Range<i32>) -> Result<Vec<Site>, FitError> {
        Ok(self.regular(&self.sites.columns(&self.lattice, columns)?))
    }

    /// The columns in which something may stand.
    pub fn columns(&self) -> Range<i32> {
        self.sites.all_columns()
    }

    /// The column that a particle at no site is counted with.
    fn column_of(&self, node: u32) -> i32 {
        self.lattice.grid_coordinates(self.faces.nodes[node as usize].point)[0].round() as i32
    }

    /// Most columns from a particle to another at the same cell.
    pub fn reach(&self) -> i32 {
        let column = |&node: &u32| {
            let site = self.faces.nodes[node as usize].site;
            site.map_or_else(|| self.column_of(node), |site| site[0])
        };
        let width = |face: &Face| {
            let columns = face.corners.iter().map(column);
            columns.clone().max().unwrap_or(0) - columns.min().unwrap_or(0)
        };
        self.faces.cells().map(width).fold(cell_width(&self.scale.templates), i32::max)
    }

    /// Particles of each of some columns that stand at no site, shape \[columns\].
    pub fn count_along(&self, columns: Range<i32>) -> Vec<u64> {
        let mut counts = vec![0; columns.len()];
        for column in self.along.iter().map(|&node| self.column_of(node)).filter(|c| columns.contains(c)) {
            counts[(column - columns.start) as usize] += 1;
        }
        counts
    }

    /// Counts the particles of some columns.
    ///
    /// # Errors
    /// More columns than can be looked at together.
    pub fn count(&self, columns: Range<i32>) -> Result<Census, FitError> {
        let mut census = Census { counts: self.count_along(columns.clone()), extent: Extent::NONE };
        let mut add = |place: [f64; 2], lowest: Site| {
            census.extent = census.extent.or(Extent { bounds: (place, place), lowest, neighbours: 0 });
        };
        for &node in self.along.iter().filter(|&&node| columns.contains(&self.column_of(node))) {
            add(self.faces.nodes[node as usize].point, Extent::NONE.lowest);
        }
        for site in self.sites(columns.clone())? {
            add(self.lattice.position(site), site);
            census.counts[(site[0] - columns.start) as usize] += 1;
        }
        Ok(census)
    }

    fn regular(&self, columns: &Columns<'_>) -> Vec<Site> {
        columns.sites(|node| self.used[node as usize] && self.faces.nodes[node as usize].site.is_some())
    }

    /// The whole body.
    ///
    /// # Errors
    /// More sites in its bounds than can be looked at together.
    pub fn body(&self) -> Result<Fitted, FitError> {
        self.lay_out(None).map(|(fitted, _)| fitted)
    }

    /// The whole body, or what stands in some columns: there particles at no site come after the others of their column, and not after
    /// all others.
    ///
    /// # Errors
    /// More columns than can be looked at together.
    pub fn lay_out(&self, columns: Option<Range<i32>>) -> Result<(Fitted, Numbers), FitError> {
        let is_part = columns.is_some();
        let columns = self.sites.columns(&self.lattice, columns.unwrap_or(self.columns()))?;
        let regular = self.regular(&columns);
        let mut along: Vec<(i32, u32)> =
            (0..).zip(&self.along).map(|(k, &n)| (self.column_of(n), k)).collect();
        if is_part {
            along.retain(|(column, _)| columns.has_column(*column));
            along.sort_unstable();
        }
        let step = if self.lattice.is_site([0, 1]) { 1 } else { 2 };
        let mut part = Laid::new(columns.window(), self.along.len());
        let mut next = along.iter().peekable();
        let add_along = |part: &mut Laid, k: u32| {
            part.along[k as usize] = part.sites.len() as u32;
            part.sites.push([Body::ALONG_OUTLINE, k as i32 * step]);
            part.reference.push(self.faces.nodes[self.along[k as usize] as usize].point);
            part.order.push(regular.len() as u32 + k);
        };
        for (number, &site) in (0..).zip(&regular) {
            while let Some((_, k)) = next.next_if(|(column, _)| is_part && *column < site[0]) {
                add_along(&mut part, *k);
            }
            part.add_at(site);
            part.reference.push(self.lattice.position(site));
            part.order.push(number);
        }
        next.for_each(|(_, k)| add_along(&mut part, *k));
        let mut places = vec![None; part.sites.len()];
        for (number, node) in (0..).zip(&self.faces.nodes) {
            if let Some(particle) = self.particle(&part, number) {
                // Only what bounds the body is its outline.
                places[particle as usize] = node.place.filter(|place| self.outline.is_bounding(place.ring));
            }
        }
        let (cells, cut) = self.cells(&columns, &regular, &part);
        let here = part.along.iter().enumerate().filter(|(_, here)| **here != u32::MAX);
        let mut along: Vec<[usize; 2]> = here.map(|(k, &here)| [here as usize, k]).collect();
        along.sort_unstable();
        let column = |site: &Site| match site[0] {
            Body::ALONG_OUTLINE => self.column_of(self.along[(site[1] / step) as usize]),
            column => column,
        };
        let numbers = Numbers { along, cut, columns: part.sites.iter().map(column).collect() };
        let Laid { sites, reference, .. } = part;
        let body = Body {
            lattice: self.lattice.clone(),
            is_frame: vec![false; sites.len()],
            sites,
            reference: Arc::new(reference),
            frame: None,
            numbering: None,
            outline: Some(Arc::new(OutlineParticles { regular: regular.len(), places })),
            part: None,
        };
        Ok((Fitted { body, cells }, numbers))
    }

    /// The particle that a node is, if it is one of those laid out.
    fn particle(&self, part: &Laid, node: u32) -> Option<u32> {
        let (used, along) = (self.used[node as usize], self.number_along[node as usize]);
        match self.faces.nodes[node as usize].site.filter(|_| used) {
            Some(site) => part.index(site),
            None => part.along.get(along as usize).copied().filter(|&here| here != u32::MAX),
        }
    }

    /// Whether a cell that is too far from the outline to be cut is inside, as its corners are.
    fn is_far_cell(&self, [i, j]: Site, kind: usize, is_inside: impl Fn(Site) -> bool) -> bool {
        let inside = |corner: &Site| is_inside([i + corner[0], j + corner[1]]);
        !self.faces.is_candidate([i, j], kind) && self.scale.templates[kind].iter().all(inside)
    }

    fn is_in_far_cell(&self, [i, j]: Site) -> bool {
        let bases = |kind: usize| {
            let corners = self.scale.templates[kind].iter().map(move |corner| [i - corner[0], j - corner[1]]);
            corners.filter(|&base| self.lattice.is_site(base) && self.lattice.sublattice(base) == 0)
        };
        let is_inside = |site: Site| self.sites.is_inside(site);
        let is_base = |kind: usize| bases(kind).any(|base| self.is_far_cell(base, kind, is_inside));
        is_inside([i, j]) && (0..self.scale.templates.len()).any(is_base)
    }

    /// Whole cells by their first corner, then the others, and which of all these each is.
    fn cells(&self, columns: &Columns<'_>, regular: &[Site], part: &Laid) -> (Cells, Vec<usize>) {
        let mut cells = Cells::of_lattice(&self.lattice, self.outline.regions().len() + 1);
        let is_inside = |site: Site| columns.is_inside(site);
        let mut corners = Vec::new();
        for &[i, j] in regular.iter().filter(|&&site| self.lattice.sublattice(site) == 0) {
            for (kind, template) in self.scale.templates.iter().enumerate() {
                let region = match self.faces.whole([i, j], kind) {
                    None if self.is_far_cell([i, j], kind, is_inside) => {
                        columns.region(template.iter().map(|c| [i + c[0], j + c[1]]))
                    }
                    region => region,
                };
                if let Some(region) = region {
                    corners.clear();
                    corners.extend(template.iter().filter_map(|c| part.index([i + c[0], j + c[1]])));
                    if corners.len() == template.len() {
                        cells.push(&corners, (region * self.scale.templates.len() + kind) as u32);
                    }
                }
            }
        }
        let mut cut = Vec::new();
        for (number, face) in self.faces.cells().filter(|face| face.whole.is_none()).enumerate() {
            corners.clear();
            corners.extend(face.corners.iter().filter_map(|&node| self.particle(part, node)));
            if corners.len() < face.corners.len() {
                continue;
            }
            // Begin with the lowest number: how a cell was found does not show.
            let number_of = |k: usize| part.order[corners[k] as usize];
            let lowest = (0..corners.len()).min_by_key(|&k| number_of(k)).unwrap_or_default();
            corners.rotate_left(lowest);
            let [x, y] = part.reference.get(corners[0] as usize);
            let relative = |&i: &u32| {
                let [px, py] = part.reference.get(i as usize);
                [px - x, py - y]
            };
            let kind = cells.add_kind(corners.iter().map(relative).collect(), face.region);
            cells.push(&corners, kind);
            cut.push(number);
        }
        (cells, cut)
    }
}

/// What of a body that is laid out in some columns the whole has in another order.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// The particles at no site: their index here, and their number among all such, ascending.
    pub along: Vec<[usize; 2]>,
    /// Of each cut cell its number among all such.
    pub cut: Vec<usize>,
    /// The column that each particle is counted with; ascending in a part.
    pub columns: Vec<i32>,
}

/// The particles that are laid out.
struct Laid {
    window: Window,
    /// The index of the particle at each site of the window; [`u32::MAX`] where there is none.
    at: Vec<u32>,
    /// The index of each particle at no site; [`u32::MAX`] of those that are not here.
    along: Vec<u32>,
    sites: Vec<Site>,
    reference: Vectors,
    /// In which order the whole body has them.
    order: Vec<u32>,
}

impl Laid {
    fn new(window: Window, along: usize) -> Self {
        let (at, along) = (vec![u32::MAX; window.count() as usize], vec![u32::MAX; along]);
        Self { window, at, along, sites: Vec::new(), reference: Vectors::default(), order: Vec::new() }
    }

    fn add_at(&mut self, site: Site) {
        if let Some(cell) = self.window.number(site) {
            self.at[cell] = self.sites.len() as u32;
        }
        self.sites.push(site);
    }

    fn index(&self, site: Site) -> Option<u32> {
        self.window.number(site).map(|cell| self.at[cell]).filter(|&here| here != u32::MAX)
    }
}

/// Along the outline: loop by loop, piece by piece.
fn order(a: &Place, b: &Place) -> std::cmp::Ordering {
    (a.ring, a.piece).cmp(&(b.ring, b.piece)).then(a.t.total_cmp(&b.t))
}
