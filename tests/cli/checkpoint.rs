//! `flockform run --resume`: a killed run goes on as if nothing had been.

use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

use crate::program::*;

/// Fracture, with probes, figures and frames: everything that a run keeps.
const RUN: [&str; 8] =
    ["run", "fracture", "--out", "o", "--set", "record.vtk_every=25", "--set", "record.figures=[50, 150]"];

/// Every file below a folder, by its path in it; what a summary says of times left out.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let timeless = |path: PathBuf| {
        let mut bytes = std::fs::read(&path).expect("readable");
        if path.ends_with("summary.json") {
            let mut summary = json(&text(&bytes));
            summary["timings"] = serde_json::Value::Null;
            bytes = summary.to_string().into_bytes();
        }
        if path.ends_with("report.html") {
            let page = String::from_utf8(bytes).expect("text");
            let page = without(&page, "<dt>Time</dt>", "</dd>");
            bytes = without(&page, "&quot;timings&quot;: {", "}").into_bytes();
        }
        (path.strip_prefix(folder).expect("below it").to_owned(), bytes)
    };
    let mut found: Vec<_> = files(folder).into_iter().map(timeless).collect();
    found.sort();
    found
}

/// A text without what stands from `begin` to the next `end`.
fn without(text: &str, begin: &str, end: &str) -> String {
    let (before, rest) = text.split_once(begin).expect("a page says how long it took");
    let (_, after) = rest.split_once(end).expect("closed");
    before.to_owned() + after
}

fn assert_same(folder: &Path, whole: &[(PathBuf, Vec<u8>)], when: &str) {
    let found = contents(folder);
    let names = |all: &[(PathBuf, Vec<u8>)]| all.iter().map(|(path, _)| path.clone()).collect::<Vec<_>>();
    assert_eq!(names(&found), names(whole), "{when}");
    for ((path, bytes), (_, expected)) in found.iter().zip(whole) {
        assert!(bytes == expected, "{when}: {} differs", path.display());
    }
}

fn wait_for(path: &Path) {
    within(Duration::from_secs(60), &path.display().to_string(), || path.exists().then_some(()));
}

fn kill(mut child: Child) {
    child.kill().expect("kills");
    child.wait().expect("ends");
}

/// A run without end that has kept a checkpoint.
fn endless(more: &[&str], folder: &Path) -> Child {
    let run =
        ["run", "tension", "--out", "o", "--set", "stop.steps=100000000", "--checkpoint-every", "1steps"];
    let child = start(&[&run[..], more].concat(), folder);
    wait_for(&folder.join("o.unfinished"));
    child
}

/// Kills a run, and the runs that go on with it, until one is done.
fn killed_until_done(folder: &Path, random: &mut impl FnMut() -> f64, whole: Duration) -> usize {
    let resume: &[&str] = &["run", "--resume", "o", "-q", "--checkpoint-every", "5ms"];
    let first = [&RUN[..], &["-q", "--checkpoint-every", "5ms"]].concat();
    for kills in 0..50 {
        let arguments = if folder.join("o.unfinished").exists() { resume } else { &first };
        let mut child = start(arguments, folder);
        if arguments != resume {
            // There is something to go on from, or nothing left to do; the rest is chance.
            let patience = Instant::now();
            while !folder.join("o.unfinished").exists() && child.try_wait().expect("a child").is_none() {
                assert!(patience.elapsed() < Duration::from_secs(60), "no checkpoint ever came");
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        let deadline = Instant::now() + whole.mul_f64(1.5 * random());
        while Instant::now() < deadline && child.try_wait().expect("a child").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let _ = child.kill();
        let output = child.wait_with_output().expect("ends");
        // A run whose folder has its name is done, even if it was killed before it could exit.
        let in_place = folder.join("o").exists() && !folder.join("o.unfinished").exists();
        if output.status.success() || in_place {
            return kills;
        }
        assert_eq!(output.status.code(), None, "{}", text(&output.stderr));
    }
    panic!("never done");
}

#[cfg(unix)]
#[test]
fn a_run_killed_at_random_and_resumed_leaves_the_files_of_a_whole_one() {
    let kills: usize = std::env::var("FLOCKFORM_KILLS").map_or(6, |kills| kills.parse().expect("a number"));
    let folder = temporary();
    let begun = Instant::now();
    done(&RUN, folder.path());
    let took = begun.elapsed();
    let whole = contents(&folder.path().join("o"));
    let mut state = 7_u64;
    let mut random = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut killed = 0;
    while killed < kills {
        let folder = temporary();
        killed += killed_until_done(folder.path(), &mut random, took);
        assert_same(&folder.path().join("o"), &whole, &format!("after {killed} kills"));
        assert!(!folder.path().join("o.unfinished").exists());
    }
}

#[cfg(unix)]
#[test]
fn a_run_killed_while_it_writes_its_results_leaves_all_of_them_when_resumed() {
    let folder = temporary();
    let every = [&RUN[..], &["-q", "--checkpoint-every", "1steps"]].concat();
    done(&RUN, folder.path());
    let whole = contents(&folder.path().join("o"));
    let unfinished = folder.path().join("o.unfinished");
    // The first of the results; pictures, which take longest, come after it.
    let first_result = unfinished.join("final.csv");
    for _ in 0..20 {
        std::fs::remove_dir_all(folder.path().join("o")).expect("there");
        let mut child = start(&every, folder.path());
        while !first_result.exists() && child.try_wait().expect("a child").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        kill(child);
        if unfinished.exists() {
            // What an interrupt leaves that came too soon for its results.
            std::fs::write(unfinished.join("steps/step_000007.vtu"), "a frame").expect("written");
            break;
        }
    }
    done(&["run", "--resume", "o", "-q"], folder.path());
    assert_same(&folder.path().join("o"), &whole, "resumed from the last step");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on_from_its_own_output() {
    let folder = temporary();
    let steps = ["--set", "stop.steps=20000", "--set", "record.vtk_every=4000"];
    let run = |out: &'static str| [&["run", "tension", "-q", "--out", out][..], &steps].concat();
    done(&run("whole"), folder.path());
    let whole = contents(&folder.path().join("whole"));
    // What cannot save within a second, on a machine that has other work, leaves what `o.unfinished` has, or nothing.
    for attempt in 0..20 {
        let mut child = start(&run("o"), folder.path());
        wait_for(&folder.path().join(".o.partial"));
        // A fast machine takes all steps in the time in which a slow one takes the first.
        std::thread::sleep(Duration::from_millis(60 - 3 * attempt));
        signal("INT", child.id());
        let status = child.wait().expect("ends");
        let left = ["o/checkpoint", "o.unfinished"].map(|name| folder.path().join(name).exists());
        // On a machine that is slow to deliver the signal all steps are taken, and only figures are interrupted.
        if status.code() == Some(1) && folder.path().join("o").exists() && !left[0] {
            std::fs::remove_dir_all(folder.path().join("o")).expect("removed");
            continue;
        }
        assert_eq!(status.code(), Some(i32::from(!folder.path().join("o").exists() || left[0])));
        if left.contains(&true) {
            done(&["run", "--resume", "o", "-q"], folder.path());
        }
        if folder.path().join("o").exists() {
            break;
        }
    }
    assert_same(&folder.path().join("o"), &whole, "after an interrupt");
}

#[cfg(unix)]
#[test]
fn a_resumed_run_that_is_killed_takes_the_place_of_the_interrupted_results_in_the_end() {
    let folder = temporary();
    let unfinished = folder.path().join("o.unfinished");
    let interrupted = |attempt: u64| {
        let every = ["--no-report", "--figures", "none", "--checkpoint-every", "2000steps"];
        let run = ["run", "tension", "-q", "--force", "--out", "o", "--set", "stop.steps=400000"];
        let mut child = start(&[&run[..], &every].concat(), folder.path());
        wait_for(&unfinished);
        std::thread::sleep(Duration::from_millis(20 * attempt));
        signal("INT", child.id());
        child.wait().expect("ends");
        folder.path().join("o/checkpoint").exists()
    };
    // A machine that has other work may have no time to save: then there is the checkpoint before.
    assert!((1..20).any(interrupted), "never in its place");
    let child = start(&["run", "--resume", "o", "-q", "--checkpoint-every", "1steps"], folder.path());
    wait_for(&unfinished.join("checkpoint"));
    kill(child);
    assert!(folder.path().join("o/checkpoint").exists() && unfinished.exists());
    // By a link, too.
    std::fs::create_dir(folder.path().join("elsewhere")).expect("writable");
    std::os::unix::fs::symlink("../o", folder.path().join("elsewhere/link")).expect("a link");
    done(&["run", "--resume", "elsewhere/link", "-q", "--no-report", "--figures", "none"], folder.path());
    assert!(!folder.path().join("o/checkpoint").exists() && !unfinished.exists());
    let summary = json(&std::fs::read_to_string(folder.path().join("o/summary.json")).expect("there"));
    assert_eq!(summary["steps"], 400_000);
    assert_eq!(names_in(folder.path()), ["elsewhere", "o"]);
}

#[test]
fn a_name_that_stands_for_an_unfinished_run_is_refused() {
    let folder = temporary();
    refused_in(&["run", "tension", "--out", "o.unfinished"], folder.path(), &["does not end in .unfinished"]);
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
}

#[cfg(unix)]
#[test]
fn a_checkpoint_that_cannot_be_gone_on_from_is_refused_by_name_and_left_alone() {
    let folder = temporary();
    kill(endless(&[], folder.path()));
    let path = folder.path().join("o.unfinished/checkpoint");
    let good = std::fs::read(&path).expect("there");
    let refused = |bytes: &[u8], arguments: &[&str], words: &[&str]| {
        std::fs::write(&path, bytes).expect("written");
        refused_in(arguments, folder.path(), words);
        assert!(std::fs::read(&path).expect("there") == bytes, "{arguments:?} changed it");
        assert!(!folder.path().join("o").exists());
    };
    let resume = ["run", "--resume", "o"];
    refused(&good[..good.len() - 1], &resume, &["o.unfinished/checkpoint is truncated", "help:"]);
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 1;
    refused(&flipped, &resume, &["o.unfinished/checkpoint is corrupted", "help:"]);
    let mut newer = good.clone();
    newer[8] = 99;
    refused(&newer, &resume, &["is of layout 99, this is layout 9", "help:"]);
    refused(b"thesis", &resume, &["is no checkpoint of flockform"]);
    let foreign = ["run", "fracture", "--resume", "o"];
    refused(&good, &foreign, &["belongs to another scene", "`title` was", "help:"]);
    let others =
        ["run", "tension", "--set", "stop.steps=100000000", "--set", "frame=mirror", "--resume", "o"];
    refused(&good, &others, &["belongs to another scene", "`frame` was \"lagged\", is \"mirror\""]);
}

#[cfg(unix)]
#[test]
fn an_unfinished_run_is_in_nobody_s_way_unless_it_is_discarded() {
    let folder = temporary();
    kill(endless(&[], folder.path()));
    let again = ["run", "tension", "--out", "o", "-q"];
    refused_in(&again, folder.path(), &["--resume", "--force"]);
    done(&[&again[..], &["--force"]].concat(), folder.path());
    assert!(!folder.path().join("o.unfinished").exists() && folder.path().join("o/final.csv").is_file());
}

#[cfg(unix)]
#[test]
fn figures_that_nobody_asked_for_until_a_run_is_gone_on_with_are_said_to_be_missing() {
    let folder = temporary();
    kill(endless(&["--figures", "none", "--set", "record.figures=[1, 99999999]"], folder.path()));
    let mut child = start(&["run", "--resume", "o"], folder.path());
    let mut said = String::new();
    let stderr = child.stderr.take().expect("piped");
    std::io::BufRead::read_line(&mut std::io::BufReader::new(stderr), &mut said).expect("text");
    kill(child);
    assert!(said.contains("there are none of steps 1\n"), "{said}");
}

#[test]
fn what_is_no_run_where_an_unfinished_one_would_be_kept_is_refused_at_the_start() {
    let folder = temporary();
    std::fs::create_dir(folder.path().join("o.unfinished")).expect("writable");
    std::fs::write(folder.path().join("o.unfinished/thesis"), "years of work").expect("writable");
    for force in [&[][..], &["--force"]] {
        refused_in(
            &[&["run", "tension", "--steps", "2", "--out", "o"], force].concat(),
            folder.path(),
            &["o.unfinished is in the way", "--out"],
        );
    }
    assert_eq!(names_in(folder.path()), ["o.unfinished"]);
}

#[cfg(unix)]
#[test]
fn a_run_that_still_runs_is_not_resumed_by_another() {
    let folder = temporary();
    let child = endless(&[], folder.path());
    refused_in(&["run", "--resume", "o"], folder.path(), &["still runs"]);
    kill(child);
}

#[cfg(unix)]
#[test]
fn a_checkpoint_that_is_a_pipe_or_a_link_is_refused() {
    let folder = temporary();
    std::fs::create_dir(folder.path().join("o.unfinished")).expect("writable");
    let checkpoint = folder.path().join("o.unfinished/checkpoint");
    let refused_soon = || {
        let mut child = start(&["run", "--resume", "o"], folder.path());
        let since = Instant::now();
        while child.try_wait().expect("a child").is_none() && since.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(5));
        }
        // One that waits for what never comes ends without a code.
        child.kill().expect("kills");
        child.wait().expect("ends").code() == Some(2)
    };
    let made = std::process::Command::new("mkfifo").arg(&checkpoint).status().expect("starts");
    assert!(made.success() && refused_soon());
    std::fs::remove_file(&checkpoint).expect("removable");
    std::os::unix::fs::symlink("nowhere", &checkpoint).expect("linked");
    refused_in(&["run", "--resume", "o"], folder.path(), &["checkpoint", "no regular file"]);
}

#[test]
fn nothing_to_resume_is_said_and_what_a_checkpoint_says_is_not_said_again() {
    let folder = temporary();
    let refused = |arguments: &[&str], word: &str| {
        refused_in(arguments, folder.path(), &[word]);
    };
    refused(&["run", "--resume", "nowhere"], "nothing to resume");
    refused(&["run", "--resume", "o", "--out", "p"], "--out");
    refused(&["run", "--resume", "o", "--steps", "3"], "SCENE");
    refused(&["run", "tension", "--checkpoint-every", "often"], "min, h or steps");
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
}

#[test]
fn checkpoints_that_there_will_be_none_of_are_cautioned_against() {
    let folder = temporary();
    let said = |every: &[&str]| {
        let run = ["run", "beam-loaded", "--force", "--out", "o", "--figures", "none", "--no-report"];
        let output = flockform(&[&run[..], every].concat(), folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    let caution = "caution: --checkpoint-every is without effect";
    assert!(said(&["--checkpoint-every", "2steps"]).contains(caution));
    for quiet in [&[][..], &["--checkpoint-every", "never"]] {
        assert!(!said(quiet).contains(caution), "{quiet:?}");
    }
}
