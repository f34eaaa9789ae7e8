//! What a testing machine would read off a run: reactions and stress; and which figures are drawn.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::program::*;

/// A bar of 4 x 2 m that is pulled to the right; without contraction, so that the clamped end does not disturb.
pub(super) const BAR: &str = r#"
title = "A bar under tension"
unit = "m"
stress_unit = "Pa"
[lattice]
kind = "square"
spacing = 0.5
[body]
shape = { kind = "rectangle", min = [0.0, 0.0], max = [4.0, 2.0] }
[material]
kind = "isotropic"
young = 210e9
poisson = 0.0
thickness = 1e-3
[rule]
mean = { kind = "material" }
[[roles]]
region = { kind = "edge", side = "left" }
role = "clamped"
"#;

pub(super) const PULL: &str = r#"
[[loads]]
kind = "traction"
region = { kind = "edge", side = "right" }
traction = [50e3, 0.0]
"#;

/// The right end is led by 0.004 m instead, a strain of 1e-3.
pub(super) const LEAD: &str = r#"
[[roles]]
region = { kind = "edge", side = "right" }
role = "leader"
motion = { kind = "keyframes", frames = [{ step = 10, displacement = [0.004, 0.0] }] }
[stop]
steps = 10
"#;

pub(super) const SOLVED: &str = "[equilibrium]\nsolver = \"direct\"\n";

/// Runs a scene of these parts without figures, which must end with this exit code; what it said, and its folder.
pub(super) fn run(parts: &[&str], more: &[&str], code: i32) -> (tempfile::TempDir, String) {
    let folder = temporary();
    std::fs::write(folder.path().join("bar.toml"), parts.concat()).expect("written");
    let arguments = [&["run", "bar.toml", "--out", "o", "--no-report"][..], more].concat();
    let output = flockform(&arguments, folder.path());
    let said = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    (folder, said)
}

pub(super) fn bundled(scene: &str, sets: &[&str]) -> (tempfile::TempDir, String) {
    let folder = temporary();
    let mut arguments = vec!["run", scene, "--out", "o", "--no-report", "--figures", "none"];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    let said = done(&arguments, folder.path());
    (folder, said)
}

pub(super) fn summary(folder: &Path) -> Value {
    json_in(&folder.join("o/summary.json"))
}

pub(super) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// The columns of a table by name; what is empty is NaN.
pub(super) fn table(path: PathBuf) -> HashMap<String, Vec<f64>> {
    let mut reader = csv::Reader::from_path(path).expect("readable");
    let names: Vec<String> = reader.headers().expect("a header").iter().map(str::to_owned).collect();
    let mut columns: HashMap<String, Vec<f64>> =
        names.iter().map(|name| (name.clone(), Vec::new())).collect();
    for row in reader.records() {
        for (name, text) in names.iter().zip(row.expect("a row").iter()) {
            columns.get_mut(name).expect("a column").push(text.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

pub(super) fn near(found: f64, expected: f64, size: f64) -> bool {
    (found - expected).abs() <= 1e-8 * size
}

#[test]
fn the_clamp_of_the_loaded_beam_returns_force_and_moment_of_the_load_and_the_energy_is_half_the_work() {
    let (folder, said) = bundled("beam-loaded", &[]);
    let measured = summary(folder.path())["mechanics"].clone();
    let (reaction, load) = (&measured["reactions"][0], &measured["load"]);
    assert_eq!((&reaction["key"], &reaction["role"]), (&"roles[0]".into(), &"clamped".into()));
    for (k, expected) in [(0, 0.0), (1, 550.0)] {
        assert!(near(number(&load["force"][k]), expected, 550.0), "{load}");
        assert!(near(number(&reaction["force"][k]), -expected, 550.0), "{reaction}");
    }
    // Half of the beam's 11 on either side of its middle height, the load 11 from the clamp, 21 from the origin.
    assert!(near(number(&load["moment_about_origin"]), 550.0 * 21.0, 11550.0), "{load}");
    assert!(near(number(&reaction["moment_about_origin"]), -550.0 * 21.0, 11550.0), "{reaction}");
    assert!(near(number(&reaction["moment"]), -550.0 * 11.0, 6050.0), "{reaction}");
    let (energy, work) = (number(&measured["strain_energy"]), number(&measured["work"]["loads"]));
    assert!(energy > 0.0 && near(2.0 * energy, work, work), "{energy} {work}");
    assert_eq!(number(&measured["work"]["supports"]), 0.0);
    assert!(number(&measured["unbalanced"]) < 1e-6);
    for words in ["reactions, force [unit of young × m²]", "roles[0] (clamped, 12 particles)  (0, -550.00)"]
    {
        assert!(said.contains(words), "no `{words}` in\n{said}");
    }
    // A third of strain is not small.
    let cautions = summary(folder.path())["cautions"].clone();
    assert!(
        cautions[0].as_str().is_some_and(|caution| caution.contains("strains of up to 30 %")),
        "{cautions}"
    );
    assert!(said.contains("caution: strains of up to 30 %"), "{said}");
}

#[test]
fn strains_that_are_not_small_are_a_caution_under_large_rotations_too() {
    let corotated = BAR.replace("kind = \"material\"", "kind = \"material\", rotation = \"corotated\"");
    let [well, too_far] = ["18e9", "42e9"].map(|traction| PULL.replace("50e3", traction));
    let (_, said) = run(&[&corotated, &well, "[equilibrium]\n"], &["--figures", "none"], 0);
    assert!(!said.contains("caution"), "{said}");
    let (_, said) = run(&[&corotated, &too_far, "[equilibrium]\n"], &["--figures", "none"], 0);
    assert!(said.contains("caution: strains of up to 20 % under rotation = \"corotated\""), "{said}");
    let beyond_all = PULL.replace("50e3", "1e200");
    let (_, said) = run(&[BAR, &beyond_all, SOLVED], &["--figures", "none"], 1);
    assert!(said.contains("caution: strains of up to 4.8e190 %"), "{said}");
}

#[test]
fn a_body_that_moves_slowly_is_not_said_to_be_in_equilibrium() {
    let swept = |tolerance: &str| {
        let stop = format!(
            "[stop]\nsteps = 100000\ntolerance = {tolerance}\n[load_steps]\nramp = {{ steps = 500 }}\n"
        );
        let (folder, said) = run(&[BAR, PULL, &stop], &["--figures", "none"], 0);
        (summary(folder.path())["cautions"].clone(), said)
    };
    let (cautions, said) = swept("1e-9");
    let caution = cautions[0].as_str().expect("a caution");
    assert!(
        caution.contains("of the loads are not in balance") && caution.contains("stop.tolerance"),
        "{caution}"
    );
    assert!(said.contains("no move beyond stop.tolerance") && !said.contains("in equilibrium"), "{said}");
    let (cautions, said) = swept("1e-14");
    assert!(cautions.is_null() && said.contains("in equilibrium"), "{said}");
}

#[test]
fn a_place_outside_the_shape_is_refused_and_one_between_it_and_its_cells_is_not() {
    let hole = "shape = { kind = \"rectangle\", min = [0.0, 0.0], max = [4.0, 2.0] }\n\
                holes = [{ kind = \"disc\", centre = [2.0, 1.0], radius = 0.6 }]";
    let (shape, _) = hole.split_once('\n').expect("two lines");
    let pierced = BAR.replace(shape, hole).replace("spacing = 0.5", "spacing = 0.2");
    let staircase = pierced.replace("holes =", "outline = \"lattice\"\nholes =");
    let at = |body: &str, place: &str, code| {
        let places = format!("[record]\nplaces = [{place}]\n");
        run(&[body, PULL, SOLVED, &places], &["--figures", "none"], code).1
    };
    for (body, place) in
        [(BAR, "[4.4, 1.0]"), (&pierced, "[4.0, 2.01]"), (&pierced, "[2.5, 1.0]"), (&staircase, "[2.5, 1.0]")]
    {
        let said = at(body, place, 2);
        assert!(said.contains("record.places[0]") && said.contains("outside the body"), "{place}: {said}");
    }
    // On the hole's edge, which chords cut off, as far as it is written; and where the staircase leaves cells out.
    for (body, place) in [(BAR, "[4.0, 1.0]"), (&pierced, "[2.4242, 1.4242]"), (&staircase, "[2.45, 1.45]")] {
        assert!(at(body, place, 0).contains("moved by"), "{place}");
    }
}

#[test]
fn a_solve_that_rounding_ends_names_stiffnesses_that_are_far_apart() {
    let stiff = "[[body.inclusions]]\nshape = { kind = \"disc\", centre = [2.0, 1.0], radius = 0.6 }\n\
                 material = { kind = \"isotropic\", young = 210e24, poisson = 0.0, thickness = 1e-3 }\n";
    let fine = BAR.replace("spacing = 0.5", "spacing = 0.2");
    let (_, said) = run(&[&fine, stiff, PULL, "[equilibrium]\n"], &["--figures", "none"], 1);
    assert!(said.contains("short of its tolerance"), "{said}");
    assert!(said.contains("the stiffest material is 1e15 times as stiff"), "{said}");
    // Listed again, it covers itself.
    let (_, said) = run(&[&fine, stiff, stiff, PULL, "[equilibrium]\n"], &["--figures", "none"], 2);
    assert!(said.contains("inclusions[0]") && said.contains("later entries cover all of it"), "{said}");
}

#[test]
fn regions_and_changes_that_cannot_be_name_the_reason() {
    let refused = |more: &str| run(&[BAR, more], &["--figures", "none"], 2).1;
    let loaded = |region: &str| {
        refused(&format!(
            "[[loads]]\nkind = \"pressure\"\nregion = {{ kind = \"outline\", {region} }}\npressure = 1.0\n"
        ))
    };
    let said = loaded("hole = 1");
    assert!(said.contains("the body has no holes\n  help: leave it out"), "{said}");
    let said = loaded("angles = [0.0, 90.0]");
    assert!(said.contains("region.angles = [0.0, 90.0]: there are no arcs"), "{said}");
    let set =
        |keys: &str| refused(&format!("[[actions]]\nat = 5\nwhat = {{ kind = \"set\", keys = [{keys}] }}\n"));
    let said = set("\"material.poisson=0.7\"");
    assert!(said.contains("above a Poisson's ratio of 0.4 (2/3 in plane stress)"), "{said}");
}

/// A strip 10,000 times as long as high is bent by two thirds of what it should be where all is computed from one stiffness in doubles.
#[test]
fn an_equilibrium_that_rounding_holds_is_a_caution() {
    let strip = |length: f64, rotation: &str, code: i32| {
        let set = [
            &format!("body.shape={{ kind = \"rectangle\", max = [{length:?}, 1.0] }}"),
            "lattice.spacing=1.0",
            "material={ kind = \"isotropic\", young = 1000.0, poisson = 0.0 }",
            "loads=[{ kind = \"traction\", region = { kind = \"edge\", side = \"right\" }, traction = [0.0, 9.375e-8] }]",
            &format!("rule.mean={{ kind = \"material\", rotation = \"{rotation}\" }}"),
        ];
        let set: Vec<&str> = set.iter().flat_map(|text| ["--set", *text]).collect();
        let asked = "[equilibrium]\nsolver = \"direct\"\n";
        run(&[BAR, PULL, asked], &[&["--figures", "none"], &set[..]].concat(), code).1
    };
    let said = strip(10_000.0, "small", 1);
    assert!(said.contains("what rounding leaves of the stiffness") && said.contains("corotated"), "{said}");
    for rotation in ["small", "corotated"] {
        assert!(!strip(2000.0, rotation, 0).contains("caution: what rounding"), "{rotation}");
    }
}

/// Resultants of loads that balance each other are rounding, and so is what is left of them.
#[test]
fn loads_or_leaders_that_balance_each_other_are_no_caution() {
    let text = |more: &str| {
        format!(
            "title = \"A bar pulled at both ends\"\nlattice = {{ kind = \"square\", spacing = 0.5 }}\n\
             body = {{ shape = {{ kind = \"rectangle\", min = [0.0, -1.0], max = [5.0, 1.0] }} }}\n\
             material = {{ kind = \"isotropic\", young = 1000.0, poisson = 0.3 }}\n\
             rule = {{ mean = {{ kind = \"material\" }} }}\nequilibrium = {{}}\n{more}"
        )
    };
    let at = |x: f64| format!("{{ kind = \"disc\", centre = [{x:?}, 0.0], radius = 0.01 }}");
    let pull = |piece: u32, by: f64| {
        format!(
            "{{ kind = \"traction\", region = {{ kind = \"outline\", pieces = [{piece}] }}, traction = [{by:?}, 0.0] }}"
        )
    };
    let loaded = format!(
        "roles = [{{ region = {}, role = \"clamped\" }}, {{ region = {}, role = \"clamped\", axis = \"y\" }}]\n\
         loads = [{}, {}]\n",
        at(0.0),
        at(5.0),
        pull(2, 1.0),
        pull(4, -1.0)
    );
    let led = "roles = [{ region = { kind = \"boundary\" }, role = \"leader\", \
               motion = { kind = \"affine\", stretch = [1.01, 1.0], steps = 1 } }]\n";
    for more in [&*loaded, led] {
        let said = run(&[&text(more)], &["--figures", "none"], 0).1;
        assert!(!said.contains("caution"), "{said}");
    }
}

/// Of 1.75 m of height whole cells of 0.5 m leave 1.5 m, a seventh less.
#[test]
fn a_run_of_whole_cells_says_when_they_are_not_the_shape() {
    let more = |height: &str| {
        let shape = format!("body.shape.max=[4.0,{height}]");
        let set = ["--figures", "none", "--set", "body.outline=\"lattice\"", "--set", &shape];
        run(&[BAR, PULL, SOLVED], &set, 0).1
    };
    let said = more("1.75");
    assert!(said.contains("the body is not the shape: its area is -14.29 % off"), "{said}");
    assert!(!more("2.0").contains("not the shape"));
}

#[test]
fn a_bar_in_uniaxial_tension_has_the_stress_of_its_load_everywhere() {
    let place = "[record]\nplaces = [[2.1, 1.3]]\n";
    let (folder, said) = run(&[BAR, PULL, SOLVED, place], &["--figures", "none"], 0);
    let summary = summary(folder.path());
    let measured = &summary["mechanics"];
    let told = &measured["places"][0];
    assert!(
        near(number(&told["stress"][0]), 50e3, 50e3) && near(number(&told["von_mises"]), 50e3, 50e3),
        "{told}"
    );
    assert!(near(number(&told["displacement"][0]), 50e3 / 210e9 * 2.1, 1e-6), "{told}");
    assert!(said.contains("at (2.1000, 1.3000) m: moved by ("), "{said}");
    assert!(near(number(&measured["largest_von_mises"]["von_mises"]), 50e3, 50e3), "{measured}");
    // 50 kPa on 2 m x 1 mm.
    assert!(near(number(&measured["reactions"][0]["force"][0]), -100.0, 100.0), "{measured}");
    assert_eq!(measured["units"]["force"], "N");
    assert!(
        said.contains("force [N] and moment [N m]") && said.contains("von Mises stress 50000 Pa"),
        "{said}"
    );
    assert!(!said.contains("caution") && summary["cautions"].is_null(), "{said}");
    let end = table(folder.path().join("o/final.csv"));
    assert_eq!(end["von_mises"].len(), 45);
    for (name, expected) in [("stress_xx", 50e3), ("stress_yy", 0.0), ("stress_xy", 0.0), ("von_mises", 50e3)]
    {
        assert!(end[name].iter().all(|found| near(*found, expected, 50e3)), "{name}: {:?}", end[name]);
    }
}

/// The clamp that only particles beyond a metre would take holds those of the left edge no more than without it.
#[test]
fn an_entry_whose_condition_never_held_has_no_reaction() {
    let never = "[[roles]]\nregion = { kind = \"all\" }\nrole = \"clamped\"\nwhen = { quantity = \"displacement\", above = 1.0 }\n";
    let (folder, _) = run(&[BAR, never, PULL, "[stop]\nsteps = 20\n"], &["--figures", "none"], 0);
    let (without, _) = run(&[BAR, PULL, "[stop]\nsteps = 20\n"], &["--figures", "none"], 0);
    let [found, expected] =
        [&folder, &without].map(|folder| summary(folder.path())["mechanics"]["reactions"].clone());
    assert!(number(&expected[0]["force"][0]) < 0.0 && expected[1].is_null(), "{expected}");
    assert_eq!(found, expected);
}

#[test]
fn a_led_region_returns_its_force_and_the_supports_do_the_work() {
    let (folder, _) = run(&[BAR, LEAD, SOLVED], &["--figures", "none"], 0);
    let measured = summary(folder.path())["mechanics"].clone();
    // E times the strain of 1e-3 on 2 m x 1 mm.
    let force = 210e9 * 1e-3 * 2e-3;
    let [clamped, led] = [0, 1].map(|k| measured["reactions"][k].clone());
    assert!(
        near(number(&led["force"][0]), force, force) && near(number(&clamped["force"][0]), -force, force)
    );
    assert!(near(number(&led["displacement"][0]), 0.004, 0.004), "{led}");
    let work = number(&measured["work"]["supports"]);
    assert!(near(work, 0.004 * force, work) && near(2.0 * number(&measured["strain_energy"]), work, work));
    assert!(measured["load"].is_null(), "{measured}");
}

#[test]
fn a_roller_returns_force_along_its_axis_alone_and_every_load_has_its_own_resultant() {
    let rollers = r#"
[[roles]]
region = { kind = "edge", side = "left" }
role = "clamped"
axis = "x"
[[roles]]
region = { kind = "edge", side = "bottom" }
role = "clamped"
axis = "y"
[[loads]]
kind = "body"
force = [0.0, -25e3]
"#;
    let (bar, _) = BAR.split_once("[[roles]]").expect("has a clamp");
    let bar = bar.replace("poisson = 0.0", "poisson = 0.3");
    let (folder, said) = run(&[&bar, PULL, rollers, SOLVED], &["--figures", "none"], 0);
    let measured = summary(folder.path())["mechanics"].clone();
    // 25 kPa/m on 8 m2 x 1 mm weigh 200 N.
    for (k, force) in [(0, [-100.0, 0.0]), (1, [0.0, 200.0])] {
        let reaction = &measured["reactions"][k];
        assert!((0..2).all(|axis| near(number(&reaction["force"][axis]), force[axis], 200.0)), "{reaction}");
    }
    for (k, force) in [(0, [100.0, 0.0]), (1, [0.0, -200.0])] {
        let load = &measured["loads"][k];
        assert!((0..2).all(|axis| near(number(&load["force"][axis]), force[axis], 200.0)), "{load}");
    }
    assert!(number(&measured["unbalanced"]) < 1e-5, "{measured}");
    for words in ["loads[0]  (100.00, 0) N", "loads[1]  (0, -200.00) N", "loads in all"] {
        assert!(said.contains(words), "no `{words}` in\n{said}");
    }
}

/// Each entry that holds a single component is looked at, and one that comes to nothing is no silent one.
#[test]
fn components_that_would_be_held_later_or_not_at_all_are_refused_by_name() {
    let role = |side: &str, role: &str, rest: &str| {
        format!("[[roles]]\nregion = {{ kind = \"edge\", side = \"{side}\" }}\nrole = \"{role}\"\n{rest}\n")
    };
    let (bar, _) = BAR.split_once("[[roles]]").expect("has a clamp");
    let left = role("left", "clamped", "axis = \"x\"");
    let cases = [
        ([left.clone(), role("right", "clamped", "axis = \"y\"\nfrom = 100")], "roles[1].axis"),
        ([left.clone(), role("right", "follower", "axis = \"y\"")], "roles[1].axis"),
        (
            [role("left", "clamped", ""), left.clone()],
            "roles[1].axis = \"x\": is without effect: roles[0] holds",
        ),
        ([left.clone(), role("left", "follower", "from = 100")], "roles[1].region"),
    ];
    for (roles, words) in cases {
        let (folder, said) = run(&[bar, &roles.concat(), PULL], &["--figures", "none"], 2);
        assert!(said.contains(words), "no `{words}` in\n{said}");
        assert!(!folder.path().join("o").exists(), "{words}");
    }
}

#[test]
fn a_motion_that_goes_where_nothing_is_led_is_refused() {
    let led = |motion: &str| {
        format!(
            "[[roles]]\nregion = {{ kind = \"edge\", side = \"right\" }}\nrole = \"leader\"\naxis = \"x\"\nmotion = {{ {motion} }}\n[stop]\nsteps = 2\n"
        )
    };
    let led_by_table = temporary();
    let table = led_by_table.path().join("led.csv");
    let rows =
        |uy: f64| (0..=4).map(|i| format!("4.0,{},0.1,{uy}\n", 0.5 * f64::from(i))).collect::<String>();
    let of_table = |uy: f64| {
        std::fs::write(&table, format!("x,y,ux,uy\n{}", rows(uy))).expect("written");
        format!("kind = \"csv\", file = '{}'", table.display())
    };
    for motion in [
        &of_table(0.3),
        "kind = \"affine\", rotate = 5.0, steps = 2",
        "kind = \"affine\", stretch = [1.0, 1.1], steps = 2",
        "kind = \"affine\", shear = [0.0, 0.1], steps = 2",
        "kind = \"velocity\", per_step = [0.01, 0.5]",
        "kind = \"sinusoid\", amplitude = [0.0, 0.1], period = 8",
        "kind = \"keyframes\", frames = [{ step = 1, displacement = [0.1, 0.0] }, { step = 2, displacement = [0.1, 0.1] }]",
    ] {
        let (_, said) = run(&[BAR, &led(motion)], &["--figures", "none"], 2);
        assert!(
            said.contains("roles[1].motion") && said.contains("axis = \"x\" leads along x alone"),
            "{said}"
        );
    }
    for motion in [
        &of_table(0.0),
        "kind = \"affine\", stretch = [1.01, 1.0], shear = [0.01, 0.0], steps = 2",
        "kind = \"velocity\", per_step = [0.01, 0.0]",
    ] {
        run(&[BAR, &led(motion)], &["--figures", "none"], 0);
    }
}

#[test]
fn stress_that_is_not_recovered_or_too_low_under_a_load_is_a_caution() {
    let figures = ["--figures", "none"];
    let caution = |more: &[&str], parts: &[&str], words: &str| {
        let (_, said) = run(parts, &[&figures[..], more].concat(), 0);
        said.contains(words)
    };
    let cells = "stress is not recovered along the edges of a body of whole cells";
    let lattice = ["--set", "body.outline=lattice"];
    assert!(caution(&lattice, &[BAR, PULL, SOLVED], cells) && !caution(&[], &[BAR, PULL, SOLVED], cells));
    // A body by count has no other edges: it is to be given by its sides.
    let grid = ["--set", "body.shape={ kind = \"grid\", columns = 9, rows = 5 }"];
    assert!(caution(&grid, &[BAR, LEAD], "give the shape as a rectangle"));
    let on = |from: f64, to: f64| {
        let region = format!("{{ kind = \"outline\", between = [[{from}, 2.0], [{to}, 2.0]] }}");
        format!("[[loads]]\nkind = \"pressure\"\nregion = {region}\npressure = 1e3\n")
    };
    let narrow = "1 load on less than 4 spacings";
    for (from, to, is_narrow) in [(2.0, 2.1, true), (1.0, 2.4, true), (1.0, 3.1, false), (0.0, 4.0, false)] {
        assert_eq!(caution(&[], &[BAR, &on(from, to), SOLVED], narrow), is_narrow, "{from} to {to}");
    }
}

#[test]
fn a_sweep_that_grows_is_not_taken_for_a_body_that_turns_far() {
    let steps = "[stop]\nsteps = 40\ndivergence_ratio = 1e9\n[update]\ndamping = 1.4\n";
    let (_, said) = run(&[BAR, PULL, steps], &["--figures", "none"], 0);
    assert!(said.contains("the sweep grows from step to step") && said.contains("damping"), "{said}");
    assert!(!said.contains("rotation = \"small\""), "{said}");
}

#[test]
fn a_component_of_particles_that_are_held_altogether_is_led_nowhere_and_that_is_said() {
    let (bar, _) = BAR.split_once("[[roles]]").expect("has a clamp");
    let clamped = "[[roles]]\nregion = { kind = \"edge\", side = \"left\" }\nrole = \"clamped\"\n";
    let below = |role: &str| {
        format!("[[roles]]\nregion = {{ kind = \"edge\", side = \"bottom\" }}\naxis = \"y\"\n{role}\n")
    };
    let led = below(
        "role = \"leader\"\nmotion = { kind = \"keyframes\", frames = [{ step = 1, displacement = [0.0, 0.01] }] }",
    );
    let words = "but 1 of these stay as roles[0] has them";
    for (roller, is_said) in [(led, true), (below("role = \"clamped\""), false)] {
        let (_, said) = run(&[bar, clamped, &roller, PULL], &["--figures", "none"], 0);
        assert_eq!(said.contains(words), is_said, "{said}");
    }
}

#[test]
fn the_stress_figure_reaches_the_largest_stress_that_is_printed() {
    let folder = temporary();
    let output = flockform(&["run", "plate-hole", "--figures", "svg", "--out", "o"], folder.path());
    let said = text(&output.stdout);
    assert!(said.contains("largest von Mises stress 3.3321"), "{said}");
    let picture = std::fs::read_to_string(folder.path().join("o/von_mises_0001.svg")).expect("drawn");
    let labels = picture.split("</text>").filter_map(|part| part.rsplit('>').next()?.parse::<f64>().ok());
    // Labels of the axes are whole numbers.
    let bar = labels.filter(|value| value.fract() != 0.0 && *value < 10.0).fold(0.0, f64::max);
    assert!(bar >= 3.3 && picture.contains("class=\"band\""), "contours up to {bar}");
    assert!(picture.contains("solved for equilibrium") && !picture.contains("step 1"), "{picture:.600}");
}

#[test]
fn figures_are_drawn_as_the_files_asked_for_and_the_report_is_named() {
    let drawn = |formats: &str| {
        let (folder, said) = run(&[BAR, PULL, SOLVED], &["--figures", formats], 0);
        assert!(!said.contains("report.html"), "{said}");
        let count = |ending: &str| {
            let is = |path: &&PathBuf| path.extension().is_some_and(|found| found == ending);
            files(&folder.path().join("o")).iter().filter(is).count()
        };
        (count("svg"), count("png"), folder)
    };
    for (formats, svg, png) in [("none", 0, 0), ("svg", 5, 0), ("png", 0, 5), ("all", 5, 5)] {
        let (found_svg, found_png, _folder) = drawn(formats);
        assert_eq!((found_svg, found_png), (svg, png), "{formats}");
    }
    let (.., folder) = drawn("svg");
    // A strain of 1e-7 is drawn so that it is seen, and the heading says so.
    let picture = std::fs::read_to_string(folder.path().join("o/von_mises_1000.svg")).expect("drawn");
    assert!(picture.contains("displacements enlarged") && picture.contains("von Mises stress"), "{picture}");
    // No step leads to an equilibrium.
    assert!(picture.contains("solved for equilibrium") && !picture.contains("step 1000"), "{picture}");
    // Three panels, and one scale from as much pressure as there is tension: the bar's tension is its end, and red.
    let picture = std::fs::read_to_string(folder.path().join("o/stress_1000.svg")).expect("drawn");
    for words in
        [">xx<", ">yy<", ">xy<", "stress [Pa]", "fill=\"#b40426\" stroke", ">\u{2212}40000<", ">40000<"]
    {
        assert!(picture.contains(words), "no `{words}` in {picture}");
    }
    let folder = temporary();
    let output = flockform(&["run", "tension", "--steps", "2", "--figures", "none"], folder.path());
    let said = text(&output.stdout);
    assert!(said.contains("open ") && said.contains("out/tension/report.html"), "{said}");
    assert!(folder.path().join("out/tension/report.html").is_file());
    let output = flockform(&["run", "tension", "--figures", "gif"], folder.path());
    assert_eq!(output.status.code(), Some(2));
}
