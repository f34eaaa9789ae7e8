//! Where edges and arcs meet.

use super::piece::{Arc, Piece};
use super::point::{cross, distance, dot, minus};

/// Where the segment from `a` to `b` meets a piece: shares of the way along either, from 0 to 1.
pub fn meetings(a: [f64; 2], b: [f64; 2], piece: &Piece) -> Vec<[f64; 2]> {
    let along = minus(b, a);
    let within = |s: &f64| (0.0..=1.0).contains(s);
    match &piece.arc {
        None => {
            let other = minus(piece.to, piece.from);
            let off = minus(piece.from, a);
            let turn = cross(along, other);
            let parallel = 1e-12 * along[0].hypot(along[1]) * other[0].hypot(other[1]);
            if turn.abs() <= parallel {
                return Vec::new();
            }
            let (s, t) = (cross(off, other) / turn, cross(off, along) / turn);
            let slack = 1e-12;
            let is_on = within(&s) && (-slack..=1.0 + slack).contains(&t);
            if is_on { vec![[s, t.clamp(0.0, 1.0)]] } else { Vec::new() }
        }
        Some(arc) => {
            let off = minus(a, arc.centre);
            let (p, q) = (dot(along, along), dot(off, along));
            let r = (off[0].hypot(off[1]) - arc.radius) * (off[0].hypot(off[1]) + arc.radius);
            let under = q * q - p * r;
            if under <= 0.0 {
                return Vec::new();
            }
            let root = under.sqrt();
            let of = |s: f64| {
                let point = [a[0] + s * along[0], a[1] + s * along[1]];
                let t = piece.nearest(point);
                let at = piece.point(t);
                // Beyond the ends of the arc its circle goes on.
                let is_on = (at[0] - point[0]).hypot(at[1] - point[1]) <= 1e-9 * arc.radius;
                is_on.then_some([s, t])
            };
            [(-q - root) / p, (root - q) / p].into_iter().filter(within).filter_map(of).collect()
        }
    }
}

/// Where two pieces cross or touch, an end of one on the other included: shares of the way along either, from 0 to 1. Of
/// pieces that overlap, where the common part begins and ends. `near` is the length below which nothing differs.
pub fn crossings(a: &Piece, b: &Piece, near: f64) -> Vec<[f64; 2]> {
    let mut found = match (&a.arc, &b.arc) {
        // Rounding makes of it two points, or none.
        _ if let Some(p) = touching(a, b, near) => {
            on(a, p, near).zip(on(b, p, near)).map(Into::into).into_iter().collect()
        }
        (None, _) => meetings(a.from, a.to, b),
        (_, None) => meetings(b.from, b.to, a).into_iter().map(|[s, t]| [t, s]).collect(),
        (Some(one), Some(other)) => {
            let off = [0, 1].map(|k| other.centre[k] - one.centre[k]);
            let apart = off[0].hypot(off[1]);
            // Along the line of the centres to the chord of the two points, and half of that chord.
            let along =
                (apart * apart + one.radius * one.radius - other.radius * other.radius) / (2.0 * apart);
            let half = ((one.radius - along) * (one.radius + along)).sqrt();
            let unit = off.map(|v| v / apart);
            let at = |side: f64| {
                let p = [0, 1].map(|k| one.centre[k] + along * unit[k]);
                [p[0] - side * half * unit[1], p[1] + side * half * unit[0]]
            };
            let points = if half.is_finite() { vec![at(1.0), at(-1.0)] } else { Vec::new() };
            points.into_iter().filter_map(|p| Some([on(a, p, near)?, on(b, p, near)?])).collect()
        }
    };
    found.extend([(0.0, a.from), (1.0, a.to)].into_iter().filter_map(|(s, p)| Some([s, on(b, p, near)?])));
    found.extend([(0.0, b.from), (1.0, b.to)].into_iter().filter_map(|(t, p)| Some([on(a, p, near)?, t])));
    // A meeting at an end but for rounding is at the end.
    let snapped = |piece: &Piece, t: f64| {
        let p = piece.point(t);
        let ends = [(0.0, piece.from), (1.0, piece.to)];
        ends.into_iter().find(|(_, end)| distance(*end, p) <= near).map_or(t, |(end, _)| end)
    };
    found.into_iter().map(|[s, t]| [snapped(a, s), snapped(b, t)]).collect()
}

/// Where an arc and an edge, or two arcs, have one direction, if they go past each other there by less than `near`.
fn touching(a: &Piece, b: &Piece, near: f64) -> Option<[f64; 2]> {
    let is_on = |arc: &Arc, p: [f64; 2]| (distance(p, arc.centre) - arc.radius).abs() <= near;
    match (&a.arc, &b.arc) {
        (None, None) => None,
        (Some(_), None) => touching(b, a, near),
        (None, Some(arc)) => {
            let t = a.nearest(arc.centre);
            Some(a.point(t)).filter(|&foot| 0.0 < t && t < 1.0 && is_on(arc, foot))
        }
        (Some(one), Some(other)) => {
            let off = [0, 1].map(|k| other.centre[k] - one.centre[k]);
            let apart = off[0].hypot(off[1]);
            let at = |side: f64| [0, 1].map(|k| one.centre[k] + side * one.radius * (off[k] / apart));
            match [1.0, -1.0].map(at).map(|p| is_on(other, p).then_some(p)) {
                // Those of one circle have a part in common, if anything.
                [Some(_), Some(_)] => None,
                [p, q] => p.or(q),
            }
        }
    }
}

/// How far along a piece a point lies, if it lies on it.
pub fn on(piece: &Piece, p: [f64; 2], near: f64) -> Option<f64> {
    let t = piece.nearest(p);
    (distance(piece.point(t), p) <= near).then_some(t)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn lines_that_touch_but_for_rounding_meet_once() {
        let near = 1e-9;
        for k in 0..200 {
            let x = f64::from(k) * 0.1 - 9.0;
            let disc = Piece::arc([x, -2.0], 3.0, 0.1, TAU);
            let edge = Piece::edge([-20.0, -5.0], [20.0, -5.0]);
            for found in [crossings(&edge, &disc, near), crossings(&disc, &edge, near)] {
                assert_eq!(found.len(), 1, "{x}: {found:?}");
            }
            // From without and from within.
            for (radius, apart) in [(1.7, 4.7), (1.2, 1.8)] {
                let (sin, cos) = x.sin_cos();
                let other = Piece::arc([x + apart * cos, -2.0 + apart * sin], radius, 2.0, TAU);
                let found = crossings(&disc, &other, near);
                let meets = [x + 3.0 * cos, -2.0 + 3.0 * sin];
                // An end that is there is found as well.
                let is_there = |at: &[f64; 2]| distance(disc.point(at[0]), meets) < 1e-8;
                assert!(!found.is_empty() && found.iter().all(is_there), "{x} {radius}: {found:?}");
            }
        }
        // Those that cross still do so twice.
        let [one, other] = [0.0, 4.0].map(|x| Piece::arc([x, 0.0], 3.0, 0.1, TAU));
        assert_eq!(crossings(&one, &other, near).len(), 2);
    }

    #[test]
    fn what_touches_an_arc_but_for_a_gap_below_near_meets_it_there_and_what_is_farther_does_not() {
        let circle = |x: f64, radius: f64| Piece::arc([x, 0.0], radius, 1.0, TAU);
        let beside = |gap: f64| {
            let edge = Piece::edge([1.0 + gap, -1.0], [1.0 + gap, 2.0]);
            [circle(3.0 + gap, 2.0), circle(0.5 - gap, 0.5), edge]
        };
        let one = circle(0.0, 1.0);
        for other in [0.0, 1e-9].into_iter().flat_map(beside) {
            for (a, b) in [(&one, &other), (&other, &one)] {
                let places = crossings(a, b, 1e-8);
                let is_there = |[s, t]: &[f64; 2]| {
                    [a.point(*s), b.point(*t)].iter().all(|p| distance(*p, [1.0, 0.0]) <= 2e-8)
                };
                assert!(!places.is_empty() && places.iter().all(is_there), "{a:?} {b:?}: {places:?}");
            }
        }
        assert!(beside(1e-7).iter().all(|other| crossings(&one, other, 1e-8).is_empty()));
    }
}
