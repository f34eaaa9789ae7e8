//! `flockform run`, `scenes`, `plan`, `schema`, `trade` and `bench`, and what they refuse.

use std::path::Path;
use std::time::Duration;

use crate::program::*;

/// As [`refused`] for a scene that is the bundled one with overrides.
fn refused_with(scene: &str, overrides: &[&str], words: &[&str]) {
    let mut arguments = vec!["run", scene];
    overrides.iter().for_each(|set| arguments.extend(["--set", set]));
    refused(&arguments, words);
}

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

#[cfg(unix)]
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
fn a_missing_scene_is_refused_with_the_nearest_name() {
    refused(&["run", "tensoin"], &["no bundled scene `tensoin`", "`tension`", "flockform list scenes"]);
    refused(&["run", "scenes/nowhere.toml"], &["scenes/nowhere.toml", "cannot be read"]);
    refused(&["plan", "fractur"], &["`fracture`"]);
    let both =
        ["no scene or swarm file", "bundled swarm is `square`", "list scenes` and `flockform list swarms`"];
    refused(&["live", "sqare"], &both);
}

#[test]
fn a_misspelt_key_is_refused_with_line_and_nearest_key() {
    let folder = temporary();
    let path = folder.path().join("mine.toml");
    let scene = "title = \"t\"\n[lattice]\nkind = \"square\"\nspcaing = 1.0\n[body]\nshape = { kind = \"grid\", columns = 3, rows = 3 }\n";
    std::fs::write(&path, scene).expect("written");
    let path = path.display().to_string();
    refused(&["run", &path], &["mine.toml:4", "spcaing", "`spacing`"]);
}

#[test]
fn values_out_of_range_are_refused_with_the_range() {
    refused_with("tension", &["lattice.spacing=-1.0"], &["--set lattice.spacing=-1.0", "greater than 0"]);
    refused_with("tension", &["lattice.spacing=nan"], &["finite"]);
    refused_with("tension", &["roles[1].motion.per_step=[0.6, inf]"], &["finite"]);
    refused_with("tension", &["update.damping=0"], &["greater than 0"]);
    refused_with("tension", &["update.damping=2.5"], &["2"]);
    refused_with("lattice-oblique", &["lattice.angle=180"], &["less than 180"]);
    refused_with("lattice-oblique", &["lattice.angle=1e-5"], &["million times"]);
    refused_with("tension", &["body.shape.columns=0"], &["body.shape.columns", "1"]);
    refused_with("fracture", &["fracture.distance=0"], &["greater than 0"]);
    refused_with("tension", &["stop.steps=0"], &["stop.steps"]);
}

#[test]
fn wrong_choices_are_refused_with_the_choices() {
    refused_with("tension", &["lattice.kind=sqare"], &["did you mean \"square\""]);
    refused_with("tension", &["frame=laged"], &["did you mean \"lagged\""]);
    refused_with("tension", &["roles[0].role=ghots"], &["did you mean \"ghost\""]);
    refused_with("tension", &["lattice={kind=\"square\",spacing=1.0,a=2.0}"], &["a"]);
}

#[test]
fn cuts_on_the_way_are_refused_where_cuts_from_the_start_are() {
    let cut = "{at=2,what={kind=\"cut\",from=[6.5,-5.0],to=[6.5,20.0]}}";
    let alone = format!("actions=[{cut}]");
    refused_with("drop", &[&alone], &["actions", "cannot go with neighbours that are found anew"]);
    refused_with("beam-loaded", &[&alone], &["actions", "not in bonds that could be cut"]);
    let material = "material={kind=\"isotropic\",young=1000.0,poisson=0.33}";
    let then = "{at=3,what={kind=\"set\",keys=[\"rule.mean={kind=\\\"material\\\"}\"]}}";
    let both = format!("actions=[{cut},{then}]");
    let overrides = ["frame=none", "neighbours={kind=\"chebyshev\",radius=1}", material, &both];
    refused_with("tension", &overrides, &["actions[1].what.keys", "not in bonds that could be cut"]);
}

#[test]
fn a_body_that_cannot_be_is_refused_with_the_remedy() {
    refused_with(
        "tension",
        &["body.shape={kind=\"disc\",radius=0.1}", "body.anchor=[0.5,0.5]", "roles=[]", "record={}"],
        &["holds no lattice site", "smaller spacing"],
    );
    refused_with(
        "shear",
        &[
            "body={shape={kind=\"rectangle\",max=[20,20]},holes=[{kind=\"rectangle\",min=[-1,5.5],max=[21,9.5]}]}",
        ],
        &["body.shape", "parts", "not connected"],
    );
    refused_with("tension", &["body.shape={kind=\"rectangle\",min=[4,4],max=[1,9]}"], &["max", "min"]);
    refused_with(
        "tension",
        &["lattice.spacing=1e-9", "body.shape={kind=\"disc\",radius=9.0}"],
        &["more than"],
    );
}

#[test]
fn regions_roles_and_probes_that_miss_the_body_are_refused() {
    refused_with(
        "tension",
        &["roles[0].region={kind=\"box\",min=[90,90],max=[99,99]}"],
        &["roles[0].region", "no particle", "spans"],
    );
    refused_with(
        "tension",
        &["roles[0].region={kind=\"ids\",ids=[9999]}"],
        &["no particle 9999", "1 to 144"],
    );
    refused_with("tension", &["roles[0].region={kind=\"ids\",ids=[1]}"], &["belongs to the frame"]);
    refused_with("tension", &["record.probes=[0]"], &["record.probes[0]", "at least 1"]);
    refused_with(
        "tension",
        &["record.probes=[1,99999]"],
        &["record.probes[1]", "no particle 99999", "help:"],
    );
    refused_with("tension", &["roles[0].role=leader"], &["a leader needs a motion"]);
    refused_with(
        "tension",
        &["roles[2].motion={kind=\"velocity\",per_step=[1,0]}"],
        &["has no motion of its own"],
    );
    refused_with("tension", &["roles[2].when={quantity=\"pe1\"}"], &["no bound", "above"]);
    let never = "roles[2].when={quantity=\"x\",above=4,below=4}";
    refused_with("tension", &[never], &["roles[2].when.above", "above 4 and below 4", "lower bound"]);
}

#[test]
fn rules_that_contradict_themselves_are_refused() {
    refused_with("tension", &["neighbours={kind=\"first\",keep=9}"], &["4 first neighbours"]);
    refused_with("lattice-honeycomb", &["neighbours={kind=\"chebyshev\",radius=1}"], &["honeycomb"]);
    refused_with("lattice-hexagonal", &["neighbours={kind=\"offsets\",offsets=[[1,0]]}"], &["no site"]);
    refused_with("tension", &["rule.weights={kind=\"list\",values=[1,1,-1,-1]}"], &["add up to 0"]);
    let huge = "rule.weights={kind=\"list\",values=[1e308,1e308,1e308,1e308]}";
    refused_with("tension", &[huge], &["too large", "smaller"]);
    let steep = ["rule.weights={kind=\"distance\",power=3000}", "neighbours={kind=\"chebyshev\",radius=1}"];
    refused_with("tension", &steep, &["rule.weights.power", "add up to inf", "nearer to 0"]);
    let own = "neighbours={kind=\"offsets\",offsets=[[1,0],[0,0]]}";
    refused_with("tension", &[own], &["neighbours.offsets[1]", "not its own neighbour"]);
    refused_with("tension", &["unit=\"\""], &["unit", "at least 1 character"]);
    refused_with("tension", &["rule.weights={kind=\"list\",values=[1,1]}"], &["2 weights", "4 neighbours"]);
    refused_with("tension", &["rule.mean={kind=\"power\",exponent=0}"], &["geometric"]);
    refused_with("drop", &["frame=lagged"], &["found anew at every step"]);
    refused_with("fracture", &["fracture.stretch=1.5"], &["both a distance and a stretch"]);
    refused_with(
        "shear",
        &["roles[1].motion.frames=[{step=9,displacement=[1,0]},{step=3,displacement=[2,0]}]"],
        &["ascending"],
    );
}

#[test]
fn feedback_that_leaves_no_place_of_rest_is_named() {
    let roles = "roles=[{region={kind='edge',side='left'},role='clamped'},{region={kind='edge',side='right'},\
                 role='leader',motion={kind='velocity',per_step=[0.1,0]}}]";
    for (factor, why) in [("-1", "no follower ever moves"), ("0.8", "stretches"), ("-2.5", "stretches")] {
        let factor = format!("rule.feedback={{factor={factor}}}");
        let keys = [roles, &factor, "frame=none", "record={}", "equilibrium={}"];
        refused_with("tension", &keys, &["rule.feedback.factor", why, "between -1 and 0"]);
    }
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
fn overrides_that_cannot_be_placed_are_refused() {
    refused_with("tension", &["lattice.spacing"], &["--set lattice.spacing", "="]);
    refused_with("tension", &["roles[9].role=follower"], &["roles"]);
    refused_with("tension", &["title.more=1"], &["title"]);
}

#[test]
fn a_broken_displacement_file_is_refused_with_its_line() {
    let csv = "roles[1].motion={kind=\"csv\",file=\"FILE\"}";
    refused_with(
        "tension",
        &[&csv.replace("FILE", "nowhere.csv")],
        &["nowhere.csv", "relative to the scene file"],
    );
    let folder = temporary();
    let path = folder.path().join("led.csv");
    std::fs::write(&path, "id,ux,uy\n1,oops,0\n").expect("written");
    let path = path.display().to_string();
    refused_with("tension", &[&csv.replace("FILE", &path)], &["line 2", "oops", "not a finite number"]);
    std::fs::write(&path, "id,ux,uy\n1,0,0\n").expect("written");
    refused_with("tension", &[&csv.replace("FILE", &path)], &["no row for particle 122"]);
}

#[test]
fn old_names_are_refused_with_the_new_ones() {
    refused(&["scenes"], &["`list scenes`"]);
    refused(&["trade", "grips", "--most-particles", "9"], &["`--max-particles`"]);
    refused(&["run", "tension", "--set", "stop.growth=9"], &["`divergence_ratio`"]);
    refused(&["run", "tension", "--set", "neighbours={ kind = 'ring', radius = 1 }"], &["\"chebyshev\""]);
}

#[test]
fn unknown_arguments_are_refused() {
    refused(&["run"], &["SCENE"]);
    refused(&["fly"], &["fly"]);
    refused(&["run", "tension", "--threads", "0"], &["--threads"]);
    refused(&["run", "tension", "--steps", "-3"], &["-3"]);
    let both = ["run", "tension", "--steps", "3", "--set", "stop.steps=2"];
    refused(&both, &["--steps", "`--set stop.steps=2`", "leave one of the two out"]);
}

#[test]
fn an_output_that_cannot_be_written_is_refused() {
    let folder = temporary();
    std::fs::write(folder.path().join("file"), "").expect("written");
    refused_in(&["run", "tension", "--out", "file"], folder.path(), &["is no folder"]);
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
    let said = done(&["plan", "tension", "--set", "rule.mean={kind=\"distance\"}"], folder.path());
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

/// What `plan` and `run` say of a bundled scene with these arguments.
fn said_by_plan_and_run(scene: &str, set: &[&str], folder: &Path) -> [String; 2] {
    let run = ["run", scene, "--no-report", "--figures", "none", "--out", "o"];
    [&["plan", scene][..], &run].map(|command| done(&[command, set].concat(), folder))
}

#[test]
fn what_comes_after_the_last_step_is_warned_of_by_the_plan_and_the_run() {
    let folder = temporary();
    let set = [
        "stop.steps=25",
        "roles[1].from=99999",
        "record.figures=[2, 25, 26, 100000]",
        "actions=[{ at = 3, what = { kind = \"cut\", from = [0, 0], to = [1, 1] } },\
         { at = 2000, what = { kind = \"cut\", from = [0, 0], to = [1, 1] } }]",
    ];
    let set: Vec<&str> = set.iter().flat_map(|text| ["--set", *text]).collect();
    let words = "caution: beyond the last step, 25, and without effect: roles[1].from = 99999, actions[1].at = 2000, \
                 record.figures[2] = 26, record.figures[3] = 100000; lower them, or raise stop.steps\n";
    said_by_plan_and_run("tension", &set, folder.path())
        .iter()
        .for_each(|said| assert!(said.contains(words), "{said}"));
    let parts = ["--set", "load_steps={ increments = 4 }", "--set", "record.figures=[4, 5]"];
    let said = done(&[&["plan", "elastica"][..], &parts].concat(), folder.path());
    assert!(
        said.contains("beyond the last increment, 4, and without effect: record.figures[1] = 5;"),
        "{said}"
    );
}

#[test]
fn keys_of_steps_that_an_equilibrium_does_not_take_are_warned_of_by_the_plan_and_the_run() {
    let folder = temporary();
    let set = [
        "update={ order = \"sequential\", damping = 0.3 }",
        "stop={ steps = 7, tolerance = 1e-3 }",
        "record={ figures = [3, 7], vtk_every = 5 }",
    ];
    let set: Vec<&str> = set.iter().flat_map(|text| ["--set", *text]).collect();
    let words = "caution: without effect on an equilibrium that is solved for: update.order, update.damping, stop.tolerance, \
                 record.figures[0] = 3; leave [equilibrium] out to step\n";
    let said = said_by_plan_and_run("bar", &set, folder.path());
    said.iter().for_each(|said| assert!(said.contains(words), "{said}"));
    assert!(said[0].contains("a ParaView file of the equilibrium"), "{}", said[0]);
    let said = done(&["plan", "bar", "--set", "record.probes=[1]"], folder.path());
    assert!(said.contains("solved for: record.probes; leave"), "{said}");
    assert!(!done(&["plan", "bar"], folder.path()).contains("without effect"));
}

/// What `run` alone says of a bundled scene with these keys set.
fn said_by_run(scene: &str, set: &[&str]) -> String {
    let set: Vec<&str> = set.iter().flat_map(|text| ["--set", *text]).collect();
    let folder = temporary();
    let run = ["run", scene, "--no-report", "--figures", "none", "--out", "o"];
    done(&[&run, &set[..]].concat(), folder.path())
}

#[test]
fn means_that_run_away_are_warned_of_by_the_plan_and_the_run() {
    let torn = [
        "rule.mean={ kind = \"geometric\" }",
        "fracture={ stretch = 5.0, ghosts = \"mirrored\" }",
        "stop.steps=5",
        "frame=\"none\"",
        "record.probes=[]",
    ];
    let anew = [
        "neighbours={ kind = \"dynamic\", radius = 1.5 }",
        "frame=\"none\"",
        "record.probes=[]",
        "stop.steps=5",
    ];
    for (set, words) in [
        (&torn[..], "fracture.ghosts = \"mirrored\" with a geometric mean"),
        (&anew[..], "of all particles in range keeps no distance"),
    ] {
        let set: Vec<&str> = set.iter().flat_map(|text| ["--set", *text]).collect();
        for said in said_by_plan_and_run("tension", &set, temporary().path()) {
            assert!(said.contains(words), "{said}");
        }
    }
}

#[test]
fn a_sweep_that_grows_is_warned_of_before_it_diverges_and_one_that_rests_is_not() {
    let grown = ["rule.feedback={ factor = 0.2 }", "stop.steps=45", "frame=\"none\"", "record.probes=[]"];
    let said = said_by_run("tension", &grown);
    assert!(said.contains("the sweep grows from step to step: feedback factor 0.2"), "{said}");
    assert!(said.contains("once |1 + factor| times its spectral radius exceeds 1"), "{said}");
    let at_rest = [
        "rule.feedback={ factor = 0.002, reference = \"previous\" }",
        "stop={ steps = 20000, tolerance = 1e-9 }",
        "frame=\"none\"",
        "record.probes=[]",
    ];
    let said = said_by_run("tension", &at_rest);
    assert!(said.contains("in equilibrium") && !said.contains("diverge"), "{said}");
    assert!(!said_by_run("tension", &["frame=\"none\"", "record.probes=[]"]).contains("grows"));
}

#[test]
fn cuts_that_miss_the_body_are_warned_of_by_the_plan_and_the_run() {
    let folder = temporary();
    let set = [
        "stop.steps=5",
        "cuts=[{ from = [6.5, -5.0], to = [6.5, 3.0] }, { from = [90.0, 90.0], to = [91.0, 91.0] }]",
        "actions=[{ at = 2, what = { kind = \"cut\", from = [3.5, -5.0], to = [3.5, 3.0] } },\
         { at = 3, what = { kind = \"cut\", from = [90.0, 90.0], to = [91.0, 91.0] } }]",
    ];
    let set: Vec<&str> = set.iter().flat_map(|text| ["--set", *text]).collect();
    let unless = "the cut of actions[1] where the body begins: without effect unless the body has moved there by step 3\n";
    let idle = "no bond crosses the cut of actions[1], which is without effect: lay it through the body\n";
    for (said, of_action) in said_by_plan_and_run("tension", &set, folder.path()).iter().zip([unless, idle]) {
        assert!(said.contains("caution: no bond crosses cuts[1], which is without effect"), "{said}");
        assert!(said.contains(of_action), "{said}");
        let cautions = said.lines().filter(|line| line.starts_with("caution"));
        let others: Vec<_> =
            cautions.filter(|line| line.contains("cuts[0]") || line.contains("actions[0]")).collect();
        assert!(others.is_empty(), "{others:?}");
    }
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
