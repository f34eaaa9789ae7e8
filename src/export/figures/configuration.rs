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

/// Bodies of more particles, or bonds, are drawn without bonds, which would be a grey sheet.
const MOST_PARTICLES_WITH_BONDS: usize = 20_000;
const MOST_BONDS: usize = 60_000;

/// Later ones are drawn over earlier ones: the few must not drown in the many.
const PAINTING_ORDER: [Role; 5] = [Role::Frame, Role::Follower, Role::Ghost, Role::Clamped, Role::Leader];

const BROKEN_NAME: &str = "broken bond";

/// Particles as dots in the colours of their roles, live bonds grey, broken ones dashed red.
pub fn configuration(subject: &Subject<'_>, snapshot: &Snapshot) -> String {
    let count = snapshot.positions.len();
    let spacing = subject.body.lattice.spacing();
    let axes = page::window(&snapshot.positions, 0..count, spacing);
    let is_raster = count > MOST_DOTS;
    let mut heading =
        Heading { title: subject.title.into(), note: page::note(snapshot), legend: legend(snapshot, is_raster) };
    if is_raster {
        heading.note += &format!("; {count} particles as squares, each in the colour of its rarest kind");
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
    let mark = if is_raster { Mark::Dot } else { Mark::DashedLine };
    let broken = Key { name: BROKEN_NAME, colour: colour::BROKEN_BOND, mark };
    let is_present = |role: &Role| snapshot.roles.contains(role);
    let roles = PAINTING_ORDER.into_iter().rev().filter(is_present);
    roles
        .map(|role| Key { name: role.name(), colour: colour::of_role(role), mark: Mark::Dot })
        .chain((!snapshot.broken.is_empty()).then_some(broken))
        .collect()
}

fn draw_bonds(svg: &mut Svg, axes: &Axes, subject: &Subject<'_>, snapshot: &Snapshot) {
    let place = |i: u32| axes.place(snapshot.positions.get(i as usize));
    let line = |path: &mut Path, pair: [u32; 2]| {
        let ends = pair.map(place);
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
        bonds::pairs(neighbours).filter(|&pair| is_live(pair)).for_each(|pair| line(&mut live, pair));
        svg.path(&live, format_args!("fill=\"none\" stroke=\"{}\" stroke-width=\"0.8\"", colour::LIVE_BOND));
    }
    let mut lost = Path::default();
    snapshot.broken.iter().for_each(|&pair| line(&mut lost, pair));
    if !lost.is_empty() {
        let stroke = format!("stroke=\"{}\" stroke-width=\"0.9\"", colour::BROKEN_BOND);
        svg.path(&lost, format_args!("class=\"broken\" fill=\"none\" {stroke} stroke-dasharray=\"3 2\""));
    }
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

/// Dots leave gaps through which bonds are seen [px].
pub(super) fn dot_radius(axes: &Axes, spacing: f64) -> f64 {
    (0.3 * spacing * axes.scale()).clamp(0.6, 8.0)
}

/// Squares in the colour of whatever in them is painted last; broken bonds mark their ends.
fn draw_raster(svg: &mut Svg, axes: &Axes, snapshot: &Snapshot, spacing: f64) {
    let mut raster = Raster::over(axes, spacing);
    let rank = |role: Role| PAINTING_ORDER.iter().position(|&r| r == role).unwrap_or(0);
    for (place, &role) in snapshot.positions.iter().zip(&snapshot.roles) {
        raster.drop(axes.place(place), rank(role) as f64);
    }
    for &end in snapshot.broken.iter().flatten() {
        raster.drop(axes.place(snapshot.positions.get(end as usize)), PAINTING_ORDER.len() as f64);
    }
    let colours = PAINTING_ORDER.map(colour::of_role).into_iter().chain([colour::BROKEN_BOND]);
    for (path, colour) in raster.paths(PAINTING_ORDER.len() + 1, |rank| rank as usize).iter().zip(colours) {
        svg.path(path, format_args!("fill=\"{colour}\" shape-rendering=\"crispEdges\""));
    }
}
