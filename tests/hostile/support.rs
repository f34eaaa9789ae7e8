//! Programs under attack, who watches them, and the packets.

use std::io::Read;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;

use flockform::ros::edge::{Edge, Options};
use flockform::scene::swarm::Swarm;

use crate::process::status;
pub use crate::running::Running;
pub use crate::signals::{is_sent, signal};
pub use crate::stranger::{Stranger, hidden, port};
use crate::swarms::load_swarm;
use crate::waits::within;

/// Another domain with every call, away from those of other runs.
pub fn domain() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    // Below those that the other tests take: a packet for a node must not meet a test.
    2 + (std::process::id() % 4) as u16 * 24 + NEXT.fetch_add(1, Ordering::Relaxed) % 24
}

pub fn edge(domain: u16) -> Edge {
    Edge::open(Options { domain, loopback_only: true }).expect("sockets")
}

pub fn square(overrides: &[&str]) -> Swarm {
    load_swarm("square", overrides)
}

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_flockform");

pub fn command(domain: u16, arguments: &[&str]) -> Command {
    command_of(Path::new(PROGRAM), domain, arguments)
}

/// The same with another file of the program.
pub fn command_of(program: &Path, domain: u16, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command
        .args(arguments)
        .env("ROS_DOMAIN_ID", domain.to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command
}

/// Runs to its end, which comes by itself.
pub fn output(command: &mut Command) -> Output {
    let mut running = Running::start(command);
    let code = until("the program ends", || running.0.try_wait().expect("a child"));
    let mut stderr = Vec::new();
    running.0.stderr.take().expect("piped").read_to_end(&mut stderr).expect("readable");
    Output { status: code, stdout: Vec::new(), stderr }
}

impl Running {
    pub fn start(command: &mut Command) -> Self {
        Self(command.spawn().expect("the binary starts"))
    }

    /// What it wrote so far is read by a thread, line by line.
    pub fn lines(&mut self) -> std::sync::mpsc::Receiver<String> {
        use std::io::{BufRead, BufReader};
        let (say, lines) = std::sync::mpsc::channel();
        let output = BufReader::new(self.0.stderr.take().expect("piped"));
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                if say.send(line).is_err() {
                    return;
                }
            }
        });
        lines
    }

    /// The process that does the work.
    pub fn worker(&self) -> Option<u32> {
        let own = self.0.id();
        let all = std::fs::read_dir("/proc").ok()?.flatten();
        let number = |entry: std::fs::DirEntry| entry.file_name().to_str()?.parse::<u32>().ok();
        all.filter_map(number).find(|&process| parent(process) == Some(own) && has_begun(process))
    }
}

/// Whether a worker has its own environment: until then the process that starts it waits for it, and one that is stopped then keeps
/// both from going on.
fn has_begun(process: u32) -> bool {
    let environment = std::fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
    environment.split(|&byte| byte == 0).any(|variable| variable.starts_with(b"FLOCKFORM_LIFE="))
}

fn parent(process: u32) -> Option<u32> {
    status(process, "PPid")?.parse().ok()
}

/// Memory in use [kB].
pub fn resident(process: u32) -> u32 {
    status(process, "VmRSS").map_or(0, |kibibytes| kibibytes.parse().expect("a number"))
}

pub const PATIENCE: Duration = Duration::from_secs(30);

/// What `look` finds in time.
pub fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    within(PATIENCE, what, look)
}
