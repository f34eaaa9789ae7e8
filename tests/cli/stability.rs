//! `flockform stability` as a person meets it.

use crate::program::*;

const QUICK: [&str; 4] = ["stability", "tension", "--quick", "--no-extremes"];

#[test]
fn a_table_is_printed_and_the_results_stand_in_a_numbered_folder() {
    let folder = temporary();
    let said = done(&QUICK, folder.path());
    for words in ["grows beyond", "feedback factor (upper)", "0.006866", "delay", "tension-stability"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let out = folder.path().join("out/tension-stability");
    for file in ["stability.json", "growth.csv", "growth.svg", "growth.png"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let rows = std::fs::read_to_string(out.join("growth.csv")).expect("written");
    for source in ["spectrum", "run", "bisection"] {
        assert!(rows.lines().any(|row| row.contains(&format!(",{source},"))), "{source}");
    }
}

#[test]
fn json_is_the_file_and_quiet_is_quiet() {
    let folder = temporary();
    let output = flockform(&[&QUICK[..], &["--json", "--out", "here"]].concat(), folder.path());
    let said = text(&output.stdout);
    assert_eq!(said, std::fs::read_to_string(folder.path().join("here/stability.json")).expect("written"));
    let study = json(&said);
    assert_eq!(study["holds"], true);
    let upper = &study["linear"]["thresholds"][1];
    assert!((upper["predicted"]["value"].as_f64().expect("a number") - 0.006866).abs() < 1e-6, "{upper}");
    let again = flockform(&[&QUICK[..], &["--quiet", "--out", "here", "--force"]].concat(), folder.path());
    assert_eq!((again.status.code(), text(&again.stdout)), (Some(0), String::new()));
}

#[test]
fn what_cannot_be_asked_is_refused_with_exit_code_2_and_leaves_nothing() {
    let folder = temporary();
    for (arguments, words) in [
        (vec!["stability", "tensoin"], "nearest bundled scene is `tension`"),
        (vec!["stability", "tension", "--set", "lattice.spacing=-1"], "lattice.spacing"),
        (vec!["stability", "tension", "--set", "body.anchor=[1e20,0.0]"], "put the origin"),
        (vec!["stability", "tension", "--set", "lattice.spacing=1e-310"], "use another unit"),
    ] {
        refused_in(&arguments, folder.path(), &[words]);
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_rule_that_changes_on_the_way_has_no_one_threshold() {
    let folder = temporary();
    let damped = "actions=[{at=2,what={kind=\"set\",keys=[\"update.damping=0.5\"]}}]";
    let output = flockform(&[&QUICK[..], &["--set", damped, "--json"]].concat(), folder.path());
    let study = json(&text(&output.stdout));
    assert!(study["linear"].is_null(), "{study}");
    let refused = study["refused"].as_str().expect("says why");
    assert!(refused.contains("actions") && refused.contains("no one threshold"), "{refused}");
}

#[test]
fn a_rule_without_a_spectrum_says_so_and_runs_its_extremes() {
    let folder = temporary();
    let arguments = ["stability", "tension", "--set", "rule.mean={kind=\"distance\"}"];
    let said = done(&arguments, folder.path());
    assert!(said.contains("no thresholds") && said.contains("nonlinear"), "{said}");
    assert!(said.contains("0 wrong") && said.contains("coordinates times 1e150"), "{said}");
    assert!(!folder.path().join("out/tension-stability/growth.csv").exists());
}
