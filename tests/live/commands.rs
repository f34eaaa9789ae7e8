//! The command that a session's page shows: as it was typed, with what was set since.

use serde_json::json;

use super::folders::temporary;
use super::pages::{Viewer, start};

/// A key that names a pipe, which nothing ever comes out of.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_session_that_is_busy_and_leaves_nothing_half_written() {
    let folder = temporary();
    let pipe = folder.path().join("pipe.csv");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("starts").success());
    let mut program = start(&["live", "tension", "--record", "live.mcap"], folder.path());
    let mut viewer = Viewer::of(folder.path());
    let motion = "{ kind = \"csv\", file = \"pipe.csv\", steps = 5 }";
    viewer.ask(&json!({ "do": "set", "key": "roles[1].motion", "value": motion }));
    // Returns when the session has opened the other end.
    let _other_end = std::fs::File::options().write(true).open(&pipe).expect("a pipe");
    let since = std::time::Instant::now();
    assert_eq!(program.terminate(), Some(1));
    assert!(since.elapsed().as_secs() < 10, "{:?}", since.elapsed());
    let files: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").flatten().collect();
    let mut names: Vec<_> = files.iter().map(|file| file.file_name()).collect();
    names.sort();
    assert_eq!(names, ["pipe.csv", "printed"]);
}

#[test]
fn the_page_shows_the_command_with_what_was_set() {
    for (name, key, more) in
        [("tension", "title=it's", "update.damping"), ("square", "title=it's", "flight.loss")]
    {
        let folder = temporary();
        let _program = start(&["live", name, "--set", key], folder.path());
        let mut viewer = Viewer::of(folder.path());
        let typed = format!("flockform live {name} --set 'title=it'\\''s'");
        viewer.status("the command", |status| status["command"] == typed);
        viewer.ask(&json!({ "do": "set", "key": more, "value": "0.5" }));
        let all = format!("{typed} --set {more}=0.5");
        viewer.status("the command with a key", |status| status["command"] == all);
        viewer.ask(&json!({ "do": "undo" }));
        viewer.status("the command without it", |status| status["command"] == typed);
        assert!(viewer.pings(b"still there?"));
    }
}
