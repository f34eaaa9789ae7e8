//! Cuts the cells that an outline passes.
//!
//! The outline becomes a chain of chords between nodes: its corners, the lattice points on it, and where it crosses
//! the sides of cells. Two nodes that follow each other along the outline share a cell, so that every cell is cut
//! by itself; nodes on its sides are shared with its neighbours, and the parts fit together by construction. Lines inside,
//! along which regions of the body meet, cut in the same way, and both parts stay.

use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};

use super::faces::{Face, Faces, Node};
use super::near::NearPieces;
use super::sites::{NearSite, Sites, State};
use super::{FitError, ROUNDING, Scale, is_kept_corner, order};
use crate::flock::lattice::{Lattice, Site};
use crate::flock::vectors::distance;
use crate::geometry::lists::{distinct, sides};
use crate::geometry::locate::Finder;
use crate::geometry::meeting::meetings;
use crate::geometry::outline::Place;
use crate::geometry::partition::Partition;
use crate::geometry::point::plus;

/// Cuts the cells near the outline.
///
/// # Errors
/// A place where the outline has finer details than cells can follow.
pub fn cut(
    (lattice, outline, near): (&Lattice, &Partition, &NearPieces),
    scale: &Scale,
    sites: &Sites,
) -> Result<Faces, FitError> {
    let mut cutter = Cutter::new(lattice, outline, scale, sites);
    cutter.cross_sides(near);
    cutter.add_corners()?;
    cutter.chain()?;
    cutter.faces()
}

/// A cell near the outline.
struct Candidate {
    site: Site,
    kind: u32,
    /// Lattice points at its corners, counter-clockwise.
    corners: Vec<Site>,
    /// Chords of the outline through its inside, in the outline's direction.
    chords: Vec<[u32; 2]>,
    /// Chords of lines inside.
    lines: Vec<[u32; 2]>,
    /// Whether a side between two nodes is a part of the outline: with the cell inside, or outside.
    along: Vec<([u32; 2], bool)>,
}

/// The two lattice points of a side, the lower first.
type SideKey = [Site; 2];

struct Cutter<'a> {
    lattice: &'a Lattice,
    outline: &'a Partition,
    scale: &'a Scale,
    sites: &'a Sites,
    nodes: Vec<Node>,
    /// Cells that each node belongs to, ascending.
    cells_of: Vec<Vec<u32>>,
    candidates: Vec<Candidate>,
    known: HashMap<(Site, u32), u32>,
    /// Cells on either side of each side.
    beside: HashMap<SideKey, Vec<u32>>,
    /// Nodes on each side: shares of the way from its lower lattice point.
    cuts: HashMap<SideKey, Vec<(f64, u32)>>,
    /// Nodes of corners, by loop and piece.
    corners: HashMap<[usize; 2], u32>,
    /// Sides along lines inside, either way.
    interfaces: HashSet<[u32; 2]>,
    /// For the few parts of cells of which nothing else says whether they are inside.
    finder: OnceCell<Finder<'a>>,
}

impl<'a> Cutter<'a> {
    fn new(lattice: &'a Lattice, outline: &'a Partition, scale: &'a Scale, sites: &'a Sites) -> Self {
        let mut cutter = Self {
            lattice,
            outline,
            scale,
            sites,
            nodes: Vec::new(),
            cells_of: Vec::new(),
            candidates: Vec::new(),
            known: HashMap::new(),
            beside: HashMap::new(),
            cuts: HashMap::new(),
            corners: HashMap::new(),
            interfaces: HashSet::new(),
            finder: OnceCell::new(),
        };
        cutter.lattice_nodes();
        cutter.collect_candidates();
        cutter
    }

    /// The first nodes are the sites near the outline, in their order.
    fn lattice_nodes(&mut self) {
        for (number, near) in self.sites.near().iter().enumerate() {
            let (place, moved) = match near.state {
                State::On { place, moved } => (Some(place), moved),
                State::Inside | State::Outside => (None, false),
            };
            let corner = place.filter(|place| self.is_corner(place)).map(|place| self.outline.corner(&place));
            if let Some(key) = corner {
                self.corners.insert(key, number as u32);
            }
            let place = corner.map(|[ring, piece]| Place { ring, piece, t: 0.0 }).or(place);
            let site = (!moved).then_some(near.site);
            self.nodes.push(Node { point: near.point, place, is_corner: corner.is_some(), site });
            self.cells_of.push(Vec::new());
        }
    }

    fn is_corner(&self, place: &Place) -> bool {
        (place.t == 0.0 || place.t == 1.0)
            && is_kept_corner(self.outline, self.scale, self.outline.corner(place))
    }

    fn collect_candidates(&mut self) {
        let mut cells: Vec<(Site, u32)> = Vec::new();
        for NearSite { site: [i, j], .. } in self.sites.near() {
            for (kind, template) in self.scale.templates.iter().enumerate() {
                cells.extend(template.iter().map(|corner| ([i - corner[0], j - corner[1]], kind as u32)));
            }
        }
        let is_base = |site: Site| self.lattice.is_site(site) && self.lattice.sublattice(site) == 0;
        cells.retain(|&(site, _)| is_base(site));
        for (site, kind) in distinct(cells) {
            let template = &self.scale.templates[kind as usize];
            let corners: Vec<Site> =
                template.iter().map(|corner| [site[0] + corner[0], site[1] + corner[1]]).collect();
            // Beyond the sites near the outline nothing is cut.
            if !corners.iter().all(|&corner| self.sites.number(corner).is_some()) {
                continue;
            }
            let number = self.candidates.len() as u32;
            self.known.insert((site, kind), number);
            for [corner, next] in sides(&corners) {
                let node = self.node_of(corner);
                self.cells_of[node as usize].push(number);
                let key = side_key(corner, next);
                self.beside.entry(key).or_default().push(number);
            }
            let [chords, lines] = [Vec::new(), Vec::new()];
            self.candidates.push(Candidate { site, kind, corners, chords, lines, along: Vec::new() });
        }
    }

    /// The node of a site near the outline.
    fn node_of(&self, site: Site) -> u32 {
        self.sites.number(site).unwrap_or_default()
    }

    fn add_node(&mut self, node: Node, cells: Vec<u32>) -> u32 {
        self.nodes.push(node);
        self.cells_of.push(cells);
        self.nodes.len() as u32 - 1
    }

    /// Nodes where the outline crosses the sides of cells.
    fn cross_sides(&mut self, near: &NearPieces) {
        let mut keys: Vec<SideKey> = self.beside.keys().copied().collect();
        keys.sort_unstable();
        for key in keys {
            let ends = key.map(|site| self.nodes[self.node_of(site) as usize]);
            let [a, b] = ends.map(|node| node.point);
            let mut found: Vec<(f64, Place)> = Vec::new();
            for [ring, piece] in near.around(a, b) {
                let crossings = meetings(a, b, self.outline.piece(ring, piece)).into_iter();
                found.extend(crossings.map(|[s, t]| (s, Place { ring, piece, t })));
            }
            found.retain(|(_, place)| ends.iter().all(|end| !self.is_at_end(end, place)));
            found.sort_by(|x, y| x.0.total_cmp(&y.0));
            for (share, place) in found {
                self.add_cut(key, share, place);
            }
        }
    }

    /// Whether a crossing is nothing but the end of the side, which is on the outline itself.
    fn is_at_end(&self, end: &Node, crossing: &Place) -> bool {
        let Some(place) = end.place else { return false };
        let piece = self.outline.piece(crossing.ring, crossing.piece);
        let is_end = place.t == 0.0 || place.t == 1.0;
        let corner = is_end.then(|| self.outline.corner(&place));
        let ends_here = |t: f64| corner == Some(self.outline.corner(&Place { t, ..*crossing }));
        let same =
            [place.ring, place.piece] == [crossing.ring, crossing.piece] || ends_here(0.0) || ends_here(1.0);
        let apart = distance(piece.point(crossing.t), end.point);
        match &piece.arc {
            // A straight piece meets the side once: at its end.
            None if same => true,
            Some(_) if same => apart < 0.05 * self.scale.altitude,
            _ => apart < ROUNDING * self.scale.spacing,
        }
    }

    fn add_cut(&mut self, key: SideKey, share: f64, place: Place) {
        let point = self.outline.point(place);
        let near = ROUNDING * self.scale.spacing;
        let known = self.cuts.get(&key).into_iter().flatten();
        if known.into_iter().any(|&(_, node)| distance(self.nodes[node as usize].point, point) < near) {
            return;
        }
        let piece = self.outline.piece(place.ring, place.piece);
        let corner = [0.0, 1.0].into_iter().find_map(|t| {
            let corner = self.outline.corner(&Place { t, ..place });
            let is_there = distance(piece.point(t), point) < near;
            (is_there && is_kept_corner(self.outline, self.scale, corner)).then_some(corner)
        });
        let beside = self.beside.get(&key).cloned().unwrap_or_default();
        let node = match corner {
            None => self.add_node(Node { point, place: Some(place), is_corner: false, site: None }, beside),
            Some(corner) => match self.corners.get(&corner) {
                Some(&node) => {
                    let cells = &mut self.cells_of[node as usize];
                    cells.extend(beside);
                    cells.sort_unstable();
                    cells.dedup();
                    node
                }
                None => self.add_corner(corner, beside),
            },
        };
        let cuts = self.cuts.entry(key).or_default();
        cuts.push((share, node));
        cuts.sort_by(|x, y| x.0.total_cmp(&y.0));
    }

    fn add_corner(&mut self, [ring, piece]: [usize; 2], cells: Vec<u32>) -> u32 {
        let place = Place { ring, piece, t: 0.0 };
        let point = self.outline.point(place);
        let node = self.add_node(Node { point, place: Some(place), is_corner: true, site: None }, cells);
        self.corners.insert([ring, piece], node);
        node
    }

    /// Corners that are neither lattice points nor on a side yet: inside of cells, or so near a side that they
    /// are on it.
    fn add_corners(&mut self) -> Result<(), FitError> {
        let all: Vec<[usize; 2]> = self
            .outline
            .pieces()
            .map(|(ring, piece, _)| [ring, piece])
            .filter(|&corner| self.outline.named(corner) == corner)
            .filter(|&corner| is_kept_corner(self.outline, self.scale, corner))
            .collect();
        for key in all {
            if self.corners.contains_key(&key) {
                continue;
            }
            let point = self.outline.piece(key[0], key[1]).from;
            let (inside, sides) = self.around(point);
            for (side, share) in sides {
                self.add_cut(side, share, Place { ring: key[0], piece: key[1], t: 0.0 });
            }
            if !self.corners.contains_key(&key) {
                let cell = inside.ok_or(self.detail(point))?;
                self.add_corner(key, vec![cell]);
            }
        }
        Ok(())
    }

    fn detail(&self, place: [f64; 2]) -> FitError {
        FitError::Detail { spacing: self.scale.spacing, place }
    }

    /// The cell that holds a point, and the sides that it lies on, with the share of the way along each.
    fn around(&self, point: [f64; 2]) -> (Option<u32>, Vec<(SideKey, f64)>) {
        let [i, j] = self.lattice.grid_coordinates(point).map(|v| v.round() as i32);
        let near = ROUNDING * self.scale.spacing;
        let (mut inside, mut near_sides) = (None, Vec::new());
        let window = (i - 6..=i + 6).flat_map(|i| (j - 6..=j + 6).map(move |j| [i, j]));
        for cell in window.flat_map(|site| {
            (0..self.scale.templates.len()).filter_map(move |kind| self.known.get(&(site, kind as u32)))
        }) {
            let corners = &self.candidates[*cell as usize].corners;
            let mut least = f64::INFINITY;
            let mut beside = None;
            for [corner, next] in sides(corners) {
                let [a, b] = [corner, next].map(|site| self.nodes[self.node_of(site) as usize].point);
                let length = distance(a, b);
                let left = ((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])) / length;
                if left < least {
                    least = left;
                    let along = ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1]))
                        / length
                        / length;
                    let key = side_key(corner, next);
                    beside = Some((key, if key[0] == corner { along } else { 1.0 - along }));
                }
            }
            if least > near {
                inside = Some(*cell);
            } else if least >= -near
                && let Some(side) = beside
                && !near_sides.iter().any(|(key, _)| *key == side.0)
            {
                near_sides.push(side);
            }
        }
        (inside, near_sides)
    }

    /// Gives every chord of the outline and of the lines inside to the cell that it cuts, or to the side that it runs along.
    fn chain(&mut self) -> Result<(), FitError> {
        let mut chain: Vec<(Place, u32)> = Vec::new();
        for (number, node) in self.nodes.iter().enumerate() {
            if let Some(place) = node.place {
                let [ring, piece] = self.outline.corner(&place);
                let is_end = node.is_corner || place.t == 1.0;
                chain.push((if is_end { Place { ring, piece, t: 0.0 } } else { place }, number as u32));
            }
        }
        chain.sort_by(|(a, x), (b, y)| order(a, b).then(x.cmp(y)));
        for (ring, pieces) in self.outline.rings().enumerate() {
            let from = chain.partition_point(|(place, _)| place.ring < ring);
            let to = chain.partition_point(|(place, _)| place.ring <= ring);
            let mut nodes: Vec<u32> = chain[from..to].iter().map(|&(_, node)| node).collect();
            // The ends of a line are corners of something else.
            let end = |piece: usize| self.corners.get(&self.outline.named([ring, piece])).copied();
            if self.outline.is_closed(ring) {
                nodes.extend(nodes.first().copied());
            } else {
                nodes.splice(0..0, end(0));
                nodes.extend(end(pieces.len()));
            }
            nodes.dedup();
            // Nothing of a loop that a cell has all to itself shows in the lattice.
            let least = if self.outline.is_closed(ring) { 4 } else { 2 };
            if nodes.len() < least {
                return Err(self.detail(pieces[0].from));
            }
            for pair in nodes.windows(2) {
                self.add_chord([pair[0], pair[1]], self.outline.is_bounding(ring))?;
            }
        }
        Ok(())
    }

    fn add_chord(&mut self, [from, to]: [u32; 2], is_bounding: bool) -> Result<(), FitError> {
        let (a, b) = (&self.cells_of[from as usize], &self.cells_of[to as usize]);
        let common: Vec<u32> = a.iter().filter(|cell| b.contains(cell)).copied().collect();
        let detail = self.detail(self.nodes[from as usize].point);
        if !is_bounding {
            self.interfaces.extend([[from, to], [to, from]]);
        }
        match common[..] {
            [] => Err(detail),
            [cell] if !self.follow_each_other(cell, [from, to]) => {
                let candidate = &mut self.candidates[cell as usize];
                if is_bounding { &mut candidate.chords } else { &mut candidate.lines }.push([from, to]);
                Ok(())
            }
            _ => {
                for cell in common {
                    let is_inside = self.boundary(cell).windows(2).any(|pair| pair == [from, to]);
                    let is_outside = self.boundary(cell).windows(2).any(|pair| pair == [to, from]);
                    match (is_inside, is_outside) {
                        (false, false) => return Err(detail),
                        _ if !is_bounding => {}
                        (true, _) => self.candidates[cell as usize].along.push(([from, to], true)),
                        (_, true) => self.candidates[cell as usize].along.push(([to, from], false)),
                    }
                }
                Ok(())
            }
        }
    }

    fn follow_each_other(&self, cell: u32, [from, to]: [u32; 2]) -> bool {
        self.boundary(cell).windows(2).any(|pair| pair == [from, to] || pair == [to, from])
    }

    /// Nodes around a cell, counter-clockwise, the first one again at the end.
    fn boundary(&self, cell: u32) -> Vec<u32> {
        let corners = &self.candidates[cell as usize].corners;
        let mut nodes = Vec::with_capacity(2 * corners.len());
        for [corner, next] in sides(corners) {
            nodes.push(self.node_of(corner));
            let key = side_key(corner, next);
            if let Some(cuts) = self.cuts.get(&key) {
                let on_side = cuts.iter().map(|&(_, node)| node);
                if key[0] == corner { nodes.extend(on_side) } else { nodes.extend(on_side.rev()) }
            }
        }
        nodes.push(nodes[0]);
        nodes
    }

    fn faces(mut self) -> Result<Faces, FitError> {
        let mut faces = Vec::new();
        for cell in 0..self.candidates.len() as u32 {
            let boundary = self.boundary(cell);
            let candidate = &self.candidates[cell as usize];
            let is_cut = !(candidate.chords.is_empty() && candidate.lines.is_empty());
            let parts = if is_cut {
                let chords: Vec<[u32; 2]> =
                    candidate.chords.iter().chain(&candidate.lines).copied().collect();
                self.parts(&boundary, &chords)
            } else {
                vec![boundary[..boundary.len() - 1].to_vec()]
            };
            for corners in parts {
                if !self.is_inside(candidate, &corners)? {
                    continue;
                }
                if (1..corners.len()).any(|k| corners[..k].contains(&corners[k])) {
                    return Err(self.detail(self.nodes[corners[0] as usize].point));
                }
                let stays = |&node: &u32| self.nodes[node as usize].site.is_some();
                let is_whole =
                    !is_cut && corners.len() == candidate.corners.len() && corners.iter().all(stays);
                let whole = is_whole.then_some((candidate.site, candidate.kind));
                faces.push(Face { corners, whole, region: 0 });
            }
        }
        let candidates = std::mem::take(&mut self.known);
        let interfaces = std::mem::take(&mut self.interfaces);
        let nodes = self.nodes;
        let mut faces = Faces { nodes, faces, interfaces, candidates, still_whole: HashMap::new() };
        faces.find_regions(self.outline);
        faces.note_whole();
        Ok(faces)
    }

    /// The parts into which chords cut a cell: walks along its boundary and the chords, always turning left.
    fn parts(&self, boundary: &[u32], chords: &[[u32; 2]]) -> Vec<Vec<u32>> {
        let mut ways: Vec<[u32; 2]> = boundary.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        ways.extend(chords.iter().flat_map(|&[a, b]| [[a, b], [b, a]]));
        let mut used = vec![false; ways.len()];
        let mut parts = Vec::new();
        for first in 0..ways.len() {
            let mut part = Vec::new();
            let mut way = first;
            while !used[way] {
                used[way] = true;
                part.push(ways[way][0]);
                match self.next_way(&ways, ways[way]) {
                    Some(next) => way = next,
                    None => break,
                }
            }
            if part.len() > 2 {
                parts.push(part);
            }
        }
        parts
    }

    /// Of the ways that leave the end of a way the first one clockwise from the way back.
    fn next_way(&self, ways: &[[u32; 2]], [from, at]: [u32; 2]) -> Option<usize> {
        let direction = |to: u32| {
            let (p, q) = (self.nodes[at as usize].point, self.nodes[to as usize].point);
            (q[1] - p[1]).atan2(q[0] - p[0])
        };
        let back = direction(from);
        let clockwise = |to: u32| {
            let turn = (back - direction(to)).rem_euclid(std::f64::consts::TAU);
            if to == from { std::f64::consts::TAU } else { turn }
        };
        let leaving = (0..ways.len()).filter(|&way| ways[way][0] == at);
        leaving.min_by(|&a, &b| clockwise(ways[a][1]).total_cmp(&clockwise(ways[b][1])))
    }

    /// Whether a part of a cell is inside: what the outline says whose chords bound it, or its lattice points.
    fn is_inside(&self, candidate: &Candidate, part: &[u32]) -> Result<bool, FitError> {
        let mut verdicts = [false; 2];
        for way in sides(part) {
            let back = [way[1], way[0]];
            if candidate.chords.contains(&way) {
                verdicts[1] = true;
            } else if candidate.chords.contains(&back) {
                verdicts[0] = true;
            } else if let Some((_, inside)) = candidate.along.iter().find(|(side, _)| *side == way) {
                verdicts[usize::from(*inside)] = true;
            }
        }
        let point = self.nodes[part[0] as usize].point;
        match verdicts {
            [true, true] => return Err(self.detail(point)),
            [false, true] => return Ok(true),
            [true, false] => return Ok(false),
            [false, false] => {}
        }
        for &node in part {
            match self.sites.near().get(node as usize).map(|near| near.state) {
                Some(State::Inside) => return Ok(true),
                Some(State::Outside) => return Ok(false),
                _ => {}
            }
        }
        let sum = part.iter().fold([0.0; 2], |sum, &node| plus(sum, self.nodes[node as usize].point));
        let finder = self.finder.get_or_init(|| Finder::new(self.outline.outline()));
        Ok(finder.contains(sum.map(|v| v / part.len() as f64)))
    }
}

fn side_key(a: Site, b: Site) -> SideKey {
    if a < b { [a, b] } else { [b, a] }
}
