//! The node and the robots of one swarm file, over DDS on loopback.
//!
//! Both sides are ticked here, so nothing depends on how long a tick of the computer takes.

use std::time::Duration;

use flockform::flock::vectors::distance;
use flockform::messages::diagnostic_msgs::DiagnosticArray;
use flockform::messages::flockform_msgs::{FormationState, MemberState};
use flockform::messages::geometry_msgs::PoseStamped;
use flockform::messages::lifecycle_msgs::{ChangeState, ChangeStateRequest, Transition};
use flockform::messages::std_msgs::Empty;
use flockform::messages::std_srvs;
use flockform::messages::visualization_msgs::MarkerArray;
use flockform::ros::arguments::RosArguments;
use flockform::ros::edge::Quality;
use flockform::ros::node::FormationNode;
use flockform::ros::robots::{Layout, RobotNodes};
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::Mode;
use flockform::swarm::watch::Health;
use ros2_client::ServiceMapping;

use super::support::*;
use crate::swarms::load_swarm;

pub fn arguments(more: &[&str]) -> RosArguments {
    let domain = domain().to_string();
    let environment = |name: &str| match name {
        "ROS_DOMAIN_ID" => Some(domain.clone()),
        "ROS_AUTOMATIC_DISCOVERY_RANGE" => Some("LOCALHOST".into()),
        _ => None,
    };
    let words = ["flockform", "--ros-args"].iter().chain(more).map(|&word| word.to_owned());
    RosArguments::parse(words, &environment).expect("arguments").1
}

pub fn square(overrides: &[&str]) -> Swarm {
    load_swarm("square", overrides)
}

/// Both sides, and what a busy computer may do to them without anybody being taken for lost.
pub struct Swarming {
    pub node: FormationNode,
    pub robots: RobotNodes,
}

pub const PATIENT: [&str; 4] =
    ["control.period=0.01", "poses.fresh=4.0", "poses.age_limit=5.0", "poses.stop_after=9.0"];

impl Swarming {
    pub fn open(swarm: &Swarm, more: &[&str]) -> Self {
        Self::open_for(swarm, more, None)
    }

    /// With the node of one robot.
    pub fn open_for(swarm: &Swarm, more: &[&str], member: Option<&str>) -> Self {
        Self {
            robots: RobotNodes::open(swarm, &arguments(&[]), Layout::OneNode).expect("robots"),
            node: FormationNode::open(swarm, &arguments(more), member).expect("a node"),
        }
    }

    pub fn tick(&mut self) {
        self.robots.tick();
        std::thread::sleep(Duration::from_millis(4));
        self.node.tick();
        std::thread::sleep(Duration::from_millis(4));
    }

    pub fn fly_until(&mut self, what: &str, mut done: impl FnMut(&Self) -> bool) {
        until(what, || {
            self.tick();
            done(self).then_some(())
        });
    }

    pub fn until_all_are_heard(&mut self) {
        self.fly_until("everybody is heard", |swarm| {
            let control = swarm.node.control();
            (0..control.formation().count()).all(|m| control.health(m) == Health::Fresh)
        });
    }
}

/// Asks for transitions, one after the other; says which were made.
pub fn ask(peers: &mut Peers, swarm: &mut Swarming, labels: &[&str]) -> Vec<bool> {
    let client = client::<ChangeState>(peers, ServiceMapping::Enhanced, "/flockform/change_state");
    let mut ask = |id: u8, label: &str| {
        let transition = Transition { id, label: label.into() };
        call::<ChangeState>(&client, &ChangeStateRequest { transition }, &mut || swarm.tick()).success
    };
    // Once this is answered no reply is lost: a request sent again after one that was carried out would be refused.
    assert!(!ask(99, "none"), "there is no such transition");
    labels.iter().map(|label| ask(0, label)).collect()
}

/// Has the node make transitions, one after the other.
pub fn change(peers: &mut Peers, swarm: &mut Swarming, labels: &[&str]) {
    let made = ask(peers, swarm, labels);
    assert!(made.iter().all(|&made| made), "{labels:?}: {made:?}");
}

#[test]
fn simulated_robots_fly_the_manoeuvre_that_the_node_leads() {
    let peers = peers();
    // Shorter and faster than the file's own, so that the test is.
    let mut overrides = vec![
        "manoeuvres[0].legs=[{ seconds = 1.0, translate = [2.0, 0.5], rotate = 30.0 }]",
        "node.markers=true",
        "limits.speed=8.0",
    ];
    overrides.extend(PATIENT);
    let mut swarm = Swarming::open(&square(&overrides), &[]);
    let hearer = peers.theirs.node("/", "listener").expect("a node");
    let reliable = Quality::reliable(5);
    let states = hearer.subscription::<FormationState>("/flockform/state", reliable).expect("hears");
    let markers = hearer.subscription::<MarkerArray>("/flockform/markers", reliable).expect("hears");
    let reports = hearer.subscription::<DiagnosticArray>("/diagnostics", reliable).expect("hears");
    swarm.until_all_are_heard();
    let mut seen = (None, None, None);
    swarm.fly_until("the formation is where it was led, and says so", |swarm| {
        seen.0 = states.take_last().map(|(state, _)| state).or(seen.0.take());
        seen.1 = markers.take_last().map(|(markers, _)| markers).or(seen.1.take());
        seen.2 = reports.take_last().map(|(report, _)| report).or(seen.2.take());
        let control = swarm.node.control();
        let formation = control.formation();
        let map = formation.affine(control.program_time()).expect("a manoeuvre");
        let places = swarm.robots.fleet().places();
        let apart = |m: usize| distance(places.get(m), map.apply(formation.places.get(m)));
        let worst = (0..formation.count()).map(apart).fold(0.0, f64::max);
        let told = seen.0.is_some() && seen.1.is_some() && seen.2.is_some();
        control.program_time() > 1.2 && worst < 0.01 && told
    });
    let (Some(state), Some(markers), Some(report)) = seen else { unreachable!("waited for") };
    assert_eq!((state.mode, state.members.len()), (FormationState::RUNNING, 25));
    assert_eq!(state.header.frame_id, "map");
    assert_eq!(state.members.iter().filter(|member| member.role == MemberState::LEADER).count(), 4);
    assert!(state.members.iter().all(|member| member.health == MemberState::FRESH));
    assert!(state.clearance > 0.3 - 1e-9, "{}", state.clearance);
    let followers = state.members.iter().filter(|member| member.role == MemberState::FOLLOWER);
    let farthest = followers.map(|member| member.to_settled).fold(0.0, f64::max);
    assert_eq!(state.formation_error, farthest, "as its definition says");
    assert_eq!(markers.markers.iter().filter(|marker| marker.ns == "members").count(), 25);
    assert_eq!(report.status[0].name, "/flockform: formation");
}

#[test]
fn the_node_publishes_the_targets_of_the_control_loop_to_the_bit() {
    let peers = peers();
    let mut swarm = Swarming::open(&square(&PATIENT), &["-r", "/robot_7/target_pose:=/elsewhere/goal"]);
    let hearer = peers.theirs.node("/", "listener").expect("a node");
    let targets = hearer.subscription::<PoseStamped>("/elsewhere/goal", Quality::reliable(1)).expect("hears");
    swarm.until_all_are_heard();
    until("a target at its remapped topic", || {
        while targets.take().is_some() {}
        swarm.tick();
        let expected = swarm.node.control().target(6).expect("heard");
        std::thread::sleep(Duration::from_millis(30));
        let (message, _) = targets.take_last()?;
        let place = [message.pose.position.x, message.pose.position.y];
        assert_eq!(place.map(f64::to_bits), expected.map(f64::to_bits));
        Some(())
    });
}

#[test]
fn an_emergency_stop_holds_everybody_until_it_is_lifted() {
    let mut peers = peers();
    let mut swarm = Swarming::open(&square(&PATIENT), &[]);
    let mut ask = |swarm: &mut Swarming, name: &str| {
        let client = client::<std_srvs::Trigger>(&mut peers, ServiceMapping::Enhanced, name);
        call::<std_srvs::Trigger>(&client, &Empty, &mut || swarm.tick())
    };
    swarm.until_all_are_heard();
    assert!(ask(&mut swarm, "/flockform/emergency_stop").success);
    assert_eq!(swarm.node.control().mode(), Mode::EmergencyStopped);
    (0..20).for_each(|_| swarm.tick());
    let before = swarm.robots.fleet().places();
    (0..20).for_each(|_| swarm.tick());
    assert_eq!(swarm.robots.fleet().places(), before, "everybody stands");
    assert!(ask(&mut swarm, "/flockform/resume").success);
    assert_eq!(swarm.node.control().mode(), Mode::Running);
    assert!(!ask(&mut swarm, "/flockform/resume").success, "there is nothing left to lift");
}

#[test]
fn a_message_stops_everybody_where_the_file_allows_it() {
    let peers = peers();
    let speaker = peers.theirs.node("/", "red_button").expect("a node");
    let request = speaker
        .publisher::<Empty>("/flockform/emergency_stop_request", Quality::reliable(1))
        .expect("speaks");
    let deaf = [&PATIENT[..], &["node.commands=none"]].concat();
    let mut swarm = Swarming::open(&square(&deaf), &[]);
    swarm.until_all_are_heard();
    for _ in 0..20 {
        let _ = request.publish(&Empty);
        swarm.tick();
    }
    assert_eq!((request.matched(), swarm.node.control().mode()), (0, Mode::Running));
    drop(swarm);
    let mut swarm = Swarming::open(&square(&PATIENT), &[]);
    swarm.until_all_are_heard();
    swarm.fly_until("a stop", |swarm| {
        let _ = request.publish(&Empty);
        swarm.node.control().mode() == Mode::EmergencyStopped
    });
}

#[test]
fn a_member_s_own_node_hears_its_neighbours_alone_and_moves_nobody_else() {
    let _peers = peers();
    let mut overrides = vec!["control.sweeps=1", "node.hears=\"neighbours\""];
    overrides.extend(PATIENT);
    let swarm = square(&overrides);
    let mut robots = RobotNodes::open(&swarm, &arguments(&[]), Layout::OneNode).expect("robots");
    let mut node = FormationNode::open(&swarm, &arguments(&[]), Some("robot_7")).expect("a node");
    // Column by column, five high: robot_7 is the second of the second column.
    let near = [0, 1, 2, 5, 6, 7, 10, 11, 12];
    until("its neighbours are heard", || {
        robots.tick();
        std::thread::sleep(Duration::from_millis(4));
        node.tick();
        near.iter().all(|&m| node.control().health(m) == Health::Fresh).then_some(())
    });
    let control = node.control();
    let heard: Vec<usize> = (0..25).filter(|&m| control.position(m).is_some()).collect();
    assert_eq!(heard, near);
    assert!(control.target(6).is_some());
    // robot_1 leads and is among them; that nobody hears the other leaders does not keep the program waiting.
    assert!(control.program_time() > 0.0);
}
