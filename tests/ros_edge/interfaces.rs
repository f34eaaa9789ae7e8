//! Every way in and out of the formation's node: types of poses, leaders moved by topic, velocities, simulated time.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use flockform::flock::vectors::distance;
use flockform::messages::builtin_interfaces::Time;
use flockform::messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use flockform::messages::geometry_msgs;
use flockform::messages::geometry_msgs::{Pose, PoseArray, PoseStamped, Twist, TwistStamped};
use flockform::messages::rosgraph_msgs::Clock;
use flockform::messages::std_msgs::Header;
use flockform::messages::tf2_msgs::TFMessage;
use flockform::ros::edge::Quality;
use flockform::ros::node::FormationNode;
use flockform::ros::robots::{Layout, RobotNodes};
use flockform::scene::swarm::Swarm;
use flockform::swarm::watch::Health;

use super::formation::{PATIENT, Swarming, arguments, change, square};
use super::support::{PATIENCE, peers, until};
use crate::waits::within;

/// A flight short enough for a test.
const SHORT: [&str; 2] =
    ["manoeuvres[0].legs=[{ seconds = 0.5, translate = [1.0, 0.5], rotate = 10.0 }]", "limits.speed=4.0"];

fn with(more: &[&'static str]) -> Vec<&'static str> {
    [&PATIENT, more].concat()
}

/// Largest distance of a robot from where `to` takes its place.
fn away(swarm: &Swarming, to: impl Fn([f64; 2]) -> [f64; 2]) -> f64 {
    let formation = swarm.node.control().formation();
    let places = swarm.robots.fleet().places();
    let apart = |m: usize| distance(places.get(m), to(formation.places.get(m)));
    (0..formation.count()).map(apart).fold(0.0, f64::max)
}

fn is_flown(swarm: &Swarming) -> bool {
    let formation = swarm.node.control().formation();
    let map = formation.affine(formation.programs_end()).expect("a manoeuvre");
    away(swarm, |place| map.apply(place)) < 0.01
}

fn until_flown(swarm: &mut Swarming, what: &str) {
    swarm.fly_until(what, is_flown);
}

#[test]
fn poses_come_in_every_type_of_message() {
    let _peers = peers();
    for kind in ["pose-stamped", "pose-with-covariance-stamped", "odometry", "pose-array"] {
        let kind_is = format!("node.pose_type=\"{kind}\"");
        let mut overrides = with(&SHORT);
        overrides.push(&kind_is);
        if kind == "pose-array" {
            overrides.push("node.pose_topic=\"/all/poses\"");
            overrides.push("node.target_type=\"pose-array\"");
        }
        let mut swarm = Swarming::open(&square(&overrides), &[]);
        swarm.until_all_are_heard();
        until_flown(&mut swarm, kind);
        let control = swarm.node.control();
        for m in 0..control.formation().count() {
            assert_eq!(control.watch().counts(m).rejected(), 0, "{kind}");
        }
    }
}

#[test]
fn an_array_of_another_number_of_poses_is_dropped_as_a_whole_and_counted() {
    let peers = peers();
    let sender = peers.theirs.node("/", "camera").expect("a node");
    let poses = sender.publisher::<PoseArray>("/camera/poses", Quality::BEST_EFFORT).expect("out");
    let reports =
        sender.subscription::<DiagnosticArray>("/diagnostics", Quality::reliable(50)).expect("hears");
    let overrides = with(&["node.pose_type=\"pose-array\"", "node.pose_topic=\"/camera/poses\""]);
    let more = ["-r", "__node:=watched_by_camera"];
    let mut node = FormationNode::open(&square(&overrides), &arguments(&more), None).expect("a node");
    let places: Vec<[f64; 2]> = node.control().formation().places.iter().collect();
    let mut send = |places: &[[f64; 2]]| {
        let poses_of = places.iter().map(|&place| Pose::planar(place, 0.0)).collect();
        let header = stamped([0.0; 2], "map").header;
        poses.publish(&PoseArray { header, poses: poses_of }).expect("sent");
        std::thread::sleep(Duration::from_millis(5));
        node.tick();
        let accepted: Vec<u64> = (0..25).map(|m| node.control().watch().counts(m).accepted).collect();
        let refused = std::iter::from_fn(|| reports.take())
            .flat_map(|(report, _)| report.status)
            .filter(|status| status.name == "/watched_by_camera: formation")
            .flat_map(|status| status.values)
            .find(|value| value.key == "messages refused");
        (accepted, refused.map(|value| value.value))
    };
    until("all are heard", || send(&places).0.iter().all(|&count| count > 0).then_some(()));
    let added = [&places[..], &[[9.0, 9.0]]].concat();
    for others in [&added[..], &places[1..], &[]] {
        // What was on its way arrives.
        (0..20).for_each(|_| drop(send(&[])));
        let (before, _) = send(&[]);
        let mut counts = Vec::new();
        until("they are counted", || {
            let (accepted, refused) = send(others);
            assert_eq!(accepted, before, "{} poses of 25 robots", others.len());
            counts.extend(refused.and_then(|count| count.parse::<u64>().ok()));
            (counts.last() > counts.first() && counts.len() > 1).then_some(())
        });
    }
}

pub fn stamped(place: [f64; 2], frame_id: &str) -> PoseStamped {
    let header = Header { stamp: Time::default(), frame_id: frame_id.into() };
    PoseStamped { header, pose: Pose::planar(place, 0.0) }
}

#[test]
fn leaders_are_moved_by_topic_in_the_swarm_s_frame_alone() {
    let peers = peers();
    let overrides = with(&["leaders[0].program={ kind = \"external\" }", "limits.speed=4.0"]);
    let mut swarm = Swarming::open(&square(&overrides), &[]);
    let guide = peers.theirs.node("/", "guide").expect("a node");
    let corners = [0, 4, 20, 24].map(|m| {
        let formation = swarm.node.control().formation();
        let topic = format!("/{}/leader_pose", formation.names[m]);
        (formation.places.get(m), guide.publisher(&topic, Quality::BEST_EFFORT).expect("out"))
    });
    let lead = |by: [f64; 2], frame_id: &str| {
        for ([x, y], topic) in &corners {
            topic.publish(&stamped([x + by[0], y + by[1]], frame_id)).expect("sent");
        }
    };
    swarm.until_all_are_heard();
    until("the guide is heard", || corners.iter().all(|(_, topic)| topic.matched() == 1).then_some(()));
    swarm.fly_until("everybody follows the corners", |swarm| {
        lead([1.0, -0.5], "map");
        away(swarm, |[x, y]| [x + 1.0, y - 0.5]) < 0.01
    });
    for (by, frame_id) in [([9.0, 9.0], "elsewhere"), ([f64::NAN, 9.0], "map")] {
        for _ in 0..50 {
            lead(by, frame_id);
            swarm.tick();
        }
    }
    assert!(away(&swarm, |[x, y]| [x + 1.0, y - 0.5]) < 0.01);
}

/// Robots that have nothing but their velocities, and are seen a quarter of a second late.
#[test]
fn velocities_lead_robots_with_late_poses_to_their_targets() {
    const LATE: f64 = 0.25;
    let peers = peers();
    let text = "title = \"driven\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 1 }\n\
                robots = [{ name = \"left\", place = [0.0, 0.0] }, { name = \"right\", place = [2.0, 0.0] }]\n\
                leaders = [{ robots = [\"left\", \"right\"], program = { kind = \"path\", points = [{ at = 1.0, displacement = [0.5, 0.3] }] } }]\n\
                limits = { speed = 1.5, clearance = 0.3 }\nposes = { fresh = 4.0, age_limit = 5.0, stop_after = 9.0 }\n\
                control = { period = 0.03 }\nnode = { velocity = \"twist\" }\nflight = { model = { kind = \"integrator\" } }\n";
    let swarm = Swarm::parse("driven", "driven.toml", text, &[], None).expect("a swarm");
    let mut node = FormationNode::open(&swarm, &arguments(&[]), None).expect("a node");
    let bases = peers.theirs.node("/", "bases").expect("a node");
    let mut robots = ["left", "right"].map(|name| {
        let velocities = bases.subscription::<Twist>(&format!("/{name}/cmd_vel"), Quality::reliable(1));
        let poses = bases.publisher::<PoseStamped>(&format!("/{name}/pose"), Quality::BEST_EFFORT);
        (velocities.expect("hears"), poses.expect("out"), Twist::default())
    });
    let time = || SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64();
    let starts: Vec<_> = node.control().formation().places.iter().collect();
    let goals: Vec<_> = starts.iter().map(|[x, y]| [x + 0.5, y + 0.3]).collect();
    // When, and where each was.
    let mut been = vec![(time(), starts)];
    let mut at_rest = 0;
    until("they stand where they were led", || {
        let now = time();
        let (then, mut places) = been.last().expect("the start").clone();
        for ((velocities, _, twist), place) in robots.iter_mut().zip(&mut places) {
            *place = [place[0] + (now - then) * twist.linear.x, place[1] + (now - then) * twist.linear.y];
            *twist = velocities.take_last().map_or(*twist, |(twist, _)| twist);
        }
        been.push((now, places.clone()));
        if let Some((stamp, late)) = been.iter().rfind(|(then, _)| *then <= now - LATE) {
            for ((_, poses, _), place) in robots.iter().zip(late) {
                let header = Header { stamp: Time::from_seconds(*stamp), frame_id: "map".into() };
                poses.publish(&PoseStamped { header, pose: Pose::planar(*place, 0.0) }).expect("sent");
            }
        }
        std::thread::sleep(Duration::from_millis(15));
        node.tick();
        std::thread::sleep(Duration::from_millis(15));
        let is_there = places.iter().zip(&goals).all(|(place, goal)| distance(*place, *goal) < 0.02);
        at_rest = if is_there { at_rest + 1 } else { 0 };
        (at_rest > 30).then_some(())
    });
}

#[test]
fn velocities_are_left_to_others_while_the_node_is_not_active() {
    let mut peers = peers();
    let hearer = peers.theirs.node("/", "idle_driver").expect("a node");
    let plain = hearer.subscription::<Twist>("/idle/robot_7/cmd_vel", Quality::reliable(50)).expect("hears");
    let overrides = with(&["node.velocity=\"twist\"", "node.velocity_topic=\"/idle/{name}/cmd_vel\""]);
    let mut swarm = Swarming::open(&square(&overrides), &[]);
    swarm.until_all_are_heard();
    until("a velocity", || {
        swarm.tick();
        plain.take()
    });
    change(&mut peers, &mut swarm, &["deactivate"]);
    // What was on its way arrives; the last of it is the zero.
    let mut last = None;
    for _ in 0..20 {
        swarm.tick();
        last = plain.take_last().map(|(twist, _)| twist).or(last);
    }
    assert_eq!(last, Some(Twist::default()));
    for _ in 0..50 {
        swarm.tick();
        assert!(plain.take().is_none(), "a velocity of a node that is not active");
    }
    change(&mut peers, &mut swarm, &["activate"]);
    until("velocities again", || {
        swarm.tick();
        plain.take()
    });
}

#[test]
fn a_robot_that_is_not_heard_is_told_to_stand() {
    let peers = peers();
    let hearer = peers.theirs.node("/", "stamped_driver").expect("a node");
    let overrides = with(&["node.velocity=\"twist-stamped\"", "node.velocity_topic=\"/drive/{name}\""]);
    let topic = hearer.subscription::<TwistStamped>("/drive/robot_7", Quality::reliable(1)).expect("hears");
    let mut node = FormationNode::open(&square(&overrides), &arguments(&[]), None).expect("a node");
    let message = until("a velocity", || {
        node.tick();
        topic.take_last()
    });
    assert_eq!(message.0.twist, geometry_msgs::Twist::default());
    // Velocities are in the robot's own axes.
    assert_eq!(message.0.header.frame_id, "robot_7/base_link");
}

const SIMULATED: [&str; 2] = ["-p", "use_sim_time:=true"];

#[test]
fn a_swarm_flies_by_the_time_of_its_simulator_and_once_more_when_that_begins_anew() {
    let _peers = peers();
    let swarm = square(&with(&SHORT));
    let robots = || {
        RobotNodes::open(&swarm, &arguments(&["-p", "publish_clock:=true"]), Layout::OneNode).expect("robots")
    };
    let node = FormationNode::open(&swarm, &arguments(&SIMULATED), None).expect("a node");
    let mut swarm = Swarming { robots: robots(), node };
    swarm.until_all_are_heard();
    until_flown(&mut swarm, "the first time");
    let age = swarm.node.control().age(6).expect("heard");
    assert!(age < 1.0, "the pose is {age} s old by the simulator's time");
    // Back at their places, at time zero: nothing of before counts.
    swarm.robots = robots();
    swarm.fly_until("time goes back", |swarm| {
        let control = swarm.node.control();
        (0..25).all(|m| control.health(m) == Health::Fresh)
            && swarm.robots.fleet().time() < 2.0
            && control.position(6).is_some_and(|at| distance(at, control.formation().places.get(6)) < 2.0)
    });
    until_flown(&mut swarm, "the second time");
}

#[test]
fn a_pose_without_a_stamp_is_as_old_as_its_arrival_by_whatever_clock() {
    let peers = peers();
    let sender = peers.theirs.node("/", "plain_robot").expect("a node");
    let clock = sender.publisher::<Clock>("/clock", Quality::BEST_EFFORT).expect("out");
    let pose = sender.publisher("/robot_7/pose", Quality::BEST_EFFORT).expect("out");
    for simulated in [false, true] {
        let more = if simulated { &SIMULATED[..] } else { &[] };
        let mut node = FormationNode::open(&square(&PATIENT), &arguments(more), None).expect("a node");
        let mut time = 100.0;
        until("robot_7 is heard", || {
            time += 0.01;
            let message = Clock { clock: Time::from_seconds(time) };
            clock.publish(&message).expect("sent");
            pose.publish(&stamped([1.5, 1.5], "map")).expect("sent");
            std::thread::sleep(Duration::from_millis(5));
            node.tick();
            (node.control().health(6) == Health::Fresh).then_some(())
        });
    }
}

#[test]
fn a_node_without_the_clock_that_it_is_to_go_by_says_so_until_one_comes() {
    let peers = peers();
    let keeper = peers.theirs.node("/", "time_keeper").expect("a node");
    let reports =
        keeper.subscription::<DiagnosticArray>("/diagnostics", Quality::reliable(5)).expect("hears");
    let clock = keeper.publisher::<Clock>("/elsewhere/clock", Quality::BEST_EFFORT).expect("out");
    let remapped = [&SIMULATED[..], &["-r", "/clock:=/elsewhere/clock"]].concat();
    let mut node = FormationNode::open(&square(&PATIENT), &arguments(&remapped), None).expect("a node");
    let mut status = |tick: &mut dyn FnMut()| {
        tick();
        std::thread::sleep(Duration::from_millis(5));
        node.tick();
        reports.take_last().and_then(|(report, _)| report.status.into_iter().next())
    };
    let misses = |status: &DiagnosticStatus| status.message.contains("no time has come on /elsewhere/clock");
    let status_without =
        until("a word about the clock", || status(&mut || {}).filter(|status| misses(status)));
    assert_eq!(status_without.level, DiagnosticStatus::ERROR);
    let mut time = 100.0;
    let mut tell = || {
        time += 0.02;
        let message = Clock { clock: Time::from_seconds(time) };
        clock.publish(&message).expect("sent");
    };
    until("no word about the clock", || status(&mut tell).filter(|status| !misses(status)));
    let ceased = until("a word about the clock that ceased", || status(&mut || {}).filter(|one| misses(one)));
    assert!(ceased.message.contains("for three seconds"), "{}", ceased.message);
}

#[test]
fn a_node_ticks_as_its_simulator_s_time_goes_on_and_rests_while_it_stands() {
    let peers = peers();
    let keeper = peers.theirs.node("/", "slow_time_keeper").expect("a node");
    let clock = keeper.publisher::<Clock>("/slow/clock", Quality::BEST_EFFORT).expect("out");
    let remapped = [&SIMULATED[..], &["-r", "/clock:=/slow/clock"]].concat();
    let swarm = square(&PATIENT);
    let mut node = FormationNode::open(&swarm, &arguments(&remapped), None).expect("a node");
    // A reading that is lost is sent again: the node looks around at least once in a period of the computer's.
    let (mut time, mut steps, mut turns_at_rest) = (100.0, 1, 0);
    let begun = Instant::now();
    node.run_while(&AtomicBool::new(false), &mut |node| {
        let ticks = node.control().ticks();
        assert!(ticks <= steps, "{ticks} ticks in {steps} periods of the simulator");
        assert!(begun.elapsed() < PATIENCE, "{ticks} ticks in {steps} periods of the simulator");
        match (ticks == steps, steps < 50) {
            (true, true) => (time, steps) = (time + swarm.raw.control.period, steps + 1),
            (true, false) => turns_at_rest += 1,
            (false, _) => {}
        }
        let message = Clock { clock: Time::from_seconds(time) };
        clock.publish(&message).expect("sent");
        turns_at_rest < 50
    });
    assert_eq!(node.control().ticks(), steps);
}

/// Simulators whose world is reset and paused go on saying what time it is there, and nothing else.
#[test]
fn a_node_whose_simulation_is_reset_and_paused_goes_on_and_says_how_it_fares() {
    let peers = peers();
    let keeper = peers.theirs.node("/", "time_keeper_that_resets").expect("a node");
    let clock = keeper.publisher::<Clock>("/reset/clock", Quality::BEST_EFFORT).expect("out");
    let pose = keeper.publisher("/robot_7/pose", Quality::BEST_EFFORT).expect("out");
    let reports =
        keeper.subscription::<DiagnosticArray>("/diagnostics", Quality::reliable(50)).expect("hears");
    let remapped = [&SIMULATED[..], &["-r", "/clock:=/reset/clock"]].concat();
    let mut node = FormationNode::open(&square(&PATIENT), &arguments(&remapped), None).expect("a node");
    node.watch_middleware().expect("a watchdog");
    let (mut time, mut paused, mut heard) = (100.0, None::<Instant>, 0);
    let begun = Instant::now();
    let lives = node.run_while(&AtomicBool::new(false), &mut |node| {
        assert!(begun.elapsed() < PATIENCE, "robot_7 is not heard");
        if paused.is_none() {
            time += 0.01;
            let mut message = stamped([1.5, 1.5], "map");
            message.header.stamp = Time::from_seconds(time);
            pose.publish(&message).expect("sent");
            if node.control().health(6) == Health::Fresh {
                (time, paused) = (0.0, Some(Instant::now()));
            }
        }
        clock.publish(&Clock { clock: Time::from_seconds(time) }).expect("sent");
        while let Some((report, _)) = reports.take() {
            let is_own = |status: &DiagnosticStatus| status.name == "/flockform: formation";
            let is_waiting = node.control().health(6) == Health::Waiting;
            heard += usize::from(is_waiting && report.status.iter().any(is_own));
        }
        std::thread::sleep(Duration::from_millis(5));
        // A few periods, by which it knows of the reset.
        time = paused.map_or(time, |since| since.elapsed().as_secs_f64().min(0.5));
        paused.is_none_or(|since| since.elapsed() < Duration::from_secs(5))
    });
    assert!(lives, "the middleware is not given up");
    assert!(heard >= 2, "{heard} reports in a pause of four seconds");
}

#[test]
fn two_fleets_of_one_file_fly_beside_each_other_each_in_its_namespace() {
    let peers = peers();
    let hearer = peers.theirs.node("/", "tower").expect("a node");
    let reports =
        hearer.subscription::<DiagnosticArray>("/diagnostics", Quality::reliable(50)).expect("hears");
    let frames = hearer.subscription::<TFMessage>("/tf", Quality::reliable(100)).expect("hears");
    let open = |namespace: &str, leg: &str| {
        let legs = format!("manoeuvres[0].legs=[{{ seconds = 0.5, {leg} }}]");
        let swarm = square(&[&PATIENT[..], &["limits.speed=4.0", &legs]].concat());
        let arguments = arguments(&["-r", &format!("__ns:={namespace}")]);
        let robots = RobotNodes::open(&swarm, &arguments, Layout::OneNode).expect("robots");
        let node = FormationNode::open(&swarm, &arguments, None).expect("a node");
        Swarming { node, robots }
    };
    // Either would be led astray by what the other's node sends.
    let mut fleets = [open("/left", "translate = [-1.0, 0.5]"), open("/right", "translate = [1.0, -0.5]")];
    let (mut nodes, mut carried) = (BTreeSet::new(), BTreeSet::new());
    let mut hear = |fleets: &mut [Swarming]| {
        fleets.iter_mut().for_each(Swarming::tick);
        while let Some((report, _)) = reports.take() {
            nodes.extend(report.status.into_iter().map(|status| status.name));
        }
        while let Some((message, _)) = frames.take() {
            carried.extend(message.transforms.into_iter().map(|frame| frame.child_frame_id));
        }
        // The last words of other tests' nodes may come too.
        ["/left/flockform: formation", "/right/flockform: formation"].iter().all(|&name| nodes.contains(name))
            && ["left/robot_7/base_link", "right/robot_7/base_link"]
                .iter()
                .all(|&name| carried.contains(name))
    };
    within(3 * PATIENCE, "both are where they were led", || {
        hear(&mut fleets);
        fleets.iter().all(is_flown).then_some(())
    });
    until("both have names and frames of their own", || hear(&mut fleets).then_some(()));
}
