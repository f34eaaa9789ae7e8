//! Straight edges and circular arcs, of which outlines are made.

use std::f64::consts::TAU;

use super::point::{Point, bounds, distance, minus};

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

/// Chords of a whole circle where arcs are tested for crossings.
const CHORDS: f64 = 256.0;

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
    pub(crate) fn arc_between(from: Point, to: Point, centre: Point, clockwise: bool) -> Self {
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

    /// Both ends, each with the direction from there into the piece, of length 1.
    pub fn leaving(&self) -> [(Point, Point); 2] {
        [(self.from, self.tangent(0.0)), (self.to, self.tangent(1.0).map(|v| -v))]
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
    pub(super) fn twice_area(&self, o: Point) -> f64 {
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

    pub(super) fn reversed(&self) -> Self {
        let arc = self.arc.map(|arc| Arc { start: arc.start + arc.sweep, sweep: -arc.sweep, ..arc });
        Self { from: self.to, to: self.from, arc, ..*self }
    }

    /// The piece as straight chords, few enough that an arc is off by less than a thousandth of its radius.
    pub(super) fn chords(&self) -> impl Iterator<Item = [Point; 2]> + '_ {
        let count = self.arc.map_or(1.0, |arc| (CHORDS * arc.sweep.abs() / TAU).ceil().max(1.0));
        let at = move |k: f64| self.point(k / count);
        (0..count as usize).map(move |k| [at(k as f64), at(k as f64 + 1.0)])
    }
}

/// Every piece of some loops or lines with the number of its loop and its own.
pub(super) fn numbered<'a>(
    rings: impl Iterator<Item = &'a [Piece]>,
) -> impl Iterator<Item = (usize, usize, &'a Piece)> {
    let of_ring = |(r, ring): (usize, &'a [Piece])| ring.iter().enumerate().map(move |(p, one)| (r, p, one));
    rings.enumerate().flat_map(of_ring)
}

/// The same loop the other way round; its first piece stays the first, and corners stay corners.
pub(super) fn reversed(ring: &[Piece]) -> Vec<Piece> {
    let count = ring.len();
    (0..count)
        .map(|k| {
            let old = (count - k) % count;
            let begins_at_corner = ring[(old + 1) % count].begins_at_corner;
            Piece { begins_at_corner, ..ring[old].reversed() }
        })
        .collect()
}

/// Whether closed loops of pieces go around `p` an odd number of times.
pub(crate) fn is_inside<'a>(pieces: impl Iterator<Item = &'a Piece>, p: Point) -> bool {
    pieces.fold(false, |sum, piece| sum ^ changes_side(piece, p))
}

/// Whether the piece crosses the ray from `p` to the right an odd number of times: its chord once, and what lies between that and an
/// arc once more. A place on the chord is to the right of it, or above, for both.
fn changes_side(piece: &Piece, p: Point) -> bool {
    let ([x, y], [ax, ay], [bx, by]) = (p, piece.from, piece.to);
    let is_beside = (ay > y) != (by > y);
    let crosses = is_beside && x < ax + (y - ay) / (by - ay) * (bx - ax);
    let Some(arc) = &piece.arc else { return crosses };
    let (along, off) = (minus(piece.to, piece.from), minus(p, piece.from));
    let is_right = if is_beside {
        crosses == (along[1] < 0.0)
    } else {
        let right = off[0] * along[1] - off[1] * along[0];
        right > 0.0 || (right == 0.0 && along[0] < 0.0)
    };
    // An arc that turns left bulges to the right of its chord.
    let is_beyond_chord = piece.from == piece.to || is_right == (arc.sweep > 0.0);
    crosses ^ (is_beyond_chord && distance(p, arc.centre) < arc.radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_on_the_chord_of_an_arc_are_inside_where_those_beside_it_are() {
        for k in 0..16 {
            let start = TAU * f64::from(k) / 16.0;
            for sweep in [0.5 * TAU, 0.6 * TAU, 0.25 * TAU] {
                // A disc as two arcs, either way round.
                let disc = [(start, sweep), (start + sweep, TAU - sweep)]
                    .map(|(a, b)| Piece::arc([2.0, 1.0], 5.0, a, b));
                let turned = reversed(&disc);
                for t in 1..10 {
                    let p = Piece::edge(disc[0].to, disc[0].from).point(f64::from(t) / 10.0);
                    assert!(
                        is_inside(disc.iter(), p) && is_inside(turned.iter(), p),
                        "{start} {sweep} {p:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_notch_whose_mouth_is_on_lattice_points_is_empty() {
        let notch = [
            Piece::edge([0.0, -10.0], [15.0, -10.0]),
            Piece::edge([15.0, -10.0], [15.0, 10.0]),
            Piece::edge([15.0, 10.0], [0.0, 10.0]),
            Piece::edge([0.0, 10.0], [0.0, 5.0]),
            Piece::arc_between([0.0, 5.0], [0.0, -5.0], [0.0, 0.0], true),
            Piece::edge([0.0, -5.0], [0.0, -10.0]),
        ];
        for y in -4..=4 {
            assert!(!is_inside(notch.iter(), [0.0, f64::from(y)]), "{y}");
            assert!(is_inside(notch.iter(), [5.5, f64::from(y)]), "{y}");
        }
    }
}
