//! Node and robots in processes of their own, each with the keys of its enclave, and what others can do to them.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use flockform::messages::flockform_msgs::FormationState;
use flockform::messages::geometry_msgs::PoseStamped;
use flockform::messages::std_msgs::Empty;
use flockform::ros::arguments::RosArguments;
use flockform::ros::edge::pulse::MIDDLEWARE_GONE;
use flockform::ros::edge::{Edge, Node, Quality, Subscription};
use flockform::ros::node::FormationNode;
use flockform::ros::robots::{Layout, RobotNodes};

use super::exchange::{domain, plain, secured};
use super::keystore::*;
use super::process::status;
use super::running::Running;
use super::stranger::{Stranger, hidden, port};
use super::swarms::load_swarm;
use super::waits::within;

const PATIENCE: Duration = Duration::from_secs(60);
/// Growth of a process that is no growth \[kB\].
const GROWTH: u32 = 96 * 1024;
/// Which part a process has that a test starts from its own program.
const PART: &str = "FLOCKFORM_TEST_PART";

#[test]
#[ignore = "is the process that the others start"]
fn a_process_of_its_own() {
    static STOP: AtomicBool = AtomicBool::new(false);
    let Ok(part) = std::env::var(PART) else { return };
    std::thread::spawn(|| {
        // The end of its input is that of the test.
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        STOP.store(true, Ordering::Relaxed);
    });
    let swarm = load_swarm("square", &[]);
    let (_, arguments) =
        RosArguments::parse::<String>([], &|name| std::env::var(name).ok()).expect("a sound enclave");
    assert!(arguments.security.enclave.is_some());
    let is_well = if part == "node" {
        let mut node = FormationNode::open(&swarm, &arguments, None).expect("admitted");
        node.watch_middleware().expect("a watchdog");
        node.run_while(&STOP, &mut |_| true)
    } else {
        let mut robots = RobotNodes::open(&swarm, &arguments, Layout::OneNode).expect("admitted");
        robots.watch_middleware().expect("a watchdog");
        robots.run_while(&STOP, &mut |_| true)
    };
    std::process::exit(if is_well { 0 } else { MIDDLEWARE_GONE.into() });
}

fn start(part: &str, domain: u16, keystore: &Path) -> Running {
    let mut command = Command::new(std::env::current_exe().expect("a program"));
    command
        .args(["--exact", "nodes::a_process_of_its_own", "--ignored", "--nocapture"])
        .env(PART, part)
        .env("ROS_DOMAIN_ID", domain.to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env("ROS_SECURITY_ENABLE", "true")
        .env("ROS_SECURITY_STRATEGY", "Enforce")
        .env("ROS_SECURITY_KEYSTORE", keystore)
        .env("ROS_SECURITY_ENCLAVE_OVERRIDE", format!("/{part}"))
        .stdin(Stdio::piped());
    Running(command.spawn().expect("the test's own program starts"))
}

/// Memory in use of a process \[kB\].
fn resident(running: &Running) -> u32 {
    status(running.0.id(), "VmRSS").map_or(0, |kibibytes| kibibytes.parse().expect("a number"))
}

/// Takes part in the network and counts what of a flight it hears.
struct Watcher {
    pose: Subscription<PoseStamped>,
    target: Subscription<PoseStamped>,
    state: Subscription<FormationState>,
    poses: u32,
    targets: u32,
    mode: Option<u8>,
    node: Node,
}

impl Watcher {
    fn of(edge: &Edge) -> Self {
        let node = edge.node("/", "watcher").expect("a node");
        Self {
            pose: node.subscription("/robot_1/pose", Quality::BEST_EFFORT).expect("may subscribe"),
            target: node.subscription("/robot_1/target_pose", Quality::reliable(1)).expect("may subscribe"),
            state: node.subscription("/flockform/state", Quality::reliable(5)).expect("may subscribe"),
            poses: 0,
            targets: 0,
            mode: None,
            node,
        }
    }

    fn look(&mut self) {
        self.poses += std::iter::from_fn(|| self.pose.take()).take(100).count() as u32;
        self.targets += std::iter::from_fn(|| self.target.take()).take(100).count() as u32;
        if let Some((state, _)) = self.state.take_last() {
            self.mode = Some(state.mode);
        }
    }
}

/// A process of the flight, and how often it had to be started again.
struct Part {
    name: &'static str,
    process: Running,
    restarts: u32,
}

/// Robots and node, flying, and a peer that may watch and command.
struct Flight {
    domain: u16,
    keystore: PathBuf,
    watcher: Watcher,
    parts: [Part; 2],
    _edge: Edge,
}

impl Flight {
    fn begin(folder: &Path) -> Self {
        let domain = domain();
        let keystore = Keystore::make(folder, domain, GOVERNANCE);
        for part in ["robots", "node", "watcher"] {
            keystore.enclave(part, &EVERYTHING, &EVERYTHING);
        }
        let edge = secured(domain, &folder.join("enclaves/watcher"));
        let watcher = Watcher::of(&edge);
        let parts =
            ["robots", "node"].map(|name| Part { name, process: start(name, domain, folder), restarts: 0 });
        let mut flight = Self { domain, keystore: folder.to_owned(), watcher, parts, _edge: edge };
        let since = Instant::now();
        flight.go_on("in flight", || {});
        println!("in flight after {:?}", since.elapsed());
        flight
    }

    /// What the watcher hears now. Starts a process again that its watchdog has ended, as the program's supervisor does.
    fn look(&mut self) {
        self.watcher.look();
        for part in &mut self.parts {
            let Some(status) = part.process.0.try_wait().expect("a child") else { continue };
            assert_eq!(status.code(), Some(MIDDLEWARE_GONE.into()), "{} has ended", part.name);
            part.process = start(part.name, self.domain, &self.keystore);
            part.restarts += 1;
            println!("{}: restart {}", part.name, part.restarts);
        }
    }

    /// Waits until twenty more poses and targets have come.
    fn go_on(&mut self, what: &str, mut each: impl FnMut()) {
        let (poses, targets) = (self.watcher.poses, self.watcher.targets);
        within(PATIENCE, what, || {
            self.look();
            each();
            std::thread::sleep(Duration::from_millis(20));
            let Watcher { poses: now, targets: then, mode, .. } = &self.watcher;
            (*now > poses + 20 && *then > targets + 20 && mode.is_some()).then_some(())
        });
    }

    fn during(&mut self, time: Duration, mut each: impl FnMut(&mut Self)) {
        let since = Instant::now();
        while since.elapsed() < time {
            self.look();
            each(self);
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Memory in use of the processes \[kB\], with how often they were started.
    fn memory(&self) -> [(u32, u32); 2] {
        [0, 1].map(|k| (self.parts[k].restarts, resident(&self.parts[k].process)))
    }
}

#[test]
#[ignore = "needs the command openssl"]
fn a_secured_flight_is_read_and_commanded_by_those_with_keys_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut flight = Flight::begin(folder.path());
    let bare = plain(flight.domain);
    let mut stranger = Watcher::of(&bare);
    let stop = |watcher: &Watcher| {
        let topic = "/flockform/emergency_stop_request";
        watcher.node.publisher::<Empty>(topic, Quality::reliable(1)).expect("a publisher")
    };
    let theirs = stop(&stranger);
    flight.go_on("it goes on beside a stranger", || {
        stranger.look();
        // One that a full queue refuses is followed by others.
        let _ = theirs.publish(&Empty);
    });
    assert_eq!([stranger.poses, stranger.targets], [0, 0]);
    assert_eq!(stranger.mode, None);
    assert_ne!(flight.watcher.mode, Some(FormationState::EMERGENCY_STOPPED));
    let ours = stop(&flight.watcher);
    within(PATIENCE, "the stop", || {
        let _ = ours.publish(&Empty);
        std::thread::sleep(Duration::from_millis(20));
        flight.look();
        (flight.watcher.mode == Some(FormationState::EMERGENCY_STOPPED)).then_some(())
    });
}

#[test]
#[ignore = "needs the command openssl"]
fn promises_in_the_name_of_a_secured_peer_are_not_believed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut flight = Flight::begin(folder.path());
    let mut stranger = Stranger::come(flight.domain);
    within(PATIENCE, "names", || {
        stranger.listen();
        flight.look();
        (stranger.prefixes.len() >= 3).then_some(())
    });
    let before = flight.memory();
    flight.during(Duration::from_secs(10), |flight| {
        for prefix in stranger.prefixes.clone() {
            let packet = stranger.promise(prefix);
            for participant in 0..4 {
                stranger.send(&packet, port(flight.domain, participant));
                // The socket filter does not see it.
                stranger.send(&hidden(&packet), port(flight.domain, participant));
            }
        }
    });
    let after = flight.memory();
    println!("(restarts, kB): {before:?} before, {after:?} after");
    for ((lives, before), (lives_now, after)) in before.into_iter().zip(after) {
        assert!(lives != lives_now || after < before + GROWTH, "{before} kB before, {after} kB after");
    }
    flight.go_on("it goes on after the flood", || {});
}
