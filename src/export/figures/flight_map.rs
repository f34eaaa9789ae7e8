//! A flight on a map: the robots' ways, where they began and where they ended, what stood in the way.

use super::axes::Axes;
use super::bands::Field;
use super::colour;
use super::configuration::mark_of;
use super::heading::{DIAMOND, Heading, Key, Mark, draw_mark};
use super::page::{self, Bounds};
use super::svg::{Path, Svg};
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawCommandKind, RawObstacle};
use crate::scene::text::counted;
use crate::swarm::flight::{FlightReport, Record};

const OBSTACLE: &str = "#6b7078";
const START: &str = "#a9b0ba";
const WAY: &str = "#7fa6dc";
const LED_WAY: &str = "#f0a09c";
/// Ways of more robots than this would cover each other.
const MOST_WAYS: usize = 400;
/// Places along a side of the fence that are looked for in the window.
const STOPS: u32 = 256;
/// Corners of the polygon that stands for a disc.
const ROUND: usize = 48;

/// The whole flight.
pub fn flight(swarm: &Swarm, record: &Record, report: &FlightReport) -> String {
    let Some(last) = record.tracks.last() else { return String::new() };
    let seconds = (1e3 * report.seconds).round() / 1e3;
    let note = format!("{}, {seconds} s", counted(report.robots, "robot"));
    let moment = Moment { flown: record.tracks.len(), places: last, note, field: None };
    Map::new(swarm, record, report, page::around).draw(&moment)
}

/// The map of a flight, which shows all of it at any of its times.
pub struct Map<'a> {
    swarm: &'a Swarm,
    record: &'a Record,
    report: &'a FlightReport,
    axes: Axes,
}

/// A time of a flight.
pub struct Moment<'a> {
    /// How many of the recorded places lie before it.
    pub flown: usize,
    /// Of the robots \[m\].
    pub places: &'a Vectors,
    /// The subtitle.
    pub note: String,
    /// Colours of the robots; those of their roles where there is none.
    pub field: Option<Field<'a>>,
}

impl<'a> Map<'a> {
    /// In the window that `around` makes of the bounds of everything.
    pub fn new(
        swarm: &'a Swarm,
        record: &'a Record,
        report: &'a FlightReport,
        around: impl FnOnce(Option<Bounds>, f64) -> Axes,
    ) -> Self {
        let obstacles = (0..swarm.raw.obstacles.len()).flat_map(|k| {
            let [first, last] = outlines(swarm, k, f64::INFINITY);
            first.into_iter().chain(last)
        });
        let shown: Vectors = record.tracks.iter().flat_map(|places| places.iter()).chain(obstacles).collect();
        let own = swarm.raw.robots.iter().filter_map(|robot| robot.radius);
        let axes = around(page::bounds(&shown, 0..shown.len()), 3.0 * own.fold(swarm.raw.radius, f64::max));
        Self { swarm, record, report, axes }
    }

    /// When a moment is \[s\].
    fn time_of(&self, moment: &Moment<'_>) -> f64 {
        let last = moment.flown.checked_sub(1).and_then(|before| self.record.times.get(before));
        last.copied().unwrap_or(0.0)
    }

    fn leads(&self, robot: usize) -> bool {
        self.report.per_robot[robot].role != Role::Follower.name()
    }

    pub fn draw(&self, moment: &Moment<'_>) -> String {
        let legend = self.legend(moment.field.is_some());
        let (title, note) = (self.report.title.clone(), moment.note.clone());
        let heading = Heading { title, note, legend, ..Heading::default() };
        let beside = moment.field.map_or(20.0, |field| field.bands.bar_room());
        page::with_body(&heading, self.axes.clone(), "m", beside, |svg, axes| {
            draw_obstacles(svg, axes, self.swarm, self.time_of(moment));
            self.draw_ways(svg, axes, moment);
            svg.group(format_args!("class=\"start\" fill=\"none\" stroke=\"{START}\""), |svg| {
                let first = self.record.tracks.first().into_iter().flat_map(|places| places.iter());
                first.enumerate().for_each(|(m, place)| svg.circle(axes.place(place), self.radius(axes, m)));
            });
            self.draw_robots(svg, axes, moment);
            if let Some(field) = &moment.field {
                field.bands.draw_bar(svg, axes);
            }
        })
    }

    fn legend(&self, is_field: bool) -> Vec<Key> {
        let [leader, follower] = [Role::Leader, Role::Follower].map(colour::of_role);
        let mut legend = vec![Key::new("leader", leader, mark_of(Role::Leader))];
        if !is_field && (0..self.report.per_robot.len()).any(|m| !self.leads(m)) {
            legend.push(Key::new("follower", follower, Mark::Dot));
        }
        legend.push(Key::new("start", START, Mark::Ring));
        if !self.swarm.raw.obstacles.is_empty() {
            legend.push(Key::new("obstacle", OBSTACLE, Mark::Dot));
        }
        if self.swarm.raw.limits.geofence.as_ref().is_some_and(|fence| self.shows(fence)) {
            legend.push(Key::new("fence", OBSTACLE, Mark::DashedLine));
        }
        legend
    }

    /// Whether any of a polygon's sides passes through the window.
    fn shows(&self, corners: &[[f64; 2]]) -> bool {
        let Axes { low, high, .. } = &self.axes;
        let is_shown = |[x, y]: [f64; 2]| x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1];
        let sides = corners.iter().zip(corners.iter().cycle().skip(1));
        let along = |([ax, ay], [bx, by]): (&[f64; 2], &[f64; 2])| {
            let at = |part: f64| [ax + part * (bx - ax), ay + part * (by - ay)];
            (0..=STOPS).any(|k| is_shown(at(f64::from(k) / f64::from(STOPS))))
        };
        { sides }.any(along)
    }

    fn draw_ways(&self, svg: &mut Svg, axes: &Axes, moment: &Moment<'_>) {
        let count = moment.places.len();
        if count > MOST_WAYS {
            return;
        }
        for (led, colour) in [(false, WAY), (true, LED_WAY)] {
            let mut ways = Path::default();
            for m in (0..count).filter(|&m| self.leads(m) == led) {
                let flown = self.record.tracks.iter().take(moment.flown).chain([moment.places]);
                let way: Vec<[f64; 2]> = flown.map(|places| axes.place(places.get(m))).collect();
                ways.polyline(simplified(&way));
            }
            svg.path(
                &ways,
                format_args!("class=\"way\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"0.9\""),
            );
        }
    }

    /// Radius of a robot's mark \[px\]: to scale, but never too small to be seen; where the file gives all robots one
    /// radius, also never so large that the marks hide the ways.
    fn radius(&self, axes: &Axes, robot: usize) -> f64 {
        let raw = &self.swarm.raw;
        let own = raw.robots.get(robot).and_then(|robot| robot.radius).unwrap_or(raw.radius);
        let most = if raw.robots.iter().any(|robot| robot.radius.is_some()) { f64::INFINITY } else { 12.0 };
        (own * axes.scale()).clamp(1.2, most)
    }

    fn draw_robots(&self, svg: &mut Svg, axes: &Axes, moment: &Moment<'_>) {
        for (led, role) in [(false, Role::Follower), (true, Role::Leader)] {
            let (own, mark) = (colour::of_role(role), mark_of(role));
            if led {
                // A diamond has its corners on the rim, which would leave a leader smaller than a follower.
                svg.group(format_args!("class=\"hull\" fill=\"{LED_WAY}\""), |svg| {
                    for m in (0..moment.places.len()).filter(|&m| self.leads(m)) {
                        svg.circle(axes.place(moment.places.get(m)), self.radius(axes, m));
                    }
                });
            }
            svg.group(format_args!("class=\"{}\" fill=\"{own}\"", role.name()), |svg| {
                for m in (0..moment.places.len()).filter(|&m| self.leads(m) == led) {
                    let at = axes.place(moment.places.get(m));
                    let radius = self.radius(axes, m) / if led { DIAMOND } else { 1.0 };
                    match &moment.field {
                        None => draw_mark(svg, mark, at, radius),
                        Some(field) => {
                            let rim = if led { own } else { "none" };
                            let width = 0.35 * radius;
                            let rim = format!("stroke=\"{rim}\" stroke-width=\"{width:.2}\"");
                            let colour = field.colour(field.band(m));
                            let attributes = format!("fill=\"{colour}\" {rim}");
                            svg.group(attributes, |svg| draw_mark(svg, mark, at, radius));
                        }
                    }
                }
            });
        }
    }
}

fn draw_obstacles(svg: &mut Svg, axes: &Axes, swarm: &Swarm, now: f64) {
    let polygon = |corners: &[[f64; 2]]| {
        let mut path = Path::default();
        path.polygon(corners.iter().map(|&corner| axes.place(corner)));
        path
    };
    for k in 0..swarm.raw.obstacles.len() {
        let [first, last] = outlines(swarm, k, now);
        if first != last {
            let stroke = format!("stroke=\"{START}\"");
            svg.path(&polygon(&first), format_args!("class=\"start\" fill=\"none\" {stroke}"));
        }
        svg.path(&polygon(&last), format_args!("class=\"obstacle\" fill=\"{OBSTACLE}\""));
    }
    if let Some(fence) = &swarm.raw.limits.geofence {
        let stroke = format!("stroke=\"{OBSTACLE}\" stroke-dasharray=\"6 4\"");
        svg.clipped("plot", axes.corner, axes.size, |svg| {
            svg.path(&polygon(fence), format_args!("class=\"fence\" fill=\"none\" {stroke}"));
        });
    }
}

/// Outlines of an obstacle where it begins and where it has been moved to by then \[s\].
fn outlines(swarm: &Swarm, obstacle: usize, now: f64) -> [Vec<[f64; 2]>; 2] {
    let first = outline(&swarm.raw.obstacles[obstacle]);
    let [_, x, y] = moves(swarm, obstacle).take_while(|[at, ..]| *at <= now).last().unwrap_or_default();
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
