//! Processes that a test starts, listens to and ends; and bounded waits.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use flockform::flock::vectors::distance;
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::Control;
use serde_json::{Value as Json, json};

pub use crate::running::Running;
use crate::swarms::load_swarm;

/// Discovery on a computer whose loopback device carries no multicast takes up to ten seconds.
pub const PATIENCE: Duration = Duration::from_secs(30);

const CYCLONE: &str = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" \
     multicast=\"true\"/></Interfaces></General></Domain></CycloneDDS>";

/// Another domain with every call, away from those of other runs.
pub fn domain() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let here = NEXT.fetch_add(1, Ordering::Relaxed) % 32;
    101 + (std::process::id() % 4) as u16 * 32 + here
}

pub fn python(script: &str, arguments: &[&str]) -> Command {
    let python = std::env::var("FLOCKFORM_PYTHON").unwrap_or_else(|_| "python3".into());
    let mut command = Command::new(python);
    command
        .arg(format!("{}/tests/interop/{script}", env!("CARGO_MANIFEST_DIR")))
        .args(arguments)
        .env("CYCLONEDDS_URI", CYCLONE)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped());
    command
}

/// `flockform` with a subcommand, on loopback.
pub fn flockform(domain: u16, arguments: &[&str]) -> Running {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
    command
        .args(arguments)
        .env("ROS_DOMAIN_ID", domain.to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .stdin(Stdio::null());
    Running(command.spawn().expect("the binary starts"))
}

/// A peer in Python that is told and tells JSON, line by line.
pub struct Peer {
    name: &'static str,
    orders: ChildStdin,
    lines: Receiver<Json>,
    _running: Running,
}

impl Peer {
    pub fn start(script: &'static str, domain: u16, argument: &str) -> Self {
        Self::of(script, python(script, &[&domain.to_string(), argument]))
    }

    /// The process of a script that this command starts.
    pub fn of(script: &'static str, mut command: Command) -> Self {
        let mut child = command.spawn().expect("python starts");
        let orders = child.stdin.take().expect("piped");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        let (say, lines) = channel();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let Ok(line) = serde_json::from_str(&line) else { panic!("{script} says {line}") };
                if say.send(line).is_err() {
                    return;
                }
            }
        });
        Self { name: script, orders, lines, _running: Running(child) }
    }

    pub fn send(&mut self, order: Json) {
        writeln!(self.orders, "{order}").expect("it listens");
    }

    /// What `look` finds in a line that is said from now on (or was not looked at yet), in time.
    pub fn until<T>(&self, what: &str, mut look: impl FnMut(&Json) -> Option<T>) -> T {
        let since = Instant::now();
        let mut last = Json::Null;
        while let Some(rest) = PATIENCE.checked_sub(since.elapsed()) {
            let Ok(line) = self.lines.recv_timeout(rest) else { break };
            if let Some(found) = look(&line) {
                return found;
            }
            last = line;
        }
        panic!("{}: {what}: not within {PATIENCE:?}; the last line was\n{last}", self.name);
    }

    /// Forgets what was said before now.
    pub fn skip(&self) {
        while self.lines.try_recv().is_ok() {}
    }

    /// Looks at all that is said for so long.
    pub fn during(&self, time: Duration, mut look: impl FnMut(&Json)) {
        let since = Instant::now();
        while let Some(rest) = time.checked_sub(since.elapsed()) {
            if let Ok(line) = self.lines.recv_timeout(rest) {
                look(&line);
            }
        }
    }
}

/// The bundled square of 25 robots, and the same overrides as arguments of the command line.
pub struct Square {
    pub swarm: Swarm,
    arguments: Vec<String>,
}

/// A loop that keeps its patience with a busy computer.
pub const PATIENT: [&str; 3] = ["poses.fresh=4.0", "poses.age_limit=5.0", "poses.stop_after=9.0"];

/// A short flight. No faster: in the age of a pose each robot may have gone that far, and that much room is left
/// around it, so at 8 m/s robots 1.5 m apart block each other.
pub const SHORT: [&str; 2] =
    ["manoeuvres[0].legs=[{ seconds = 1.0, translate = [2.0, 0.5], rotate = 30.0 }]", "limits.speed=2.0"];

impl Square {
    pub fn new(overrides: &[&[&str]]) -> Self {
        Self::of("square", overrides)
    }

    pub fn of(name: &str, overrides: &[&[&str]]) -> Self {
        let overrides = overrides.concat();
        let mut arguments = vec![name.to_owned()];
        overrides.iter().for_each(|&one| arguments.extend(["--set", one].map(str::to_owned)));
        Self { swarm: load_swarm(name, &overrides), arguments }
    }

    pub fn control(&self) -> Control {
        Control::new(&self.swarm).expect("valid")
    }

    /// `flockform SUBCOMMAND` of it, with more arguments.
    pub fn start(&self, domain: u16, subcommand: &str, more: &[&str]) -> Running {
        let mut all = vec![subcommand];
        all.extend(self.arguments.iter().map(String::as_str));
        all.extend(more);
        flockform(domain, &all)
    }

    /// `flockform SUBCOMMAND` of it, for peers on all hosts.
    pub fn start_anywhere(&self, domain: u16, subcommand: &str) -> Running {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
        command.arg(subcommand).args(&self.arguments).env("ROS_DOMAIN_ID", domain.to_string());
        command.env_remove("ROS_AUTOMATIC_DISCOVERY_RANGE").stdin(Stdio::null());
        Running(command.spawn().expect("the binary starts"))
    }

    /// What `robots.py` is told, with the robots where `place` puts each from its place.
    pub fn spec(&self, place: impl Fn(&str, [f64; 2]) -> [f64; 2]) -> Json {
        let control = self.control();
        let formation = control.formation();
        // In the order of the formation, which an array needs.
        let robots: serde_json::Map<String, Json> = formation
            .names
            .iter()
            .zip(formation.places.iter())
            .map(|(name, nominal)| (name.clone(), json!(place(name, nominal))))
            .collect();
        json!({"robots": robots, "rate": 1.0 / control.period(), "frame": "map"})
    }

    pub fn robots(&self, domain: u16) -> Peer {
        Peer::start("robots.py", domain, &self.spec(|_, place| place).to_string())
    }
}

pub fn watch(domain: u16) -> Peer {
    Peer::start("watch.py", domain, "/flockform")
}

/// One entry of a report of `robots.py`.
pub fn place(report: &Json, name: &str) -> Option<[f64; 2]> {
    serde_json::from_value(report["places"][name].clone()).ok()
}

/// Targets received, by robot.
pub fn received(report: &Json) -> BTreeMap<String, u64> {
    serde_json::from_value(report["received"].clone()).expect("a report")
}

/// Largest distance of a robot from where it should be [m].
pub fn apart(report: &Json, names: &[String], should: impl Fn(usize) -> [f64; 2]) -> f64 {
    let away = |m: usize| place(report, &names[m]).map_or(f64::INFINITY, |at| distance(at, should(m)));
    (0..names.len()).map(away).fold(0.0, f64::max)
}

pub mod state {
    //! Entries of a line of `watch.py` that holds a formation's state.

    use super::Json;
    use flockform::messages::flockform_msgs::MemberState;

    /// The state in the line, if it is one.
    pub fn of(line: &Json) -> Option<&Json> {
        line.get("state")
    }

    pub fn members(state: &Json) -> impl Iterator<Item = &Json> {
        state["members"].as_array().expect("members").iter()
    }

    /// Names of those of whom something holds.
    pub fn who(state: &Json, holds: impl Fn(&Json) -> bool) -> Vec<String> {
        members(state)
            .filter(|one| holds(one))
            .map(|one| one["name"].as_str().expect("a name").into())
            .collect()
    }

    pub fn health(member: &Json) -> u8 {
        member["health"].as_u64().expect("a number") as u8
    }

    pub fn has(member: &Json, flag: u32) -> bool {
        member["flags"].as_u64().expect("a number") & u64::from(flag) != 0
    }

    pub fn all_fresh(state: &Json) -> bool {
        members(state).all(|one| health(one) == MemberState::FRESH)
    }

    /// The number under a key of a diagnostics line.
    pub fn diagnostic(line: &Json, key: &str) -> Option<f64> {
        line.get("diagnostics")?[key].as_str()?.parse().ok()
    }
}
