//! Who may command a node, and what nobody may.

use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};

use flockform::messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use flockform::messages::flockform_msgs::SetFormationRequest;
use flockform::messages::formation::leaders::set_formation;
use flockform::messages::std_msgs::Empty;
use flockform::messages::type_description_interfaces::{GetTypeDescription, GetTypeDescriptionRequest};
use flockform::messages::{lifecycle_msgs, rcl_interfaces, std_srvs};
use flockform::ros::arguments::Severity;
use flockform::ros::edge::Quality;
use flockform::ros::edge::lifecycle::State;
use flockform::ros::edge::loggers::LogLevel;
use flockform::ros::edge::parameters::Value;
use flockform::ros::node::{CommandQueue, FormationNode, NodeCommand};
use flockform::swarm::control::{Control, Mode};
use ros2_client::ServiceMapping;

use super::formation::{PATIENT, Swarming, arguments, square};
use super::support::*;

fn set(peers: &mut Peers, swarm: &mut Swarming, name: &str, value: f64) -> Result<(), String> {
    set_value(peers, swarm, name, &Value::Double(value))
}

fn set_value(peers: &mut Peers, swarm: &mut Swarming, name: &str, value: &Value) -> Result<(), String> {
    let parameter = rcl_interfaces::Parameter { name: name.into(), value: value.to_wire() };
    let request = rcl_interfaces::Settings { parameters: vec![parameter] };
    let service = "/flockform/set_parameters";
    let client = client::<rcl_interfaces::SetParameters>(peers, ServiceMapping::Enhanced, service);
    let answer = call::<rcl_interfaces::SetParameters>(&client, &request, &mut || swarm.tick());
    let result = answer.results.into_iter().next().expect("one for each");
    if result.successful { Ok(()) } else { Err(result.reason) }
}

#[test]
fn limits_are_tightened_and_never_loosened() {
    let mut peers = peers();
    let mut swarm = Swarming::open(&square(&PATIENT), &[]);
    for (name, value) in [
        ("speed_limit", 0.0),
        ("speed_limit", 1.001),
        ("clearance", 0.0),
        ("clearance", 0.299),
        ("speed_limit", -0.0),
    ] {
        let refused = set(&mut peers, &mut swarm, name, value).expect_err("loosens");
        assert!(refused.contains(name), "{refused}");
    }
    assert_eq!((swarm.node.control().limits().speed, swarm.node.control().limits().clearance), (1.0, 0.3));
    assert_eq!(set(&mut peers, &mut swarm, "speed_limit", 0.25), Ok(()));
    assert_eq!(set(&mut peers, &mut swarm, "clearance", 0.4), Ok(()));
    assert_eq!((swarm.node.control().limits().speed, swarm.node.control().limits().clearance), (0.25, 0.4));
    // Back to the file's, and not beyond.
    assert_eq!(set(&mut peers, &mut swarm, "speed_limit", 1.0), Ok(()));
}

#[test]
fn a_clearance_where_robots_are_not_kept_apart_is_refused() {
    let mut peers = peers();
    let apart_from_nothing = [&PATIENT[..], &["limits={speed=1.0}"]].concat();
    let mut swarm = Swarming::open(&square(&apart_from_nothing), &[]);
    let refused = set(&mut peers, &mut swarm, "clearance", 0.5).expect_err("without effect");
    assert!(refused.contains("limits.clearance"), "{refused}");
}

#[test]
fn the_gains_of_the_rule_change_while_it_flies() {
    let mut peers = peers();
    let mut swarm = Swarming::open(&square(&PATIENT), &[]);
    assert_eq!(set(&mut peers, &mut swarm, "damping", 0.5), Ok(()));
    assert_eq!(set_value(&mut peers, &mut swarm, "sweeps", &Value::Integer(7)), Ok(()));
    let many = set_value(&mut peers, &mut swarm, "sweeps", &Value::Integer(1001)).expect_err("too many");
    assert!(many.contains("1 to 1000"), "{many}");
    let refused = set_value(&mut peers, &mut swarm, "sweeps", &Value::Integer(0)).expect_err("none");
    assert!(refused.contains("1 to 1000"), "{refused}");
    let control = swarm.node.control();
    assert_eq!((control.damping(), control.sweeps()), (0.5, 7));
    // What another process would go on from.
    let kept = swarm.node.kept();
    drop(swarm);
    let mut again = Swarming::open(&square(&PATIENT), &[]);
    again.node.restore(kept);
    assert_eq!((again.node.control().damping(), again.node.control().sweeps()), (0.5, 7));
}

#[test]
fn a_formation_that_the_limits_cannot_fly_is_refused() {
    let fenced = "limits.geofence=[[-5.0, -5.0], [20.0, -5.0], [20.0, 20.0], [-5.0, 20.0]]";
    for (overrides, request, says) in [
        (
            &[][..],
            SetFormationRequest { translate: [9.0, 9.0], duration: 0.1, ..moved() },
            "duration of at least",
        ),
        (&[], SetFormationRequest { translate: [1.4e308, 0.0], duration: 1e3, ..moved() }, "poses.range"),
        (&[], SetFormationRequest { stretch: [1e308, 1e308], duration: 1e3, ..moved() }, "poses.range"),
        (&[fenced], SetFormationRequest { translate: [15.0, 0.0], duration: 100.0, ..moved() }, "geofence"),
        (
            &["limits.acceleration=0.1"],
            SetFormationRequest { rotate: 1.0, duration: 4.0, ..moved() },
            "m/s^2",
        ),
    ] {
        let mut control = Control::new(&square(overrides)).expect("valid");
        let refused = set_formation(&mut control, &request).expect_err("nobody can fly it");
        assert!(refused.contains(says), "{refused}");
    }
    // What a refusal says will do does.
    let mut control = Control::new(&square(&[])).expect("valid");
    let asked = SetFormationRequest { translate: [9.0, 0.0], duration: 1.0, ..moved() };
    let refused = set_formation(&mut control, &asked).expect_err("9 m in a second");
    let duration =
        refused.rsplit("at least ").next().and_then(|rest| rest.trim_end_matches(" s").parse().ok());
    let duration: f64 = duration.expect("a number");
    assert!((13.4..13.7).contains(&duration), "{refused}");
    set_formation(&mut control, &SetFormationRequest { duration, ..asked }).expect("flyable");
}

#[test]
fn a_manoeuvre_of_the_file_is_begun_only_where_it_can_be_flown() {
    let far =
        "manoeuvres[0].legs=[{ seconds = 5.0, hold = 1.0 }, { seconds = 100.0, translate = [15.0, 0.0] }]";
    let fast = "manoeuvres[0].legs=[{ seconds = 5.0 }, { seconds = 1.0, translate = [5.0, 0.0] }]";
    let fenced = "limits.geofence=[[-5.0, -5.0], [20.0, -5.0], [20.0, 20.0], [-5.0, 20.0]]";
    for (overrides, says) in
        [(&[far, fenced][..], "geofence"), (&[fast], "its legs would have to take at least 4")]
    {
        let mut control = Control::new(&square(overrides)).expect("valid");
        let name = control.formation().manoeuvres[0].name.clone();
        let refused =
            set_formation(&mut control, &SetFormationRequest { name, ..moved() }).expect_err("not flyable");
        assert!(refused.contains(says), "{refused}");
    }
    let mut control = Control::new(&square(&[far])).expect("valid");
    let name = control.formation().manoeuvres[0].name.clone();
    let request = SetFormationRequest { name, ..moved() };
    set_formation(&mut control, &request).expect("without a fence");
    let limits = flockform::swarm::safety::Limits { speed: 0.1, ..control.limits().clone() };
    control.set_limits(limits).expect("a limit");
    let refused = set_formation(&mut control, &request).expect_err("the limit is lower now");
    assert!(refused.contains("the limits are 0.1"), "{refused}");
}

fn moved() -> SetFormationRequest {
    SetFormationRequest { stretch: [1.0; 2], ..SetFormationRequest::default() }
}

#[test]
fn a_swarm_takes_the_commands_that_its_file_allows() {
    let mut peers = peers();
    for commands in ["none", "stop-only"] {
        let of = format!("node.commands={commands}");
        let overrides: Vec<&str> = PATIENT.into_iter().chain([of.as_str()]).collect();
        let mut swarm = Swarming::open(&square(&overrides), &["-r", "__ns:=/shy"]);
        let mut trigger = |swarm: &mut Swarming, name: &str| {
            let client = client::<std_srvs::Trigger>(&mut peers, ServiceMapping::Enhanced, name);
            call::<std_srvs::Trigger>(&client, &Empty, &mut || swarm.tick())
        };
        let stopped = trigger(&mut swarm, "/shy/flockform/emergency_stop");
        assert_eq!(stopped.success, commands == "stop-only", "{stopped:?}");
        let mode = if stopped.success { Mode::EmergencyStopped } else { Mode::Running };
        assert_eq!(swarm.node.control().mode(), mode);
        let resumed = trigger(&mut swarm, "/shy/flockform/resume");
        assert!(!resumed.success && resumed.message.contains(commands), "{resumed:?}");
        assert_eq!(swarm.node.control().mode(), mode);
        let mut change = |swarm: &mut Swarming, label: &str| {
            let name = "/shy/flockform/change_state";
            let client = client::<lifecycle_msgs::ChangeState>(&mut peers, ServiceMapping::Enhanced, name);
            let transition = lifecycle_msgs::Transition { id: 0, label: label.into() };
            let request = lifecycle_msgs::ChangeStateRequest { transition };
            call::<lifecycle_msgs::ChangeState>(&client, &request, &mut || swarm.tick()).success
        };
        assert!(!change(&mut swarm, State::Inactive.name()), "no transition");
        assert_eq!(change(&mut swarm, "deactivate"), commands == "stop-only");
        assert!(!change(&mut swarm, "activate"));
    }
}

#[test]
fn commands_of_the_program_around_a_node_are_those_of_peers() {
    let _peers = peers();
    let permissions = [("none", [false; 4]), ("stop-only", [true, true, false, false]), ("all", [true; 4])];
    for (allowed, may) in permissions {
        let of = format!("node.commands={allowed}");
        let overrides: Vec<&str> = PATIENT.into_iter().chain([of.as_str()]).collect();
        let mut swarm = Swarming::open(&square(&overrides), &["-r", "__ns:=/own"]);
        let (send, commands) = sync_channel(8);
        let (answers, answered) = sync_channel(2);
        swarm.node.take_commands(CommandQueue { commands, answers });
        let asked = [
            NodeCommand::ChangeState("deactivate"),
            NodeCommand::EmergencyStop,
            NodeCommand::Resume,
            NodeCommand::SetFormation(SetFormationRequest {
                translate: [1.0, 0.0],
                duration: 5.0,
                ..moved()
            }),
        ];
        for (command, may) in asked.into_iter().zip(may) {
            send.send((7, command.clone())).expect("there is room");
            swarm.tick();
            let (number, answer) = answered.try_recv().expect("answered in the same period");
            assert_eq!((number, answer.is_ok()), (7, may), "{allowed}, {command:?}: {answer:?}");
            assert!(may || answer.is_err_and(|words| words.contains(allowed)));
        }
        // A second transition in one period, and answers that nobody takes.
        for label in ["activate", "deactivate", "activate"] {
            send.send((8, NodeCommand::ChangeState(label))).expect("room");
        }
        swarm.tick();
        let second = answered.try_iter().nth(1).expect("two have room").1;
        assert!(second.is_err_and(|words| words.contains("another transition") || words.contains(allowed)));
        let state = serde_json::to_value(swarm.node.kept()).expect("JSON")["state"].clone();
        assert_eq!(state, if allowed == "stop-only" { "inactive" } else { "active" });
        if allowed != "all" {
            continue;
        }
        send.send((9, NodeCommand::ChangeState("shutdown"))).expect("room");
        swarm.tick();
        let named = SetFormationRequest { name: "move".to_owned(), ..moved() };
        for command in [NodeCommand::EmergencyStop, NodeCommand::Resume, NodeCommand::SetFormation(named)] {
            answered.try_iter().for_each(drop);
            send.send((10, command.clone())).expect("room");
            swarm.tick();
            let refused = answered.try_recv().expect("answered").1.expect_err("it flies no more");
            assert!(refused.contains("finalized"), "{command:?}: {refused}");
        }
    }
}

#[test]
fn the_node_of_one_robot_answers_commands_for_that_robot_alone() {
    let _peers = peers();
    let swarm = square(&[&["control.sweeps=1"], &PATIENT[..]].concat());
    let answers = |member: Option<&str>| {
        let swarm = if member.is_some() { swarm.clone() } else { square(&PATIENT) };
        let mut node = FormationNode::open(&swarm, &arguments(&[]), member).expect("a node");
        let ((send, commands), (answers, answered)) = (sync_channel(8), sync_channel(8));
        node.take_commands(CommandQueue { commands, answers });
        let led = SetFormationRequest { translate: [1.0, 0.0], duration: 5.0, ..moved() };
        for command in [NodeCommand::EmergencyStop, NodeCommand::Resume, NodeCommand::SetFormation(led)] {
            send.send((0, command)).expect("room");
        }
        node.tick();
        answered.try_iter().map(|(_, answer)| answer.expect("done")).collect::<Vec<_>>()
    };
    let (of_all, of_one) = (answers(None), answers(Some("robot_7")));
    assert_eq!((of_all.len(), of_one.len()), (3, 3));
    for (all, one) in of_all.iter().zip(&of_one) {
        assert!(!all.contains("robot_7"), "{all}");
        assert!(one.contains("`robot_7` alone") && !one.contains("every robot"), "{one}");
    }
}

#[test]
fn a_second_node_of_the_same_name_is_noticed_and_reported() {
    let peers = peers();
    let mut swarm = Swarming::open(&square(&PATIENT), &["-r", "__node:=alone"]);
    let hearer = peers.theirs.node("/", "doctor").expect("a node");
    let reports =
        hearer.subscription::<DiagnosticArray>("/diagnostics", Quality::reliable(5)).expect("hears");
    let told = |swarm: &mut Swarming, holds: &dyn Fn(&DiagnosticStatus) -> bool| {
        swarm.fly_until("diagnostics that say so", |_| {
            reports.take_last().is_some_and(|(report, _)| holds(&report.status[0]))
        });
    };
    swarm.until_all_are_heard();
    told(&mut swarm, &|status| !status.message.contains("name"));
    let twin = peers.theirs.node("/", "alone").expect("a node");
    told(&mut swarm, &|status| {
        status.level == DiagnosticStatus::ERROR && status.message.contains("1 other node has the name /alone")
    });
    drop(twin);
    told(&mut swarm, &|status| !status.message.contains("name"));
}

#[test]
fn a_peer_without_our_files_is_told_what_our_messages_are_made_of() {
    let mut peers = peers();
    let asked_for = [&PATIENT[..], &["node.services=[\"type-description\"]"]].concat();
    let mut swarm = Swarming::open(&square(&asked_for), &[]);
    let name = "/flockform/get_type_description";
    let ask = client::<GetTypeDescription>(&mut peers, ServiceMapping::Enhanced, name);
    let type_name = "flockform_msgs/msg/FormationState".to_owned();
    let asked = GetTypeDescriptionRequest { type_name, include_type_sources: true, ..Default::default() };
    let answer = call::<GetTypeDescription>(&ask, &asked, &mut || swarm.tick());
    assert!(answer.successful, "{}", answer.failure_reason);
    assert!(answer.type_sources[0].raw_file_contents.contains("MemberState[] members"));
    let fields = &answer.type_description.type_description.fields;
    assert!(fields.iter().any(|field| field.kind.nested_type_name == "flockform_msgs/msg/MemberState"));
    let asked = GetTypeDescriptionRequest { type_hash: "RIHS01_ff".into(), ..asked };
    let refused = call::<GetTypeDescription>(&ask, &asked, &mut || swarm.tick());
    assert!(!refused.successful && refused.failure_reason.contains("RIHS01_"), "{refused:?}");
}

#[test]
fn the_log_s_level_is_read_and_set_by_the_node_s_name_where_commands_are_allowed() {
    use rcl_interfaces::{GetLoggerLevels, LoggerLevel, Names, SetLoggerLevels, SetLoggerLevelsRequest};
    let mut peers = peers();
    let severity = Arc::new(Mutex::new(Severity::Unset));
    for (overrides, may) in [(&[][..], true), (&["node.commands=\"stop-only\""], false)] {
        *severity.lock().expect("whole") = Severity::Info;
        let (read, written) = (Arc::clone(&severity), Arc::clone(&severity));
        let level = LogLevel {
            get: Box::new(move || *read.lock().expect("whole")),
            set: Box::new(move |wanted| {
                *written.lock().expect("whole") = wanted;
                Ok(())
            }),
        };
        let asked_for = ["node.services=[\"logger-levels\"]"];
        let mut swarm = Swarming::open(&square(&[&PATIENT[..], overrides, &asked_for].concat()), &[]);
        swarm.node.share_log(Some(level), None).expect("services");
        let mapping = ServiceMapping::Enhanced;
        let get = client::<GetLoggerLevels>(&mut peers, mapping, "/flockform/get_logger_levels");
        let set = client::<SetLoggerLevels>(&mut peers, mapping, "/flockform/set_logger_levels");
        let names = Names { names: vec!["flockform".into(), "else".into()] };
        let levels = call::<GetLoggerLevels>(&get, &names, &mut || swarm.tick()).levels;
        assert_eq!(levels.iter().map(|one| one.level).collect::<Vec<_>>(), [20, 0]);
        let wanted = [("flockform", 10), ("flockform", 11), ("else", 10)];
        let levels = wanted.map(|(name, level)| LoggerLevel { name: name.into(), level }).into();
        let asked = SetLoggerLevelsRequest { levels };
        let results = call::<SetLoggerLevels>(&set, &asked, &mut || swarm.tick()).results;
        assert_eq!(results.iter().map(|one| one.successful).collect::<Vec<_>>(), [may, false, false]);
        let expected = if may { Severity::Debug } else { Severity::Info };
        assert_eq!(*severity.lock().expect("whole"), expected);
        let levels = vec![LoggerLevel { name: "flockform".into(), level: 40 }; 17];
        let results = call::<SetLoggerLevels>(&set, &SetLoggerLevelsRequest { levels }, &mut || swarm.tick());
        assert_eq!(results.results.len(), 17);
        assert!(results.results.iter().all(|one| !one.successful));
        assert_eq!(*severity.lock().expect("whole"), expected, "too many in one request");
    }
}
