//! `flockform compare` as a person meets it.

use std::path::Path;

use crate::program::*;

fn compare(folder: &Path, more: &[&str]) -> String {
    let arguments = [&["compare", "beam", "--truth-error", "0.01"], more].concat();
    done(&arguments, folder)
}

#[test]
fn a_table_is_printed_and_the_results_stand_in_a_numbered_folder() {
    let folder = temporary();
    for name in ["beam-compare", "beam-compare-2"] {
        let said = compare(folder.path(), &[]);
        for words in ["in equilibrium; truth of the shape on ", "von Mises, relative L2", "time, truth", name]
        {
            assert!(said.contains(words), "{words}: {said}");
        }
        assert!(folder.path().join("out").join(name).join("compare.json").is_file());
    }
}

#[test]
fn a_truth_of_large_rotations_is_told_from_one_of_small_ones() {
    let folder = temporary();
    let words = "rule and truth follow the body's turns";
    let turned = compare(folder.path(), &["--set", "rule.mean={kind=\"material\",rotation=\"corotated\"}"]);
    assert!(turned.contains(words), "{turned}");
    assert!(!compare(folder.path(), &[]).contains(words));
}

#[test]
fn places_that_a_scene_names_are_told_beside_the_truth_s() {
    let folder = temporary();
    let said = done(&["compare", "cook", "--out", "o", "--no-report"], folder.path());
    assert!(said.contains("at (48, 52): rule, truth"), "{said}");
    let told = &json_in(&folder.path().join("o/compare.json"))["places"][0];
    for who in ["rule", "truth"] {
        let rise = told[who]["displacement"][1].as_f64().expect("a number");
        assert!((rise / 23.965 - 1.0).abs() < 0.003, "{told}");
    }
    refused_in(
        &["compare", "cook", "--set", "record.places=[[0.0, 50.0]]"],
        folder.path(),
        &["record.places[0]", "outside the body"],
    );
}

#[test]
fn an_accuracy_is_met_before_the_comparison() {
    let folder = temporary();
    let arguments =
        ["compare", "beam-loaded", "--out", "o", "--no-report", "--set", "equilibrium.accuracy=1%"];
    let output = flockform(&arguments, folder.path());
    let said = text(&output.stdout);
    assert!(said.starts_with("accuracy 1 %: material rule at 0.5 of the written spacing"), "{said}");
    let error = json_in(&folder.path().join("o/compare.json"))["displacement_rel_l2"].as_f64();
    assert!(error.is_some_and(|error| error < 0.01), "{error:?}");
}

#[test]
fn json_is_the_file_and_quiet_is_quiet() {
    let folder = temporary();
    let said = json(&compare(folder.path(), &["--json", "--out", "here"]));
    assert_eq!(said, json_in(&folder.path().join("here/compare.json")));
    assert!(said["von_mises_rel_l2"].as_f64().is_some_and(|error| error < 0.025), "{said}");
    assert_eq!(compare(folder.path(), &["--quiet", "--out", "here", "--force"]), "");
}

#[test]
fn what_cannot_be_compared_is_refused_with_exit_code_2_and_leaves_nothing() {
    let folder = temporary();
    for (arguments, words) in [
        (vec!["compare", "tension"], "the scene has none"),
        (vec!["compare", "beam", "--truth-error", "0"], "--truth-error"),
        (vec!["compare", "beam", "--set", "neighbours.kind=first"], "cannot carry shear coupling"),
        (vec!["compare", "beem"], "nearest bundled scene is `beam`"),
    ] {
        refused_in(&arguments, folder.path(), &[words]);
        let left = files(folder.path());
        assert!(left.is_empty(), "{arguments:?} left {left:?}");
    }
}

#[test]
fn run_and_plan_take_scenes_whose_leaders_the_truth_leads() {
    let folder = temporary();
    for arguments in [&["run", "beam", "--quiet"][..], &["plan", "beam"]] {
        done(arguments, folder.path());
    }
    let last = std::fs::read_to_string(folder.path().join("out/beam/final.csv")).expect("written");
    // The upper right corner, led by the truth, is 4.08 up and 1.89 back.
    assert!(last.lines().last().is_some_and(|line| line.contains(",19.1")), "{last}");
}
