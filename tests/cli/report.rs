//! `report.html` and `flockform gallery`, as far as they can be told without a browser (see `tests/browser`).

use std::fs::read_to_string;

use crate::program::*;

/// The data of a page.
fn data(html: &str) -> serde_json::Value {
    let (_, rest) = html.split_once("id=\"data\">").expect("a page has data");
    json(rest.split_once("</script>").expect("closed").0)
}

#[test]
fn every_command_with_an_outcome_leaves_a_report_unless_told_not_to() {
    let folder = temporary();
    for (words, stages, charts) in [
        (vec!["run", "tension"], 1, 3),
        (vec!["compare", "beam", "--truth-error", "0.01"], 2, 0),
        (vec!["swarm", "square"], 1, 2),
        (vec!["trade", "beam", "--quick"], 0, 1),
        (vec!["stability", "tension", "--quick", "--no-extremes"], 0, 2),
    ] {
        let run = |more: &[&str]| {
            let arguments = [&words[..], &["--quiet", "--force", "--out", "out"], more].concat();
            done(&arguments, folder.path());
        };
        run(&[]);
        let path = folder.path().join("out/report.html");
        let html = read_to_string(&path).expect("written");
        let shown = data(&html);
        let counts = ["stages", "plots"].map(|key| shown[key].as_array().expect("listed").len());
        assert_eq!(counts, [stages, charts], "{words:?}");
        let command = format!("<code id=\"command\">flockform {}</code>", words.join(" "));
        assert!(html.contains(&command), "{words:?}");
        run(&["--no-report"]);
        assert!(!path.exists(), "{words:?}");
    }
}

#[test]
fn a_long_run_is_told_by_evenly_spaced_frames_and_the_page_says_so() {
    let folder = temporary();
    done(&["run", "tension", "--steps", "1301", "--out", "out"], folder.path());
    let html = read_to_string(folder.path().join("out/report.html")).expect("written");
    let film = &data(&html)["stages"][0];
    let times: Vec<f64> = serde_json::from_value(film["times"].clone()).expect("numbers");
    let expected: Vec<f64> = (0..=325).map(|k| 4.0 * f64::from(k)).chain([1301.0]).collect();
    assert_eq!(times, expected);
    assert!(html.contains("Of 1301 steps one in 4 is shown, 327 frames"), "it says what it leaves out");
}

#[test]
fn a_body_that_is_solved_for_is_shown_on_its_way_under_the_load() {
    let folder = temporary();
    done(&["run", "beam-loaded", "--out", "out"], folder.path());
    let html = read_to_string(folder.path().join("out/report.html")).expect("written");
    let film = &data(&html)["stages"][0];
    assert_eq!(film["times"].as_array().expect("listed").len(), 21);
    assert_eq!(film["clock"], serde_json::json!({ "quantity": "load", "unit": "%" }));
    let quantities = film["quantities"].as_array().expect("listed").iter();
    let keys: Vec<&str> = quantities.filter_map(|one| one["key"].as_str()).collect();
    assert_eq!(keys, ["pe1", "von_mises", "strain"]);
    // What is measured is one fact of several lines.
    assert_eq!(html.matches("<dt>Mechanics</dt>").count(), 1);
    assert!(html.contains("class=\"wide\"><dt>Mechanics</dt><dd>reactions, force"), "with its lines");
}

/// A body that turns far has no even parts of what it comes to.
#[test]
fn a_comparison_shows_increments_where_all_is_proportional() {
    let folder = temporary();
    for (rotation, frames) in [("small", 21), ("corotated", 2)] {
        let mean = format!("rule.mean={{ kind = \"material\", rotation = \"{rotation}\" }}");
        let set = ["--set", &mean, "--truth-error", "0.01", "--force", "--out", "out"];
        done(&[&["compare", "beam-loaded"], &set[..]].concat(), folder.path());
        let html = read_to_string(folder.path().join("out/report.html")).expect("written");
        let film = &data(&html)["stages"][0];
        assert_eq!(film["times"].as_array().expect("listed").len(), frames, "{rotation}");
        assert_eq!(film["linear"].as_bool().unwrap_or(false), rotation == "small");
    }
}

#[test]
fn a_gallery_leads_to_the_reports_of_what_is_named() {
    let folder = temporary();
    done(&["gallery", "square", "tension", "--out", "out"], folder.path());
    let out = folder.path().join("out");
    let index = read_to_string(out.join("index.html")).expect("written");
    for report in ["scenes/tension/report.html", "swarms/square/report.html"] {
        assert!(out.join(report).is_file(), "{report}");
        assert!(index.contains(&format!("href=\"{report}\"")), "{report}");
    }
    assert_eq!(index.matches("<img").count(), 2);
    // Its own output may be replaced.
    done(&["gallery", "tension", "--out", "out", "--force", "--quiet"], folder.path());
    assert!(!out.join("swarms").exists());
}

#[test]
fn a_gallery_of_what_is_not_bundled_is_refused_with_exit_code_2_and_leaves_nothing() {
    let folder = temporary();
    refused_in(&["gallery", "tensoin", "--out", "out"], folder.path(), &["`tension`"]);
    std::fs::write(folder.path().join("mine.toml"), "").expect("written");
    refused_in(&["gallery", "mine.toml", "--out", "out"], folder.path(), &["no file is taken here"]);
    assert!(!folder.path().join("out").exists());
}
