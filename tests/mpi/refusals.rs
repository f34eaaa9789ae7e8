//! What ranks refuse, each once and by name.

use std::borrow::Cow;
use std::path::Path;
use std::time::{Duration, Instant};

use flockform::Engine;
use flockform::continuum::digest::digest;
use flockform::continuum::plan::Plan;
use flockform::engine::state::EngineState;
use flockform::export::checkpoint::{Checkpoint, RunRequest};
use flockform::scene::bundled;

use crate::command::text;
use crate::folders::{names_in, temporary};
use crate::support::{PARTED, PATIENCE, PROGRAM, on_ranks};

#[test]
#[ignore = "needs mpirun"]
fn what_is_wrong_is_said_once_and_nothing_is_left() {
    for (arguments, words) in [
        (vec!["run", "tension", "--stepps", "3"], "unexpected argument '--stepps'"),
        (vec!["run", "tensio"], "no bundled scene"),
        (vec!["run", "tension", "--set", "rule.mean.kind=x"], "rule.mean"),
        (vec!["run", "beam-loaded", "--set", "equilibrium.tolerance=2"], "equilibrium.tolerance"),
        // It is said after all have begun.
        (
            vec![
                "run",
                "lattice-square",
                "--set",
                "equilibrium={}",
                "--set",
                "rule.mean={kind=\"distance\"}",
            ],
            "no equilibrium can be solved for",
        ),
        (
            [
                &["run", "tension", "--set", "roles[1].region={kind=\"box\",min=[900,0],max=[901,1]}"],
                &PARTED[..],
            ]
            .concat(),
            "no particle of the body lies in this region",
        ),
        (
            [
                &[
                    "run",
                    "tension",
                    "--set",
                    "frame=none",
                    "--set",
                    "body={shape={kind=\"rectangle\",max=[60,4]},holes=[{kind=\"rectangle\",min=[29,-1],max=[33,5]}]}",
                ],
                &PARTED[..],
            ]
            .concat(),
            "the body falls into 2 parts that are no neighbours of each other: particle 1 and particle 151",
        ),
        (vec!["compare", "beam"], "`compare` runs on one"),
        (vec!["live", "tension"], "`live` runs on one"),
        (vec!["run", "tension", "--out", "/proc/none"], "cannot create /proc/"),
    ] {
        let folder = temporary();
        let start = Instant::now();
        let output = on_ranks(4, &arguments, folder.path());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert_eq!(said.matches("error: ").count(), 1, "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
        assert!(names_in(folder.path()).is_empty(), "{arguments:?}");
        assert!(start.elapsed() < PATIENCE, "{arguments:?}");
    }
}

/// Leaves what a run that was killed after so many steps leaves, and returns the words that go on with it.
fn killed(folder: &Path, out: &'static str, steps: usize) -> [&'static str; 3] {
    let scene = bundled("tension").expect("bundled").load(&[]).expect("valid");
    let plan = Plan::new(&scene).expect("fits");
    let sum = digest(&plan);
    let mut engine = Engine::new(plan.setup);
    (0..steps).for_each(|_| engine.advance());
    let asked = RunRequest { scene: "tension".into(), set: Vec::new(), force: false };
    let state = (EngineState::of(&engine), f64::INFINITY);
    let left = Checkpoint::new((&asked, &scene, sum), state, (Cow::default(), None), Duration::ZERO);
    let folder = folder.join(out);
    std::fs::create_dir(&folder).expect("a folder");
    left.write(&folder).expect("written");
    ["run", "--resume", out]
}

#[test]
#[ignore = "needs mpirun"]
fn ranks_that_are_to_make_different_runs_are_refused() {
    let folder = temporary();
    let resumed = [killed(folder.path(), "p", 10), killed(folder.path(), "q", 20)];
    for (name, moved) in [("one", "0.1"), ("two", "0.2")] {
        let folder = folder.path().join(name);
        std::fs::create_dir(&folder).expect("a folder");
        let rows = (1..=4).map(|id| format!("{id},{moved},0\n"));
        std::fs::write(folder.join("m.csv"), String::from("id,ux,uy\n") + &rows.collect::<String>())
            .expect("written");
        std::fs::write(folder.join("s.toml"), LED_BY_A_FILE).expect("written");
    }
    let before = names_in(folder.path());
    let with = |option: &'static str| ["run", "tension", "--figures", "none", option];
    let set = |words: &'static str| ["run", "tension", "--set", words];
    for [first, second] in [
        // A frame is no part of the planned body.
        [&set("frame=mirror")[..], &set("frame=immediate")],
        [&set("lattice.spacing=0.5"), &set("lattice.spacing=0.25")],
        [&resumed[0], &resumed[1]],
        [&["run", "tension"], &resumed[0]],
        // What all of them do together.
        [&with("--no-report"), &with("--quiet")],
        [&with("--checkpoint-every=60s"), &with("--checkpoint-every=never")],
        [&["run", "one/s.toml", "--figures", "none"], &["run", "two/s.toml", "--figures", "none"]],
    ] {
        let both = [first, &[":", "-n", "1", PROGRAM], second].concat();
        let output = on_ranks(1, &both, folder.path());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{both:?}: {said}");
        assert!(said.contains("rank 1 is to make another run than rank 0"), "{both:?}: {said}");
        assert_eq!(names_in(folder.path()), before, "{both:?}");
    }
}

/// A body whose left edge is moved as a file says.
const LED_BY_A_FILE: &str = r#"
title = "Led by a file"
lattice = { kind = "square", spacing = 1.0 }
body.shape = { kind = "grid", columns = 20, rows = 4 }
stop.steps = 5

[[roles]]
region = { kind = "edge", side = "left" }
role = "leader"
motion = { kind = "csv", file = "m.csv", steps = 1 }
"#;

#[test]
#[ignore = "needs mpirun"]
fn ranks_with_different_programs_are_refused() {
    let folder = temporary();
    let other = folder.path().join("other");
    let mut program = std::fs::read(PROGRAM).expect("readable");
    // It still runs: what comes after its last section is not loaded.
    program.push(0);
    std::fs::write(&other, program).expect("written");
    let permissions = std::fs::metadata(PROGRAM).expect("a file").permissions();
    std::fs::set_permissions(&other, permissions).expect("permitted");
    let other = other.display().to_string();
    let both = ["run", "tension", ":", "-n", "1", &other, "run", "tension"];
    let output = on_ranks(1, &both, folder.path());
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("rank 1 has another program than rank 0"), "{said}");
    assert_eq!(names_in(folder.path()), ["other"]);
}
