//! What `plan` and `run` warn of: scenes that are taken, and do not do what they seem to ask for.

use std::path::Path;

use crate::program::*;

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

/// A strip of 40 spacings: at 1e-3 its middle has come a seventh of its way.
#[test]
fn a_rule_without_forces_that_stops_far_from_rest_is_warned_of() {
    let folder = temporary();
    let text = "title = 'strip'\nlattice = { kind = 'square', spacing = 1.0 }\nbody.shape = { kind = 'rectangle', max = [40.0, 2.0] }\n\
                stop = { steps = 50000, tolerance = 1e-3 }\n\
                roles = [{ region = { kind = 'edge', side = 'left' }, role = 'clamped' },\n\
                { region = { kind = 'edge', side = 'right' }, role = 'leader', motion = { kind = 'keyframes', frames = [{ step = 1, \
                displacement = [0.5, 0.0] }] } }]";
    std::fs::write(folder.path().join("strip.toml"), text).expect("written");
    let run = ["run", "strip.toml", "--no-report", "--figures", "none", "--force", "--out", "o"];
    for order in ["synchronous", "sequential"] {
        let of = |tolerance: &str| {
            let (order, tolerance) = (format!("update.order={order}"), format!("stop.tolerance={tolerance}"));
            done(&[&run[..], &["--set", &order, "--set", &tolerance]].concat(), folder.path())
        };
        let short = of("1e-3");
        let words =
            ["no move beyond stop.tolerance", "caution: nothing moves farther", "or more are left to go"];
        assert!(words.iter().all(|words| short.contains(words)), "{order}: {short}");
        let at_rest = of("1e-7");
        assert!(at_rest.contains("in equilibrium") && !at_rest.contains("caution"), "{order}: {at_rest}");
    }
}
