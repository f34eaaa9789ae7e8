//! Flies a recorded flight again: its poses through today's loop, today's targets beside the recorded ones.
//!
//! A recording of this program has the loop's ticks and the commands it took, so that the same program gives the
//! same targets to the bit. One that `ros2 bag record` has written of poses and targets alone is replayed as far as
//! it goes: a tick is taken to be where a new stamp of targets appears.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::file::TAKEN_OVER;
use super::topics::{Heard, of_robots, stamped, topics};
use super::{Entry, Reader, RecordError};
use crate::flock::vectors::distance;
use crate::messages::builtin_interfaces::Time;
use crate::messages::flockform_msgs::{LoopEvent, Ranges, SetFormationRequest};
use crate::messages::formation::leaders::requested;
use crate::messages::formation::{NAME, pose, ranges};
use crate::messages::geometry_msgs::{self, PoseArray, PoseStamped};
use crate::messages::names::Names;
use crate::messages::recorder::{parameters, set_parameter};
use crate::messages::std_msgs::Header;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawCommand;
use crate::swarm::control::scope::NodeScope;
use crate::swarm::control::{Control, ControlSnapshot};
use crate::swarm::flight::commands;
use crate::swarm::watch::Range;

/// How a replay went.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Report {
    /// The file that was replayed.
    pub recording: PathBuf,
    /// Short name of the swarm.
    pub swarm: String,
    /// Periods replayed.
    pub ticks: u64,
    /// Poses of the swarm's robots that were replayed.
    pub poses: u64,
    /// Differences beyond this count \[m\].
    pub tolerance: f64,
    /// In the order of the swarm file.
    pub robots: Vec<RobotDifference>,
    /// The defect of the file's end, if it has one.
    pub damage: Option<String>,
}

/// Of one robot; distances in \[m\], times as recorded in \[s\].
#[derive(Clone, Debug, Default, Serialize, PartialEq)]
pub struct RobotDifference {
    /// Name of the robot.
    pub name: String,
    /// Targets recorded.
    pub recorded: u64,
    /// Targets of which recording and replay differ by more than the tolerance.
    pub differ: u64,
    /// Targets that only the recording has.
    pub only_recorded: u64,
    /// Targets that only the replay has.
    pub only_replayed: u64,
    /// Largest distance of a recorded target from the replayed one.
    pub largest: f64,
    /// When the difference was largest.
    pub largest_at: Option<f64>,
    /// When it was first beyond the tolerance.
    pub first_at: Option<f64>,
}

impl RobotDifference {
    fn holds(&self) -> bool {
        self.differ == 0 && self.only_recorded == 0 && self.only_replayed == 0
    }
}

impl Report {
    /// Whether no target is farther off than the tolerance, and none is missing; of a file that breaks off, as far as it goes.
    pub fn holds(&self) -> bool {
        self.robots.iter().all(RobotDifference::holds)
    }

    /// Whether all that was recorded has been read: a file that breaks off may have had more.
    pub fn is_whole(&self) -> bool {
        self.damage.is_none()
    }

    /// The largest difference of all \[m\].
    pub fn largest(&self) -> f64 {
        self.robots.iter().map(|robot| robot.largest).fold(0.0, f64::max)
    }
}

/// The swarm that a recording carries, with `set` over its own overrides.
///
/// # Errors
/// A recording without a swarm; what the overrides make of it.
pub fn recorded_swarm(reader: &Reader, set: &[String]) -> Result<Swarm, RecordError> {
    let described = reader.described();
    let nameless = || {
        reader.refused(
            " does not say which swarm flew\n  help: name the swarm file with --swarm; only flockform's own recordings of a \
             swarm carry it (those of a body are for viewers: `flockform run` makes the run again)",
        )
    };
    let text = described.swarm.ok_or_else(nameless)?;
    let of = |key: &str| described.metadata.get(key).cloned();
    let given: Vec<String> = of("set").and_then(|set| serde_json::from_str(&set).ok()).unwrap_or_default();
    let (name, folder) = (of("name").unwrap_or_default(), of("folder").map(PathBuf::from));
    let file = format!("{}: {}", reader.path().display(), super::file::SWARM);
    let overrides = [&given[..], set].concat();
    Ok(Swarm::parse(&name, &file, &text, &overrides, folder.as_deref())?)
}

/// Replays a recording with this swarm.
///
/// # Errors
/// A recording of other topics than this swarm's, or of a loop that was not at work.
pub fn replay(reader: &Reader, swarm: &Swarm, tolerance: f64) -> Result<Report, RecordError> {
    let mut replay = Replay::new(reader, swarm, tolerance)?;
    let damage = reader.each(&mut |entry| replay.see(entry));
    if damage.is_none() {
        // Of a file that breaks off, the last tick may not be whole.
        replay.compare();
    }
    let unusable = |what: &str, help: &str| Err(reader.refused(&format!(": {what}\n  help: {help}")));
    if let Some(refusal) = replay.refusal {
        return unusable(&refusal, "give the swarm file that was flown with --swarm");
    }
    let help = if replay.has_topics {
        "its topics are this swarm's, but the loop was not at work: record it for longer"
    } else {
        "its topics are not those that the swarm file's [node] names; give another --swarm, or --set node.pose_topic=..."
    };
    let has_targets = replay.robots.iter().any(|robot| robot.recorded > 0);
    // A loop at work that gets no pose, or believes none, sends no target.
    if !(replay.has_topics && replay.ticks > 0) {
        if replay.poses == 0 {
            return unusable("it has no poses of this swarm's robots", help);
        }
        if !has_targets {
            return unusable("it has no targets of this swarm's robots", help);
        }
    }
    Ok(Report {
        recording: reader.path().to_owned(),
        swarm: swarm.name.clone(),
        ticks: replay.ticks,
        poses: replay.poses,
        tolerance,
        robots: replay.robots,
        damage,
    })
}

struct Replay {
    control: Control,
    /// The loop before its first tick.
    fresh: Control,
    /// The state of the process before, which the loop takes over before its first tick.
    taken_over: Option<ControlSnapshot>,
    /// The parameters that the file and the overrides of the recording gave.
    as_recorded: Vec<(&'static str, f64)>,
    topics: BTreeMap<String, Heard>,
    /// Whether the loop that was recorded had the same topics, with messages or without.
    has_topics: bool,
    frame_id: String,
    heard_of: Vec<usize>,
    numbers: ranges::Numbers,
    mine: Vec<bool>,
    tolerance: f64,
    has_events: bool,
    /// Whether the robots were: their time begins at 0, which says of a real one that it has none.
    is_simulated: bool,
    /// Commands from outside in the file of a simulated flight, by ascending period.
    commands: Vec<RawCommand>,
    active: bool,
    begun: bool,
    /// Poses since the last tick: member, header, pose, arrival \[s\].
    waiting: Vec<(usize, Header, geometry_msgs::Pose, f64)>,
    /// Ranges since the last tick: observer, message, arrival \[s\].
    measured: Vec<(usize, Ranges, f64)>,
    /// Times of ticks by what a stamp makes of them: a simulation's times are finer than nanoseconds.
    exact: BTreeMap<Time, f64>,
    now: f64,
    ticks: u64,
    poses: u64,
    /// Targets of the last tick, today's and recorded.
    today: Vec<Option<[f64; 2]>>,
    recorded: Vec<Option<[f64; 2]>>,
    stamp: Option<Time>,
    robots: Vec<RobotDifference>,
    refusal: Option<String>,
}

impl Replay {
    fn new(reader: &Reader, swarm: &Swarm, tolerance: f64) -> Result<Self, RecordError> {
        let described = reader.described();
        let mut control = Control::new(swarm)?;
        let flown = described.swarm.as_ref().map(|_| recorded_swarm(reader, &[])).transpose()?;
        let before = flown.as_ref().map_or_else(|| Ok(control.clone()), Control::new)?;
        let count = control.formation().count();
        let member = described.metadata.get("member").and_then(|name| control.formation().number(name));
        let heard_of = NodeScope::restrict(swarm, &mut control, member).heard;
        control.set_active(false);
        let fleet = described.metadata.get("namespace").map_or("/", String::as_str);
        let mut names = Names::new(NAME, fleet, &[])?;
        if let Some(member) = described.metadata.get("member") {
            names = names.of_robot(member)?;
        }
        let (topics, has_events) = topics(reader, swarm, &control, &names)?;
        let has_topics = match &flown {
            Some(flown) => of_robots(flown, &before, &names)?.keys().all(|topic| topics.contains_key(topic)),
            None => false,
        };
        let taken_over =
            described.metadata.get(TAKEN_OVER).map(|text| taken_over(reader, text)).transpose()?;
        let is_simulated = described.metadata.get("source").is_some_and(|source| source == "swarm");
        let commands = if is_simulated { swarm.raw.flight.commands.clone() } else { Vec::new() };
        if is_simulated {
            commands::check(swarm, &control)?;
        }
        let robot = |name: &String| RobotDifference { name: name.clone(), ..RobotDifference::default() };
        Ok(Self {
            as_recorded: parameters(&before).to_vec(),
            robots: control.formation().names.iter().map(robot).collect(),
            mine: (0..count).map(|m| member.is_none_or(|one| one == m)).collect(),
            numbers: ranges::numbers(&control.formation().names),
            frame_id: swarm.raw.node.frame_id.clone(),
            active: !has_events,
            today: vec![None; count],
            recorded: vec![None; count],
            fresh: control.clone(),
            taken_over,
            control,
            topics,
            has_topics,
            heard_of,
            tolerance,
            has_events,
            is_simulated,
            commands,
            begun: false,
            waiting: Vec::new(),
            measured: Vec::new(),
            exact: BTreeMap::new(),
            now: 0.0,
            ticks: 0,
            poses: 0,
            stamp: None,
            refusal: None,
        })
    }

    /// Ticks where the targets of a recording without the loop's events are the first of a period.
    fn tick_of_targets(&mut self, header: &Header) {
        if !self.has_events && self.stamp != Some(header.stamp) {
            self.stamp = Some(header.stamp);
            self.tick(header.stamp.seconds());
        }
    }

    fn see(&mut self, entry: &Entry) {
        match self.topics.get(&*entry.topic) {
            None => {}
            Some(Heard::Events) => {
                if let Some(event) = entry.decode() {
                    self.event(&event);
                }
            }
            Some(&Heard::Pose(member)) => {
                if let Some((header, pose)) = stamped(entry) {
                    self.waiting.push((member, header, pose, entry.published));
                }
            }
            Some(Heard::Poses) => {
                let Some(PoseArray { header, poses }) = entry.decode() else { return };
                if poses.len() == self.recorded.len() {
                    for &member in self.heard_of.iter().filter(|&&member| !poses[member].is_nowhere()) {
                        self.waiting.push((member, header.clone(), poses[member], entry.published));
                    }
                }
            }
            Some(&Heard::Ranges(observer)) => {
                if let Some(message) = entry.decode::<Ranges>() {
                    self.measured.push((observer, message, entry.published));
                }
            }
            Some(&Heard::Leader(member)) => {
                let Some(PoseStamped { header, pose: place }) = entry.decode() else { return };
                if pose::is_frame(&header.frame_id, &self.frame_id) {
                    self.control.place_leader(member, [place.position.x, place.position.y]);
                }
            }
            Some(&Heard::Target(member)) => {
                let Some(PoseStamped { header, pose }) = entry.decode() else { return };
                self.tick_of_targets(&header);
                self.recorded[member] = Some([pose.position.x, pose.position.y]);
            }
            Some(Heard::Targets) => {
                let Some(PoseArray { header, poses }) = entry.decode() else { return };
                self.tick_of_targets(&header);
                for (recorded, pose) in self.recorded.iter_mut().zip(&poses) {
                    let place = [pose.position.x, pose.position.y];
                    // Of a robot that is sent nowhere it is no number.
                    if place.iter().all(|x| x.is_finite()) {
                        *recorded = Some(place);
                    }
                }
            }
        }
    }

    fn event(&mut self, event: &LoopEvent) {
        let text = &event.text;
        let commands =
            [LoopEvent::EMERGENCY_STOP, LoopEvent::RESUME, LoopEvent::MANOEUVRE, LoopEvent::POSTURE];
        if commands.contains(&event.kind) {
            self.take_over();
        }
        match (event.kind, &event.values[..]) {
            (LoopEvent::TICK, &[now]) => self.tick(now),
            (LoopEvent::ACTIVE | LoopEvent::INACTIVE, _) => {
                self.active = event.kind == LoopEvent::ACTIVE;
                self.control.set_active(self.active);
            }
            (LoopEvent::EMERGENCY_STOP, _) => self.control.emergency_stop(),
            (LoopEvent::RESUME, _) => {
                self.control.resume();
            }
            (LoopEvent::MANOEUVRE, _) => {
                let request = SetFormationRequest { name: text.clone(), ..SetFormationRequest::default() };
                self.move_leaders(&request);
            }
            (LoopEvent::POSTURE, &[tx, ty, rotate, sx, sy, hx, hy, duration]) => {
                let (translate, stretch, shear) = ([tx, ty], [sx, sy], [hx, hy]);
                let name = String::new();
                self.move_leaders(&SetFormationRequest { name, translate, rotate, stretch, shear, duration });
            }
            (LoopEvent::PARAMETER, &[value]) => self.parameter(text, value),
            (LoopEvent::CONFIGURE, _) => self.begin_anew(),
            _ => {}
        }
    }

    /// Goes on from the state of an earlier loop, as the node does before anything is asked of it.
    fn take_over(&mut self) {
        if let Some(state) = self.taken_over.take() {
            self.control.restore(state);
        }
    }

    /// As the node does in its transition `configure`.
    fn begin_anew(&mut self) {
        self.control.begin_anew(&self.fresh);
        self.control.set_active(self.active);
        // The parameters that follow are those of a start.
        self.begun = false;
    }

    /// Settings given at the start give way to those changed since the flight; what was changed during it is changed again.
    fn parameter(&mut self, name: &str, value: f64) {
        let of = |all: &[(&str, f64)]| all.iter().find(|(one, _)| *one == name).map(|(_, value)| *value);
        let (then, today) = (of(&self.as_recorded), of(&parameters(&self.fresh)));
        let is_changed_since = then.map(f64::to_bits) != today.map(f64::to_bits);
        if !self.begun && is_changed_since {
            return;
        }
        if set_parameter(&mut self.control, name, value) != Ok(true) {
            self.refusal.get_or_insert(format!("parameter {name} = {value} cannot be set"));
        }
    }

    fn move_leaders(&mut self, request: &SetFormationRequest) {
        // Whether it can be flown was asked in the flight, with the limits of then.
        match requested(&self.control, request) {
            Ok(manoeuvre) => self.control.begin(&manoeuvre),
            Err(why) => {
                self.refusal.get_or_insert(format!("the leaders cannot move as they did: {why}"));
            }
        }
    }

    /// When the content of a message was measured \[s\].
    fn stamp_of(&self, header: &Header, arrival: f64) -> f64 {
        if !self.is_simulated && header.stamp == Time::default() {
            return arrival;
        }
        self.exact.get(&header.stamp).copied().unwrap_or(header.stamp.seconds())
    }

    fn tick(&mut self, now: f64) {
        self.compare();
        self.begun = true;
        self.take_over();
        if !self.active {
            self.control.set_active(false);
        } else if !self.has_events {
            self.control.set_active(true);
        }
        for command in commands::due(&self.commands, self.ticks) {
            // What was refused is refused again.
            commands::perform(command, &mut self.control);
        }
        (self.now, self.ticks) = (now, self.ticks + 1);
        self.exact.insert(Time::from_seconds(now), now);
        for (observer, message, arrival) in std::mem::take(&mut self.measured) {
            let stamp = self.stamp_of(&message.header, arrival);
            let all = ranges::ranges(&message, observer, &self.numbers, arrival);
            for range in all.filter(|range| self.heard_of.binary_search(&range.of).is_ok()) {
                self.control.receive_range(Range { stamp, ..range }, now);
            }
        }
        for (member, header, one, arrival) in std::mem::take(&mut self.waiting) {
            let mut pose = pose::pose(&header, &one, arrival, &self.frame_id);
            pose.stamp = self.stamp_of(&header, arrival);
            // Refused messages are refused again.
            let _ = self.control.receive(member, pose, now);
            self.poses += 1;
        }
        self.control.tick(now);
        for (member, today) in self.today.iter_mut().enumerate() {
            *today = self.control.target(member).filter(|_| self.active && self.mine[member]);
        }
    }

    /// Holds the targets of the last tick against each other.
    fn compare(&mut self) {
        for (m, robot) in self.robots.iter_mut().enumerate() {
            let (today, recorded) = (self.today[m].take(), self.recorded[m].take());
            robot.recorded += u64::from(recorded.is_some());
            let apart = match (today, recorded) {
                (None, None) => continue,
                // A recorder outside the loop may have missed a target.
                (Some(_), None) if !self.has_events => continue,
                (Some(_), None) => {
                    robot.only_replayed += 1;
                    robot.first_at.get_or_insert(self.now);
                    continue;
                }
                (None, Some(_)) => {
                    robot.only_recorded += 1;
                    robot.first_at.get_or_insert(self.now);
                    continue;
                }
                (Some(today), Some(recorded)) => distance(today, recorded),
            };
            if apart > robot.largest {
                (robot.largest, robot.largest_at) = (apart, Some(self.now));
            }
            // NaN agrees with nothing.
            if apart > self.tolerance || apart.is_nan() {
                robot.differ += 1;
                robot.first_at.get_or_insert(self.now);
            }
        }
    }
}

/// The state that a recorded loop took over.
fn taken_over(reader: &Reader, text: &str) -> Result<ControlSnapshot, RecordError> {
    /// More than a loop runs through; a body that moves by itself is taken through all of them.
    const MOST_PERIODS: u64 = 100_000_000;
    let state: Option<ControlSnapshot> = serde_json::from_str(text).ok();
    state.filter(|state| state.periods() <= MOST_PERIODS).ok_or_else(|| {
        RecordError::Refused(format!(
            "{}: its `{TAKEN_OVER}` is no state of a loop\n  help: give a recording as --record has written it",
            reader.path().display()
        ))
    })
}

/// Reads a recording and replays it.
///
/// # Errors
/// As [`Reader::open`] and [`replay`].
pub fn replay_file(
    path: &Path,
    swarm: Option<Swarm>,
    set: &[String],
    tolerance: f64,
) -> Result<Report, RecordError> {
    let reader = Reader::open(path)?;
    let swarm = swarm.map_or_else(|| recorded_swarm(&reader, set), Ok)?;
    replay(&reader, &swarm, tolerance)
}
