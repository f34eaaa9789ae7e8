//! Ctrl-C: whatever the program is doing, it ends within a second, and what it leaves is whole or not there.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::*;

/// Longest time from the signal to the end. The program promises one second; a machine that has other things to do
/// takes longer to let it.
fn patience() -> Duration {
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load: f64 = load.split_whitespace().next().and_then(|load| load.parse().ok()).unwrap_or(0.0);
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    Duration::from_secs_f64(1.0 + f64::max(0.0, load / cores - 0.5))
}

/// Waits until the program, which goes on, has come that far.
fn wait_until(child: &mut Child, is_there: impl Fn() -> bool) {
    within(Duration::from_secs(60), "its beginning", || {
        assert!(child.try_wait().expect("a child").is_none(), "it ended by itself");
        is_there().then_some(())
    });
}

/// Waits until the program is busy: it has made its hidden folder, and some time has gone by.
fn wait_until_busy(child: &mut Child, folder: &Path, busy: Duration) {
    wait_until(child, || !names_in(folder).is_empty());
    std::thread::sleep(busy);
}

/// What is said after an interrupt; the end comes in time, and with exit code 1.
fn ended(mut child: Child, what: &str) -> String {
    assert!(child.try_wait().expect("a child").is_none(), "{what}: it ended by itself");
    signal("INT", child.id());
    ended_after(child, what)
}

/// The same of a program that has its signals already.
fn ended_after(mut child: Child, what: &str) -> String {
    let (since, patience) = (Instant::now(), patience());
    while child.try_wait().expect("a child").is_none() {
        if since.elapsed() > patience {
            child.kill().expect("kills");
            panic!("{what}: not within {patience:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().expect("ended");
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{what}: {said}");
    said
}

/// A body of 62,500 particles under a rule without a fast path, and none of what asks to see every step.
const LARGE: &str = r#"
title = "Large"
unit = "m"
frame = "mirror"
[lattice]
kind = "square"
spacing = 1.0
[body]
shape = { kind = "grid", columns = 250, rows = 250 }
[rule]
mean = { kind = "power", exponent = 2.0 }
[neighbours]
kind = "first"
[[roles]]
region = { kind = "edge", side = "left" }
role = "clamped"
[[roles]]
region = { kind = "edge", side = "right" }
role = "leader"
motion = { kind = "velocity", per_step = [0.01, 0.0] }
[stop]
steps = 1000000
"#;

#[test]
fn whatever_leaves_nothing_ends_at_once_and_leaves_nothing() {
    let out = ["-q", "--out", "deep/er/o"];
    let solve = ["run", "beam-loaded", "--set", "lattice.spacing=0.03", "--set"];
    let jobs: [&[&str]; 6] = [
        &["compare", "cook", "--truth-error", "1e-7"],
        &["trade", "grips"],
        &["stability", "tension"],
        &["gallery"],
        // A solve, and the factorisation that nothing can be asked in the midst of.
        &[&solve[..], &["equilibrium={solver=\"direct\",tolerance=1e-10}"]].concat(),
        &[&solve[..], &["equilibrium={solver=\"jacobi\",tolerance=1e-14}"]].concat(),
    ];
    for job in jobs {
        let folder = temporary();
        let mut child = start(&[job, &out].concat(), folder.path());
        wait_until_busy(&mut child, folder.path(), Duration::from_millis(400));
        let said = ended(child, &format!("{job:?}"));
        assert!(said.contains("interrupted"), "{job:?}: {said}");
        assert!(names_in(folder.path()).is_empty(), "{job:?}: {:?}", files(folder.path()));
    }
}

#[test]
fn a_large_run_of_slow_steps_keeps_its_checkpoint_and_goes_on_from_it() {
    let folder = temporary();
    std::fs::write(folder.path().join("large.toml"), LARGE).expect("writable");
    let quietly = ["-q", "--no-report", "--figures", "none"];
    // A step that takes longer than a second, on a machine that has other work, is ended with nothing kept: another try.
    let kept = (0..8).any(|_| {
        let mut child = start(&[&["run", "large.toml", "--out", "o"][..], &quietly].concat(), folder.path());
        wait_until(&mut child, || folder.path().join(".o.partial").exists());
        std::thread::sleep(Duration::from_millis(700));
        let said = ended(child, "a large run");
        let is_kept = said.contains("--resume");
        let left: &[&str] = if is_kept { &["large.toml", "o.unfinished"] } else { &["large.toml"] };
        assert_eq!(names_in(folder.path()), left, "{said}");
        is_kept
    });
    assert!(kept, "a large run that is interrupted never keeps its checkpoint");
    let resumed = start(&[&["run", "--resume", "o"][..], &quietly].concat(), folder.path());
    std::thread::sleep(Duration::from_secs(2));
    ended(resumed, "the same run, resumed");
    assert_eq!(names_in(folder.path()), ["large.toml", "o.unfinished"]);
}

/// Interrupts a job until its results come in time, which a computer that has other work may not let them: then nothing is
/// kept, and it is tried again.
fn kept(job: &[&str], busy: Duration, result: &str) -> (tempfile::TempDir, String) {
    for _ in 0..8 {
        let folder = temporary();
        let mut child = start(&[job, &["--out", "o"]].concat(), folder.path());
        wait_until_busy(&mut child, folder.path(), busy);
        let said = ended(child, &format!("{job:?}"));
        let is_kept = folder.path().join("o").join(result).is_file();
        assert_ne!(is_kept, said.contains("nothing is kept"), "{said}: {:?}", files(folder.path()));
        assert!(is_kept || names_in(folder.path()).is_empty(), "{said}: {:?}", files(folder.path()));
        if is_kept {
            return (folder, said);
        }
    }
    panic!("{job:?}: its results are never kept");
}

#[test]
fn increments_that_are_solved_before_an_interrupt_are_kept() {
    let job = ["run", "beam-loaded", "--set", "load_steps={increments=20000}"];
    let (folder, _) = kept(&job, Duration::from_secs(3), "load.csv");
    let table = std::fs::read_to_string(folder.path().join("o/load.csv")).expect("kept");
    assert!(table.lines().count() > 2, "{table}");
}

#[test]
fn a_flight_keeps_what_was_flown_and_says_so() {
    let job = ["swarm", "square", "--set", "flight.duration=100000"];
    for (film, missing) in
        [(&[][..], "figures are missing"), (&["--film", "f.gif"], "figures and the film are missing")]
    {
        let (_, said) = kept(&[&job, film].concat(), Duration::from_millis(300), "flight.json");
        assert!(said.contains(missing), "{said}");
    }
}

/// Results grow with what was done: however many there are, the end comes in time, and a run can be gone on with or has left
/// nothing.
#[test]
fn results_that_take_long_to_write_keep_no_program_from_ending() {
    let endless = ["run", "tension", "--set", "stop.steps=100000000"];
    let jobs: [(&[&str], u64); 3] = [
        (&["--set", "record.vtk_every=1"], 4),
        (&[], 8),
        (&["swarm", "square", "--set", "flight.duration=100000"], 12),
    ];
    for (job, seconds) in jobs {
        let job = if job.first() == Some(&"swarm") { job.to_vec() } else { [&endless, job].concat() };
        let folder = temporary();
        let mut child = start(&[&job[..], &["-q", "--out", "o"]].concat(), folder.path());
        wait_until_busy(&mut child, folder.path(), Duration::from_secs(seconds));
        let said = ended(child, &format!("{job:?}"));
        let left = names_in(folder.path());
        match said.contains("nothing is kept") {
            true => assert!(left.is_empty(), "{left:?}"),
            false => assert!(left == ["o"] || left == ["o.unfinished"], "{left:?}: {said}"),
        }
    }
}

/// A second signal comes while results are being saved: what then stands there is whole.
#[test]
fn a_second_interrupt_leaves_no_part_of_the_results() {
    for pause in [20, 100, 300] {
        let folder = temporary();
        let frames = ["--set", "stop.steps=100000000", "--set", "record.vtk_every=1"];
        let mut child =
            start(&[&["run", "tension", "-q", "--out", "o"], &frames[..]].concat(), folder.path());
        wait_until_busy(&mut child, folder.path(), Duration::from_secs(3));
        signal("INT", child.id());
        std::thread::sleep(Duration::from_millis(pause));
        let is_sent = crate::signals::is_sent("INT", child.id());
        let said = ended_after(child, "results");
        let (kept, unfinished) = (folder.path().join("o"), folder.path().join("o.unfinished"));
        if kept.exists() {
            let list = std::fs::read_to_string(kept.join("steps.pvd")).expect("a list of frames");
            let frames = list.split("file=\"").skip(1).map(|part| part.split('"').next().expect("quoted"));
            let missing: Vec<&str> = frames.filter(|frame| !kept.join(frame).is_file()).collect();
            assert!(missing.is_empty(), "{said}: {} frames are missing", missing.len());
            assert!(!said.contains("nothing is kept"), "{said}");
        } else if unfinished.exists() {
            assert!(unfinished.join("checkpoint").is_file(), "{said}: {:?}", names_in(&unfinished));
        }
        assert!(
            kept.exists() || unfinished.exists() || said.contains("nothing is kept"),
            "{is_sent}: {said}"
        );
        assert!(!said.contains("could not be resumed"), "{said}");
    }
}

/// A pipe that is full, and that nothing empties.
#[test]
fn a_program_whose_words_are_never_taken_ends_too() {
    for signals in [1, 2] {
        let folder = temporary();
        let script = format!(
            "{{ head -c 70000 /dev/zero >&2 & sleep 0.3; exec '{}' stability tension -q --out o; }}",
            command(&[], folder.path()).get_program().to_string_lossy()
        );
        let mut shell = Command::new("sh");
        shell.args(["-c", &script]).current_dir(folder.path()).env_remove("RUST_LOG");
        let mut child = shell.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("sh starts");
        wait_until_busy(&mut child, folder.path(), Duration::from_millis(300));
        for _ in 0..signals {
            signal("INT", child.id());
        }
        ended_after(child, "a full pipe");
        assert!(names_in(folder.path()).is_empty());
    }
}

#[test]
fn a_second_interrupt_ends_at_once() {
    let folder = temporary();
    let endless = ["--set", "stop.steps=100000000", "--set", "record={}"];
    let mut child = start(&[&["run", "tension", "--out", "o"][..], &endless].concat(), folder.path());
    wait_until_busy(&mut child, folder.path(), Duration::from_millis(300));
    signal("INT", child.id());
    signal("INT", child.id());
    ended_after(child, "a second interrupt");
    let left = names_in(folder.path());
    // Whichever came first: it was all written, or a part that can be resumed, or nothing.
    assert!(left.is_empty() || left == ["o"] || left == ["o.unfinished"], "{left:?}");
}

#[test]
fn a_program_whose_words_nobody_reads_ends_too() {
    let folder = temporary();
    let mut child = start(&["stability", "tension", "-q", "--out", "o"], folder.path());
    wait_until_busy(&mut child, folder.path(), Duration::from_millis(200));
    drop(child.stderr.take());
    ended(child, "a closed pipe");
    assert!(names_in(folder.path()).is_empty());
}

#[test]
fn figures_are_not_worth_waiting_for() {
    let folder = temporary();
    let every: Vec<String> = (0..1500).map(|n| n.to_string()).collect();
    let figures = format!("record.figures=[{}]", every.join(","));
    let run = ["run", "tension", "--out", "o", "--no-report", "--set", "stop.steps=1500", "--set", &figures];
    let mut child = start(&run, folder.path());
    wait_until(&mut child, || folder.path().join(".o.partial/final.csv").exists());
    let said = ended(child, "figures");
    let left = names_in(folder.path());
    assert!(left.is_empty() || folder.path().join("o/summary.json").is_file(), "{left:?}: {said}");
}
