//! The folders in which iceoryx2 keeps its files: open to every user of the computer, and removed after the last use.
//!
//! iceoryx2 makes them its first user's alone, and leaves them. Here they are made as `/tmp` is, where each user has
//! files of its own, and removed by the last that leaves.

use std::fs;
use std::path::{Path, PathBuf};

use iceoryx2::prelude::Config;

/// Removes them when it is dropped, which must be after all that has files in them.
#[derive(Debug)]
pub(super) struct Folders {
    /// The root, and in it that of services and that of nodes.
    folders: [PathBuf; 3],
    /// Of all files of the domain, and of the one in which it counts its nodes.
    prefix: String,
    counter: String,
}

/// Where the system keeps shared memory as files.
const SHARED_MEMORY: &str = "/dev/shm";

impl Folders {
    pub fn of(config: &Config) -> Self {
        let global = &config.global;
        let folders =
            [*global.root_path(), global.service_dir(), global.node_dir()].map(|path| as_path(&path));
        let (prefix, counter) = (global.prefix.to_string(), global.node.global_mgmt_suffix.to_string());
        Self { folders, prefix, counter }
    }

    /// Makes those that are missing, and opens this user's to all.
    pub fn open(&self) {
        for folder in &self.folders {
            // Where this fails, joining fails and says why; only their owner can open them.
            let _ = fs::create_dir(folder);
            let _ = open_to_all(folder);
        }
    }
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

impl Folders {
    /// Whether a file of shared memory counts the nodes of this domain: `PREFIX`, a checksum, a name.
    fn is_counter(&self, name: &str) -> bool {
        let middle = name.strip_prefix(&self.prefix).and_then(|name| name.strip_suffix(&self.counter));
        let checksum = middle.and_then(|middle| middle.split_once('_'));
        checksum.is_some_and(|(sum, _)| !sum.is_empty() && sum.bytes().all(|byte| byte.is_ascii_hexdigit()))
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
