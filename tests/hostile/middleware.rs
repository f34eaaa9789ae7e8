//! The middleware dies, goes deaf or eats the memory; the swarm must not.

use std::path::Path;
use std::process::Command;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use flockform::flock::vectors::distance;
use flockform::messages::flockform_msgs::FormationState;
use flockform::messages::geometry_msgs::{PoseStamped, Twist};
use flockform::messages::lifecycle_msgs::{ChangeState, ChangeStateRequest, Transition};
use flockform::messages::std_msgs::Empty;
use flockform::messages::std_srvs;
use flockform::ros::edge::{Edge, Node, Quality, Subscription};
use flockform::swarm::control::Control;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use ros2_client::ServiceMapping;

use super::peers;
use super::support::*;

/// Robots that fly slowly for minutes.
pub const LONG: [&str; 1] = ["manoeuvres[0].legs=[{ seconds = 300.0, translate = [60.0, 0.0] }]"];

fn arguments(subcommand: &'static str, overrides: &[&'static str]) -> Vec<&'static str> {
    let mut all = vec![subcommand, "square"];
    overrides.iter().for_each(|one| all.extend(["--set", one]));
    all
}

/// Who sees all poses and targets, and judges them.
pub struct Judge {
    control: Control,
    /// A robot whose poses are others' too.
    pub liar: Option<usize>,
    poses: Vec<Subscription<PoseStamped>>,
    targets: Vec<Subscription<PoseStamped>>,
    state: Subscription<FormationState>,
    places: Vec<Option<(f64, [f64; 2])>>,
    /// When each robot was last sent somewhere, and was last seen to move.
    sent: Vec<Instant>,
    last_state: Option<FormationState>,
    states: u64,
    /// Longest time without targets [s].
    silence: f64,
    /// Where each robot was a second after its last target, and how far one went from there [m].
    held: Vec<Option<[f64; 2]>>,
    coast: f64,
    _node: Node,
}

impl Judge {
    fn sit(edge: &Edge, overrides: &[&str]) -> Self {
        let control = Control::new(&square(overrides)).expect("valid");
        let node = edge.node("/", "judge").expect("a node");
        let each = |leaf: &str, quality| {
            let names = control.formation().names.iter();
            names.map(|name| node.subscription(&format!("/{name}/{leaf}"), quality).expect("hears")).collect()
        };
        let count = control.formation().count();
        Self {
            poses: each("pose", Quality::BEST_EFFORT),
            targets: each("target_pose", Quality::reliable(1)),
            state: node.subscription("/flockform/state", Quality::reliable(5)).expect("hears"),
            places: vec![None; count],
            sent: vec![Instant::now(); count],
            last_state: None,
            states: 0,
            silence: 0.0,
            held: vec![None; count],
            coast: 0.0,
            liar: None,
            control,
            _node: node,
        }
    }

    fn look(&mut self) {
        let limits = self.control.limits().clone();
        let period = self.control.period();
        if let Some(liar) = self.liar {
            (self.places[liar], self.sent[liar]) = (None, Instant::now());
        }
        for m in (0..self.poses.len()).filter(|&m| self.liar != Some(m)) {
            while let Some((pose, _)) = self.poses[m].take() {
                let (stamp, at) = (pose.header.stamp.seconds(), [pose.pose.position.x, pose.pose.position.y]);
                if let Some((before, from)) = self.places[m] {
                    let far = distance(at, from);
                    // Two periods may be told in one and a bit, by a simulator that a busy computer held up.
                    let most = limits.speed * (stamp - before).max(period) * 3.0;
                    assert!(far <= most + 1e-9, "robot {m} leapt {far} m in {} s", stamp - before);
                }
                self.places[m] = Some((stamp, at));
                if self.sent[m].elapsed() > Duration::from_secs(1) {
                    let held = *self.held[m].get_or_insert(at);
                    self.coast = self.coast.max(distance(at, held));
                }
            }
            while let Some((target, _)) = self.targets[m].take() {
                let to = [target.pose.position.x, target.pose.position.y];
                let Some((stamp, at)) = self.places[m] else { continue };
                // The pose that it was computed from may be a few periods old. Where the judge's own middleware is
                // attacked, the last pose is older still, or the target comes late: the robot has moved on between them.
                let between = (target.header.stamp.seconds() - stamp).abs();
                let (far, most) = (distance(to, at), limits.speed * (10.0 * period + between));
                assert!(
                    far <= most + 1e-9,
                    "robot {m} is sent {far} m away, {between} s from the judge's last pose of it"
                );
                (self.sent[m], self.held[m]) = (Instant::now(), None);
            }
        }
        let quiet = self.sent.iter().map(Instant::elapsed).max().unwrap_or_default().as_secs_f64();
        self.silence = self.silence.max(quiet);
        if let Some((state, _)) = self.state.take_last() {
            self.states += 1;
            self.last_state = Some(state);
        }
        let places: Vec<[f64; 2]> = self.places.iter().flatten().map(|(_, at)| *at).collect();
        let radii = &self.control.formation().radii;
        for a in 0..places.len() {
            for b in a + 1..places.len() {
                let gap = distance(places[a], places[b]) - radii[a] - radii[b];
                // Poses of one period come one after another: one robot may be a period ahead of another.
                assert!(
                    gap >= limits.clearance - 2.0 * limits.speed * period,
                    "{a} and {b} are {gap} m apart"
                );
            }
        }
    }

    pub fn during(&mut self, time: Duration, mut each: impl FnMut()) {
        let since = Instant::now();
        while since.elapsed() < time {
            self.look();
            each();
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// How long it takes until everybody is sent somewhere anew [s].
    pub fn until_all_are_sent(&mut self) -> f64 {
        let since = Instant::now();
        while since.elapsed() < PATIENCE {
            self.look();
            if self.sent.iter().all(|&sent| sent > since) {
                return since.elapsed().as_secs_f64();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        f64::INFINITY
    }

    /// Where the leaders' program has them: the mean place of all targets.
    pub fn mean(&self) -> f64 {
        let all: Vec<f64> = self.places.iter().flatten().map(|(_, at)| at[0]).collect();
        all.iter().sum::<f64>() / all.len() as f64
    }
}

/// Judge, robots and node, flying.
pub struct Scene {
    domain: u16,
    stranger: Stranger,
    pub judge: Judge,
    pub robots: Running,
    pub node: Running,
    pub begun_at: f64,
    pub edge: Edge,
}

/// Numbers of the participants, in the order in which they come.
const ROBOTS: u16 = 1;
const NODE: u16 = 2;

impl Scene {
    pub fn open(overrides: &[&'static str]) -> Self {
        let domain = domain();
        let stranger = Stranger::come(domain);
        let edge = edge(domain);
        let mut judge = Judge::sit(&edge, overrides);
        let mut stranger = stranger;
        let first = until("the judge's name", || {
            stranger.listen();
            stranger.prefixes.first().copied()
        });
        stranger.spare(first);
        let robots = Running::start(&mut command(domain, &arguments("robots", overrides)));
        until("the robots", || {
            judge.look();
            judge.places.iter().all(Option::is_some).then_some(())
        });
        let node = Running::start(&mut command(domain, &arguments("node", overrides)));
        assert!(judge.until_all_are_sent().is_finite());
        judge.during(Duration::from_secs(3), || ());
        let begun_at = judge.mean();
        (judge.silence, judge.coast) = (0.0, 0.0);
        let mut scene = Self { domain, stranger, judge, robots, node, begun_at, edge };
        scene.stranger.listen();
        let known = scene.stranger.prefixes.len();
        assert!(known >= 2, "{known} participants are known");
        scene
    }

    /// Sends what `make` makes to a participant for as long as a flood lasts; largest memory of its process [kB].
    fn flood(&mut self, to: u16, mut make: impl FnMut(&mut Stranger) -> Vec<Vec<u8>>) -> u32 {
        let Self { domain, stranger, judge, robots, node, .. } = self;
        let victim = if to == NODE { node } else { robots };
        let mut largest = 0;
        judge.during(FLOOD, || {
            stranger.listen();
            for packet in make(stranger) {
                stranger.send(&packet, port(*domain, to));
            }
            largest = largest.max(victim.worker().map_or(0, resident));
        });
        largest
    }

    /// What must hold after any flood.
    fn is_well(&mut self, largest: u32, lines: &Receiver<String>) -> Vec<String> {
        let back = self.judge.until_all_are_sent();
        let lines: Vec<String> = lines.try_iter().collect();
        lines.iter().filter(|line| line.contains("given up")).for_each(|line| println!("{line}"));
        let lives = lines.iter().filter(|line| line.contains("goes on")).count();
        let Judge { silence, coast, .. } = self.judge;
        let (from, to) = (self.begun_at, self.judge.mean());
        println!("{lives} lives, {} MB, silent for {silence:.2} s, back after {back:.2} s", largest / 1024);
        println!("moved {coast:.3} m while nobody was sent anywhere, from {from:.2} to {to:.2} m");
        assert!(largest < 512 * 1024, "{largest} kB");
        assert!(back < 5.0, "{back} s");
        // Whoever comes back goes the rest of one way, and the first of the next may be seen before it is sent.
        assert!(coast <= 0.15, "{coast} m");
        assert!(to > from - 0.1, "the program began anew");
        lines
    }
}

const FLOOD: Duration = Duration::from_secs(30);

fn promises(stranger: &mut Stranger) -> Vec<Vec<u8>> {
    let all = stranger.prefixes.clone();
    all.into_iter().map(|prefix| stranger.promise(prefix)).collect()
}

/// Packets of discovery and promises with some bytes of each changed.
fn changed(stranger: &mut Stranger, random: &mut Pcg64Mcg) -> Vec<Vec<u8>> {
    let mut all = promises(stranger);
    all.extend(stranger.packets.iter().cloned());
    for packet in &mut all {
        for _ in 0..=random.random_range(0..4) {
            // The magic word stays, or nobody would look at the rest.
            let at = random.random_range(4..packet.len());
            packet[at] = random.random();
        }
    }
    all
}

#[test]
#[ignore = "takes a minute: thirty seconds of a flood"]
fn a_flood_of_impossible_promises_costs_nothing() {
    let mut scene = Scene::open(&LONG);
    let lines = scene.node.lines();
    let largest = scene.flood(NODE, promises);
    let lines = scene.is_well(largest, &lines);
    assert!(!lines.iter().any(|line| line.contains("given up")), "{lines:#?}");
    assert!(scene.judge.silence < 1.0, "{} s", scene.judge.silence);
    assert_eq!(scene.node.terminate(), Some(0));
}

#[test]
#[ignore = "takes a minute: thirty seconds of a flood"]
fn promises_that_the_filter_does_not_see_cost_some_seconds_of_hold_and_no_memory() {
    let mut scene = Scene::open(&LONG);
    let lines = scene.node.lines();
    let largest = scene.flood(NODE, |stranger| promises(stranger).iter().map(|one| hidden(one)).collect());
    let lines = scene.is_well(largest, &lines);
    assert!(lines.iter().any(|line| line.contains("given up: the process has grown")), "{lines:#?}");
    assert_eq!(scene.node.terminate(), Some(0));
}

#[test]
#[ignore = "takes a minute: thirty seconds of a flood"]
fn robots_under_the_same_flood_go_on_where_they_were() {
    let mut scene = Scene::open(&LONG);
    let lines = scene.robots.lines();
    let largest = scene.flood(ROBOTS, |stranger| promises(stranger).iter().map(|one| hidden(one)).collect());
    let lines = scene.is_well(largest, &lines);
    assert!(lines.iter().any(|line| line.contains("given up")), "{lines:#?}");
    assert_eq!(scene.robots.terminate(), Some(0));
}

#[test]
#[ignore = "takes a minute: thirty seconds of a flood"]
fn changed_packets_of_discovery_cost_some_seconds_of_hold_at_most() {
    let mut scene = Scene::open(&LONG);
    let lines = scene.node.lines();
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let largest = scene.flood(NODE, |stranger| changed(stranger, &mut random));
    scene.is_well(largest, &lines);
    assert_eq!(scene.node.terminate(), Some(0));
}

#[test]
#[ignore = "takes half a minute"]
fn a_process_that_is_killed_or_stands_still_is_followed_by_one_that_goes_on() {
    let mut scene = Scene::open(&LONG);
    for signal_name in ["KILL", "STOP", "ABRT"] {
        let worker = scene.node.worker().expect("a worker");
        signal(signal_name, worker);
        scene.judge.during(Duration::from_millis(200), || ());
        let next = until("another process", || scene.node.worker().filter(|&process| process != worker));
        let back = scene.judge.until_all_are_sent();
        println!("{signal_name}: {worker} then {next}, back after {back:.2} s");
        assert!(back < 5.0, "{signal_name}: {back} s");
        scene.judge.during(Duration::from_secs(2), || ());
    }
    // One that stands still before it has said a word.
    let worker = scene.node.worker().expect("a worker");
    signal("KILL", worker);
    let next = until("another process", || scene.node.worker().filter(|&process| process != worker));
    signal("STOP", next);
    // What was sent before is no sign of life.
    scene.judge.during(Duration::from_millis(200), || ());
    let back = scene.judge.until_all_are_sent();
    println!("STOP while it opens: back after {back:.2} s");
    assert!(back < 5.0, "{back} s");
    assert!(scene.judge.mean() > scene.begun_at, "the program began anew");
    assert_eq!(scene.node.terminate(), Some(0));
}

/// As an update does while the swarm flies.
/// Silence after which the peers of a process count as lost, and more.
const SILENCE: Duration = Duration::from_secs(4);

#[test]
fn robots_whose_node_has_taken_leave_wait_for_another_and_a_node_for_other_robots() {
    let mut scene = Scene::open(&LONG);
    let lines = scene.robots.lines();
    assert_eq!(scene.node.terminate(), Some(0));
    std::thread::sleep(SILENCE);
    let said: Vec<String> = lines.try_iter().collect();
    assert!(said.iter().any(|line| line.contains("all peers have left")), "{said:#?}");
    let ended = ["given up", "ended with code"];
    assert!(!said.iter().any(|line| ended.iter().any(|words| line.contains(words))), "{said:#?}");

    scene.node = Running::start(&mut command(scene.domain, &arguments("node", &LONG)));
    let lines = scene.node.lines();
    assert!(scene.judge.until_all_are_sent().is_finite(), "another node flies them");
    assert_eq!(scene.robots.terminate(), Some(0));
    std::thread::sleep(SILENCE);
    let said: Vec<String> = lines.try_iter().collect();
    assert!(said.iter().any(|line| line.contains("all peers have left")), "{said:#?}");
    assert!(!said.iter().any(|line| ended.iter().any(|words| line.contains(words))), "{said:#?}");
    assert_eq!(scene.node.terminate(), Some(0));
}

#[test]
fn robots_whose_node_is_not_active_or_not_even_configured_wait_for_it() {
    let mut peers = peers::peers();
    let domain = peers::domain();
    let mut judge = Judge::sit(&peers.theirs, &LONG);
    let mut robots = Running::start(&mut command(domain, &arguments("robots", &LONG)));
    let lines = robots.lines();
    let node = Running::start(&mut command(domain, &arguments("node", &LONG)));
    assert!(judge.until_all_are_sent().is_finite());
    let change =
        peers::client::<ChangeState>(&mut peers, ServiceMapping::Enhanced, "/flockform/change_state");
    let make = |judge: &mut Judge, label: &str| {
        let transition = Transition { id: 0, label: label.into() };
        let request = ChangeStateRequest { transition };
        assert!(peers::call::<ChangeState>(&change, &request, &mut || judge.look()).success, "{label}");
        judge.during(SILENCE, || ());
    };
    for label in ["deactivate", "cleanup", "configure", "activate"] {
        make(&mut judge, label);
    }
    assert!(judge.until_all_are_sent().is_finite());
    let said: Vec<String> = lines.try_iter().collect();
    assert!(!said.iter().any(|line| line.contains("given up")), "{said:#?}");
    // One that dies without a word is missed all the same, active or not.
    make(&mut judge, "deactivate");
    let worker = node.worker().expect("a worker");
    signal("STOP", node.0.id());
    signal("KILL", worker);
    until("robots that give up", || lines.try_iter().find(|line| line.contains("given up")));
    assert_eq!(robots.terminate(), Some(0));
}

#[test]
fn a_program_whose_file_is_removed_or_replaced_goes_on_when_its_worker_dies() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("flockform");
    std::fs::copy(PROGRAM, &program).expect("copied");
    let mut node = Running::start(&mut command_of(&program, domain(), &arguments("node", &[])));
    let lines = node.lines();
    let mut worker = until("a worker", || node.worker());
    for put_in_place in [None, Some("this is no program")] {
        std::fs::remove_file(&program).expect("it runs, and yet it can be removed");
        put_in_place.iter().for_each(|text| std::fs::write(&program, text).expect("written"));
        signal("KILL", worker);
        worker = until("another worker", || node.worker().filter(|&process| process != worker));
        until("a line that says so", || lines.try_iter().find(|line| line.contains("goes on")));
        std::fs::write(&program, "").expect("written");
    }
    assert_eq!(node.terminate(), Some(0));
}

/// What is refused: a recorded run that the swarm names, which is away for a moment.
#[test]
fn what_is_refused_for_a_moment_after_a_program_has_run_does_not_end_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, table) = (folder.path().join("flown.toml"), folder.path().join("probes.csv"));
    let text = "title = \"flown\"\nradius = 0.01\n[scene]\nname = \"tension\"\nrecording = \"probes.csv\"\n[limits]\nspeed = 100.0\n";
    std::fs::write(&file, text).expect("written");
    let run = [
        "run",
        "tension",
        "--set",
        "record.probes=[67, 68, 115]",
        "--figures",
        "none",
        "--no-report",
        "--out",
        "run",
    ];
    let run = Command::new(PROGRAM).args(run).current_dir(folder.path()).output().expect("runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    std::fs::copy(folder.path().join("run/probes.csv"), &table).expect("copied");
    let (mut node, says) = flying(&file, "3 robots at");
    let worker = until("a worker", || node.worker());
    let away = folder.path().join("away.csv");
    std::fs::rename(&table, &away).expect("moved");
    signal("KILL", worker);
    says("ended with code 2");
    std::fs::rename(&away, &table).expect("moved back");
    says("3 robots at");
    assert_eq!(node.terminate(), Some(0));
}

/// What is written there meanwhile is for the next flight: other radii, another order of the robots, half a line, nothing.
#[test]
fn the_file_of_a_flight_is_read_when_it_begins_and_never_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("pair.toml");
    let text = "title = \"pair\"\nradius = 0.2\nrobots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [2.0, 0.0] }]\n\
        links = { kind = \"nearest\", count = 1 }\nleaders = [{ robots = [\"a\"], program = { kind = \"external\" } }]\n\
        limits = { speed = 1.0 }\n";
    std::fs::write(&file, text).expect("written");
    let (mut node, says) = flying(&file, "2 robots at");
    let three = text.replace("robots = [", "robots = [{ name = \"c\", place = [9.0, 0.0] }, ");
    assert!(three.len() > text.len());
    for written in [Some(three.as_str()), Some("radius = "), None] {
        std::fs::remove_file(&file).expect("there");
        written.iter().for_each(|written| std::fs::write(&file, written).expect("written"));
        let worker = until("a worker", || node.worker());
        signal("KILL", worker);
        says("was ended");
        says("2 robots at");
        std::thread::sleep(Duration::from_secs(1));
        std::fs::write(&file, "").expect("written");
    }
    assert_eq!(node.terminate(), Some(0));
}

/// A node of the file once it says these words, and what waits for others.
fn flying(file: &Path, words: &str) -> (Running, impl Fn(&str)) {
    let mut node = Running::start(&mut command(domain(), &["node", file.to_str().expect("a path")]));
    let lines = node.lines();
    let says = move |words: &str| drop(until(words, || lines.try_iter().find(|line| line.contains(words))));
    says(words);
    // It has said so to the process that starts others.
    std::thread::sleep(Duration::from_secs(1));
    (node, says)
}

/// Takes seconds from `FLOCKFORM_ATTACK_SECONDS`.
#[test]
#[ignore = "takes a minute; half an hour with FLOCKFORM_ATTACK_SECONDS=1800"]
fn all_attacks_at_once_on_node_and_robots_make_nothing_unsafe() {
    const PHASE: Duration = Duration::from_secs(3);
    let seconds = std::env::var("FLOCKFORM_ATTACK_SECONDS").ok().and_then(|text| text.parse().ok());
    let length = Duration::from_secs(seconds.unwrap_or(30));
    // There and back for as long as it takes.
    let away = "{ seconds = 10.0, hold = 1.0, translate = [5.0, 2.0], rotate = 90.0 }, { seconds = 10.0, hold = 1.0 }, ";
    let legs = format!("manoeuvres[0].legs=[{}]", away.repeat(length.as_secs() as usize / 20 + 2));
    let mut scene = Scene::open(&[legs.leak()]);
    let [node_lines, robot_lines] = [scene.node.lines(), scene.robots.lines()];
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let (mut attacks, mut largest, mut longest) = ([0_u32; 5], [0; 2], 0.0_f64);
    let since = Instant::now();
    while since.elapsed() < length {
        // Any of them, all of them, or none, in which case the swarm flies on.
        let [promised, masked, mutated] = [0.5; 3].map(|part| random.random_bool(part));
        let signals = ["KILL", "STOP"].map(|name| (name, random.random_bool(1.0 / 6.0)));
        for (count, is_on) in attacks.iter_mut().zip([promised, masked, mutated, signals[0].1, signals[1].1])
        {
            *count += u32::from(is_on);
        }
        let Scene { domain, stranger, judge, robots, node, .. } = &mut scene;
        for (name, _) in signals.iter().filter(|(_, is_sent)| *is_sent) {
            let victim = if random.random() { &*node } else { &*robots };
            // One that has just ended by itself takes none.
            victim.worker().into_iter().for_each(|worker| _ = is_sent(name, worker));
        }
        judge.during(PHASE, || {
            stranger.listen();
            // Of those that were: each life has a name of its own.
            let old = stranger.prefixes.len().saturating_sub(6);
            stranger.prefixes.drain(..old);
            let mut packets = Vec::new();
            if promised || masked {
                let all = promises(stranger);
                packets.extend(all.iter().filter(|_| masked).map(|one| hidden(one)));
                packets.extend(all.into_iter().filter(|_| promised));
            }
            if mutated {
                packets.extend(changed(stranger, &mut random));
            }
            for (packet, to) in packets.iter().flat_map(|packet| [ROBOTS, NODE].map(|to| (packet, to))) {
                stranger.send(packet, port(*domain, to));
            }
            for (largest, victim) in largest.iter_mut().zip([&*node, &*robots]) {
                *largest = victim.worker().map_or(0, resident).max(*largest);
            }
        });
        longest = longest.max(std::mem::take(&mut judge.silence));
    }
    let back = scene.judge.until_all_are_sent();
    let lives = [&node_lines, &robot_lines]
        .map(|lines| lines.try_iter().filter(|line| line.contains("goes on")).count());
    println!(
        "{} s: {attacks:?} phases of promises, hidden ones, changed packets, kills and stops; lives of node and robots \
         {lives:?}, {largest:?} kB; longest without targets {longest:.1} s, robots then went {:.3} m; back after {back:.1} s",
        length.as_secs(),
        scene.judge.coast,
    );
    assert!(largest.iter().all(|&size| size < 512 * 1024), "{largest:?} kB");
    assert!(scene.judge.coast <= 0.15, "{} m", scene.judge.coast);
    assert!(back < 10.0, "{back} s");
    assert_eq!([scene.node.terminate(), scene.robots.terminate()], [Some(0), Some(0)]);
}

#[test]
#[ignore = "takes half a minute"]
fn an_emergency_stop_a_tighter_limit_and_zero_velocities_outlast_the_process() {
    let mut peers = peers::peers();
    let domain = peers::domain();
    let overrides = [&LONG[..], &["node.velocity=twist"]].concat();
    let mut judge = Judge::sit(&peers.theirs, &overrides);
    let listener = peers.theirs.node("/", "driver").expect("a node");
    let velocity = listener.subscription::<Twist>("/robot_1/cmd_vel", Quality::reliable(1)).expect("hears");
    let _robots = Running::start(&mut command(domain, &arguments("robots", &overrides)));
    let mut node = Running::start(&mut command(domain, &arguments("node", &overrides)));
    judge.until_all_are_sent();
    judge.during(Duration::from_secs(2), || ());
    let stop =
        peers::client::<std_srvs::Trigger>(&mut peers, ServiceMapping::Enhanced, "/flockform/emergency_stop");
    assert!(peers::call::<std_srvs::Trigger>(&stop, &Empty, &mut || judge.look()).success);
    judge.during(Duration::from_secs(1), || ());
    let worker = node.worker().expect("a worker");
    while velocity.take().is_some() {}
    signal("KILL", worker);
    let since = Instant::now();
    let (first, after) = until("a velocity", || {
        judge.look();
        velocity.take().map(|(twist, _)| (twist, since.elapsed().as_secs_f64()))
    });
    println!("first velocity after {after:.2} s: {first:?}");
    assert_eq!(first, Twist::default());
    judge.states = 0;
    until("states", || {
        judge.look();
        (judge.states > 20).then_some(())
    });
    assert_eq!(judge.last_state.as_ref().map(|state| state.mode), Some(FormationState::EMERGENCY_STOPPED));
    assert!(node.worker().is_some_and(|process| process != worker));
    assert_eq!(node.terminate(), Some(0));
}
