//! Runs a session: steps at the speed asked for, what viewers ask in between, and the latest state for all of them.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime};

use serde_json::{Value, json};
use tungstenite::Bytes;

use super::command::Command;
use super::monitor::Monitor;
use super::session::{Frame, Session, Viewer};
use super::state::{Board, Published};
use crate::export::report::live_page;
use crate::export::shell::quoted;
use crate::export::write_new;

/// Time from one state that is shown to the next, at least.
const SHOWN_EVERY: Duration = Duration::from_micros(16_000);
/// Time that requests are waited for: at least while the body moves, as at a slow speed nothing is due for long, and
/// while it stands still.
const LEAST_WAIT: Duration = Duration::from_millis(2);
const IDLE: Duration = Duration::from_millis(50);
/// Steps that are behind are caught up with for so long, and then forgotten.
const BUSY: Duration = Duration::from_millis(14);
/// Saved files of one name.
const MOST_FILES: usize = 1000;

/// Something for the session.
#[derive(Debug)]
pub enum Request {
    /// A viewer asks for something.
    Command(Viewer, Command),
    /// A viewer has come.
    Come,
    /// A viewer has gone.
    Gone(Viewer),
}

/// A session and how it goes on.
pub struct Conductor {
    session: Box<dyn Session>,
    board: Arc<Board>,
    /// The command that began the session.
    command: String,
    /// Folder of saved files.
    folder: PathBuf,
    is_playing: bool,
    speed: f64,
    /// Parts of a step that are due.
    due: f64,
    /// Mean time of a step, and of encoding a frame \[ms\].
    step_time: f64,
    frame_time: f64,
    pace: Pace,
    number: u64,
    lineage: u64,
    layout: Option<u64>,
    /// Why it goes on no further.
    stopped: Option<String>,
    /// Viewers whose last grasp was refused: what they drag is nothing, as the refusal said.
    empty_handed: BTreeSet<Viewer>,
}

/// Sends every viewer away when it is dropped, by a panic too.
struct Closed(Arc<Board>);

impl Drop for Closed {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Counts steps and frames in stretches of time.
struct Pace {
    since: Instant,
    steps: u32,
    frames: u32,
    /// \[1/s\]
    rates: [f64; 2],
}

impl Pace {
    fn look(&mut self) {
        let seconds = self.since.elapsed().as_secs_f64();
        if seconds > 0.5 {
            self.rates = [f64::from(self.steps) / seconds, f64::from(self.frames) / seconds];
            (self.since, self.steps, self.frames) = (Instant::now(), 0, 0);
        }
    }
}

impl Conductor {
    /// A session that stands still, begun by `command`, whose files are saved in `folder`.
    pub fn new(session: Box<dyn Session>, board: Arc<Board>, command: String, folder: PathBuf) -> Self {
        let pace = Pace { since: Instant::now(), steps: 0, frames: 0, rates: [0.0; 2] };
        Self {
            session,
            board,
            command,
            folder,
            is_playing: false,
            speed: 1.0,
            due: 0.0,
            step_time: 0.0,
            frame_time: 0.0,
            pace,
            number: 0,
            lineage: 0,
            layout: None,
            stopped: None,
            empty_handed: BTreeSet::new(),
        }
    }

    /// Goes on until `stop` is raised or no viewer can ask for anything any more, and returns the session.
    pub fn run(mut self, requests: &Receiver<Request>, stop: &AtomicBool) -> Box<dyn Session> {
        let _closed = Closed(Arc::clone(&self.board));
        // Kept on a grid of times: what a frame is late by would otherwise come on top of each.
        let mut next = Instant::now();
        let mut before = Instant::now();
        let mut is_news = false;
        while !stop.load(Ordering::Relaxed) {
            if self.session.monitor().is_some() {
                // It goes on by itself; the question is whether a viewer follows it.
                self.is_playing = self.board.viewers() > 0;
            }
            let due = next.saturating_duration_since(Instant::now()).max(LEAST_WAIT);
            let wait = if self.is_playing { due } else { IDLE };
            is_news |= match requests.recv_timeout(wait) {
                Ok(request) => self.take(request),
                Err(RecvTimeoutError::Timeout) => false,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            // A flood of requests does not keep the body from moving.
            for request in requests.try_iter().take(256) {
                is_news |= self.take(request);
            }
            let now = Instant::now();
            is_news |= self.play(now.duration_since(before).as_secs_f64());
            before = now;
            self.pace.look();
            if is_news && (now >= next || !self.is_playing) {
                self.show();
                (next, is_news) = ((next + SHOWN_EVERY).max(now), false);
            }
        }
        self.session
    }

    /// Takes the steps that are due after so many seconds; whether there were any.
    fn play(&mut self, seconds: f64) -> bool {
        if let Some(monitor) = self.session.monitor_mut() {
            for (viewer, answer) in monitor.answers() {
                self.board.send(viewer, &answered(answer));
            }
            let is_new = monitor.poll(self.is_playing);
            self.pace.steps += u32::from(is_new);
            return is_new;
        }
        if !self.is_playing {
            self.due = 0.0;
            return false;
        }
        self.due += seconds * self.session.rate() * self.speed;
        let begun = Instant::now();
        let mut taken = 0;
        while self.due >= 1.0 && self.is_playing && begun.elapsed() < BUSY {
            self.step();
            self.due -= 1.0;
            taken += 1;
        }
        self.due = self.due.min(1.0);
        taken > 0
    }

    fn step(&mut self) {
        let begun = Instant::now();
        match self.session.advance() {
            Ok(()) => self.stopped = None,
            Err(why) => {
                self.is_playing = false;
                self.stopped = Some(why);
            }
        }
        self.pace.steps += 1;
        self.step_time += 0.1 * (1e3 * begun.elapsed().as_secs_f64() - self.step_time);
    }

    /// Does what is asked; whether there is something to show.
    fn take(&mut self, request: Request) -> bool {
        match request {
            Request::Come => true,
            Request::Gone(viewer) => {
                self.session.release(viewer);
                self.empty_handed.remove(&viewer);
                true
            }
            Request::Command(viewer, command) => self.perform(viewer, &command),
        }
    }

    fn perform(&mut self, viewer: Viewer, command: &Command) -> bool {
        let is_stepped_elsewhere = self.session.monitor().is_some();
        match command {
            Command::Ask { quantity } => self.board.want(viewer, quantity.clone()),
            Command::Drawn { .. } => return false,
            other if is_stepped_elsewhere => self.act(viewer, other),
            Command::Play {} => self.is_playing = true,
            Command::Pause {} => self.is_playing = false,
            Command::Step {} => {
                self.is_playing = false;
                self.step();
            }
            Command::Speed { value } => self.speed = *value,
            Command::Save {} => self.save(viewer),
            other => self.act(viewer, other),
        }
        true
    }

    /// Does something with the session, or says why not.
    fn act(&mut self, viewer: Viewer, command: &Command) {
        if command.moves_hand() && self.empty_handed.contains(&viewer) {
            return;
        }
        self.empty_handed.remove(&viewer);
        if let Err(refused) = self.session.perform(viewer, command) {
            if matches!(command, Command::Grab { .. } | Command::GrabObstacle { .. }) {
                self.empty_handed.insert(viewer);
            }
            self.board.send(viewer, &answered(Err(refused.0)));
            return;
        }
        self.stopped = None;
        if matches!(command, Command::Undo {} | Command::Reset {}) {
            self.is_playing = false;
            self.lineage += 1;
        }
    }

    fn save(&self, viewer: Viewer) {
        let said = match self.session.saved(Some(&self.folder)).and_then(|text| self.write(&text)) {
            Ok(path) => {
                let command =
                    format!("flockform {} {}", self.session.runner(), quoted(&path.to_string_lossy()));
                json!({ "event": "saved", "path": path, "command": command })
            }
            Err(words) => json!({ "event": "refused", "words": words }),
        };
        self.board.send(viewer, &said);
    }

    /// Writes a file of a name that is not taken.
    fn write(&self, text: &str) -> Result<PathBuf, String> {
        let (name, _) = self.session.title();
        let heading = format!("# Recorded by `flockform live`, from `{name}`.\n");
        let name = name.strip_suffix("_live").unwrap_or(name);
        let names = (1..=MOST_FILES).map(|n| match n {
            1 => format!("{name}_live.toml"),
            n => format!("{name}_live_{n}.toml"),
        });
        for name in names {
            let path = self.folder.join(name);
            match write_new(&path, &(heading.clone() + text)) {
                Ok(()) => return Ok(path),
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(format!("cannot write {}: {error}", path.display())),
            }
        }
        Err(format!("{} has {MOST_FILES} such files: remove some", self.folder.display()))
    }

    /// Publishes the state, with a page where there is none of this layout.
    pub(super) fn show(&mut self) {
        let begun = Instant::now();
        let layout = self.session.layout();
        if self.layout != Some(layout) {
            self.layout = Some(layout);
            self.lineage += 1;
            self.board.set_page(self.page());
        }
        let channels = self.session.channels();
        let wanted: Vec<bool> = channels.iter().map(|name| self.board.is_wanted(name)).collect();
        let frame = self.session.frame(&wanted);
        self.number += 1;
        let published = Published {
            number: self.number,
            frame: encoded(&frame, self.step_time, self.frame_time),
            roles: roles(&self.session.roles()),
            broken: Arc::new(self.session.broken()),
            lineage: self.lineage,
            status: self.status(frame.clock).to_string().into(),
        };
        self.pace.frames += 1;
        self.board.publish(published);
        self.frame_time += 0.1 * (1e3 * begun.elapsed().as_secs_f64() - self.frame_time);
    }

    fn status(&self, clock: f64) -> Value {
        let (alarms, alarmed) = self.session.alarms();
        json!({
            "event": "status",
            "clock": clock,
            "playing": self.is_playing,
            "speed": self.speed,
            "layout": self.layout,
            "undo": self.session.undoable(),
            "stopped": self.stopped,
            "alarms": alarms,
            "alarmed": alarmed,
            "faults": self.session.faults(),
            "obstacles": self.session.obstacles(),
            "sets": self.session.sets(),
            "command": self.command(),
            "tools": self.session.tools(),
            "viewers": self.board.viewers(),
            "rates": self.pace.rates,
            "node": self.session.monitor().map(Monitor::status),
        })
    }

    fn page(&self) -> String {
        let (_, title) = self.session.title();
        let node = self.session.monitor().map(
            |monitor| json!({ "commands": monitor.takes_commands(), "manoeuvres": monitor.manoeuvres() }),
        );
        let live = json!({
            "channels": self.session.channels(),
            "layout": self.session.layout(),
            "keys": if node.is_some() { Vec::new() } else { self.keys() },
            "swarm": !self.session.is_body(),
            "node": node,
            "design": self.session.exactness(),
        });
        live_page(self.command(), title.to_owned(), self.session.view(), live)
    }

    /// The command that begins with everything as it is set now.
    fn command(&self) -> String {
        let sets = self.session.sets();
        let key = |set: &str| set.split('=').next().unwrap_or_default().to_owned();
        // Of several changes of a key the last holds.
        let holds = |(n, set): &(usize, &String)| !sets[n + 1..].iter().any(|later| key(later) == key(set));
        let held = sets.iter().enumerate().filter(holds);
        held.fold(self.command.clone(), |command, (_, set)| format!("{command} --set {}", quoted(set)))
    }

    /// Numbers that a page offers to change, by key.
    fn keys(&self) -> Vec<(String, Value)> {
        let written = numbers(&self.session.raw());
        let is_new = |(key, _): &(String, Value)| !written.iter().any(|(known, _)| known == key);
        let defaults: Vec<_> = self.session.defaults().into_iter().filter(is_new).collect();
        written.into_iter().chain(defaults).collect()
    }
}

/// The outcome of a command, for its viewer.
fn answered(answer: Result<String, String>) -> Value {
    match answer {
        Ok(words) => json!({ "event": "done", "words": words }),
        Err(words) => json!({ "event": "refused", "words": words }),
    }
}

/// Kinds of binary messages, which begin with it.
const FRAME: u32 = 1;
const ROLES: u32 = 2;
const BROKEN: u32 = 3;

/// A frame: kind, count, the channels that follow as bits, nothing; the clock, when it was sent \[ms since 1970\], times
/// of a step and of a frame \[ms\] as doubles; then of every quantity its unit as a double, and its values in that as single
/// floats. A unit is a power of two, which keeps the digits, of the size of the largest value: floats go no further than 1e38.
fn encoded(frame: &Frame, step_time: f64, frame_time: f64) -> Bytes {
    let Frame { clock, displacements, channels } = frame;
    let mut bytes = Vec::with_capacity(48 + (8 + 4 * displacements.len()) * (2 + channels.len()));
    let bit = |(k, channel): (usize, &Option<Vec<f64>>)| u32::from(channel.is_some()) << k;
    let present: u32 = channels.iter().enumerate().map(bit).sum();
    for word in [FRAME, displacements.len() as u32, present, 0] {
        bytes.extend(word.to_le_bytes());
    }
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    for value in [*clock, 1e3 * since.as_secs_f64(), step_time, frame_time] {
        bytes.extend(value.to_le_bytes());
    }
    let channels = channels.iter().flatten().map(Vec::as_slice);
    for values in displacements.components().into_iter().chain(channels) {
        let sizes = values.iter().map(|value| value.abs()).filter(|size| size.is_finite());
        let largest = sizes.fold(0.0, f64::max);
        let unit = if largest > 0.0 { largest.log2().floor().exp2() } else { 1.0 };
        bytes.extend(unit.to_le_bytes());
        values.iter().for_each(|value| bytes.extend(((value / unit) as f32).to_le_bytes()));
    }
    bytes.into()
}

fn roles(roles: &[u8]) -> Bytes {
    let mut bytes = Vec::with_capacity(8 + roles.len());
    bytes.extend(ROLES.to_le_bytes());
    bytes.extend((roles.len() as u32).to_le_bytes());
    bytes.extend(roles);
    bytes.into()
}

/// Broken bonds as the page unpacks them: more of them, or all anew.
pub(super) fn broken(pairs: &[[u32; 2]], is_anew: bool) -> Bytes {
    let mut bytes = Vec::with_capacity(8 + 8 * pairs.len());
    bytes.extend(BROKEN.to_le_bytes());
    bytes.extend(u32::from(is_anew).to_le_bytes());
    pairs.iter().flatten().for_each(|end| bytes.extend(end.to_le_bytes()));
    bytes.into()
}

/// The numbers of a file that a page offers to change, by key.
fn numbers(raw: &Value) -> Vec<(String, Value)> {
    const TABLES: [&str; 7] = ["rule", "update", "material", "fracture", "lattice", "limits", "flight"];
    const MOST: usize = 24;
    let mut found = Vec::new();
    for table in TABLES {
        collect(table, &raw[table], &mut found);
    }
    found.retain(|(key, _)| {
        !["flight.seed", "flight.record_every", "flight.duration"].contains(&key.as_str())
    });
    found.truncate(MOST);
    found
}

fn collect(key: &str, value: &Value, found: &mut Vec<(String, Value)>) {
    match value {
        Value::Number(_) => found.push((key.to_owned(), value.clone())),
        Value::Object(table) => {
            table.iter().for_each(|(name, value)| collect(&format!("{key}.{name}"), value, found));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::vectors::Vectors;

    #[test]
    fn values_beyond_the_range_of_single_floats_are_sent_with_their_digits() {
        let displacements = Vectors { x: vec![1e-60, -3e-60], y: vec![2e60, 0.0] };
        let channels = vec![None, Some(vec![f64::NAN, 0.0])];
        let bytes = encoded(&Frame { clock: 1.0, displacements: displacements.clone(), channels }, 0.0, 0.0);
        let quantity = |bytes: &[u8]| -> Vec<f64> {
            let unit = f64::from_le_bytes(bytes[..8].try_into().expect("eight"));
            let part = |four: &[u8]| f32::from_le_bytes(four.try_into().expect("four"));
            bytes[8..].chunks(4).map(|four| unit * f64::from(part(four))).collect()
        };
        let sent: Vec<Vec<f64>> = bytes[48..].chunks(8 + 2 * 4).map(quantity).collect();
        for (sent, value) in sent[..2].concat().into_iter().zip(displacements.components().concat()) {
            assert!((sent - value).abs() <= 1e-7 * value.abs(), "{sent} for {value}");
        }
        assert!(sent[2][0].is_nan() && sent[2][1] == 0.0, "{sent:?}");
    }
}
