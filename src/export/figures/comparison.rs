//! A rule's displacement over the true one, as in the paper's figures 11, 13, 15 and 17.

use super::axes::Axes;
use super::colour;
use super::configuration::{dot_radius, mark_of};
use super::heading::{Heading, Key, Mark, draw_mark};
use super::page::{self, Bounds};
use super::svg::{Path, Svg};
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;

/// Bodies of more particles are drawn as outlines: dots would be one blot.
const MOST_PARTICLES: usize = 20_000;
/// Displacements whose largest is below this part of the body's longer side cannot be seen.
const SEEN: f64 = 0.02;
/// Above this part they would make the body itself a speck: small strain has no bound on them.
const LOST: f64 = 0.6;

const TRUTH: &str = "#d55e00";
const UNDEFORMED: &str = "#a8adb4";

/// Two displacements of one body. Arrays follow the particles, shape \[particles\].
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// The heading of the figure.
    pub title: &'a str,
    /// Name of the unit of length.
    pub unit: &'a str,
    /// Name of the unit of stress; may be empty.
    pub stress_unit: &'a str,
    /// Distance of neighbours \[length\].
    pub spacing: f64,
    /// Cells between the particles.
    pub cells: &'a Cells,
    /// Role of each particle.
    pub roles: &'a [Role],
    /// Places of the particles at rest \[length\].
    pub reference: &'a Vectors,
    /// Displacements \[length\].
    pub rule: &'a Vectors,
    /// True displacements \[length\].
    pub truth: &'a Vectors,
}

/// Particles where the rule has them and where the truth has them, on the same axes.
pub fn overlay(pair: &Pair<'_>) -> String {
    let factor = pair.factor();
    let [rule, truth] = [pair.rule, pair.truth].map(|u| pair.displaced(u, factor));
    let axes = page::around(pair.bounds([pair.reference, &rule, &truth]), pair.spacing);
    let is_dotted = pair.roles.len() <= MOST_PARTICLES;
    let mut note = "the rule's particles and the true ones".to_owned();
    if !is_dotted {
        note = "outlines by the rule and in truth".to_owned();
    }
    note += &scale_note(factor);
    let heading =
        Heading { title: pair.title.into(), note, legend: legend(pair, is_dotted), ..Heading::default() };
    page::with_body(&heading, axes, pair.unit, 20.0, |svg, axes| {
        let dashes = "stroke-dasharray=\"5 3\"";
        draw_outline(svg, axes, pair, pair.reference, &format!("stroke=\"{UNDEFORMED}\" {dashes}"));
        draw_outline(svg, axes, pair, &truth, &format!("stroke=\"{TRUTH}\" stroke-width=\"1.2\""));
        if is_dotted {
            draw_particles(svg, axes, pair, &rule, &truth);
        } else {
            let ink = colour::of_role(Role::Follower);
            draw_outline(svg, axes, pair, &rule, &format!("stroke=\"{ink}\" stroke-width=\"1.2\""));
        }
    })
}

impl Pair<'_> {
    /// See [`enlargement`].
    pub(super) fn factor(&self) -> f64 {
        enlargement(largest_of(self.truth, self.drawn()), self.bounds([self.reference]))
    }

    /// The particles that are matter: the frame and ghosts are no part of the truth.
    pub(super) fn drawn(&self) -> impl Iterator<Item = usize> {
        (0..self.roles.len()).filter(|&i| self.roles[i].is_body())
    }

    pub(super) fn displaced(&self, displacement: &Vectors, factor: f64) -> Vectors {
        displaced(self.reference, displacement, factor)
    }

    /// Lowest and highest of all these places of the particles.
    pub(super) fn bounds<const N: usize>(&self, places: [&Vectors; N]) -> Option<Bounds> {
        places.map(|points| page::bounds(points, self.drawn())).into_iter().fold(None, page::around_both)
    }
}

/// The places of particles that are displaced by so many times the displacement.
pub(in crate::export) fn displaced(reference: &Vectors, displacement: &Vectors, factor: f64) -> Vectors {
    let moved = |(p, u): ([f64; 2], [f64; 2])| [p[0] + factor * u[0], p[1] + factor * u[1]];
    reference.iter().zip(displacement.iter()).map(moved).collect()
}

/// The largest of these particles' displacements \[length\].
pub(super) fn largest_of(displacement: &Vectors, drawn: impl Iterator<Item = usize>) -> f64 {
    let size = |u: [f64; 2]| u[0].hypot(u[1]);
    drawn.map(|i| size(displacement.get(i))).filter(|u| u.is_finite()).fold(0.0, f64::max)
}

/// The factor by which displacements are drawn of which this one is the largest, of a body within these bounds: 1, or 1, 2, 5
/// times a power of ten for those too small to be seen and those so large that the body would be lost beside them.
pub(super) fn enlargement(largest: f64, reference: Option<Bounds>) -> f64 {
    let [low, high] = reference.unwrap_or_default();
    let part = largest / (high[0] - low[0]).max(high[1] - low[1]);
    if !part.is_normal() || (SEEN..=LOST).contains(&part) {
        return 1.0;
    }
    let wanted = if part < SEEN { 4.0 * SEEN } else { 0.5 * LOST } / part;
    let decade = 10f64.powf(wanted.log10().floor());
    [5.0, 2.0].map(|m| m * decade).into_iter().find(|&factor| factor <= wanted).unwrap_or(decade)
}

/// The end of the note: the factor by which displacements are enlarged.
pub(super) fn scale_note(factor: f64) -> String {
    match factor {
        1.0 => ", displacements to scale".into(),
        small if small < 1.0 => format!(", displacements drawn at {small} of their size"),
        large => format!(", displacements enlarged {large} times"),
    }
}

fn legend(pair: &Pair<'_>, is_dotted: bool) -> Vec<Key> {
    let undeformed = Key::new("undeformed", UNDEFORMED, Mark::DashedLine);
    let blue = colour::of_role(Role::Follower);
    if !is_dotted {
        return vec![Key::new("truth", TRUTH, Mark::Line), Key::new("rule", blue, Mark::Line), undeformed];
    }
    let led = [Role::Leader, Role::Clamped].into_iter().filter(|role| pair.roles.contains(role));
    let led = led.map(|role| Key::new(role.name(), colour::of_role(role), mark_of(role)));
    let first = [Key::new("truth", TRUTH, Mark::Ring), Key::new("rule: follower", blue, Mark::Dot)];
    first.into_iter().chain(led).chain([undeformed]).collect()
}

/// The body's boundary with its corners at `places`, in one piece each, or the dashes of a line would begin anew at every
/// particle.
fn draw_outline(svg: &mut Svg, axes: &Axes, pair: &Pair<'_>, places: &Vectors, stroke: &str) {
    let mut path = Path::default();
    for way in pair.cells.boundary_ways(places.len()) {
        let way: Vec<[f64; 2]> = way.iter().map(|&i| axes.place(places.get(i as usize))).collect();
        if way.iter().flatten().all(|value| value.is_finite()) {
            path.polyline(way);
        }
    }
    svg.path(&path, format_args!("class=\"outline\" fill=\"none\" {stroke} stroke-linejoin=\"round\""));
}

/// Rings where the truth is, dots where the rule is, and a line from each to the other.
fn draw_particles(svg: &mut Svg, axes: &Axes, pair: &Pair<'_>, rule: &Vectors, truth: &Vectors) {
    let radius = (0.75 * dot_radius(axes, pair.spacing)).min(4.2);
    let ring = (radius + 1.4).min(1.5 * radius);
    let is_seen = |i: &usize| rule.get(*i).iter().chain(&truth.get(*i)).all(|value| value.is_finite());
    let mut errors = Path::default();
    for i in pair.drawn().filter(is_seen) {
        errors.polyline([truth.get(i), rule.get(i)].map(|place| axes.place(place)));
    }
    svg.path(&errors, "class=\"error\" fill=\"none\" stroke=\"#6b7280\" stroke-width=\"0.8\"");
    for role in [Role::Follower, Role::Clamped, Role::Leader] {
        svg.group(format_args!("class=\"{}\" fill=\"{}\"", role.name(), colour::of_role(role)), |svg| {
            for i in pair.drawn().filter(is_seen).filter(|&i| pair.roles[i] == role) {
                draw_mark(svg, mark_of(role), axes.place(rule.get(i)), radius);
            }
        });
    }
    svg.group(format_args!("class=\"truth\" fill=\"none\" stroke=\"{TRUTH}\" stroke-width=\"1.3\""), |svg| {
        pair.drawn().filter(is_seen).for_each(|i| svg.circle(axes.place(truth.get(i)), ring));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::{Body, Cut};
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::geometry::shape::Shape;
    use crate::material::cells::neighbourhood;

    #[test]
    fn a_body_with_a_hole_is_outlined_by_two_closed_ways() {
        let shape = Shape::Rectangle { min: [0.0; 2], max: [9.0, 6.0] };
        for kind in LatticeKind::SAMPLES {
            let lattice = Lattice::new(kind, [0.0; 2], 0.0);
            let near = neighbourhood(&lattice);
            let (body, _) = Body::build(lattice, &Cut::Shape(shape.clone()), &near, None).expect("builds");
            let mut cells = Cells::of_body(&body);
            let whole = cells.boundary_ways(body.count());
            assert_eq!(whole.len(), 1, "{kind:?}");
            // A cell that touches no side of the boundary.
            let inner = |cell: &usize| cells.of(*cell).iter().all(|corner| !whole[0].contains(corner));
            let hole = (0..cells.count()).find(inner).expect("inside");
            let corners = cells.of(hole).len();
            let all = cells.clone();
            cells = Cells::of_kinds(all.shapes.clone());
            for (cell, kept) in all.iter().enumerate().filter(|(cell, _)| *cell != hole) {
                cells.push(kept, all.kind[cell]);
            }
            let ways = cells.boundary_ways(body.count());
            let closed = ways.iter().filter(|way| way.first() == way.last()).count();
            assert_eq!((ways.len(), closed), (2, 2), "{kind:?}");
            assert_eq!(ways.iter().map(Vec::len).sum::<usize>(), whole[0].len() + corners + 1);
        }
    }

    #[test]
    fn displacements_are_enlarged_or_reduced_by_round_factors_until_they_can_be_seen() {
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let near = neighbourhood(&lattice);
        let cut = Cut::Count { columns: 11, rows: 3 };
        let (body, _) = Body::build(lattice, &cut, &near, None).expect("builds");
        let cells = Cells::of_body(&body);
        for (size, factor) in [(1.0, 1.0), (0.0, 1.0), (5.9, 1.0), (1e-3, 500.0), (50.0, 0.05), (0.1, 5.0)] {
            let moved: Vectors = body.reference.iter().map(|_| [0.0, size]).collect();
            let pair = Pair {
                title: "",
                unit: "m",
                stress_unit: "",
                spacing: 1.0,
                cells: &cells,
                roles: &vec![Role::Follower; body.count()],
                reference: &body.reference,
                rule: &moved,
                truth: &moved,
            };
            assert!((pair.factor() - factor).abs() < 1e-12 * factor, "{size}: {}", pair.factor());
        }
    }
}
