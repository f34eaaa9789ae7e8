//! A swarm under the reader's hands: leaders sent to places, robots that fail, poses that are lost; and the file that
//! flies it again.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::command::{Command, Fault};
use super::session::{Frame, Refused, Viewer};
use crate::export::report::FlightRecorder;
use crate::export::report::view::View;
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm as File;
use crate::scene::swarm::raw::{RawCommand, RawCommandKind, RawFault, RawFaultKind};
use crate::swarm::flight::{Alarm, Flight, FlightCommand};

/// Quantities that come with every frame: a swarm is small.
pub const CHANNELS: [&str; 4] = ["clearance", "age", "pe1", "strain"];

/// Keys of the flight that may change while robots fly: noise, delay and loss.
const CHANNEL_KEYS: [&str; 3] = ["flight.noise", "flight.delay", "flight.loss"];
/// Most commands and faults that are kept.
const MOST_COMMANDS: usize = 100_000;
/// States that can be returned to.
const MOST_UNDONE: usize = 40;

/// Reads the swarm with these overrides after those that the session began with.
pub type Load = Box<dyn Fn(&[String]) -> Result<File, SceneError> + Send>;

/// Robots under way, and everything that was done to them.
pub struct Swarm {
    load: Load,
    now: State,
    before: Vec<State>,
}

/// Each leader that is held and where it was taken \[m\], and where the hand has them.
type Hand = (Vec<(usize, [f64; 2])>, [f64; 2]);

/// What [`Command::Undo`] returns to.
#[derive(Clone)]
struct State {
    set: Vec<String>,
    file: Arc<File>,
    flight: Flight,
    /// What was done, as the format of swarm files says it.
    commands: Vec<RawCommand>,
    faults: Vec<RawFault>,
    /// Noise, delay and loss now.
    channel: (f64, u32, f64),
    /// What viewers hold.
    hands: BTreeMap<Viewer, Hand>,
    alarms: Vec<Alarm>,
    layout: u64,
}

impl Swarm {
    /// # Errors
    /// Names the key of a swarm that cannot be flown.
    pub fn new(load: Load) -> Result<Self, SceneError> {
        let now = State::begin(&load, Vec::new(), 0)?;
        Ok(Self { load, now, before: Vec::new() })
    }

    /// The robots as they are.
    pub fn flight(&self) -> &Flight {
        &self.now.flight
    }

    /// The swarm that it began with.
    pub fn swarm(&self) -> &File {
        &self.now.file
    }

    /// Time of a period \[s\].
    pub fn period(&self) -> f64 {
        self.now.flight.control().period()
    }

    /// Changes whenever the robots are other ones.
    pub fn layout(&self) -> u64 {
        self.now.layout
    }

    /// States that can be returned to.
    pub fn undoable(&self) -> usize {
        self.before.len()
    }

    /// Keys that were changed and hold now, `KEY=VALUE`, in their order.
    pub fn sets(&self) -> Vec<String> {
        let (noise, delay, loss) = self.now.channel;
        let values = [noise.to_string(), delay.to_string(), loss.to_string()];
        let channel = CHANNEL_KEYS.iter().zip(values).map(|(key, value)| format!("{key}={value}"));
        self.now.set.iter().cloned().chain(channel).collect()
    }

    /// Flies a period.
    pub fn advance(&mut self) {
        let State { file, flight, alarms, .. } = &mut self.now;
        let before = flight.fleet().places();
        flight.step();
        *alarms = Alarm::now(file, flight, &before);
    }

    /// Does what a viewer asks of a swarm.
    ///
    /// # Errors
    /// Why it cannot be done; nothing has changed then.
    pub fn perform(&mut self, viewer: Viewer, command: &Command) -> Result<(), Refused> {
        match command {
            Command::Grab { particle, alone } => self.grab(viewer, *particle, *alone),
            Command::Drag { by } => self.drag(viewer, *by),
            Command::Release {} => {
                self.release(viewer);
                Ok(())
            }
            Command::Set { key, value } if CHANNEL_KEYS.contains(&key.trim()) => {
                self.channel(key.trim(), value)
            }
            Command::Set { key, value } => {
                self.restart([&self.now.set[..], &[format!("{key}={value}")]].concat())
            }
            Command::Fault { robot, what } => self.fault(*robot, *what),
            Command::Reset {} => self.restart(self.now.set.clone()),
            Command::Undo {} => {
                let layout = self.now.layout;
                self.now = self.before.pop().ok_or("nothing was done yet")?;
                if self.now.layout != layout {
                    self.now.layout = layout + 1;
                }
                Ok(())
            }
            _ => Err("a swarm cannot do this".into()),
        }
    }

    fn keep(&mut self) {
        if self.before.len() >= MOST_UNDONE {
            self.before.remove(0);
        }
        let hands = BTreeMap::new();
        self.before.push(State { hands, ..self.now.clone() });
    }

    fn restart(&mut self, set: Vec<String>) -> Result<(), Refused> {
        let state = State::begin(&self.load, set, self.now.layout + 1)?;
        self.keep();
        self.now = state;
        Ok(())
    }

    fn grab(&mut self, viewer: Viewer, robot: usize, alone: bool) -> Result<(), Refused> {
        let formation = self.now.flight.control().formation();
        if robot >= formation.count() {
            return Err("there is no such robot".into());
        }
        if !formation.is_led(robot) {
            return Err(format!("`{}` does not lead: drag a leader", formation.names[robot]).into());
        }
        self.now.require_room()?;
        let places = self.now.flight.fleet().places();
        let held = |m: &usize| if alone { *m == robot } else { formation.is_led(*m) };
        let held = (0..formation.count()).filter(held).map(|m| (m, places.get(m))).collect();
        self.keep();
        self.now.hands.insert(viewer, (held, [0.0; 2]));
        Ok(())
    }

    fn drag(&mut self, viewer: Viewer, by: [f64; 2]) -> Result<(), Refused> {
        let (held, last) = self.now.hands.get(&viewer).cloned().ok_or("nothing is held")?;
        if by == last {
            return Ok(());
        }
        self.now.require_room()?;
        let targets: Vec<_> = held.iter().map(|&(m, [x, y])| (m, [x + by[0], y + by[1]])).collect();
        // All of them or none: a formation that is led by a part of its leaders is torn.
        if !targets.iter().all(|&(_, to)| self.now.flight.control().is_believed(to)) {
            return Err("poses there would not be believed: they are beyond `poses.range`".into());
        }
        for (member, to) in targets {
            self.now.lead(member, to)?;
        }
        self.now.hands.insert(viewer, (held, by));
        Ok(())
    }

    /// Lets go of what a viewer holds: it stays where it was led to.
    pub fn release(&mut self, viewer: Viewer) {
        self.now.hands.remove(&viewer);
    }

    fn channel(&mut self, key: &str, value: &str) -> Result<(), Refused> {
        let set = [&self.now.set[..], &[format!("{key}={value}")]].concat();
        let raw = (self.load)(&set)?.raw.flight;
        let (mut noise, mut delay, mut loss) = self.now.channel;
        match key {
            "flight.noise" => noise = raw.noise,
            "flight.delay" => delay = raw.delay,
            _ => loss = raw.loss,
        }
        self.now.require_room()?;
        self.keep();
        let command = FlightCommand::Channel { noise, delay, loss };
        if !self.now.flight.perform(&command) {
            self.now = self.before.pop().ok_or("nothing was done yet")?;
            return Err("the safety filter refuses this noise".into());
        }
        self.now.channel = (noise, delay, loss);
        self.now.record(RawCommandKind::Channel { noise, delay, loss });
        Ok(())
    }

    fn fault(&mut self, robot: usize, what: Option<Fault>) -> Result<(), Refused> {
        let names = &self.now.flight.control().formation().names;
        let name = names.get(robot).ok_or("there is no such robot")?.clone();
        self.now.require_room()?;
        self.keep();
        let now = self.now.flight.fleet().time();
        self.now.end_fault(&name, now);
        let fleet = self.now.flight.fleet_mut();
        match what.map(kind) {
            None => fleet.mend(robot),
            Some(kind) => {
                fleet.break_down(robot, kind.clone());
                self.now.faults.push(RawFault { robot: name, at: now, until: None, what: kind });
            }
        }
        Ok(())
    }

    /// The swarm file that flies it again, as TOML.
    ///
    /// # Errors
    /// A swarm that cannot be written.
    pub fn saved(&self) -> Result<String, String> {
        let mut raw = self.now.file.raw.clone();
        // Before a period the hand acted first: the file's own commands are performed when it begins.
        let own = std::mem::replace(&mut raw.flight.commands, self.now.commands.clone());
        raw.flight.commands.extend(own);
        raw.flight.commands.sort_by_key(|command| command.after);
        raw.flight.faults.clone_from(&self.now.faults);
        let flown = self.now.flight.fleet().period().max(1) as f64;
        raw.flight.duration = Some(flown * raw.control.period);
        toml::to_string(&raw).map_err(|error| error.to_string())
    }

    /// The page's view of the robots as they are.
    pub fn view(&self) -> View {
        FlightRecorder::still(&self.now.file, &self.now.flight, self.start())
    }

    /// Where displacements are counted from \[m\].
    fn start(&self) -> &Vectors {
        &self.now.flight.control().formation().places
    }

    /// The state of every robot, with all channels.
    pub fn frame(&self) -> Frame {
        let (control, places, start) =
            (self.now.flight.control(), self.now.flight.fleet().places(), self.start());
        let moved = |now: &[f64], then: &[f64]| now.iter().zip(then).map(|(n, t)| (n - t) as f32).collect();
        let places_moved = [moved(&places.x, &start.x), moved(&places.y, &start.y)];
        let mut clearance = Vec::new();
        control.filter().clearance(&places, &mut clearance);
        let measures = control.formation().measures(&places);
        let of = |name: &str, m: usize| match name {
            "clearance" => clearance[m],
            "age" => control.age(m).unwrap_or(f64::NAN),
            "pe1" => measures.pe1[m],
            _ => measures.strain[m].map_or(f64::NAN, |strain| strain.largest()),
        };
        let channel = |name: &str| (0..places.len()).map(|m| of(name, m) as f32).collect();
        let channels = CHANNELS.into_iter().map(|name| Some(channel(name))).collect();
        Frame { clock: self.now.flight.fleet().time(), places: places_moved, channels }
    }

    /// Roles by number.
    pub fn roles(&self) -> Vec<u8> {
        let formation = self.now.flight.control().formation();
        let role = |m: usize| if formation.leads(m) { Role::Leader } else { Role::Follower };
        crate::export::report::view::numbers(&(0..formation.count()).map(role).collect::<Vec<_>>())
    }

    /// Bounds that are broken, in words, and the robots that break them.
    pub fn alarms(&self) -> (Vec<String>, Vec<usize>) {
        let names = &self.now.flight.control().formation().names;
        let words = |alarm: &Alarm| {
            let robots: Vec<&str> = alarm.robots.iter().map(|&m| names[m].as_str()).collect();
            let Alarm { bound, declared, found, .. } = alarm;
            format!("{bound}: declared {declared} m, now {found:.3} m, by {}", robots.join(" and "))
        };
        let robots = self.now.alarms.iter().flat_map(|alarm| alarm.robots.iter().copied());
        (self.now.alarms.iter().map(words).collect(), robots.collect())
    }

    /// Robots with a fault now, and its kind.
    pub fn faults(&self) -> Vec<(usize, &'static str)> {
        let fleet = self.now.flight.fleet();
        let count = fleet.robots().len();
        (0..count).filter_map(|m| Some((m, fleet.fault_name(m)?))).collect()
    }
}

impl State {
    fn begin(load: &Load, set: Vec<String>, layout: u64) -> Result<Self, SceneError> {
        let file = load(&set)?;
        let flight = Flight::new(&file)?;
        let raw = &file.raw.flight;
        Ok(Self {
            set,
            channel: (raw.noise, raw.delay, raw.loss),
            faults: raw.faults.clone(),
            commands: Vec::new(),
            hands: BTreeMap::new(),
            alarms: Vec::new(),
            layout,
            flight,
            file: Arc::new(file),
        })
    }

    fn lead(&mut self, member: usize, to: [f64; 2]) -> Result<(), Refused> {
        if !self.flight.perform(&FlightCommand::Lead { member, to }) {
            return Err("the poses there would not be believed: `poses.range` is less".into());
        }
        let robot = self.flight.control().formation().names[member].clone();
        self.record(RawCommandKind::Lead { robot, to });
        Ok(())
    }

    /// Keeps a command; of several for a robot before the same period the last.
    fn record(&mut self, what: RawCommandKind) {
        let after = self.flight.fleet().period();
        let is_same = |one: &RawCommand| match (&one.what, &what) {
            (RawCommandKind::Lead { robot, .. }, RawCommandKind::Lead { robot: other, .. }) => robot == other,
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
