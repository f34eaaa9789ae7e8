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
