//! What an outline leaves of the cells near it.

use std::collections::{HashMap, HashSet};

use crate::flock::lattice::Site;
use crate::geometry::lists::sides;
use crate::geometry::outline::Place;
use crate::geometry::partition::Partition;
use crate::geometry::point::area;
use crate::material::stiffness::centroid;

/// A corner of cells near the outline.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// \[length\]
    pub point: [f64; 2],
    /// Where it is on the outline, if it is.
    pub place: Option<Place>,
    /// Whether it is a corner of the outline.
    pub is_corner: bool,
    /// The site of a lattice point that has not been moved.
    pub site: Option<Site>,
}

/// The rest of a cell near the outline.
#[derive(Clone, Debug, Default)]
pub struct Face {
    /// Nodes, counter-clockwise; none of a face that became part of another.
    pub corners: Vec<u32>,
    /// Of a whole cell of the lattice: its first site, and which of its cells.
    pub whole: Option<(Site, u32)>,
    /// The region of the body that it lies in.
    pub region: usize,
}

/// The cells near the outline, as far as they are inside.
#[derive(Debug)]
pub struct Faces {
    pub nodes: Vec<Node>,
    pub faces: Vec<Face>,
    /// Sides along lines inside, either way.
    pub interfaces: HashSet<[u32; 2]>,
    /// Every cell near the outline, whether anything is left of it or not.
    pub(super) candidates: HashMap<(Site, u32), u32>,
    /// Cells near the outline that are still whole, and their regions.
    pub(super) still_whole: HashMap<(Site, u32), usize>,
}

impl Faces {
    /// Faces that are left.
    pub fn cells(&self) -> impl Iterator<Item = &Face> {
        self.faces.iter().filter(|face| !face.corners.is_empty())
    }

    /// Whether the cell was near enough to the outline to be looked at.
    pub fn is_candidate(&self, site: Site, kind: usize) -> bool {
        self.candidates.contains_key(&(site, kind as u32))
    }

    /// The region of a cell that was looked at and is whole.
    pub fn whole(&self, site: Site, kind: usize) -> Option<usize> {
        self.still_whole.get(&(site, kind as u32)).copied()
    }

    /// The face that has each side, the way it runs there.
    pub fn owners(&self) -> HashMap<[u32; 2], usize> {
        let faces = self.faces.iter().enumerate();
        faces.flat_map(|(number, face)| sides(&face.corners).map(move |way| (way, number))).collect()
    }

    /// To be called when the faces are final.
    pub fn note_whole(&mut self) {
        let whole = self.cells().filter_map(|face| Some((face.whole?, face.region)));
        self.still_whole = whole.collect();
    }

    /// Gives each face its region. Faces that share a side that is no interface are of one region: that of the middle
    /// of the largest of them, which is far from any line.
    pub(super) fn find_regions(&mut self, outline: &Partition) {
        if outline.regions().is_empty() {
            return;
        }
        let owner = self.owners();
        let mut seen = vec![false; self.faces.len()];
        for first in 0..self.faces.len() {
            let mut group = Vec::new();
            let mut open = vec![first];
            while let Some(face) = open.pop() {
                if std::mem::replace(&mut seen[face], true) {
                    continue;
                }
                group.push(face);
                let across = sides(&self.faces[face].corners).filter(|way| !self.interfaces.contains(way));
                open.extend(across.filter_map(|[a, b]| owner.get(&[b, a])));
            }
            let points = |face: &usize| -> Vec<[f64; 2]> {
                self.faces[*face].corners.iter().map(|&node| self.nodes[node as usize].point).collect()
            };
            let size = |face: &usize| area(&points(face));
            if let Some(largest) = group.iter().max_by(|a, b| size(a).total_cmp(&size(b))) {
                let (points, o) =
                    (points(largest), self.nodes[self.faces[*largest].corners[0] as usize].point);
                let relative: Vec<[f64; 2]> = points.iter().map(|p| [p[0] - o[0], p[1] - o[1]]).collect();
                let middle = centroid(&relative);
                let region = outline.region([o[0] + middle[0], o[1] + middle[1]]);
                group.into_iter().for_each(|face| self.faces[face].region = region);
            }
        }
    }
}
