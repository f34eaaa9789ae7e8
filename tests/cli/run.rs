//! `flockform run`, `scenes`, `plan`, `schema`, `trade` and `bench`.

use crate::program::*;
use std::path::Path;
use std::time::Duration;

#[test]
fn the_main_job_writes_the_figures_and_tables_of_the_paper() {
    let folder = temporary();
    let said = done(&["run", "tension"], folder.path());
    assert!(said.contains("step 401") && said.contains("out/tension"), "{said}");
    let out = folder.path().join("out/tension");
    for figure in ["configuration_0001", "configuration_0020", "pe1_0020", "configuration_0401", "probes"] {
        for ending in ["svg", "png"] {
            assert!(out.join(format!("{figure}.{ending}")).is_file(), "{figure}.{ending}");
        }
    }
    let summary = json_in(&out.join("summary.json"));
    assert_eq!(summary["stop_reason"], "steps");
    assert_eq!(summary["steps"], 401);
    assert_eq!(summary["counts"]["frame"], 44);
    assert_eq!(summary["scene"]["lattice"]["spacing"], 1.0);
    let table = std::fs::read_to_string(out.join("final.csv")).expect("written");
    assert_eq!(
        table.lines().next(),
        Some("id,column,row,role,X,Y,x,y,pe1,pe2,strain_xx,strain_yy,strain_xy,rotation")
    );
    assert_eq!(table.lines().count(), 145);
    assert!(table.lines().nth(67).is_some_and(|row| row.starts_with("67,6,7,follower,")));
}

#[test]
fn a_second_run_takes_a_new_folder_unless_one_is_named() {
    let folder = temporary();
    done(&["run", "tension", "--steps", "2", "-q"], folder.path());
    let said = done(&["run", "tension", "--steps", "2"], folder.path());
    assert!(said.contains("out/tension-2"), "{said}");
    refused_in(&["run", "tension", "--steps", "2", "--out", "out/tension"], folder.path(), &["--force"]);
    done(&["run", "tension", "--steps", "3", "--out", "out/tension", "--force"], folder.path());
    assert_eq!(json_in(&folder.path().join("out/tension/summary.json"))["steps"], 3);
}

#[test]
fn force_leaves_a_folder_alone_that_is_not_ours() {
    let folder = temporary();
    std::fs::create_dir(folder.path().join("mine")).expect("made");
    std::fs::write(folder.path().join("mine/thesis.txt"), "years").expect("written");
    refused_in(
        &["run", "tension", "--out", "mine", "--force"],
        folder.path(),
        &["does not look like an output of flockform"],
    );
    assert_eq!(files(folder.path()).len(), 1);
}

#[test]
fn quiet_prints_nothing_and_a_pipe_gets_no_bar() {
    let folder = temporary();
    let quiet = flockform(&["run", "tension", "--steps", "2", "--quiet"], folder.path());
    assert!(quiet.stdout.is_empty() && quiet.stderr.is_empty(), "{}", text(&quiet.stderr));
    let piped = flockform(&["run", "tension", "--steps", "2"], folder.path());
    assert!(!text(&piped.stderr).contains('\r') && !text(&piped.stdout).contains('\x1b'));
}

#[test]
fn overrides_and_steps_reach_the_scene() {
    let folder = temporary();
    let sets =
        ["run", "tension", "--steps", "7", "--set", "roles[1].motion.per_step=[0.1, 0.2]", "--out", "o"];
    done(&sets, folder.path());
    let summary = json_in(&folder.path().join("o/summary.json"));
    assert_eq!(summary["steps"], 7);
    assert_eq!(summary["scene"]["roles"][1]["motion"]["per_step"], serde_json::json!([0.1, 0.2]));
}

#[test]
fn paraview_frames_are_written_when_asked_for() {
    let folder = temporary();
    done(&["run", "tension", "--steps", "5", "--set", "record.vtk_every=2", "--out", "o"], folder.path());
    let frames = files(&folder.path().join("o/steps"));
    // Steps 0, 2 and 4, and the last one.
    assert_eq!(frames.len(), 4, "{frames:?}");
    assert!(folder.path().join("o/steps.pvd").is_file());
}

#[test]
fn the_fracture_scene_breaks_near_the_top_and_its_variants_elsewhere_or_faster() {
    let folder = temporary();
    let broken = |scene: &str| {
        done(&["run", scene, "-q", "--out", scene], folder.path());
        let summary = json_in(&folder.path().join(scene).join("summary.json"));
        let first = &summary["broken_bonds"]["first"];
        (first["along"].as_f64().expect("broke"), first["step"].as_u64().expect("broke"))
    };
    let (top, _) = broken("fracture");
    let breaks = std::fs::read_to_string(folder.path().join("fracture/breaks.csv")).expect("written");
    assert_eq!(breaks.lines().next(), Some("step,id_a,id_b,X,Y,along,length"));
    // Broken at the step after the bond had grown past df = 11.
    let first: Vec<f64> =
        breaks.lines().nth(1).expect("a break").split(',').map(|v| v.parse().expect("a number")).collect();
    assert!((first[5] - top).abs() < 1e-12 && first[6] > 11.0 && first[6] < 12.0, "{first:?}");
    // The profile narrows between 0.31 and 0.69 of the length; its middle is at 0.5.
    assert!((0.67..0.71).contains(&top), "{top}");
    let (slow, _) = broken("fracture-slow");
    assert!((0.62..0.67).contains(&slow), "{slow}: slower, lower");
}

#[test]
fn a_run_that_diverges_fails_names_the_cause_and_keeps_the_last_good_state() {
    let folder = temporary();
    let arguments =
        ["run", "tension", "--out", "o", "--set", "rule.feedback={factor=1.0}", "--set", "stop.steps=4000"];
    let said = failed(&arguments, folder.path());
    assert!(said.contains("diverged at step") && said.contains("particle"), "{said}");
    assert!(said.contains("feedback factor 1"), "{said}");
    // Its frame takes no feedback.
    assert!(said.contains("`flockform stability`") && !said.contains("spectral radius"), "{said}");
    let summary = json_in(&folder.path().join("o/summary.json"));
    assert_eq!(summary["stop_reason"], "diverged");
    let table = std::fs::read_to_string(folder.path().join("o/final.csv")).expect("written");
    assert!(!table.contains("NaN") && !table.contains("inf"));
}

#[test]
fn a_poisson_term_that_diverges_by_its_centre_is_blamed_on_that() {
    let folder = temporary();
    let arguments =
        ["run", "tension", "--no-report", "--out", "o", "--set", "rule.poisson={k=-0.3,centre=1e9}"];
    let said = failed(&arguments, folder.path());
    assert!(
        said.contains("= 1000000000, which lies outside the body; leave rule.poisson.centre out"),
        "{said}"
    );
}

/// Starts a run that would go on for minutes.
fn long_run(folder: &Path) -> std::process::Child {
    let arguments = ["run", "tension", "--out", "o", "--set", "stop.steps=100000000", "--set", "record={}"];
    let child = command(&arguments, folder).stdout(std::process::Stdio::piped()).spawn();
    let child = child.expect("the program starts");
    // The hidden folder shows that it has begun.
    within(Duration::from_secs(30), "its beginning", || (!names_in(folder).is_empty()).then_some(()));
    std::thread::sleep(Duration::from_millis(200));
    child
}

#[test]
fn a_solved_scene_reports_its_solver_and_how_it_came_to_rest() {
    let folder = temporary();
    let set = ["--set", "equilibrium.solver=conjugate-gradients"];
    let said = done(&[&["run", "beam-loaded", "--out", "here"][..], &set].concat(), folder.path());
    assert!(said.contains("conjugate-gradients, asked for:") && said.contains("in equilibrium"), "{said}");
    let here = folder.path().join("here");
    let summary = json_in(&here.join("summary.json"));
    let solved = &summary["equilibrium"];
    assert_eq!((&solved["solver"], &solved["converged"]), (&"conjugate-gradients".into(), &true.into()));
    assert!(solved["phases"]["solve"].as_f64().is_some_and(|s| s > 0.0), "{solved}");
    let history = std::fs::read_to_string(here.join("residuals.csv")).expect("written");
    assert_eq!(history.lines().count() as u64, solved["iterations"].as_u64().expect("a count") + 2);
    assert!(here.join("residuals.png").is_file());
    let too_few = ["run", "beam-loaded", "--out", "there", "--set"];
    let asked = "equilibrium={solver=\"jacobi\",most_iterations=3}";
    failed(&[&too_few[..], &[asked]].concat(), folder.path());
    assert_eq!(json_in(&folder.path().join("there/summary.json"))["stop_reason"], "unsettled");
    // Of a body that turns it is the cap that is named, and not a load at which it would buckle.
    let asked = "equilibrium={solver=\"conjugate-gradients\",most_iterations=3}";
    let too_few =
        ["run", "elastica", "--out", "turned", "--set", asked, "--set", "load_steps={increments=1}"];
    refused_in(&too_few, folder.path(), &["no further than most_iterations", "raise it"]);
}

#[test]
fn a_trade_study_prints_what_is_cheapest_and_writes_every_setting() {
    let folder = temporary();
    let said = done(&["trade", "grips", "--quick", "--out", "here"], folder.path());
    for words in ["for 10 % error the cheapest setting is", "the material rule comes as near as"] {
        assert!(said.contains(words), "{said}");
    }
    let here = folder.path().join("here");
    let table = std::fs::read_to_string(here.join("trade.csv")).expect("written");
    let study = json_in(&here.join("trade.json"));
    assert_eq!(table.lines().count() - 1, study["points"].as_array().expect("points").len());
    assert!(table.lines().any(|line| line.starts_with("material,0.5,") && line.contains(",multigrid,")));
    assert!(here.join("trade.png").is_file() && here.join("trade.svg").is_file());
    let again = ["trade", "grips", "--quick", "--out", "here", "--force", "--quiet"];
    done(&[&again[..], &["--repeats", "2", "--max-particles", "600"]].concat(), folder.path());
    let smaller = json_in(&here.join("trade.json"));
    let particles = |study: &serde_json::Value| {
        let points = study["points"].as_array().expect("points").iter();
        points.filter_map(|point| point["particles"].as_u64()).max().expect("some")
    };
    assert_eq!([&study["repeats"], &smaller["repeats"]], [1, 2]);
    assert!(
        particles(&study) > 600 && particles(&smaller) <= 600,
        "{} {}",
        particles(&study),
        particles(&smaller)
    );
    let none = ["trade", "grips", "--quick", "--out", "none", "--max-particles", "1"];
    refused(&none, &["no setting is left", "--max-particles"]);
}

#[test]
fn an_accuracy_is_met_and_told() {
    let folder = temporary();
    let arguments = ["run", "beam-loaded", "--out", "here", "--set", "equilibrium.accuracy=1%"];
    let said = done(&arguments, folder.path());
    assert!(said.starts_with("accuracy 1 %: material rule at 0.5 of the written spacing"), "{said}");
}

#[cfg(unix)]
#[test]
fn an_interrupt_stops_at_the_next_step_and_writes_what_there_is() {
    for name in ["INT", "TERM"] {
        let folder = temporary();
        let child = long_run(folder.path());
        signal(name, child.id());
        let output = child.wait_with_output().expect("ends");
        assert_eq!(output.status.code(), Some(1), "{name}");
        assert!(text(&output.stdout).contains("interrupted"), "{}", text(&output.stdout));
        assert_eq!(json_in(&folder.path().join("o/summary.json"))["stop_reason"], "interrupted");
    }
}

#[cfg(unix)]
#[test]
fn a_killed_run_leaves_nothing_at_the_output_s_place() {
    let folder = temporary();
    let mut child = long_run(folder.path());
    child.kill().expect("kills");
    child.wait().expect("ends");
    assert!(!folder.path().join("o").exists());
}

#[test]
fn a_quiet_run_that_diverges_says_why() {
    let folder = temporary();
    let grown = ["--set", "rule.feedback={factor=0.8}", "--figures", "none", "--no-report"];
    let output = flockform(&[&["run", "tension", "-q"], &grown[..]].concat(), folder.path());
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(1), String::new()));
    let said = text(&output.stderr);
    assert!(said.starts_with("error: tension: diverged at step") && said.contains("feedback"), "{said}");
}

#[test]
fn scenes_are_listed_with_a_line_each() {
    let said = done(&["list", "scenes"], temporary().path());
    assert_eq!(said.lines().count(), flockform::scene::bundled::SCENES.len());
    assert!(said.lines().all(|line| line.split_whitespace().count() > 3), "{said}");
}

#[test]
fn a_plan_says_what_is_modelled_left_out_and_why() {
    let folder = temporary();
    let said = done(&["plan", "fracture"], folder.path());
    for words in ["particles", "memory", "models", "fracture past df = 11 mm", "leaves out", "frame"] {
        assert!(said.contains(words), "no `{words}` in\n{said}");
    }
    assert!(files(folder.path()).is_empty());
    let undamped = ["--set", "rule.mean={kind=\"distance\"}", "--set", "update.damping=1"];
    let said = done(&[&["plan", "tension"], &undamped[..]].concat(), folder.path());
    assert!(said.contains("caution") && said.contains("sequential"), "{said}");
    let later = "actions=[{at=21,what={kind='set',keys=['rule.feedback.factor=-0.1']}}]";
    let said = done(&["plan", "tension", "--set", later], folder.path());
    let words = [
        "from step 21 on rule.feedback.factor=-0.1",
        "rule.feedback from step 21 on",
        "because of actions[0]",
    ];
    assert!(words.iter().all(|words| said.contains(words)) && !said.contains("not overshot"), "{said}");
    let within = later.replace(
        "'rule.feedback.factor=-0.1'",
        "'rule={mean={kind=\"barycentre\"},poisson={axis=\"x\",k=0.1}}'",
    );
    let said = done(&["plan", "tension", "--set", &within], folder.path());
    assert!(said.contains("rule.poisson from step 21 on") && said.contains("  rule.feedback "), "{said}");
}

#[test]
fn a_strain_that_is_not_defined_is_none() {
    const ROW: &str = "title = \"t\"\nframe = \"none\"\nlattice = { kind = \"square\", spacing = 1.0 }\n\
        body = { shape = { kind = \"grid\", columns = 6, rows = 1 } }\nstop = { steps = 3 }\n\
        roles = [{ role = \"leader\", region = { kind = \"ids\", ids = [6] }, \
        motion = { kind = \"velocity\", per_step = [0.1, 0.0] } }]\n";
    let folder = temporary();
    std::fs::write(folder.path().join("row.toml"), ROW).expect("written");
    let said = done(&["run", "row.toml", "--out", "o"], folder.path());
    assert!(said.contains("strain not defined: no particle has neighbours in two directions\n"), "{said}");
    assert!(json_in(&folder.path().join("o/summary.json"))["energies"]["largest_strain"].is_null());
}

#[test]
fn the_schema_is_json_and_knows_every_top_level_key() {
    let schema = json(&done(&["schema"], temporary().path()));
    for key in
        ["lattice", "body", "frame", "neighbours", "rule", "update", "roles", "fracture", "stop", "record"]
    {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
    // Particles are counted from 1.
    let probes = &schema["$defs"]["RawRecord"]["properties"]["probes"];
    assert_eq!(probes["items"]["minimum"], 1, "{probes}");
}

#[test]
fn completions_and_help_have_what_they_promise() {
    let folder = temporary();
    for shell in ["bash", "zsh", "fish"] {
        assert!(done(&["completions", shell], folder.path()).contains("flockform"));
    }
    for command in ["run", "list", "plan", "schema", "completions", "material"] {
        assert!(done(&[command, "--help"], folder.path()).contains("Example"), "{command}");
    }
    for command in
        ["run", "compare", "trade", "sweep", "stability", "swarm", "live", "replay", "node", "robots"]
            .into_iter()
            .chain(["gallery", "list", "show", "new", "plan", "material", "install", "schema", "completions"])
    {
        let help = done(&[command, "--help"], folder.path());
        let (_, examples) = help.split_once("\nExample").expect("there are some");
        let count = examples.split("\n\n").next().map_or(0, |lines| lines.matches("\n  flockform ").count());
        assert_eq!(examples.starts_with("s:"), count > 1, "{command}: {count} in {help}");
    }
}

#[test]
fn the_bench_completes_and_its_json_is_valid() {
    let said = done(&["bench", "sweep", "--quick", "--json"], temporary().path());
    let report = json(&said);
    assert!(report.is_object(), "{said}");
}

#[cfg(feature = "swarm")]
#[test]
fn the_swarm_bench_says_in_json_what_a_tick_costs_and_how_long_a_target_takes() {
    let said = done(&["bench", "swarm", "--quick", "--json"], temporary().path());
    let report = json(&said);
    for (list, keys) in [
        ("cases", &["robots", "rule_robots_per_millisecond", "safe_robots_per_millisecond"][..]),
        ("ticks", &["robots", "sweeps", "seconds_per_tick", "robots_per_millisecond"]),
    ] {
        let cases = report[list].as_array().expect("a list");
        assert!(!cases.is_empty(), "{said}");
        for (case, key) in cases.iter().flat_map(|case| keys.iter().map(move |key| (case, key))) {
            assert!(case[key].as_f64().is_some_and(|number| number > 0.0), "{list} {key}: {said}");
        }
    }
    let latency = &report["latency"];
    let cases = latency["cases"].as_array().expect("a list");
    let no_network = |why: &str| why.starts_with("no DDS participant");
    assert!(latency["skipped"].as_str().map_or(cases.len() == 2, no_network), "{said}");
    for case in cases {
        for key in ["robots", "samples", "lost", "period_seconds", "p50_seconds", "p99_seconds"] {
            assert!(case[key].is_number() || case[key].is_null(), "{key}: {said}");
        }
        assert!(case["robots"].is_u64() && case.get("period_seconds").is_some(), "{said}");
    }
}

/// Of a rule without rest offsets the ends of a body move from the first step on, and an action may move all of it.
#[test]
fn a_plan_predicts_how_much_of_the_work_is_done_where_nothing_rests_at_first() {
    let scene = "title = \"a strip\"\nunit = \"m\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n[body]\n\
                 shape = { kind = \"grid\", columns = 600, rows = 100 }\n[[roles]]\nregion = { kind = \"edge\", side = \"right\" }\n\
                 role = \"leader\"\nmotion = { kind = \"velocity\", per_step = [0.01, 0.0] }\n[stop]\nsteps = 60\n";
    let cases = [
        ("", true),
        ("[rule]\nrest = \"literal\"\n", true),
        ("[[actions]]\nat = 5\nwhat = { kind = \"set\", keys = [\"update.damping=0.5\"] }\n", false),
    ];
    for (more, is_known) in cases {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("s.toml"), format!("{scene}{more}")).expect("written");
        let output = |arguments: &[&str]| {
            let output = command(arguments, folder.path()).output().expect("runs");
            assert!(output.status.success(), "{more}: {}", String::from_utf8_lossy(&output.stderr));
            String::from_utf8(output.stdout).expect("text")
        };
        let plan = output(&["plan", "s.toml"]);
        let run = output(&["run", "s.toml", "--out", "o", "--figures", "none", "--no-report", "--json"]);
        let run: serde_json::Value = serde_json::from_str(&run).expect("JSON");
        let share = 100.0 * run["share_swept"].as_f64().expect("a number");
        let predicted = plan.lines().find(|line| line.contains("of the updates"));
        assert_eq!(predicted.is_some(), is_known, "{more}: {plan}");
        let number =
            |line: &str| line.split_whitespace().find_map(|word| word.parse::<f64>().ok()).expect("a number");
        assert!(
            predicted.is_none_or(|line| (number(line) - share).abs() < 0.15 * share + 3.0),
            "{more}: {predicted:?}, {share}"
        );
    }
}
