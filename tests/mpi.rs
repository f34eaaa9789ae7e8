//! The program under `mpirun`: the files of a run are those of a run alone, whatever happens on the way.
//!
//! Needs the launcher of the MPI that the program is built with, and a build with the feature `mpi`. The launcher is `mpirun`, or
//! what the variable `FLOCKFORM_MPIRUN` names.

#![cfg(all(feature = "cli", feature = "mpi"))]

use std::hash::{BuildHasher, RandomState};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use command::{flockform, text};
use flockform::Engine;
use flockform::continuum::digest::digest;
use flockform::continuum::plan::Plan;
use flockform::engine::state::EngineState;
use flockform::export::checkpoint::{Checkpoint, RunRequest};
use flockform::scene::bundled;
use folders::{files, names_in, temporary};
use process::status;
use running::Running;
use signals::signal;
use waits::within;

#[path = "common/command.rs"]
mod command;
#[path = "common/folders.rs"]
mod folders;
#[path = "common/json.rs"]
mod json;
#[path = "common/process.rs"]
mod process;
#[path = "common/running.rs"]
#[allow(dead_code, reason = "a launcher is not asked to end")]
mod running;
#[path = "common/signals.rs"]
mod signals;
#[path = "common/waits.rs"]
mod waits;

const PROGRAM: &str = env!("CARGO_BIN_EXE_flockform");
const PATIENCE: Duration = Duration::from_secs(60);

fn launcher() -> String {
    std::env::var("FLOCKFORM_MPIRUN").unwrap_or_else(|_| "mpirun".to_owned())
}

/// The program on so many ranks, more than there may be cores, as the user that runs the tests.
fn mpirun(ranks: usize, arguments: &[&str], folder: &Path) -> Command {
    let mut command = Command::new(launcher());
    command.args(["-n", &ranks.to_string(), PROGRAM]).args(arguments);
    command.current_dir(folder).env_remove("RUST_LOG");
    // Open MPI's; MPICH asks for none of it.
    for (name, value) in [
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
    ] {
        command.env(name, value);
    }
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Waits for the program on ranks, which may be waiting for each other.
fn on_ranks(ranks: usize, arguments: &[&str], folder: &Path) -> Output {
    let run = mpirun(ranks, arguments, folder).spawn().expect("mpirun is installed");
    let (process, (done, output)) = (run.id(), mpsc::channel());
    std::thread::spawn(move || done.send(run.wait_with_output()));
    match output.recv_timeout(2 * PATIENCE) {
        Ok(output) => output.expect("readable"),
        Err(_) => {
            signal("TERM", process);
            panic!("{arguments:?} on {ranks} ranks: not within {:?}", 2 * PATIENCE);
        }
    }
}

/// The files of a run, by their path in its folder; of the summary, what does not depend on the clock or on how the work
/// was shared. The report embeds the summary.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let read = |path: PathBuf| {
        let mut bytes = std::fs::read(&path).expect("readable");
        if path.ends_with("summary.json") {
            let mut summary = json::json(&text(&bytes));
            summary["timings"] = serde_json::Value::Null;
            summary["share_swept"] = serde_json::Value::Null;
            if let Some(solver) = summary["equilibrium"].as_object_mut() {
                solver.remove("phases");
            }
            bytes = summary.to_string().into_bytes();
        }
        (path.strip_prefix(folder).expect("below it").to_owned(), bytes)
    };
    let mut found: Vec<_> =
        files(folder).into_iter().filter(|path| !path.ends_with("report.html")).map(read).collect();
    found.sort();
    found
}

fn assert_same(found: &Path, expected: &Path, what: &str) {
    let (found, expected) = (contents(found), contents(expected));
    let names = |all: &[(PathBuf, Vec<u8>)]| all.iter().map(|(path, _)| path.clone()).collect::<Vec<_>>();
    assert_eq!(names(&found), names(&expected), "{what}");
    for ((path, bytes), (_, of_one)) in found.iter().zip(&expected) {
        assert!(bytes == of_one, "{what}: {} differs", path.display());
    }
}

fn assert_ends_well(output: &Output, what: &str) {
    assert!(output.status.success(), "{what}: {}", text(&output.stderr));
}

#[test]
#[ignore = "needs mpirun"]
fn a_run_on_ranks_writes_the_files_of_a_run_alone() {
    let folder = temporary();
    let scenes: [(&str, &[&str]); 6] = [
        ("tension", &["--set", "record.vtk_every=20"]),
        ("tension-immediate", &[]),
        ("feedback-oscillate", &[]),
        ("fracture", &["--steps", "80"]),
        ("lattice-honeycomb", &[]),
        ("shear", &["--steps", "60"]),
    ];
    assert_alike_on_ranks(&folder, &scenes);
}

#[test]
#[ignore = "needs mpirun"]
fn equilibria_on_ranks_are_those_of_a_run_alone() {
    let folder = temporary();
    let scenes: [(&str, &[&str]); 3] = [
        ("beam-loaded", &LARGE_BEAM),
        ("plate-hole", &["--set", "equilibrium.solver=conjugate-gradients"]),
        ("elastica", &["--set", "lattice.spacing=0.5", "--set", "load_steps.increments=3"]),
    ];
    assert_alike_on_ranks(&folder, &scenes);
}

fn assert_alike_on_ranks(folder: &tempfile::TempDir, scenes: &[(&str, &[&str])]) {
    for &(name, more) in scenes {
        let alone = folder.path().join(format!("{name}-alone"));
        let arguments = |out: &Path| {
            let out = out.display().to_string();
            // Of figures of small bodies each rank lays out the whole.
            let fixed = ["run", name, "--figures", "svg", "--out"].map(str::to_owned);
            fixed.into_iter().chain([out]).chain(more.iter().map(|&one| one.to_owned())).collect::<Vec<_>>()
        };
        let words = arguments(&alone);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        assert_ends_well(&flockform(&words, folder.path()), name);
        for ranks in [2, 4] {
            let shared = folder.path().join(format!("{name}-{ranks}"));
            let words = arguments(&shared);
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let output = on_ranks(ranks, &words, folder.path());
            assert_ends_well(&output, name);
            assert_same(&shared, &alone, &format!("{name} on {ranks} ranks"));
            let said = text(&output.stdout);
            assert_eq!(said.matches("results in").count(), 1, "only one rank speaks: {said}");
        }
    }
}

#[test]
#[ignore = "needs mpirun"]
fn what_is_wrong_is_said_once_and_nothing_is_left() {
    for (arguments, words) in [
        (vec!["run", "tension", "--stepps", "3"], "unexpected argument '--stepps'"),
        (vec!["run", "tensio"], "no bundled scene"),
        (vec!["run", "tension", "--set", "rule.mean.kind=x"], "rule.mean"),
        (vec!["run", "tension", "--set", "update.order=sequential"], "cannot be shared by ranks"),
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
    let left = Checkpoint::new((&asked, &scene, sum), state, (&[], &[], &[], &[], None), Duration::ZERO);
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

/// Five groups of columns, which two ranks share.
const LARGE_BEAM: [&str; 6] = [
    "--set",
    "lattice.spacing=0.1",
    "--set",
    "body.shape.max=[40.0,22.0]",
    "--set",
    "equilibrium.solver=multigrid",
];

/// What keeps a run from being looked at as a whole: each rank lays out a part of the body.
const PARTED: [&str; 3] = ["--no-report", "--figures", "none"];

/// A plate whose outline is kept.
const FITTED: &str = r#"
title = "A plate whose outline is kept"
lattice = { kind = "hexagonal", spacing = 1.0 }
rule = { mean = { kind = "material" } }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
stop = { steps = 60 }
loads = [{ kind = "pressure", region = { kind = "outline", hole = 1 }, pressure = 9.0 }]
load_steps = { ramp = { steps = 40 }, every = 7 }
record = { probes = [1, 300, 900, 1000], places = [[33.5, 5.0], [90.0, 7.0]] }

[body]
shape = { kind = "polygon", vertices = [[0, 0], [60, -0.4], [120, 3.7], [90, 10.9], [1, 8]] }
holes = [{ kind = "disc", centre = [30, 4.3], radius = 2.1 }]

[[roles]]
region = { kind = "edge", side = "left", depth = 2.0 }
role = "clamped"
"#;

#[test]
#[ignore = "needs mpirun"]
fn a_run_in_parts_writes_the_tables_of_a_run_alone() {
    let folder = temporary();
    std::fs::write(folder.path().join("fitted.toml"), FITTED).expect("written");
    let fine = ["--set", "body.shape={kind=\"grid\",columns=300,rows=40}", "--steps", "100"];
    let when = "roles[2]={region={kind=\"all\"},role=\"ghost\",from=9,when={quantity=\"pe1\",above=0.3}}";
    for (name, more) in [
        ("tension", &fine[..]),
        ("tension-immediate", &[]),
        ("lattice-honeycomb", &[]),
        ("fracture", &["--steps", "80"]),
        ("tension", &["--set", when, "--steps", "60"]),
        ("fitted.toml", &[]),
        ("beam-loaded", &[]),
        ("beam-loaded", &LARGE_BEAM),
        ("beam-loaded", &[&LARGE_BEAM[..], &["--set", "load_steps={increments=2}"]].concat()),
        ("elastica", &["--set", "lattice.spacing=0.5", "--set", "load_steps={increments=3}"]),
    ] {
        let run = |out: &'static str| [&["run", name, "--out", out][..], &PARTED, more].concat();
        assert_ends_well(&flockform(&run("alone"), folder.path()), name);
        for (ranks, out) in [(2, "two"), (4, "four")] {
            let output = on_ranks(ranks, &run(out), folder.path());
            assert_ends_well(&output, name);
            let said = text(&output.stdout);
            assert_eq!(said.matches("results in").count(), 1, "only one rank speaks: {said}");
            let [found, expected] = [out, "alone"].map(|out| folder.path().join(out));
            assert_same(&found, &expected, &format!("{name} in {ranks} parts"));
            std::fs::remove_dir_all(found).expect("removed");
        }
        std::fs::remove_dir_all(folder.path().join("alone")).expect("removed");
    }
}

#[test]
#[ignore = "needs mpirun"]
fn a_run_in_parts_has_figures_of_all_and_a_report_of_a_sample() {
    let folder = temporary();
    std::fs::write(folder.path().join("fitted.toml"), FITTED).expect("written");
    let large = ["--set", "body.shape={kind=\"grid\",columns=300,rows=210}", "--steps", "20"];
    let scenes: [(&str, &str, &[&str]); 3] =
        [("tension", "svg", &large), ("fitted.toml", "none", &[]), ("beam-loaded", "none", &LARGE_BEAM)];
    for (name, figures, more) in scenes {
        let run = |out: &'static str| [&["run", name, "--figures", figures, "--out", out][..], more].concat();
        assert_ends_well(&flockform(&run("alone"), folder.path()), name);
        assert_ends_well(&on_ranks(3, &run("three"), folder.path()), name);
        let report = |out: &str| {
            std::fs::read_to_string(folder.path().join(out).join("report.html")).expect("a report")
        };
        let says = |out: &str| report(out).contains("Ranks had a part of the body each");
        assert!(says("three") && !says("alone"), "{name}");
        let [found, expected] = ["three", "alone"].map(|out| folder.path().join(out));
        assert_same(&found, &expected, name);
        for folder in [found, expected] {
            std::fs::remove_dir_all(folder).expect("removed");
        }
    }
}

#[test]
#[ignore = "needs mpirun"]
fn a_run_in_parts_is_recorded_whole_and_its_film_shows_the_same_sample_on_any_number_of_ranks() {
    let folder = temporary();
    std::fs::write(folder.path().join("fitted.toml"), FITTED).expect("written");
    let grid = ["--set", "body.shape={kind=\"grid\",columns=300,rows=210}", "--steps", "20"];
    let short = "load_steps={ramp={steps=4},every=2}";
    let fine = ["--set", "lattice.spacing=0.12", "--set", short, "--steps", "6"];
    let scenes: [(&str, &str, &[&str]); 2] = [("tension", "pe1", &grid), ("fitted.toml", "von-mises", &fine)];
    for (name, colour, more) in scenes {
        // A recording has the name of its file in it.
        let files = |ranks: usize| ["film.gif", "run.mcap"].map(|file| format!("{ranks}/{file}"));
        let run = |ranks: usize| {
            let [film, record] = &files(ranks);
            let outputs = ["--film", film, "--film-colour", colour, "--record", record, "--figures", "none"];
            let arguments =
                [&["run", "-v", name, "--no-report", "--force", "--out", "out"][..], &outputs, more].concat();
            let output = match ranks {
                1 => flockform(&arguments, folder.path()),
                _ => on_ranks(ranks, &arguments, folder.path()),
            };
            assert_ends_well(&output, name);
            let said = text(&output.stderr);
            let mut planned =
                said.lines().filter_map(|line| line.split_once("planned ")?.1.split_once(" particles"));
            let is_whole =
                |(counts, _): (&str, &str)| counts.split_once(" of ").is_some_and(|(own, all)| own == all);
            assert_eq!(planned.any(is_whole), ranks == 1, "{name}: {said}");
        };
        for ranks in [1, 2, 3] {
            std::fs::create_dir_all(folder.path().join(ranks.to_string())).expect("made");
            run(ranks);
        }
        let read = |file: &str| std::fs::read(folder.path().join(file)).expect(file);
        let [alone, two, three] = [1, 2, 3].map(|ranks| files(ranks).map(|file| read(&file)));
        assert!(two == three, "{name}");
        assert!(two[1] == alone[1], "{name}: recordings");
    }
}

#[test]
#[ignore = "needs mpirun"]
fn every_rank_writes_its_piece_of_a_frame() {
    let folder = temporary();
    let run = ["run", "tension", "--out", "o", "--steps", "30", "--set", "record.vtk_every=20"];
    assert_ends_well(&on_ranks(3, &[&run[..], &PARTED].concat(), folder.path()), "frames");
    let read = |file: &str| std::fs::read_to_string(folder.path().join("o").join(file)).expect(file);
    for step in ["000000", "000020", "000030"] {
        assert!(read("steps.pvd").contains(&format!("steps/step_{step}.pvtu")));
        let list = read(&format!("steps/step_{step}.pvtu"));
        for rank in 0..3 {
            let piece = format!("step_{step}_000{rank}.vtu");
            assert!(list.contains(&format!("<Piece Source=\"{piece}\"/>")), "{list}");
            assert!(read("flockform-files.txt").contains(&format!("steps/{piece}\n")));
            // The list names the arrays of the pieces, and no others.
            let names = |text: &str| {
                let of = |part: &str| part.split('"').next().map(str::to_owned);
                let mut names: Vec<_> = text.split(" Name=\"").skip(1).filter_map(of).collect();
                names.retain(|name| !["connectivity", "offsets", "types"].contains(&name.as_str()));
                names
            };
            assert_eq!(names(&list), names(&read(&format!("steps/{piece}"))));
        }
    }
}

/// A long run in parts.
const LONG_IN_PARTS: [&str; 18] = [
    "run",
    "tension",
    "--out",
    "o",
    "--quiet",
    "--checkpoint-every",
    "50steps",
    "--steps",
    "600",
    "--set",
    "body.shape={kind=\"grid\",columns=60,rows=40}",
    "--no-report",
    "--figures",
    "none",
    "--set",
    "record.probes=[1,700,1500,2400]",
    "--set",
    "cuts=[{from=[29.5,-1.0],to=[29.5,12.5]}]",
];

#[test]
#[ignore = "needs mpirun"]
fn a_run_in_parts_goes_on_in_any_number_of_parts_and_alone() {
    let expected = alone(&LONG_IN_PARTS);
    for victim in 0..3 {
        let folder = temporary();
        let (mut run, ranks) = begun(3, &LONG_IN_PARTS, (victim + 1) % 3, folder.path());
        let parts = names_in(&folder.path().join("o.unfinished"));
        let parts = parts.iter().filter(|name| name.starts_with("checkpoint.")).count();
        // While one is made, that of the step before is there too.
        assert!([2, 3, 4].contains(&parts), "{parts}");
        signal("KILL", ranks[victim]);
        let (is_well, said) = ended(&mut run);
        assert!(!is_well, "{said}");
        // One more than there were, alone, or as many.
        let ranks = [4, 1, 3][victim];
        assert_resumes(
            ranks,
            folder.path(),
            expected.path(),
            &format!("rank {victim} killed, {ranks} go on"),
        );
    }
    // What was begun alone goes on in parts.
    let folder = temporary();
    let run = Running(mpirun(1, &LONG_IN_PARTS, folder.path()).spawn().expect("mpirun is installed"));
    wait_for_checkpoint(folder.path());
    ranks_of(&run.0).into_iter().for_each(|process| signal("KILL", process));
    let mut run = run;
    let _ = ended(&mut run);
    if !folder.path().join("o").exists() {
        assert_resumes(2, folder.path(), expected.path(), "alone, then two");
    }
}

/// A run that is looked at after each of its steps, which take a while on ranks, with checkpoints.
#[rustfmt::skip]
const fn long(steps: &'static str) -> [&'static str; 12] {
    [
        "run", "tension", "--out", "o", "--no-report", "--figures", "none", "--quiet",
        "--checkpoint-every", "100steps", "--steps", steps,
    ]
}

const LONG: [&str; 12] = long("1500");
/// One whose ranks are not at its end yet when they are frozen for the second time.
const LONGER: [&str; 12] = long("60000");

/// A long run alone, in a folder of its own.
fn alone(long: &[&str]) -> tempfile::TempDir {
    let folder = temporary();
    assert_ends_well(&flockform(long, folder.path()), "alone");
    folder
}

/// A long run on ranks, and their process ids.
fn started(ranks: usize, long: &[&str], folder: &Path) -> (Running, Vec<u32>) {
    let run = Running(mpirun(ranks, long, folder).spawn().expect("mpirun is installed"));
    let found = || Some(ranks_of(&run.0)).filter(|found| found.len() == ranks);
    let processes = within(PATIENCE, "all ranks", found);
    (run, processes)
}

/// The same once it has kept a checkpoint; so that it does not end before it is asked to, one rank is frozen, for which the
/// others wait.
fn begun(ranks: usize, long: &[&str], frozen: usize, folder: &Path) -> (Running, Vec<u32>) {
    let (run, processes) = started(ranks, long, folder);
    wait_for_checkpoint(folder);
    signal("STOP", processes[frozen]);
    (run, processes)
}

/// Waits until a run has kept a checkpoint, or has ended already.
fn wait_for_checkpoint(folder: &Path) {
    let places = ["o.unfinished/checkpoint", "o"].map(|of| folder.join(of));
    within(PATIENCE, "a checkpoint", || places.iter().any(|place| place.exists()).then_some(()));
}

/// Waits until the launcher has ended; whether it ended well, and its words: MPICH's says on its output what went wrong.
fn ended(run: &mut Running) -> (bool, String) {
    let status = within(PATIENCE, "mpirun ends", || run.0.try_wait().expect("a child"));
    let mut said = String::new();
    run.0.stdout.take().expect("piped").read_to_string(&mut said).expect("text");
    run.0.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    (status.success(), said)
}

/// Resumes a long run and compares it with the one that was never disturbed.
fn assert_resumes(ranks: usize, folder: &Path, expected: &Path, what: &str) {
    let resume = ["run", "--resume", "o", "--no-report", "--figures", "none", "--quiet"];
    let output = if ranks == 1 { flockform(&resume, folder) } else { on_ranks(ranks, &resume, folder) };
    assert_ends_well(&output, what);
    assert_same(&folder.join("o"), &expected.join("o"), what);
}

/// Whether a signal that asks a frozen process to end waits for it.
fn is_asked_to_end(process: u32) -> bool {
    const INT: u64 = 1 << 1;
    const TERM: u64 = 1 << 14;
    let waiting = status(process, "ShdPnd").map_or(0, |bits| u64::from_str_radix(&bits, 16).expect("bits"));
    waiting & (INT | TERM) != 0
}

/// Process ids of the ranks.
fn ranks_of(mpirun: &Child) -> Vec<u32> {
    let children = |parent: u32| -> Vec<u32> {
        let output = Command::new("ps").args(["--ppid", &parent.to_string(), "-o", "pid="]).output();
        let output = text(&output.expect("ps runs").stdout);
        output.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let is_rank = |&process: &u32| {
        let file = std::fs::read_link(format!("/proc/{process}/exe")).unwrap_or_default();
        file == Path::new(PROGRAM)
    };
    // MPICH has a process of its own in between.
    let first = children(mpirun.id());
    let second: Vec<u32> = first.iter().flat_map(|&process| children(process)).collect();
    first.into_iter().chain(second).filter(is_rank).collect()
}

#[test]
#[ignore = "needs mpirun"]
fn a_killed_rank_ends_the_run_which_goes_on_with_any_number_of_ranks() {
    let expected = alone(&LONG);
    for victim in 0..3 {
        let folder = temporary();
        let (mut run, ranks) = begun(3, &LONG, (victim + 1) % 3, folder.path());
        signal("KILL", ranks[victim]);
        let killed = Instant::now();
        let (is_well, said) = ended(&mut run);
        assert!(!is_well, "{said}");
        assert!(killed.elapsed() < PATIENCE / 4, "{:?}", killed.elapsed());
        // Open MPI names the rank. MPICH names a process, which may be one that it has ended because of the other.
        let by_process = ranks.iter().any(|process| said.contains(&format!("PID {process} RUNNING")));
        assert!(by_process || said.contains(&format!("rank {victim} with PID")), "rank {victim}: {said}");
        assert!(folder.path().join("o.unfinished/checkpoint").exists(), "the last checkpoint stays");
        let what = format!("rank {victim} killed");
        assert_resumes(victim + 1, folder.path(), expected.path(), &what);
    }
}

#[test]
#[ignore = "needs mpirun"]
fn a_rank_killed_at_any_moment_costs_no_more_than_the_last_checkpoint() {
    const KILLS: usize = 20;
    let expected = alone(&LONG);
    // How long a run takes that is not disturbed, before its first checkpoint and from there to its results.
    let mut longest = {
        let folder = temporary();
        let (mut run, _) = started(2, &LONG, folder.path());
        let begin = Instant::now();
        wait_for_checkpoint(folder.path());
        let first = begin.elapsed();
        within(PATIENCE, "results", || folder.path().join("o").exists().then_some(()));
        let all = begin.elapsed();
        assert!(ended(&mut run).0);
        [first, all - first]
    };
    // Of a resumed run, one that had ended, and one without a checkpoint yet.
    let mut counts = [0; 3];
    let mut kills = 0;
    for n in 0..80 {
        let folder = temporary();
        let random = RandomState::new().hash_one(n);
        // Ranks may take longer to begin than to take all of their steps: of every other one a checkpoint is waited for.
        let (victim, is_kept) = (random as usize % 2, n % 2 == 1);
        let longest = &mut longest[usize::from(is_kept)];
        let after = longest.mul_f64((random >> 32) as f64 / 2f64.powi(32));
        let (mut run, ranks) = started(2, &LONG, folder.path());
        if is_kept {
            wait_for_checkpoint(folder.path());
        }
        std::thread::sleep(after);
        // Runs may be faster than the first: those that had ended are no kills.
        match signals::is_sent("KILL", ranks[victim]) {
            true => kills += 1,
            false => *longest = longest.mul_f64(0.8),
        }
        let (_, said) = ended(&mut run);
        let what = format!("rank {victim} killed after {after:?} of {longest:?}, kept: {is_kept}");
        let [done, left] =
            ["o/summary.json", "o.unfinished/checkpoint"].map(|of| folder.path().join(of).exists());
        match (done, left) {
            (true, _) => assert_same(&folder.path().join("o"), &expected.path().join("o"), &what),
            (false, true) => assert_resumes(1 + n / 2 % 2, folder.path(), expected.path(), &what),
            (false, false) => assert!(!is_kept && !folder.path().join("o").exists(), "{what}: {said}"),
        }
        counts[if done { 1 } else { usize::from(!left) * 2 }] += 1;
        if kills == KILLS {
            break;
        }
    }
    println!("resumed, ended before, killed before the first checkpoint: {counts:?}");
    assert!(kills == KILLS && counts[0] > 0, "{kills} kills, {counts:?}");
}

#[test]
#[ignore = "needs mpirun"]
fn an_interrupt_of_the_launcher_ends_the_run_which_goes_on_to_the_same_bits() {
    let expected = alone(&LONGER);
    let folder = temporary();
    let (mut run, ranks) = begun(3, &LONGER, 1, folder.path());
    signal("INT", run.0.id());
    // Open MPI has the ranks go on, and passes the interrupt to them a second later.
    within(PATIENCE, "an interrupt of the ranks", || {
        // Half a second later the others have ended, and this one with them.
        let state = status(ranks[1], "State");
        if state.as_ref().is_some_and(|state| state != "T") {
            signals::is_sent("STOP", ranks[1]);
        }
        (state.is_none() || is_asked_to_end(ranks[1])).then_some(())
    });
    signals::is_sent("CONT", ranks[1]);
    let interrupted = Instant::now();
    let (is_well, said) = ended(&mut run);
    // MPICH's launcher, which begins its lines so, says at times that it ended well. There is a checkpoint only if the run did not.
    assert!(!is_well || said.contains("[mpiexec@"), "{said}");
    assert!(interrupted.elapsed() < PATIENCE / 4, "{:?}", interrupted.elapsed());
    assert_resumes(2, folder.path(), expected.path(), "interrupted");
}

#[test]
#[ignore = "needs mpirun"]
fn an_interrupt_of_one_rank_ends_all_at_one_step_from_which_the_run_goes_on() {
    let expected = alone(&LONG);
    let folder = temporary();
    let (mut run, ranks) = begun(3, &LONG, 1, folder.path());
    // It is not told by the launcher, which would kill what takes longer than it likes.
    signal("TERM", ranks[1]);
    signal("CONT", ranks[1]);
    let (is_well, said) = ended(&mut run);
    assert!(!is_well, "{said}");
    assert!(folder.path().join("o/summary.json").exists(), "the first rank writes what there is");
    assert_resumes(2, folder.path(), expected.path(), "interrupted");
}
