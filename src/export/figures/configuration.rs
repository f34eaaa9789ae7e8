//! The body at a step, in the paper's colours.

use std::collections::HashSet;

use super::axes::Axes;
use super::colour;
use super::heading::{Heading, Key, Mark};
use super::page;
use super::raster::Raster;
use super::svg::{Path, Svg};
use super::{MOST_DOTS, Subject};
use crate::continuum::record::Snapshot;
use crate::export::bonds;
use crate::flock::role::Role;
use crate::flock::vectors::distance;

/// Bodies of more particles, or bonds, are drawn without bonds, which would be a grey sheet.
const MOST_PARTICLES_WITH_BONDS: usize = 20_000;
const MOST_BONDS: usize = 60_000;

/// Later ones are drawn over earlier ones: the few must not drown in the many.
const PAINTING_ORDER: [Role; 5] = [Role::Frame, Role::Follower, Role::Ghost, Role::Clamped, Role::Leader];

/// Particles as dots in the colours of their roles, live bonds grey, broken ones dashed red.
pub fn configuration(subject: &Subject<'_>, snapshot: &Snapshot) -> String {
    let count = snapshot.positions.len();
    let spacing = subject.body.lattice.spacing();
    let axes = page::window(&snapshot.positions, 0..count, spacing);
    let is_raster = count > MOST_DOTS;
    let mut heading = Heading {
        title: subject.title.into(),
        note: page::note(subject, snapshot),
        legend: legend(snapshot, is_raster),
    };
    if is_raster {
        heading.note += &format!("; {count} particles drawn as squares");
    }
    page::with_body(&heading, axes, subject.unit, 20.0, |svg, axes| {
        if is_raster {
            draw_raster(svg, axes, snapshot, spacing);
        } else {
            draw_bonds(svg, axes, subject, snapshot);
            draw_dots(svg, axes, snapshot, spacing);
        }
    })
}

fn legend(snapshot: &Snapshot, is_raster: bool) -> Vec<Key> {
    let (colour, mark) = if is_raster {
        (colour::BROKEN_BOND_SQUARE, Mark::Dot)
    } else {
        (colour::BROKEN_BOND, Mark::DashedLine)
    };
    let broken = Key { name: "broken bond".into(), colour, mark };
    let is_present = |role: &Role| snapshot.roles.contains(role);
    let roles = PAINTING_ORDER.into_iter().rev().filter(is_present);
    roles
        .map(|role| Key { name: role.name().into(), colour: colour::of_role(role), mark: Mark::Dot })
        .chain((!snapshot.broken.is_empty()).then_some(broken))
        .collect()
}

fn draw_bonds(svg: &mut Svg, axes: &Axes, subject: &Subject<'_>, snapshot: &Snapshot) {
    let line = |path: &mut Path, ends: [[f64; 2]; 2]| {
        let ends = ends.map(|end| axes.place(end));
        if ends.iter().flatten().all(|value| value.is_finite()) {
            path.polyline(ends);
        }
    };
    let broken: HashSet<[u32; 2]> = snapshot.broken.iter().copied().collect();
    let is_live = |[j, k]: [u32; 2]| !broken.contains(&[j.min(k), j.max(k)]);
    if let Some(neighbours) = subject.neighbours
        && snapshot.positions.len() <= MOST_PARTICLES_WITH_BONDS
        && neighbours.index.len() <= 2 * MOST_BONDS
    {
        let mut live = Path::default();
        for pair in bonds::pairs(neighbours).filter(|&pair| is_live(pair)) {
            line(&mut live, pair.map(|i| snapshot.positions.get(i as usize)));
        }
        svg.path(&live, format_args!("fill=\"none\" stroke=\"{}\" stroke-width=\"0.8\"", colour::LIVE_BOND));
    }
    let mut lost = Path::default();
    for &pair in &snapshot.broken {
        broken_bond(axes, subject, snapshot, pair).into_iter().for_each(|ends| line(&mut lost, ends));
    }
    if !lost.is_empty() {
        let stroke = format!("stroke=\"{}\" stroke-width=\"1.3\"", colour::BROKEN_BOND);
        svg.path(&lost, format_args!("class=\"broken\" fill=\"none\" {stroke} stroke-dasharray=\"3 2\""));
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

fn draw_dots(svg: &mut Svg, axes: &Axes, snapshot: &Snapshot, spacing: f64) {
    let radius = dot_radius(axes, spacing);
    for role in PAINTING_ORDER {
        let attributes = format!("class=\"{}\" fill=\"{}\"", role.name(), colour::of_role(role));
        svg.group(attributes, |svg| {
            for (place, _) in snapshot.positions.iter().zip(&snapshot.roles).filter(|(_, r)| **r == role) {
                if place.iter().all(|value| value.is_finite()) {
                    svg.circle(axes.place(place), radius);
                }
            }
        });
    }
}

/// Dots leave gaps through which bonds are seen \[px\].
pub(super) fn dot_radius(axes: &Axes, spacing: f64) -> f64 {
    (0.3 * spacing * axes.scale()).clamp(0.6, 8.0)
}

/// Marks of a square of the raster; of several that fall into one square the last of these is shown. Ends of broken bonds
/// (`None`) must not hide the few that are led.
const SQUARE_ORDER: [Option<Role>; 6] = [
    Some(Role::Frame),
    Some(Role::Follower),
    Some(Role::Ghost),
    None,
    Some(Role::Clamped),
    Some(Role::Leader),
];

fn draw_raster(svg: &mut Svg, axes: &Axes, snapshot: &Snapshot, spacing: f64) {
    let mut raster = Raster::over(axes, spacing);
    let mut drop = |place: [f64; 2], shown: Option<Role>| {
        let rank = SQUARE_ORDER.iter().position(|&other| other == shown).unwrap_or(0);
        raster.drop(axes.place(place), rank as f64);
    };
    for (place, &role) in snapshot.positions.iter().zip(&snapshot.roles) {
        drop(place, Some(role));
    }
    for &end in snapshot.broken.iter().flatten() {
        drop(snapshot.positions.get(end as usize), None);
    }
    let paths = raster.paths(SQUARE_ORDER.len(), |rank| rank as usize);
    for (path, shown) in paths.iter().zip(SQUARE_ORDER) {
        let colour = shown.map_or(colour::BROKEN_BOND_SQUARE, colour::of_role);
        svg.path(path, format_args!("fill=\"{colour}\" shape-rendering=\"crispEdges\""));
    }
}
