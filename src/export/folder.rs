//! The output folder: whole, or not there.
//!
//! Everything is written into a hidden folder beside the one asked for, `.NAME.partial`, which takes the name only
//! when the last file is closed. A killed run leaves the former outputs or nothing in their place, never half of
//! the new ones. A run that keeps checkpoints stands in the open meanwhile, as `NAME.unfinished`, and is resumed
//! there ([`OutputFolder::reopen`]).
//!
//! The hidden folder is locked, so that two programs at once never fill one; what a killed program left of it is
//! removed by the next that wants the name. A list of files ([`super::manifest`]) names what flockform wrote: nothing
//! else is ever removed.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::error::ExportError;
use super::manifest::{Ours, Written};
use super::{checkpoint, sweep};

/// A folder being filled. Dropped without [`OutputFolder::commit`] or [`OutputFolder::keep_unfinished`], it
/// leaves nothing behind.
#[derive(Debug)]
pub struct OutputFolder {
    out: PathBuf,
    partial: PathBuf,
    files: Arc<Written>,
    force: bool,
    /// The command that makes its content again, for the reader.
    command: Option<String>,
    /// Folders above it that were made for it, the innermost first.
    made: Vec<PathBuf>,
    /// Whether what was written outlives this value.
    is_kept: bool,
    /// Holds others off, for as long as this program lives.
    _lock: Option<File>,
}

/// The present content of the place of the outputs.
enum Standing {
    Nothing,
    EmptyFolder,
    /// Outputs of an earlier run, all of them flockform's, that may be replaced.
    FormerOutputs,
}

impl OutputFolder {
    /// # Errors
    /// A folder that is not empty is refused without `force`; with it, one that holds files which flockform did not
    /// write. A file in the place, a parent that cannot be written to, and a place that another program is about to
    /// fill are refused too, and a name that ends in `.unfinished`.
    pub fn create(out: &Path, force: bool) -> Result<Self, ExportError> {
        let out = in_full(out)?;
        if out.extension().is_some_and(|ending| ending == "unfinished") {
            return Err(ExportError::Reserved(out));
        }
        require_free(&out, force)?;
        let above = out.ancestors().skip(1).take_while(|folder| !folder.exists());
        let made: Vec<PathBuf> = above.map(Path::to_owned).collect();
        if let Some(parent) = made.first() {
            fs::create_dir_all(parent)
                .map_err(|source| ExportError::Unmakeable { out: parent.clone(), source })?;
        }
        let (partial, lock) = claim(&out)?;
        let files = Arc::new(Written::open(&partial).map_err(ExportError::io("create", &partial))?);
        let folder = Self { out, partial, files, force, command: None, made, is_kept: false, _lock: lock };
        put_back(&folder.out)?;
        // Asked again under the lock: what held the name until now may have filled the place.
        require_free(&folder.out, force)?;
        Ok(folder)
    }

    /// The folder that a run to `out` has left unfinished; `force` as in [`OutputFolder::create`].
    ///
    /// # Errors
    /// A folder that a program is still filling.
    pub fn reopen(out: &Path, force: bool) -> Result<Self, ExportError> {
        let out = in_full(out)?;
        let partial = unfinished(&out);
        let Locked::Free(lock) = lock(&partial) else { return Err(ExportError::Busy(partial)) };
        let files = Arc::new(Written::open(&partial).map_err(ExportError::io("open", &partial))?);
        Ok(Self { out, partial, files, force, command: None, made: Vec::new(), is_kept: true, _lock: lock })
    }

    /// Lets what is written outlive this program, in the open, as `NAME.unfinished`. Paths given before are
    /// of the former name.
    ///
    /// # Errors
    /// Stays under the former name where the new one is taken.
    pub fn keep_unfinished(&mut self) -> Result<(), ExportError> {
        let open = unfinished(&self.out);
        if self.partial == open {
            return Ok(());
        }
        if open.exists() {
            return Err(ExportError::Unfinished(open));
        }
        rename(&self.partial, &open)?;
        self.files.moved(&open);
        (self.partial, self.is_kept) = (open, true);
        Ok(())
    }

    /// The folders made for it: the hidden folder, and the folders above it, the innermost first.
    pub fn made(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.partial).chain(&self.made).map(PathBuf::as_path)
    }

    /// The folder in which everything stands until [`OutputFolder::commit`].
    pub fn folder(&self) -> &Path {
        &self.partial
    }

    /// Refuses a file beside the outputs, a film or a recording, whose place is among them.
    ///
    /// # Errors
    /// A place in the folder under its later name, or one that cannot be looked at.
    pub fn require_outside(&self, file: &Path) -> Result<(), ExportError> {
        let [at, out] = [file, &self.out].map(|path| resolved(path).map_err(ExportError::io("find", path)));
        match at?.starts_with(out?) {
            true => Err(ExportError::InResults { file: file.to_owned(), out: self.out.clone() }),
            false => Ok(()),
        }
    }

    /// Sets the command that makes its content again, which reports show.
    pub fn set_command(&mut self, command: String) {
        self.command = Some(command);
    }

    /// The command that makes its content again, if it is known.
    pub fn command(&self) -> Option<&str> {
        self.command.as_deref()
    }

    /// The path of the output of this name, which `--force` may replace from now on.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.files.path(name.as_ref())
    }

    /// The list of its files, for writers that go on after it has taken another name.
    pub(super) fn files(&self) -> Arc<Written> {
        Arc::clone(&self.files)
    }

    /// Gives the folder its name, in the place of what may be replaced.
    ///
    /// # Errors
    /// Keeps the outputs under a name beside it, and names it, if they cannot be moved.
    pub fn commit(mut self) -> Result<PathBuf, ExportError> {
        self.files.close().map_err(ExportError::io("list the files of", &self.partial))?;
        self.is_kept = true;
        match self.take_place() {
            Ok(()) => Ok(self.out.clone()),
            Err(error) => Err(ExportError::NotMoved { kept: self.step_aside(), source: Box::new(error) }),
        }
    }

    fn take_place(&self) -> Result<(), ExportError> {
        let Self { out, partial, .. } = self;
        // Checked again: another program may have written there during the run.
        match standing(out, self.force)? {
            Standing::Nothing => rename(partial, out),
            Standing::EmptyFolder => {
                fs::remove_dir(out).map_err(ExportError::io("replace", out))?;
                rename(partial, out)
            }
            Standing::FormerOutputs => {
                let aside = beside(out, "replaced", 0);
                rename(out, &aside)?;
                let moved = rename(partial, out);
                if moved.is_err() {
                    rename(&aside, out)?;
                } else {
                    remove_former(&aside);
                }
                moved
            }
        }
    }

    /// A hidden folder is the next program's to remove: outputs that are kept stand in the open.
    fn step_aside(&self) -> PathBuf {
        let name = |n: u32| {
            let mut name = self.out.file_name().unwrap_or_default().to_owned();
            name.push(format!("-{n}"));
            self.out.with_file_name(name)
        };
        // A rename does not replace a folder with anything in it.
        let free = (2..1000).map(name).find(|free| fs::rename(&self.partial, free).is_ok());
        free.unwrap_or_else(|| self.partial.clone())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if self.is_kept {
            return;
        }
        if let Err(error) = fs::remove_dir_all(&self.partial)
            && error.kind() != ErrorKind::NotFound
        {
            tracing::warn!("unfinished outputs are left in {}: {error}", self.partial.display());
        }
        // Not those that other programs have written to meanwhile.
        let _ = self.made.iter().try_for_each(fs::remove_dir);
    }
}

/// The folder of a run to `out` while it keeps checkpoints.
pub fn unfinished(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(".unfinished");
    out.with_file_name(name)
}

/// Where the results of a run go that is taken up again, by the name of that place or of the folder of its checkpoints; links are
/// followed, as by those who write there.
pub fn out_of(dir: &Path) -> PathBuf {
    let followed = |path: PathBuf| path.canonicalize().ok().filter(|_| path.is_symlink()).unwrap_or(path);
    let dir = followed(dir.to_owned());
    let stem = dir.file_stem().filter(|_| dir.extension().is_some_and(|ending| ending == "unfinished"));
    let out = stem.map(|stem| dir.with_file_name(stem));
    out.map_or(dir, followed)
}

fn in_full(out: &Path) -> Result<PathBuf, ExportError> {
    if out.file_name().is_none() {
        return Err(ExportError::Unnamed(out.to_owned()));
    }
    // A symbolic link stays one: what it leads to is replaced. And the place must not move with the
    // working directory.
    let found = if out.is_symlink() { fs::canonicalize(out) } else { std::path::absolute(out) };
    found.map_err(ExportError::io("find", out))
}

/// A path without links and steps back, as far as it is there already.
fn resolved(path: &Path) -> std::io::Result<PathBuf> {
    let path = std::path::absolute(path)?;
    let there = path.ancestors().find_map(|above| Some((above, fs::canonicalize(above).ok()?)));
    let Some((above, mut found)) = there else { return Ok(path) };
    for part in path.strip_prefix(above).into_iter().flat_map(Path::components) {
        match part {
            Component::ParentDir => drop(found.pop()),
            part => found.push(part),
        }
    }
    Ok(found)
}

/// Refuses a place that is not free for new outputs.
fn require_free(out: &Path, force: bool) -> Result<(), ExportError> {
    standing(out, force)?;
    make_way(&unfinished(out), force)
}

/// Discards a run that was killed, where that is asked for; what else is in its place is nobody's to discard.
fn make_way(unfinished: &Path, force: bool) -> Result<(), ExportError> {
    if unfinished.symlink_metadata().is_err() {
        return Ok(());
    }
    if ![checkpoint::FILE, sweep::REQUEST].iter().any(|file| unfinished.join(file).exists()) {
        return Err(ExportError::InTheWay(unfinished.to_owned()));
    }
    if !force {
        return Err(ExportError::Unfinished(unfinished.to_owned()));
    }
    let Locked::Free(_lock) = lock(unfinished) else { return Err(ExportError::Busy(unfinished.to_owned())) };
    remove(unfinished)
}

/// Removes a folder of outputs that holds nothing else.
fn remove(folder: &Path) -> Result<(), ExportError> {
    Ours::in_folder(folder)?.remove().map_err(ExportError::io("remove", folder))
}

/// Whether a folder is in the hands of another program.
enum Locked {
    /// Ours now; without a lock where the file system has none.
    Free(Option<File>),
    Busy,
    Gone,
}

/// The system lets go of it when the program ends, however it ends.
fn lock(folder: &Path) -> Locked {
    let file = match File::open(folder) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Locked::Gone,
        Err(_) => return Locked::Free(None),
    };
    match file.try_lock() {
        Ok(()) => Locked::Free(Some(file)),
        Err(TryLockError::WouldBlock) => Locked::Busy,
        Err(TryLockError::Error(_)) => Locked::Free(None),
    }
}

/// Makes the hidden folder and locks it: of several programs that want one name, one gets it.
fn claim(out: &Path) -> Result<(PathBuf, Option<File>), ExportError> {
    let mut attempt = 0;
    for _ in 0..1000 {
        let path = beside(out, "partial", attempt);
        let is_new = match fs::create_dir(&path) {
            Ok(()) => true,
            Err(error) if error.kind() == ErrorKind::AlreadyExists => false,
            Err(source) => return Err(ExportError::Unmakeable { out: out.to_owned(), source }),
        };
        match lock(&path) {
            Locked::Busy => return Err(ExportError::Busy(path)),
            Locked::Gone => {}
            // Another folder was opened: one that was moved to its place, or removed, before it was locked.
            Locked::Free(lock) if !is_at(lock.as_ref(), &path) => {}
            Locked::Free(lock) if is_new => return Ok((path, lock)),
            // A killed program's remains are removed, unless their origin is unclear or other files are among them.
            Locked::Free(Some(_lock)) if discard(&path).is_ok() => {}
            Locked::Free(_) => attempt += 1,
        }
    }
    Err(ExportError::Busy(beside(out, "partial", 0)))
}

/// Whether a path leads to the folder that was opened at it; where none could be opened, whether to any.
fn is_at(folder: Option<&File>, path: &Path) -> bool {
    let Some(folder) = folder else { return path.exists() };
    let identity = |found: fs::Metadata| (found.dev(), found.ino());
    let at_path = fs::metadata(path).map(identity).ok();
    at_path.is_some() && at_path == folder.metadata().map(identity).ok()
}

/// A killed program may not even have begun its list.
fn discard(partial: &Path) -> Result<(), ExportError> {
    fs::remove_dir(partial).or_else(|_| remove(partial))
}

/// A program that was killed while it replaced outputs has left them aside; a folder of that name that another program made is
/// not touched.
fn put_back(out: &Path) -> Result<(), ExportError> {
    let aside = beside(out, "replaced", 0);
    match Ours::in_folder(&aside).is_ok() {
        true if !out.exists() => return rename(&aside, out),
        true => remove_former(&aside),
        false => {}
    }
    Ok(())
}

/// Removes outputs that were replaced; those that cannot be removed are no reason to end.
fn remove_former(aside: &Path) {
    if let Err(error) = remove(aside) {
        tracing::warn!("former outputs are left in {}: {error}", aside.display());
    }
}

fn standing(out: &Path, force: bool) -> Result<Standing, ExportError> {
    match fs::metadata(out) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Standing::Nothing),
        Err(error) => return Err(ExportError::io("look at", out)(error)),
        Ok(found) if !found.is_dir() => return Err(ExportError::NotAFolder(out.to_owned())),
        Ok(_) => {}
    }
    let mut entries = fs::read_dir(out).map_err(ExportError::io("look into", out))?;
    match entries.next() {
        None => Ok(Standing::EmptyFolder),
        Some(_) if !force => Err(ExportError::NotEmpty(out.to_owned())),
        Some(_) => Ours::in_folder(out).map(|_| Standing::FormerOutputs),
    }
}

/// A hidden name in the same parent, hence on the same file system, so that a rename is one step.
pub(super) fn beside(out: &Path, what: &str, attempt: u32) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(out.file_name().unwrap_or_default());
    name.push(format!(".{what}"));
    if attempt > 0 {
        name.push(format!("-{attempt}"));
    }
    out.with_file_name(name)
}

fn rename(from: &Path, to: &Path) -> Result<(), ExportError> {
    fs::rename(from, to).map_err(ExportError::io("rename the finished folder to", to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_go_where_links_lead_whatever_they_are_called_by() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let real = folder.path().canonicalize().expect("a folder");
        std::fs::create_dir(at("x")).expect("made");
        std::fs::create_dir(at("y.unfinished")).expect("made");
        for (link, to) in [("to-x", "x"), ("to-y", "y.unfinished")] {
            std::os::unix::fs::symlink(at(to), at(link)).expect("made");
        }
        assert_eq!(out_of(&at("x")), at("x"));
        assert_eq!(out_of(&at("x.unfinished")), at("x"));
        assert_eq!(out_of(&at("to-x")), real.join("x"));
        assert_eq!(out_of(&at("to-x.unfinished")), real.join("x"));
        assert_eq!(out_of(&at("to-y")), real.join("y"));
        assert_eq!(out_of(&at("y")), at("y"));
    }
}
