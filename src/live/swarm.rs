//! A swarm under the reader's hands: leaders sent to places, obstacles moved, robots that fail, poses that are lost; and the file that
//! flies it again.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use super::command::{Command, Fault};
use super::history::{self, History, Source};
use super::session::{Frame, Refused, Session, Viewer};
use crate::export::report::flight::{FlightRecorder, from_places};
use crate::export::report::view::View;
use crate::flock::role::Role;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::SceneError;
use crate::scene::swarm::Swarm as File;
use crate::scene::swarm::raw::{RawCommand, RawCommandKind, RawFault, RawFaultKind};
use crate::scene::text::listed;
use crate::swarm::control::Control;
use crate::swarm::design::{self, Edit};
use crate::swarm::flight::{Alarm, Flight};
use crate::swarm::plan::Exactness;

/// Quantities that come with every frame: a swarm is small.
pub(crate) const CHANNELS: [&str; 9] =
    ["clearance", "away", "age", "pe1", "strain", "target_dx", "target_dy", "speed", "acceleration"];

/// Keys of the flight that may change while robots fly: noise, delay and loss.
const CHANNEL_KEYS: [&str; 3] = ["flight.noise", "flight.delay", "flight.loss"];
/// Most commands and faults that are kept.
const MOST_COMMANDS: usize = 100_000;

/// Robots under way, and everything that was done to them.
pub struct Swarm {
    history: History<State>,
}

/// The thing that a viewer holds.
#[derive(Clone)]
struct Hand {
    held: Held,
    /// Where the hand has it, from where it was taken \[m\].
    by: [f64; 2],
    /// Whether it has moved it: all that it does to it is undone as one.
    has_moved: bool,
}

/// A thing that can be held, and where it was taken \[m\].
#[derive(Clone)]
enum Held {
    Leaders(Vec<(usize, [f64; 2])>),
    /// From its place in the file.
    Obstacle(usize, [f64; 2]),
}

/// A swarm and everything that was done to it.
#[derive(Clone)]
struct State {
    file: Arc<File>,
    flight: Flight,
    /// Past changes, in the format of swarm files.
    commands: Vec<RawCommand>,
    faults: Vec<RawFault>,
    /// Things that viewers hold.
    hands: BTreeMap<Viewer, Hand>,
    alarms: Vec<Alarm>,
    /// Velocities before the last period \[m/s\].
    before: Vec<[f64; 2]>,
}

impl Swarm {
    /// A swarm whose file looks up other files in `folder`.
    ///
    /// # Errors
    /// Names the key of a swarm that cannot be flown.
    pub fn new(swarm: File, folder: Option<PathBuf>) -> Result<Self, SceneError> {
        Ok(Self { history: History::new(swarm, folder)? })
    }

    /// The robots as they are.
    pub fn flight(&self) -> &Flight {
        &self.history.now.flight
    }

    /// The swarm that it began with.
    pub fn swarm(&self) -> &File {
        &self.history.now.file
    }

    /// The change is made in the file that was designed last, and what was flown since is left behind.
    fn design(&mut self, edit: &Edit) -> Result<(), Refused> {
        let State { file, flight, .. } = &self.history.now;
        let mut raw = design::by_robots(file, flight.control().formation())?;
        edit.perform(&mut raw)?;
        let text = toml::to_string(&raw).map_err(|error| error.to_string())?;
        let folder = self.history.source.folder.clone();
        self.history.replace(File::parse(&file.name, "the design", &text, &[], folder.as_deref())?)
    }

    fn grab(&mut self, viewer: Viewer, robot: usize, alone: bool) -> Result<(), Refused> {
        let formation = self.history.now.flight.control().formation();
        if robot >= formation.count() {
            return Err("there is no such robot".into());
        }
        if !formation.is_led(robot) {
            return Err(format!("`{}` does not lead: drag a leader", formation.names[robot]).into());
        }
        self.history.now.require_room()?;
        let places = self.history.now.flight.fleet().places();
        let held = |m: &usize| if alone { *m == robot } else { formation.is_led(*m) };
        let held = (0..formation.count()).filter(held).map(|m| (m, places.get(m))).collect();
        self.take(viewer, Held::Leaders(held));
        Ok(())
    }

    fn grab_obstacle(&mut self, viewer: Viewer, obstacle: usize) -> Result<(), Refused> {
        let by = self.obstacles().get(obstacle).copied().ok_or("there is no such obstacle")?;
        self.history.now.require_room()?;
        self.take(viewer, Held::Obstacle(obstacle, by));
        Ok(())
    }

    fn take(&mut self, viewer: Viewer, held: Held) {
        self.history.now.hands.insert(viewer, Hand { held, by: [0.0; 2], has_moved: false });
    }

    fn drag(&mut self, viewer: Viewer, by: [f64; 2]) -> Result<(), Refused> {
        let hand = self.history.now.hands.get(&viewer).cloned().ok_or("nothing is held")?;
        if by == hand.by {
            return Ok(());
        }
        let held = hand.held.clone();
        let act = |now: &mut State| match &held {
            Held::Leaders(leaders) => now.lead_all(leaders, |[x, y]| [x + by[0], y + by[1]]),
            Held::Obstacle(obstacle, [x, y]) => {
                let what = RawCommandKind::MoveObstacle { obstacle: *obstacle, by: [x + by[0], y + by[1]] };
                now.perform(what, "an obstacle cannot be so far away")
            }
        };
        self.move_held(viewer, Hand { by, ..hand }, act)
    }

    fn squeeze(&mut self, viewer: Viewer, by: [f64; 2]) -> Result<(), Refused> {
        let hand = self.history.now.hands.get(&viewer).cloned();
        let Some((hand, Held::Leaders(leaders))) = hand.map(|hand| (hand.clone(), hand.held)) else {
            return Err("no leaders are held".into());
        };
        let share = 1.0 / leaders.len() as f64;
        let middle = [0, 1].map(|k| leaders.iter().map(|(_, place)| place[k] * share).sum::<f64>());
        let to = |place: [f64; 2]| [0, 1].map(|k| middle[k] + by[k] * (place[k] - middle[k]));
        self.move_held(viewer, hand, |now| now.lead_all(&leaders, to))
    }

    /// Moves what a viewer holds to where its hand is now.
    fn move_held(
        &mut self,
        viewer: Viewer,
        hand: Hand,
        act: impl FnOnce(&mut State) -> Result<(), Refused>,
    ) -> Result<(), Refused> {
        self.history.now.require_room()?;
        if hand.has_moved { act(&mut self.history.now) } else { self.history.attempt(act) }?;
        self.history.now.hands.insert(viewer, Hand { has_moved: true, ..hand });
        Ok(())
    }

    fn channel(&mut self, key: &str, value: &str) -> Result<(), Refused> {
        let set = [self.history.set(), &[format!("{key}={value}")]].concat();
        let Source { file, folder } = &*self.history.source;
        let raw = file.with(&set, folder.as_deref())?.raw.flight;
        let (mut noise, mut delay, mut loss) = self.flight().fleet().channel();
        match key {
            "flight.noise" => noise = raw.noise,
            "flight.delay" => delay = raw.delay,
            _ => loss = raw.loss,
        }
        self.history.now.require_room()?;
        let what = RawCommandKind::Channel { noise, delay, loss };
        // Apart: of a refused channel nothing may stay.
        let mut flight = self.history.now.flight.clone();
        if !flight.perform(&what) {
            return Err("the safety filter refuses this noise".into());
        }
        self.history.keep();
        self.history.now.flight = flight;
        self.history.now.record(what);
        Ok(())
    }

    fn fault(&mut self, robot: usize, what: Option<Fault>) -> Result<(), Refused> {
        let names = &self.history.now.flight.control().formation().names;
        let name = names.get(robot).ok_or("there is no such robot")?.clone();
        self.history.now.require_room()?;
        self.history.keep();
        let now = self.history.now.flight.fleet().time();
        self.history.now.end_fault(&name, now);
        let fleet = self.history.now.flight.fleet_mut();
        match what.map(kind) {
            None => fleet.mend(robot),
            Some(kind) => {
                fleet.break_down(robot, kind.clone());
                self.history.now.faults.push(RawFault { robot: name, at: now, until: None, what: kind });
            }
        }
        Ok(())
    }
}

impl Session for Swarm {
    fn advance(&mut self) -> Result<(), String> {
        let State { file, flight, alarms, before, .. } = &mut self.history.now;
        let places = flight.fleet().places();
        *before = velocities(flight);
        flight.step();
        *alarms = Alarm::now(file, flight, &places);
        Ok(())
    }

    fn perform(&mut self, viewer: Viewer, command: &Command) -> Result<(), Refused> {
        match command {
            Command::Grab { particle, alone } => self.grab(viewer, *particle, *alone),
            Command::GrabObstacle { obstacle } => self.grab_obstacle(viewer, *obstacle),
            Command::Drag { by } => self.drag(viewer, *by),
            Command::Squeeze { by } => self.squeeze(viewer, *by),
            Command::Release {} => {
                self.release(viewer);
                Ok(())
            }
            Command::Set { key, value } if CHANNEL_KEYS.contains(&key.trim()) => {
                self.channel(key.trim(), value)
            }
            Command::Set { key, value } => {
                // What the file makes of the channel on its way it does again.
                let is_channel =
                    |command: &RawCommand| matches!(command.what, RawCommandKind::Channel { .. });
                let by_hand = self.history.now.commands.iter().any(is_channel);
                let sets = if by_hand { self.sets() } else { self.history.set().to_vec() };
                self.history.restart([sets, vec![format!("{key}={value}")]].concat())
            }
            Command::Fault { robot, what } => self.fault(*robot, *what),
            Command::Design { edit } => self.design(edit),
            other => self.history.perform(other),
        }
    }

    fn release(&mut self, viewer: Viewer) {
        self.history.now.hands.remove(&viewer);
    }

    fn saved(&self, folder: Option<&Path>) -> Result<String, String> {
        let mut raw = self.history.now.file.raw.clone();
        if let Some(to) = folder {
            raw.name_files_from(self.history.source.folder.as_deref(), to);
        }
        // Before a period the hand acted first: the file's own commands are performed when it begins.
        let own = std::mem::replace(&mut raw.flight.commands, self.history.now.commands.clone());
        raw.flight.commands.extend(own);
        raw.flight.commands.sort_by_key(|command| command.after);
        raw.flight.faults.clone_from(&self.history.now.faults);
        let flown = self.history.now.flight.fleet().period();
        // What has not begun to fly is to fly as its file says.
        if flown > 0 {
            raw.flight.duration = Some(flown as f64 * raw.control.period);
        }
        toml::to_string(&raw).map_err(|error| error.to_string())
    }

    fn frame(&self, _wanted: &[bool]) -> Frame {
        let (control, fleet) = (self.flight().control(), self.flight().fleet());
        let (places, mut clearance) = (fleet.places(), Vec::new());
        control.filter().clearance(&places, &mut clearance);
        let sent = self.history.now.sent();
        let target = |m: usize| sent.get(&m).copied().or_else(|| control.target(m));
        let mut frame = frame(control, &places, &clearance, &target, fleet.time());
        let now = velocities(self.flight());
        let speed = now.iter().map(|[x, y]| x.hypot(*y)).collect();
        let changes = now.iter().zip(&self.history.now.before);
        let acceleration = changes.map(|(now, before)| distance(*now, *before) / control.period());
        frame.channels.extend([Some(speed), Some(acceleration.collect())]);
        frame
    }

    fn roles(&self) -> Vec<u8> {
        roles(self.flight().control())
    }

    fn layout(&self) -> u64 {
        self.history.layout()
    }

    fn undoable(&self) -> usize {
        self.history.undoable()
    }

    fn sets(&self) -> Vec<String> {
        let (noise, delay, loss) = self.flight().fleet().channel();
        let values = [noise.to_string(), delay.to_string(), loss.to_string()];
        let raw = &self.history.now.file.raw.flight;
        let is_changed = [noise != raw.noise, delay != raw.delay, loss != raw.loss];
        let channel = CHANNEL_KEYS.iter().zip(values).zip(is_changed).filter(|(_, is_changed)| *is_changed);
        let channel = channel.map(|((key, value), _)| format!("{key}={value}"));
        self.history.set().iter().cloned().chain(channel).collect()
    }

    fn rate(&self) -> f64 {
        1.0 / self.flight().control().period()
    }

    fn alarms(&self) -> (Vec<String>, Vec<usize>) {
        in_words(&self.history.now.alarms, &self.flight().control().formation().names)
    }

    fn obstacles(&self) -> Vec<[f64; 2]> {
        self.history.now.flight.control().filter().obstacles().moved().collect()
    }

    fn faults(&self) -> Vec<(usize, &'static str)> {
        let fleet = self.history.now.flight.fleet();
        let count = fleet.robots().len();
        (0..count).filter_map(|m| Some((m, fleet.fault_name(m)?))).collect()
    }

    fn exactness(&self) -> Option<Vec<String>> {
        let formation = self.flight().control().formation();
        let exactness = Exactness::of(self.swarm(), formation).map(|exactness| exactness.in_words());
        let follows = (0..formation.count()).any(|m| !formation.leads(m));
        let unknown = || {
            let words = "what becomes of manoeuvres is not predicted: the rule is not linear";
            follows.then(|| words.to_owned()).into_iter().collect()
        };
        formation.is_led_here().then(|| exactness.unwrap_or_else(unknown))
    }

    fn view(&self) -> View {
        let State { file, flight, .. } = &self.history.now;
        FlightRecorder::still(file, flight.control(), &flight.fleet().places(), true)
    }

    fn title(&self) -> (&str, &str) {
        (&self.swarm().name, &self.swarm().raw.title)
    }

    fn runner(&self) -> &'static str {
        "swarm"
    }

    fn raw(&self) -> Value {
        serde_json::to_value(&self.swarm().raw).unwrap_or_default()
    }
}

fn velocities(flight: &Flight) -> Vec<[f64; 2]> {
    flight.fleet().robots().iter().map(|robot| robot.velocity).collect()
}

/// The state of every robot at these places \[m\], with all channels but those of motion, the last two; displacements
/// are from the nominal places.
pub(super) fn frame(
    control: &Control,
    places: &Vectors,
    clearance: &[f64],
    target: &dyn Fn(usize) -> Option<[f64; 2]>,
    clock: f64,
) -> Frame {
    let start = &control.formation().places;
    let measures = control.formation().measures(places);
    let away = from_places(control, places);
    let to_target =
        |m: usize, axis: usize| target(m).map_or(f64::NAN, |target| target[axis] - start.get(m)[axis]);
    let of = |name: &str, m: usize| match name {
        "clearance" => clearance[m],
        "away" => away.as_ref().map_or(f64::NAN, |away| away[m]),
        "age" => control.age(m).unwrap_or(f64::NAN),
        "pe1" => measures.pe1[m],
        "target_dx" => to_target(m, 0),
        "target_dy" => to_target(m, 1),
        _ => measures.strain[m].map_or(f64::NAN, |strain| strain.largest()),
    };
    let channel = |name: &str| (0..places.len()).map(|m| of(name, m)).collect();
    Frame {
        clock,
        displacements: places.since(start),
        channels: CHANNELS[..7].iter().map(|name| Some(channel(name))).collect(),
    }
}

/// Roles by number.
pub(super) fn roles(control: &Control) -> Vec<u8> {
    let formation = control.formation();
    let role = |m: usize| if formation.leads(m) { Role::Leader } else { Role::Follower };
    (0..formation.count()).map(|m| role(m).number()).collect()
}

/// Bounds that are broken, in words, and the robots that break them.
pub(super) fn in_words(alarms: &[Alarm], names: &[String]) -> (Vec<String>, Vec<usize>) {
    let words = |alarm: &Alarm| {
        let robots: Vec<&str> = alarm.robots.iter().map(|&m| names[m].as_str()).collect();
        let Alarm { bound, declared, found, .. } = alarm;
        format!("{bound}: declared {declared} m, now {found:.3} m, by {}", listed(&robots))
    };
    let robots = alarms.iter().flat_map(|alarm| alarm.robots.iter().copied());
    (alarms.iter().map(words).collect(), robots.collect())
}

impl history::State for State {
    const NAME: &'static str = "swarm";
    type File = File;

    fn begin(source: &Source<File>, set: &[String]) -> Result<Self, SceneError> {
        let file = source.file.with(set, source.folder.as_deref())?;
        let flight = Flight::new(&file)?;
        let raw = &file.raw.flight;
        Ok(Self {
            faults: raw.faults.clone(),
            commands: Vec::new(),
            hands: BTreeMap::new(),
            alarms: Vec::new(),
            before: velocities(&flight),
            flight,
            file: Arc::new(file),
        })
    }

    fn let_go_all(&mut self) {
        self.hands.clear();
    }

    fn size(&self) -> usize {
        self.flight.fleet().robots().len() + self.commands.len() + self.faults.len()
    }
}

impl State {
    /// Leads from where each leader was taken to where `to` has it.
    fn lead_all(
        &mut self,
        leaders: &[(usize, [f64; 2])],
        to: impl Fn([f64; 2]) -> [f64; 2],
    ) -> Result<(), Refused> {
        let targets: Vec<_> = leaders.iter().map(|&(m, place)| (m, to(place))).collect();
        // All of them or none: a formation that is led by a part of its leaders is torn.
        if !targets.iter().all(|&(_, to)| self.flight.control().is_believed(to)) {
            return Err("poses there would not be believed: they are beyond `poses.range`".into());
        }
        targets.into_iter().try_for_each(|(member, to)| {
            let robot = self.flight.control().formation().names[member].clone();
            let refusal = "the poses there would not be believed: `poses.range` is less";
            self.perform(RawCommandKind::Lead { robot, to }, refusal)
        })
    }

    /// Places that leaders were sent to since the last period \[m\]: their targets, once the next one is flown.
    fn sent(&self) -> BTreeMap<usize, [f64; 2]> {
        let names = &self.flight.control().formation().names;
        let begun = self.commands.partition_point(|one| one.after < self.flight.fleet().period());
        let sent = self.commands[begun..].iter().filter_map(|one| match &one.what {
            RawCommandKind::Lead { robot, to } => Some((names.iter().position(|name| name == robot)?, *to)),
            _ => None,
        });
        sent.collect()
    }

    /// Performs a command and keeps it, or says why not.
    fn perform(&mut self, what: RawCommandKind, refusal: &str) -> Result<(), Refused> {
        if !self.flight.perform(&what) {
            return Err(refusal.into());
        }
        self.record(what);
        Ok(())
    }

    /// Keeps a command; of several for a robot or an obstacle before the same period the last.
    fn record(&mut self, what: RawCommandKind) {
        let after = self.flight.fleet().period();
        let is_same = |one: &RawCommand| match (&one.what, &what) {
            (RawCommandKind::Lead { robot, .. }, RawCommandKind::Lead { robot: other, .. }) => robot == other,
            (
                RawCommandKind::MoveObstacle { obstacle, .. },
                RawCommandKind::MoveObstacle { obstacle: other, .. },
            ) => obstacle == other,
            (RawCommandKind::Channel { .. }, RawCommandKind::Channel { .. }) => true,
            _ => false,
        };
        let begun = self.commands.partition_point(|one| one.after < after);
        let known = self.commands[begun..].iter().position(is_same);
        match known {
            Some(k) => self.commands[begun + k].what = what,
            None => self.commands.push(RawCommand { after, what }),
        }
    }

    /// Ends the faults of a robot that hold now; those that have lasted for no period are forgotten.
    fn end_fault(&mut self, robot: &str, now: f64) {
        let holds = |fault: &RawFault| {
            fault.robot == robot && fault.at <= now && fault.until.is_none_or(|end| end > now)
        };
        self.faults.retain(|fault| !(holds(fault) && fault.at == now));
        self.faults.iter_mut().filter(|fault| holds(fault)).for_each(|fault| fault.until = Some(now));
    }

    fn require_room(&self) -> Result<(), Refused> {
        let kept = self.commands.len() + self.faults.len();
        let is_full = kept + self.flight.control().formation().count() > MOST_COMMANDS;
        if is_full { Err("too much was done to be kept: save it, and reset".into()) } else { Ok(()) }
    }
}

fn kind(fault: Fault) -> RawFaultKind {
    match fault {
        Fault::Dead => RawFaultKind::Dead,
        Fault::Silent => RawFaultKind::Silent,
        Fault::Stuck => RawFaultKind::Stuck,
    }
}
