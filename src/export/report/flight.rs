//! The report of a flight: robots, obstacles, links, and the measures of each period.

use std::path::PathBuf;

use super::super::error::ExportError;
use super::super::figures::flight_map::{moves, outline};
use super::super::{OutputFolder, flight};
use super::frames::{Channel, Frames};
use super::page::{Page, Table, file_texts, number};
use super::view::{Animation, Clock, Outline, Quantity, View};
use crate::flock::role::Role;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::swarm::Swarm;
use crate::swarm::control::Control;
use crate::swarm::flight::{Flight, FlightReport, Record, RobotReport, Verdict};

/// Bits of every quantity.
const BITS: u32 = 24;
/// Robots beyond this get no line of their own in the page's table: robots.csv has them.
const MOST_ROWS: usize = 400;

/// Keeps the frames of a flight while it goes on.
#[derive(Debug)]
pub struct FlightRecorder {
    /// Of each robot its displacement \[m\], as `dx` and `dy`, and the other quantities.
    pub(in crate::export) frames: Frames,
    /// Places from which displacements are counted \[m\].
    pub(in crate::export) start: Vectors,
    links: Vec<[u32; 2]>,
    leads: Vec<bool>,
    /// Whether it is known where each robot comes to rest.
    has_places: bool,
    /// Velocities after the last period \[m/s\], from which the next ones' accelerations follow.
    velocities: Vec<[f64; 2]>,
    /// \[s\]
    period: f64,
}

/// The quantities that frames hold besides displacements: name, label, unit.
const QUANTITIES: [(&str, &str, &str); 7] = [
    ("clearance", "clearance", "m"),
    ("away", "distance from place", "m"),
    ("speed", "speed", "m/s"),
    ("acceleration", "acceleration", "m/s²"),
    ("age", "age of the pose", "s"),
    ("pe1", "PE1", "m²"),
    ("strain", "largest strain", ""),
];
/// Those of robots whose motion is known, and not their places alone.
const OF_MOTION: [&str; 2] = ["speed", "acceleration"];

/// Distance of every robot from where the rule comes to rest with the leaders as they are \[m\]; `None` where that is
/// not known.
pub(crate) fn from_places(control: &Control, places: &Vectors) -> Option<Vec<f64>> {
    let rest = control.settled_at(places)?;
    Some(rest.iter().zip(places.iter()).map(|(rest, place)| distance(rest, place)).collect())
}

impl FlightRecorder {
    /// From the flight before its first period.
    pub fn new(flight: &Flight) -> Self {
        let places = flight.fleet().places();
        Self::since(flight.control(), &places, places.clone())
    }

    /// Robots at these places \[m\], with displacements from `start` \[m\].
    fn since(control: &Control, places: &Vectors, start: Vectors) -> Self {
        let names = ["dx", "dy"].into_iter().chain(QUANTITIES.map(|(name, ..)| name));
        let channels = names.map(|name| Channel { name, bits: BITS }).collect();
        let formation = control.formation();
        let count = formation.count();
        // Seen from both ends or from one, a line between two robots is one line.
        let mut links: Vec<[u32; 2]> = (0..count)
            .flat_map(|m| formation.neighbours(m).map(move |k| [m.min(k) as u32, m.max(k) as u32]))
            .collect();
        links.sort_unstable();
        links.dedup();
        let mut recorder = Self {
            frames: Frames::new(count, channels),
            start,
            links,
            leads: (0..count).map(|m| formation.leads(m)).collect(),
            has_places: from_places(control, places).is_some(),
            velocities: vec![[0.0; 2]; count],
            period: control.period(),
        };
        let at_rest = vec![0.0; count];
        recorder.keep(control, places, [&at_rest, &at_rest], 0, false);
        recorder
    }

    /// Looks at a period just flown, after which there may be no other: `is_last` says so of one that is not that of the file.
    pub fn watch(&mut self, flight: &Flight, is_last: bool) {
        let (fleet, period) = (flight.fleet(), flight.fleet().period());
        let velocities: Vec<[f64; 2]> = fleet.robots().iter().map(|robot| robot.velocity).collect();
        let is_last = is_last || period == flight.periods();
        if is_last || self.frames.wants(period as usize) {
            let speed: Vec<f64> = velocities.iter().map(|[x, y]| x.hypot(*y)).collect();
            let change = velocities.iter().zip(&self.velocities);
            let acceleration: Vec<f64> =
                change.map(|(&now, &before)| distance(now, before) / self.period).collect();
            self.keep(flight.control(), &fleet.places(), [&speed, &acceleration], period, is_last);
        }
        self.velocities = velocities;
    }

    fn keep(
        &mut self,
        control: &Control,
        places: &Vectors,
        [speed, acceleration]: [&[f64]; 2],
        period: u64,
        is_last: bool,
    ) {
        let count = places.len();
        let moved = places.since(&self.start);
        let mut clearance = Vec::new();
        control.filter().clearance(places, &mut clearance);
        let away = from_places(control, places).unwrap_or_else(|| vec![f64::NAN; count]);
        let age: Vec<f64> = (0..count).map(|m| control.age(m).unwrap_or(f64::NAN)).collect();
        let measures = control.formation().measures(places);
        let strain: Vec<f64> =
            measures.strain.iter().map(|strain| strain.map_or(f64::NAN, |s| s.largest())).collect();
        // In the order of the channels.
        let values =
            [&moved.x[..], &moved.y, &clearance, &away, speed, acceleration, &age, &measures.pe1, &strain];
        let (period, values) = (period as usize, |k: usize, _: &Channel| values[k].into());
        if is_last { self.frames.keep_last(period, values) } else { self.frames.keep(period, values) }
    }

    /// Label and unit of a quantity of frames.
    pub(in crate::export) fn label_and_unit(name: &str) -> Option<(&'static str, &'static str)> {
        let (_, label, unit) = QUANTITIES.into_iter().find(|(known, ..)| *known == name)?;
        Some((label, unit))
    }

    /// Time of a frame \[s\].
    pub(in crate::export) fn time(&self, frame: usize) -> f64 {
        self.frames.kept[frame].step as f64 * self.period
    }

    /// The animation of the flight.
    pub fn stage(&mut self, swarm: &Swarm, report: &FlightReport) -> View {
        let names = report.per_robot.iter().map(|robot| robot.name.clone()).collect();
        let mut stage = self.begun(swarm, names, true);
        let robots = || report.per_robot.iter();
        stage.add_exact(Quantity::new("x", "x", "m"), robots().map(|robot| robot.x));
        stage.add_exact(Quantity::new("y", "y", "m"), robots().map(|robot| robot.y));
        stage.add_exact(Quantity::new("way", "way", "m"), robots().map(|robot| robot.way));
        let least = robots().map(|robot| robot.clearance.unwrap_or(f64::NAN));
        stage.add_exact(Quantity::new("least_clearance", "least clearance", "m"), least);
        self.finished(stage)
    }

    /// Robots at these places \[m\], in a single frame, of motions that are known or not; displacements are from their
    /// nominal places.
    #[cfg(feature = "live")]
    pub(crate) fn still(swarm: &Swarm, control: &Control, places: &Vectors, flies: bool) -> View {
        let formation = control.formation();
        let mut recorder = Self::since(control, places, formation.places.clone());
        let stage = recorder.begun(swarm, formation.names.clone(), flies);
        recorder.finished(stage)
    }

    /// The view without its frames, of robots whose motion is known or whose places alone are.
    fn begun(&self, swarm: &Swarm, names: Vec<String>, flies: bool) -> View {
        let is_known = |name: &str| match name {
            "away" => self.has_places,
            _ => flies || !OF_MOTION.contains(&name),
        };
        let known = QUANTITIES.into_iter().filter(|(name, ..)| is_known(name));
        let quantities = known.map(|(name, label, unit)| Quantity::new(name, label, unit)).collect();
        let mut stage = View::new(Animation { quantities, ..animation(swarm, names) });
        stage.set_reference(&self.start);
        let role = |&leads: &bool| if leads { Role::Leader } else { Role::Follower };
        stage.set_roles(&self.leads.iter().map(role).collect::<Vec<_>>(), &[]);
        if !self.links.is_empty() {
            let none = self.links.iter().map(|_| 0);
            stage.set_bonds(&self.links, none.clone(), none);
        }
        stage
    }

    fn finished(&mut self, mut stage: View) -> View {
        let period = self.period;
        stage.set_frames(&mut self.frames, |step| step as f64 * period);
        stage
    }
}

fn animation(swarm: &Swarm, names: Vec<String>) -> Animation {
    let own = |m: usize| swarm.raw.robots.get(m).and_then(|robot| robot.radius).unwrap_or(swarm.raw.radius);
    let obstacles = swarm.raw.obstacles.iter().enumerate().map(|(k, obstacle)| Outline {
        kind: "obstacle",
        corners: outline(obstacle),
        moves: moves(swarm, k).collect(),
    });
    let still = |fence: &Vec<[f64; 2]>| Outline { kind: "fence", corners: fence.clone(), moves: Vec::new() };
    let fence = swarm.raw.limits.geofence.iter().map(still);
    Animation {
        noun: "robot",
        unit: "m".into(),
        clock: Clock { quantity: "time", unit: "s" },
        spacing: 2.0 * swarm.raw.radius,
        radii: (0..names.len()).map(own).collect(),
        names,
        outlines: obstacles.chain(fence).collect(),
        ..Animation::default()
    }
}

/// Writes `report.html`.
///
/// # Errors
/// The file cannot be written.
pub fn write(
    folder: &OutputFolder,
    swarm: &Swarm,
    record: &Record,
    report: &FlightReport,
    stage: View,
) -> Result<PathBuf, ExportError> {
    let mut plots = flight::charts(record, report);
    for plot in &mut plots {
        plot.follows_clock = true;
        // As a figure the chart bears the flight's title; the page has that already.
        if plot.title == report.title {
            plot.title.clone_from(&plot.y.quantity);
        }
    }
    let broken = report.bounds.iter().filter(|verdict| !verdict.holds).count();
    let verdict = match (report.bounds.len(), broken) {
        (0, _) => None,
        (declared, 0) => Some((true, format!("all {declared} declared bounds held"))),
        (declared, broken) => Some((false, format!("{broken} of {declared} declared bounds broken"))),
    };
    let page = Page {
        title: swarm.raw.title.clone(),
        command: format!("flockform swarm {}", swarm.name),
        verdict,
        moments: moments(report),
        note: note(&stage.animation, report),
        stages: vec![stage],
        plots,
        facts: facts(report),
        tables: tables(report),
        texts: file_texts(["swarm", "Swarm"], &swarm.raw.notes, &swarm.raw),
        ..Page::default()
    };
    page.write(folder)
}

/// The moments at which bounds were broken and robots came closest.
fn moments(report: &FlightReport) -> Vec<(String, f64)> {
    let broken =
        report.bounds.iter().filter_map(|verdict| Some((verdict.complaint()?, verdict.worst.as_ref()?.time)));
    broken.collect()
}

fn note(animation: &Animation, report: &FlightReport) -> String {
    let shown = animation.times.len();
    let all = if shown as u64 > report.periods { "all".to_owned() } else { format!("{shown} of them are") };
    format!(
        "{} periods flown, {all} shown. Lines join neighbours at the start. At the last frame places, ways and \
         least clearances are those of robots.csv, as far as their digits are shown.",
        report.periods
    )
}

fn facts(report: &FlightReport) -> Vec<(&'static str, String)> {
    let robots = format!("{} ({}), {} of them lead", report.robots, report.model, report.leaders);
    let first = [("Robots", robots), ("Flown", format!("{} s", number(report.seconds)))];
    first.into_iter().chain(report.facts(number)).collect()
}

fn tables(report: &FlightReport) -> Vec<Table> {
    let mut tables = Vec::new();
    if !report.bounds.is_empty() {
        let row = |v: &Verdict| {
            let found = v.found.map_or_else(|| "not measured".into(), number);
            let word = if v.holds { "holds" } else { "broken" };
            vec![v.bound.to_owned(), number(v.declared), found, word.into()]
        };
        let head = ["bound", "declared", "found", ""];
        tables.push(Table::new("Declared bounds", &head, report.bounds.iter().map(row)));
    }
    let row = |robot: &RobotReport| {
        vec![
            robot.name.clone(),
            robot.role.to_owned(),
            number(robot.x),
            number(robot.y),
            number(robot.way),
            robot.clearance.map_or_else(String::new, number),
            robot.accepted.to_string(),
            robot.rejected.to_string(),
            robot.health.into(),
        ]
    };
    let rows = report.per_robot.iter().take(MOST_ROWS).map(row);
    let caption = match report.robots.saturating_sub(rows.len()) {
        0 => "Robots at the end".to_owned(),
        more => format!("Robots at the end ({more} more in robots.csv)"),
    };
    let names = [
        "name",
        "role",
        "x [m]",
        "y [m]",
        "way [m]",
        "least clearance [m]",
        "poses accepted",
        "rejected",
        "health",
    ];
    tables.push(Table::new(&caption, &names, rows));
    tables
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::bundled::bundled_swarm;

    #[test]
    fn no_robot_has_a_distance_from_a_place_that_is_not_known_and_a_flight_that_ends_early_has_its_end() {
        let dead = r#"flight.faults=[{ robot = "robot_1", at = 0.5, what = { kind = "dead" } }]"#;
        let swarm = bundled_swarm("square").expect("bundled").load_swarm(&[dead.into()]).expect("valid");
        let mut flight = Flight::new(&swarm).expect("flies");
        let mut recorder = FlightRecorder::new(&flight);
        recorder.frames.halve();
        for period in 1..=63 {
            flight.step();
            recorder.watch(&flight, period == 63);
        }
        let last = recorder.frames.kept.len() - 1;
        assert_eq!(recorder.frames.kept[last].step, 63);
        assert_eq!(flight.control().settled(), None, "a leader is lost");
        let away = |frame: usize| recorder.frames.values(frame, "away").expect("known");
        assert!(away(1).iter().all(|away| away.is_finite()));
        assert!(away(last).iter().all(|away| away.is_nan()), "{:?}", away(last));
    }

    #[test]
    fn a_quantity_of_a_frame_is_found_by_its_name() {
        let swarm = bundled_swarm("square").expect("bundled").load_swarm(&[]).expect("valid");
        let mut flight = Flight::new(&swarm).expect("flies");
        let mut recorder = FlightRecorder::new(&flight);
        for _ in 0..64 {
            flight.step();
            recorder.watch(&flight, false);
        }
        let last = recorder.frames.kept.len() - 1;
        assert_eq!(recorder.frames.kept[last].step as u64, flight.periods().min(64));
        let (control, places) = (flight.control(), flight.fleet().places());
        let mut clearance = Vec::new();
        control.filter().clearance(&places, &mut clearance);
        let robots = flight.fleet().robots().iter();
        let speed: Vec<f64> = robots.map(|robot| robot.velocity[0].hypot(robot.velocity[1])).collect();
        let measures = control.formation().measures(&places);
        for (name, expected) in [("clearance", &clearance), ("speed", &speed), ("pe1", &measures.pe1)] {
            let values = recorder.frames.values(last, name).expect("known");
            let largest = expected.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            assert!(largest > 0.0, "{name}");
            let off = values.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off <= 1e-6 * largest, "{name}: {off} of {largest}");
        }
        assert_eq!(recorder.frames.values(last, "von-mises"), None);
    }
}
