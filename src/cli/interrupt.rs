//! Ctrl-C and SIGTERM: one flag, and an end within a second whatever the program is doing.
//!
//! Most commands have nothing to keep before they are done: the thread that hears of the signal removes what they
//! have begun to write and ends the program, in the midst of a mesh or a factorisation too. A command that
//! [`keeps`] results looks at the flag itself and saves them; if it has not begun to within [`GRACE`], or is still saving at
//! [`SAVED_BY`], earlier where there is much memory to free, it is ended all the same. Nothing gets its final name once the
//! end has begun. A second signal ends any command at once, but for one that [`serves`]: `ros2 launch` and `timeout` signal
//! a group of processes and each of them, and a node has its leave to take. There the signals of [`ONE_SIGNAL`] are one.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use flockform::export::{ExportError, OutputFolder};

use super::FAILED;

static RAISED: AtomicBool = AtomicBool::new(false);
/// Whether the program is being ended by the thread of the signal.
static ENDING: AtomicBool = AtomicBool::new(false);
/// When the first signal came.
static FIRST: OnceLock<Instant> = OnceLock::new();
/// How the first signal is handled.
static MODE: AtomicU8 = AtomicU8::new(ENDS);
/// How many parts of the program ask for what is left of the second to save something.
static SAVING: AtomicUsize = AtomicUsize::new(0);
/// Paths removed at the end, and the message printed.
static LEFT: Mutex<Left> = Mutex::new(Left { paths: Vec::new(), words: None });

const ENDS: u8 = 0;
const KEEPS: u8 = 1;
const SERVES: u8 = 2;

const NOTHING_KEPT: &str = "interrupted: nothing is kept";

/// How long work that keeps results may take to notice.
const GRACE: Duration = Duration::from_millis(500);
/// When results have to be saved by a small program; what is not is given up, and the checkpoint before it stays.
const SAVED_BY: Duration = Duration::from_millis(750);
/// How long the system takes at the end of a program to free a GiB of its memory, with the disk's cache of what is removed.
const FREEING: Duration = Duration::from_millis(250);
/// How long the last words may take: a reader that has stopped keeps no program from ending.
const PRINTING: Duration = Duration::from_millis(100);
/// How long another thread may go on writing into a folder that is being removed.
const REMOVING: Duration = Duration::from_millis(150);

/// How long signals are one with the first to a command that serves.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

struct Left {
    paths: Vec<PathBuf>,
    words: Option<String>,
}

fn left() -> MutexGuard<'static, Left> {
    LEFT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Listens for signals, from now until the program ends.
pub fn watch() {
    // A file beyond the largest that the shell allows is then an error like a full disk, in words, and not a signal.
    // SAFETY: no handler is called, and no other thread runs yet.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
    let heard = || {
        let first = FIRST.get_or_init(Instant::now);
        if RAISED.swap(true, Ordering::SeqCst) {
            if MODE.load(Ordering::SeqCst) == SERVES && first.elapsed() < ONE_SIGNAL {
                return;
            }
            end();
        }
        match MODE.load(Ordering::SeqCst) {
            ENDS => drop(std::thread::spawn(|| end_when_saved(Duration::ZERO))),
            KEEPS => drop(std::thread::spawn(|| end_when_saved(GRACE))),
            _ => {}
        }
    };
    if let Err(error) = ctrlc::set_handler(heard) {
        tracing::warn!("an interrupt will end the program without removing what it has begun: {error}");
    }
}

/// The flag of a command that saves what it has when it is raised.
pub fn keeps() -> &'static AtomicBool {
    MODE.store(KEEPS, Ordering::SeqCst);
    &RAISED
}

/// The flag of a command that goes on until it is raised, and takes its time to end well.
pub fn serves() -> &'static AtomicBool {
    MODE.store(SERVES, Ordering::SeqCst);
    &RAISED
}

/// The flag alone, for what looks at it on the way.
pub fn flag() -> &'static AtomicBool {
    &RAISED
}

pub fn is_raised() -> bool {
    RAISED.load(Ordering::SeqCst)
}

/// Does not return once the signal's thread ends the program: what the work finds broken then is no news.
pub fn leave_to_the_end() {
    while ENDING.load(Ordering::SeqCst) {
        std::thread::sleep(GRACE);
    }
}

/// What is left of the second to save results, for as long as this lives.
pub struct Saving(());

pub fn saving() -> Saving {
    SAVING.fetch_add(1, Ordering::SeqCst);
    Saving(())
}

impl Drop for Saving {
    fn drop(&mut self) {
        SAVING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Has these files and folders removed if the program is ended; folders above others only if they are empty then.
pub fn removes(paths: impl IntoIterator<Item = PathBuf>) {
    left().paths.extend(paths);
}

/// Sets the message printed if the program is ended from here on.
pub fn says(words: String) {
    left().words = Some(words);
}

/// Prints the message now; an end from here on is silent.
pub fn says_at_once(words: &str) {
    // Not under the lock, which the end needs: a reader that has stopped keeps this from returning.
    left().words = Some(String::new());
    print(words);
}

/// Gives something its name, and the end a message, without an end in between; does not return once the end has begun.
fn rename<R, E>(work: impl FnOnce() -> Result<R, E>, words: impl FnOnce(&R) -> String) -> Result<R, E> {
    let mut left = left();
    if ENDING.load(Ordering::SeqCst) {
        drop(left);
        leave_to_the_end();
        unreachable!("the program ends");
    }
    let done = work()?;
    left.words = Some(words(&done));
    Ok(done)
}

/// Gives a finished folder its name.
pub fn commit(folder: OutputFolder) -> Result<PathBuf, ExportError> {
    let kept =
        rename(|| folder.commit(), |kept| format!("interrupted: the results are in {}", kept.display()))?;
    left().paths.clear();
    Ok(kept)
}

/// Lets a folder outlive the program, to be gone on with as `words` say.
pub fn keep_unfinished(
    folder: &mut OutputFolder,
    words: impl FnOnce(&OutputFolder) -> String,
) -> Result<(), ExportError> {
    rename(|| folder.keep_unfinished().map(|()| folder), |folder| words(folder)).map(|_| ())
}

fn end_when_saved(grace: Duration) {
    let raised = Instant::now();
    let saved_by = saved_by(super::memory::resident());
    std::thread::sleep(grace.min(saved_by));
    while SAVING.load(Ordering::SeqCst) > 0 && raised.elapsed() < saved_by {
        std::thread::sleep(Duration::from_millis(5));
    }
    end();
}

/// When a program of this size \[B\] has to be done: its memory is freed within the second too.
fn saved_by(resident: u64) -> Duration {
    SAVED_BY.saturating_sub(FREEING.mul_f64(resident as f64 / f64::from(1 << 30)))
}

fn end() -> ! {
    ENDING.store(true, Ordering::SeqCst);
    let left = left();
    let since = Instant::now();
    for path in &left.paths {
        while remove(path).is_err() && since.elapsed() < REMOVING {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
    let words = last_words(&left);
    let (done, printed) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        print(&words);
        let _ = done.send(());
    });
    let _ = printed.recv_timeout(PRINTING);
    std::process::exit(FAILED.into())
}

/// Prints what the program's end would, where the work ends by itself.
pub fn print_last_words() {
    let words = last_words(&left());
    print(&words);
}

fn last_words(left: &Left) -> String {
    left.words.clone().unwrap_or_else(|| NOTHING_KEPT.to_owned())
}

fn print(words: &str) {
    if !words.is_empty() {
        note!("{words}");
    }
}

/// A hidden folder is ours with all that is in it; any other must be empty.
fn remove(path: &Path) -> std::io::Result<()> {
    let Ok(found) = path.symlink_metadata() else { return Ok(()) };
    let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    match found.is_dir() {
        false => std::fs::remove_file(path),
        true if is_hidden => std::fs::remove_dir_all(path),
        true => {
            // A folder that another program has put something into stays.
            let _ = std::fs::remove_dir(path);
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_more_memory_there_is_to_free_the_earlier_the_end() {
        assert_eq!(saved_by(0), SAVED_BY);
        assert_eq!(saved_by(1 << 30), SAVED_BY - FREEING);
        assert_eq!(saved_by(1 << 40), Duration::ZERO);
        let resident = crate::cli::memory::resident();
        assert!((1 << 20..1 << 34).contains(&resident), "{resident}");
    }
}
