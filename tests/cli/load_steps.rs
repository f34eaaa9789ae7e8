//! Loads and motions in parts: increments, ramps, and the rows of `load.csv`.

use super::measured::{BAR, LEAD, PULL, SOLVED, bundled, near, number, run, summary, table};
use crate::program::*;

/// Nothing is moved at the end of a way that leads back, and what is left there is no measure of what is left on the way.
#[test]
fn leaders_that_come_back_are_followed_there_and_back_however_the_body_turns() {
    let body = "title = \"back\"\n[lattice]\nkind = \"square\"\nspacing = 0.5\n\
                [body]\nshape = { kind = \"rectangle\", max = [4.0, 1.0] }\n\
                [material]\nkind = \"isotropic\"\nyoung = 100.0\npoisson = 0.3\n\
                [rule]\nmean = { kind = \"material\", rotation = \"corotated\" }\n\
                [stop]\nsteps = 1000\n[equilibrium]\n[load_steps]\n";
    let pulled = "increments = 4\n\
                  [[roles]]\nregion = { kind = \"edge\", side = \"left\" }\nrole = \"clamped\"\naxis = \"x\"\n\
                  [[roles]]\nregion = { kind = \"edge\", side = \"bottom\" }\nrole = \"clamped\"\naxis = \"y\"\n\
                  [[roles]]\nregion = { kind = \"edge\", side = \"right\" }\nrole = \"leader\"\naxis = \"x\"\n\
                  motion = { kind = \"keyframes\", frames = [{ step = 500, displacement = [0.08, 0.0] }, \
                  { step = 1000, displacement = [0.0, 0.0] }] }\n";
    let (folder, _) = run(&[body, pulled], &["--figures", "none"], 0);
    let rows = table(folder.path().join("o/load.csv"));
    // 100 times 1 % on a side of 1 at first, along 4.
    for (name, wanted) in
        [("roles[2].fx", [0.0, 1.0, 2.0, 1.0, 0.0]), ("strain_energy", [0.0, 0.02, 0.08, 0.02, 0.0])]
    {
        let found = &rows[name];
        assert!(
            found.iter().zip(wanted).all(|(&found, wanted)| near(found, wanted, 1.0)),
            "{name}: {found:?}"
        );
    }
    let turned = "increments = 8\n[[roles]]\nregion = { kind = \"boundary\" }\nrole = \"leader\"\n\
                  motion = { kind = \"affine\", rotate = 360.0, about = [1.0, 1.0], steps = 1000 }\n";
    let (folder, _) = run(&[body, turned], &["--figures", "none"], 0);
    let rows = table(folder.path().join("o/load.csv"));
    assert!(rows["von_mises"].iter().all(|&stress| near(stress, 0.0, 1.0)), "{:?}", rows["von_mises"]);
}

#[test]
fn increments_of_a_linear_body_lie_on_a_line_and_a_schedule_comes_back() {
    let (folder, said) = bundled("beam-loaded", &["load_steps={increments=4}"]);
    assert!(said.contains("increment 4"), "{said}");
    let rows = table(folder.path().join("o/load.csv"));
    let sets = ["--set", "load_steps={increments=4}", "--set", "record.probes=[1]"];
    done(
        &[&["run", "beam-loaded", "--out", "p", "--no-report", "--figures", "svg"], &sets[..]].concat(),
        folder.path(),
    );
    let probes = read(folder.path().join("p/probes.svg"));
    assert!(probes.contains(">increment<"), "{probes}");
    assert_eq!(rows["increment"], [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(rows["factor"], [0.0, 0.25, 0.5, 0.75, 1.0]);
    for (name, power) in [
        ("load.fy", 1),
        ("load.displacement", 1),
        ("roles[0].fy", 1),
        ("von_mises", 1),
        ("strain_energy", 2),
        ("work.loads", 2),
    ] {
        let last = rows[name][4];
        assert!(last != 0.0, "{name}");
        for (found, part) in rows[name].iter().zip(&rows["factor"]) {
            assert!(near(*found, last * part.powi(power), last.abs()), "{name} at {part}: {found}");
        }
    }
    let (turned, _) = bundled(
        "beam-loaded",
        &[
            "load_steps={schedule=[0.5, 1.0, 0.5, 0.0]}",
            "rule.mean.rotation=corotated",
            "equilibrium.tolerance=1e-11",
        ],
    );
    let rows = table(turned.path().join("o/load.csv"));
    let by = &rows["load.displacement"];
    assert!(near(by[1], by[3], by[2]) && near(by[4], 0.0, by[2]), "unloading goes the way back: {by:?}");
    assert!(by[2] < 1.98 * by[1], "a bent beam is stiffer: {by:?}");
    for (reaction, load) in rows["roles[0].fy"].iter().zip(&rows["load.fy"]) {
        assert!(near(*reaction, -load, 550.0), "action is reaction: {reaction} {load}");
    }
    assert_eq!(summary(turned.path())["steps"], 4);
}

#[test]
fn work_done_on_the_way_is_the_energy_that_a_body_bent_far_stores() {
    let stored = |scene: &str, sets: &[&str]| {
        let (folder, said) = bundled(scene, sets);
        assert!(said.contains("done on the way by the loads"), "{said}");
        let measured = summary(folder.path())["mechanics"].clone();
        let done = ["loads", "supports"].map(|who| number(&measured["work_done"][who]));
        let rows = table(folder.path().join("o/load.csv"));
        assert!(near(rows["work.loads"].last().copied().expect("a row"), done[0], done[0].abs()));
        assert_eq!((rows["work.loads"][0], rows["work.supports"][0]), (0.0, 0.0));
        (number(&measured["strain_energy"]), done)
    };
    let far = ["lattice.spacing=0.5", "equilibrium.tolerance=1e-10"];
    let off = ["load_steps={increments=10}", "load_steps={increments=20}", "load_steps={increments=40}"].map(
        |parts| {
            let (energy, [loads, supports]) = stored("elastica", &[far[0], far[1], parts]);
            assert!(supports.abs() < 1e-9 * energy, "a clamp does none: {supports}");
            loads / energy - 1.0
        },
    );
    println!("{off:?}");
    assert!(off[0].abs() < 0.03 && off[2].abs() < 0.002, "{off:?}");
    assert!((0..2).all(|k| (off[k] / off[k + 1]).log2() > 1.7), "the trapezoid's order is 2: {off:?}");
    // Led instead of pushed, the supports do it; and what was done is given back.
    let led = [
        far[0],
        far[1],
        "loads=[]",
        "roles=[{ region = { kind = \"edge\", side = \"left\" }, role = \"clamped\" }, \
         { region = { kind = \"edge\", side = \"right\" }, role = \"leader\", \
         motion = { kind = \"velocity\", per_step = [0.0, 6.0] } }]",
    ];
    let (energy, [loads, supports]) =
        stored("elastica", &[&led[..], &["load_steps={increments=40}"]].concat());
    assert!(loads == 0.0 && (supports / energy - 1.0).abs() < 0.005, "{supports} {energy}");
    let back = "load_steps={schedule=[0.2, 0.4, 0.6, 0.8, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0]}";
    let (left, [loads, _]) = stored("elastica", &[far[0], far[1], back]);
    assert!(left.abs() < 1e-9 * energy && loads.abs() < 1e-6 * energy, "{left} {loads}");

    let unloaded =
        |parts: &str| bundled("elastica", &[far[0], far[1], &format!("load_steps={{schedule={parts}}}")]).1;
    assert!(unloaded("[0.2, 1.0, 0.0]").contains("and to zero in a body that gives it back"));
    assert!(!unloaded("[0.2, 1.0, 0.2, 0.0]").contains("the work done on the way, summed up"));
    // Carried about without a strain there is nothing to give back.
    let turned = |side: &str| {
        format!(
            "{{ region = {{ kind = \"edge\", side = \"{side}\" }}, role = \"leader\", \
             motion = {{ kind = \"affine\", about = [0.0, 0.0], rotate = 90.0, steps = 4 }} }}"
        )
    };
    let roles = format!("roles=[{}, {}]", turned("left"), turned("right"));
    let (folder, said) =
        bundled("elastica", &["loads=[]", &roles, "load_steps={increments=4}", "stop.steps=4"]);
    let measured = summary(folder.path())["mechanics"].clone();
    assert!(number(&measured["largest_turn"]) > 1.57 && !said.contains("caution"), "{said}");
    // What the tolerance leaves strains it a little, and works on a long way.
    let roles =
        roles.replace("[0.0, 0.0], rotate = 90.0, steps = 4", "[0.0, 1.0], rotate = 150.0, steps = 1");
    let hexagonal = "lattice={ kind = \"hexagonal\", spacing = 0.5, orientation = 7.0 }";
    let sets = [
        "loads=[]",
        &roles,
        hexagonal,
        "body.shape.max=[20.0, 2.0]",
        "material.poisson=0.3",
        "load_steps={increments=12}",
    ];
    let (folder, said) = bundled("elastica", &sets);
    let measured = summary(folder.path())["mechanics"].clone();
    let done = number(&measured["work_done"]["supports"]);
    assert!(done > 1e3 * number(&measured["strain_energy"]) && !said.contains("caution"), "{done}: {said}");
}

#[test]
fn a_body_that_turns_is_the_same_in_any_unit() {
    let in_units = |length: f64, stress: f64| {
        let sets = [
            format!("lattice.spacing={:e}", 0.25 * length),
            format!("body.shape.max=[{:e},{length:e}]", 20.0 * length),
            format!("material.thickness={length:e}"),
            format!("material.young={:e}", 1000.0 * stress),
            format!("loads[0].traction=[0.0,{:e}]", 2.0 * stress),
            "record.places=[]".to_owned(),
        ];
        let (folder, _) = bundled("elastica", &sets.each_ref().map(String::as_str));
        let summary = summary(folder.path());
        let largest = number(&summary["mechanics"]["largest_von_mises"]["von_mises"]);
        [number(&summary["energies"]["largest_strain"]), largest / stress]
    };
    let expected = in_units(1.0, 1.0);
    for (length, stress) in [(1e-100, 1.0), (1e100, 1.0), (1.0, 1e-170), (1.0, 1e170)] {
        let found = in_units(length, stress);
        let are_near = (0..2).all(|k| (found[k] / expected[k] - 1.0).abs() < 1e-9);
        assert!(are_near, "{length:e}, {stress:e}: {found:?}, {expected:?}");
    }
}

#[test]
fn a_schedule_that_ends_with_the_whole_load_ends_where_the_load_at_once_does() {
    let sets = ["rule.mean.rotation=corotated", "equilibrium.tolerance=1e-10"];
    let (at_once, _) = bundled("beam-loaded", &sets);
    let (in_parts, _) =
        bundled("beam-loaded", &[sets[0], sets[1], "load_steps={schedule=[0.3, 0.1, 0.8, 1.0]}"]);
    let [at_once, in_parts] = [at_once, in_parts].map(|folder| table(folder.path().join("o/final.csv")));
    for (a, b) in at_once["y"].iter().zip(&in_parts["y"]) {
        assert!((a - b).abs() < 1e-7, "{a} {b}");
    }
}

#[test]
fn a_load_follows_the_steps_of_a_sweep_and_leaders_are_measured_on_their_way() {
    let steps = "[stop]\nsteps = 400\n[load_steps]\nramp = { steps = 200 }\nevery = 50\n";
    let (folder, _) = run(&[BAR, PULL, steps], &["--figures", "none"], 0);
    let rows = table(folder.path().join("o/load.csv"));
    assert!(rows.values().flatten().all(|&value| value != 0.0 || value.is_sign_positive()), "{rows:?}");
    assert_eq!(rows["step"], [0.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0]);
    assert_eq!(rows["factor"], [0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 1.0, 1.0]);
    assert!(near(rows["load.fx"][2], 50.0, 100.0) && near(rows["load.fx"][8], 100.0, 100.0), "{rows:?}");
    // What is not yet at rest is said to be so: the clamp has not heard of the whole load.
    let (reaction, left) =
        (rows["roles[0].fx"][8], number(&summary(folder.path())["mechanics"]["unbalanced"]));
    assert!(reaction > -100.0 && left > 0.0, "{reaction} {left}");
    let (folder, _) = run(&[BAR, LEAD, "[load_steps]\nevery = 5\n"], &["--figures", "none"], 0);
    let rows = table(folder.path().join("o/load.csv"));
    assert!(rows["step"].len() == 3 && near(rows["roles[1].ux"][1], 0.002, 0.002), "{rows:?}");
}

#[test]
fn load_steps_that_make_no_sense_are_refused_by_name() {
    let refused = |parts: &[&str], words: &[&str]| {
        let (_folder, said) = run(parts, &[], 2);
        for word in words {
            assert!(said.contains(word), "no `{word}` in\n{said}");
        }
    };
    let steps = |keys: &str| format!("[load_steps]\n{keys}\n");
    refused(&[BAR, PULL, SOLVED, &steps("ramp = { steps = 3 }")], &["load_steps.ramp", "increments"]);
    refused(&[BAR, PULL, SOLVED, &steps("")], &["gives no parts", "increments = 10"]);
    refused(&[BAR, PULL, SOLVED, &steps("increments = 3\nschedule = [1.0]")], &["both", "either"]);
    refused(
        &[BAR, PULL, SOLVED, &steps("schedule = [0.5, 1.5]")],
        &["load_steps.schedule[1]", "from 0 to 1"],
    );
    refused(&[BAR, PULL, SOLVED, &steps("schedule = []")], &["load_steps.schedule"]);
    refused(&[BAR, PULL, SOLVED, &steps("increments = 0")], &["load_steps.increments"]);
    refused(&[BAR, PULL, &steps("increments = 3")], &["load_steps.increments", "add [equilibrium]"]);
    refused(&[BAR, PULL, &steps("ramp = { steps = 3000 }")], &["load_steps.ramp.steps", "stop.steps"]);
    refused(&[BAR, LEAD, &steps("ramp = { steps = 3 }")], &["no load that could grow", "every"]);
    refused(&[BAR, PULL, &steps("")], &["says nothing", "every"]);
    let folder = temporary();
    refused_in(&["run", "tension", "--set", "load_steps={every=5}"], folder.path(), &["add [material]"]);
}

#[test]
fn a_body_that_finds_no_rest_under_more_load_keeps_what_it_had() {
    let sets = ["rule.mean.rotation=corotated", "loads[0].traction=[0.0, 1e7]"];
    let parts = "load_steps={schedule=[1e-6, 1.0]}";
    let folder = temporary();
    let mut arguments = vec!["run", "beam-loaded", "--out", "o", "--no-report", "--figures", "none"];
    sets.iter().chain([&parts]).for_each(|set| arguments.extend(["--set", set]));
    let said = failed(&arguments, folder.path());
    assert!(said.contains("increment 1,") && said.contains("not at 1 of the load"), "{said}");
    assert_eq!(summary(folder.path())["stop_reason"], "stuck");
    assert_eq!(table(folder.path().join("o/load.csv"))["factor"], [0.0, 1e-6]);
}

#[test]
fn loads_that_an_action_puts_on_have_columns_from_the_beginning() {
    let late = |loads: &[&str]| {
        let loads = loads.join(",");
        format!("[[actions]]\nat = 3\nwhat = {{ kind = \"set\", keys = [\"loads=[{loads}]\"] }}\n")
    };
    let pull = "{kind='traction',region={kind='edge',side='right'},traction=[50e3,0.0]}";
    let steps = "[stop]\nsteps = 4\n[load_steps]\nevery = 2\n";
    let rows = |loads: &[&str]| {
        let (folder, _) = run(&[BAR, &late(loads), steps], &["--figures", "none"], 0);
        table(folder.path().join("o/load.csv"))
    };
    let one = rows(&[pull]);
    assert!(
        one["load.fx"][0].is_nan() && one["load.fx"][1].is_nan() && near(one["load.fx"][2], 100.0, 100.0)
    );
    assert!(!one.contains_key("loads[0].fx"), "{one:?}");
    let two = rows(&[pull, "{kind='body',force=[0.0,-1e3]}"]);
    assert!(near(two["loads[0].fx"][2], 100.0, 100.0) && near(two["loads[1].fy"][2], -8.0, 8.0), "{two:?}");
}

#[test]
fn what_feedback_holds_is_not_laid_at_the_door_of_the_tolerance() {
    let tied = "feedback = { factor = -0.5, reference = \"initial\" }\n";
    let (folder, said) = run(
        &[&BAR.replace("[[roles]]", &format!("{tied}[[roles]]")), LEAD, SOLVED],
        &["--figures", "none"],
        0,
    );
    assert!(said.contains("what feedback from the initial place holds: an unbalanced force"), "{said}");
    let cautions = summary(folder.path())["cautions"].to_string();
    assert!(cautions.contains("feedback from the initial place ties each particle"), "{cautions}");
    let back = tied.replace("-0.5", "-1.0");
    let (_, said) = run(&[&BAR.replace("[[roles]]", &format!("{back}[[roles]]")), LEAD, SOLVED], &[], 2);
    assert!(said.contains("rule.feedback.factor") && said.contains("no follower ever moves"), "{said}");
}
