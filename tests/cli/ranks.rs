//! A program without MPI that is started as one of several ranks.

use std::process::Output;

use crate::command::{assert_refused, command, text};
use crate::folders::{names_in, temporary};

/// Variables of each launcher that make this the given one of four ranks.
const LAUNCHERS: [[&str; 2]; 3] = [
    ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"],
    ["PMI_SIZE", "PMI_RANK"],
    ["SLURM_STEP_NUM_TASKS", "SLURM_PROCID"],
];

fn as_rank(rank: &str, count: &str, [size, own]: [&str; 2], arguments: &[&str]) -> (Output, Vec<String>) {
    let folder = temporary();
    let output = command(arguments, folder.path()).env(size, count).env(own, rank).output();
    (output.expect("the program starts"), names_in(folder.path()))
}

const RUN: [&str; 4] = ["run", "tension", "--steps", "3"];

#[test]
fn one_of_several_ranks_refuses_to_make_the_whole_run_and_names_the_feature() {
    for launcher in LAUNCHERS {
        let (output, left) = as_rank("0", "4", launcher, &RUN);
        assert_refused(&output, launcher[0], &[launcher[0], "one of 4 ranks", "--features mpi", "env -u"]);
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn the_first_rank_speaks_for_all() {
    let (output, left) = as_rank("3", "4", LAUNCHERS[0], &RUN);
    // The launcher would end the first one, before it has spoken, if this one failed.
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty() && output.stdout.is_empty() && left.is_empty());
}

#[test]
fn the_first_rank_speaks_of_a_command_line_that_none_can_read_and_prints_the_help() {
    for (arguments, code, words) in [
        (&["run", "tension", "--stepps", "3"][..], 2, "--stepps"),
        (&["run", "--help"], 0, "Usage"),
        (&["rum"], 2, "rum"),
    ] {
        for launcher in LAUNCHERS {
            let said = |rank: &str| {
                let (output, _) = as_rank(rank, "4", launcher, arguments);
                (output.status.code(), text(&output.stdout) + &text(&output.stderr))
            };
            let (found, first) = said("0");
            assert!(found == Some(code) && first.contains(words), "{first}");
            assert_eq!(said("2"), (Some(0), String::new()), "{arguments:?}");
        }
    }
}

#[test]
fn studies_that_would_write_over_each_other_refuse_too() {
    for arguments in [["compare", "beam"], ["swarm", "gap"], ["stability", "tension"]] {
        let (output, left) = as_rank("0", "2", LAUNCHERS[1], &arguments);
        assert_refused(&output, arguments[0], &[&format!("`{}` runs on one", arguments[0])]);
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn a_single_rank_is_a_program_like_any_other_and_so_are_commands_that_write_nothing() {
    let (output, _) =
        as_rank("0", "1", LAUNCHERS[0], &["run", "tension", "--steps", "3", "--quiet", "--no-report"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let (output, _) = as_rank("1", "2", LAUNCHERS[0], &["list", "scenes"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("tension"));
}
