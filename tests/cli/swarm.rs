//! `flockform swarm`, `node` and `robots` as people call them.

use std::fs::{read_dir, read_to_string};
use std::process::Output;

use crate::program::*;

fn refused(output: &Output, words: &[&str], expected: &str) {
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {said}");
    assert!(said.contains(expected), "{words:?}: {said}");
}

#[test]
fn a_swarm_is_flown_and_leaves_tables_and_figures() {
    let folder = temporary();
    let out = folder.path().join("out");
    let output = flockform(&["swarm", "bridge", "--out", "out"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("from the continuum"), "{}", text(&output.stdout));
    for file in
        ["flight.json", "samples.csv", "robots.csv", "tracks.csv", "flight.png", "flight.svg", "errors.png"]
    {
        assert!(out.join(file).is_file(), "{file}");
    }
    let report = json_in(&out.join("flight.json"));
    assert_eq!((report["holds"].as_bool(), report["robots"].as_u64()), (Some(true), Some(100)));
    assert_eq!(report["continuum_error"].as_f64(), Some(0.0));
    let samples = read_to_string(out.join("samples.csv")).expect("written");
    assert_eq!(samples.lines().count(), 1 + 401);
    let robots = read_to_string(out.join("robots.csv")).expect("written");
    assert_eq!(robots.lines().count(), 1 + 100);
}

#[test]
fn leaders_are_diamonds_on_the_map_and_in_its_legend() {
    let folder = temporary();
    let output = flockform(&["swarm", "square", "--out", "out", "--no-report"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let map = read_to_string(folder.path().join("out/flight.svg")).expect("drawn");
    let group = |role: &str| {
        let (_, rest) = map.split_once(&format!("<g class=\"{role}\"")).expect("drawn");
        rest.split_once("</g>").expect("closed").0.to_owned()
    };
    let marks = |role: &str| (group(role).matches("<path").count(), group(role).matches("<circle").count());
    assert_eq!([marks("leader"), marks("follower")], [(4, 0), (0, 21)]);
    let keys: Vec<&str> = map.split("class=\"key\"").skip(1).collect();
    assert!(keys[0].trim_start_matches('>').trim_start().starts_with("<path"), "{}", keys[0]);
}

#[test]
fn a_broken_bound_ends_with_exit_code_1_and_all_is_written() {
    let folder = temporary();
    let set = "flight.bounds={ final_error = 1e-30, clearance = 5.0 }";
    let output = flockform(&["swarm", "square", "--set", set, "--out", "out"], folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("BROKEN: declared 5"), "{}", text(&output.stdout));
    assert!(folder.path().join("out/flight.json").is_file());
}

#[test]
fn what_cannot_fly_is_refused_with_exit_code_2_and_nothing_is_left() {
    let folder = temporary();
    let cases: [(&[&str], &str); 5] = [
        (&["swarm", "sqare"], "the nearest bundled swarm is `square`"),
        (&["swarm", "nothing.toml"], "cannot be read"),
        (&["swarm", "square", "--set", "limits.speed=-1"], "--set limits.speed=-1: limits.speed = -1"),
        (&["swarm", "square", "--set", "limits.sped=1"], "known keys: `speed`"),
        (
            &["swarm", "square", "--set", "flight.start=[{ robot = \"nobody\", place = [0.0, 0.0] }]"],
            "there is no robot `nobody`",
        ),
    ];
    for (words, expected) in cases {
        let output = flockform(&[words, &["--out", "out"]].concat(), folder.path());
        refused(&output, words, expected);
    }
    assert_eq!(read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn nodes_refuse_what_ros_cannot_mean() {
    let folder = temporary();
    let cases: [(&[&str], &str); 9] = [
        (&["node", "square", "--ros-args", "--remapp", "a:=b"], "--remapp"),
        (&["node", "square", "--ros-args", "-r", "__ns:=no slash"], "no slash"),
        (&["node", "square", "--port", "9000"], "--live"),
        (&["node", "square", "--allow-commands"], "--live"),
        (&["node", "square", "--live", "--transport", "shm"], "leave out --transport shm"),
        (&["node", "square", "--member", "robot_99"], "they are called `robot_1` to `robot_25`"),
        (&["node", "square", "--member", "robot_7"], "needs to see the whole formation"),
        (&["node", "square", "--ros-args", "-p", "speed_limit:=-2.0"], "speed_limit"),
        (&["run", "tension", "--ros-args", "-r", "a:=b"], "this command is no ROS 2 node"),
    ];
    for (words, expected) in cases {
        refused(&flockform(words, folder.path()), words, expected);
    }
}

#[test]
fn swarms_are_listed_and_their_format_is_printed() {
    let folder = temporary();
    let listed = flockform(&["list", "swarms"], folder.path());
    assert!(listed.status.success());
    assert!(text(&listed.stdout).lines().any(|line| line.starts_with("gap ") && line.contains("hundred")));
    let schema = flockform(&["schema", "--swarm"], folder.path());
    let schema = json(&text(&schema.stdout));
    assert!(schema["properties"]["limits"].is_object() && schema["properties"]["flight"].is_object());
}
