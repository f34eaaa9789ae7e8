//! Runs on ranks: started, asked to end, ended, and held against a run alone.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use crate::command::{flockform, text};
use crate::folders::{files, temporary};
use crate::json::json;
use crate::running::Running;
use crate::signals::signal;
use crate::waits::within;

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_flockform");
pub const PATIENCE: Duration = Duration::from_secs(60);

fn launcher() -> String {
    std::env::var("FLOCKFORM_MPIRUN").unwrap_or_else(|_| "mpirun".to_owned())
}

/// The program on so many ranks, more than there may be cores, as the user that runs the tests.
pub fn mpirun(ranks: usize, arguments: &[&str], folder: &Path) -> Command {
    let mut command = Command::new(launcher());
    command.args(["-n", &ranks.to_string(), PROGRAM]).args(arguments);
    command.current_dir(folder).env_remove("RUST_LOG");
    // Open MPI's; MPICH asks for none of it.
    for (name, value) in [
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
    ] {
        command.env(name, value);
    }
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Waits for the program on ranks, which may be waiting for each other.
pub fn on_ranks(ranks: usize, arguments: &[&str], folder: &Path) -> Output {
    let run = mpirun(ranks, arguments, folder).spawn().expect("mpirun is installed");
    let (process, (done, output)) = (run.id(), mpsc::channel());
    std::thread::spawn(move || done.send(run.wait_with_output()));
    match output.recv_timeout(2 * PATIENCE) {
        Ok(output) => output.expect("readable"),
        Err(_) => {
            signal("TERM", process);
            panic!("{arguments:?} on {ranks} ranks: not within {:?}", 2 * PATIENCE);
        }
    }
}

/// The files of a run, by their path in its folder; of the summary, what does not depend on the clock or on how the work
/// was shared. The report embeds the summary.
pub fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let read = |path: PathBuf| {
        let mut bytes = std::fs::read(&path).expect("readable");
        if path.ends_with("summary.json") {
            let mut summary = json(&text(&bytes));
            summary["timings"] = serde_json::Value::Null;
            summary["share_swept"] = serde_json::Value::Null;
            if let Some(solver) = summary["equilibrium"].as_object_mut() {
                solver.remove("phases");
            }
            bytes = summary.to_string().into_bytes();
        }
        (path.strip_prefix(folder).expect("below it").to_owned(), bytes)
    };
    let mut found: Vec<_> =
        files(folder).into_iter().filter(|path| !path.ends_with("report.html")).map(read).collect();
    found.sort();
    found
}

pub fn assert_same(found: &Path, expected: &Path, what: &str) {
    let (found, expected) = (contents(found), contents(expected));
    let names = |all: &[(PathBuf, Vec<u8>)]| all.iter().map(|(path, _)| path.clone()).collect::<Vec<_>>();
    assert_eq!(names(&found), names(&expected), "{what}");
    for ((path, bytes), (_, of_one)) in found.iter().zip(&expected) {
        assert!(bytes == of_one, "{what}: {} differs", path.display());
    }
}

pub fn assert_ends_well(output: &Output, what: &str) {
    assert!(output.status.success(), "{what}: {}", text(&output.stderr));
}

/// Five groups of columns, which two ranks share.
pub const LARGE_BEAM: [&str; 6] = [
    "--set",
    "lattice.spacing=0.1",
    "--set",
    "body.shape.max=[40.0,22.0]",
    "--set",
    "equilibrium.solver=multigrid",
];

/// What keeps a run from being looked at as a whole: each rank lays out a part of the body.
pub const PARTED: [&str; 3] = ["--no-report", "--figures", "none"];

/// A long run alone, in a folder of its own.
pub fn alone(long: &[&str]) -> tempfile::TempDir {
    let folder = temporary();
    assert_ends_well(&flockform(long, folder.path()), "alone");
    folder
}

/// A long run on ranks, and their process ids.
pub fn started(ranks: usize, long: &[&str], folder: &Path) -> (Running, Vec<u32>) {
    let run = Running(mpirun(ranks, long, folder).spawn().expect("mpirun is installed"));
    let found = || Some(ranks_of(&run.0)).filter(|found| found.len() == ranks);
    let processes = within(PATIENCE, "all ranks", found);
    (run, processes)
}

/// The same once it has kept a checkpoint; so that it does not end before it is asked to, one rank is frozen, for which the
/// others wait.
pub fn begun(ranks: usize, long: &[&str], frozen: usize, folder: &Path) -> (Running, Vec<u32>) {
    let (run, processes) = started(ranks, long, folder);
    wait_for_checkpoint(folder);
    signal("STOP", processes[frozen]);
    (run, processes)
}

/// Waits until a run has kept a checkpoint, or has ended already.
pub fn wait_for_checkpoint(folder: &Path) {
    let places = ["o.unfinished/checkpoint", "o"].map(|of| folder.join(of));
    within(PATIENCE, "a checkpoint", || places.iter().any(|place| place.exists()).then_some(()));
}

/// Waits until the launcher has ended; whether it ended well, and its words: MPICH's says on its output what went wrong.
pub fn ended(run: &mut Running) -> (bool, String) {
    let status = within(PATIENCE, "mpirun ends", || run.0.try_wait().expect("a child"));
    let mut said = String::new();
    run.0.stdout.take().expect("piped").read_to_string(&mut said).expect("text");
    run.0.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    (status.success(), said)
}

/// Resumes a long run and compares it with the one that was never disturbed.
pub fn assert_resumes(ranks: usize, folder: &Path, expected: &Path, what: &str) {
    let resume = ["run", "--resume", "o", "--no-report", "--figures", "none", "--quiet"];
    let output = if ranks == 1 { flockform(&resume, folder) } else { on_ranks(ranks, &resume, folder) };
    assert_ends_well(&output, what);
    assert_same(&folder.join("o"), &expected.join("o"), what);
}

/// Process ids of the ranks.
pub fn ranks_of(mpirun: &Child) -> Vec<u32> {
    let children = |parent: u32| -> Vec<u32> {
        let output = Command::new("ps").args(["--ppid", &parent.to_string(), "-o", "pid="]).output();
        let output = text(&output.expect("ps runs").stdout);
        output.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let is_rank = |&process: &u32| {
        let file = std::fs::read_link(format!("/proc/{process}/exe")).unwrap_or_default();
        file == Path::new(PROGRAM)
    };
    // MPICH has a process of its own in between.
    let first = children(mpirun.id());
    let second: Vec<u32> = first.iter().flat_map(|&process| children(process)).collect();
    first.into_iter().chain(second).filter(is_rank).collect()
}
