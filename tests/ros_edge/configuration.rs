//! What `configure` opens and `cleanup` closes.

use std::path::Path;
use std::sync::mpsc::{channel, sync_channel};

use flockform::flock::vectors::distance;
use flockform::messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use flockform::messages::flockform_msgs::{FormationState, LoopEvent};
use flockform::messages::geometry_msgs::PoseStamped;
use flockform::messages::rcl_interfaces::{Parameter, SetParameters, Settings};
use flockform::record::replay::{Report, replay_file};
use flockform::record::{About, Reader, Recording, Shared};
use flockform::ros::edge::Quality;
use flockform::ros::edge::parameters::Value;
use flockform::ros::node::{CommandQueue, FormationNode, NodeCommand};
use flockform::ros::robots::{Layout, RobotNodes};
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::{Control, Mode};
use ros2_client::ServiceMapping;

use super::formation::{PATIENT, Swarming, arguments, ask, change, square};
use super::interfaces::stamped;
use super::support::*;

const MAPPING: ServiceMapping = ServiceMapping::Enhanced;

fn set(peers: &mut Peers, swarm: &mut Swarming, name: &str, value: &str) -> Result<(), String> {
    let value = Value::String(value.into()).to_wire();
    let request = Settings { parameters: vec![Parameter { name: name.into(), value }] };
    let client = client::<SetParameters>(peers, MAPPING, "/flockform/set_parameters");
    let answer = call::<SetParameters>(&client, &request, &mut || swarm.tick());
    let result = answer.results.into_iter().next().expect("one for each");
    if result.successful { Ok(()) } else { Err(result.reason) }
}

#[test]
fn a_node_is_configured_with_names_that_were_set_while_it_was_not() {
    let mut peers = peers();
    let mut swarm = Swarming::open(&square(&PATIENT), &[]);
    let hearer = peers.theirs.node("/", "configurer").expect("a node");
    let reliable = Quality::reliable(5);
    let states = hearer.subscription::<FormationState>("/flockform/state", reliable).expect("hears");
    let goals = hearer.subscription::<PoseStamped>("/robot_7/goal", reliable).expect("hears");
    let targets = hearer.subscription::<PoseStamped>("/robot_7/target_pose", reliable).expect("hears");
    swarm.until_all_are_heard();
    swarm.fly_until("a state", |_| states.take_last().is_some());
    swarm.fly_until("targets by their first name", |_| targets.matched() == 1);

    let refused = set(&mut peers, &mut swarm, "target_topic", "{name}/goal").expect_err("it flies");
    assert!(refused.contains("cleanup"), "{refused}");
    assert_eq!(set(&mut peers, &mut swarm, "target_topic", "{name}/target_pose"), Ok(()), "as it is");

    swarm.fly_until("the leaders are under way", |swarm| swarm.node.control().program_time() > 0.1);
    let before = swarm.node.control().program_time();
    change(&mut peers, &mut swarm, &["deactivate", "cleanup"]);
    swarm.fly_until("the state's topic is closed", |_| states.matched() == 0);
    swarm.fly_until("the targets' topic is closed", |_| targets.matched() == 0);
    while states.take().is_some() {}
    let refused = set(&mut peers, &mut swarm, "target_topic", "{name}/no goal").expect_err("no name");
    assert!(refused.contains("` `"), "{refused}");
    assert_eq!(set(&mut peers, &mut swarm, "target_topic", "{name}/goal"), Ok(()));

    change(&mut peers, &mut swarm, &["configure"]);
    assert!(swarm.node.control().program_time() < before, "the formation begins anew");
    change(&mut peers, &mut swarm, &["activate"]);
    swarm.fly_until("targets by their new name", |_| goals.take_last().is_some());
    swarm.fly_until("a state again", |_| states.take_last().is_some());
    assert_eq!(targets.matched(), 0, "the topic of the first name stays closed");
}

#[test]
fn places_of_leaders_from_before_cleanup_are_forgotten() {
    let mut peers = peers();
    let external = "leaders[0].program={ kind = \"external\" }";
    let mut swarm = Swarming::open(&square(&[&PATIENT[..], &[external]].concat()), &[]);
    let guide = peers.theirs.node("/", "former_guide").expect("a node");
    let (name, corner) = {
        let formation = swarm.node.control().formation();
        (formation.names[0].clone(), formation.places.get(0))
    };
    let topic = guide.publisher(&format!("/{name}/leader_pose"), Quality::BEST_EFFORT).expect("out");
    let away = [corner[0] - 0.5, corner[1] - 0.5];
    swarm.until_all_are_heard();
    swarm.fly_until("the corner is led away", |swarm| {
        topic.publish(&stamped(away, "map")).expect("sent");
        distance(swarm.node.control().wanted(0), away) < 1e-6
    });
    // The rest of what is on its way arrives.
    (0..20).for_each(|_| swarm.tick());
    change(&mut peers, &mut swarm, &["deactivate", "cleanup", "configure", "activate"]);
    swarm.until_all_are_heard();
    (0..50).for_each(|_| swarm.tick());
    assert!(distance(swarm.node.control().wanted(0), corner) < 1e-6);
}

#[test]
fn an_emergency_stop_outlasts_cleanup_and_configure() {
    let mut peers = peers();
    let mut swarm = Swarming::open(&square(&PATIENT), &[]);
    swarm.until_all_are_heard();
    let stop =
        client::<flockform::messages::std_srvs::Trigger>(&mut peers, MAPPING, "/flockform/emergency_stop");
    let asked = flockform::messages::std_msgs::Empty;
    let answer = call::<flockform::messages::std_srvs::Trigger>(&stop, &asked, &mut || swarm.tick());
    assert!(answer.success);
    change(&mut peers, &mut swarm, &["deactivate", "cleanup", "configure", "activate"]);
    assert_eq!(swarm.node.control().mode(), Mode::EmergencyStopped);
}

/// Its leaders must move, or a loop that goes on would give the targets of one that begins anew.
fn led_far() -> Swarm {
    let legs = "manoeuvres[0].legs=[{ seconds = 20.0, translate = [2.0, 0.5] }]";
    square(&[&PATIENT[..], &[legs]].concat())
}

fn begin(path: &Path, about: &About) -> Shared {
    Shared::new(Recording::create(path, about, false).expect("writable"))
}

fn finish(recording: &Shared) {
    recording.take().expect("open").finish().expect("whole");
}

/// The report of a recording that replays to the bit.
fn replayed(path: &Path, file: Swarm) -> Report {
    let report = replay_file(path, Some(file), &[], 0.0).expect("readable");
    assert!(report.holds(), "{:?}", report.robots);
    report
}

#[test]
fn a_recording_with_a_cleanup_in_it_replays_to_the_bit() {
    let mut peers = peers();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("flight.mcap");
    let file = led_far();
    let about = About { source: "node", ..About::default() };
    let recording = begin(&path, &about);
    let mut swarm = Swarming::open(&file, &[]);
    swarm.node.record(recording.sink()).expect("named");
    swarm.until_all_are_heard();
    swarm.fly_until("the leaders are under way", |swarm| swarm.node.control().program_time() > 0.3);
    change(&mut peers, &mut swarm, &["deactivate", "cleanup", "configure", "activate"]);
    swarm.until_all_are_heard();
    swarm.fly_until("the leaders are under way again", |swarm| swarm.node.control().program_time() > 0.3);
    drop(swarm);
    finish(&recording);
    let report = replayed(&path, file);
    assert!(report.robots.iter().all(|robot| robot.recorded > 30), "{:?}", report.robots);
}

#[test]
fn a_recording_by_a_simulator_s_time_begins_with_that_and_replays_to_the_bit() {
    let _peers = peers();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("flight.mcap");
    let file = led_far();
    let about = About { source: "node", ..About::default() };
    let recording = begin(&path, &about);
    let mut node =
        FormationNode::open(&file, &arguments(&["-p", "use_sim_time:=true"]), None).expect("a node");
    node.record(recording.sink()).expect("named");
    // Asked of it before there is any time.
    let (ask, commands) = channel();
    let (answers, _answers) = sync_channel(4);
    node.take_commands(CommandQueue { commands, answers });
    for (number, command) in [NodeCommand::EmergencyStop, NodeCommand::Resume].into_iter().enumerate() {
        ask.send((number as u64, command)).expect("taken");
        node.tick();
    }
    let own_time = arguments(&["-p", "publish_clock:=true"]);
    let robots = RobotNodes::open(&file, &own_time, Layout::OneNode).expect("robots");
    let mut swarm = Swarming { node, robots };
    swarm.until_all_are_heard();
    swarm.fly_until("the leaders are under way", |swarm| swarm.node.control().program_time() > 0.3);
    let last = swarm.robots.fleet().time();
    drop(swarm);
    finish(&recording);
    let (mut times, mut kinds) = (Vec::new(), Vec::new());
    let damage = Reader::open(&path).expect("readable").each(&mut |entry| {
        times.push(entry.published);
        if let Some(event) = entry.decode::<LoopEvent>() {
            times.push(event.header.stamp.seconds());
            kinds.push(event.kind);
        }
    });
    assert_eq!(damage, None);
    // As stamps are: whole nanoseconds.
    let outside: Vec<&f64> = times.iter().filter(|time| !(0.0..=last + 0.5e-9).contains(*time)).collect();
    assert!(outside.is_empty(), "{last} {outside:?}");
    let first = kinds.iter().position(|kind| *kind == LoopEvent::TICK).expect("ticks");
    for kind in [LoopEvent::ACTIVE, LoopEvent::EMERGENCY_STOP, LoopEvent::RESUME, LoopEvent::PARAMETER] {
        assert!(kinds[..first].contains(&kind), "{kind} before the first tick: {kinds:?}");
    }
    let report = replayed(&path, file);
    assert!(report.robots.iter().all(|robot| robot.recorded > 20), "{:?}", report.robots);
}

/// What is asked of it before its first tick comes after what it takes over.
#[test]
fn a_recording_of_a_process_that_goes_on_where_another_ended_replays_to_the_bit() {
    let _peers = peers();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("flight.2.mcap");
    let file = led_far();
    let mut swarm = Swarming::open(&file, &[]);
    swarm.until_all_are_heard();
    swarm.fly_until("the leaders are under way", |swarm| swarm.node.control().program_time() > 0.3);
    let (ask, commands) = channel();
    let (answers, _answers) = sync_channel(4);
    swarm.node.take_commands(CommandQueue { commands, answers });
    ask.send((1, NodeCommand::EmergencyStop)).expect("taken");
    swarm.fly_until("it is stopped", |swarm| swarm.node.control().mode() == Mode::EmergencyStopped);
    assert!(swarm.node.has_changed() && !swarm.node.has_changed(), "the next process is to know at once");
    let kept = swarm.node.kept();
    drop(swarm);
    let taken_over = Some(kept.control().clone());
    let about = About { source: "node", taken_over, ..About::default() };
    let recording = begin(&path, &about);
    let mut swarm = Swarming::open(&file, &[]);
    swarm.node.record(recording.sink()).expect("named");
    swarm.node.restore(kept);
    let (ask, commands) = channel();
    let (answers, _answers) = sync_channel(4);
    swarm.node.take_commands(CommandQueue { commands, answers });
    ask.send((1, NodeCommand::Resume)).expect("taken");
    swarm.until_all_are_heard();
    swarm.fly_until("the leaders go on", |swarm| swarm.node.control().program_time() > 0.6);
    drop(swarm);
    finish(&recording);
    let report = replayed(&path, file);
    assert!(report.robots.iter().all(|robot| robot.recorded > 20), "{:?}", report.robots);
}

#[test]
fn a_recording_of_the_node_of_one_robot_replays_to_the_bit() {
    let _peers = peers();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("flight.mcap");
    // It is sent through the others, so that it counts whose targets a node knows.
    let legs = "manoeuvres[0].legs=[{ seconds = 2.0, rotate = 90.0 }]";
    let file = square(&[&PATIENT[..], &[legs, "limits.clearance=0.6", "control.sweeps=1"]].concat());
    let names = Control::new(&file).expect("valid").formation().names.clone();
    let member = names.last().cloned();
    let about = About { source: "node", member: member.clone(), ..About::default() };
    let recording = begin(&path, &about);
    let mut swarm = Swarming::open_for(&file, &[], member.as_deref());
    swarm.node.record(recording.sink()).expect("named");
    swarm.until_all_are_heard();
    swarm.fly_until("it is under way", |swarm| swarm.node.control().program_time() > 1.5);
    drop(swarm);
    finish(&recording);
    let report = replayed(&path, file);
    assert!(report.robots[names.len() - 1].recorded > 20, "{:?}", report.robots);
}

/// Words of the refusal of a topic with two uses.
fn refusal(overrides: &[&str], more: &[&str]) -> String {
    let file = square(&[&PATIENT[..], overrides].concat());
    let refused = FormationNode::open(&file, &arguments(more), None);
    refused.err().expect("a topic has two uses").to_string()
}

#[test]
fn a_topic_with_two_uses_is_refused() {
    let mut peers = peers();
    let shared = refusal(&[], &["-p", "target_topic:=target_pose"]);
    assert!(
        shared.contains("topic /target_pose has two uses: targets of robot_1 and targets of"),
        "{shared}"
    );
    assert!(shared.contains("{name}"), "{shared}");
    let external = "leaders[0].program={ kind = \"external\" }";
    let fed_back = refusal(&[external], &["-p", "leader_topic:='{name}/target_pose'"]);
    assert!(fed_back.contains("targets of") && fed_back.contains("places of"), "{fed_back}");
    let velocities = refusal(&["node.velocity=\"twist\"", "node.velocity_topic=\"/cmd_vel\""], &[]);
    assert!(velocities.contains("velocities of"), "{velocities}");
    // A node that hears itself on its emergency stop would stop for ever.
    for own in
        ["~/state", "~/markers", "/diagnostics", "/parameter_events", "robot_1/target_pose", "/robot_25/pose"]
    {
        let heard = refusal(&[&format!("node.emergency_stop_topic={own:?}")], &[]);
        assert!(heard.contains("has two uses: "), "{own}: {heard}");
    }
    // Nor may what it publishes for others be taken for poses or targets; a recording would have two types on one topic.
    let arrays = ["node.pose_type=\"pose-array\"", "node.target_type=\"pose-array\""];
    for own in ["~/state", "~/markers", "~/events", "/diagnostics", "/rosout", "/parameter_events"] {
        for key in ["pose_topic", "target_topic"] {
            let topic = format!("node.{key}={own:?}");
            let shared = refusal(&[&arrays[..], &[&topic]].concat(), &[]);
            let leaf = own.trim_start_matches('~');
            assert!(
                shared.contains(&format!("{leaf} has two uses: ")) && shared.contains(" of this node"),
                "{shared}"
            );
        }
    }
    for rule in ["/robot_1/target_pose:=/flockform/state", "~/state:=/robot_1/target_pose"] {
        let shared = refusal(&[], &["-r", rule]);
        assert!(shared.contains("has two uses: states of this node and targets of robot_1"), "{shared}");
    }
    let timed = ["node.pose_type=\"pose-array\"", "node.pose_topic=\"/clock\""];
    let shared = refusal(&timed, &["-p", "use_sim_time:=true"]);
    assert!(shared.contains("topic /clock has two uses: "), "{shared}");
    let file = square(&[&PATIENT[..], &["node.emergency_stop_topic=\"/rosout\""]].concat());
    let mut node = FormationNode::open(&file, &arguments(&[]), None).expect("without a log");
    let heard = node.share_log(None, Some(std::sync::mpsc::channel().1)).expect_err("two uses").to_string();
    assert!(heard.contains("topic /rosout has two uses: Log of this node"), "{heard}");
    drop(node);
    // Without leaders moved by topic and without velocities those topics are not used.
    let unused = ["-p", "leader_topic:=/places", "-p", "velocity_topic:=/places"];
    drop(Swarming::open(&square(&PATIENT), &unused));
    for topic in [
        "node.target_topic=\"goal\"",
        "node.pose_topic=\"{name}/target_pose\"",
        "node={ pose_type = \"pose-array\", pose_topic = \"/tf\" }",
        "node={ pose_type = \"pose-array\", pose_topic = \"/clock\" }",
        "node={ pose_type = \"pose-array\", pose_topic = \"/rosout\" }",
    ] {
        let file = square(&[&PATIENT[..], &[topic]].concat());
        let own_time = arguments(&["-p", "publish_clock:=true"]);
        let refused = RobotNodes::open(&file, &own_time, Layout::OneNode).err().expect("two uses");
        assert!(refused.to_string().contains("has two uses"), "{refused}");
    }

    let mut swarm = Swarming::open(&square(&PATIENT), &["-p", "autostart:=false"]);
    assert_eq!(set(&mut peers, &mut swarm, "target_topic", "target_pose"), Ok(()));
    assert_eq!(ask(&mut peers, &mut swarm, &["configure"]), [false]);
    assert_eq!(set(&mut peers, &mut swarm, "target_topic", "{name}/target_pose"), Ok(()));
    change(&mut peers, &mut swarm, &["configure", "activate"]);
    swarm.until_all_are_heard();
}

#[test]
fn a_node_that_is_not_configured_reports_no_error() {
    let peers = peers();
    let hearer = peers.theirs.node("/", "idle_doctor").expect("a node");
    let reports =
        hearer.subscription::<DiagnosticArray>("/diagnostics", Quality::reliable(50)).expect("hears");
    let mut swarm = Swarming::open(&square(&PATIENT), &["-r", "__node:=idle", "-p", "autostart:=false"]);
    let status = until("a report", || {
        swarm.tick();
        let messages = std::iter::from_fn(|| reports.take());
        // The last words of other tests' nodes may come too.
        messages.flat_map(|(report, _)| report.status).find(|status| status.name == "/idle: formation")
    });
    assert_eq!((status.level, &*status.message), (DiagnosticStatus::OK, "not configured"));
}

#[test]
fn a_recording_s_overrides_name_the_topics_that_the_parameters_gave() {
    let mut peers = peers();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("flight.mcap");
    let about = About { source: "node", ..About::default() };
    let recording = begin(&path, &about);
    let (file, given) = (square(&PATIENT), "node.pose_topic=\"{name}/mocap\"");
    let renamed = square(&[&PATIENT[..], &[given]].concat());
    let more = ["-p", "pose_topic:='{name}/mocap'"];
    let mut swarm = Swarming {
        robots: RobotNodes::open(&renamed, &arguments(&[]), Layout::OneNode).expect("robots"),
        node: FormationNode::open(&file, &arguments(&more), None).expect("a node"),
    };
    assert_eq!(swarm.node.overrides(&file), [given]);
    assert_eq!(swarm.node.overrides(&renamed), [""; 0]);
    swarm.node.record(recording.sink()).expect("named");
    swarm.until_all_are_heard();
    change(&mut peers, &mut swarm, &["deactivate"]);
    drop(swarm);
    recording.take().expect("open").finish().expect("whole");
    let report = replay_file(&path, Some(renamed), &[], 0.0).expect("readable");
    assert!(report.poses > 25, "{}", report.poses);
}
