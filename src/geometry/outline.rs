//! The outline of a shape: closed loops of straight edges and circular arcs, the shape to the left of each.
//!
//! The first loop bounds the shape from outside and runs counter-clockwise, the others bound its holes and run
//! clockwise. Loads and supports of a body act on parts of its outline ([`super::portion`]), bodies are
//! fitted to it, and finite elements are refined towards it.

use std::f64::consts::TAU;

use super::box_tree::BoxTree;
use super::shape::Shape;
use super::specimen::Specimen;

type Point = [f64; 2];

/// An edge or an arc, travelled with the shape on the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Where it begins \[length\].
    pub from: Point,
    /// Where it ends \[length\]; of a whole circle where it begins.
    pub to: Point,
    /// The circle that it lies on; a straight edge has none.
    pub arc: Option<Arc>,
    /// Whether it meets the piece before it at a corner, which every description of the shape has to keep.
    pub begins_at_corner: bool,
    /// Its number in the description of the shape, from 0: which vertex of a polygon it begins at, whichever way round
    /// the polygon was given.
    pub number: usize,
}

/// A part of a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// \[length\]
    pub centre: Point,
    /// \[length\]
    pub radius: f64,
    /// Direction from the centre to where it begins \[rad\].
    pub start: f64,
    /// Angle that it covers, positive counter-clockwise \[rad\].
    pub sweep: f64,
}

/// A place on an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Number of the loop: 0 is the outer one, others are holes.
    pub ring: usize,
    /// Number of the piece in its loop.
    pub piece: usize,
    /// How far along the piece, from 0 to 1.
    pub t: f64,
}

/// Closed loops of pieces; see the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    rings: Vec<Vec<Piece>>,
}

/// Why a shape has no outline that a body can be fitted to. Pieces and holes are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OutlineError {
    /// A loop that bounds no area, up to rounding.
    #[error("{} has no area", ring_name(*.ring))]
    NoArea {
        /// Number of the loop: 0 is the outer one, others are holes.
        ring: usize,
    },
    /// Two pieces of one loop cross or touch elsewhere than where one ends and the next begins, or fold back on each
    /// other.
    #[error(
        "{} crosses or touches itself near ({:.6}, {:.6})", ring_name(*.ring), .place[0], .place[1]
    )]
    SelfCrossing {
        /// Number of the loop: 0 is the outer one, others are holes.
        ring: usize,
        /// Where they meet \[length\].
        place: Point,
    },
    /// Two loops cross or touch.
    #[error(
        "{} and {} cross or touch near ({:.6}, {:.6})", ring_name(.rings[0]), ring_name(.rings[1]), .place[0], .place[1]
    )]
    Touching {
        /// Numbers of the loops, the lower first: 0 is the outer one, others are holes.
        rings: [usize; 2],
        /// Where they meet \[length\].
        place: Point,
    },
    /// A hole that begins outside the outer loop.
    #[error("hole {hole} does not lie inside the outer outline, but at ({:.6}, {:.6})", .place[0], .place[1])]
    Outside {
        /// Number of the hole, from 1.
        hole: usize,
        /// Where its first piece begins \[length\].
        place: Point,
    },
    /// A hole within another hole.
    #[error("hole {inner} lies inside hole {outer}")]
    Nested {
        /// Number of the hole that lies inside, from 1.
        inner: usize,
        /// Number of the hole around it, from 1.
        outer: usize,
    },
}

/// How messages name a loop.
pub fn ring_name(ring: usize) -> String {
    if ring == 0 { "the outer outline".into() } else { format!("the outline of hole {ring}") }
}

/// Chords of a whole circle where arcs are tested for crossings.
const CHORDS: f64 = 256.0;

/// Lengths below this part of the outline's size are none.
const NOTHING: f64 = 1e-9;

impl Piece {
    /// The straight edge between two corners \[length\].
    pub fn edge(from: Point, to: Point) -> Self {
        Self { from, to, arc: None, begins_at_corner: true, number: 0 }
    }

    /// The arc about `centre` from one angle over another \[rad\].
    pub fn arc(centre: Point, radius: f64, start: f64, sweep: f64) -> Self {
        let at = |angle: f64| [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()];
        let from = at(start);
        let whole = sweep.abs() >= TAU;
        let to = if whole { from } else { at(start + sweep) };
        let arc = Some(Arc { centre, radius, start, sweep });
        Self { from, to, arc, begins_at_corner: !whole, number: 0 }
    }

    /// The arc from one point to another about `centre` \[length\], which is as far from both; the whole circle if they
    /// are one.
    pub fn arc_between(from: Point, to: Point, centre: Point, clockwise: bool) -> Self {
        let [start, end] = [from, to].map(|p| (p[1] - centre[1]).atan2(p[0] - centre[0]));
        let left = if from == to { TAU } else { (end - start).rem_euclid(TAU) };
        let sweep = if clockwise && from != to {
            left - TAU
        } else if clockwise {
            -TAU
        } else {
            left
        };
        let arc = Some(Arc { centre, radius: distance(from, centre), start, sweep });
        Self { from, to, arc, begins_at_corner: from != to, number: 0 }
    }

    /// The place a share `t` of the way along \[length\].
    pub fn point(&self, t: f64) -> Point {
        match &self.arc {
            _ if t == 0.0 => self.from,
            _ if t == 1.0 => self.to,
            None => [0, 1].map(|k| self.from[k] + t * (self.to[k] - self.from[k])),
            Some(arc) => {
                let (sin, cos) = (arc.start + t * arc.sweep).sin_cos();
                [arc.centre[0] + arc.radius * cos, arc.centre[1] + arc.radius * sin]
            }
        }
    }

    /// The direction of travel at `t`, of length 1.
    pub fn tangent(&self, t: f64) -> Point {
        match &self.arc {
            None => {
                let along = minus(self.to, self.from);
                let length = along[0].hypot(along[1]);
                along.map(|v| v / length)
            }
            Some(arc) => {
                let (sin, cos) = (arc.start + t * arc.sweep).sin_cos();
                [-sin, cos].map(|v| v * arc.sweep.signum())
            }
        }
    }

    /// The outward normal at `t`, of length 1.
    pub fn normal(&self, t: f64) -> Point {
        let [x, y] = self.tangent(t);
        [y, -x]
    }

    /// \[length\]
    pub fn length(&self) -> f64 {
        match &self.arc {
            None => distance(self.from, self.to),
            Some(arc) => arc.radius * arc.sweep.abs(),
        }
    }

    /// How far along the place nearest to `p` is, from 0 to 1.
    pub fn nearest(&self, p: Point) -> f64 {
        match &self.arc {
            None => {
                let (along, off) = (minus(self.to, self.from), minus(p, self.from));
                let length = along[0].hypot(along[1]);
                let share = (off[0] * (along[0] / length) + off[1] * (along[1] / length)) / length;
                share.clamp(0.0, 1.0)
            }
            Some(arc) => {
                let [x, y] = minus(p, arc.centre);
                let turned = (y.atan2(x) - arc.start) * arc.sweep.signum();
                let (angle, sweep) = (turned.rem_euclid(TAU), arc.sweep.abs());
                if angle <= sweep {
                    angle / sweep
                } else {
                    // In the gap between end and beginning: whichever is nearer.
                    f64::from(u8::from(angle - sweep < TAU - angle))
                }
            }
        }
    }

    /// Lowest and highest coordinates \[length\].
    pub fn bounds(&self) -> (Point, Point) {
        let mut points = vec![self.from, self.to];
        if let Some(arc) = &self.arc {
            let quarter = TAU / 4.0;
            let (low, high) = (arc.start.min(arc.start + arc.sweep), arc.start.max(arc.start + arc.sweep));
            let mut k = (low / quarter).ceil();
            while k * quarter <= high {
                let (sin, cos) = (k * quarter).sin_cos();
                points.push([arc.centre[0] + arc.radius * cos, arc.centre[1] + arc.radius * sin]);
                k += 1.0;
            }
        }
        bounds(points)
    }

    /// Twice the area between the piece and the origin at `o` \[length^2\].
    fn twice_area(&self, o: Point) -> f64 {
        let (a, b) = (minus(self.from, o), minus(self.to, o));
        let chord = a[0] * b[1] - a[1] * b[0];
        let segment = self.arc.map_or(0.0, |arc| arc.radius * arc.radius * (arc.sweep - arc.sweep.sin()));
        chord + segment
    }

    /// The part between two shares of the way along.
    pub fn part(&self, [begin, end]: [f64; 2]) -> Self {
        let part =
            |arc: Arc| Arc { start: arc.start + begin * arc.sweep, sweep: (end - begin) * arc.sweep, ..arc };
        Self { from: self.point(begin), to: self.point(end), arc: self.arc.map(part), ..*self }
    }

    fn reversed(&self) -> Self {
        let arc = self.arc.map(|arc| Arc { start: arc.start + arc.sweep, sweep: -arc.sweep, ..arc });
        Self { from: self.to, to: self.from, arc, ..*self }
    }

    /// The piece as straight chords, few enough that an arc is off by less than a thousandth of its radius.
    fn chords(&self) -> impl Iterator<Item = [Point; 2]> + '_ {
        let count = self.arc.map_or(1.0, |arc| (CHORDS * arc.sweep.abs() / TAU).ceil().max(1.0));
        let at = move |k: f64| self.point(k / count);
        (0..count as usize).map(move |k| [at(k as f64), at(k as f64 + 1.0)])
    }
}

impl Outline {
    /// The outline of a shape.
    ///
    /// # Errors
    /// A shape whose outline crosses or touches itself or has no area, and holes that touch each other or the
    /// outside.
    pub fn of_shape(shape: &Shape) -> Result<Self, OutlineError> {
        let rings = match shape {
            Shape::WithHoles { body, holes } => {
                let holes = holes.iter().map(|hole| reversed(&ring_of(hole)));
                std::iter::once(ring_of(body)).chain(holes).collect()
            }
            solid => vec![ring_of(solid)],
        };
        Self::of_rings(rings)
    }

    /// The outline of a region bounded by polygons, the outer one first; each either way round.
    ///
    /// # Errors
    /// As [`Outline::of_shape`].
    pub fn of_polygons(polygons: &[Vec<Point>]) -> Result<Self, OutlineError> {
        let ring = |(k, polygon): (usize, &Vec<Point>)| {
            let ring = edges(polygon);
            if k == 0 { ring } else { reversed(&ring) }
        };
        Self::of_rings(polygons.iter().enumerate().map(ring).collect())
    }

    fn of_rings(rings: Vec<Vec<Piece>>) -> Result<Self, OutlineError> {
        let outline = Self { rings };
        outline.check()?;
        Ok(outline)
    }

    /// The same outline, its pieces divided.
    pub(super) fn with_rings(&self, rings: Vec<Vec<Piece>>) -> Self {
        Self { rings }
    }

    /// Loops of pieces, the outer one first, shape \[loops\].
    pub fn rings(&self) -> &[Vec<Piece>] {
        &self.rings
    }

    /// Every piece with the number of its loop and its own.
    pub fn pieces(&self) -> impl Iterator<Item = (usize, usize, &Piece)> {
        numbered(&self.rings)
    }

    /// The piece with this number of its loop and its own, both from 0.
    pub fn piece(&self, ring: usize, piece: usize) -> &Piece {
        &self.rings[ring][piece]
    }

    /// \[length\]
    pub fn point(&self, place: Place) -> Point {
        self.piece(place.ring, place.piece).point(place.t)
    }

    /// Corners, in the order of the pieces that begin there \[length\].
    pub fn corners(&self) -> impl Iterator<Item = Point> + '_ {
        self.pieces().filter(|(.., piece)| piece.begins_at_corner).map(|(.., piece)| piece.from)
    }

    /// \[length\]
    pub fn length(&self) -> f64 {
        self.pieces().map(|(.., piece)| piece.length()).sum()
    }

    /// Area of the shape \[length^2\].
    pub fn area(&self) -> f64 {
        // About a point of the outline: far from the origin of the coordinates no digits are lost.
        let o = self.rings[0][0].from;
        self.pieces().map(|(.., piece)| 0.5 * piece.twice_area(o)).sum()
    }

    /// Lowest and highest coordinates \[length\].
    pub fn bounds(&self) -> (Point, Point) {
        bounds(self.rings[0].iter().flat_map(|piece| <[Point; 2]>::from(piece.bounds())))
    }

    /// Diagonal of the bounds \[length\].
    pub fn size(&self) -> f64 {
        let (low, high) = self.bounds();
        distance(low, high)
    }

    /// The place nearest to `p`, and how far it is \[length\].
    pub fn nearest(&self, p: Point) -> (Place, f64) {
        self.nearest_among(p, self.pieces().map(|(ring, piece, _)| [ring, piece]))
            .expect("an outline has pieces")
    }

    /// The same among pieces given by the numbers of their loop and their own.
    pub fn nearest_among(&self, p: Point, pieces: impl Iterator<Item = [usize; 2]>) -> Option<(Place, f64)> {
        let place = |[ring, number]: [usize; 2]| {
            let piece = self.piece(ring, number);
            let t = piece.nearest(p);
            (Place { ring, piece: number, t }, distance(piece.point(t), p))
        };
        pieces.map(place).reduce(|best, next| if next.1 < best.1 { next } else { best })
    }

    /// Whether `p` lies inside: in the polygon of the chords, or else in a segment between a chord and its arc.
    pub fn contains(&self, p: Point) -> bool {
        is_inside(self.pieces().map(|(.., piece)| piece), p)
    }

    fn check(&self) -> Result<(), OutlineError> {
        let o = self.rings[0].first().map_or([0.0; 2], |piece| piece.from);
        let least = NOTHING * self.size().powi(2);
        for (ring, pieces) in self.rings.iter().enumerate() {
            let area: f64 = pieces.iter().map(|piece| 0.5 * piece.twice_area(o)).sum();
            let has_area = area.abs() > least;
            if !has_area {
                return Err(OutlineError::NoArea { ring });
            }
        }
        self.check_crossings()?;
        for (hole, pieces) in self.rings.iter().enumerate().skip(1) {
            let place = pieces[0].from;
            if !is_inside(self.rings[0].iter(), place) {
                return Err(OutlineError::Outside { hole, place });
            }
            let within = |&other: &usize| other != hole && is_inside(self.rings[other].iter(), place);
            if let Some(outer) = (1..self.rings.len()).find(within) {
                return Err(OutlineError::Nested { inner: hole, outer });
            }
        }
        Ok(())
    }

    /// Refuses chords of which two come nearer than rounding and are not neighbours.
    fn check_crossings(&self) -> Result<(), OutlineError> {
        let chords = self.chords();
        let tree = BoxTree::new(chords.iter().map(|chord| (chord.low, chord.high)));
        // Twice as far as what is too near: sums are rounded.
        let reach = 2.0 * NOTHING * self.size();
        self.check_pairs(&chords, |chord| {
            tree.overlapping(chord.low.map(|v| v - reach), chord.high.map(|v| v + reach))
        })
    }

    /// The chords of all pieces, from left to right.
    fn chords(&self) -> Vec<Chord> {
        let mut chords = Vec::new();
        for (ring, pieces) in self.rings.iter().enumerate() {
            for (number, ends) in pieces.iter().flat_map(Piece::chords).enumerate() {
                let (low, high) = bounds(ends);
                chords.push(Chord { ends, ring, number, low, high });
            }
        }
        chords.sort_by(|a, b| a.low[0].total_cmp(&b.low[0]));
        chords
    }

    /// Compares each chord with those around it, in their order: of many crossings the leftmost is named. `around` names
    /// at least the chords whose boxes are as near as the chord's own.
    fn check_pairs<I: Iterator<Item = usize>>(
        &self,
        chords: &[Chord],
        around: impl Fn(&Chord) -> I,
    ) -> Result<(), OutlineError> {
        let mut counts = vec![0; self.rings.len()];
        chords.iter().for_each(|chord| counts[chord.ring] += 1);
        let near = NOTHING * self.size();
        let mut ahead: Vec<usize> = Vec::new();
        for (k, a) in chords.iter().enumerate() {
            ahead.clear();
            ahead.extend(around(a).filter(|&other| other > k));
            ahead.sort_unstable();
            let ahead = ahead.iter().map(|&other| &chords[other]);
            let is_near = |b: &&Chord| {
                let within =
                    |axis: usize| b.low[axis] <= a.high[axis] + near && a.low[axis] <= b.high[axis] + near;
                within(0) && within(1)
            };
            for b in ahead.filter(is_near) {
                let place = match self.meeting((a.ends, b.ends), near) {
                    Some(place) => place,
                    None => continue,
                };
                if a.ring != b.ring {
                    let rings = [a.ring.min(b.ring), a.ring.max(b.ring)];
                    return Err(OutlineError::Touching { rings, place });
                }
                let (apart, count) = (a.number.abs_diff(b.number), counts[a.ring]);
                if apart > 1 && apart + 1 < count || folds_back(a.ends, b.ends, near) {
                    return Err(OutlineError::SelfCrossing { ring: a.ring, place });
                }
            }
        }
        Ok(())
    }

    /// Where two chords cross or come nearer than `near` \[length\].
    fn meeting(&self, (a, b): ([Point; 2], [Point; 2]), near: f64) -> Option<Point> {
        let [along, other] = [a, b].map(|[from, to]| minus(to, from));
        let off = minus(b[0], a[0]);
        let cross = |u: Point, v: Point| u[0] * v[1] - u[1] * v[0];
        let turn = cross(along, other);
        if turn != 0.0 {
            let (s, t) = (cross(off, other) / turn, cross(off, along) / turn);
            if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
                return Some([0, 1].map(|k| a[0][k] + s * along[k]));
            }
        }
        let touch = |p: Point, [from, to]: [Point; 2]| {
            let edge = Piece::edge(from, to);
            let is_near = from != to && distance(edge.point(edge.nearest(p)), p) <= near;
            is_near.then_some(p)
        };
        touch(a[0], b).or_else(|| touch(a[1], b)).or_else(|| touch(b[0], a)).or_else(|| touch(b[1], a))
    }
}

/// A straight part of the outline, where it is tested for crossings.
#[derive(Clone, Copy, Debug)]
struct Chord {
    ends: [Point; 2],
    ring: usize,
    /// Its number in its loop.
    number: usize,
    low: Point,
    high: Point,
}

/// Whether two chords that share an end lie on each other.
fn folds_back(a: [Point; 2], b: [Point; 2], near: f64) -> bool {
    let reaches = |p: Point, [from, to]: [Point; 2]| {
        let edge = Piece::edge(from, to);
        let t = edge.nearest(p);
        let at = edge.point(t);
        distance(at, p) <= near && distance(at, from) > near && distance(at, to) > near
    };
    a.iter().any(|&p| reaches(p, b)) || b.iter().any(|&p| reaches(p, a))
}

/// Every piece of some loops or lines with the number of its loop and its own.
pub(super) fn numbered(rings: &[Vec<Piece>]) -> impl Iterator<Item = (usize, usize, &Piece)> {
    let of_ring = |(r, ring): (usize, &'_ Vec<Piece>)| (0..ring.len()).map(move |p| (r, p));
    rings.iter().enumerate().flat_map(of_ring).map(|(r, p)| (r, p, &rings[r][p]))
}

/// Whether closed loops of pieces go around `p` an odd number of times.
pub fn is_inside<'a>(pieces: impl Iterator<Item = &'a Piece>, p: Point) -> bool {
    let changes = |piece: &Piece| u8::from(crosses_ray(piece, p)) + u8::from(is_in_segment(piece, p));
    pieces.map(changes).fold(0, |sum: u8, next| sum ^ (next & 1)) == 1
}

/// Whether the chord of a piece crosses the ray from `p` to the right.
fn crosses_ray(piece: &Piece, [x, y]: Point) -> bool {
    let ([ax, ay], [bx, by]) = (piece.from, piece.to);
    (ay > y) != (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)
}

/// Whether `p` lies between the chord of a piece and its arc.
fn is_in_segment(piece: &Piece, p: Point) -> bool {
    let Some(arc) = &piece.arc else { return false };
    let (along, off) = (minus(piece.to, piece.from), minus(p, piece.from));
    // An arc that turns left bulges to the right of its chord.
    let right = off[0] * along[1] - off[1] * along[0];
    let is_whole = piece.from == piece.to;
    distance(p, arc.centre) < arc.radius && (is_whole || right * arc.sweep > 0.0)
}

fn ring_of(shape: &Shape) -> Vec<Piece> {
    match shape {
        Shape::Rectangle { min, max } => edges(&[*min, [max[0], min[1]], *max, [min[0], max[1]]]),
        Shape::Disc { centre, radius } => vec![Piece::arc(*centre, *radius, 0.0, TAU)],
        Shape::Polygon { vertices } => edges(vertices),
        Shape::Path { pieces } => counter_clockwise(pieces.clone()),
        Shape::Specimen(specimen) => profile(specimen),
        Shape::WithHoles { body, .. } => ring_of(body),
    }
}

/// The edges of a polygon, counter-clockwise; corners that fall together are one.
fn edges(vertices: &[Point]) -> Vec<Piece> {
    let mut corners: Vec<(usize, Point)> = vertices.iter().copied().enumerate().collect();
    corners.dedup_by_key(|(_, corner)| *corner);
    if corners.len() > 1 && corners[0].1 == corners[corners.len() - 1].1 {
        corners.pop();
    }
    let edge = |k: usize| {
        let ((number, from), (_, to)) = (corners[k], corners[(k + 1) % corners.len()]);
        Piece { number, ..Piece::edge(from, to) }
    };
    counter_clockwise((0..corners.len()).map(edge).collect())
}

fn counter_clockwise(ring: Vec<Piece>) -> Vec<Piece> {
    let o = ring.first().map_or([0.0; 2], |piece| piece.from);
    let twice: f64 = ring.iter().map(|piece| piece.twice_area(o)).sum();
    if twice < 0.0 { reversed(&ring) } else { ring }
}

/// The same loop the other way round; its first piece stays the first, and corners stay corners.
fn reversed(ring: &[Piece]) -> Vec<Piece> {
    let count = ring.len();
    (0..count)
        .map(|k| {
            let old = (count - k) % count;
            let begins_at_corner = ring[(old + 1) % count].begins_at_corner;
            Piece { begins_at_corner, ..ring[old].reversed() }
        })
        .collect()
}

/// Right side up, left side down: gauge, fillets and grips of a specimen.
fn profile(specimen: &Specimen) -> Vec<Piece> {
    let Specimen { overall, grip_width, gauge_width, gauge_length, fillet, lying } = *specimen;
    let (wide, narrow) = (grip_width / 2.0, gauge_width / 2.0);
    let (low, high) = ((overall - gauge_length) / 2.0, (overall + gauge_length) / 2.0);
    // Where the fillet has risen to the grip: an angle from the axis of symmetry of its circle.
    let rise = wide - narrow;
    let angle = if rise < fillet { (1.0 - rise / fillet).acos() } else { TAU / 4.0 };
    let run = fillet * angle.sin();
    let middle = narrow + fillet;
    let mut right = vec![
        Piece::edge([wide, 0.0], [wide, low - run]),
        Piece::arc([middle, low], fillet, TAU / 2.0 + angle, -angle),
        Piece::edge([narrow, low], [narrow, high]),
        Piece::arc([middle, high], fillet, TAU / 2.0, -angle),
        Piece::edge([wide, high + run], [wide, overall]),
    ];
    // The fillets run out tangentially into the gauge; arcs end exactly where edges begin.
    right[1].from = right[0].to;
    right[1].to = right[2].from;
    right[3].from = right[2].to;
    right[3].to = right[4].from;
    (right[2].begins_at_corner, right[3].begins_at_corner) = (false, false);
    let mirrored = |piece: &Piece| {
        let flip = |[x, y]: Point| [-x, y];
        let arc = piece.arc.map(|arc| Arc {
            centre: flip(arc.centre),
            start: TAU / 2.0 - arc.start,
            sweep: -arc.sweep,
            ..arc
        });
        Piece { from: flip(piece.from), to: flip(piece.to), arc, ..*piece }
    };
    let left: Vec<Piece> = right.iter().map(mirrored).collect();
    let mut ring = right;
    ring.push(Piece::edge([wide, overall], [-wide, overall]));
    // Down the left side: each piece begins at a corner if the one after it did on the way up.
    ring.extend(left.iter().enumerate().rev().map(|(k, piece)| {
        let begins_at_corner = left.get(k + 1).is_none_or(|next| next.begins_at_corner);
        Piece { begins_at_corner, ..piece.reversed() }
    }));
    ring.push(Piece::edge([-wide, 0.0], [wide, 0.0]));
    ring.iter_mut().enumerate().for_each(|(number, piece)| piece.number = number);
    if !lying {
        return ring;
    }
    let swap = |[x, y]: Point| [y, x];
    let swapped = |piece: &Piece| {
        let arc = piece.arc.map(|arc| Arc {
            centre: swap(arc.centre),
            start: TAU / 4.0 - arc.start,
            sweep: -arc.sweep,
            ..arc
        });
        Piece { from: swap(piece.from), to: swap(piece.to), arc, ..*piece }
    };
    reversed(&ring.iter().map(swapped).collect::<Vec<_>>())
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

pub(super) fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Lowest and highest coordinates of points.
fn bounds(points: impl IntoIterator<Item = Point>) -> (Point, Point) {
    points.into_iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), p| {
        ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Vec<Point> {
        vec![[low, low], [high, low], [high, high], [low, high]]
    }

    fn shapes() -> Vec<Shape> {
        let plate = Shape::Rectangle { min: [0.0; 2], max: [4.0, 3.0] };
        vec![
            plate.clone(),
            Shape::Disc { centre: [1.0, -2.0], radius: 1.5 },
            Shape::Polygon { vertices: vec![[0.0, 0.0], [0.0, 3.0], [1.0, 1.0], [4.0, 0.0]] },
            Shape::Specimen(Specimen::e8_sheet(0.1)),
            Shape::Specimen(Specimen { lying: true, ..Specimen::d638_type_i(0.1) }),
            Shape::WithHoles {
                body: Box::new(plate),
                holes: vec![
                    Shape::Disc { centre: [1.0, 1.0], radius: 0.5 },
                    Shape::Polygon { vertices: vec![[2.0, 1.0], [3.0, 1.0], [2.5, 2.0]] },
                ],
            },
        ]
    }

    #[test]
    fn the_outline_of_each_shape_is_closed_and_has_the_shape_on_its_left() {
        for shape in shapes() {
            let outline = Outline::of_shape(&shape).expect("an outline");
            for (ring, piece, now) in outline.pieces() {
                let next = &outline.rings()[ring][(piece + 1) % outline.rings()[ring].len()];
                assert!(distance(now.to, next.from) < 1e-12, "{shape:?} {ring} {piece}");
                for t in [0.0, 0.3, 1.0] {
                    let (p, n) = (now.point(t), now.normal(t));
                    assert!((now.nearest(p) - t).abs() < 1e-9 || now.from == now.to, "{shape:?} {piece} {t}");
                    assert!((n[0].hypot(n[1]) - 1.0).abs() < 1e-12);
                }
                let (p, n) = (now.point(0.5), now.normal(0.5));
                let (inside, outside) =
                    ([0, 1].map(|k| p[k] - 1e-6 * n[k]), [0, 1].map(|k| p[k] + 1e-6 * n[k]));
                assert!(outline.contains(inside) && shape.contains(inside, 0.0), "{shape:?} {ring} {piece}");
                assert!(
                    !outline.contains(outside) && !shape.contains(outside, 0.0),
                    "{shape:?} {ring} {piece}"
                );
            }
        }
    }

    #[test]
    fn areas_and_bounds_are_those_of_the_shapes() {
        let disc = std::f64::consts::PI * 0.25;
        for (shape, area) in
            shapes().into_iter().zip([12.0, 9.0 * disc, 3.5, f64::NAN, f64::NAN, 12.0 - disc - 0.5])
        {
            let outline = Outline::of_shape(&shape).expect("an outline");
            assert!(area.is_nan() || (outline.area() - area).abs() < 1e-12, "{shape:?}: {}", outline.area());
            let (found, expected) = (outline.bounds(), shape.bounds());
            let off =
                (0..2).map(|k| (found.0[k] - expected.0[k]).abs().max((found.1[k] - expected.1[k]).abs()));
            assert!(off.fold(0.0, f64::max) < 1e-12, "{shape:?}");
        }
        // Grips, gauge and fillets of the standard, which narrow the specimen by what their circles leave.
        let e8 = Outline::of_shape(&Shape::Specimen(Specimen::e8_sheet(1.0))).expect("an outline");
        let slices = 2_000_000;
        let sheet = Specimen::e8_sheet(1.0);
        let width = |k: i32| 2.0 * sheet.half_width((f64::from(k) + 0.5) * 200.0 / f64::from(slices));
        let area = (0..slices).map(width).sum::<f64>() * 200.0 / f64::from(slices);
        assert!((e8.area() - area).abs() < 1e-4 * area, "{} {area}", e8.area());
        assert_eq!(e8.corners().count(), 8, "four of the grips, four where fillets end, none at the gauge");
    }

    #[test]
    fn the_crossing_that_is_named_is_the_one_that_a_look_at_every_pair_finds() {
        let mut state: u64 = 1;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let mut verdicts = [0; 3];
        for round in 0..600 {
            // Stars about the middle of a square do not cross themselves, and do not touch it but where one of their
            // arms is that long; of some, one corner lies elsewhere, of others all lie on a raster.
            let count = 5 + round % 60;
            let mut star: Vec<Point> = (0..count)
                .map(|k| {
                    let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
                    let length = 1.0 + 3.0 * next();
                    [length * cos, length * sin]
                })
                .collect();
            match round % 6 {
                1 => star[0] = [10.0 * next() - 5.0, 10.0 * next() - 5.0],
                2 => star[0] = [5.0, 0.0],
                3 => star[2] = star[0],
                4 => star.iter_mut().for_each(|p| *p = p.map(f64::round)),
                5 => star[3] = [0, 1].map(|k| 0.5 * (star[0][k] + star[1][k])),
                _ => {}
            }
            let outline = Outline { rings: vec![edges(&square(-5.0, 5.0)), reversed(&edges(&star))] };
            let chords = outline.chords();
            let plain = outline.check_pairs(&chords, |_| 0..chords.len());
            assert_eq!(outline.check_crossings(), plain, "{star:?}");
            verdicts[match plain {
                Ok(()) => 0,
                Err(OutlineError::Touching { .. }) => 1,
                Err(_) => 2,
            }] += 1;
        }
        assert!(verdicts.iter().all(|&count| count > 50), "of each kind some: {verdicts:?}");
    }

    #[test]
    fn outlines_that_bound_nothing_are_refused_with_the_place() {
        let bow = Outline::of_polygons(&[vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 3.0]]]);
        assert!(matches!(bow, Err(OutlineError::SelfCrossing { ring: 0, .. })), "{bow:?}");
        let flat = Outline::of_polygons(&[vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]]);
        assert!(matches!(flat, Err(OutlineError::NoArea { ring: 0 })), "{flat:?}");
        let spike = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 2.0], [4.0, 4.0], [0.0, 4.0]];
        let spike = Outline::of_polygons(&[spike]);
        assert!(matches!(spike, Err(OutlineError::SelfCrossing { .. })), "{spike:?}");
        let with = |hole: Vec<Point>| Outline::of_polygons(&[square(0.0, 4.0), hole]);
        let touching = with(vec![[1.0, 1.0], [4.0, 2.0], [1.0, 3.0]]);
        match touching {
            Err(OutlineError::Touching { rings: [0, 1], place }) => {
                assert!(distance(place, [4.0, 2.0]) < 1e-6)
            }
            other => panic!("{other:?}"),
        }
        assert!(matches!(with(square(5.0, 6.0)), Err(OutlineError::Outside { hole: 1, .. })));
        let nested = Outline::of_polygons(&[square(0.0, 4.0), square(1.0, 3.0), square(1.5, 2.5)]);
        assert!(matches!(nested, Err(OutlineError::Nested { inner: 2, outer: 1 })), "{nested:?}");
        assert!(with(square(1.0, 3.0)).is_ok());
    }
}
