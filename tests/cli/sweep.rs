//! `flockform sweep`: the table and whatever must not change it.

use std::path::Path;
use std::process::Child;
use std::time::{Duration, Instant};

use crate::program::*;

/// The cells of a table, its head first.
pub fn table(path: impl AsRef<Path>) -> Vec<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(path).expect("a table");
    let cells = |row: csv::StringRecord| row.iter().map(str::to_owned).collect();
    reader.records().map(|row| cells(row.expect("a row"))).collect()
}

const VARY: [&str; 4] = ["--vary", "update.damping=0.5:1:3", "--vary", "stop.steps=[20, 40]"];

#[test]
fn a_sweep_has_the_numbers_of_single_runs() {
    let folder = temporary();
    let outputs = "energies.pe1,steps,probe.67.ux@20,probe.67.x";
    done(&[&["sweep", "tension", "--outputs", outputs, "--out", "o"], &VARY[..]].concat(), folder.path());
    let rows = table(folder.path().join("o/sweep.csv"));
    assert_eq!(
        rows[0].join(","),
        "run,update.damping,stop.steps,energies.pe1,steps,probe.67.ux@20,probe.67.x,stop_reason,reason,cautions"
    );
    assert_eq!(rows.len(), 7);
    let varied: Vec<String> = rows[1..].iter().map(|row| row[1..3].join(" ")).collect();
    assert_eq!(varied, ["0.5 20", "0.5 40", "0.75 20", "0.75 40", "1 20", "1 40"]);
    let set = ["--set", "update.damping=0.75", "--set", "stop.steps=40"];
    // Probed twice, kept once.
    let twice = ["--set", "record.probes=[67,67,1]"];
    let run = ["run", "tension", "-q", "--figures", "none", "--no-report", "--out", "single"];
    done(&[&run[..], &set, &twice].concat(), folder.path());
    let (summary, single) = (read(folder.path().join("single/summary.json")), &rows[4]);
    assert!(summary.contains(&format!("\"pe1\": {},", single[3])), "{single:?} {summary}");
    assert_eq!((single[4].as_str(), single[7].as_str()), ("40", "steps"));
    let probes = table(folder.path().join("single/probes.csv"));
    assert_eq!(probes.iter().filter(|row| row[0] == "20").count(), 2);
    let place = |step: &str| -> f64 {
        let row = probes.iter().find(|row| row[0] == step && row[1] == "67").expect("probed");
        row[2].parse().expect("a number")
    };
    let number = |text: &str| -> f64 { text.parse().expect("a number") };
    assert!((number(&single[5]) - (place("20") - place("0"))).abs() < 1e-12, "{single:?}");
    assert_eq!(number(&single[6]), place("40"));
    assert!(folder.path().join("o/sweep.svg").is_file() && folder.path().join("o/sweep.png").is_file());
}

#[test]
fn cautions_of_single_runs_are_those_of_a_sweep() {
    let folder = temporary();
    let vary = "lattice.spacing=[2.0,0.25]";
    let outputs = "mechanics.largest_von_mises.von_mises";
    let sweep = ["sweep", "plate-hole", "--vary", vary, "--outputs", outputs, "--out", "o"];
    let said = flockform(&sweep, folder.path());
    assert!(
        said.status.success() && text(&said.stderr).contains("caution: 1 of 2 runs with cautions"),
        "{said:?}"
    );
    let rows = table(folder.path().join("o/sweep.csv"));
    let of = |row: usize| rows[row].last().expect("a column").as_str();
    assert!(of(1).contains("stress is too low") && of(2).is_empty(), "{rows:?}");
}

#[test]
fn threads_and_shards_do_not_change_a_byte_of_the_table() {
    let folder = temporary();
    let sweep = |more: &[&str]| {
        let common = ["sweep", "tension", "--figures", "none", "-q"];
        done(&[&common[..], &VARY, more].concat(), folder.path())
    };
    sweep(&["--out", "one", "--threads", "1"]);
    sweep(&["--out", "many", "--threads", "5"]);
    let one = read(folder.path().join("one/sweep.csv"));
    assert_eq!(read(folder.path().join("many/sweep.csv")), one);
    for shard in ["1/3", "2/3", "3/3"] {
        sweep(&["--shard", shard]);
    }
    let parts = ["tension-sweep-1-of-3", "tension-sweep-2-of-3", "tension-sweep-3-of-3"];
    let parts = parts.map(|part| format!("out/{part}"));
    assert_eq!(table(folder.path().join(&parts[1]).join("sweep.csv")).len(), 3, "a head and two of six");
    // In any order.
    done(&["sweep", "--merge", &parts[2], &parts[0], &parts[1], "--out", "all", "-q"], folder.path());
    assert_eq!(read(folder.path().join("all/sweep.csv")), one);
    // Without one it says so, and the rest can be made.
    let output = flockform(&["sweep", "--merge", &parts[0], &parts[2], "--out", "two"], folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(
        text(&output.stderr).contains("2 runs are missing, the first is run 1"),
        "{}",
        text(&output.stderr)
    );
    assert_eq!(table(folder.path().join("two/sweep.csv")).len(), 5);
    done(&["sweep", "--resume", "two", "-q"], folder.path());
    assert_eq!(read(folder.path().join("two/sweep.csv")), one);
    // As if that had been killed before its last run: it goes on into the place of the merged runs.
    let (two, unfinished) = (folder.path().join("two"), folder.path().join("two.unfinished"));
    std::fs::create_dir(&unfinished).expect("writable");
    for file in files(&two) {
        std::fs::copy(&file, unfinished.join(file.file_name().expect("a name"))).expect("writable");
    }
    let rows = read(two.join("runs.jsonl"));
    let kept: Vec<&str> = rows.split_inclusive('\n').take(5).collect();
    std::fs::write(unfinished.join("runs.jsonl"), kept.concat()).expect("writable");
    done(&["sweep", "--resume", "two", "-q"], folder.path());
    assert_eq!(read(two.join("sweep.csv")), one);
    sweep(&["--out", "other", "--set", "lattice.spacing=2.0"]);
    refused_in(
        &["sweep", "--merge", "one", "other", "--out", "none"],
        folder.path(),
        &["not parts of one sweep"],
    );
    assert!(!folder.path().join("none").exists());
}

#[test]
fn samples_are_those_of_their_seed() {
    let folder = temporary();
    let draw = |seed: &str, sampling: &str, out: &str| {
        let arguments =
            ["sweep", "tension", "--vary", "update.damping=0.1:1", "--samples", "8", "--seed", seed];
        let more = ["--sampling", sampling, "--set", "stop.steps=5", "--figures", "none", "-q", "--out", out];
        done(&[&arguments[..], &more].concat(), folder.path());
        read(folder.path().join(out).join("sweep.csv"))
    };
    let first = draw("1", "latin-hypercube", "a");
    assert_eq!(draw("1", "latin-hypercube", "b"), first);
    assert_ne!(draw("2", "latin-hypercube", "c"), first);
    assert_ne!(draw("1", "random", "d"), first);
    let mut parts: Vec<usize> = table(folder.path().join("a/sweep.csv"))[1..]
        .iter()
        .map(|row| (8.0 * (row[1].parse::<f64>().expect("a number") - 0.1) / 0.9) as usize)
        .collect();
    parts.sort_unstable();
    assert_eq!(parts, [0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn runs_that_the_scene_refuses_are_rows_that_say_why() {
    let folder = temporary();
    let arguments = ["sweep", "tension", "--vary", "update.damping=[0.5, -1, 1]", "--set", "stop.steps=5"];
    let said = failed(&[&arguments[..], &["--out", "o", "--json"]].concat(), folder.path());
    let rows = table(folder.path().join("o/sweep.csv"));
    let ended: Vec<&str> = rows[1..].iter().map(|row| row[row.len() - 3].as_str()).collect();
    assert_eq!(ended, ["steps", "refused", "steps"]);
    assert!(rows[2][rows[2].len() - 2].contains("update.damping"), "{rows:?}");
    let json = json(&said);
    assert_eq!(
        (json[1]["update.damping"].as_f64(), json[1]["stop_reason"].as_str()),
        (Some(-1.0), Some("refused"))
    );
    assert!(json[0]["residual"].is_f64() && json[1]["residual"].is_null(), "{json}");
}

#[test]
fn what_cannot_be_swept_is_refused_and_leaves_nothing() {
    let sweep = |more: &[&str], words: &[&str]| {
        refused(&[&["sweep", "tension", "--set", "stop.steps=2"], more].concat(), words);
    };
    let damping = ["--vary", "update.damping=0.5:1:2"];
    sweep(&["--vary", "update.dampnig=0.5:1:2"], &["dampnig"]);
    sweep(&["--vary", "update.damping"], &["--vary update.damping", "KEY=FROM:TO:COUNT"]);
    sweep(&["--vary", "update.damping=0.5:1"], &["--samples"]);
    sweep(&["--vary", "a=0:1:2000", "--vary", "b=0:1:2000"], &["more than 1000000 runs"]);
    sweep(&[&damping[..], &damping].concat(), &["twice"]);
    let part = ["--vary", "update=[{damping=0.5},{damping=0.9}]"];
    sweep(&[&damping[..], &part].concat(), &["twice", "--vary update.damping", "--vary update\n", "help: "]);
    sweep(&[&part[..], &["--vary", "update . \"damping\"=[1]"]].concat(), &["twice"]);
    sweep(&["--vary", "update.damping=[nan, -1]"], &["--vary update.damping=nan: "]);
    sweep(&[&damping[..], &["--outputs", "energies.pe9"]].concat(), &["energies.pe9", "pe1, pe2"]);
    sweep(&[&damping[..], &["--outputs", "energies"]].concat(), &["energies.pe1"]);
    sweep(&[&damping[..], &["--outputs", "probe.999999.x"]].concat(), &["no particle 999999"]);
    sweep(&[&damping[..], &["--outputs", "probe.67.ux@3"]].concat(), &["the last step is 2", "stop.steps"]);
    let longer = ["--vary", "stop.steps=[9, 4]", "--outputs", "probe.67.ux@10"];
    refused(&[&["sweep", "tension"], &longer[..]].concat(), &["the last step is 9"]);
    let both = [&damping[..], &["--set", "update.damping=0.1"]].concat();
    sweep(&both, &["--set: `update.damping=0.1` has no effect", "--vary"]);
    sweep(&["--vary", "roles[1].motion=[1, 2]", "--set", "roles.1.motion.kind=velocity"], &["has no effect"]);
    // The first run is refused, the last shows what there is.
    let refused_first = ["--vary", "update.damping=[-1, 0.5]"];
    sweep(&[&refused_first[..], &["--outputs", "energies.pe9"]].concat(), &["energies.pe9", "pe1, pe2"]);
    sweep(&[&damping[..], &["--threads", "2000"]].concat(), &["--threads", "1024"]);
    sweep(&[&damping[..], &["--shard", "5/4"]].concat(), &["--shard 5/4"]);
    sweep(&[&damping[..], &["--plot", "steps", "--outputs", "residual"]].concat(), &["--plot", "residual"]);
    sweep(&["--vary", "update.damping=0.5:1:4", "--samples", "3"], &["--samples"]);
    sweep(&["--vary", "stop.steps=1:2:5"], &["two of its 5 values are 1"]);
    refused(&["sweep", "tension"], &["--vary"]);
    refused(&["sweep", "square", "--vary", "a=0:1:2"], &["`square` is a swarm"]);
    refused(&["sweep", "--resume", "nowhere"], &["nowhere.unfinished", "holds a sweep"]);
    refused(&["sweep", "--resume", "nowhere", "--vary", "a=0:1:2"], &["--vary", "cannot be used with"]);
    refused(&["sweep", "--merge", "nowhere", "--set", "a=0"], &["--set", "cannot be used with"]);
}

#[test]
fn ids_that_are_other_particles_in_each_run_are_a_caution() {
    let folder = temporary();
    let cautions = |more: &[&str]| {
        let sweep = ["sweep", "tension", "--set", "stop.steps=2", "--figures", "none", "--force"];
        let output = flockform(&[&sweep[..], more].concat(), folder.path());
        text(&output.stderr)
    };
    let columns = ["--vary", "body.shape.columns=[10, 12]"];
    let is_cautioned = |more: &[&str]| cautions(more).contains("then another one's");
    assert!(is_cautioned(&[&columns[..], &["--outputs", "probe.67.ux"]].concat()));
    assert!(is_cautioned(&[&columns[..], &["--set", "roles[1].region={kind=\"ids\",ids=[100]}"]].concat()));
    assert!(!is_cautioned(&[&columns[..], &["--outputs", "energies.pe1"]].concat()));
    assert!(!is_cautioned(&["--vary", "update.damping=[0.5, 0.8]", "--outputs", "probe.67.ux"]));
}

#[test]
fn the_last_line_says_how_the_runs_ended() {
    let folder = temporary();
    let of = |more: &[&str]| {
        let sweep = ["sweep", "tension", "--vary", "update.damping=[0.5, 0.8]", "--figures", "none"];
        done(&[&sweep[..], more].concat(), folder.path())
    };
    let words = of(&["--set", "stop.steps=3"]);
    assert!(words.contains("tension: 2 runs, all ended at stop.steps, "), "{words}");
    let words = of(&["--set", "stop.steps=100000", "--set", "stop.tolerance=1e-3"]);
    assert!(words.contains("tension: 2 runs, all came to equilibrium, "), "{words}");
    let words = of(&["--set", "stop.steps=3", "--shard", "4/5"]);
    assert!(words.contains("tension: no runs: this shard has none of the study's, "), "{words}");
}

#[test]
fn twenty_runs_of_tension_take_a_moment() {
    // About a tenth of a second each, unoptimised; a sweep that waits for something is far off.
    let patience = Duration::from_secs(20);
    let folder = temporary();
    let took = (0..3).map(|n| {
        let start = Instant::now();
        let out = format!("o{n}");
        done(&["sweep", "tension", "--vary", "update.damping=0.5:1:20", "-q", "--out", &out], folder.path());
        start.elapsed()
    });
    let took = took.min().expect("three times");
    assert!(took < patience, "{took:?}");
}

/// A sweep that is not over when its first rows are seen, however fast the machine.
const LONG: [&str; 7] =
    ["sweep", "tension", "--vary", "update.damping=0.5:1:40", "--set", "stop.steps=100000", "-q"];

/// A sweep of which some runs have ended, and not all.
fn begun(folder: &Path) -> Child {
    let more = ["--out", "o", "--figures", "none", "--threads", "1"];
    let child = start(&[&LONG[..], &more].concat(), folder);
    let journal = folder.join("o.unfinished/runs.jsonl");
    within(Duration::from_secs(120), "some runs have ended", || {
        let rows = std::fs::read_to_string(&journal).unwrap_or_default();
        (rows.lines().count() >= 3).then_some(())
    });
    child
}

/// The table of an uninterrupted sweep.
fn undisturbed(folder: &Path) -> String {
    done(&[&LONG[..], &["--out", "whole", "--figures", "none"]].concat(), folder);
    read(folder.join("whole/sweep.csv"))
}

#[test]
fn a_killed_sweep_goes_on_with_the_runs_that_had_not_ended() {
    let folder = temporary();
    let mut child = begun(folder.path());
    signal("KILL", child.id());
    assert!(!child.wait().expect("a child").success(), "it was killed before its end");
    let journal = folder.path().join("o.unfinished/runs.jsonl");
    let kept = read(&journal);
    // As a power cut might leave it.
    std::fs::write(&journal, format!("{kept}{{\"run\":39,\"stop_re")).expect("writable");
    let again = ["sweep", "tension", "--vary", "update.damping=0.5:1:2", "--out", "o"];
    refused_in(&again, folder.path(), &["flockform sweep --resume"]);
    done(&["sweep", "--resume", "o", "-q", "--figures", "none"], folder.path());
    assert!(!folder.path().join("o.unfinished").exists());
    let all = read(folder.path().join("o/runs.jsonl"));
    assert!(all.starts_with(&kept), "the runs that had ended were not made again");
    assert_eq!(all.lines().count(), 40);
    assert_eq!(read(folder.path().join("o/sweep.csv")), undisturbed(folder.path()));
}

#[test]
fn ctrl_c_ends_a_sweep_soon_and_keeps_its_rows() {
    let folder = temporary();
    let child = begun(folder.path());
    let since = Instant::now();
    signal("INT", child.id());
    let output = child.wait_with_output().expect("a child");
    assert!(since.elapsed() < Duration::from_secs(5), "{:?}", since.elapsed());
    let words = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("interrupted: `flockform sweep --resume"), "{words}");
    assert!(!folder.path().join("o").exists());
    assert!(read(folder.path().join("o.unfinished/runs.jsonl")).lines().count() >= 3);
    done(&["sweep", "--resume", "o.unfinished", "-q", "--figures", "none"], folder.path());
    assert_eq!(read(folder.path().join("o/sweep.csv")), undisturbed(folder.path()));
}

#[test]
fn runs_of_a_scene_that_has_changed_are_not_gone_on_with() {
    let folder = temporary();
    done(&["new", "scene", "mine"], folder.path());
    let arguments = ["sweep", "mine.toml", "--vary", "update.damping=0.5:1:4", "--shard", "1/2", "-q"];
    done(&[&arguments[..], &["--out", "o", "--figures", "none"]].concat(), folder.path());
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, read(&path).replace("steps = 401", "steps = 40")).expect("writable");
    refused_in(&["sweep", "--resume", "o"], folder.path(), &["are of another"]);
    assert_eq!(table(folder.path().join("o/sweep.csv")).len(), 3);
}
