//! Runs of bodies of which each rank has a part.

use crate::command::{flockform, text};
use crate::folders::{names_in, temporary};
use crate::running::Running;
use crate::signals::signal;
use crate::support::{
    LARGE_BEAM, PARTED, alone, assert_ends_well, assert_resumes, assert_same, begun, ended, mpirun, on_ranks,
    ranks_of, wait_for_checkpoint,
};

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
    let grid = ["--set", "body.shape={kind=\"grid\",columns=300,rows=210}", "--steps", "6"];
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
