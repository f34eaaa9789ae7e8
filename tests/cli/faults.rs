//! What nobody asks for and somebody will meet: runs at once, values without bounds, files that write to the terminal.

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use crate::program::*;

/// The program under a limit of the shell, which `ulimit` sets.
fn limited(limit: &str, words: &str, folder: &Path) -> Output {
    let program = command(&[], folder).get_program().to_string_lossy().into_owned();
    let script = format!("ulimit {limit}; exec '{program}' {words}");
    Command::new("sh").args(["-c", &script]).current_dir(folder).output().expect("sh starts")
}

#[test]
fn robots_over_shared_memory_are_no_nodes() {
    let folder = temporary();
    refused_in(
        &["robots", "square", "--transport", "shm", "--node-per-robot"],
        folder.path(),
        &["--node-per-robot", "help: "],
    );
}

/// 100,000 corners in teeth as high as the body, upright or slanted, and around a swarm.
#[test]
fn outlines_of_a_hundred_thousand_corners_are_answered_at_once() {
    let folder = temporary();
    let teeth = |slant: f64, [width, height]: [f64; 2]| {
        let count = 50_000;
        let corner = |k: usize| {
            let x = width * k as f64 / count as f64;
            if k.is_multiple_of(2) { [x, 0.0] } else { [x + slant * width, height] }
        };
        let corners: Vec<String> = (0..count)
            .map(corner)
            .chain([[width * (1.0 + slant), 2.0 * height], [slant * width, 2.0 * height]])
            .map(|[x, y]| format!("[{x:?}, {y:?}]"))
            .collect();
        corners.join(", ")
    };
    let round: Vec<String> = (0..100_000)
        .map(|k| (std::f64::consts::TAU * f64::from(k) / 1e5).sin_cos())
        .map(|(sin, cos)| format!("[{:?}, {:?}]", 50.0 * cos, 50.0 * sin))
        .collect();
    let rule = "title = \"T\"\nstop = { steps = 1 }\nrule = { mean = { kind = \"barycentre\" } }\n\
                neighbours = { kind = \"first\" }\n\
                roles = [{ region = { kind = \"edge\", side = \"left\" }, role = \"clamped\" }]\n";
    let body = |slant: f64, turned: f64| {
        format!(
            "{rule}lattice = {{ kind = \"square\", spacing = 1.0, orientation = {turned:?} }}\n\
             body = {{ shape = {{ kind = \"polygon\", vertices = [{}] }} }}\n",
            teeth(slant, [100.0, 50.0])
        )
    };
    let fence = format!("limits.geofence=[{}]", round.join(", "));
    let files = [("upright", body(0.0, 0.0)), ("turned", body(0.0, 30.0)), ("slanted", body(0.7, 0.0))];
    for (name, text) in &files {
        std::fs::write(folder.path().join(format!("{name}.toml")), text).expect("writable");
    }
    let swarm = flockform(&["show", "square"], folder.path());
    let fenced = text(&swarm.stdout).replace("[limits]", &format!("[limits]\n{}", &fence["limits.".len()..]));
    std::fs::write(folder.path().join("fenced.toml"), fenced).expect("writable");
    for name in ["upright", "turned", "slanted", "fenced"] {
        // Of processor time, whatever else the computer has to do.
        let output = limited("-t 5", &format!("plan {name}.toml"), folder.path());
        let said = text(&output.stderr);
        assert!(output.status.code().is_some(), "{name}: it takes more than five seconds");
        assert!(output.status.success() || said.contains("help: "), "{name}: {said}");
    }
}

#[test]
fn standard_output_that_takes_nothing_is_a_failure() {
    let folder = temporary();
    for words in
        [&["plan", "tension"][..], &["schema"], &["list", "scenes"], &["show", "square"], &["--help"]]
    {
        let full = std::fs::File::options().write(true).open("/dev/full").expect("Linux");
        let output = command(words, folder.path()).stdout(full).output().expect("starts");
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{words:?}: {said}");
        assert!(said.contains("No space left"), "{words:?}: {said}");
        // A reader that has had enough is none.
        let mut child =
            command(words, folder.path()).stdout(std::process::Stdio::piped()).spawn().expect("starts");
        drop(child.stdout.take());
        assert!(child.wait().expect("ends").success(), "{words:?}");
    }
}

#[test]
fn runs_that_begin_at_once_get_a_folder_each() {
    let folder = temporary();
    let start = || {
        let run = ["run", "tension", "-q", "--no-report", "--figures", "none"];
        command(&run, folder.path()).spawn().expect("the program starts")
    };
    let mut children: Vec<_> = (0..4).map(|_| start()).collect();
    for child in &mut children {
        assert!(child.wait().expect("ends").success());
    }
    for name in ["tension", "tension-2", "tension-3", "tension-4"] {
        assert!(folder.path().join("out").join(name).join("summary.json").is_file(), "{name}");
    }
}

#[test]
fn a_body_beyond_the_memory_that_is_there_is_refused_with_both_numbers() {
    let folder = temporary();
    let limited = |columns: &str, words: &str| {
        let body = format!("body.shape={{kind=\"grid\",columns={columns},rows={columns}}}");
        limited("-v 3000000", &format!("{words} tension --set '{body}'"), folder.path())
    };
    // At least 63 bytes a particle are 6.3 and 3.1 GB; that is known before any of it is asked for.
    for columns in ["10000", "7000"] {
        for words in ["run --out o", "plan"] {
            let words_of_both = ["GiB of memory or more", "`ulimit -v`", "help: "];
            assert_refused(&limited(columns, words), columns, &words_of_both);
        }
    }
    // With their lists, 79 bytes each, 0.71 GB: beside the program that is too much, or just enough.
    let body = "body.shape={kind=\"grid\",columns=3000,rows=3000}";
    for limit in ["-v 800000", "-v 900000", "-v 1000000"] {
        let output = self::limited(limit, &format!("run tension --out o --set '{body}'"), folder.path());
        let said = text(&output.stderr);
        assert!(output.status.code().is_some(), "{limit}: {said}");
        assert!(output.status.success() || said.contains("`ulimit -v`"), "{limit}: {said}");
    }
    assert!(names_in(folder.path()).is_empty());
    let small = limited("20", "plan");
    assert!(small.status.success(), "{}", text(&small.stderr));
}

/// 20,000 points in one place see 4e8 others: 3.2 GB of lists, which are counted before there are any.
#[test]
fn points_whose_lists_are_beyond_the_memory_that_is_there_are_refused_as_a_body_is() {
    let folder = temporary();
    let places =
        (0..20_000).map(|k| format!("{:e},{:e}\n", 1e-10 * f64::from(k % 200), 1e-10 * f64::from(k / 200)));
    std::fs::write(folder.path().join("heap.csv"), "x,y\n".to_owned() + &places.collect::<String>())
        .expect("written");
    let scene = "title = \"heap\"\nbody = { shape = { kind = \"points\", file = \"heap.csv\" } }\n\
                 neighbours = { kind = \"within\", radius = 1.5 }\nstop = { steps = 1 }\n";
    std::fs::write(folder.path().join("heap.toml"), scene).expect("written");
    for words in ["run heap.toml --out o", "plan heap.toml"] {
        let output = limited("-v 2500000", words, folder.path());
        assert_refused(&output, words, &["GiB of memory or more", "`ulimit -v`"]);
    }
    assert_eq!(names_in(folder.path()), ["heap.csv", "heap.toml"]);
}

#[cfg(unix)]
#[test]
fn a_scene_that_is_a_link_to_nothing_or_to_itself_is_refused_as_such() {
    let folder = temporary();
    for (to, words) in [("nowhere", "a link to a file that is not there"), ("scene", "symbolic links")] {
        let _ = std::fs::remove_file(folder.path().join("scene"));
        std::os::unix::fs::symlink(to, folder.path().join("scene")).expect("linked");
        refused_in(&["run", "scene"], folder.path(), &[words, "help: "]);
    }
}

#[cfg(unix)]
#[test]
fn names_that_are_not_utf_8_are_taken_as_they_are_or_refused_in_words() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStringExt;
    let odd = |before: &str, after: &str| {
        OsString::from_vec([before.as_bytes(), b"\xff", after.as_bytes()].concat())
    };
    let folder = temporary();
    let inside = folder.path().join(odd("in", ""));
    std::fs::create_dir(&inside).expect("a folder");
    std::fs::write(inside.join("s.toml"), text(&flockform(&["show", "tension"], folder.path()).stdout))
        .expect("written");
    let run = |words: &[&OsStr]| command(&[], &inside).args(words).output().expect("starts");
    let named = [("--out", odd("o", "")), ("--record", odd("r", ".mcap")), ("--film", odd("f", ".gif"))];
    let words = ["run", "s.toml", "--steps", "2", "-q"].map(OsStr::new);
    let options = named.iter().flat_map(|(option, name)| [OsStr::new(*option), name]);
    let output = run(&words.into_iter().chain(options).collect::<Vec<_>>());
    assert!(output.status.success(), "{}", text(&output.stderr));
    for (_, name) in &named {
        assert!(inside.join(name).exists(), "{name:?}");
    }
    assert!(inside.join(&named[0].1).join("report.html").is_file());
    let prefix = odd("p", "");
    let output = run(&[OsStr::new("install"), OsStr::new("--prefix"), &prefix]);
    assert!(output.status.success() && inside.join(&prefix).join("setup.bash").is_file());
    assert_eq!(std::fs::read_dir(&inside).expect("a folder").count(), 5, "nothing else");
    let (scene, set) = (odd("s", ".toml"), odd("title=", ""));
    let [tension, key] = ["tension", "--set"].map(OsStr::new);
    for command in ["run", "compare", "plan"].map(OsStr::new) {
        for refused in [&[command, &scene][..], &[command, tension, key, &set]] {
            assert_refused(&run(refused), &format!("{refused:?}"), &["UTF-8"]);
        }
    }
}

#[test]
fn values_that_overflow_end_as_a_divergence() {
    for pull in ["1e155", "1e200", "1e308"] {
        let folder = temporary();
        let motion = format!("roles[1].motion.per_step=[{pull},0.0]");
        let run = ["run", "tension", "--out", "o", "--no-report", "--figures", "none", "--set", &motion];
        let said = failed(&[&run[..], &["--set", "stop.divergence_ratio=1e300"]].concat(), folder.path());
        assert!(said.contains("diverged"), "{pull}: {said}");
        let summary = json_in(&folder.path().join("o/summary.json"));
        assert_eq!(summary["stop_reason"], "diverged", "{pull}");
        assert!(summary["energies"]["pe1"].is_number(), "{pull}: {}", summary["energies"]);
    }
}

#[test]
fn control_characters_of_a_file_never_reach_the_terminal() {
    let folder = temporary();
    let path = folder.path().join("a\u{1b}[2Jb.toml");
    let scene = flockform::scene::bundled("tension").expect("bundled").text;
    let escape = "title = \"\\u001B]0;owned\\u0007 \\u009B2J \\u202Ekcab\"\nxtitle = ";
    let quiet = ["--no-report", "--figures", "svg", "--out", "o", "--force"];
    for text_of_scene in [scene.replacen("title = ", escape, 1), format!("\u{1b}[2J = 1\n{scene}")] {
        std::fs::write(&path, text_of_scene.replace("xtitle", "notes")).expect("writable");
        let name = path.file_name().expect("a name").to_str().expect("text");
        for command in [&["run", name][..], &["plan", name]] {
            let more: &[&str] = if command[0] == "run" { &quiet } else { &[] };
            let output = flockform(&[command, more].concat(), folder.path());
            let said = text(&output.stdout) + &text(&output.stderr);
            assert!(!said.contains(['\u{1b}', '\u{7}', '\u{9b}', '\u{202e}']), "{command:?}: {said:?}");
            assert!(said.len() > 20, "{command:?}: {said}");
        }
    }
}

#[test]
fn a_radius_beyond_everything_is_refused_at_once() {
    for sets in [
        &["neighbours={kind=\"within\",radius=1e9}"][..],
        &["neighbours={kind=\"within\",radius=300.0}", "body.shape={kind=\"grid\",columns=900,rows=900}"],
        &["neighbours={kind=\"dynamic\",radius=1e9}", "body.shape={kind=\"grid\",columns=900,rows=900}"],
    ] {
        let begun = Instant::now();
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let arguments = [&["plan", "tension"][..], &sets, &["--set", "frame=none"]].concat();
        refused(&arguments, &["neighbours", "at most"]);
        assert!(begun.elapsed() < Duration::from_secs(20), "{sets:?}: {:?}", begun.elapsed());
    }
}

#[test]
fn a_body_that_nothing_holds_is_refused_with_the_remedy() {
    let sets = ["roles=[]", "equilibrium={}", "record={}"];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).collect();
    let words = ["connected to no held particle", "help: clamp or lead particles of each part of the body"];
    refused(&[&["run", "tension"][..], &sets].concat(), &words);
}

#[test]
fn shapes_that_no_lattice_follows_are_refused_by_name_and_place() {
    let plate = "shape = { kind = \"rectangle\", max = [20.0, 10.0] }";
    let disc = |centre: [f64; 2], radius: f64| {
        format!("{{ kind = \"disc\", centre = {centre:?}, radius = {radius:?} }}")
    };
    let holes = |discs: &[String]| format!("body={{ {plate}, holes = [{}] }}", discs.join(", "));
    let lattice = |second: &str| {
        let first = disc([14.0, 5.0], 2.0);
        format!("body={{ {plate}, outline = \"lattice\", holes = [{first}, {second}] }}")
    };
    let polygon =
        |vertices: &str| format!("body={{ shape = {{ kind = \"polygon\", vertices = [{vertices}] }} }}");
    let cases = [
        (
            polygon("[0.0, 0.0], [20.0, 10.0], [20.0, 0.0], [0.0, 10.0]"),
            "body.shape",
            "crosses or touches itself near (10.000000, 5.000000)",
        ),
        (
            polygon("[0.0, 0.0], [20.0, 0.0], [8.0, 0.0]"),
            "body.shape",
            "has no area near (0.000000, 0.000000)",
        ),
        // Narrow, a bridge between two holes, one between a hole and the edge, a hole that no cell leaves room for.
        (
            "body.shape={ kind = \"rectangle\", max = [20.0, 0.7] }".to_owned(),
            "body.shape",
            "0.700000 wide near (0.2",
        ),
        (holes(&[disc([7.0, 5.0], 2.0), disc([11.5, 5.0], 2.0)]), "body.holes[1]", "wide near (8.9"),
        (holes(&[disc([7.0, 5.0], 1.0), disc([14.0, 2.4], 2.0)]), "body.holes[1]", "wide near (12."),
        (
            holes(&[disc([7.0, 5.0], 2.0), disc([14.0, 5.0], 0.3)]),
            "body.holes[1]",
            "hole 2 is 0.600000 across",
        ),
        // Holes that a body of whole cells would leave out: between sites, and outside.
        (lattice(&disc([4.5, 4.9], 0.5)), "body.holes[1]", "takes no particle out of the body"),
        (lattice(&disc([40.0, 4.5], 2.0)), "body.holes[1]", "takes no particle out of the body"),
        (lattice(&disc([1e12, 4.5], 2.0)), "body.holes[1]", "takes no particle out of the body"),
    ];
    for (body, key, words) in cases {
        let sets = ["--set", &body, "--set", "lattice.spacing=1.0", "--set", "record.places=[]"];
        refused(&[&["run", "bar", "--out", "o"][..], &sets].concat(), &[key, words, "help: "]);
    }
}
