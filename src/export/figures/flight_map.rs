//! A flight on a map: the robots' ways, where they began and where they ended, what stood in the way.

use super::axes::Axes;
use super::colour;
use super::heading::{Heading, Key, Mark};
use super::page;
use super::svg::{Path, Svg};
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawCommandKind, RawObstacle};
use crate::swarm::flight::{FlightReport, Record};

const OBSTACLE: &str = "#6b7078";
const START: &str = "#a9b0ba";
const WAY: &str = "#7fa6dc";
const LED_WAY: &str = "#f0a09c";
/// Ways of more robots than this would cover each other.
const MOST_WAYS: usize = 400;
/// Corners of the polygon that stands for a disc.
const ROUND: usize = 48;

pub fn flight(swarm: &Swarm, record: &Record, report: &FlightReport) -> String {
    let (Some(first), Some(last)) = (record.tracks.first(), record.tracks.last()) else {
        return String::new();
    };
    let leads = |m: usize| report.per_robot[m].role != Role::Follower.name();
    let count = first.len();
    let obstacles = (0..swarm.raw.obstacles.len()).flat_map(|k| {
        let [first, last] = ends(swarm, k);
        first.into_iter().chain(last)
    });
    let shown: Vectors = record.tracks.iter().flat_map(|places| places.iter()).chain(obstacles).collect();
    let axes = page::window(&shown, 0..shown.len(), 3.0 * swarm.raw.radius);
    let key = |name: &'static str, colour, mark| Key { name: name.into(), colour, mark };
    let mut legend = vec![
        key("leader", colour::of_role(Role::Leader), Mark::Dot),
        key("follower", colour::of_role(Role::Follower), Mark::Dot),
        key("start", START, Mark::Ring),
    ];
    if !swarm.raw.obstacles.is_empty() {
        legend.push(key("obstacle", OBSTACLE, Mark::Dot));
    }
    let note = format!("{} robots, {:.1} s", report.robots, report.seconds);
    let heading = Heading { title: report.title.clone(), note, legend };
    page::with_body(&heading, axes, "m", 20.0, |svg, axes| {
        let radius = (swarm.raw.radius * axes.scale()).clamp(1.2, 12.0);
        draw_obstacles(svg, axes, swarm);
        if count <= MOST_WAYS {
            for (led, colour) in [(false, WAY), (true, LED_WAY)] {
                let mut ways = Path::default();
                for m in (0..count).filter(|&m| leads(m) == led) {
                    let way: Vec<[f64; 2]> =
                        record.tracks.iter().map(|places| axes.place(places.get(m))).collect();
                    ways.polyline(simplified(&way));
                }
                svg.path(
                    &ways,
                    format_args!("class=\"way\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"0.9\""),
                );
            }
        }
        svg.group(format_args!("class=\"start\" fill=\"none\" stroke=\"{START}\""), |svg| {
            first.iter().for_each(|place| svg.circle(axes.place(place), radius));
        });
        for (led, role) in [(false, Role::Follower), (true, Role::Leader)] {
            svg.group(format_args!("class=\"{}\" fill=\"{}\"", role.name(), colour::of_role(role)), |svg| {
                for m in (0..count).filter(|&m| leads(m) == led) {
                    svg.circle(axes.place(last.get(m)), radius);
                }
            });
        }
    })
}

fn draw_obstacles(svg: &mut Svg, axes: &Axes, swarm: &Swarm) {
    let polygon = |corners: &[[f64; 2]]| {
        let mut path = Path::default();
        path.polygon(corners.iter().map(|&corner| axes.place(corner)));
        path
    };
    for k in 0..swarm.raw.obstacles.len() {
        let [first, last] = ends(swarm, k);
        if first != last {
            let stroke = format!("stroke=\"{START}\"");
            svg.path(&polygon(&first), format_args!("class=\"start\" fill=\"none\" {stroke}"));
        }
        svg.path(&polygon(&last), format_args!("class=\"obstacle\" fill=\"{OBSTACLE}\""));
    }
    if let Some(fence) = &swarm.raw.limits.geofence {
        let stroke = format!("stroke=\"{OBSTACLE}\" stroke-dasharray=\"6 4\"");
        svg.path(&polygon(fence), format_args!("class=\"fence\" fill=\"none\" {stroke}"));
    }
}

/// Outlines of an obstacle where it begins and where it is moved to in the end.
fn ends(swarm: &Swarm, obstacle: usize) -> [Vec<[f64; 2]>; 2] {
    let first = outline(&swarm.raw.obstacles[obstacle]);
    let [_, x, y] = moves(swarm, obstacle).last().unwrap_or_default();
    let last = first.iter().map(|[px, py]| [px + x, py + y]).collect();
    [first, last]
}

/// When an obstacle is moved \[s\], and how far from its place in the file along x and y \[m\].
pub(in super::super) fn moves(swarm: &Swarm, obstacle: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
    swarm.raw.flight.commands.iter().filter_map(move |command| match command.what {
        RawCommandKind::MoveObstacle { obstacle: one, by: [x, y] } if one == obstacle => {
            Some([command.after as f64 * swarm.raw.control.period, x, y])
        }
        _ => None,
    })
}

pub(in super::super) fn outline(obstacle: &RawObstacle) -> Vec<[f64; 2]> {
    match obstacle {
        RawObstacle::Polygon { vertices } => vertices.clone(),
        RawObstacle::Disc { centre, radius } => (0..ROUND)
            .map(|k| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / ROUND as f64).sin_cos();
                [centre[0] + radius * cos, centre[1] + radius * sin]
            })
            .collect(),
    }
}

/// Of a way in pixels, the points that are half a pixel or more from the one before.
fn simplified(way: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for (n, &point) in way.iter().enumerate() {
        let far = kept.last().is_none_or(|last| (point[0] - last[0]).hypot(point[1] - last[1]) >= 0.5);
        if far || n + 1 == way.len() {
            kept.push(point);
        }
    }
    kept
}
