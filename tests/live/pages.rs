//! The program with a page, and a viewer that is no browser.

use std::fs::File;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use serde_json::{Value, json};
use tungstenite::client::ClientRequestBuilder;
use tungstenite::{Message, WebSocket};

use super::running::Running;
use super::served::parts;
use super::strangers::PATIENCE;
use super::waits::within;

/// Starts the program in a folder, where what it prints goes to a file `printed`.
pub fn start(arguments: &[&str], folder: &Path) -> Running {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
    // Above the domains of other tests, which may run meanwhile.
    command.args(arguments).env("ROS_DOMAIN_ID", (229 + std::process::id() % 4).to_string());
    command.env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST").env_remove("RUST_LOG");
    let printed = File::create(folder.join("printed")).expect("a file");
    command.current_dir(folder).stdin(Stdio::null()).stdout(printed).stderr(Stdio::null());
    Running(command.spawn().expect("the program starts"))
}

/// Host with port, and token, that a program in this folder prints.
pub fn address(folder: &Path) -> (String, String) {
    let line = || {
        std::fs::read_to_string(folder.join("printed"))
            .ok()?
            .split_once('\n')
            .map(|(line, _)| line.to_owned())
    };
    parts(&within(PATIENCE, "an address", line))
}

/// A page without a browser.
pub struct Viewer {
    socket: WebSocket<TcpStream>,
    /// The last frame.
    pub frame: Vec<u8>,
}

impl Viewer {
    /// Unless it is not let in.
    pub fn enter(host: &str, token: &str) -> Option<Self> {
        let stream = TcpStream::connect(host).ok()?;
        stream.set_read_timeout(Some(PATIENCE)).ok()?;
        let uri = format!("ws://{host}/socket?token={token}").parse().expect("an address");
        let request = ClientRequestBuilder::new(uri).with_header("Origin", format!("http://{host}"));
        let (socket, _) = tungstenite::client(request, stream).ok()?;
        Some(Self { socket, frame: Vec::new() })
    }

    /// The first of a program in this folder.
    pub fn of(folder: &Path) -> Self {
        let (host, token) = address(folder);
        within(PATIENCE, "a viewer is let in", || Self::enter(&host, &token))
    }

    /// Whether a ping is answered, as clients that watch over a connection expect.
    pub fn pings(&mut self, payload: &'static [u8]) -> bool {
        self.socket.send(Message::Ping(payload.into())).expect("sent");
        let since = Instant::now();
        while since.elapsed() < PATIENCE {
            match self.socket.read().expect("open") {
                Message::Pong(answer) => return answer == payload,
                _ => continue,
            }
        }
        false
    }

    pub fn ask(&mut self, command: &Value) {
        self.socket.send(Message::text(command.to_string())).expect("sent");
    }

    /// The first event that `holds`; frames before it are drawn.
    pub fn until(&mut self, what: &str, mut holds: impl FnMut(&Value, &[u8]) -> bool) -> Value {
        let since = Instant::now();
        while since.elapsed() < PATIENCE {
            match self.socket.read().unwrap_or_else(|error| panic!("{what}: {error}")) {
                Message::Text(text) => {
                    let event: Value = serde_json::from_str(&text).expect("JSON");
                    if holds(&event, &self.frame) {
                        return event;
                    }
                }
                Message::Binary(bytes) if bytes[0] == 1 => {
                    self.frame = bytes.to_vec();
                    self.ask(&json!({ "do": "drawn", "ms": 1.0 }));
                }
                _ => {}
            }
        }
        panic!("{what}: not within {PATIENCE:?}");
    }

    pub fn status(&mut self, what: &str, mut holds: impl FnMut(&Value) -> bool) -> Value {
        self.until(what, |event, _| event["event"] == "status" && holds(event))
    }

    /// What came of a command: whether it was done, and the words.
    pub fn done(&mut self, command: Value) -> (bool, String) {
        self.ask(&command);
        let answer =
            self.until("an answer", |event, _| event["event"] == "done" || event["event"] == "refused");
        (answer["event"] == "done", answer["words"].as_str().expect("words").to_owned())
    }

    pub fn mode(&mut self, mode: &str) {
        self.status(mode, |status| status["node"]["mode"].as_str().is_some_and(|now| now.starts_with(mode)));
    }

    pub fn until_all_poses_are_received(&mut self) -> Value {
        self.status("every pose is received", |status| {
            status["faults"] == json!([]) && status["clock"] != 0.0
        })
    }
}
