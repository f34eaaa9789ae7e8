//! The first minutes: `show`, `new`, `list`, `plan`, `--json`, `--open`, completion, and a file of the wrong kind.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::program::*;

fn json(arguments: &[&str], folder: &Path) -> serde_json::Value {
    crate::json::json(&done(arguments, folder))
}

#[test]
fn show_prints_a_bundled_file_as_it_is() {
    let folder = temporary();
    let scene = flockform::scene::bundled("tension").expect("bundled");
    assert_eq!(done(&["show", "tension"], folder.path()), scene.text);
    let swarm = flockform::scene::bundled::bundled_swarm("square").expect("bundled");
    assert_eq!(done(&["show", "square"], folder.path()), swarm.text);
    refused_in(&["show", "tensoin"], folder.path(), &["`tensoin`", "`tension`"]);
}

#[test]
fn every_bundled_file_is_a_valid_beginning_with_comments() {
    let folder = temporary();
    let kinds = [("scene", flockform::scene::bundled::SCENES), ("swarm", flockform::scene::bundled::SWARMS)];
    for (kind, all) in kinds {
        for one in all {
            done(&["new", kind, one.name, "--from", one.name], folder.path());
            let path = folder.path().join(format!("{}.toml", one.name));
            let written = std::fs::read_to_string(&path).expect("written");
            assert!(written.starts_with("# A ") && written.ends_with(one.text), "{written}");
            let loaded = match kind {
                "scene" => flockform::scene::Scene::from_file(&path, &[]).map(drop),
                _ => flockform::scene::swarm::Swarm::from_file(&path, &[]).map(drop),
            };
            loaded.unwrap_or_else(|error| panic!("{}: {error}", one.name));
        }
    }
}

#[test]
fn new_begins_with_a_file_that_runs_and_never_replaces_one() {
    let folder = temporary();
    let words = done(&["new", "scene", "mine"], folder.path());
    assert!(words.contains("mine.toml") && words.contains("flockform run mine.toml"), "{words}");
    done(&["run", "mine.toml", "-q", "--steps", "2", "--figures", "none"], folder.path());
    done(&["new", "swarm", "fleet.toml"], folder.path());
    done(&["plan", "fleet.toml"], folder.path());
    std::fs::write(folder.path().join("mine.toml"), "years of work").expect("writable");
    refused_in(&["new", "scene", "mine"], folder.path(), &["mine.toml is there already"]);
    refused_in(&["new", "scene", "no/mine"], folder.path(), &["no/mine.toml", "mkdir -p no"]);
    assert_eq!(std::fs::read(folder.path().join("mine.toml")).expect("there"), b"years of work");
    refused_in(&["new", "scene", "nowhere/mine"], folder.path(), &["cannot write nowhere/mine.toml"]);
    refused_in(&["new", "scene", "a b"], folder.path(), &["`a b` cannot be the name"]);
    refused_in(&["new", "scene", "other", "--from", "square"], folder.path(), &["`square` is a swarm"]);
    assert!(!folder.path().join("other.toml").exists());
}

#[test]
fn a_file_of_the_other_kind_is_named_with_its_command() {
    let folder = temporary();
    for command in ["run", "compare", "stability", "trade"] {
        refused_in(&[command, "square"], folder.path(), &["`square` is a swarm", "flockform swarm square"]);
    }
    for command in ["swarm", "node", "robots"] {
        let words = [command, "tension"];
        refused_in(&words, folder.path(), &["`tension` is a scene", "flockform run tension"]);
    }
    done(&["new", "swarm", "fleet"], folder.path());
    done(&["new", "scene", "mine"], folder.path());
    refused_in(&["run", "fleet.toml"], folder.path(), &["is a swarm", "flockform swarm fleet.toml"]);
    refused_in(&["swarm", "mine.toml"], folder.path(), &["is a scene", "flockform run mine.toml"]);
    // A mistake in a file of the right kind is that mistake.
    refused_in(&["run", "mine.toml", "--set", "lattice.spacing=-1"], folder.path(), &["lattice.spacing"]);
}

#[test]
fn list_plan_and_run_have_json() {
    let folder = temporary();
    let scenes = json(&["list", "scenes", "--json"], folder.path());
    let first = &scenes[0];
    assert_eq!((first["name"].as_str(), scenes.as_array().map(Vec::len)), (Some("tension"), Some(46)));
    assert!(first["title"].as_str().is_some_and(|title| title.contains("Tension")), "{first}");
    assert_eq!(json(&["list", "swarms", "--json"], folder.path())[0]["name"], "square");
    let plan = json(&["plan", "tension", "--json"], folder.path());
    assert_eq!((plan["particles"].as_u64(), plan["steps"].as_u64()), (Some(144), Some(401)), "{plan}");
    assert!(plan["models"].as_array().is_some_and(|models| !models.is_empty()), "{plan}");
    let arguments = ["run", "tension", "--json", "--steps", "3", "--figures", "none", "--out", "o"];
    let summary = json(&arguments, folder.path());
    let file = std::fs::read(folder.path().join("o/summary.json")).expect("written");
    assert_eq!(summary, serde_json::from_slice::<serde_json::Value>(&file).expect("JSON"));
}

#[cfg(unix)]
#[test]
fn a_scene_from_a_pipe_is_planned() {
    let folder = temporary();
    let scene = done(&["show", "tension"], folder.path());
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_flockform"))
        .args(["plan", "/dev/stdin"])
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut pipe = child.stdin.take().expect("a pipe");
    std::io::Write::write_all(&mut pipe, scene.as_bytes()).expect("it is read");
    drop(pipe);
    let output = child.wait_with_output().expect("a child");
    assert!(output.status.success() && text(&output.stdout).contains("144"), "{}", text(&output.stdout));
}

#[test]
fn the_plan_of_a_swarm_states_margins_and_speeds() {
    let folder = temporary();
    let words = done(&["plan", "square"], folder.path());
    for word in ["robots", "delay margin", "noise margin", "speed limit", "manoeuvre", "`turn`"] {
        assert!(words.contains(word), "no `{word}` in\n{words}");
    }
    let plan = json(&["plan", "square", "--json", "--set", "limits.speed=0.7"], folder.path());
    assert_eq!((plan["robots"].as_u64(), plan["leaders"].as_u64()), (Some(25), Some(4)), "{plan}");
    assert_eq!(plan["speed"]["limit"], 0.7);
    // 1.5 m between places less two radii of 0.2 m and 0.3 m of clearance, in six standard deviations.
    assert!((plan["noise"]["largest"].as_f64().expect("kept apart") - 0.8 / 6.0).abs() < 1e-9, "{plan}");
    // Followers that are in their places at once set no speed, and ideal robots none either.
    assert_eq!(plan["speed"]["reachable"], 0.7);
    let unlimited = ["plan", "gap", "--set", "limits={ clearance = 0.1 }"];
    let ideal = done(&unlimited, folder.path());
    assert!(ideal.contains("  reachable speed   not limited: ideal robots"), "{ideal}");
    assert!(ideal.contains("limits.clearance without limits.speed holds for poses of now alone"), "{ideal}");
    let planned = json(&[&unlimited[..], &["--json"]].concat(), folder.path());
    assert!(planned["speed"]["reachable"].is_null(), "{ideal}");
    for name in ["gap", "patch", "antipodal", "faulty-robot", "bridge"] {
        assert!(done(&["plan", name], folder.path()).contains("robots"), "{name}");
    }
    refused_in(&["plan", "square", "--set", "limits.speed=-1"], folder.path(), &["limits.speed"]);
    assert!(files(folder.path()).is_empty());
}

/// The words that bash offers at the end of a command line.
fn completed(line: &[&str], folder: &Path) -> Vec<String> {
    let script = done(&["completions", "bash"], folder);
    std::fs::write(folder.join("completion"), script).expect("writable");
    let words: Vec<String> = line.iter().map(|word| format!("'{word}'")).collect();
    let (last, before) = (line[line.len() - 1], line[line.len() - 2]);
    let ask = format!(
        ". ./completion; COMP_WORDS=({}); COMP_CWORD={}; _flockform flockform '{last}' '{before}'; echo \"${{COMPREPLY[@]}}\"",
        words.join(" "),
        line.len() - 1
    );
    let output = Command::new("bash").args(["-c", &ask]).current_dir(folder).output().expect("bash runs");
    text(&output.stdout).split_whitespace().map(str::to_owned).collect()
}

#[test]
fn completion_knows_the_names_of_scenes_and_swarms() {
    let folder = temporary();
    assert_eq!(completed(&["flockform", "run", "tens"], folder.path()), ["tension", "tension-immediate"]);
    assert_eq!(completed(&["flockform", "swarm", "squ"], folder.path()), ["square"]);
    assert_eq!(completed(&["flockform", "show", "ga"], folder.path()), ["gap"]);
    assert!(completed(&["flockform", "run", "squ"], folder.path()).is_empty());
    let zsh = done(&["completions", "zsh"], folder.path());
    assert!(zsh.contains("bundled file\\:(square gap") && zsh.contains("files\\:file\\:_files"), "{zsh}");
    let of_names = |before: &str| zsh.matches(&format!("{before}:(square gap")).count();
    assert_eq!(of_names(""), of_names("\\"), "a place that completes names alone");
    let fish = done(&["completions", "fish"], folder.path());
    assert!(fish.contains("__fish_seen_subcommand_from run\" -a \"tension"), "{fish}");
    // They are not in the help, where they would be half of it.
    assert!(!done(&["run", "--help"], folder.path()).contains("possible values: tension"));
}

#[cfg(target_os = "linux")]
#[test]
fn open_hands_the_report_to_the_platform_and_a_missing_opener_is_no_failure() {
    use std::os::unix::fs::PermissionsExt;
    let folder = temporary();
    let opener = folder.path().join("xdg-open");
    std::fs::write(&opener, "#!/bin/sh\necho \"$1\" > opened.part\nmv opened.part opened\n")
        .expect("writable");
    std::fs::set_permissions(&opener, std::fs::Permissions::from_mode(0o755)).expect("ours");
    let run = |out: &str, path: &str| {
        Command::new(env!("CARGO_BIN_EXE_flockform"))
            .args(["run", "tension", "--steps", "2", "--figures", "none", "--open", "--out", out])
            .current_dir(folder.path())
            .env("PATH", path)
            .output()
            .expect("the program starts")
    };
    let path = format!("{}:/usr/bin:/bin", folder.path().display());
    let output = run("o", &path);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let opened = within(Duration::from_secs(20), "the report is opened", || {
        std::fs::read_to_string(folder.path().join("opened")).ok()
    });
    assert!(opened.trim_end().ends_with("o/report.html"), "{opened}");
    let without = run("o2", "/nowhere");
    assert!(without.status.success() && text(&without.stderr).contains("open it by hand"));
    refused_in(&["run", "tension", "--open", "--no-report"], folder.path(), &["cannot be used with"]);
}
