//! The folders in which iceoryx2 keeps its files: open to every user of the computer, and removed after the last use.
//!
//! iceoryx2 makes them its first user's alone, and leaves them. Here they are made as `/tmp` is, where each user has
//! files of its own, and removed by the last that leaves.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use iceoryx2::prelude::Config;

use super::ShmError;
use super::domain::VARIABLE;

/// Removes them when it is dropped, which must be after all that has files in them.
#[derive(Debug)]
pub(super) struct Folders {
    /// The root, and in it that of services and that of nodes.
    folders: [PathBuf; 3],
    /// Of all files of the domain, and of the one in which it counts its nodes.
    prefix: String,
    counter: String,
    /// Of the files that describe services.
    service: String,
}

/// Where the system keeps shared memory as files.
const SHARED_MEMORY: &str = "/dev/shm";

/// Time after which a file that is still being made is one that its maker left: iceoryx2 makes one in milliseconds, and
/// gives up waiting for most after a second.
const MAKING: Duration = Duration::from_secs(2);

impl Folders {
    pub fn of(config: &Config) -> Self {
        let global = &config.global;
        let folders =
            [*global.root_path(), global.service_dir(), global.node_dir()].map(|path| as_path(&path));
        let (prefix, counter) = (global.prefix.to_string(), global.node.global_mgmt_suffix.to_string());
        let service = global.service.static_config_storage_suffix.to_string();
        Self { folders, prefix, counter, service }
    }

    /// Makes those that are missing, and opens this user's to all.
    pub fn open(&self) {
        for folder in &self.folders {
            // Where this fails, joining fails and says why; only their owner can open them.
            let _ = fs::create_dir(folder);
            let _ = open_to_all(folder);
        }
    }

    /// Waits for files of the domain that are being made, and removes those that a process left which died while it made
    /// them: iceoryx2 would refuse them for good, or wait for them without end.
    ///
    /// # Errors
    /// Names the files that stay: a process has them open, or they are another user's.
    pub fn clear_unfinished(&self) -> Result<(), ShmError> {
        let begun = Instant::now();
        let is_left = |file: &PathBuf| {
            let modified = file.metadata().and_then(|found| found.modified());
            // Of a clock that was set back none is old.
            modified.is_ok_and(|time| time.elapsed().is_ok_and(|age| age >= MAKING))
        };
        let mut files = self.unfinished();
        while !files.iter().all(is_left) && begun.elapsed() < 2 * MAKING {
            std::thread::sleep(Duration::from_millis(10));
            files = self.unfinished();
        }
        files.retain(|file| is_left(file) && is_unfinished(file, &self.service));
        files.retain(|file| is_open(file) || fs::remove_file(file).is_err());
        files.retain(|file| file.exists());
        if files.is_empty() {
            return Ok(());
        }
        let listed: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        let it = if files.len() == 1 { "it" } else { "them" };
        Err(ShmError::Refused(format!(
            "a process does not finish {}, for which iceoryx2 waits without end\n  help: end all programs of this domain and \
             start again, which removes {it}, remove {it} yourself, or take another {VARIABLE}",
            listed.join(", ")
        )))
    }

    /// Removes the files of a domain in which no process lives, after `clean_up` has removed what iceoryx2 can: what a dead
    /// one has made in part, it would wait for. Processes register before they make any, but for the counter.
    pub fn clear_remains(&self, has_peers: impl FnOnce() -> bool, clean_up: impl FnOnce()) {
        let made = |file: &PathBuf| file.metadata().and_then(|found| found.modified()).ok();
        let files = self
            .files()
            .into_iter()
            .filter(|file| file.file_name().is_none_or(|name| !self.is_counter(&name.to_string_lossy())));
        let files: Vec<_> = files.map(|file| (made(&file), file)).collect();
        if files.is_empty() || has_peers() {
            return;
        }
        // Not one that another process has made anew meanwhile.
        let remove = |(then, file): &(_, PathBuf)| {
            if made(file) == *then {
                let _ = fs::remove_file(file);
            }
        };
        files.iter().filter(|(_, file)| is_unfinished(file, &self.service)).for_each(remove);
        clean_up();
        files.iter().for_each(remove);
    }

    /// Removes what is registered of a dead node of this number: a folder, and files of the domain.
    pub fn forget(&self, node: u128) {
        let [_, _, nodes] = &self.folders;
        let _ = fs::remove_dir_all(nodes.join(node.to_string()));
        let name = format!("{}{node}", self.prefix);
        let is_its = |file: &PathBuf| file.file_stem().is_some_and(|stem| stem.to_string_lossy() == name);
        self.of_domain(nodes).into_iter().filter(is_its).for_each(|file| drop(fs::remove_file(file)));
    }

    fn of_domain(&self, folder: &Path) -> Vec<PathBuf> {
        let names = names(folder).into_iter().filter(|name| name.starts_with(&self.prefix));
        names.map(|name| folder.join(name)).collect()
    }

    /// Files of the domain: its shared memory, its services and the sockets of its events.
    fn files(&self) -> Vec<PathBuf> {
        let [root, services, _] = &self.folders;
        let mut files = self.of_domain(Path::new(SHARED_MEMORY));
        files.extend(self.of_domain(services).into_iter().filter(|file| has_ending(file, &self.service)));
        files.extend(self.of_domain(root));
        files
    }

    fn unfinished(&self) -> Vec<PathBuf> {
        self.files().into_iter().filter(|file| is_unfinished(file, &self.service)).collect()
    }

    /// Whether a file of shared memory counts the nodes of this domain: `PREFIX`, a checksum, a name.
    fn is_counter(&self, name: &str) -> bool {
        let middle = name.strip_prefix(&self.prefix).and_then(|name| name.strip_suffix(&self.counter));
        let checksum = middle.and_then(|middle| middle.split_once('_'));
        checksum.is_some_and(|(sum, _)| !sum.is_empty() && sum.bytes().all(|byte| byte.is_ascii_hexdigit()))
    }
}

/// Whether a process has a file open, or may: its maker has until it is finished.
fn is_open(file: &Path) -> bool {
    let processes = Path::new("/proc");
    let is_process = |name: &String| name.bytes().all(|byte| byte.is_ascii_digit());
    let mut folders =
        names(processes).into_iter().filter(is_process).map(|name| processes.join(name).join("fd"));
    let is_it = |link: PathBuf| fs::read_link(link).is_ok_and(|open| open == file);
    !cfg!(target_os = "linux")
        || folders.any(|folder| names(&folder).iter().any(|number| is_it(folder.join(number))))
}

fn has_ending(file: &Path, ending: &str) -> bool {
    file.to_string_lossy().ends_with(ending)
}

/// Refuses shared memory with less room than `bytes`: what is written beyond it ends a process without a word.
///
/// # Errors
/// Says how much there is.
pub(super) fn require_room(bytes: u64) -> Result<(), ShmError> {
    match room() {
        Some(free) if free < bytes => Err(ShmError::Refused(format!(
            "{SHARED_MEMORY} has {} kB free, and this takes about {} kB\n  help: remove what is not needed there, or make it \
             larger: `mount -o remount,size=64m {SHARED_MEMORY}`, of a container its `--shm-size`",
            free / 1000,
            bytes / 1000
        ))),
        _ => Ok(()),
    }
}

/// Free shared memory \[bytes\], where the system says.
#[cfg(target_os = "linux")]
fn room() -> Option<u64> {
    let folder = std::ffi::CString::new(SHARED_MEMORY).ok()?;
    let mut found = std::mem::MaybeUninit::<libc::statvfs64>::uninit();
    // SAFETY: the call reads a string and writes a struct, both of which live as long as it takes.
    let is_known = unsafe { libc::statvfs64(folder.as_ptr(), found.as_mut_ptr()) } == 0;
    // SAFETY: a call that went well has written the struct.
    let found = is_known.then(|| unsafe { found.assume_init() })?;
    Some(found.f_bavail.saturating_mul(found.f_frsize))
}

#[cfg(not(target_os = "linux"))]
fn room() -> Option<u64> {
    None
}

/// Whether a file is still being made: by its mode, which iceoryx2 sets at the end, or because nothing is in it. Sockets are
/// made at once.
#[cfg(unix)]
fn is_unfinished(file: &Path, service: &str) -> bool {
    use std::os::unix::fs::MetadataExt;
    let Ok(found) = file.metadata() else { return false };
    match has_ending(file, service) {
        true => found.mode() & 0o200 != 0,
        false => found.is_file() && (found.len() == 0 || found.mode() & 0o400 == 0),
    }
}

#[cfg(not(unix))]
fn is_unfinished(_file: &Path, _service: &str) -> bool {
    false
}

impl Drop for Folders {
    fn drop(&mut self) {
        let is_of_domain = |name: &String| name.starts_with(&self.prefix);
        let [_, _, nodes] = &self.folders;
        if !names(nodes).iter().any(is_of_domain) {
            // Numbers of nodes begin anew when there is no node.
            let counters = names(Path::new(SHARED_MEMORY)).into_iter().filter(|name| self.is_counter(name));
            counters.for_each(|name| drop(fs::remove_file(Path::new(SHARED_MEMORY).join(name))));
        }
        // One with files in it is in use. Of a peer that has joined there is a node before there is a service.
        let _ = self.folders.iter().rev().try_for_each(fs::remove_dir);
    }
}

fn names(folder: &Path) -> Vec<String> {
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    fs::read_dir(folder).map(|entries| entries.flatten().map(name).collect()).unwrap_or_default()
}

/// Whether another user has made the folders; two users do not read each other's files.
pub(super) fn is_another_s(config: &Config) -> Option<u32> {
    owner(&as_path(config.global.root_path()))
        .zip(owner(Path::new("/proc/self")))
        .and_then(|(theirs, ours)| (theirs != ours).then_some(ours))
}

/// The folder of services, if its owner keeps it from this user.
pub(super) fn closed(config: &Config) -> Option<PathBuf> {
    let folder = as_path(&config.global.service_dir());
    let is_refused = |error: std::io::Error| error.kind() == std::io::ErrorKind::PermissionDenied;
    fs::read_dir(&folder).is_err_and(is_refused).then_some(folder)
}

fn as_path(path: &impl std::fmt::Display) -> PathBuf {
    PathBuf::from(path.to_string())
}

#[cfg(unix)]
fn owner(path: &Path) -> Option<u32> {
    use std::os::unix::fs::MetadataExt;
    path.metadata().ok().map(|found| found.uid())
}

#[cfg(not(unix))]
fn owner(_path: &Path) -> Option<u32> {
    None
}

#[cfg(unix)]
fn open_to_all(folder: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(folder, fs::Permissions::from_mode(0o1777))
}

#[cfg(not(unix))]
fn open_to_all(_folder: &Path) -> std::io::Result<()> {
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use iceoryx2::prelude::SemanticString;

    use super::*;

    #[test]
    fn folders_made_for_one_user_are_opened_and_outlast_a_peer_while_another_is_there() {
        let parent = tempfile::tempdir().expect("a folder");
        let mut config = Config::global_config().clone();
        let root = parent.path().join("root");
        let name = iceoryx2::prelude::Path::new(root.to_string_lossy().as_bytes()).expect("a path");
        config.global.set_root_path(&name);
        let (first, second) = (Folders::of(&config), Folders::of(&config));
        first.open();
        let services = as_path(&config.global.service_dir());
        // As iceoryx2 makes it.
        fs::set_permissions(&services, fs::Permissions::from_mode(0o750)).expect("ours");
        second.open();
        let mode = services.metadata().expect("it is there").permissions().mode();
        assert_eq!(mode & 0o7777, 0o1777);
        let node = as_path(&config.global.node_dir()).join("node");
        fs::write(&node, "").expect("a node");
        drop(first);
        assert!(services.is_dir(), "another peer is there");
        fs::remove_file(node).expect("it was there");
        drop(second);
        assert!(!root.exists());
    }
}
