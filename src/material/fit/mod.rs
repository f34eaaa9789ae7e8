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
mod narrow;
mod near;
mod sites;
#[cfg(test)]
mod tests;
mod tidy;

use std::sync::Arc;

use self::cut::{Faces, Node};
use self::near::NearPieces;
use self::sites::{Columns, Sites};
use super::cells::{Cells, templates};
use super::stiffness::area;
use crate::flock::body::{Body, OutlineParticles};
use crate::flock::lattice::{Lattice, Site};
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::outline::{Outline, Place};
use crate::geometry::partition::Partition;

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
        "the shape is {width:.6} wide near ({:.6}, {:.6}), less than the spacing of the lattice, which is {spacing:.6}",
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
            let count = shape.len();
            least.area = least.area.min(area(shape) / scale.area);
            for k in 0..count {
                let (a, b) = (shape[k], shape[(k + 1) % count]);
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

    /// The whole body.
    ///
    /// # Errors
    /// More sites in its bounds than can be looked at together.
    pub fn body(&self) -> Result<Fitted, FitError> {
        let columns = self.sites.columns(&self.lattice, self.sites.all_columns())?;
        // Lattice sites near the outline that are in cells, and those far from it, in the order of sites.
        let near = self.faces.nodes.iter().zip(&self.used).filter(|(_, used)| **used);
        let near = near.filter_map(|(node, _)| node.site);
        let mut sites: Vec<Site> = columns.far_inside().chain(near).collect();
        sites.sort_unstable();
        let regular = sites.len();
        let index = |site: Site| sites.binary_search(&site).map_or(u32::MAX, |i| i as u32);
        let mut particle = vec![u32::MAX; self.faces.nodes.len()];
        for (number, node) in self.faces.nodes.iter().enumerate().filter(|(number, _)| self.used[*number]) {
            particle[number] = match node.site {
                Some(site) => index(site),
                None => regular as u32 + self.number_along[number],
            };
        }
        let place = |node: &Node| node.point;
        let reference: Vectors = sites
            .iter()
            .map(|&site| self.lattice.position(site))
            .chain(self.along.iter().map(|&node| place(&self.faces.nodes[node as usize])))
            .collect();
        let mut places = vec![None; reference.len()];
        for (number, node) in self.faces.nodes.iter().enumerate().filter(|(number, _)| self.used[*number]) {
            // Only what bounds the body is its outline.
            places[particle[number] as usize] =
                node.place.filter(|place| self.outline.is_bounding(place.ring));
        }
        let cells = self.cells(&columns, &sites, &particle, &reference);
        let step = if self.lattice.is_site([0, 1]) { 1 } else { 2 };
        sites.extend((0..self.along.len() as i32).map(|k| [Body::ALONG_OUTLINE, k * step]));
        let body = Body {
            lattice: self.lattice.clone(),
            is_frame: vec![false; sites.len()],
            sites,
            reference: Arc::new(reference),
            frame: None,
            numbering: None,
            outline: Some(Arc::new(OutlineParticles { regular, places })),
            part: None,
        };
        Ok(Fitted { body, cells })
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

    /// Whole cells by their first corner, then the others.
    fn cells(&self, columns: &Columns<'_>, sites: &[Site], particle: &[u32], reference: &Vectors) -> Cells {
        let mut cells = Cells::of_lattice(&self.lattice, self.outline.regions().len() + 1);
        let index = |site: Site| sites.binary_search(&site).ok().map(|i| i as u32);
        let is_inside = |site: Site| columns.is_inside(site);
        let mut corners = Vec::new();
        for &[i, j] in sites.iter().filter(|&&site| self.lattice.sublattice(site) == 0) {
            for (kind, template) in self.scale.templates.iter().enumerate() {
                let region = match self.faces.whole([i, j], kind) {
                    None if self.is_far_cell([i, j], kind, is_inside) => {
                        columns.region(template.iter().map(|c| [i + c[0], j + c[1]]))
                    }
                    region => region,
                };
                if let Some(region) = region {
                    corners.clear();
                    corners.extend(template.iter().filter_map(|c| index([i + c[0], j + c[1]])));
                    cells.push(&corners, (region * self.scale.templates.len() + kind) as u32);
                }
            }
        }
        for face in self.faces.cells().filter(|face| face.whole.is_none()) {
            corners.clear();
            corners.extend(face.corners.iter().map(|&node| particle[node as usize]));
            // Begin with the lowest number: how a cell was found does not show.
            let lowest = (0..corners.len()).min_by_key(|&k| corners[k]).unwrap_or_default();
            corners.rotate_left(lowest);
            let [x, y] = reference.get(corners[0] as usize);
            let relative = |&i: &u32| {
                let [px, py] = reference.get(i as usize);
                [px - x, py - y]
            };
            let kind = cells.add_kind(corners.iter().map(relative).collect(), face.region);
            cells.push(&corners, kind);
        }
        cells
    }
}

/// Along the outline: loop by loop, piece by piece.
fn order(a: &Place, b: &Place) -> std::cmp::Ordering {
    (a.ring, a.piece).cmp(&(b.ring, b.piece)).then(a.t.total_cmp(&b.t))
}
