//! `flockform node` and `flockform robots` over shared memory, and the same in one process.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::Duration;

use flockform::flock::vectors::distance;
use flockform::scene::swarm::Swarm;
use flockform::shm::channel::{Capacity, Reader, Slice, Writer};
use flockform::shm::link::POSES;
use flockform::shm::node::{COMMANDS, MEMBERS, STATE};
use flockform::shm::payload::{Command as Order, Formation, Member, Pose};
use flockform::shm::{FormationNode, SimulatedRobots};
use flockform::swarm::flight::Flight;
use flockform::swarm::watch::Health;

use super::support::*;
use crate::running::Running;
use crate::swarms::load_swarm;

/// Patience with a busy computer, and a short flight.
const OVERRIDES: [&str; 6] = [
    "control.period=0.01",
    "poses.fresh=4.0",
    "poses.age_limit=5.0",
    "poses.stop_after=9.0",
    "manoeuvres[0].legs=[{ seconds = 1.0, translate = [2.0, 0.5], rotate = 30.0 }]",
    "limits.speed=8.0",
];

fn square() -> Swarm {
    load_swarm("square", &OVERRIDES)
}

#[test]
fn the_loop_over_shared_memory_flies_what_the_simulated_flight_flies() {
    let shm = domain(&domain_name());
    let swarm = square();
    let mut robots = SimulatedRobots::open(&swarm, &shm).expect("robots");
    let mut node = FormationNode::open(&swarm, &shm, None).expect("a node");
    let mut flight = Flight::new(&swarm).expect("a flight");
    for _ in 0..150 {
        robots.tick();
        node.tick();
        flight.step();
    }
    let control = node.control();
    assert!((0..25).all(|m| control.health(m) == Health::Fresh));
    assert!(control.program_time() > 1.2);
    let map = control.formation().affine(control.program_time()).expect("a manoeuvre");
    let places = robots.fleet().places();
    let apart = |m: usize| distance(places.get(m), map.apply(control.formation().places.get(m)));
    let worst = (0..25).map(apart).fold(0.0, f64::max);
    assert!(worst < 0.01, "{worst} m from where they were led");
    let from_flight = |m: usize| distance(places.get(m), flight.fleet().robots()[m].position);
    let worst = (0..25).map(from_flight).fold(0.0, f64::max);
    assert!(worst < 0.01, "{worst} m from the flight without a transport");
}

#[test]
fn a_member_s_own_node_hears_its_neighbours_alone_and_moves_nobody_else() {
    let shm = domain(&domain_name());
    let near = ["control.sweeps=1", "node.hears=\"neighbours\""];
    let swarm = load_swarm("square", &[&OVERRIDES[..], &near].concat());
    let mut robots = SimulatedRobots::open(&swarm, &shm).expect("robots");
    let mut node = FormationNode::open(&swarm, &shm, Some("robot_7")).expect("a node");
    for _ in 0..20 {
        robots.tick();
        node.tick();
    }
    let control = node.control();
    let heard: Vec<usize> = (0..25).filter(|&m| control.position(m).is_some()).collect();
    assert_eq!(heard, [0, 1, 2, 5, 6, 7, 10, 11, 12]);
    let places = robots.fleet().places();
    let moved = (0..25).filter(|&m| places.get(m) != control.formation().places.get(m));
    assert!(moved.into_iter().all(|m| m == 6));
}

/// The program with the square in a domain of shared memory.
fn start(domain: &str, subcommand: &str) -> Running {
    start_with(domain, &[subcommand], Stdio::inherit())
}

/// Waits for a line with these words of what a program says of itself, not for ever.
fn lines(running: &mut Running) -> impl FnMut(&str) -> String + use<> {
    let said = BufReader::new(running.0.stderr.take().expect("piped"));
    let (send, receive) = std::sync::mpsc::channel();
    std::thread::spawn(move || said.lines().map_while(Result::ok).try_for_each(|line| send.send(line)));
    move |words| {
        let next =
            || receive.recv_timeout(Duration::from_secs(60)).unwrap_or_else(|_| panic!("no `{words}`"));
        std::iter::repeat_with(next).find(|line| line.contains(words)).expect("without end")
    }
}

#[test]
fn both_say_what_they_serve_as_over_ros_2() {
    let name = domain_name();
    for (subcommand, expected) in [("robots", "25 simulated robots"), ("node", "25 robots at 100.0 Hz")] {
        let mut running = start_with(&name, &[subcommand], Stdio::piped());
        let line = lines(&mut running)("`square`: ");
        assert!(line.contains(expected), "{line}");
        assert_eq!(running.terminate(), Some(0));
    }
}

#[test]
fn robots_say_that_they_do_no_commands_of_a_flight() {
    let command =
        "flight.commands=[{ after = 5, what = { kind = \"lead\", robot = \"robot_1\", to = [0.0, 0.0] } }]";
    let mut running = start_with(&domain_name(), &["robots", "--set", command], Stdio::piped());
    lines(&mut running)("flight.commands are done by `flockform swarm`");
    assert_eq!(running.terminate(), Some(0));
}

fn start_with(domain: &str, arguments: &[&str], log: Stdio) -> Running {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
    command.args(arguments).args(["square", "--transport", "shm"]);
    OVERRIDES.iter().for_each(|one| {
        command.args(["--set", one]);
    });
    command.env(flockform::shm::domain::VARIABLE, domain).stdin(Stdio::null()).stderr(log);
    command.env_remove("RUST_LOG");
    Running(command.spawn().expect("it starts"))
}

#[test]
fn a_second_node_and_robots_of_another_number_are_said() {
    let name = domain_name();
    let mut running = start_with(&name, &["node"], Stdio::piped());
    let mut line = lines(&mut running);
    line("25 robots at");
    let peer = domain(&name).join("test").expect("shared memory");
    let mut poses = Writer::<Pose>::open(&peer, "square", POSES, &Capacity::SWARM, 1).expect("a writer");
    let stranger = Pose { member: 25, frame: 0, position: [0.0; 2], yaw: 0.0, stamp: 0.0 };
    poses.send(0.0, 0, 1, |_| stranger).expect("sent");
    line("a pose is of robot 25, and the swarm has 25");
    let second = start(&name, "node");
    line("another node moves the same robots");
    drop(second);
    assert_eq!(running.terminate(), Some(0));
}

#[test]
fn a_second_node_of_the_same_robot_is_said_and_one_of_another_is_not() {
    let name = domain_name();
    let member = |robot| ["node", "--set", "control.sweeps=1", "--member", robot];
    let mut running = start_with(&name, &member("robot_7"), Stdio::piped());
    let mut line = lines(&mut running);
    line("25 robots at");
    let node = |arguments: &[&str]| start_with(&name, arguments, Stdio::null());
    let _other = node(&member("robot_8"));
    let _same = node(&member("robot_7"));
    let said = line("another node moves the same robots");
    assert!(said.contains("1 other writer:"), "{said}");
    let _all = node(&["node"]);
    let said = line("another node moves the same robots");
    assert!(said.contains("2 other writers:"), "{said}");
    assert_eq!(running.terminate(), Some(0));
}

fn next(reader: &Reader<Member>, what: &str, is: impl Fn(&Slice<Member>) -> bool) {
    until(what, || reader.take_last().filter(&is).map(|_| ()));
}

#[test]
fn node_and_robots_are_processes_that_may_be_killed_and_come_back() {
    let name = domain_name();
    let peer = domain(&name).join("test").expect("shared memory");
    let capacity = &Capacity::SWARM;
    let members = Reader::<Member>::open(&peer, "square", MEMBERS, capacity).expect("a reader");
    let state = Reader::<Formation>::open(&peer, "square", STATE, capacity).expect("a reader");
    let mut orders = Writer::<Order>::open(&peer, "square", COMMANDS, capacity, 1).expect("a writer");
    let robots = start(&name, "robots");
    let node = start(&name, "node");
    let all_fresh = |slice: &Slice<Member>| slice.len() == 25 && slice.iter().all(|one| one.health == 1);
    next(&members, "everybody is heard", |slice| {
        all_fresh(slice) && slice[6].name() == "robot_7" && slice[6].target[0].is_finite()
    });
    next(&members, "the formation moves", |slice| slice.iter().all(|one| one.displacement[0].abs() > 0.1));

    // SIGKILL.
    drop(node);
    let mut node = start(&name, "node");
    next(&members, "a new node hears everybody", all_fresh);

    drop(robots);
    next(&members, "robots that are gone are held", |slice| slice.iter().all(|one| one.health != 1));
    let mut robots = start(&name, "robots");
    next(&members, "new robots are heard", all_fresh);

    until("the emergency stop", || {
        orders.send(0.0, 0, 1, |_| Order::new(Order::EMERGENCY_STOP)).expect("sent");
        state.take_last().filter(|slice| slice[0].mode == Formation::EMERGENCY_STOPPED).map(|_| ())
    });
    until("the end of it", || {
        orders.send(0.0, 0, 1, |_| Order::new(Order::RESUME)).expect("sent");
        state.take_last().filter(|slice| slice[0].mode == Formation::RUNNING).map(|_| ())
    });
    assert_eq!((node.terminate(), robots.terminate()), (Some(0), Some(0)));
}
