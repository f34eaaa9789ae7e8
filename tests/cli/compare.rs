//! `flockform compare` as a person meets it.

use std::path::Path;

use crate::program::*;

fn compare(folder: &Path, more: &[&str]) -> String {
    let arguments = [&["compare", "beam", "--truth-error", "0.01"], more].concat();
    let output = flockform(&arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn a_table_is_printed_and_the_results_stand_in_a_numbered_folder() {
    let folder = temporary();
    for name in ["beam-compare", "beam-compare-2"] {
        let said = compare(folder.path(), &[]);
        for words in ["at rest; truth of the shape on ", "von Mises, relative L2", "time, truth", name] {
            assert!(said.contains(words), "{words}: {said}");
        }
        assert!(folder.path().join("out").join(name).join("compare.json").is_file());
    }
}

#[test]
fn a_rule_of_large_rotations_is_told_from_a_truth_of_small_ones() {
    let folder = temporary();
    let words = "the truth is of small rotations";
    let turned = compare(folder.path(), &["--set", "rule.mean={kind=\"material\",rotation=\"corotated\"}"]);
    assert!(turned.contains(words), "{turned}");
    assert!(!compare(folder.path(), &[]).contains(words));
}

#[test]
fn json_is_the_file_and_quiet_is_quiet() {
    let folder = temporary();
    let said = compare(folder.path(), &["--json", "--out", "here"]);
    let file = std::fs::read_to_string(folder.path().join("here/compare.json")).expect("written");
    let [said, file] =
        [said, file].map(|text| serde_json::from_str::<serde_json::Value>(&text).expect("JSON"));
    assert_eq!(said, file);
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
        let output = flockform(&arguments, folder.path());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(text(&output.stderr).contains(words), "{arguments:?}: {}", text(&output.stderr));
        let left: Vec<_> = walk(folder.path());
        assert!(left.is_empty(), "{arguments:?} left {left:?}");
    }
}

/// Files below a folder.
fn walk(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).expect("readable").map(|entry| entry.expect("readable").path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
fn run_and_plan_take_scenes_whose_leaders_the_truth_leads() {
    let folder = temporary();
    for arguments in [&["run", "beam", "--quiet"][..], &["plan", "beam"]] {
        let output = flockform(arguments, folder.path());
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    }
    let last = std::fs::read_to_string(folder.path().join("out/beam/final.csv")).expect("written");
    // The upper right corner, led by the truth, is 4.08 up and 1.89 back.
    assert!(last.lines().last().is_some_and(|line| line.contains(",19.1")), "{last}");
}
