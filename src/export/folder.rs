//! The output folder: whole, or not there.
//!
//! Everything is written into a hidden folder beside the one asked for, `.NAME.partial-PID`, which takes
//! the name only when the last file is closed. A killed run leaves the former outputs or nothing in their
//! place, never half of the new ones. A run that keeps checkpoints is visible meanwhile, as
//! `NAME.unfinished`, which a resumed run opens again ([`OutputFolder::reopen`]).

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::error::ExportError;
use super::{checkpoint, summary};

/// A folder being filled. Dropped without [`OutputFolder::commit`] or [`OutputFolder::keep_unfinished`], it
/// leaves nothing behind.
#[derive(Debug)]
pub struct OutputFolder {
    out: PathBuf,
    partial: PathBuf,
    force: bool,
    /// Folders above it that were made for it, the innermost first.
    made: Vec<PathBuf>,
    /// Whether what was written outlives this value.
    is_kept: bool,
    /// Holds others off an unfinished folder, for as long as this program lives.
    lock: Option<File>,
}

/// The present content of the place of the outputs.
enum Standing {
    Nothing,
    EmptyFolder,
    /// Outputs of an earlier run that may be replaced.
    FormerOutputs,
}

impl OutputFolder {
    /// # Errors
    /// A folder that is not empty is refused without `force`; with it, one that this program did not
    /// write. A file in the place, and a parent that cannot be written to, are refused too.
    pub fn create(out: &Path, force: bool) -> Result<Self, ExportError> {
        let out = in_full(out)?;
        standing(&out, force)?;
        make_way(&unfinished(&out), force)?;
        let above = out.ancestors().skip(1).take_while(|folder| !folder.exists());
        let made: Vec<PathBuf> = above.map(Path::to_owned).collect();
        if let Some(parent) = made.first() {
            fs::create_dir_all(parent).map_err(ExportError::io("create", parent))?;
        }
        let partial = create_beside(&out, "partial")?;
        Ok(Self { out, partial, force, made, is_kept: false, lock: None })
    }

    /// The folder that a run to `out` has left unfinished; `force` as in [`OutputFolder::create`].
    ///
    /// # Errors
    /// A folder that a program is still filling.
    pub fn reopen(out: &Path, force: bool) -> Result<Self, ExportError> {
        let out = in_full(out)?;
        let partial = unfinished(&out);
        let lock = lock(&partial)?;
        Ok(Self { out, partial, force, made: Vec::new(), is_kept: true, lock })
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
        let lock = lock(&self.partial)?;
        rename(&self.partial, &open)?;
        (self.partial, self.is_kept, self.lock) = (open, true, lock);
        Ok(())
    }

    /// The folder that holds everything until [`OutputFolder::commit`].
    pub fn folder(&self) -> &Path {
        &self.partial
    }

    /// Path for the output of this name.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.partial.join(name)
    }

    /// Gives the folder its name, in the place of what may be replaced.
    ///
    /// # Errors
    /// Keeps the outputs under their temporary name, which the error gives, if they cannot be moved.
    pub fn commit(mut self) -> Result<PathBuf, ExportError> {
        self.is_kept = true;
        match self.take_place() {
            Ok(()) => Ok(self.out.clone()),
            Err(error) => Err(ExportError::NotMoved { kept: self.partial.clone(), source: Box::new(error) }),
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
                let aside = create_beside(out, "replaced")?;
                let former = aside.join("former");
                rename(out, &former)?;
                let moved = rename(partial, out);
                if moved.is_err() {
                    rename(&former, out)?;
                }
                if let Err(error) = fs::remove_dir_all(&aside) {
                    tracing::warn!("the former outputs are left in {}: {error}", aside.display());
                }
                moved
            }
        }
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if self.is_kept {
            return;
        }
        if let Err(error) = fs::remove_dir_all(&self.partial) {
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

fn in_full(out: &Path) -> Result<PathBuf, ExportError> {
    if out.file_name().is_none() {
        return Err(ExportError::Unnamed(out.to_owned()));
    }
    // A symbolic link stays one: what it leads to is replaced. And the place must not move with the
    // working directory.
    let found = if out.is_symlink() { fs::canonicalize(out) } else { std::path::absolute(out) };
    found.map_err(ExportError::io("find", out))
}

/// Discards a run that was killed, where that is asked for.
fn make_way(unfinished: &Path, force: bool) -> Result<(), ExportError> {
    if !unfinished.join(checkpoint::FILE).exists() {
        return Ok(());
    }
    if !force {
        return Err(ExportError::Unfinished(unfinished.to_owned()));
    }
    let _lock = lock(unfinished)?;
    fs::remove_dir_all(unfinished).map_err(ExportError::io("discard", unfinished))
}

/// The system lets go of it when the program ends, however it ends. `None` on a file system without locks.
fn lock(folder: &Path) -> Result<Option<File>, ExportError> {
    let Ok(file) = File::open(folder) else { return Ok(None) };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Err(ExportError::Busy(folder.to_owned())),
        Err(TryLockError::Error(_)) => Ok(None),
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
        Some(_) if summary::is_in(out) => Ok(Standing::FormerOutputs),
        Some(_) => Err(ExportError::NotOurs(out.to_owned())),
    }
}

/// Makes a hidden folder in the same parent, hence on the same file system, so that a rename is one
/// step.
fn create_beside(out: &Path, what: &str) -> Result<PathBuf, ExportError> {
    let name = |attempt: u32| {
        let mut name = OsString::from(".");
        name.push(out.file_name().unwrap_or_default());
        name.push(format!(".{what}-{}", std::process::id()));
        if attempt > 0 {
            name.push(format!("-{attempt}"));
        }
        out.with_file_name(name)
    };
    let mut attempt = 0;
    loop {
        let path = name(attempt);
        match fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            // Process ids repeat, in containers at every start: a killed run may have left its own.
            Err(error) if error.kind() == ErrorKind::AlreadyExists && attempt < 1000 => attempt += 1,
            Err(error) => return Err(ExportError::io("create", &path)(error)),
        }
    }
}

fn rename(from: &Path, to: &Path) -> Result<(), ExportError> {
    fs::rename(from, to).map_err(ExportError::io("rename the finished folder to", to))
}
