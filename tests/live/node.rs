//! A flying swarm in the page of its node: robots and node as programs over DDS on loopback, and viewers.

use std::io::Write;
use std::net::TcpStream;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::json;

use super::folders::temporary;
use super::pages::{Viewer, address, start};
use super::running::Running;
use super::signals::signal;
use super::strangers::{PATIENCE, answer, let_in, masked, socket_request, soon};
use super::waits::within;

/// One flight at a time: the processes of several would wait for each other.
static TURN: Mutex<()> = Mutex::new(());

/// A node with a page, and its simulated robots.
pub struct Flown {
    node: Running,
    _robots: Running,
    host: String,
    token: String,
    _folders: [tempfile::TempDir; 2],
    _turn: MutexGuard<'static, ()>,
}

impl Flown {
    pub fn begin(more: &[&str]) -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = temporary();
        let elsewhere = temporary();
        let _robots = start(&["robots", "square"], elsewhere.path());
        let node = start(&[&["node", "square", "--live"], more].concat(), folder.path());
        let (host, token) = address(folder.path());
        Self { node, _robots, host, token, _folders: [folder, elsewhere], _turn: turn }
    }

    pub fn address(&self) -> String {
        format!("http://{}/?token={}", self.host, self.token)
    }

    fn port(&self) -> u16 {
        self.host.rsplit(':').next().and_then(|port| port.parse().ok()).expect("a port")
    }

    /// The request for a socket.
    fn asks(&self) -> String {
        let origin = format!("Origin: http://{}\r\n", self.host);
        socket_request(&self.token, &self.host, &origin)
    }

    fn viewer(&self) -> Viewer {
        within(PATIENCE, "a viewer is let in", || self.try_viewer())
    }

    fn try_viewer(&self) -> Option<Viewer> {
        Viewer::enter(&self.host, &self.token)
    }
}

/// Of a frame: the clock, then displacements and channels, shape \[quantities\]\[robots\].
fn decoded(frame: &[u8]) -> (f64, Vec<Vec<f32>>) {
    let count = u32::from_le_bytes(frame[4..8].try_into().expect("four")) as usize;
    let clock = f64::from_le_bytes(frame[16..24].try_into().expect("eight"));
    let quantity = |quantity: &[u8]| {
        let unit = f64::from_le_bytes(quantity[..8].try_into().expect("eight")) as f32;
        let part = |four: &[u8]| f32::from_le_bytes(four.try_into().expect("four"));
        quantity[8..].chunks(4).map(|four| unit * part(four)).collect()
    };
    (clock, frame[48..].chunks(8 + 4 * count).map(quantity).collect())
}

#[test]
fn a_flying_swarm_is_shown_on_this_computer_alone_and_can_only_be_read() {
    let flown = Flown::begin(&["--set", "flight.bounds.clearance=5.0"]);
    let begun = flown.viewer().status("its command", |_| true)["command"].clone();
    assert_eq!(begun, "flockform node square --live --set flight.bounds.clearance=5.0");
    assert!(flown.host.starts_with("127.0.0.1:"));
    // An address of this computer that is not 127.0.0.1, as those of its networks are.
    assert!(TcpStream::connect(("127.0.0.2", flown.port())).is_err());
    let page = |token: &str| {
        answer(&flown.host, &format!("GET /?token={token} HTTP/1.1\r\nHost: {}\r\n\r\n", flown.host))
    };
    assert!(page("").starts_with("HTTP/1.1 403") && page(&flown.token).starts_with("HTTP/1.1 200"));
    let mut viewer = flown.viewer();
    viewer.until_all_poses_are_received();
    let status = viewer.status("a broken bound", |status| status["alarms"] != json!([]));
    let words = status["alarms"][0].as_str().expect("words");
    assert!(words.starts_with("clearance: declared 5 m, now") && words.contains("robot_"), "{words}");
    assert!(status["alarmed"].as_array().is_some_and(|robots| robots.len() >= 2), "{status}");
    let (_, quantities) = decoded(&viewer.frame);
    // Displacements, clearance, distance from place, age, PE1, strain, and targets.
    assert_eq!((quantities.len(), quantities[0].len()), (9, 25));
    let is_known = |k: &usize| quantities[*k].iter().all(|value| value.is_finite());
    assert!([0, 1, 2, 3, 4, 7, 8].iter().all(is_known), "{quantities:?}");
    let asked = [
        json!({ "do": "emergency-stop" }),
        json!({ "do": "deactivate" }),
        json!({ "do": "set-formation", "translate": [1.0, 0.0], "duration": 9.0 }),
        json!({ "do": "pause" }),
        json!({ "do": "save" }),
        json!({ "do": "grab", "particle": 0 }),
    ];
    for command in asked {
        let (done, words) = viewer.done(command);
        assert!(!done && words.contains("--allow-commands"), "{words}");
    }
    let before = viewer.status("a state", |_| true)["clock"].as_f64().expect("a clock");
    let later = viewer.status("it flies on", |status| status["clock"].as_f64() > Some(before + 0.2));
    assert_eq!(later["node"]["mode"], "running");
}

#[test]
fn deaf_viewers_floods_and_garbage_do_not_hold_up_the_loop() {
    let flown = Flown::begin(&["--allow-commands", "--set", "node.commands=none"]);
    let mut viewer = flown.viewer();
    viewer.until_all_poses_are_received();
    // They take nothing of what they are sent.
    let deaf: Vec<TcpStream> = (0..3).map(|_| let_in(&flown.host, &flown.asks())).collect();
    let mut loud = let_in(&flown.host, &flown.asks());
    loud.set_write_timeout(Some(PATIENCE)).expect("a socket");
    let garbage = (0..40).filter_map(|_| {
        let mut stream = TcpStream::connect(&flown.host).ok()?;
        stream.write_all(b"GET / HTTP/1.1\r\nX: ").ok().map(|()| stream)
    });
    let garbage: Vec<TcpStream> = garbage.collect();
    let flood = std::thread::spawn(move || {
        let text = br#"{"do":"set-formation","translate":[1,0],"duration":9}"#;
        let frames = masked(text).repeat(100);
        (0..200).take_while(|_| loud.write_all(&frames).is_ok()).count()
    });
    let clock = |viewer: &mut Viewer, than: f64| {
        let status = viewer.status("the loop ticks", |status| status["clock"].as_f64() > Some(than));
        status["clock"].as_f64().expect("a clock")
    };
    let (before, since) = (clock(&mut viewer, 0.0), Instant::now());
    let after = clock(&mut viewer, before + 3.0);
    let pace = (after - before) / since.elapsed().as_secs_f64();
    println!(
        "the loop's clock went at {pace:.2} of the time; {} parts of the flood",
        flood.join().expect("ends")
    );
    // A program's time goes on with every tick: 1, but for the load of other tests.
    assert!(pace > 0.5, "{pace}");
    drop((deaf, garbage));
    soon("viewers are let in as before", || flown.try_viewer().is_some());
}

#[test]
fn commands_of_the_page_are_the_node_s_own_and_a_new_process_serves_the_same_address() {
    let flown = Flown::begin(&["--allow-commands"]);
    let mut viewer = flown.viewer();
    viewer.until_all_poses_are_received();
    let fast = json!({ "do": "set-formation", "translate": [9.0, 0.0], "duration": 0.1 });
    let (done, words) = viewer.done(fast);
    assert!(!done && words.contains("duration of at least"), "{words}");
    let (done, words) = viewer.done(json!({ "do": "pause" }));
    assert!(!done && words.contains("no such command"), "{words}");
    let moved = json!({ "do": "set-formation", "translate": [1.0, 0.5], "duration": 3.0 });
    assert_eq!(viewer.done(moved), (true, "under way for 3 s".to_owned()));
    viewer.until("the robots are there", |_, frame| {
        let (_, quantities) = decoded(frame);
        let all_at = |k: usize, to: f32| quantities[k].iter().all(|moved: &f32| (moved - to).abs() < 0.05);
        all_at(0, 1.0) && all_at(1, 0.5)
    });
    assert!(viewer.done(json!({ "do": "deactivate" })).0);
    viewer.mode("inactive");
    assert!(viewer.done(json!({ "do": "activate" })).0);
    viewer.mode("running");
    assert!(viewer.done(json!({ "do": "emergency-stop" })).0);
    viewer.mode("emergency stop");
    // The process of the control loop, which serves the page too.
    let outer = flown.node.0.id();
    let inner = std::fs::read_to_string(format!("/proc/{outer}/task/{outer}/children")).expect("listed");
    // Its state is sent ten times a second.
    std::thread::sleep(Duration::from_millis(300));
    signal("KILL", inner.trim().parse().expect("one process"));
    let mut viewer = flown.viewer();
    viewer.until_all_poses_are_received();
    viewer.mode("emergency stop");
    assert!(viewer.done(json!({ "do": "resume" })).0);
    viewer.mode("running");
}

#[test]
fn the_page_may_command_what_the_swarm_file_allows() {
    let mut flown = Flown::begin(&["--allow-commands", "--set", "node.commands=stop-only"]);
    let mut viewer = flown.viewer();
    viewer.until_all_poses_are_received();
    assert!(viewer.done(json!({ "do": "emergency-stop" })).0);
    viewer.mode("emergency stop");
    let moved = json!({ "do": "set-formation", "translate": [1.0, 0.5], "duration": 3.0 });
    for command in [json!({ "do": "resume" }), json!({ "do": "activate" }), moved] {
        let (done, words) = viewer.done(command);
        assert!(!done && words.contains("stop-only"), "{words}");
    }
    viewer.mode("emergency stop");
    assert_eq!(flown.node.terminate(), Some(0), "a viewer does not hold up the end");
}
