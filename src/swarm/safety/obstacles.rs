//! Obstacles: polygons and discs behind a tree of bounding boxes. The one file that
//! uses parry.
//!
//! Solids are kept out by their borders. Outside a polygon, each edge near the member gives a
//! half-plane, unless it lies behind that of a nearer one. The edge is convex, so it lies wholly behind
//! the plane through its nearest point across the line to it. A member that stays before that plane keeps
//! its distance, however far the step. That holds for concave polygons too, since no member gets inside
//! without crossing an edge. A member that starts inside is led out over the nearest point of the border.

use parry2d::bounding_volume::Aabb;
use parry2d::math::{Pose, Vector};
use parry2d::partitioning::{Bvh, BvhBuildStrategy};
use parry2d::query::{PointQuery, ShapeCastOptions, cast_shapes};
use parry2d::shape::{Ball, Segment};

use super::cell::{HalfPlane, foot, length, nearest};
use super::limits::{Place, SafetyError};
use super::ways::edges;
use crate::geometry::box_tree::BoxTree;
use crate::geometry::point::{area, bounds, minus, plus};
use crate::geometry::shape::{crossing, segments_cross};

/// A solid \[m, world frame\].
#[derive(Clone, Debug, PartialEq)]
pub enum Obstacle {
    /// Corners in order, either way round, convex or not; the last joins the first.
    Polygon(Vec<[f64; 2]>),
    /// A full disc.
    Disc {
        /// Coordinates of the middle.
        centre: [f64; 2],
        /// Distance of the rim from the middle.
        radius: f64,
    },
}

impl Obstacle {
    /// The same solid farther along \[m\].
    fn moved(&self, by: [f64; 2]) -> Self {
        match self {
            Obstacle::Polygon(corners) => Obstacle::Polygon(corners.iter().map(|&at| plus(at, by)).collect()),
            Obstacle::Disc { centre, radius } => {
                Obstacle::Disc { centre: plus(*centre, by), radius: *radius }
            }
        }
    }
}

/// Solids, indexed for queries by place.
#[derive(Clone, Default)]
pub struct Obstacles {
    /// As they were given, and how far each has been moved since \[m\].
    given: Vec<(Obstacle, [f64; 2])>,
    pieces: Vec<Piece>,
    outlines: Vec<Outline>,
    tree: Bvh,
    /// Whether a member stands in the outline's solid, for the member queried last.
    within: Vec<bool>,
    /// Pieces near that member, with their distances \[m\].
    near: Vec<(f64, u32)>,
}

#[derive(Clone, Copy)]
enum Piece {
    Edge { segment: Segment, outline: usize },
    Disc { centre: Vector, ball: Ball },
}

/// The border of one polygon.
#[derive(Clone)]
struct Outline {
    low: [f64; 2],
    high: [f64; 2],
    /// The solid is all that lies outside: a fence.
    inverted: bool,
    anticlockwise: bool,
}

/// Comparisons of two edges of a polygon that are made at most: a quarter of a second.
const MOST_PAIRS: usize = 20_000_000;

/// Largest coordinate accepted \[m\]: squares must not overflow.
const LARGEST: f64 = 1e100;
const NOT_FINITE: &str =
    " has a number that is not finite or beyond 1e100 m: give finite coordinates in metres";

impl Obstacles {
    /// # Errors
    /// A polygon of fewer than 3 corners, without area or with crossing edges, a disc without radius,
    /// a number that is not finite.
    pub fn new(obstacles: &[Obstacle]) -> Result<Self, SafetyError> {
        Self::of(obstacles.iter().map(|obstacle| (obstacle.clone(), [0.0; 2])).collect())
    }

    fn of(given: Vec<(Obstacle, [f64; 2])>) -> Result<Self, SafetyError> {
        let mut built = Self::default();
        for (index, (obstacle, by)) in given.iter().enumerate() {
            let place = Place::Obstacle(index);
            match obstacle.moved(*by) {
                Obstacle::Polygon(corners) => built.add_outline(&corners, false, place)?,
                Obstacle::Disc { centre, radius } => built.add_disc(centre, radius, place)?,
            }
        }
        built.grow_tree();
        Ok(Self { given, ..built })
    }

    /// The same with one of them so far from where it was given \[m\].
    ///
    /// # Errors
    /// As [`Obstacles::new`]; a place so far away that a polygon has no area there is none.
    ///
    /// # Panics
    /// If there is no such obstacle.
    pub(crate) fn with_moved(&self, obstacle: usize, by: [f64; 2]) -> Result<Self, SafetyError> {
        let mut given = self.given.clone();
        given[obstacle].1 = by;
        Self::of(given)
    }

    /// How far each has been moved from where it was given \[m\].
    pub fn moved(&self) -> impl ExactSizeIterator<Item = [f64; 2]> + '_ {
        self.given.iter().map(|(_, by)| *by)
    }

    /// All that lies outside a polygon.
    pub(super) fn fence(corners: &[[f64; 2]]) -> Result<Self, SafetyError> {
        let mut built = Self::default();
        built.add_outline(corners, true, Place::Geofence)?;
        built.grow_tree();
        Ok(built)
    }

    /// Whether there is nothing to keep away from.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    fn add_outline(&mut self, corners: &[[f64; 2]], inverted: bool, place: Place) -> Result<(), SafetyError> {
        // Maps and drawings repeat the first corner at the end.
        let mut corners = corners.to_vec();
        corners.dedup();
        while corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        let twice_area = check_polygon(&corners, place)?;
        let outline = self.outlines.len();
        for [a, b] in edges(&corners) {
            self.pieces.push(Piece::Edge { segment: Segment::new(vector(a), vector(b)), outline });
        }
        let (low, high) = bounds(corners);
        let anticlockwise = twice_area > 0.0;
        self.outlines.push(Outline { low, high, inverted, anticlockwise });
        self.within.push(false);
        Ok(())
    }

    fn add_disc(&mut self, centre: [f64; 2], radius: f64, place: Place) -> Result<(), SafetyError> {
        if !centre.iter().chain([&radius]).all(|value| value.abs() <= LARGEST) {
            return Err(place.refused(NOT_FINITE));
        }
        if radius <= 0.0 {
            return Err(place.refused(format!(" has radius {radius} m: give a positive number")));
        }
        self.pieces.push(Piece::Disc { centre: vector(centre), ball: Ball::new(radius) });
        Ok(())
    }

    fn grow_tree(&mut self) {
        let boxes: Vec<Aabb> = self.pieces.iter().map(Piece::bounds).collect();
        self.tree = Bvh::from_leaves(BvhBuildStrategy::default(), &boxes);
    }

    /// Appends the half-planes that keep a member at `place`, finite, `keep` \[m\] away from every solid as
    /// long as it moves no further than `reach` \[m\], and in which all places of the hull with these corners are that are so far away.
    pub(super) fn planes_near(
        &mut self,
        place: [f64; 2],
        hull: &[[f64; 2]],
        keep: f64,
        reach: f64,
        planes: &mut Vec<HalfPlane>,
    ) {
        if self.pieces.is_empty() {
            return;
        }
        let here = vector(place);
        let mut within = std::mem::take(&mut self.within);
        self.find_solids(place, &mut within);
        let inside = (0..within.len()).filter(|&outline| within[outline]);
        planes.extend(inside.map(|outline| self.way_out(outline, here, keep)));
        self.within = within;
        let margin = Vector::splat((keep + reach).min(LARGEST));
        let near = Aabb::new(here - margin, here + margin);
        self.near.clear();
        for leaf in self.tree.intersect_aabb(&near) {
            match &self.pieces[leaf as usize] {
                Piece::Edge { outline, .. } if self.within[*outline] => {}
                piece => self.near.push((piece.distance(piece.place_nearest(hull)), leaf)),
            }
        }
        self.near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let first = planes.len();
        for &(distance, leaf) in &self.near {
            let piece = &self.pieces[leaf as usize];
            if distance - keep > reach
                || planes[first..].iter().any(|plane| piece.is_behind(plane, here, keep))
            {
                continue;
            }
            let from = piece.place_nearest(hull);
            let normal = self.towards(piece, from);
            let ahead = vector(normal).dot(from - here);
            planes.push(HalfPlane { normal, offset: distance - keep + ahead });
        }
    }

    /// Finds for each outline whether the place lies in its solid; even-odd, by the edges to the right of it.
    fn find_solids(&self, [x, y]: [f64; 2], within: &mut Vec<bool>) {
        within.clear();
        within.resize(self.outlines.len(), false);
        let farthest = self.outlines.iter().fold(x, |far, outline| far.max(outline.high[0]));
        for leaf in self.tree.intersect_aabb(&Aabb::new(vector([x, y]), vector([farthest, y]))) {
            if let Piece::Edge { segment, outline } = &self.pieces[leaf as usize] {
                let edge = (pair(segment.a), pair(segment.b));
                within[*outline] ^= crossing(edge, y).is_some_and(|crossing| x < crossing);
            }
        }
        for (within, outline) in within.iter_mut().zip(&self.outlines) {
            *within = (*within && outline.is_boxed([x, y])) != outline.inverted;
        }
    }

    /// Unit vector from `here` to the nearest point of a piece.
    fn towards(&self, piece: &Piece, here: Vector) -> [f64; 2] {
        let (way, on_border) = match piece {
            Piece::Edge { segment, outline } => {
                let way = segment.project_local_point(here, true).point - here;
                (way, self.outlines[*outline].inward(segment))
            }
            Piece::Disc { centre, .. } => (*centre - here, [1.0, 0.0]),
        };
        let (direction, distance) = apart(way);
        if distance > 0.0 { direction } else { on_border }
    }

    /// The half-plane that leads out of a solid over the nearest point of its border.
    fn way_out(&self, outline: usize, here: Vector, keep: f64) -> HalfPlane {
        let mut nearest = ([1.0, 0.0], f64::INFINITY);
        for piece in &self.pieces {
            let Piece::Edge { segment, outline: of } = piece else { continue };
            if *of == outline {
                let (back, depth) = apart(here - segment.project_local_point(here, true).point);
                if depth < nearest.1 {
                    let normal = if depth > 0.0 { back } else { self.outlines[outline].inward(segment) };
                    nearest = (normal, depth);
                }
            }
        }
        HalfPlane { normal: nearest.0, offset: -(nearest.1 + keep) }
    }

    /// Distance from `place`, finite, to the nearest solid, negative inside \[m\]; infinite without any.
    pub fn distance(&self, place: [f64; 2]) -> f64 {
        let here = vector(place);
        let border = self.tree.find_best(
            f64::MAX,
            |node: &parry2d::partitioning::BvhNode, _| node.aabb().distance_to_local_point(here, true),
            |leaf, _| Some(Distance(self.pieces[leaf as usize].distance(here))),
        );
        let mut within = Vec::new();
        self.find_solids(place, &mut within);
        let mut deepest = border.map_or(f64::INFINITY, |(_, Distance(distance))| distance);
        if deepest >= 0.0 && !within.contains(&true) {
            return deepest;
        }
        // Of several solids around it the deepest counts.
        let mut depths = vec![f64::INFINITY; within.len()];
        for piece in &self.pieces {
            match piece {
                Piece::Edge { outline, .. } => depths[*outline] = depths[*outline].min(piece.distance(here)),
                Piece::Disc { .. } => deepest = deepest.min(piece.distance(here)),
            }
        }
        let depths = depths.iter().zip(&within).filter(|(_, within)| **within);
        depths.fold(deepest, |deepest, (depth, _)| deepest.min(-depth))
    }

    /// The least distance from a straight way to a solid \[m\], as [`Obstacles::distance`] has that of a place; of one that goes
    /// through a solid at most 0. `of_ends` is that of the nearer end.
    pub(super) fn distance_along(&self, [from, to]: [[f64; 2]; 2], of_ends: f64) -> f64 {
        if from == to || of_ends <= 0.0 || !of_ends.is_finite() {
            return of_ends;
        }
        let (here, there) = (vector(from), vector(to));
        let margin = Vector::splat(of_ends.min(LARGEST));
        let near = Aabb::new(here.min(there) - margin, here.max(there) + margin);
        let of_piece = |leaf: u32| match &self.pieces[leaf as usize] {
            Piece::Edge { segment, .. } if segments_cross(from, to, pair(segment.a), pair(segment.b)) => 0.0,
            piece => piece.distance(piece.place_nearest(&[from, to])),
        };
        self.tree.intersect_aabb(&near).map(of_piece).fold(of_ends, f64::min)
    }

    /// The share of the straight way \[1\] that a disc of this radius \[m\], above 0, goes before it touches
    /// a solid, by shape cast; 1 where nothing is in the way.
    pub fn free_way(&self, from: [f64; 2], to: [f64; 2], radius: f64) -> f64 {
        let (here, there) = (vector(from), vector(to));
        let margin = Vector::splat(radius);
        let swept = Aabb::new(here.min(there) - margin, here.max(there) + margin);
        let options = ShapeCastOptions {
            stop_at_penetration: false,
            compute_impact_geometry_on_penetration: false,
            ..ShapeCastOptions::with_max_time_of_impact(1.0)
        };
        // In radii and seen from the disc: the cast's tolerances are absolute, made for sizes about 1.
        let seen = |point: Vector| (point - here) / radius;
        let (disc, way, start, still) = (Ball::new(1.0), seen(there), Pose::IDENTITY, Vector::ZERO);
        let mut share = 1.0_f64;
        for leaf in self.tree.intersect_aabb(&swept) {
            let hit = match &self.pieces[leaf as usize] {
                Piece::Edge { segment, .. } => {
                    let edge = Segment::new(seen(segment.a), seen(segment.b));
                    cast_shapes(&start, way, &disc, &start, still, &edge, options)
                }
                Piece::Disc { centre, ball } => {
                    let (at, ball) = (Pose::from_translation(seen(*centre)), Ball::new(ball.radius / radius));
                    cast_shapes(&start, way, &disc, &at, still, &ball, options)
                }
            };
            if let Ok(Some(hit)) = hit {
                share = share.min(hit.time_of_impact);
            }
        }
        share
    }
}

/// Orders the leaves of the tree.
struct Distance(f64);

impl parry2d::partitioning::BvhLeafCost for Distance {
    fn cost(&self) -> f64 {
        self.0
    }
}

impl Piece {
    fn bounds(&self) -> Aabb {
        match self {
            Piece::Edge { segment, .. } => Aabb::new(segment.a.min(segment.b), segment.a.max(segment.b)),
            Piece::Disc { centre, ball } => {
                let radius = Vector::splat(ball.radius);
                Aabb::new(*centre - radius, *centre + radius)
            }
        }
    }

    fn distance(&self, here: Vector) -> f64 {
        match self {
            Piece::Edge { segment, .. } => segment.distance_to_local_point(here, true),
            Piece::Disc { centre, ball } => (*centre - here).length() - ball.radius,
        }
    }

    /// The place in the hull with these corners, one or more, that is nearest to the piece.
    fn place_nearest(&self, hull: &[[f64; 2]]) -> Vector {
        let from_edge = |edge: [[f64; 2]; 2]| match self {
            Piece::Edge { segment, .. } => nearest(edge, [segment.a, segment.b].map(pair)),
            Piece::Disc { centre, .. } => [foot(edge, pair(*centre)), pair(*centre)],
        };
        let apart = |[a, b]: &[[f64; 2]; 2]| length(minus(*b, *a));
        let found = edges(hull).map(from_edge).min_by(|a, b| apart(a).total_cmp(&apart(b)));
        vector(found.map_or(hull[0], |[place, _]| place))
    }

    /// Whether all of the piece is as far behind a plane as the plane's own piece, so that a member that stays
    /// before that plane keeps its distance from this piece too. This holds for the edges of a convex
    /// polygon but the nearest.
    fn is_behind(&self, plane: &HalfPlane, here: Vector, keep: f64) -> bool {
        let normal = vector(plane.normal);
        let depth = match self {
            Piece::Edge { segment, .. } => normal.dot(segment.a - here).min(normal.dot(segment.b - here)),
            Piece::Disc { centre, ball } => normal.dot(*centre - here) - ball.radius,
        };
        depth >= (plane.offset + keep) * (1.0 - 1e-14)
    }
}

impl Outline {
    fn is_boxed(&self, [x, y]: [f64; 2]) -> bool {
        self.low[0] <= x && x <= self.high[0] && self.low[1] <= y && y <= self.high[1]
    }

    /// The edge's unit normal into the solid.
    fn inward(&self, edge: &Segment) -> [f64; 2] {
        let (along, _) = apart(edge.b - edge.a);
        let left = [-along[1], along[0]];
        if self.anticlockwise != self.inverted { left } else { [along[1], -along[0]] }
    }
}

/// Twice the signed area.
fn check_polygon(corners: &[[f64; 2]], place: Place) -> Result<f64, SafetyError> {
    let count = corners.len();
    if count < 3 {
        return Err(place.refused(format!(" has {count} corners: give at least 3")));
    }
    if !corners.iter().flatten().all(|value| value.abs() <= LARGEST) {
        return Err(place.refused(NOT_FINITE));
    }
    let edge = |k: usize| [corners[k], corners[(k + 1) % count]];
    let tree = BoxTree::new((0..count).map(|k| bounds(edge(k))));
    let mut compared = 0;
    for first in 0..count {
        let (low, high) = bounds(edge(first));
        // Neighbouring edges share a corner; they cannot cross, but they can lie on each other.
        let others = tree.overlapping(low, high).inspect(|_| compared += 1).filter(|&second| {
            let ([a, b], [c, d]) = (edge(first), edge(second));
            second >= first + 2 && !(first == 0 && second == count - 1) && segments_cross(a, b, c, d)
        });
        if let Some(second) = others.min() {
            return Err(place.refused(format!(
                ": edges {first} and {second} (from 0) cross: give corners in order around the shape"
            )));
        }
        // To compare each with those beside it would take minutes.
        if compared > MOST_PAIRS {
            return Err(place.refused(format!(
                ": too many of its {count} edges run side by side to be checked for crossings: give fewer corners"
            )));
        }
    }
    let twice_area = 2.0 * area(corners);
    let extent =
        corners.iter().flat_map(|&p| minus(p, corners[0])).fold(0.0, |most: f64, off| most.max(off.abs()));
    if twice_area.abs() <= 1e-12 * extent * extent {
        return Err(place.refused(" has no area: give corners that do not lie on one line"));
    }
    Ok(twice_area)
}

fn vector([x, y]: [f64; 2]) -> Vector {
    Vector::new(x, y)
}

fn pair(vector: Vector) -> [f64; 2] {
    [vector.x, vector.y]
}

/// Direction and length.
fn apart(way: Vector) -> ([f64; 2], f64) {
    let length = way.length();
    ([way.x / length, way.y / length], length)
}
