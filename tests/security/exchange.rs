//! Participants in one process: with keys, with others' keys, with fewer permissions, and without any.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use flockform::messages::geometry_msgs::{Pose, PoseStamped};
use flockform::ros::edge::{Edge, Node, Options, Publisher, Quality, Subscription};

use super::keystore::*;
use super::running::Running;
use super::waits::within;

const PATIENCE: Duration = Duration::from_secs(30);

/// Another domain with every call, away from those of other runs.
pub fn domain() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    // The ports of these lie below those that the system hands out.
    2 + (std::process::id() % 4) as u16 * 24 + NEXT.fetch_add(1, Ordering::Relaxed) % 24
}

fn options(domain: u16) -> Options {
    Options { domain, loopback_only: true }
}

pub fn secured(domain: u16, enclave: &Path) -> Edge {
    Edge::open_in_enclave(options(domain), enclave).expect("admitted")
}

pub fn plain(domain: u16) -> Edge {
    Edge::open(options(domain)).expect("sockets")
}

/// A node, and both ends of `/pose`.
struct Peer {
    out: Publisher<PoseStamped>,
    poses: Subscription<PoseStamped>,
    heard: Vec<String>,
    name: &'static str,
    _node: Node,
}

impl Peer {
    fn of(edge: &Edge, name: &'static str) -> Self {
        let node = edge.node("/", name).expect("a node");
        let out = node.publisher("/pose", Quality::reliable(1)).expect("may publish");
        let poses = node.subscription("/pose", Quality::reliable(10)).expect("may subscribe");
        Self { out, poses, heard: Vec::new(), name, _node: node }
    }

    fn turn(&mut self) {
        let mut pose = PoseStamped { pose: Pose::planar([1.0, 2.0], 0.5), ..PoseStamped::default() };
        pose.header.frame_id = self.name.into();
        // One that a full queue refuses is followed by others.
        let _ = self.out.publish(&pose);
        while let Some((pose, _)) = self.poses.take() {
            assert_eq!(pose.pose.position.y, 2.0);
            self.heard.push(pose.header.frame_id);
        }
    }

    /// How often it has heard the peer of this name.
    fn count(&self, name: &str) -> usize {
        self.heard.iter().filter(|one| *one == name).count()
    }

    fn has_heard(&self, name: &str) -> bool {
        self.count(name) > 0
    }
}

fn all<const N: usize>(peers: [&mut Peer; N]) {
    std::thread::sleep(Duration::from_millis(20));
    peers.into_iter().for_each(Peer::turn);
}

fn during(time: Duration, mut each: impl FnMut()) {
    let since = Instant::now();
    while since.elapsed() < time {
        each();
    }
}

#[test]
#[ignore = "needs the command openssl"]
fn peers_of_one_keystore_exchange_and_nobody_else_reads_or_is_heard() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = domain();
    let keystore = Keystore::make(&folder.path().join("ours"), domain, GOVERNANCE);
    let others = Keystore::make(&folder.path().join("others"), domain, GOVERNANCE);
    let enclave = |keystore: &Keystore, name| keystore.enclave(name, &EVERYTHING, &EVERYTHING);
    let [one, two] = ["fleet/one", "two"].map(|name| secured(domain, &enclave(&keystore, name)));
    let outsider = secured(domain, &enclave(&others, "outsider"));
    let bare = plain(domain);
    let (mut one, mut two) = (Peer::of(&one, "one"), Peer::of(&two, "two"));
    let (mut outsider, mut bare) = (Peer::of(&outsider, "outsider"), Peer::of(&bare, "bare"));
    within(PATIENCE, "fifty each way", || {
        all([&mut one, &mut two, &mut outsider, &mut bare]);
        (one.count("two") > 50 && two.count("one") > 50).then_some(())
    });
    for peer in [&one, &two] {
        assert!(!peer.has_heard("bare") && !peer.has_heard("outsider"), "{}: {:?}", peer.name, peer.heard);
    }
    for peer in [&outsider, &bare] {
        assert!(!peer.has_heard("one") && !peer.has_heard("two"), "{}: {:?}", peer.name, peer.heard);
    }
}

#[test]
#[ignore = "needs the command openssl"]
fn a_peer_publishes_and_subscribes_to_what_its_permissions_allow_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = domain();
    let keystore = Keystore::make(folder.path(), domain, GOVERNANCE);
    let graph = "ros_discovery_info";
    let listener = keystore.enclave("listener", &[graph], &[graph, "rt/pose"]);
    let speaker = keystore.enclave("speaker", &[graph, "rt/pose"], &[graph]);
    let open = |enclave: &Path, name| secured(domain, enclave).node("/", name).expect("a node");
    let (listener, speaker) = (open(&listener, "listener"), open(&speaker, "speaker"));
    let poses = listener.subscription::<PoseStamped>("/pose", Quality::reliable(10)).expect("allowed");
    let out = speaker.publisher::<PoseStamped>("/pose", Quality::reliable(10)).expect("allowed");
    within(PATIENCE, "a pose", || {
        // One that a full queue refuses is followed by others.
        let _ = out.publish(&PoseStamped::default());
        std::thread::sleep(Duration::from_millis(20));
        poses.take()
    });
    let refusals = [
        listener.publisher::<PoseStamped>("/pose", Quality::reliable(1)).err(),
        listener.publisher::<PoseStamped>("/other", Quality::reliable(1)).err(),
        speaker.subscription::<PoseStamped>("/pose", Quality::reliable(1)).err(),
        speaker.subscription::<PoseStamped>("/other", Quality::reliable(1)).err(),
    ];
    for refusal in refusals {
        let said = refusal.expect("not allowed").to_string();
        assert!(
            said.contains("rt/") && said.contains("permissions") && said.contains("Not allowed to"),
            "{said}"
        );
    }
}

#[test]
#[ignore = "needs the command openssl"]
fn peers_look_at_the_permissions_of_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = domain();
    let keystore = Keystore::make(folder.path(), domain, GOVERNANCE);
    let [honest, witness, insider] =
        ["honest", "witness", "insider"].map(|name| keystore.enclave(name, &EVERYTHING, &EVERYTHING));
    // It is opened while it may do everything, and meets those who come when it no longer may.
    let begun = Instant::now();
    let end = Duration::from_secs(20);
    let few = ["ros_discovery_info"];
    keystore.permit_until("insider", end, [&few, &few]);
    let insider = secured(domain, &insider);
    let mut insider = Peer::of(&insider, "insider");
    assert!(begun.elapsed() < end, "this computer is too slow for this test");
    std::thread::sleep((end + Duration::from_secs(2)).saturating_sub(begun.elapsed()));
    let (honest, witness) = (secured(domain, &honest), secured(domain, &witness));
    let (mut honest, mut witness) = (Peer::of(&honest, "honest"), Peer::of(&witness, "witness"));
    within(PATIENCE, "fifty each way", || {
        all([&mut honest, &mut witness, &mut insider]);
        (honest.count("witness") > 50 && witness.count("honest") > 50).then_some(())
    });
    assert!(!honest.has_heard("insider") && !witness.has_heard("insider"));
    assert!(!insider.has_heard("honest") && !insider.has_heard("witness"));
}

/// A participant of Fast DDS, compiled here; what it has heard comes line by line.
fn fast_dds(folder: &Path, domain: u16, enclave: &Path) -> (Running, Receiver<String>) {
    let program = folder.join("fastdds_peer");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/security/fastdds_peer.cpp");
    let libraries = ["-lfastrtps", "-lfastcdr"];
    let compiled =
        Command::new("g++").args(["-std=c++17", "-o"]).arg(&program).arg(source).args(libraries).status();
    assert!(compiled.expect("g++ is there").success(), "the peer is compiled with Debian's libfastrtps-dev");
    let mut child = Command::new(program)
        .arg(domain.to_string())
        .args([enclave.as_os_str(), "fast".as_ref()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let output = BufReader::new(child.stdout.take().expect("piped"));
    let (say, lines) = channel();
    std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| say.send(line)));
    (Running(child), lines)
}

#[test]
#[ignore = "needs g++, Fast DDS (Debian's libfastrtps-dev) and the command openssl"]
fn fast_dds_with_keys_of_the_same_keystore_exchanges_and_with_others_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = domain();
    let keystore = Keystore::make(&folder.path().join("ours"), domain, GOVERNANCE);
    let others = Keystore::make(&folder.path().join("others"), domain, GOVERNANCE);
    let ours = secured(domain, &keystore.enclave("ours", &EVERYTHING, &EVERYTHING));
    let mut ours = Peer::of(&ours, "ours");
    let has_heard = |lines: &Receiver<String>| lines.try_iter().any(|line| line == "heard ours");
    {
        let enclave = others.enclave("fast", &EVERYTHING, &EVERYTHING);
        let (_running, lines) = fast_dds(folder.path(), domain, &enclave);
        within(PATIENCE, "it is ready", || lines.try_iter().find(|line| line == "ready"));
        during(Duration::from_secs(4), || all([&mut ours]));
        assert!(!has_heard(&lines) && !ours.has_heard("fast"));
    }
    let enclave = keystore.enclave("fast", &EVERYTHING, &EVERYTHING);
    let (_running, lines) = fast_dds(folder.path(), domain, &enclave);
    let mut is_heard = false;
    within(PATIENCE, "each hears the other", || {
        all([&mut ours]);
        is_heard |= has_heard(&lines);
        (is_heard && ours.has_heard("fast")).then_some(())
    });
}
