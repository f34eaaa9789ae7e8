//! Ranks that die, interrupts and full disks: what is left, and what goes on from it.

use std::hash::{BuildHasher, RandomState};
use std::process::Command;
use std::time::Instant;

use crate::command::text;
use crate::folders::temporary;
use crate::process::status;
use crate::signals::{is_sent, signal};
use crate::support::{
    PATIENCE, alone, assert_resumes, assert_same, begun, ended, mpirun, started, wait_for_checkpoint,
};
use crate::waits::within;

/// A run that is looked at after each of its steps, which take a while on ranks, with checkpoints.
#[rustfmt::skip]
const fn long(steps: &'static str) -> [&'static str; 12] {
    [
        "run", "tension", "--out", "o", "--no-report", "--figures", "none", "--quiet",
        "--checkpoint-every", "100steps", "--steps", steps,
    ]
}

const LONG: [&str; 12] = long("1500");
/// One whose ranks are not at its end yet when they are frozen for the second time.
const LONGER: [&str; 12] = long("60000");

/// Whether a signal that asks a frozen process to end waits for it.
fn is_asked_to_end(process: u32) -> bool {
    const INT: u64 = 1 << 1;
    const TERM: u64 = 1 << 14;
    let waiting = status(process, "ShdPnd").map_or(0, |bits| u64::from_str_radix(&bits, 16).expect("bits"));
    waiting & (INT | TERM) != 0
}

#[test]
#[ignore = "needs mpirun"]
fn a_killed_rank_ends_the_run_which_goes_on_with_any_number_of_ranks() {
    let expected = alone(&LONG);
    for victim in 0..3 {
        let folder = temporary();
        let (mut run, ranks) = begun(3, &LONG, (victim + 1) % 3, folder.path());
        signal("KILL", ranks[victim]);
        let killed = Instant::now();
        let (is_well, said) = ended(&mut run);
        assert!(!is_well, "{said}");
        assert!(killed.elapsed() < PATIENCE / 4, "{:?}", killed.elapsed());
        // Open MPI names the rank. MPICH names a process, which may be one that it has ended because of the other.
        let by_process = ranks.iter().any(|process| said.contains(&format!("PID {process} RUNNING")));
        assert!(by_process || said.contains(&format!("rank {victim} with PID")), "rank {victim}: {said}");
        assert!(folder.path().join("o.unfinished/checkpoint").exists(), "the last checkpoint stays");
        let what = format!("rank {victim} killed");
        assert_resumes(victim + 1, folder.path(), expected.path(), &what);
    }
}

#[test]
#[ignore = "needs mpirun"]
fn a_rank_killed_at_any_moment_costs_no_more_than_the_last_checkpoint() {
    const KILLS: usize = 20;
    let expected = alone(&LONG);
    // How long a run takes that is not disturbed, before its first checkpoint and from there to its results.
    let mut longest = {
        let folder = temporary();
        let (mut run, _) = started(2, &LONG, folder.path());
        let begin = Instant::now();
        wait_for_checkpoint(folder.path());
        let first = begin.elapsed();
        within(PATIENCE, "results", || folder.path().join("o").exists().then_some(()));
        let all = begin.elapsed();
        assert!(ended(&mut run).0);
        [first, all - first]
    };
    // Of a resumed run, one that had ended, and one without a checkpoint yet.
    let mut counts = [0; 3];
    let mut kills = 0;
    for n in 0..80 {
        let folder = temporary();
        let random = RandomState::new().hash_one(n);
        // Ranks may take longer to begin than to take all of their steps: of every other one a checkpoint is waited for.
        let (victim, is_kept) = (random as usize % 2, n % 2 == 1);
        let longest = &mut longest[usize::from(is_kept)];
        let after = longest.mul_f64((random >> 32) as f64 / 2f64.powi(32));
        let (mut run, ranks) = started(2, &LONG, folder.path());
        if is_kept {
            wait_for_checkpoint(folder.path());
        }
        std::thread::sleep(after);
        // Runs may be faster than the first: those that had ended are no kills.
        match is_sent("KILL", ranks[victim]) {
            true => kills += 1,
            false => *longest = longest.mul_f64(0.8),
        }
        let (_, said) = ended(&mut run);
        let what = format!("rank {victim} killed after {after:?} of {longest:?}, kept: {is_kept}");
        let [done, left] =
            ["o/summary.json", "o.unfinished/checkpoint"].map(|of| folder.path().join(of).exists());
        match (done, left) {
            (true, _) => assert_same(&folder.path().join("o"), &expected.path().join("o"), &what),
            (false, true) => assert_resumes(1 + n / 2 % 2, folder.path(), expected.path(), &what),
            (false, false) => assert!(!is_kept && !folder.path().join("o").exists(), "{what}: {said}"),
        }
        counts[if done { 1 } else { usize::from(!left) * 2 }] += 1;
        if kills == KILLS {
            break;
        }
    }
    println!("resumed, ended before, killed before the first checkpoint: {counts:?}");
    assert!(kills == KILLS && counts[0] > 0, "{kills} kills, {counts:?}");
}

#[test]
#[ignore = "needs mpirun"]
fn an_interrupt_of_the_launcher_ends_the_run_which_goes_on_to_the_same_bits() {
    let expected = alone(&LONGER);
    let folder = temporary();
    let (mut run, ranks) = begun(3, &LONGER, 1, folder.path());
    signal("INT", run.0.id());
    // Open MPI has the ranks go on, and passes the interrupt to them a second later.
    within(PATIENCE, "an interrupt of the ranks", || {
        // Half a second later the others have ended, and this one with them.
        let state = status(ranks[1], "State");
        if state.as_ref().is_some_and(|state| state != "T") {
            is_sent("STOP", ranks[1]);
        }
        (state.is_none() || is_asked_to_end(ranks[1])).then_some(())
    });
    is_sent("CONT", ranks[1]);
    let interrupted = Instant::now();
    let (is_well, said) = ended(&mut run);
    // MPICH's launcher, which begins its lines so, says at times that it ended well. There is a checkpoint only if the run did not.
    assert!(!is_well || said.contains("[mpiexec@"), "{said}");
    assert!(interrupted.elapsed() < PATIENCE / 4, "{:?}", interrupted.elapsed());
    assert_resumes(2, folder.path(), expected.path(), "interrupted");
}

#[test]
#[ignore = "needs mpirun"]
fn an_interrupt_of_one_rank_ends_all_at_one_step_from_which_the_run_goes_on() {
    let expected = alone(&LONG);
    let folder = temporary();
    let (mut run, ranks) = begun(3, &LONG, 1, folder.path());
    // Not by the launcher, which would kill what takes longer than it likes.
    signal("TERM", ranks[1]);
    signal("CONT", ranks[1]);
    let (is_well, said) = ended(&mut run);
    assert!(!is_well, "{said}");
    assert!(folder.path().join("o/summary.json").exists(), "the first rank writes what there is");
    assert_resumes(2, folder.path(), expected.path(), "interrupted");
}

/// On a disk of its own that is full until a checkpoint has failed.
const ON_A_FULL_DISK: &str = r#"
mount -t tmpfs -o size=400k tmpfs "$disk" && cd "$disk" && head -c 390k /dev/zero > filler || exit
"$@" > "$said" 2>&1 &
run=$!
until_it() { for _ in $(seq 300); do "$@" && return; sleep 0.1; done; echo "never: $*"; kill $run; exit; }
until_it grep -q "no checkpoint at step" "$said"
for _ in $(seq 40); do ls -A .o.partial | wc -l; sleep 0.01; done | sort -n | tail -n 1
mount -o remount,size=64m "$disk"
until_it test -e o.unfinished/checkpoint
kill -INT $run
wait $run
ls o/summary.json o.unfinished/checkpoint
"#;

#[test]
#[ignore = "needs mpirun, and leave to mount a small disk"]
fn a_full_disk_costs_checkpoints_as_long_as_it_is_full_and_no_longer() {
    let (folder, disk) = (temporary(), temporary());
    let said = folder.path().join("said");
    let run = mpirun(3, &LONGER, folder.path());
    let output = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", ON_A_FULL_DISK, "sh"])
        .arg(run.get_program())
        .args(run.get_args())
        .envs(run.get_envs().filter_map(|(name, value)| Some((name, value?))))
        .env("disk", disk.path())
        .env("said", &said)
        .output()
        .expect("unshare is there");
    let (found, said) = (text(&output.stdout), std::fs::read_to_string(&said).expect("text"));
    // Two parts at a time and the first rank's own, beside what a run begins with.
    let names: usize = found.lines().next().and_then(|line| line.parse().ok()).unwrap_or(usize::MAX);
    assert!(names <= 4, "{found}, {said}");
    // Where the ranks had no time to write what there is, the checkpoint is left.
    assert!(found.contains("o/summary.json") || found.contains("o.unfinished/checkpoint"), "{found}, {said}");
    for once in ["no checkpoint at step", "checkpoints are written again"] {
        assert_eq!(said.matches(once).count(), 1, "{found}, {said}");
    }
}
