//! A rule's displacement over the true one, as in the paper's figures 11, 13, 15 and 17.

use super::axes::Axes;
use super::colour;
use super::configuration::dot_radius;
use super::heading::{Heading, Key, Mark};
use super::page;
use super::svg::{Path, Svg};
use crate::flock::points::Points;
use crate::flock::role::Role;
use crate::material::cells::Cells;

/// Bodies of more particles are drawn as outlines: dots would be one blot.
const MOST_PARTICLES: usize = 20_000;
/// Largest displacements below this part of the body's longer side cannot be seen and are enlarged.
const SEEN: f64 = 0.02;

const TRUTH: &str = "#d55e00";
const UNDEFORMED: &str = "#a8adb4";

/// Two displacements of one body. Arrays follow the particles, shape \[particles\].
#[derive(Clone, Copy, Debug)]
pub struct Compared<'a> {
    pub title: &'a str,
    /// Name of the unit of length.
    pub unit: &'a str,
    /// Name of the unit of stress; may be empty.
    pub stress_unit: &'a str,
    /// Distance of neighbours \[length\].
    pub spacing: f64,
    pub cells: &'a Cells,
    pub roles: &'a [Role],
    /// Where the particles are at rest \[length\].
    pub reference: &'a Points,
    /// Displacements \[length\].
    pub rule: &'a Points,
    pub truth: &'a Points,
}

/// Particles where the rule has them and where the truth has them, on the same axes.
pub fn overlay(compared: &Compared<'_>) -> String {
    let factor = compared.factor();
    let [rule, truth] = [compared.rule, compared.truth].map(|u| compared.displaced(u, factor));
    let axes = compared.window([compared.reference, &rule, &truth], Axes::equal);
    let is_dotted = compared.roles.len() <= MOST_PARTICLES;
    let mut note = "the rule's particles and the true ones".to_owned();
    if !is_dotted {
        note = "outlines by the rule and in truth".to_owned();
    }
    note += &told(factor);
    let heading = Heading { title: compared.title.into(), note, legend: legend(compared, is_dotted) };
    page::with_body(&heading, axes, compared.unit, 20.0, |svg, axes| {
        let dashes = "stroke-dasharray=\"5 3\"";
        draw_outline(svg, axes, compared, compared.reference, &format!("stroke=\"{UNDEFORMED}\" {dashes}"));
        draw_outline(svg, axes, compared, &truth, &format!("stroke=\"{TRUTH}\" stroke-width=\"1.2\""));
        if is_dotted {
            draw_particles(svg, axes, compared, &rule, &truth);
        } else {
            let ink = colour::of_role(Role::Follower);
            draw_outline(svg, axes, compared, &rule, &format!("stroke=\"{ink}\" stroke-width=\"1.2\""));
        }
    })
}

impl Compared<'_> {
    /// By how much displacements are drawn larger than they are: 1, or 1, 2, 5 times a power of ten.
    pub(super) fn factor(&self) -> f64 {
        let size = |u: [f64; 2]| u[0].hypot(u[1]);
        let largest = self.drawn().map(|i| size(self.truth.get(i)).max(size(self.rule.get(i))));
        let largest = largest.filter(|u| u.is_finite()).fold(0.0, f64::max);
        let (low, high) = self.reference.bounds(self.drawn()).unwrap_or_default();
        let wanted = 4.0 * SEEN * (high[0] - low[0]).max(high[1] - low[1]);
        if largest == 0.0 || 4.0 * largest >= wanted {
            return 1.0;
        }
        let decade = 10f64.powf((wanted / largest).log10().floor());
        let round = [5.0, 2.0, 1.0].map(|m| m * decade);
        round.into_iter().find(|&factor| factor * largest <= wanted).unwrap_or(decade)
    }

    /// The particles that are matter: the frame and ghosts are no part of the truth.
    pub(super) fn drawn(&self) -> impl Iterator<Item = usize> {
        (0..self.roles.len()).filter(|&i| self.roles[i].is_body())
    }

    pub(super) fn displaced(&self, displacement: &Points, factor: f64) -> Points {
        let moved = |(p, u): ([f64; 2], [f64; 2])| [p[0] + factor * u[0], p[1] + factor * u[1]];
        self.reference.iter().zip(displacement.iter()).map(moved).collect()
    }

    /// The window that holds the particles at all these places.
    pub(super) fn window<'p>(
        &self,
        places: impl IntoIterator<Item = &'p Points>,
        axes: impl FnOnce([f64; 2], [f64; 2], f64) -> Axes,
    ) -> Axes {
        let finite = |p: &[f64; 2]| p.iter().all(|value| value.is_finite());
        let all: Points = places
            .into_iter()
            .flat_map(|points| self.drawn().map(|i| points.get(i)))
            .filter(finite)
            .collect();
        let (low, high) = all.bounds(0..all.len()).unwrap_or(([0.0; 2], [1.0; 2]));
        let longest = (high[0] - low[0]).max(high[1] - low[1]);
        axes(low, high, (0.02 * longest).max(0.6 * self.spacing))
    }
}

/// How the note ends where displacements are enlarged.
pub(super) fn told(factor: f64) -> String {
    if factor == 1.0 {
        ", displacements to scale".into()
    } else {
        format!(", displacements enlarged {factor} times")
    }
}

fn legend(compared: &Compared<'_>, is_dotted: bool) -> Vec<Key> {
    let blue = colour::of_role(Role::Follower);
    let undeformed = Key { name: "undeformed", colour: UNDEFORMED, mark: Mark::DashedLine };
    if !is_dotted {
        let line = |name, colour| Key { name, colour, mark: Mark::Line };
        return vec![line("truth", TRUTH), line("rule", blue), undeformed];
    }
    let present = |role: &Role| compared.roles.contains(role);
    let led = [Role::Leader, Role::Clamped].into_iter().filter(present);
    let dot = |role: Role| Key { name: role.name(), colour: colour::of_role(role), mark: Mark::Dot };
    let first = [
        Key { name: "truth", colour: TRUTH, mark: Mark::Ring },
        Key { name: "rule: follower", colour: blue, mark: Mark::Dot },
    ];
    first.into_iter().chain(led.map(dot)).chain([undeformed]).collect()
}

/// The body's boundary with its corners at `places`.
fn draw_outline(svg: &mut Svg, axes: &Axes, compared: &Compared<'_>, places: &Points, stroke: &str) {
    let cells = compared.cells;
    let mut path = Path::default();
    for side in cells.boundary_sides(&cells.incidence(places.len())) {
        let ends = side.map(|i| axes.place(places.get(i as usize)));
        if ends.iter().flatten().all(|value| value.is_finite()) {
            path.polyline(ends);
        }
    }
    svg.path(&path, format_args!("fill=\"none\" {stroke} stroke-linecap=\"round\""));
}

/// Rings where the truth is, dots where the rule is, and a line from each to the other.
fn draw_particles(svg: &mut Svg, axes: &Axes, compared: &Compared<'_>, rule: &Points, truth: &Points) {
    let radius = (0.75 * dot_radius(axes, compared.spacing)).min(4.2);
    let ring = (radius + 1.4).min(1.5 * radius);
    let is_seen = |i: &usize| rule.get(*i).iter().chain(&truth.get(*i)).all(|value| value.is_finite());
    let mut errors = Path::default();
    for i in compared.drawn().filter(is_seen) {
        errors.polyline([truth.get(i), rule.get(i)].map(|place| axes.place(place)));
    }
    svg.path(&errors, "class=\"error\" fill=\"none\" stroke=\"#6b7280\" stroke-width=\"0.8\"");
    for role in [Role::Follower, Role::Clamped, Role::Leader] {
        svg.group(format_args!("class=\"{}\" fill=\"{}\"", role.name(), colour::of_role(role)), |svg| {
            for i in compared.drawn().filter(is_seen).filter(|&i| compared.roles[i] == role) {
                svg.circle(axes.place(rule.get(i)), radius);
            }
        });
    }
    svg.group(format_args!("class=\"truth\" fill=\"none\" stroke=\"{TRUTH}\" stroke-width=\"1.3\""), |svg| {
        compared.drawn().filter(is_seen).for_each(|i| svg.circle(axes.place(truth.get(i)), ring));
    });
}
