//! Runs on ranks of bodies that each of them has whole.

use std::path::Path;

use crate::command::{flockform, text};
use crate::folders::temporary;
use crate::support::{LARGE_BEAM, assert_ends_well, assert_same, on_ranks};

#[test]
#[ignore = "needs mpirun"]
fn a_run_on_ranks_writes_the_files_of_a_run_alone() {
    let folder = temporary();
    let scenes: [(&str, &[&str]); 6] = [
        ("tension", &["--set", "record.vtk_every=20"]),
        ("tension-immediate", &[]),
        ("feedback-oscillate", &[]),
        ("fracture", &["--steps", "80"]),
        ("lattice-honeycomb", &[]),
        ("shear", &["--steps", "60"]),
    ];
    assert_alike_on_ranks(&folder, &scenes);
}

#[test]
#[ignore = "needs mpirun"]
fn equilibria_on_ranks_are_those_of_a_run_alone() {
    let folder = temporary();
    let scenes: [(&str, &[&str]); 3] = [
        ("beam-loaded", &LARGE_BEAM),
        ("plate-hole", &["--set", "equilibrium.solver=conjugate-gradients"]),
        ("elastica", &["--set", "lattice.spacing=0.5", "--set", "load_steps.increments=3"]),
    ];
    assert_alike_on_ranks(&folder, &scenes);
}

fn assert_alike_on_ranks(folder: &tempfile::TempDir, scenes: &[(&str, &[&str])]) {
    for &(name, more) in scenes {
        let alone = folder.path().join(format!("{name}-alone"));
        let arguments = |out: &Path| {
            let out = out.display().to_string();
            // Of figures of small bodies each rank lays out the whole.
            let fixed = ["run", name, "--figures", "svg", "--out"].map(str::to_owned);
            fixed.into_iter().chain([out]).chain(more.iter().map(|&one| one.to_owned())).collect::<Vec<_>>()
        };
        let words = arguments(&alone);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        assert_ends_well(&flockform(&words, folder.path()), name);
        for ranks in [2, 4] {
            let shared = folder.path().join(format!("{name}-{ranks}"));
            let words = arguments(&shared);
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let output = on_ranks(ranks, &words, folder.path());
            assert_ends_well(&output, name);
            assert_same(&shared, &alone, &format!("{name} on {ranks} ranks"));
            let said = text(&output.stdout);
            assert_eq!(said.matches("results in").count(), 1, "only one rank speaks: {said}");
        }
    }
}
