//! What others read in our files is what we wrote.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use flockform::messages::diagnostic_msgs::DiagnosticArray;
use flockform::messages::flockform_msgs::{FormationState, LoopEvent};
use flockform::messages::geometry_msgs::{PoseArray, PoseStamped, PoseWithCovarianceStamped};
use flockform::messages::nav_msgs::Odometry;
use flockform::messages::recorder::RecordedMessage;
use flockform::messages::visualization_msgs::MarkerArray;
use flockform::record::{About, Entry, Reader, Recording};

use crate::program::*;

/// A message of any type that recordings have.
fn as_json(entry: &Entry) -> serde_json::Value {
    macro_rules! any {
        ($($message:ty),+) => {{
            $(if let Some(message) = entry.decode::<$message>() {
                return serde_json::to_value(&message).expect("plain data");
            })+
            panic!("{} is of a type that no recording has: {}", entry.topic, entry.kind)
        }};
    }
    any!(
        PoseStamped,
        PoseWithCovarianceStamped,
        Odometry,
        PoseArray,
        MarkerArray,
        FormationState,
        LoopEvent,
        DiagnosticArray
    )
}

/// Writes down what stands in a recording; topics and how many messages each has.
fn expected(recording: &Path, into: &Path) -> Vec<(String, usize)> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(into).expect("a file"));
    let mut topics: Vec<(String, usize)> = Vec::new();
    let damage = Reader::open(recording).expect("readable").each(&mut |entry| {
        let kind = entry.kind.replace('/', "/msg/");
        let line = serde_json::json!({"topic": &*entry.topic, "type": kind, "message": as_json(entry)});
        writeln!(out, "{line}").expect("written");
        match topics.iter_mut().find(|(topic, _)| **topic == *entry.topic) {
            Some((_, count)) => *count += 1,
            None => topics.push((entry.topic.to_string(), 1)),
        }
    });
    assert_eq!(damage, None);
    topics
}

fn python(script: &str, arguments: &[&Path]) {
    let python = std::env::var("FLOCKFORM_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/recording").join(script);
    let output = Command::new(python).arg(script).args(arguments).output().expect("Python is there");
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    println!("{said}");
}

#[test]
fn a_flight_s_recording_has_the_topics_of_the_live_node() {
    let folder = temporary();
    let calm = ["--set", "flight.duration=2.0", "--set", "flight.bounds={}"];
    let flight = [&["swarm", "square", "-q", "--out", "o", "--record", "f.mcap"][..], &calm].concat();
    says(0, &flight, folder.path());
    let topics = expected(&folder.path().join("f.mcap"), &folder.path().join("f.jsonl"));
    let count = |topic: &str| topics.iter().find(|(one, _)| one == topic).map(|(_, count)| *count);
    let ticks = count("/robot_1/target_pose").expect("targets");
    assert_eq!(count("/robot_25/pose"), Some(ticks));
    // Before the ticks come six parameters and the start.
    assert_eq!(count("/flockform/events"), Some(ticks + 7));
    assert!(count("/flockform/state").is_some() && count("/flockform/markers").is_some(), "{topics:?}");
    assert!(count("/diagnostics").is_some(), "{topics:?}");
    assert!(!folder.path().join("f.mcap.part").exists());
}

/// The last message of each kind in the recording of a bundled scene.
fn last_of_body(scene: &str, sets: &[&str]) -> (PoseArray, FormationState, MarkerArray, DiagnosticArray) {
    let folder = temporary();
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    let run = ["run", scene, "-q", "--figures", "none", "--no-report", "--out", "o", "--record", "b.mcap"];
    says(0, &run.into_iter().chain(sets).collect::<Vec<_>>(), folder.path());
    let (mut poses, mut state, mut markers, mut diagnostics) = (None, None, None, None);
    let reader = Reader::open(&folder.path().join("b.mcap")).expect("readable");
    let damage = reader.each(&mut |entry| {
        poses = entry.decode().or(poses.take());
        state = entry.decode().or(state.take());
        markers = entry.decode().or(markers.take());
        diagnostics = entry.decode().or(diagnostics.take());
    });
    assert_eq!(damage, None);
    (
        poses.expect("poses"),
        state.expect("a state"),
        markers.expect("markers"),
        diagnostics.expect("diagnostics"),
    )
}

#[test]
fn bodies_are_recorded_in_metres_where_their_unit_has_any_and_say_so_where_it_has_none() {
    let of = |unit: &str| last_of_body("tension", &["stop.steps=20", unit]);
    let unit_said = |all: &DiagnosticArray| {
        let of_unit = all.status[0].values.iter().find(|pair| pair.key == "unit of length");
        of_unit.expect("there").value.clone()
    };
    let (poses, state, markers, said) = of("unit=\"m\"");
    assert_eq!((unit_said(&said).as_str(), said.status[0].message.as_str()), ("m", "stepping"));
    let near = |small: f64, large: f64, by: f64| (small - by * large).abs() <= 1e-12 * (by * large).abs();
    let (in_mm, state_in_mm, markers_in_mm, said) = of("unit=\"mm\"");
    assert_eq!(unit_said(&said), "m");
    assert!(poses.poses.iter().any(|pose| pose.position.x > 5.0) && state.pe1_sum > 1e-3);
    assert_eq!(in_mm.poses.len(), poses.poses.len());
    for (small, large) in in_mm.poses.iter().zip(&poses.poses) {
        assert!(near(small.position.x, large.position.x, 1e-3), "{small:?} {large:?}");
        assert!(near(small.position.y, large.position.y, 1e-3), "{small:?} {large:?}");
    }
    assert!(near(state_in_mm.pe1_sum, state.pe1_sum, 1e-6) && state_in_mm.strain_max == state.strain_max);
    assert!(!state.members.is_empty() && state_in_mm.members.len() == state.members.len());
    for (small, large) in state_in_mm.members.iter().zip(&state.members) {
        assert!(near(small.pe1, large.pe1, 1e-6) && small.strain == large.strain, "{small:?} {large:?}");
        assert!(near(small.displacement.x, large.displacement.x, 1e-3), "{small:?} {large:?}");
        assert!(near(small.position.x, large.position.x, 1e-3), "{small:?} {large:?}");
    }
    for (small, large) in markers_in_mm.markers.iter().zip(&markers.markers) {
        assert!(near(small.scale.x, large.scale.x, 1e-3), "{} {}", small.scale.x, large.scale.x);
        assert!(!large.points.is_empty() && small.points.len() == large.points.len());
        for (small, large) in small.points.iter().zip(&large.points) {
            assert!(near(small.x, large.x, 1e-3), "{small:?} {large:?}");
        }
    }
    let (poses_of_none, .., said) = of("unit=\"span\"");
    assert_eq!(poses_of_none.poses, poses.poses);
    assert!(unit_said(&said).starts_with("span, as in the scene"), "{}", unit_said(&said));
}

#[test]
fn a_body_that_is_solved_for_at_once_is_recorded_without_steps() {
    let (poses, state, _, said) = last_of_body("beam-loaded", &[]);
    let said = &said.status[0];
    assert_eq!((said.message.as_str(), state.tick, poses.header.stamp.sec), ("solved for equilibrium", 0, 0));
    assert!(said.values.iter().all(|pair| pair.key != "step"), "{:?}", said.values);
}

#[test]
fn a_killed_program_s_recording_lacks_its_last_second_at_most() {
    let folder = temporary();
    let path = folder.path().join("f.mcap");
    let about = About { source: "node", ..About::default() };
    let mut recording = Recording::create(&path, &about, false).expect("created");
    for tick in 0..48 {
        let time = 100.0 + 0.05 * f64::from(tick);
        recording.write(&RecordedMessage {
            topic: "/robot_1/pose",
            package: "geometry_msgs",
            name: "PoseStamped",
            payload: &[0, 1, 0, 0],
            reliable: false,
            time,
            published: time,
        });
    }
    let part = recording.part().to_owned();
    // Nothing of it is run any more.
    std::mem::forget(recording);
    let mut seen = 0;
    let damage = Reader::open(&part).expect("readable").each(&mut |_| seen += 1);
    assert!(damage.is_some());
    assert!((29..48).contains(&seen), "{seen}");
    // The name that was asked for leads to it.
    let said = Reader::open(&path).map(|_| ()).expect_err("not there yet").to_string();
    assert!(said.contains("f.mcap.part; name that file"), "{said}");
}

/// With an index of it all: readers that seek, as rosbag2 does, need not repair the file.
#[test]
fn a_recording_tells_rosbag2_its_topics_and_their_quality_of_service() {
    let folder = temporary();
    let calm = ["--set", "flight.duration=2.0", "--set", "flight.bounds={}"];
    says(
        0,
        &[&["swarm", "square", "-q", "--out", "o", "--record", "f.mcap"][..], &calm].concat(),
        folder.path(),
    );
    let bytes = std::fs::read(folder.path().join("f.mcap")).expect("written");
    let summary = mcap::Summary::read(&bytes).expect("an index").expect("one that is not empty");
    let statistics = summary.stats.as_ref().expect("statistics");
    let index = summary.metadata_indexes.iter().find(|one| one.name == "rosbag2").expect("a record");
    let mcap::records::Metadata { metadata, .. } = mcap::read::metadata(&bytes, index).expect("readable");
    let bag: serde_json::Value = serde_json::from_str(&metadata["serialized_metadata"]).expect("JSON");
    assert_eq!(bag["message_count"], statistics.message_count);
    assert_eq!(bag["starting_time"]["nanoseconds_since_epoch"], statistics.message_start_time);
    assert_eq!(bag["relative_file_paths"][0], "f.mcap");
    let topics = bag["topics_with_message_count"].as_array().expect("topics");
    assert_eq!(topics.len(), summary.channels.len());
    for (id, channel) in &summary.channels {
        let find = |one: &&serde_json::Value| one["topic_metadata"]["name"] == channel.topic.as_str();
        let topic = topics.iter().find(find).expect("every channel");
        assert_eq!(topic["message_count"], statistics.channel_message_counts[id], "{}", channel.topic);
        let text = &channel.metadata["offered_qos_profiles"];
        let offered: serde_json::Value = serde_json::from_str(text).expect("JSON");
        assert_eq!(offered, topic["topic_metadata"]["offered_qos_profiles"]);
        let expected = if channel.topic.ends_with("/pose") { "best_effort" } else { "reliable" };
        assert_eq!(offered[0]["reliability"], expected, "{}", channel.topic);
        let hash = topic["topic_metadata"]["type_description_hash"].as_str().expect("text");
        assert!(hash.starts_with("RIHS01_") && hash.len() == 71, "{}: {hash:?}", channel.topic);
        if channel.topic.ends_with("/pose") {
            // As Jazzy's geometry_msgs has it.
            let known = "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8";
            assert_eq!(hash, known);
        }
    }
}

#[test]
#[ignore = "needs Python with mcap, mcap-ros2-support and rosbags: see main.rs"]
fn mcap_and_rosbags_decode_every_message_to_the_values_written() {
    let odometry = ["--set", "node.pose_type=odometry"];
    let covariance = ["--set", "node.pose_type=pose-with-covariance-stamped"];
    let recordings: [&[&str]; 4] = [
        &["swarm", "square", "--set", "flight.duration=3.0", "--set", "flight.bounds={}"],
        &[&["swarm", "gap", "--set", "flight.duration=1.0", "--set", "flight.bounds={}"][..], &odometry]
            .concat(),
        &[
            &["swarm", "faulty-robot", "--set", "flight.duration=2.0", "--set", "flight.bounds={}"][..],
            &covariance,
        ]
        .concat(),
        &["run", "fracture", "--set", "record.vtk_every=20"],
    ];
    for arguments in recordings {
        let folder = temporary();
        says(0, &[arguments, &["-q", "--out", "o", "--record", "r.mcap"]].concat(), folder.path());
        let (recording, lines) = (folder.path().join("r.mcap"), folder.path().join("r.jsonl"));
        assert!(expected(&recording, &lines).len() >= 4);
        python("read_mcap.py", &[&recording, &lines]);
    }
}

#[test]
#[ignore = "needs Python with meshio: see main.rs"]
fn meshio_reads_in_the_last_frame_what_stands_in_the_final_table() {
    let runs: [&[&str]; 3] = [
        &["run", "fracture", "--set", "record.vtk_every=50"],
        &["run", "beam-loaded", "--set", "record.vtk_every=1"],
        &["run", "tension", "--steps", "30", "--set", "record.vtk_every=10"],
    ];
    for arguments in runs {
        let folder = temporary();
        says(0, &[arguments, &["-q", "--out", "o"]].concat(), folder.path());
        python("read_vtk.py", &[&folder.path().join("o")]);
    }
}
