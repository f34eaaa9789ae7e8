//! `flockform-files.txt`: which files of an output folder flockform wrote, so that `--force` removes no others.
//!
//! One path below the folder a line, the parts separated by `/`; a folder that has a list of its own is one line. A
//! name is added before its file is written, so that the list of a killed run is complete.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::checkpoint;
use super::error::ExportError;

/// Its name in the folder.
pub const FILE: &str = "flockform-files.txt";

/// These come and go, and are flockform's wherever there is a list.
const ALWAYS: [&str; 4] = [FILE, TEMPORARY, checkpoint::FILE, checkpoint::PART];
const TEMPORARY: &str = "flockform-files.txt.part";

fn is_always_ours(name: &str) -> bool {
    ALWAYS.contains(&name) || checkpoint::is_part(name)
}

/// Foreign files that are named; a folder may hold thousands.
const MOST_NAMED: usize = 5;

/// The list of a folder that is being filled.
#[derive(Debug)]
pub(super) struct Written(Mutex<State>);

#[derive(Debug)]
struct State {
    root: PathBuf,
    names: BTreeSet<String>,
    list: File,
}

impl Written {
    /// Goes on with the list of this folder, or begins one.
    pub fn open(root: &Path) -> io::Result<Self> {
        let names = read(root).unwrap_or_default();
        let mut list = create(&root.join(FILE))?;
        list.write_all(lines(&names).as_bytes())?;
        Ok(Self(Mutex::new(State { root: root.to_owned(), names, list })))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The path of the file of this name, which is ours from now on.
    pub fn path(&self, name: &Path) -> PathBuf {
        let mut state = self.state();
        let text = line(name);
        if !is_always_ours(&text) && state.names.insert(text.clone()) {
            // If this cannot be written, the file itself cannot either, and that error is reported.
            let _ = writeln!(state.list, "{text}");
        }
        state.root.join(name)
    }

    /// Follows the folder to its new name.
    pub fn moved(&self, root: &Path) {
        self.state().root = root.to_owned();
    }

    /// Writes the list of what there is in the end.
    pub fn close(&self) -> io::Result<()> {
        let state = self.state();
        let is_there = |name: &&String| state.root.join(name).symlink_metadata().is_ok();
        let names: BTreeSet<String> = state.names.iter().filter(is_there).cloned().collect();
        let part = state.root.join(TEMPORARY);
        create(&part)?.write_all(lines(&names).as_bytes())?;
        fs::rename(part, state.root.join(FILE))
    }
}

/// A new file, never one that a symbolic link leads to: what has the name is unlinked.
pub(crate) fn create(path: &Path) -> io::Result<File> {
    match File::create_new(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            fs::remove_file(path)?;
            File::create_new(path)
        }
        created => created,
    }
}

/// Refuses a link, which may lead to a file that is not flockform's, and a pipe, which may never end.
pub(super) fn require_regular(path: &Path) -> io::Result<()> {
    match path.symlink_metadata()?.is_file() {
        true => Ok(()),
        false => Err(io::Error::other("it is no regular file")),
    }
}

/// The contents of a file that flockform wrote.
///
/// # Errors
/// Those of the system, and what is no regular file.
pub(super) fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    require_regular(path).and_then(|()| fs::read(path))
}

/// The same as [`create`], buffered.
pub(crate) fn create_buffered(path: &Path) -> io::Result<BufWriter<File>> {
    create(path).map(BufWriter::new)
}

/// Writes a file that is not there yet; nothing of it stays if it cannot be written whole.
///
/// # Errors
/// Those of the system.
pub fn write_new(path: &Path, text: &str) -> io::Result<()> {
    File::create_new(path)?.write_all(text.as_bytes()).inspect_err(|_| {
        let _ = fs::remove_file(path);
    })
}

fn line(name: &Path) -> String {
    let parts: Vec<_> = name.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    parts.join("/")
}

fn lines(names: &BTreeSet<String>) -> String {
    names.iter().map(|name| format!("{name}\n")).collect()
}

fn read(folder: &Path) -> Option<BTreeSet<String>> {
    let path = folder.join(FILE);
    path.symlink_metadata().ok().filter(fs::Metadata::is_file)?;
    Some(fs::read_to_string(path).ok()?.lines().map(str::to_owned).collect())
}

/// The contents of a folder, deepest first, when all of it is flockform's.
pub(super) struct Ours {
    files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
}

impl Ours {
    /// Looks through a folder; symbolic links are not followed, and are never ours.
    ///
    /// # Errors
    /// A folder without a list, a few of the files that are not in it, and a folder that cannot be looked into.
    pub fn in_folder(root: &Path) -> Result<Self, ExportError> {
        let names = read(root).ok_or_else(|| ExportError::NotOurs(root.to_owned()))?;
        let mut ours = Self { files: Vec::new(), folders: Vec::new() };
        let mut files = Vec::new();
        ours.look(root, Path::new(""), &names, &mut files).map_err(ExportError::io("look into", root))?;
        ours.folders.push(root.to_owned());
        if files.is_empty() { Ok(ours) } else { Err(ExportError::Foreign { folder: root.to_owned(), files }) }
    }

    fn look(
        &mut self,
        root: &Path,
        below: &Path,
        names: &BTreeSet<String>,
        foreign: &mut Vec<PathBuf>,
    ) -> io::Result<()> {
        for entry in fs::read_dir(root.join(below))? {
            let entry = entry?;
            let (name, kind) = (below.join(entry.file_name()), entry.file_type()?);
            let (text, path) = (line(&name), entry.path());
            let is_listed = names.contains(&text) || is_always_ours(&text);
            let prefix = format!("{text}/");
            let leads_to_listed =
                || names.range(prefix.clone()..).next().is_some_and(|n| n.starts_with(&prefix));
            if kind.is_file() && is_listed {
                self.files.push(path);
            } else if kind.is_dir() && is_listed && path.join(FILE).exists() {
                match Self::in_folder(&path) {
                    Ok(inner) => {
                        self.files.extend(inner.files);
                        self.folders.extend(inner.folders);
                    }
                    Err(ExportError::Io { source, .. }) => return Err(source),
                    Err(ExportError::Foreign { files, .. }) => foreign.extend(files),
                    Err(_) => foreign.push(path),
                }
            } else if kind.is_dir() && (is_listed || leads_to_listed()) {
                self.look(root, &name, names, foreign)?;
                self.folders.push(path);
            } else {
                foreign.push(path);
            }
            if foreign.len() >= MOST_NAMED {
                break;
            }
        }
        Ok(())
    }

    /// Removes what was found, and nothing that has come since.
    pub fn remove(self) -> io::Result<()> {
        self.files.iter().try_for_each(fs::remove_file)?;
        self.folders.iter().try_for_each(fs::remove_dir)
    }
}
