//! The body at a step, in the paper's colours.

use std::collections::HashSet;

use super::Subject;
use super::axes::Axes;
use super::bands::{Bands, Field};
use super::colour;
use super::energy::draw_contours;
use super::heading::{Heading, Key, Mark, draw_mark};
use super::page::{self, Bounds};
use super::raster::Raster;
use super::svg::{Path, Svg};
use crate::continuum::layout::roles::held_components;
use crate::continuum::record::Snapshot;
use crate::export::bonds;
use crate::flock::role::Role;
use crate::flock::rules::Axis;
use crate::flock::vectors::distance;

/// Bodies of more particles, or bonds, are drawn without bonds, which would be a grey sheet.
const MOST_PARTICLES_WITH_BONDS: usize = 20_000;
const MOST_BONDS: usize = 60_000;

/// Dots of more particles than this are too small for their colours: their body is drawn as a surface.
const MOST_COLOURED_DOTS: usize = 2_000;

/// How particles are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Style {
    Dots,
    /// Filled contours of a field.
    Surface,
    /// Squares, each for several particles.
    Raster,
}

impl Style {
    fn of(subject: &Subject<'_>, is_field: bool) -> Self {
        // Where neighbours are found anew at every step there are no faces to fill.
        let has_faces = is_field && subject.neighbours.is_some();
        match subject.is_raster() {
            true => Self::Raster,
            false if has_faces && subject.body.count() > MOST_COLOURED_DOTS => Self::Surface,
            false => Self::Dots,
        }
    }
}

/// Later ones are drawn over earlier ones: the few must not drown in the many.
const PAINTING_ORDER: [Role; 5] = [Role::Frame, Role::Follower, Role::Ghost, Role::Clamped, Role::Leader];

/// The shape of a role, which distinguishes the reds without their colour.
pub(super) fn mark_of(role: Role) -> Mark {
    match role {
        Role::Leader => Mark::Diamond,
        Role::Clamped => Mark::Square,
        Role::Follower | Role::Frame | Role::Ghost => Mark::Dot,
    }
}

/// Particles as dots in the colours of their roles, leaders as diamonds, clamped ones as squares, live bonds grey, broken ones dashed red.
pub fn configuration(subject: &Subject<'_>, snapshot: &Snapshot) -> String {
    let mut setting = Setting::default();
    setting.include(subject, snapshot, None);
    configuration_in(&setting, subject, snapshot, page::note(subject, snapshot), None)
}

/// The parts that all configurations of a film share, so that nothing moves but the body.
#[derive(Clone, Debug, Default)]
pub struct Setting {
    bounds: Option<Bounds>,
    /// Of the body in its reference places: one that bends is no wider.
    at_rest: Option<Bounds>,
    /// Lowest and highest value of the field; none of frame and ghosts, which are no matter.
    range: Option<[f64; 2]>,
    roles: Vec<Role>,
    has_broken_bonds: bool,
    /// Height of the heading, at least \[px\].
    heading: f64,
    is_film: bool,
}

impl Setting {
    /// For the configurations of a film.
    pub fn of_film() -> Self {
        Self { is_film: true, ..Self::default() }
    }

    fn axes(&self, spacing: f64) -> Axes {
        match self.is_film {
            true => page::around_in_film(self.bounds, spacing),
            false => page::around(self.bounds, spacing),
        }
    }

    /// Whether a surface is seen: one that is thinner is drawn as dots.
    fn is_wide(&self, axes: &Axes) -> bool {
        /// \[px\]
        const LEAST: f64 = 2.0;
        let all = [self.bounds, self.at_rest].into_iter().flatten();
        all.flat_map(|[low, high]| [0, 1].map(|k| high[k] - low[k]))
            .all(|width| width * axes.scale() >= LEAST)
    }

    /// Makes room for this configuration, and for these values of its particles, shape \[count\].
    pub fn include(&mut self, subject: &Subject<'_>, snapshot: &Snapshot, values: Option<&[f64]>) {
        let owned = subject.body.owned();
        let within = subject.bounds(page::bounds(&snapshot.positions, owned.clone()));
        self.bounds = page::around_both(self.bounds, within);
        let at_rest = || subject.bounds(page::bounds(&subject.body.reference, owned.clone()));
        self.at_rest = self.at_rest.or_else(at_rest);
        let is_here = |role: Role| f64::from(snapshot.roles[owned.clone()].contains(&role));
        let are_present = subject.largest(PAINTING_ORDER.map(is_here));
        let is_there = |role: Role| PAINTING_ORDER.into_iter().zip(are_present).any(|one| one == (role, 1.0));
        let is_present = |role: &Role| self.roles.contains(role) || is_there(*role);
        self.roles = PAINTING_ORDER.into_iter().filter(is_present).collect();
        self.has_broken_bonds |= !snapshot.broken.is_empty();
        let of_bodies = snapshot.roles.iter().zip(values.into_iter().flatten());
        let shown = of_bodies.filter(|(role, value)| role.is_body() && value.is_finite());
        self.range = shown.fold(self.range, |range, (_, &value)| {
            let [low, high] = range.unwrap_or([value; 2]);
            Some([low.min(value), high.max(value)])
        });
    }

    /// Bands for all values; those that differ by no more than `noise` have one colour.
    pub fn bands(&self, noise: f64) -> Bands {
        let [low, high] = self.range.unwrap_or([0.0; 2]);
        Bands::around(low, high, noise)
    }

    /// Makes room for this note above the plot.
    pub fn reserve(&mut self, subject: &Subject<'_>, note: String, bands: Option<&Bands>) {
        let axes = self.axes(subject.body.lattice.spacing());
        let width = page::width_of(&axes, beside(bands));
        self.heading = self.heading(subject, note, bands.is_some()).height(width);
    }

    fn heading(&self, subject: &Subject<'_>, mut note: String, is_field: bool) -> Heading {
        let style = Style::of(subject, is_field);
        if style == Style::Raster {
            let all = subject.total;
            // Of a body of which no other rank has a part there are fewer in a sample alone.
            let drawn = if subject.team.is_none() { subject.body.count() } else { all };
            let of_all = if drawn < all { format!("{drawn} of {all}") } else { all.to_string() };
            note += &format!("; {of_all} particles drawn as squares");
        }
        // Surfaces and squares have the colours of the field alone.
        let legend = match style {
            Style::Surface | Style::Raster if is_field => Vec::new(),
            _ => self.legend(style == Style::Raster, is_field),
        };
        let is_railed = style == Style::Dots && !rails(subject).is_empty();
        let rail = || Key::new("held along one axis", colour::of_role(Role::Clamped), Mark::Line);
        let rail = is_railed.then(rail);
        let legend = legend.into_iter().chain(rail).collect();
        Heading { title: subject.title.into(), note, legend, least: self.heading }
    }

    fn legend(&self, is_raster: bool, is_field: bool) -> Vec<Key> {
        let broken = match is_raster {
            true => Key::new("broken bond", colour::BROKEN_BOND_SQUARE, Mark::Dot),
            false => Key::new("broken bond", colour::BROKEN_BOND, Mark::DashedLine),
        };
        // A field has its colours for the body.
        let is_listed = |role: &Role| !is_field || *role != Role::Follower;
        let mark = |role: Role| if is_raster { Mark::Dot } else { mark_of(role) };
        let roles = self.roles.iter().rev().copied().filter(is_listed);
        roles
            .map(|role| Key::new(role.name(), colour::of_role(role), mark(role)))
            .chain(self.has_broken_bonds.then_some(broken))
            .collect()
    }
}

/// A configuration in a setting under this note; with a field, the particles of the body are dots in its colours,
/// leaders and clamped ones with a rim.
pub fn configuration_in(
    setting: &Setting,
    subject: &Subject<'_>,
    snapshot: &Snapshot,
    note: String,
    field: Option<&Field<'_>>,
) -> String {
    let spacing = subject.body.lattice.spacing();
    let style = Style::of(subject, field.is_some());
    let heading = setting.heading(subject, note, field.is_some());
    let axes = setting.axes(spacing);
    let beside = beside(field.map(|field| field.bands));
    page::with_body(&heading, axes, subject.unit, beside, |svg, axes| {
        match (style, field) {
            (Style::Raster, None) => draw_raster(svg, axes, subject, snapshot),
            (Style::Raster, Some(field)) => {
                let drawn = subject.drawn(&snapshot.roles);
                let values = drawn.map(|i| (axes.place(snapshot.positions.get(i)), field.values[i]));
                field.bands.draw_raster(svg, (axes, spacing), values, subject.team);
            }
            (Style::Surface, Some(field)) if setting.is_wide(axes) => {
                let is_shown = |i: usize| snapshot.roles[i].is_body() && field.values[i].is_finite();
                let is_drawn: Vec<bool> = (0..field.values.len()).map(is_shown).collect();
                draw_contours(svg, axes, subject, (snapshot, field.values), &is_drawn, field.bands);
            }
            _ => {
                draw_bonds(svg, axes, subject, snapshot);
                draw_dots(svg, axes, snapshot, spacing, field);
                draw_rails(svg, axes, subject, snapshot);
            }
        }
        if let Some(field) = field {
            field.bands.draw_bar(svg, axes);
        }
    })
}

/// Room for the colour bar, if there is one \[px\].
fn beside(bands: Option<&Bands>) -> f64 {
    bands.map_or(20.0, Bands::bar_room)
}

fn draw_bonds(svg: &mut Svg, axes: &Axes, subject: &Subject<'_>, snapshot: &Snapshot) {
    let broken: HashSet<[u32; 2]> = snapshot.broken.iter().copied().collect();
    let is_live = |[j, k]: [u32; 2]| !broken.contains(&[j.min(k), j.max(k)]);
    if let Some(neighbours) = subject.neighbours
        && snapshot.positions.len() <= MOST_PARTICLES_WITH_BONDS
        && neighbours.index.len() <= 2 * MOST_BONDS
    {
        let live = bonds::pairs(neighbours).filter(|&pair| is_live(pair));
        let ends = live.map(|pair| pair.map(|i| snapshot.positions.get(i as usize)));
        draw_lines(svg, axes, ends, &format!("stroke=\"{}\" stroke-width=\"0.8\"", colour::LIVE_BOND));
    }
    let lost = snapshot.broken.iter().flat_map(|&pair| broken_bond(axes, subject, snapshot, pair));
    let stroke = format!("stroke=\"{}\" stroke-width=\"1.3\" stroke-dasharray=\"3 2\"", colour::BROKEN_BOND);
    draw_lines(svg, axes, lost, &format!("class=\"broken\" {stroke}"));
}

/// Draws lines between ends that are somewhere, a few in a path: what is made of one to fill it takes memory.
fn draw_lines(svg: &mut Svg, axes: &Axes, lines: impl Iterator<Item = [[f64; 2]; 2]>, attributes: &str) {
    const OF_A_PATH: usize = 500;
    let lines = lines.map(|ends| ends.map(|end| axes.place(end)));
    let mut lines = lines.filter(|ends| ends.iter().flatten().all(|value| value.is_finite())).peekable();
    while lines.peek().is_some() {
        let mut path = Path::default();
        lines.by_ref().take(OF_A_PATH).for_each(|ends| path.polyline(ends));
        svg.path(&path, format_args!("fill=\"none\" {attributes}"));
    }
}

/// The lines that stand for a broken bond: one from end to end or, where the ends are far apart,
/// a stub at either, as long as the bond was or as it takes to be seen. Lines across the gaps would
/// hide what is there.
fn broken_bond(
    axes: &Axes,
    subject: &Subject<'_>,
    snapshot: &Snapshot,
    pair: [u32; 2],
) -> Vec<[[f64; 2]; 2]> {
    const FAR: f64 = 3.0;
    const SHORTEST_STUB: f64 = 8.0;
    let [a, b] = pair.map(|i| snapshot.positions.get(i as usize));
    let [from, to] = pair.map(|i| subject.body.reference.get(i as usize));
    let (rest, length) = (distance(from, to), distance(a, b));
    let part = (rest.max(SHORTEST_STUB / axes.scale()) / length).min(1.0);
    if part > 1.0 / FAR {
        return vec![[a, b]];
    }
    let towards = |start: [f64; 2], end: [f64; 2]| [0, 1].map(|k| start[k] + part * (end[k] - start[k]));
    vec![[a, towards(a, b)], [b, towards(b, a)]]
}

fn draw_dots(svg: &mut Svg, axes: &Axes, snapshot: &Snapshot, spacing: f64, field: Option<&Field<'_>>) {
    let radius = dot_radius(axes, spacing);
    let dots = |svg: &mut Svg, mark: Mark, chosen: &dyn Fn(usize) -> bool| {
        for (_, place) in snapshot.positions.iter().enumerate().filter(|(i, _)| chosen(*i)) {
            if place.iter().all(|value| value.is_finite()) {
                draw_mark(svg, mark, axes.place(place), radius);
            }
        }
    };
    for role in PAINTING_ORDER {
        let is_it = |i: usize| snapshot.roles[i] == role;
        let Some(field) = field.filter(|_| role.is_body()) else {
            let attributes = format!("class=\"{}\" fill=\"{}\"", role.name(), colour::of_role(role));
            svg.group(attributes, |svg| dots(svg, mark_of(role), &is_it));
            continue;
        };
        let rim = match role {
            Role::Follower => String::new(),
            _ => format!(" stroke=\"{}\" stroke-width=\"{:.2}\"", colour::of_role(role), 0.35 * radius),
        };
        for band in 0..=field.bands.count() {
            let attributes = format!("class=\"{}\" fill=\"{}\"{rim}", role.name(), field.colour(band));
            svg.group(attributes, |svg| dots(svg, mark_of(role), &|i| is_it(i) && field.band(i) == band));
        }
    }
}

/// Particles of which one component is held or led from the start, with the axis along which they may move.
fn rails(subject: &Subject<'_>) -> Vec<(usize, Axis)> {
    let held = held_components(subject.changes, subject.body, 0.0).into_iter();
    held.map(|held| (held.particle, if held.axis == Axis::X { Axis::Y } else { Axis::X })).collect()
}

/// A short line along which each of them may move.
fn draw_rails(svg: &mut Svg, axes: &Axes, subject: &Subject<'_>, snapshot: &Snapshot) {
    let rails = rails(subject);
    if rails.is_empty() {
        return;
    }
    let radius = dot_radius(axes, subject.body.lattice.spacing());
    let attributes = format!(
        "class=\"rail\" stroke=\"{}\" stroke-width=\"{:.2}\"",
        colour::of_role(Role::Clamped),
        0.5 * radius
    );
    svg.group(attributes, |svg| {
        for (i, free) in rails {
            let [x, y] = axes.place(snapshot.positions.get(i));
            let [dx, dy] = if free == Axis::X { [1.8 * radius, 0.0] } else { [0.0, 1.8 * radius] };
            if [x, y].iter().all(|value| value.is_finite()) {
                svg.line([x - dx, y - dy], [x + dx, y + dy]);
            }
        }
    });
}

/// Dots leave gaps through which bonds are seen \[px\].
pub(super) fn dot_radius(axes: &Axes, spacing: f64) -> f64 {
    (0.3 * spacing * axes.scale()).clamp(0.6, 8.0)
}

/// Marks of a square of the raster; of several that fall into one square the last of these is shown. Ends of broken bonds
/// (`None`) must not hide the few that are led, nor the many the frame around them.
const SQUARE_ORDER: [Option<Role>; 6] = [
    Some(Role::Follower),
    Some(Role::Ghost),
    Some(Role::Frame),
    None,
    Some(Role::Clamped),
    Some(Role::Leader),
];

fn draw_raster(svg: &mut Svg, axes: &Axes, subject: &Subject<'_>, snapshot: &Snapshot) {
    let (body, owned) = (subject.body, subject.body.owned());
    let mut raster = Raster::over(axes, body.lattice.spacing());
    let mut drop = |particle: usize, shown: Option<Role>| {
        let rank = SQUARE_ORDER.iter().position(|&other| other == shown).unwrap_or(0);
        raster.drop(axes.place(snapshot.positions.get(particle)), rank as f64);
    };
    owned.clone().for_each(|i| drop(i, Some(snapshot.roles[i])));
    let ends = snapshot.broken.iter().flatten().filter_map(|&end| body.exact_particle(end as usize));
    ends.filter(|i| owned.contains(i)).for_each(|i| drop(i, None));
    let raster = raster.of_all(subject.team);
    let colour = |n: usize| SQUARE_ORDER[n].map_or(colour::BROKEN_BOND_SQUARE, colour::of_role).to_owned();
    raster.draw(svg, SQUARE_ORDER.len(), |rank| rank as usize, colour);
}
