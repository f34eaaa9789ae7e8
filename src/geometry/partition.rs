//! A shape divided into regions: its outline, and the lines inside along which regions meet.
//!
//! Regions are given as shapes of their own, which may leave the body and overlap: the later one counts. Of their outlines
//! what lies inside the body and on no line before it becomes lines; where these end on the outline or on each other,
//! both have a corner.

use std::collections::{HashMap, HashSet};

use super::meeting::{crossings, on};
use super::outline::{Outline, OutlineError, Place};
use super::piece::{Piece, numbered};
use super::point::{Point, distance};
use super::shape::Shape;

/// Lengths below this part of the body's size are none.
const NOTHING: f64 = 1e-9;

/// Why regions divide no body. Regions are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PartitionError {
    /// A region has no outline of its own that could divide anything.
    #[error("region {region}: {reason}")]
    Outline {
        /// Number of the region, from 1.
        region: usize,
        /// The fault of its outline.
        reason: OutlineError,
    },
    /// A region lies outside the body, or only along its outline.
    #[error("region {region} has no part of the body")]
    Outside {
        /// Number of the region, from 1.
        region: usize,
    },
}

/// The outline of a body, and the lines inside along which its regions meet.
#[derive(Clone, Debug, PartialEq)]
pub struct Partition {
    /// With a corner wherever a line ends on it.
    outline: Outline,
    /// Pieces of the lines inside.
    lines: Vec<Vec<Piece>>,
    /// Of each line, whether it comes back to where it begins.
    closed: Vec<bool>,
    /// Ends of lines, as loop and piece that begins there, and the corner that each is.
    joined: HashMap<[usize; 2], [usize; 2]>,
    /// Corners where lines end.
    junctions: HashSet<[usize; 2]>,
    regions: Vec<Outline>,
}

impl Partition {
    /// A body of one region.
    pub fn whole(outline: &Outline) -> Self {
        Self {
            outline: outline.clone(),
            lines: Vec::new(),
            closed: Vec::new(),
            joined: HashMap::new(),
            junctions: HashSet::new(),
            regions: Vec::new(),
        }
    }

    /// A body with regions.
    ///
    /// # Errors
    /// A region whose own outline crosses itself or has no area, or that has no part of the body.
    pub fn new(outline: &Outline, regions: &[Shape]) -> Result<Self, PartitionError> {
        let mut partition = Self::whole(outline);
        for (k, shape) in regions.iter().enumerate() {
            let region = Outline::of_shape(shape)
                .map_err(|reason| PartitionError::Outline { region: k + 1, reason })?;
            partition.add(&region);
            partition.regions.push(region);
            // Lines that are not there yet, or those of others that the region shares.
            if !partition.has_part(k) {
                return Err(PartitionError::Outside { region: k + 1 });
            }
        }
        partition.join();
        Ok(partition)
    }

    /// The outline of the body.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// Loops of the outline, then lines; pieces of either.
    pub fn rings(&self) -> impl Iterator<Item = &[Piece]> {
        self.outline.rings().iter().chain(&self.lines).map(Vec::as_slice)
    }

    /// Pieces of a loop or line.
    pub fn ring(&self, ring: usize) -> &[Piece] {
        let loops = self.outline.rings();
        loops.get(ring).unwrap_or_else(|| &self.lines[ring - loops.len()])
    }

    /// Pieces of the outline and of lines, with the numbers of their loop or line and their own.
    pub fn pieces(&self) -> impl Iterator<Item = (usize, usize, &Piece)> {
        numbered(self.rings())
    }

    /// Pieces of the lines inside.
    pub fn lines(&self) -> impl Iterator<Item = &Piece> {
        self.lines.iter().flatten()
    }

    /// Whether a loop bounds the body, and is no line inside.
    pub(crate) fn is_bounding(&self, ring: usize) -> bool {
        ring < self.outline.rings().len()
    }

    /// Whether a loop or line comes back to where it begins: every loop of the outline does, and a region's outline
    /// that lies wholly inside the body.
    pub(crate) fn is_closed(&self, ring: usize) -> bool {
        self.is_bounding(ring) || self.closed[ring - self.outline.rings().len()]
    }

    /// The piece with these numbers in [`Partition::rings`].
    pub fn piece(&self, ring: usize, piece: usize) -> &Piece {
        &self.ring(ring)[piece]
    }

    /// \[length\]
    pub fn point(&self, place: Place) -> Point {
        self.piece(place.ring, place.piece).point(place.t)
    }

    /// The corner at an end of a piece: the loop, and the piece that begins there.
    pub fn corner(&self, place: &Place) -> [usize; 2] {
        self.named([place.ring, if place.t == 1.0 { place.piece + 1 } else { place.piece }])
    }

    /// The one name of a corner that belongs to several lines.
    pub fn named(&self, [ring, piece]: [usize; 2]) -> [usize; 2] {
        let piece = if self.is_closed(ring) && piece == self.ring(ring).len() { 0 } else { piece };
        self.joined.get(&[ring, piece]).copied().unwrap_or([ring, piece])
    }

    /// The region whose outline a line inside is part of, counted from 1: of several that share it the first.
    pub(crate) fn region_along(&self, line: usize) -> usize {
        let p = self.piece(line, 0).point(0.5);
        let is_along = |region: &Outline| region.nearest(p).1 <= 1e3 * self.near();
        self.regions.iter().position(is_along).map_or(0, |k| k + 1)
    }

    /// Whether a line ends at a corner.
    pub(crate) fn is_junction(&self, corner: [usize; 2]) -> bool {
        self.junctions.contains(&corner)
    }

    /// Shapes of the regions, in their order.
    pub fn regions(&self) -> &[Outline] {
        &self.regions
    }

    /// The region of a place that lies on no line: 0 is what no region has, others count from 1.
    pub fn region(&self, p: Point) -> usize {
        (0..self.regions.len()).rev().find(|&k| self.regions[k].contains(p)).map_or(0, |k| k + 1)
    }

    fn near(&self) -> f64 {
        NOTHING * self.outline.size()
    }

    /// Adds what a region's outline has inside the body.
    fn add(&mut self, region: &Outline) {
        let near = self.near();
        for ring in region.rings() {
            let mut cuts: Vec<Vec<f64>> = vec![Vec::new(); ring.len()];
            let mut known_cuts: HashMap<[usize; 2], Vec<f64>> = HashMap::new();
            for (r, p, known) in self.pieces() {
                let (low, high) = known.bounds();
                for (number, piece) in ring.iter().enumerate() {
                    let (l, h) = piece.bounds();
                    let is_apart = |k: usize| l[k] > high[k] + near || h[k] < low[k] - near;
                    if is_apart(0) || is_apart(1) {
                        continue;
                    }
                    for [s, t] in crossings(piece, known, near) {
                        cuts[number].push(s);
                        known_cuts.entry([r, p]).or_default().push(t);
                    }
                }
            }
            let touches: Vec<Point> = ring
                .iter()
                .zip(&cuts)
                .flat_map(|(piece, cuts)| cuts.iter().map(|&t| piece.point(t)))
                .collect();
            self.cut_known(&known_cuts);
            let parts: Vec<Piece> =
                ring.iter().zip(&mut cuts).flat_map(|(piece, cuts)| cut(piece, cuts, near)).collect();
            let kept: Vec<bool> = parts.iter().map(|part| self.is_new(part)).collect();
            let begins = |k: usize| {
                let before = (k + parts.len() - 1) % parts.len();
                kept[k] && (!kept[before] || touches.iter().any(|p| distance(*p, parts[k].from) <= near))
            };
            let Some(first) = (0..parts.len()).find(|&k| begins(k)) else {
                if kept[0] {
                    self.lines.push(parts);
                    self.closed.push(true);
                }
                continue;
            };
            for k in (first..first + parts.len()).map(|k| k % parts.len()).filter(|&k| kept[k]) {
                match self.lines.last_mut().filter(|_| !begins(k)) {
                    Some(line) => line.push(parts[k]),
                    None => {
                        self.lines.push(vec![parts[k]]);
                        self.closed.push(false);
                    }
                }
            }
        }
    }

    /// Whether a part of a region's outline lies inside the body and on nothing that is there already.
    fn is_new(&self, part: &Piece) -> bool {
        let near = self.near();
        let is_there = |(.., known): (usize, usize, &Piece)| {
            [0.25, 0.5, 0.75].into_iter().all(|t| on(known, part.point(t), near).is_some())
        };
        !self.pieces().any(is_there) && self.outline.contains(part.point(0.5))
    }

    /// Divides pieces that are there where something meets them.
    fn cut_known(&mut self, cuts: &HashMap<[usize; 2], Vec<f64>>) {
        let near = self.near();
        let divided = |(r, ring): (usize, &[Piece])| {
            let parts = |(p, piece): (usize, &Piece)| match cuts.get(&[r, p]) {
                None => vec![*piece],
                Some(cuts) => cut(piece, &mut cuts.clone(), near),
            };
            ring.iter().enumerate().flat_map(parts).collect()
        };
        let mut rings: Vec<Vec<Piece>> = self.rings().enumerate().map(divided).collect();
        self.lines = rings.split_off(self.outline.rings().len());
        self.outline = self.outline.with_rings(rings);
    }

    /// Names the ends of lines after the corners that they are.
    fn join(&mut self) {
        let near = self.near();
        let bounding = self.outline.rings().len();
        let open: Vec<usize> =
            (0..self.lines.len()).filter(|&k| !self.closed[k]).map(|k| bounding + k).collect();
        for line in open {
            let count = self.ring(line).len();
            for (piece, end) in [(0, self.piece(line, 0).from), (count, self.piece(line, count - 1).to)] {
                let corner = self.pieces().find(|(r, p, piece)| {
                    [*r, *p] != [line, 0] && *r <= line && distance(piece.from, end) <= near
                });
                if let Some((r, p, _)) = corner {
                    let corner = self.joined.get(&[r, p]).copied().unwrap_or([r, p]);
                    self.joined.insert([line, piece], corner);
                    self.junctions.insert(corner);
                }
            }
        }
    }

    /// Whether anything of the body lies in a region: beside its outline, or the whole body.
    fn has_part(&self, region: usize) -> bool {
        let near = 1e3 * self.near();
        let beside = |piece: &Piece| {
            let (p, n) = (piece.point(0.5), piece.normal(0.5));
            [1.0, -1.0].map(|side| [0, 1].map(|k| p[k] + side * near * n[k]))
        };
        let is_in = |p: &Point| self.regions[region].contains(*p) && self.outline.contains(*p);
        let pieces = self.pieces().map(|(.., piece)| piece);
        pieces
            .chain(self.regions[region].pieces().map(|(.., piece)| piece))
            .any(|p| beside(p).iter().any(is_in))
    }
}

/// The parts of a piece between cuts, given as shares of the way along.
fn cut(piece: &Piece, cuts: &mut [f64], near: f64) -> Vec<Piece> {
    cuts.sort_by(f64::total_cmp);
    let mut ends = vec![0.0];
    for &t in cuts.iter() {
        let far = |other: f64| (t - other).abs() * piece.length() > near;
        if far(0.0) && far(1.0) && ends.last().is_some_and(|&last| far(last)) {
            ends.push(t);
        }
    }
    ends.push(1.0);
    let is_ring = piece.from == piece.to;
    // A whole circle that is cut has a corner where it began as well, where lines may end.
    ends.windows(2)
        .map(|t| {
            let part = piece.part([t[0], t[1]]);
            let begins_at_corner = if t[0] == 0.0 { piece.begins_at_corner && !is_ring } else { true };
            Piece { begins_at_corner, ..part }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(min: Point, max: Point) -> Shape {
        Shape::Rectangle { min, max }
    }

    fn partition(regions: &[Shape]) -> Partition {
        let outline = Outline::of_shape(&rectangle([0.0; 2], [4.0, 3.0])).expect("an outline");
        Partition::new(&outline, regions).expect("regions")
    }

    fn length(partition: &Partition) -> f64 {
        partition.lines().map(Piece::length).sum()
    }

    #[test]
    fn a_region_inside_adds_its_own_outline() {
        let disc = Shape::Disc { centre: [2.0, 1.0], radius: 0.5 };
        let found = partition(&[disc]);
        assert_eq!(found.outline(), partition(&[]).outline());
        assert!((length(&found) - std::f64::consts::PI).abs() < 1e-12 && found.is_closed(1));
        assert_eq!([[2.3, 1.0], [2.6, 1.0]].map(|p| found.region(p)), [1, 0]);
    }

    #[test]
    fn layers_share_their_edges_with_the_body_and_with_each_other() {
        let found = partition(&[
            rectangle([0.0; 2], [4.0, 1.0]),
            rectangle([-1.0, 1.0], [9.0, 2.0]),
            rectangle([0.0, 0.0], [1.0, 1.0]),
        ]);
        assert!((length(&found) - 9.0).abs() < 1e-12, "two across and one upright: {}", length(&found));
        assert!(
            (found.outline().length() - 14.0).abs() < 1e-12 && (found.outline().area() - 12.0).abs() < 1e-12
        );
        assert_eq!(found.outline().corners().count(), 4 + 4 + 1, "where lines end the outline has corners");
        assert!(found.outline().pieces().all(|(.., piece)| piece.number < 4), "pieces keep their numbers");
        assert_eq!([[0.5, 0.5], [2.0, 0.5], [2.0, 1.5], [2.0, 2.5]].map(|p| found.region(p)), [3, 1, 2, 0]);
        for (ring, line) in found.rings().enumerate().skip(1) {
            for end in [[ring, 0], [ring, line.len()]] {
                assert!(found.named(end) != end && found.is_junction(found.named(end)), "{end:?}");
            }
        }
    }

    #[test]
    fn outlines_that_cross_are_divided_where_they_do() {
        let disc = |x: f64, y: f64| Shape::Disc { centre: [x, y], radius: 1.0 };
        // The second crosses the first twice, the third the right edge.
        let found = partition(&[disc(1.2, 1.5), disc(2.4, 1.5), disc(4.0, 1.5)]);
        let tau = std::f64::consts::TAU;
        // The third loses half outside, and crosses the second.
        assert!((length(&found) - 2.5 * tau).abs() < 1e-9, "{}", length(&found));
        let points: Vec<Point> = found.junctions.iter().map(|&[r, p]| found.piece(r, p).from).collect();
        assert_eq!(points.len(), 2 + 2 + 2);
        let on_two = |p: &Point| found.pieces().filter(|(.., piece)| on(piece, *p, 1e-9).is_some()).count();
        assert!(points.iter().all(|p| on_two(p) >= 3), "three pieces or four end at each");
        assert_eq!(found.region([1.8, 1.5]), 2, "the later one counts");
    }

    #[test]
    fn a_region_that_crosses_itself_or_has_no_part_of_the_body_is_refused() {
        let outline = Outline::of_shape(&rectangle([0.0; 2], [4.0, 3.0])).expect("an outline");
        let away = Partition::new(&outline, &[rectangle([5.0, 0.0], [6.0, 1.0])]);
        assert_eq!(away, Err(PartitionError::Outside { region: 1 }));
        let beside = Partition::new(&outline, &[rectangle([4.0, 0.0], [6.0, 1.0])]);
        assert_eq!(beside, Err(PartitionError::Outside { region: 1 }));
        let bow = Shape::Polygon { vertices: vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 3.0]] };
        assert!(matches!(Partition::new(&outline, &[bow]), Err(PartitionError::Outline { region: 1, .. })));
        let all = partition(&[rectangle([-1.0; 2], [9.0; 2])]);
        assert_eq!((all.lines().count(), all.region([1.0, 1.0])), (0, 1));
    }
}
