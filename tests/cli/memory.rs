//! The memory that `plan` predicts against that of the run.

use std::process::{Child, Stdio};
use std::time::Duration;

use super::command::command;
use super::folders::temporary;
use super::process::status;

/// The largest that a process has been, once it has ended \[byte\].
fn peak(mut child: Child) -> f64 {
    let mut most = 0.0_f64;
    loop {
        let kibibytes = status(child.id(), "VmHWM").and_then(|kibibytes| kibibytes.parse::<f64>().ok());
        most = most.max(1024.0 * kibibytes.unwrap_or(0.0));
        if let Some(ended) = child.try_wait().expect("a child") {
            assert!(ended.success(), "{ended}");
            return most;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Most runs of which one has to take what is predicted.
const TRIES: u32 = 10;

/// Share of the memory by which a prediction may be off \[1\].
const MOST_OFF: f64 = 0.1;

/// Lines that are off by more than that. On one thread: as many pictures are counted as there are threads, and on a busy computer two
/// need not paint their largest at the same moment.
fn off(scene: &str, sets: &[&str]) -> Vec<String> {
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let folder = temporary();
    let on_one_thread = |arguments: &[&str]| {
        let mut command = command(arguments, folder.path());
        command.env("RAYON_NUM_THREADS", "1");
        command
    };
    let plan = on_one_thread(&[&["plan", scene, "--json"], &sets[..]].concat()).output();
    let plan = plan.expect("the program starts");
    let plan: serde_json::Value = serde_json::from_slice(&plan.stdout).expect("JSON");
    let mut off = Vec::new();
    for (key, flags) in [("all", &[][..]), ("tables", &["--figures", "none", "--no-report"])] {
        let run = [&["run", scene, "--quiet", "--force", "--out", key], flags, &sets].concat();
        let predicted = plan["memory_bytes"][key].as_f64().expect("a number");
        let mut found = 0.0_f64;
        // On a busy computer the last of a short process is not seen: what is seen is never more than it takes.
        for _ in 0..TRIES {
            if predicted > (1.0 + MOST_OFF) * found {
                let child = on_one_thread(&run).stdout(Stdio::null()).spawn().expect("starts");
                found = found.max(peak(child));
            }
        }
        let line = format!("{scene} {key}: {:.1} MB, predicted {:.1}", found / 1e6, predicted / 1e6);
        println!("{line} ({:+.1} %)", 100.0 * (predicted / found - 1.0));
        if (predicted / found - 1.0).abs() > MOST_OFF {
            off.push(line);
        }
    }
    off
}

#[test]
fn plan_predicts_the_memory_of_a_run_within_a_tenth() {
    let cases: [(&str, &[&str]); 10] = [
        (
            "tension",
            &["body.shape.columns=400", "body.shape.rows=400", "stop.steps=60", "record.figures=[1,10,20]"],
        ),
        ("shear", &["body.shape.columns=500", "body.shape.rows=400", "stop.steps=10"]),
        ("notched-plate", &["lattice.spacing=0.1", "stop.steps=20"]),
        ("second-gradient", &["body.shape.columns=350", "body.shape.rows=350", "stop.steps=40"]),
        ("fracture", &["lattice.a=1", "lattice.b=1.1", "fracture.distance=2", "stop.steps=20"]),
        ("beam-loaded", &["lattice.spacing=0.03"]),
        ("beam-loaded", &["lattice.spacing=0.04", "load_steps.increments=2"]),
        ("beam-hexagonal", &["lattice.spacing=0.03"]),
        ("plate-hole", &["lattice.spacing=0.05"]),
        // Near incompressibility, where particles feel each other across two cells.
        ("rubber-block", &["lattice.spacing=0.07"]),
    ];
    let off: Vec<String> = cases.iter().flat_map(|(scene, sets)| off(scene, sets)).collect();
    assert!(off.is_empty(), "{off:#?}");
}

/// Of small bodies pictures take most; of a scene led by its truth the finite elements take most, before there is a plan.
#[test]
fn small_bodies_and_those_led_by_their_truth_take_what_plan_predicts() {
    let cases: [(&str, &[&str]); 8] = [
        ("tension", &[]),
        ("tension", &["body.shape.columns=140", "body.shape.rows=140", "stop.steps=60"]),
        ("shear", &["body.shape.columns=100", "body.shape.rows=100"]),
        ("fracture-slow", &[]),
        ("plate-hole", &["lattice.spacing=0.2"]),
        ("l-bracket", &[]),
        ("beam", &[]),
        ("beam-paper-5", &[]),
    ];
    let off: Vec<String> = cases.iter().flat_map(|(scene, sets)| off(scene, sets)).collect();
    assert!(off.is_empty(), "{off:#?}");
}
