//! `flockform swarm`, `node` and `robots` as people call them.

use std::fs::{read_dir, read_to_string, write};

use flockform::swarm::control::scope::NodeScope;

use crate::program::*;

#[test]
fn a_swarm_is_flown_and_leaves_tables_and_figures() {
    let folder = temporary();
    let out = folder.path().join("out");
    let said = done(&["swarm", "bridge", "--out", "out"], folder.path());
    assert!(said.contains("From the continuum run"), "{said}");
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
    done(&["swarm", "square", "--out", "out", "--no-report"], folder.path());
    let map = read_to_string(folder.path().join("out/flight.svg")).expect("drawn");
    let group = |role: &str| {
        let (_, rest) = map.split_once(&format!("<g class=\"{role}\"")).expect("drawn");
        rest.split_once("</g>").expect("closed").0.to_owned()
    };
    let marks = |role: &str| (group(role).matches("<path").count(), group(role).matches("<circle").count());
    assert_eq!([marks("leader"), marks("follower")], [(4, 0), (0, 21)]);
    // Below each diamond, which lies within, is the robot to scale.
    assert_eq!(marks("hull"), (0, 4));
    let radius = |role: &str| {
        group(role).split(" r=\"").nth(1).and_then(|rest| rest.split('"').next()).map(str::to_owned)
    };
    assert!(radius("hull").is_some() && radius("hull") == radius("follower"), "{:?}", radius("hull"));
    let keys: Vec<&str> = map.split("class=\"key\"").skip(1).collect();
    assert!(keys[0].trim_start_matches('>').trim_start().starts_with("<path"), "{}", keys[0]);
}

/// A fence far outside the window, and robots of two sizes.
#[test]
fn the_map_clips_the_fence_and_draws_every_robot_to_scale() {
    const PAIR: &str = "title = \"t\"\n\
        robots = [{ name = \"a\", place = [0.0, 0.0], radius = 1.2 }, { name = \"b\", place = [4.0, 0.0] },\n\
        { name = \"c\", place = [2.0, 0.0], radius = 0.3 }]\n\
        leaders = [{ robots = [\"a\", \"b\"], program = { kind = \"external\" } }]\n\
        [limits]\ngeofence = [[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]]\n\
        [flight]\nduration = 1.0\n";
    let folder = temporary();
    write(folder.path().join("pair.toml"), PAIR).expect("written");
    done(&["swarm", "pair.toml", "--out", "out", "--no-report"], folder.path());
    let map = read_to_string(folder.path().join("out/flight.svg")).expect("drawn");
    let (_, window) = map.split_once("<clipPath id=\"plot\">").expect("a window");
    let (_, clipped) = window.split_once("<g clip-path=\"url(#plot)\">").expect("something is clipped");
    assert!(clipped.trim_start().starts_with("<path class=\"fence\""), "{clipped}");
    let (_, starts) = map.split_once("<g class=\"start\"").expect("drawn");
    let (starts, _) = starts.split_once("</g>").expect("closed");
    let radius = |circle: &str| circle.split('"').next().expect("a number").parse::<f64>().expect("a number");
    let radii: Vec<f64> = starts.split(" r=\"").skip(1).map(radius).collect();
    let [a, b, c] = radii[..] else { panic!("{radii:?}") };
    assert!((a / c - 4.0).abs() < 0.02 && (a / b - 8.0).abs() < 0.02, "{radii:?}");
}

/// A line of robots that leaders stretch has neighbours in one direction alone.
#[test]
fn a_strain_that_is_not_defined_is_left_out() {
    const LINE: &str = "title = \"t\"\nlinks = { kind = \"nearest\", count = 2 }\n\
        robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [1.0, 0.0] },\n\
        { name = \"c\", place = [2.0, 0.0] }]\n\
        leaders = [{ robots = [\"a\"], program = { kind = \"external\" } }, { robots = [\"c\"], program = \
        { kind = \"path\", points = [{ at = 1.0, displacement = [2.0, 0.0] }] } }]\n\
        flight = { duration = 2.0 }\n";
    let folder = temporary();
    write(folder.path().join("line.toml"), LINE).expect("written");
    let said = done(&["swarm", "line.toml", "--out", "out"], folder.path());
    assert!(said.contains("not defined: no robot has neighbours in two directions"), "{said}");
    assert!(json_in(&folder.path().join("out/flight.json"))["strain"].is_null());
    let samples = read_to_string(folder.path().join("out/samples.csv")).expect("written");
    let mut rows = samples.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let column = rows.next().expect("a header").iter().position(|name| *name == "strain").expect("there");
    assert!(rows.all(|row| row[column].is_empty()), "{samples}");
}

#[test]
fn a_robot_alone_has_no_clearance_in_any_table() {
    let text = "title = \"t\"\nrobots = [{ name = \"a\", place = [0.0, 0.0] }]\nflight = { duration = 1.0 }\n\
                leaders = [{ robots = [\"a\"], program = { kind = \"external\" } }]\n";
    let folder = temporary();
    write(folder.path().join("alone.toml"), text).expect("written");
    done(&["swarm", "alone.toml", "--out", "out"], folder.path());
    let samples = read_to_string(folder.path().join("out/samples.csv")).expect("written");
    assert!(samples.contains("clearance") && !samples.contains("inf"), "{samples}");
}

#[test]
fn a_broken_bound_ends_with_exit_code_1_and_all_is_written() {
    let folder = temporary();
    let set = "flight.bounds={ final_error = 1e-30, clearance = 5.0 }";
    let said = failed(&["swarm", "square", "--set", set, "--out", "out"], folder.path());
    assert!(said.contains("BROKEN: declared 5"), "{said}");
    assert!(folder.path().join("out/flight.json").is_file());
}

#[test]
fn what_cannot_fly_is_refused_with_exit_code_2_and_nothing_is_left() {
    let folder = temporary();
    let cases: [(&[&str], &str); 8] = [
        (&["swarm", "liar"], "the nearest bundled swarm is `faulty-robot`"),
        (&["swarm", "square", "--set", "ranges.max_liars=1"], "it is called `max_faulty` now"),
        (&["swarm", "sqare"], "the nearest bundled swarm is `square`"),
        (&["swarm", "nothing.toml"], "cannot be read"),
        (&["swarm", "square", "--set", "limits.speed=-1"], "--set limits.speed=-1: limits.speed = -1"),
        (
            &["swarm", "square", "--set", "limits.clearance=1e300"],
            "their radii and the clearance need 1e300 m",
        ),
        (&["swarm", "square", "--set", "limits.sped=1"], "known keys: `speed`"),
        (
            &["swarm", "square", "--set", "flight.start=[{ robot = \"nobody\", place = [0.0, 0.0] }]"],
            "there is no robot `nobody`",
        ),
    ];
    for (words, expected) in cases {
        refused_in(&[words, &["--out", "out"]].concat(), folder.path(), &[expected]);
    }
    assert_eq!(read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn nodes_refuse_what_ros_cannot_mean() {
    let folder = temporary();
    let cases: [(&[&str], &str); 10] = [
        (&["node", "square", "--ros-args", "--remapp", "a:=b"], "--remapp"),
        (&["node", "square", "--ros-args", "-r", "__ns:=no slash"], "no slash"),
        (&["node", "square", "--port", "9000"], "--live"),
        (&["node", "square", "--allow-commands"], "--live"),
        (&["node", "square", "--live", "--transport", "shm"], "leave out --transport shm"),
        (&["node", "square", "--member", "robot_99"], "they are called `robot_1` to `robot_25`"),
        (&["node", "square", "--member", "robot_7"], "help: add --set control.sweeps=1"),
        (
            &["node", "square", "--member", "robot_7", "--transport", "shm"],
            "control.sweeps = 200: --member robot_7",
        ),
        (&["node", "square", "--ros-args", "-p", "speed_limit:=-2.0"], "speed_limit"),
        (&["run", "tension", "--ros-args", "-r", "a:=b"], "this command is no ROS 2 node"),
    ];
    for (words, expected) in cases {
        refused_in(words, folder.path(), &[expected]);
    }
}

/// Every call of `node` or `robots` for a single member in the guide and in the help.
#[test]
fn the_examples_of_single_members_can_be_flown_alone() {
    let folder = temporary();
    let help = flockform(&["node", "--help"], folder.path());
    let guide = include_str!("../../src/guide/ros2.md");
    let texts = [text(&help.stdout), guide.to_owned()];
    let examples = texts.iter().flat_map(|text| text.lines()).filter_map(|line| {
        let line = line.split('#').next().unwrap_or(line).trim();
        (line.starts_with("flockform node") && line.contains("--member")).then_some(line)
    });
    let examples: Vec<&str> = examples.collect();
    assert_eq!(examples.len(), 2, "{examples:?}");
    for example in examples {
        let words: Vec<&str> = example.split_whitespace().collect();
        let value =
            |option: &str| words.iter().position(|word| *word == option).map(|k| words[k + 1].to_owned());
        let set: Vec<String> = value("--set").into_iter().collect();
        let swarm = flockform::scene::bundled::bundled_swarm(words[2]).expect("bundled").load_swarm(&set);
        let swarm = swarm.expect("valid");
        let mut control = flockform::swarm::control::Control::new(&swarm).expect("laid out");
        let scope = NodeScope::take(&swarm, &mut control, value("--member").as_deref());
        assert_eq!(scope.map(|scope| scope.mine.len()), Ok(1), "{example}");
    }
}

#[test]
fn a_flight_that_is_in_doubt_says_so_on_standard_error_and_the_plan_too() {
    let folder = temporary();
    let set = ["--set", "flight.loss=1.0"];
    let flown =
        flockform(&[&["swarm", "square", "--out", "out", "--no-report"], &set[..]].concat(), folder.path());
    assert!(text(&flown.stderr).contains("caution: every pose is lost"), "{}", text(&flown.stderr));
    let planned = flockform(&[&["plan", "square"], &set[..]].concat(), folder.path());
    assert!(text(&planned.stdout).contains("caution: every pose is lost"), "{}", text(&planned.stdout));
}

/// A scene changes the roles on its way.
#[test]
fn the_leaders_of_a_flight_are_those_of_its_plan() {
    const TENSION: &str = "title = \"t\"\nscene = { name = \"tension\" }\n[flight]\nduration = 40.0\n";
    let folder = temporary();
    write(folder.path().join("tension.toml"), TENSION).expect("written");
    let planned = flockform(&["plan", "tension.toml"], folder.path());
    let planned = text(&planned.stdout);
    let (before, _) = planned.split_once(" leaders)").expect("said");
    let leaders = before.rsplit('(').next().expect("a number");
    let flown = flockform(&["swarm", "tension.toml", "--out", "out", "--no-report"], folder.path());
    let said = text(&flown.stdout);
    assert!(said.contains(&format!("), {leaders} leaders")), "{leaders}: {said}");
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
