//! Programs under attack, who watches them, and the packets.

use std::io::Read;
use std::net::{Ipv4Addr, UdpSocket};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;

use flockform::ros::edge::{Edge, Options};
use flockform::scene::swarm::Swarm;

pub use crate::running::Running;
pub use crate::signals::signal;
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

pub fn command(domain: u16, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
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
        all.filter_map(number).find(|&process| parent(process) == Some(own))
    }
}

fn parent(process: u32) -> Option<u32> {
    status(process, "PPid:")
}

/// Memory in use [kB].
pub fn resident(process: u32) -> u32 {
    status(process, "VmRSS:").unwrap_or(0)
}

fn status(process: u32, key: &str) -> Option<u32> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix(key))?.split_whitespace().next()?.parse().ok()
}

pub const PATIENCE: Duration = Duration::from_secs(30);

/// What `look` finds in time.
pub fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    within(PATIENCE, what, look)
}

/// The port where a participant hears of others, by its number on this computer.
pub fn port(domain: u16, participant: u16) -> u16 {
    7410 + 250 * domain + 2 * participant
}

/// A listener, in a place where participants look for others on this computer.
pub struct Stranger {
    pub socket: UdpSocket,
    pub prefixes: Vec<[u8; 12]>,
    /// Some that came.
    pub packets: Vec<Vec<u8>>,
    count: i32,
    /// Whose name it does not take: who is to judge has to hear.
    spared: Option<[u8; 12]>,
}

impl Stranger {
    pub fn come(domain: u16) -> Self {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, port(domain, 9))).expect("a free port");
        socket.set_nonblocking(true).expect("a socket");
        Self { socket, prefixes: Vec::new(), packets: Vec::new(), count: 1 << 20, spared: None }
    }

    /// Takes this name no more.
    pub fn spare(&mut self, prefix: [u8; 12]) {
        self.spared = Some(prefix);
        self.prefixes.retain(|one| *one != prefix);
        self.packets.retain(|packet| packet[8..20] != prefix);
    }

    /// The participants it has heard of.
    pub fn listen(&mut self) {
        let mut packet = [0; 65_536];
        while let Ok(length) = self.socket.recv(&mut packet) {
            let Some(prefix) = packet[..length].get(8..20).and_then(|bytes| bytes.try_into().ok()) else {
                continue;
            };
            if self.spared == Some(prefix) {
                continue;
            }
            if self.packets.len() < 16 {
                self.packets.push(packet[..length].to_vec());
            }
            if !self.prefixes.contains(&prefix) {
                self.prefixes.push(prefix);
            }
        }
    }

    /// A heartbeat in the name of a participant, which promises more than any memory holds.
    pub fn promise(&mut self, prefix: [u8; 12]) -> Vec<u8> {
        self.count += 1;
        let mut packet = Vec::from(*b"RTPS\x02\x03\x01\x12");
        packet.extend(prefix);
        packet.extend([0x07, 0x01, 28, 0]);
        packet.extend([0, 0, 3, 0xc7, 0, 0, 3, 0xc2]);
        // Numbers are a high word and a low one: 1, and 2^62.
        for word in [0, 1, 1 << 30, 0, self.count] {
            packet.extend(i32::to_le_bytes(word));
        }
        assert_eq!(packet.len(), 52);
        packet
    }

    pub fn send(&self, packet: &[u8], port: u16) {
        // A port that nobody has is as good as one that does not answer.
        let _ = self.socket.send_to(packet, (Ipv4Addr::LOCALHOST, port));
    }
}
