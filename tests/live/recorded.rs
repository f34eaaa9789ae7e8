//! Sessions of `flockform live` that are recorded.

use std::path::Path;
use std::process::Command;

use flockform::record::Reader;
use flockform::record::replay::replay_file;
use serde_json::json;

use super::folders::temporary;
use super::pages::{Viewer, start};
use super::strangers::PATIENCE;
use super::waits::within;

/// Messages of a recording, without those that name the file.
fn messages(file: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    let damage = Reader::open(file).expect("readable").each(&mut |entry| {
        if !entry.topic.ends_with("/state") && !entry.topic.ends_with("/diagnostics") {
            found.push((entry.topic.to_string(), entry.payload.clone()));
        }
    });
    assert_eq!(damage, None);
    found
}

#[test]
fn a_session_is_recorded_as_a_run_of_the_file_that_replays_it() {
    // A leader of the one, a follower of the other.
    for (name, runner, particle) in [("square", "swarm", 0), ("tension", "run", 66)] {
        let folder = temporary();
        let of = |file: &str| folder.path().join(file);
        let mut program = start(&["live", name, "--record", "live.mcap", "--out", "."], folder.path());
        let mut viewer = Viewer::of(folder.path());
        viewer.ask(&json!({ "do": "grab", "particle": particle }));
        viewer.ask(&json!({ "do": "play" }));
        for k in 1..=5 {
            viewer.ask(&json!({ "do": "drag", "by": [0.1 * f64::from(k), 0.0] }));
            let before = viewer.status("a state", |_| true)["clock"].clone();
            viewer.status("it goes on", |status| status["clock"].as_f64() > before.as_f64());
        }
        viewer.ask(&json!({ "do": "pause" }));
        viewer.status("it stands still", |status| status["playing"] == false);
        viewer.ask(&json!({ "do": "save" }));
        viewer.until("it is saved", |event, _| event["event"] == "saved");
        assert!(!of("live.mcap").exists(), "it has its name when it is whole");
        assert_eq!(program.terminate(), Some(0));
        let saved = format!("{name}_live.toml");
        let again = [runner, &saved, "--record", "again.mcap", "--out", "out", "--no-report", "-q"];
        let again =
            Command::new(env!("CARGO_BIN_EXE_flockform")).args(again).current_dir(folder.path()).output();
        let again = again.expect("the program starts");
        assert!(again.stderr.is_empty(), "{}", String::from_utf8_lossy(&again.stderr));
        let (live, again) = (messages(&of("live.mcap")), messages(&of("again.mcap")));
        assert!(live.len() > 5 && live == again, "{name}: {} messages, {}", live.len(), again.len());
        if runner == "swarm" {
            let report = replay_file(&of("live.mcap"), None, &[], 0.0).expect("has its swarm");
            assert!(report.holds() && report.ticks > 0, "{report:?}");
        }
    }
}

#[test]
fn a_recording_that_would_replace_a_file_is_refused_before_the_session() {
    let folder = temporary();
    std::fs::write(folder.path().join("live.mcap"), "mine").expect("written");
    let mut program = start(&["live", "tension", "--record", "live.mcap"], folder.path());
    let code = within(PATIENCE, "it ends", || program.0.try_wait().expect("a child"));
    assert_eq!(code.code(), Some(2));
    assert_eq!(std::fs::read(folder.path().join("live.mcap")).expect("there"), b"mine");
}

#[test]
fn a_session_that_was_never_set_going_is_no_recording() {
    for (name, words) in [("square", "no period was flown"), ("tension", "no step was taken")] {
        let folder = temporary();
        let mut program = start(&["live", name, "--record", "live.mcap"], folder.path());
        let mut viewer = Viewer::of(folder.path());
        viewer.ask(&json!({ "do": "step" }));
        viewer.status("it goes on", |status| status["clock"].as_f64() > Some(0.0));
        viewer.ask(&json!({ "do": "reset" }));
        viewer.status("it begins anew", |status| status["clock"] == 0.0);
        assert_eq!(program.terminate(), Some(0));
        let files: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").flatten().collect();
        assert_eq!(files.iter().map(|file| file.file_name()).collect::<Vec<_>>(), ["printed"]);
        let printed = std::fs::read_to_string(folder.path().join("printed")).expect("printed");
        assert!(printed.contains(&format!("{words}: nothing is recorded")), "{printed}");
    }
}
