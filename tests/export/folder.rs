//! Whose files an output folder holds, and what becomes of them: `--force` removes what flockform wrote and nothing else.

use std::fs;
use std::path::{Path, PathBuf};

use flockform::export::{ExportError, OutputFolder, VtkSeries};

use crate::files::{LIST, Run, fill};
use crate::folders::{names_in, temporary};

/// Everything below a folder, folders included, links not followed.
fn files(folder: &Path) -> Vec<PathBuf> {
    let of = |entry: fs::DirEntry| {
        let below =
            if entry.file_type().expect("known").is_dir() { files(&entry.path()) } else { Vec::new() };
        [vec![entry.path()], below].concat()
    };
    fs::read_dir(folder).expect("readable").flatten().flat_map(of).collect()
}

/// A committed output of two files, one of them in a folder.
fn former(parent: &Path) -> PathBuf {
    let out = parent.join("out");
    let folder = OutputFolder::create(&out, false).expect("created");
    fill(&folder, "summary.json");
    fs::create_dir(folder.path("steps")).expect("created");
    fs::write(folder.path("steps/step_000001.vtu"), "a frame").expect("writable");
    folder.commit().expect("committed");
    out
}

/// Puts something into a folder of outputs.
type Adversary<'a> = &'a dyn Fn(&Path);

#[test]
fn force_removes_what_the_list_names_and_refuses_where_there_is_more() {
    let adversaries: &[(&str, Adversary<'_>)] = &[
        ("thesis.tex", &|out| fs::write(out.join("thesis.tex"), "years").expect("writable")),
        ("steps/thesis.tex", &|out| fs::write(out.join("steps/thesis.tex"), "years").expect("writable")),
        ("photos", &|out| fs::create_dir(out.join("photos")).expect("created")),
        (".git", &|out| fs::create_dir(out.join(".git")).expect("created")),
        // The name of ours, and something else.
        ("summary.json", &|out| {
            fs::remove_file(out.join("summary.json")).expect("removed");
            fs::create_dir(out.join("summary.json")).expect("created");
            fs::write(out.join("summary.json/thesis.tex"), "years").expect("writable");
        }),
        // Outputs of another run that somebody has put there.
        ("inner", &|out| {
            OutputFolder::create(&out.join("inner"), false).expect("created").commit().expect("committed");
        }),
        #[cfg(unix)]
        ("steps", &|out| {
            fs::remove_dir_all(out.join("steps")).expect("removed");
            let elsewhere = out.with_file_name("elsewhere");
            fs::create_dir(&elsewhere).expect("created");
            fs::write(elsewhere.join("step_000001.vtu"), "mine").expect("writable");
            std::os::unix::fs::symlink(&elsewhere, out.join("steps")).expect("linked");
        }),
    ];
    for (named, put) in adversaries {
        let parent = temporary();
        let out = former(parent.path());
        // Made in time, and too late for the first look.
        let early = OutputFolder::create(&out, true).expect("all is ours");
        put(&out);
        let before = files(&out);
        fill(&early, "summary.json");
        let kept = early.commit().expect_err(named);
        assert!(kept.to_string().contains(named) && kept.to_string().contains("out-2"), "{named}: {kept}");
        let error = OutputFolder::create(&out, true).expect_err(named).to_string();
        assert!(error.contains(named) && error.contains("did not write"), "{named}: {error}");
        let after = files(&out);
        assert!(before.iter().all(|file| after.contains(file)), "{named}: {before:?} {after:?}");
    }
}

#[test]
fn a_list_that_somebody_wrote_reaches_nothing_outside() {
    let parent = temporary();
    let out = former(parent.path());
    fs::write(parent.path().join("important.txt"), "mine").expect("writable");
    let lines =
        format!("../important.txt\n{}\nsummary.json\nsteps\n", parent.path().join("important.txt").display());
    fs::write(out.join(LIST), lines + "steps/../../important.txt\nsteps/step_000001.vtu\n")
        .expect("writable");
    OutputFolder::create(&out, true).expect("all is ours").commit().expect("committed");
    assert_eq!(fs::read_to_string(parent.path().join("important.txt")).expect("there"), "mine");
    assert_eq!(names_in(&out), [LIST]);
}

#[test]
fn a_killed_program_s_folder_is_removed_by_the_next_one_and_a_running_one_s_is_not() {
    let parent = temporary();
    let out = parent.path().join("out");
    let first = OutputFolder::create(&out, false).expect("created");
    fill(&first, "final.csv");
    assert!(matches!(OutputFolder::create(&out, false).expect_err("taken"), ExportError::Busy(_)));
    drop(first);
    // As a killed program leaves it: no lock, a list, files.
    let partial = parent.path().join(".out.partial");
    fs::create_dir(&partial).expect("created");
    fs::write(partial.join(LIST), "final.csv\n").expect("writable");
    fs::write(partial.join("final.csv"), "half").expect("writable");
    let second = OutputFolder::create(&out, false).expect("the dead hold nothing");
    assert_eq!(names_in(&partial), [LIST]);
    second.commit().expect("committed");
    // One that holds more is somebody's.
    fs::create_dir(&partial).expect("created");
    fs::write(partial.join(LIST), "final.csv\n").expect("writable");
    fs::write(partial.join("thesis.tex"), "years").expect("writable");
    OutputFolder::create(&out, true).expect("beside it").commit().expect("committed");
    assert!(partial.join("thesis.tex").is_file());
}

#[test]
fn outputs_that_a_killed_program_had_put_aside_come_back() {
    let parent = temporary();
    let out = former(parent.path());
    fs::rename(&out, parent.path().join(".out.replaced")).expect("renamed");
    // Once they are back, the place is theirs.
    let error = OutputFolder::create(&out, false).expect_err("not empty");
    assert!(matches!(error, ExportError::NotEmpty(_)), "{error}");
    assert_eq!(names_in(parent.path()), ["out"]);
    assert!(out.join("summary.json").is_file());
}

#[test]
fn a_folder_of_another_program_is_not_taken_for_former_outputs() {
    let parent = temporary();
    let (out, other) = (parent.path().join("out"), parent.path().join(".out.replaced"));
    fs::create_dir(&other).expect("created");
    fs::write(other.join("thesis.tex"), "years").expect("writable");
    OutputFolder::create(&out, false).expect("the place is free").commit().expect("committed");
    assert!(other.join("thesis.tex").is_file());
}

#[cfg(unix)]
#[test]
fn nothing_is_written_through_a_link() {
    let parent = temporary();
    let out = parent.path().join("out");
    let victim = parent.path().join("victim");
    fs::write(&victim, "mine").expect("writable");
    let mut folder = OutputFolder::create(&out, false).expect("created");
    folder.keep_unfinished().expect("kept");
    let open = parent.path().join("out.unfinished");
    for name in ["final.csv", "summary.json", "probes.csv", "pe1_0025.svg", "pe1_0025.png", "steps.pvd", LIST]
    {
        let _ = fs::remove_file(open.join(name));
        std::os::unix::fs::symlink(&victim, open.join(name)).expect("linked");
    }
    let run = Run::of("tension", &["stop.steps=25", "record.figures=[25]"]);
    run.write_into(&folder).expect("written");
    VtkSeries::create(&folder).expect("created").finish().expect("written");
    folder.commit().expect("committed");
    assert_eq!(fs::read_to_string(&victim).expect("there"), "mine");
    assert!(fs::symlink_metadata(out.join("final.csv")).expect("there").is_file());
}

#[test]
fn of_many_that_want_one_name_each_gets_a_place_of_its_own() {
    let parent = temporary();
    let place = |n: usize| parent.path().join(format!("out-{n}"));
    // As a command does without --out: the first name that is free. Short work, so that names are filled meanwhile.
    let work = || {
        for _ in 0..100 {
            let made = (0..).find_map(|n| match OutputFolder::create(&place(n), false) {
                Err(ExportError::NotEmpty(_) | ExportError::Busy(_)) => None,
                made => Some(made.expect("refused for no other reason")),
            });
            let folder = made.expect("endless");
            fill(&folder, "summary.json");
            folder.commit().expect("no other took the place");
        }
    };
    std::thread::scope(|scope| (0..4).for_each(|_| drop(scope.spawn(work))));
    assert!((0..400).all(|n| place(n).join("summary.json").is_file()), "{:?}", names_in(parent.path()));
    assert_eq!(names_in(parent.path()).len(), 400);
}
