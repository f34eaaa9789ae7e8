//! The journal of `flockform sweep`: which runs are gone on with and put together, and which are not.

use std::path::Path;

use crate::program::*;
use crate::sweep::table;

/// A scene whose body is in a file beside it.
const POINTS: &str = r#"
title = "Four by three"
neighbours = { kind = "within", radius = 1.2 }
stop = { steps = 5 }
body = { shape = { kind = "points", file = "points.csv" } }

[[roles]]
region = { kind = "edge", side = "left", depth = 0.5 }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right", depth = 0.5 }
role = "leader"
motion = { kind = "velocity", per_step = [0.05, 0.0] }
"#;

fn points(last_x: f64) -> String {
    let places = (0..12).map(|n| (if n == 11 { last_x } else { f64::from(n / 3) }, f64::from(n % 3)));
    std::iter::once("x,y\n".to_owned()).chain(places.map(|(x, y)| format!("{x:?},{y:?}\n"))).collect()
}

#[test]
fn runs_of_a_body_whose_points_have_changed_are_not_put_together() {
    let folder = temporary();
    let place = folder.path().join("points.csv");
    std::fs::write(folder.path().join("mine.toml"), POINTS).expect("writable");
    let shard = |part: &str, out: &str| {
        let arguments = ["sweep", "mine.toml", "--vary", "update.damping=0.5:1:4", "--figures", "none", "-q"];
        done(&[&arguments[..], &["--shard", part, "--out", out]].concat(), folder.path());
    };
    std::fs::write(&place, points(3.0)).expect("writable");
    shard("1/2", "a");
    shard("2/2", "b");
    done(&["sweep", "--merge", "a", "b", "--out", "both", "--figures", "none", "-q"], folder.path());
    std::fs::write(&place, points(3.1)).expect("writable");
    shard("2/2", "c");
    refused_in(&["sweep", "--merge", "a", "c", "--out", "none"], folder.path(), &["not parts of one sweep"]);
    refused_in(&["sweep", "--resume", "a"], folder.path(), &["of another body"]);
}

/// A finished sweep of two runs in `o`.
fn finished(folder: &Path) {
    let arguments = ["sweep", "tension", "--vary", "update.damping=0.5:1:2", "--set", "stop.steps=2", "-q"];
    done(&[&arguments[..], &["--out", "o", "--figures", "none"]].concat(), folder);
}

fn not_resumed(folder: &Path, words: &[&str]) {
    refused_in(&["sweep", "--resume", "o"], folder, words);
}

#[test]
fn files_of_a_sweep_that_cannot_be_trusted_are_named() {
    let folder = temporary();
    finished(folder.path());
    let [rows, request] = ["runs.jsonl", "sweep.json"].map(|name| folder.path().join("o").join(name));
    let (good_rows, good_request) = (read(&rows), read(&request));
    std::fs::write(&rows, format!("damaged\n{good_rows}")).expect("writable");
    not_resumed(folder.path(), &["runs.jsonl", "line 1"]);
    std::fs::write(&rows, &good_rows).expect("writable");
    let written: serde_json::Value = serde_json::from_str(&good_request).expect("JSON");
    let with = |key: &str, value: serde_json::Value| {
        let mut changed = written.clone();
        changed.as_object_mut().expect("fields").shift_remove("crc32");
        changed["request"][key] = value;
        changed["crc32"] = crc32fast::hash(changed.to_string().as_bytes()).into();
        std::fs::write(&request, changed.to_string()).expect("writable");
    };
    with("shard", serde_json::json!({ "number": 1, "of": 0 }));
    not_resumed(folder.path(), &["sweep.json", "--shard 1/0"]);
    with("vary", serde_json::json!(["update.damping"]));
    not_resumed(folder.path(), &["sweep.json", "there is no `=`"]);
    with("outputs", serde_json::json!([]));
    not_resumed(folder.path(), &["not those of its sweep.json"]);
    std::fs::write(&request, good_request.replace("stop.steps=2", "stop.steps=3")).expect("writable");
    not_resumed(folder.path(), &["sweep.json", "its checksum differs", "help: "]);
    // As an earlier version wrote it.
    std::fs::write(&request, good_request.replace("crc32", "sum")).expect("writable");
    not_resumed(folder.path(), &["sweep.json", "crc32", "start the sweep again"]);
    std::fs::write(&request, &good_request).expect("writable");
    // One digit of one value.
    let lines: Vec<&str> = good_rows.lines().collect();
    std::fs::write(&rows, format!("{}\n{}\n", lines[0].replace("\"2\"", "\"3\""), lines[1]))
        .expect("writable");
    not_resumed(folder.path(), &["runs.jsonl", "line 1 is damaged"]);
    refused_in(&["sweep", "--merge", "o", "--out", "p"], folder.path(), &["line 1 is damaged"]);
}

#[test]
fn runs_of_files_that_are_varied_are_those_of_the_files() {
    let folder = temporary();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("writable");
    write("mine.toml", POINTS);
    let moves = |ux: f64| format!("id,ux,uy\n10,{ux},0\n11,{ux},0\n12,{ux},0\n");
    [("points.csv", points(3.0)), ("a.csv", points(3.0)), ("b.csv", points(3.1)), ("m.csv", moves(0.1))]
        .iter()
        .for_each(|(name, text)| write(name, text));
    let sweep = |vary: &str, more: &[&str]| {
        let arguments = ["sweep", "mine.toml", "--figures", "none", "-q", "--vary", vary];
        done(&[&arguments[..], more].concat(), folder.path());
    };
    let shapes = "body.shape.file=[a.csv, b.csv]";
    let motions = "roles[1].motion=[{ kind = \"velocity\", per_step = [0.05, 0.0] }, { kind = \"csv\", file = \"m.csv\", steps = 5 }]";
    sweep(shapes, &["--shard", "1/2", "--out", "p1"]);
    sweep(shapes, &["--shard", "2/2", "--out", "p2"]);
    sweep(motions, &["--out", "m"]);
    done(&["sweep", "--merge", "p1", "p2", "--out", "all", "--figures", "none", "-q"], folder.path());
    done(&["sweep", "--resume", "m", "--figures", "none", "-q"], folder.path());
    write("b.csv", &points(3.3));
    write("m.csv", &moves(0.2));
    let changed =
        |arguments: &[&str], file: &str| refused_in(arguments, folder.path(), &["of another body", file]);
    changed(&["sweep", "--resume", "all"], "b.csv");
    changed(&["sweep", "--resume", "p2"], "b.csv");
    changed(&["sweep", "--merge", "p1", "p2", "--out", "none"], "b.csv");
    changed(&["sweep", "--resume", "m"], "m.csv");
    std::fs::remove_file(folder.path().join("b.csv")).expect("removable");
    changed(&["sweep", "--resume", "all"], "b.csv");
    // What was not made of it is gone on with.
    done(&["sweep", "--resume", "p1", "--figures", "none", "-q"], folder.path());
}

#[test]
fn two_results_of_one_run_are_not_chosen_from() {
    let folder = temporary();
    for out in ["o", "p"] {
        let vary = ["sweep", "tension", "--vary", "update.damping=0.5:1:2", "--set", "stop.steps=2", "-q"];
        let outputs = ["--outputs", "timings.steps_s,residual", "--out", out, "--figures", "none"];
        done(&[&vary[..], &outputs].concat(), folder.path());
    }
    let words = ["o and ", "p are not parts of one sweep", "two results of run 0", "help: "];
    refused_in(&["sweep", "--merge", "o", "p", "--out", "q"], folder.path(), &words);
    done(&["sweep", "--merge", "o", "o", "--out", "q", "--figures", "none", "-q"], folder.path());
    let [rows, others] = ["o", "p"].map(|out| folder.path().join(out).join("runs.jsonl"));
    std::fs::write(&rows, read(&rows) + &read(others)).expect("writable");
    not_resumed(folder.path(), &["two results of run 0", "help: "]);
}

#[test]
fn refused_runs_are_made_again_and_give_way_to_those_that_ran() {
    let folder = temporary();
    let write = |name: &str| std::fs::write(folder.path().join(name), points(3.0)).expect("writable");
    std::fs::write(folder.path().join("mine.toml"), POINTS).expect("writable");
    ["points.csv", "a.csv"].into_iter().for_each(write);
    let sweep = |out: &str| {
        let arguments =
            ["sweep", "mine.toml", "--vary", "body.shape.file=[a.csv, b.csv]", "--out", out, "-q"];
        flockform(&arguments, folder.path()).status.code()
    };
    assert_eq!([sweep("o"), sweep("p")], [Some(1); 2]);
    assert_eq!(table(folder.path().join("o/sweep.csv"))[2][6], "refused");
    write("b.csv");
    done(&["sweep", "--resume", "o", "-q"], folder.path());
    let made = read(folder.path().join("o/sweep.csv"));
    assert!(!made.contains("refused"), "{made}");
    for parts in [["o", "p"], ["p", "o"]] {
        let merge = ["sweep", "--merge", parts[0], parts[1], "--out", "all", "--force", "-q"];
        done(&merge, folder.path());
        assert_eq!(read(folder.path().join("all/sweep.csv")), made);
    }
}

#[cfg(unix)]
#[test]
fn a_resumed_sweep_neither_follows_links_nor_discards_what_else_was_begun() {
    let folder = temporary();
    finished(folder.path());
    let (rows, other) = (folder.path().join("o/runs.jsonl"), folder.path().join("other"));
    std::fs::rename(&rows, &other).expect("movable");
    let kept = read(&other);
    std::os::unix::fs::symlink(&other, &rows).expect("linked");
    // In the open, as a kill leaves it.
    std::fs::rename(folder.path().join("o"), folder.path().join("o.unfinished")).expect("movable");
    not_resumed(folder.path(), &["runs.jsonl", "no regular file"]);
    assert_eq!(read(&other), kept);
    std::fs::remove_file(folder.path().join("o.unfinished/runs.jsonl")).expect("removable");
    std::fs::rename(&other, folder.path().join("o.unfinished/runs.jsonl")).expect("movable");
    std::fs::rename(folder.path().join("o.unfinished"), folder.path().join("real")).expect("movable");
    std::os::unix::fs::symlink(folder.path().join("real"), folder.path().join("o")).expect("linked");
    let begun = folder.path().join("real.unfinished/checkpoint");
    std::fs::create_dir(folder.path().join("real.unfinished")).expect("writable");
    std::fs::write(&begun, "a run").expect("writable");
    not_resumed(folder.path(), &["real.unfinished", "not finished"]);
    assert_eq!(read(&begun), "a run");
}
