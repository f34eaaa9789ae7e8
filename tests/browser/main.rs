//! Reports as a reader has them, in headless Chromium.
//!
//! They need Chromium, Node and two packages of npm:
//!
//! ```text
//! apt-get install chromium nodejs npm
//! npm install --prefix browser playwright-core axe-core
//! FLOCKFORM_NODE_MODULES=browser/node_modules cargo test --test browser -- --ignored
//! ```
//!
//! `tour.mjs` does what a reader does and says what there was to see; here is what should have been.
//! `FLOCKFORM_CHROMIUM` names another browser than `/usr/bin/chromium`.

#![cfg(feature = "cli")]

#[path = "../common/command.rs"]
mod command;
#[path = "../common/folders.rs"]
mod folders;

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use tempfile::TempDir;

use command::done;
use folders::temporary;

/// A folder with a report, and what the program said of itself in tables.
struct Report {
    _folder: TempDir,
    out: PathBuf,
}

impl Report {
    fn of(arguments: &[&str]) -> Self {
        let folder = temporary();
        done(&[arguments, &["--quiet", "--out", "out"]].concat(), folder.path());
        Self { out: folder.path().join("out"), _folder: folder }
    }

    fn tour(&self, asked: &Value) -> Value {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/tour.mjs");
        let output = Command::new("node")
            .arg(script)
            .arg(self.out.join("report.html"))
            .arg(asked.to_string())
            .output()
            .expect("node starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {said}"))
    }

    /// A table's rows by column name.
    fn table(&self, name: &str) -> Vec<std::collections::BTreeMap<String, String>> {
        let mut reader = csv::Reader::from_path(self.out.join(name)).expect("written");
        reader.deserialize().map(|row| row.expect("a row")).collect()
    }
}

/// What holds of every report: nothing went wrong, nothing was asked of a network, whoever uses a keyboard or a
/// screen reader is served.
fn assert_sound(seen: &Value) {
    assert_eq!(seen["errors"], json!([]), "the console has no errors");
    assert_eq!(seen["faults"], json!([]), "axe finds nothing serious");
    let requests = seen["requests"].as_array().expect("listed");
    let is_own = |url: &Value| {
        url.as_str()
            .is_some_and(|u| u.starts_with("file:") || u.starts_with("data:") || u.starts_with("blob:"))
    };
    assert!(requests.iter().all(is_own), "{requests:?}");
    assert_eq!(seen["cut"], json!([]), "all of it is seen on a phone");
}

/// What holds of every animation: it plays, stops, steps, scrubs to the end, zooms and looks different coloured by at least
/// `colours` of its quantities.
fn assert_film_works(seen: &Value, colours: u64) {
    let frames = &seen["frames"];
    let last = frames["count"].as_u64().expect("counted") - 1;
    let played = frames["played"].as_u64().expect("counted");
    assert!(played >= 3 && frames["isPaused"] == true, "{frames}");
    assert_eq!(frames["stepped"], (played + 1).min(last), "{frames}");
    assert_eq!(frames["back"], frames["stepped"].as_u64().expect("counted") - 1, "{frames}");
    assert_eq!(frames["scrubbed"], last, "{frames}");
    assert_eq!(frames["moved"], true, "{frames}");
    let zoom: Vec<f64> = serde_json::from_value(seen["zoom"].clone()).expect("numbers");
    assert!((zoom[0] - 1.25).abs() < 1e-9 && (zoom[1] - 1.0).abs() < 1e-9, "{zoom:?}");
    let pictures = &seen["pictures"];
    assert!(pictures["different"].as_u64() >= Some(colours), "{pictures}");
    assert_eq!(pictures["themes"], true);
    // The wheel scrolls the page over a view that shows all, zooms with ctrl, and then by itself; a finger likewise.
    let turned =
        |scrolled: bool, touch: &str| json!({ "scrolled": scrolled, "zoomed": !scrolled, "touch": touch });
    let wheel = [turned(true, "pan-x pan-y"), turned(false, "none"), turned(false, "none")]
        .map(|one| one.to_string());
    let seen_wheel = seen["wheel"].as_array().expect("listed").iter().map(Value::to_string);
    assert_eq!(seen_wheel.collect::<Vec<_>>(), wheel);
    // An address shows what was shown; what makes no sense in it is left alone.
    let [last, changed, again] = [0, 1, 2].map(|k| &seen["address"][k]);
    assert_eq!(changed, again);
    assert_eq!((&changed["quantity"], &changed["layers"]["points"]), (last, &json!(false)));
    assert_ne!(seen["nonsense"]["quantity"], *last);
    assert_saved(seen);
    assert_marked(seen);
}

/// What holds of marks: a role has one shape, in the view and in its legend, and a broken bond is dashed.
fn assert_marked(seen: &Value) {
    // Whether the corner of a square and the tip of a diamond are covered.
    for (role, covered) in seen["shapes"].as_object().expect("by role") {
        let expected = match role.as_str() {
            "leader" => [false, true],
            "clamped" => [true, false],
            _ => [false, false],
        };
        assert_eq!(*covered, json!(expected), "{role}");
    }
    for sign in seen["signs"].as_array().expect("listed") {
        let expected = match sign[0].as_str().expect("a name") {
            "leader" | "leaders" => "diamond",
            "clamped" => "square",
            "broken bond" | "broken bonds" => "crack",
            _ => "dot",
        };
        assert_eq!(sign[1], expected, "{sign}");
    }
}

/// What holds of saved pictures: they are as wide as the views, with title, clock and scale, in a drawing as letters.
fn assert_saved(seen: &Value) {
    let saved = &seen["saved"];
    let views: u64 = saved["views"].as_array().expect("listed").iter().filter_map(Value::as_u64).sum();
    let png = &saved["png"];
    assert!(png["pixels"][0].as_u64() > Some(views) && png["size"].as_u64() > Some(5000), "{png}");
    let texts = saved["svg"]["texts"].as_array().expect("listed");
    for text in saved["shown"].as_array().expect("listed") {
        assert!(texts.contains(text), "{text} in {texts:?}");
    }
}

/// A number as the page has it.
fn number(shown: &Value, key: &str) -> f64 {
    shown[key].as_str().and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{key} in {shown}"))
}

/// Every column of the row that the page shows under the same name, to the last bit.
fn assert_same(shown: &Value, row: &std::collections::BTreeMap<String, String>, columns: &[&str]) {
    for &column in columns {
        let written: f64 = row[column].parse().expect("a number");
        assert_eq!(number(shown, column).to_bits(), written.to_bits(), "{column}: {shown} {row:?}");
    }
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_runs_report_shows_at_the_end_what_final_csv_has_and_before_what_probes_csv_has() {
    let report = Report::of(&["run", "tension"]);
    for painter in ["webgl", "2d"] {
        let asked = json!({ "painter": painter, "find": [["67", 20], ["115", 20], ["67", 80]], "hover": [66, 114, 0, 50] });
        let seen = report.tour(&asked);
        assert_sound(&seen);
        assert_film_works(&seen, 5);
        let expected = if painter == "2d" { "PlainPainter" } else { "Painter" };
        assert_eq!(seen["painter"], expected);
        assert_eq!(seen["charts"], 3, "x displacement, PE1 and PE2 of the probes");
        assert_eq!(seen["now"], "step 401 of 401");
        let rows = report.table("final.csv");
        for (shown, particle) in seen["hovered"].as_array().expect("listed").iter().zip([66, 114, 0, 50]) {
            assert_same(shown, &rows[particle], &["x", "y", "pe1", "pe2"]);
            assert_eq!(shown["role"], rows[particle]["role"].as_str());
        }
        assert_same(&seen["hovered"][0], &rows[66], &["strain_xx", "strain_yy", "strain_xy", "rotation"]);
        let probes = report.table("probes.csv");
        for (shown, (id, step)) in seen["numbers"].as_array().expect("listed").iter().zip([
            ("67", "20"),
            ("115", "20"),
            ("67", "80"),
        ]) {
            let row = probes.iter().find(|row| row["id"] == id && row["step"] == step).expect("probed");
            for (column, within) in [("x", 1e-5), ("y", 1e-5), ("pe1", 1e-4), ("pe2", 1e-3)] {
                let written: f64 = row[column].parse().expect("a number");
                assert!(
                    (number(shown, column) - written).abs() < within,
                    "{column} at {step}: {shown} {row:?}"
                );
            }
        }
        assert_eq!([&seen["numbers"][1]["role"], &seen["numbers"][2]["role"]], ["follower", "follower"]);
    }
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn bodies_beyond_the_range_of_single_floats_are_drawn_where_they_are() {
    for spacing in ["1e-60", "1e60"] {
        let scene = format!(
            "title = \"T\"\nlattice = {{ kind = \"square\", spacing = {spacing} }}\n\
             body.shape = {{ kind = \"grid\", columns = 6, rows = 4 }}\nstop.steps = 5\n\
             roles = [{{ region = {{ kind = \"edge\", side = \"left\" }}, role = \"leader\", \
             motion = {{ kind = \"velocity\", per_step = [{spacing}, 0.0] }} }}]\n"
        );
        let folder = temporary();
        let file = folder.path().join("t.toml");
        std::fs::write(&file, scene).expect("writable");
        let report = Report::of(&["run", file.to_str().expect("plain")]);
        let rows = report.table("final.csv");
        for painter in ["2d", "webgl"] {
            let seen = report.tour(&json!({ "hover": [0, 9, 23], "painter": painter }));
            assert_sound(&seen);
            assert_eq!(seen["frames"]["moved"], true, "{painter}: {}", seen["frames"]);
            for (shown, particle) in seen["hovered"].as_array().expect("listed").iter().zip([0, 9, 23]) {
                assert_same(shown, &rows[particle], &["x", "y"]);
            }
        }
    }
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_torn_body_shows_its_strain_and_its_broken_bonds() {
    let report = Report::of(&["run", "fracture"]);
    let seen = report.tour(&json!({ "hover": [500] }));
    assert_sound(&seen);
    assert_film_works(&seen, 5);
    let row = &report.table("final.csv")[500];
    assert_same(&seen["hovered"][0], row, &["x", "y", "pe1", "strain_xx"]);
    let part = |name: &str| row[name].parse::<f64>().expect("a number");
    let (xx, yy, xy) = (part("strain_xx"), part("strain_yy"), part("strain_xy"));
    let names = |of: &str| {
        seen[of].as_array().expect("listed").iter().filter_map(|one| one[0].as_str()).collect::<Vec<_>>()
    };
    assert!(
        names("signs").contains(&"broken bonds") && names("signs").contains(&"clamped"),
        "{:?}",
        names("signs")
    );
    assert!(seen["saved"]["svg"]["dashed"].as_u64() >= Some(1), "{}", seen["saved"]["svg"]);
    // Buttons stand at that corner of the page, and not in a picture.
    let texts = seen["saved"]["svg"]["texts"].as_array().expect("listed");
    assert!(texts.contains(&json!("1000")), "{texts:?}");
    let largest = ((xx + yy) / 2.0).abs() + ((xx - yy) / 2.0).hypot(xy);
    let shown = number(&seen["hovered"][0], "strain");
    assert!(
        (shown - largest).abs() < 1e-4 * (1.0 + largest),
        "computed in the page {shown}, in Rust {largest}"
    );
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_swarms_report_shows_its_robots_where_robots_csv_has_them() {
    let report = Report::of(&["swarm", "square"]);
    let seen = report.tour(&json!({ "hover": [0, 1, 2], "find": [["robot_2", 1.0]] }));
    assert_sound(&seen);
    // Ideal robots: nothing is strained, every pose is fresh.
    assert_film_works(&seen, 3);
    let rows = report.table("robots.csv");
    for (shown, row) in seen["hovered"].as_array().expect("listed").iter().zip(&rows) {
        assert_same(shown, row, &["x", "y", "way"]);
        let least: f64 = row["clearance"].parse().expect("a number");
        assert_eq!(number(shown, "least_clearance").to_bits(), least.to_bits(), "{shown} {row:?}");
        assert!(number(shown, "clearance") >= least - 1e-9, "{shown}");
    }
    let offered = seen["pictures"]["names"].as_array().expect("listed");
    for quantity in ["clearance", "away", "speed", "acceleration", "age", "strain"] {
        assert!(offered.contains(&quantity.into()), "{offered:?}");
    }
    assert!(number(&seen["numbers"][0], "clearance") > 0.0, "found by its name");
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_comparison_shows_rule_and_truth_beside_each_other() {
    let report = Report::of(&["compare", "beam-paper", "--truth-error", "0.01"]);
    let seen = report.tour(&json!({ "hover": [40], "compare": true }));
    assert_sound(&seen);
    assert_film_works(&seen, 4);
    assert_eq!(seen["views"], 2);
    assert_eq!(seen["command"], "flockform compare beam-paper --truth-error 0.01");
    let compared = &seen["compare"];
    assert_eq!((&compared["clip"], &compared["isOver"]), (&json!("inset(0px 0px 0px 30%)"), &json!(true)));
    assert_eq!(compared["line"], json!(["\"\"", "2px", 30]));
    assert_eq!(seen["seams"], json!([0, 0]));
    let apart = &compared["apart"];
    assert!(apart["wrong"] == 0 && apart["right"].as_u64() > Some(100), "{apart}");
    let scale = compared["scale"].as_str().expect("text");
    assert!(scale.contains("rule less truth") && scale.contains("from −"), "{scale}");
    assert_eq!(compared["differs"], true);
    let row = &report.table("compare.csv")[40];
    for (shown, written) in [("ux", "ux_rule"), ("uy", "uy_rule")] {
        let written: f64 = row[written].parse().expect("a number");
        assert_eq!(number(&seen["hovered"][0], shown).to_bits(), written.to_bits());
    }
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn the_stress_of_a_report_reaches_what_the_program_prints() {
    let report = Report::of(&["run", "plate-hole"]);
    let seen = report.tour(&json!({}));
    assert_sound(&seen);
    let largest = report
        .table("final.csv")
        .iter()
        .map(|row| row["von_mises"].parse().unwrap_or(0.0))
        .fold(0.0, f64::max);
    let shown = number(&seen["scale"], "end");
    assert!(largest > 3.3 && (shown - largest).abs() < 1e-9 * largest, "{shown} of {largest}");
    assert_eq!(seen["seams"], json!([0]));
    // Displacements of some 1e-10, whose last digit is that of the power; and far from the origin.
    let stiff = ["--set", "material.young=1e11", "--set", "material.thickness=2.0"];
    let report = Report::of(&[&["run", "plate-hole"][..], &stiff].concat());
    let find: Vec<_> = ["60", "400", "700", "1200"].iter().map(|id| json!([id, 100])).collect();
    let seen = report.tour(&json!({ "find": find }));
    assert_sound(&seen);
    let small = |shown: &Value| (1e-11..1e-9).contains(&number(shown, "ux").abs());
    assert!(seen["numbers"].as_array().is_some_and(|all| all.len() == 4 && all.iter().any(small)), "{seen}");
    // In even parts of the load stress is as many parts of that at the end.
    let half = report.tour(&json!({ "find": [["60", 50], ["60", 100]] }));
    let [half, whole] = [0, 1].map(|k| number(&half["numbers"][k], "von_mises"));
    assert!((half / whole - 0.5).abs() < 1e-12, "{half} of {whole}");
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn stress_on_the_way_is_that_of_a_run_that_ends_there() {
    let of_cells = ["--set", r#"body.outline="lattice""#];
    let steps = |n: usize| format!("stop.steps={n}");
    let increments = |schedule: &str| format!("load_steps={{schedule={schedule}}}");
    for (name, way, end, at, sets) in [
        ("pulled", steps(40), steps(20), 20, vec!["lattice.kind=\"hexagonal\""]),
        ("pulled", steps(40), steps(20), 20, vec!["lattice.kind=\"honeycomb\""]),
        ("turned", steps(40), steps(20), 20, vec!["rule.mean.rotation=\"corotated\""]),
        ("soft", steps(40), steps(20), 20, vec!["material.poisson=0.4995", "material.plane=\"strain\""]),
        (
            "stiffened",
            steps(40),
            steps(20),
            20,
            vec![r#"actions=[{at=30,what={kind="set",keys=["material.young=4000.0"]}}]"#],
        ),
        ("filled", steps(40), steps(20), 20, vec![FILLED]),
        ("torn", steps(40), steps(30), 30, vec!["rule.mean={kind=\"barycentre\"}", "fracture.stretch=1.2"]),
        ("elastica", increments("[0.2,0.5,1]"), increments("[0.2,0.5]"), 2, vec![]),
        ("inclusion", increments("[0.2,0.5,1]"), increments("[0.2,0.5]"), 2, vec![]),
    ] {
        let folder = temporary();
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, PULLED).expect("written");
        let bundled = ["elastica", "inclusion"].contains(&name);
        let scene = if bundled { name } else { file.to_str().expect("a path") };
        let report = |until: &str| {
            let mut arguments = vec!["run", scene, "--figures", "none", "--set", until];
            if !bundled {
                arguments.extend(of_cells);
            }
            arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
            Report::of(&arguments)
        };
        let seen = report(&way).tour(&json!({ "fields": [["von_mises", at]] }));
        assert_sound(&seen);
        let shown = seen["fields"][0].as_array().expect("listed").iter().map(|value| value.as_f64());
        let expected = report(&end).table("final.csv");
        let expected: Vec<Option<f64>> = expected.iter().map(|row| row["von_mises"].parse().ok()).collect();
        let largest = expected.iter().flatten().fold(0.0, |most: f64, &one| most.max(one));
        assert!(largest > 0.0 && expected.len() == shown.len(), "{name}");
        for (i, (shown, expected)) in shown.zip(&expected).enumerate() {
            let apart = shown.unwrap_or(-1.0) - expected.unwrap_or(-1.0);
            assert!(apart.abs() < 1e-6 * largest, "{name}, {i}: {shown:?} for {expected:?}");
        }
    }
}

/// With another material within.
const FILLED: &str = r#"body.inclusions=[{shape={kind="disc",centre=[6,3],radius=2.1},material={kind="isotropic",young=9000.0,poisson=0.2}}]"#;

/// A strip that is pulled and sheared step by step.
const PULLED: &str = r#"
title = "A strip, pulled"
lattice = { kind = "square", spacing = 1.0 }
body.shape = { kind = "rectangle", max = [12.0, 7.0] }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
rule.mean = { kind = "material" }
stop.steps = 40

[[roles]]
region = { kind = "edge", side = "left", depth = 0.6 }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right", depth = 0.6 }
role = "leader"
motion = { kind = "velocity", per_step = [0.02, 0.01] }
"#;

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_swarms_table_is_read_on_a_phone() {
    assert_sound(&Report::of(&["swarm", "gap"]).tour(&json!({})));
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_trades_report_names_the_setting_of_a_point() {
    let seen = Report::of(&["trade", "grips", "--quick"]).tour(&json!({}));
    assert_sound(&seen);
    let points = seen["points"].as_array().expect("listed");
    let named =
        |text: &Value| text.as_str().is_some_and(|text| text.contains("rule") && text.contains("particles"));
    assert!(points.len() == 3 && points.iter().all(named), "{points:?}");
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_stability_report_draws_growth_against_each_parameter() {
    let seen = Report::of(&["stability", "tension", "--quick", "--no-extremes"]).tour(&json!({}));
    assert_sound(&seen);
    assert_eq!(seen["charts"], 2, "feedback and damping");
}

#[test]
#[ignore = "needs Chromium, Node, playwright-core and axe-core: see tests/browser/main.rs"]
fn a_dense_body_looks_alike_as_triangles_and_as_pixels() {
    // Particles as squares; as dots with bonds between them.
    for side in [300, 60] {
        let shape = format!("body.shape={{ kind = \"grid\", columns = {side}, rows = {side} }}");
        let report =
            Report::of(&["run", "shear", "--set", &shape, "--set", "stop.steps=200", "--figures", "none"]);
        let [triangles, pixels]: [Vec<f64>; 2] = ["webgl", "2d"].map(|painter| {
            let seen = report.tour(&json!({ "painter": painter, "small": true }));
            assert_eq!(seen["painter"], if painter == "2d" { "PlainPainter" } else { "Painter" });
            serde_json::from_value(seen["small"].clone()).expect("numbers")
        });
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / pixels.len() as f64;
        let apart = mean(&mut triangles.iter().zip(&pixels).map(|(a, b)| (a - b).abs()));
        let from_its_mean = mean(&mut pixels.iter().copied());
        let contrast = mean(&mut pixels.iter().map(|value| (value - from_its_mean).abs()));
        println!("{side}: {apart} apart, contrast {contrast}");
        assert!(apart < 0.1 * contrast && contrast > 10.0, "{side}: {apart} apart, contrast {contrast}");
    }
}
