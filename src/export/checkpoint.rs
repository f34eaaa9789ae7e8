//! `checkpoint`: a stepped run on its way, so that a killed one can go on ([`crate::continuum::run::run_shared`]).
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `FLOCKFRM` |
//! | 4 | version of this layout, little-endian |
//! | 8 | length of the payload |
//! | 4 | CRC-32 of the payload |
//! | rest | the payload: [`Checkpoint`] in [postcard](https://postcard.jamesmunns.com)'s wire format (numbers \[f64\] as their 8 bytes, little-endian) |
//!
//! Where each rank has a part of the body, the others write files of their own first, `checkpoint.STEP.RANK`, which the first
//! rank's then names.
//!
//! It is written beside its place, brought to the disk and then renamed, so that there is always a whole one.

mod difference;
mod error;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Seek, Write};
use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use self::difference::first_difference;
pub use self::error::CheckpointError;
use self::error::RESTORE;
use super::Records;
use super::error::ExportError;
use super::manifest::{create, read_regular};
use super::parts::write_each;
use super::report::AnimationState;
use crate::continuum::digest::fnv1a;
use crate::engine::setup::Setup;
use crate::engine::state::EngineState;
use crate::ranks::Team;
use crate::scene::Scene;

/// Its name in the folder of the run.
pub const FILE: &str = "checkpoint";
pub(super) const PART: &str = "checkpoint.part";
const MAGIC: [u8; 8] = *b"FLOCKFRM";
const VERSION: u32 = 9;
const HEADER: usize = 24;
const PROGRAM_VERSION: &str = env!("CARGO_PKG_VERSION");

/// A run on its way: its command line, its state, and its records.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Checkpoint<'a> {
    /// Version of the program: another one may round otherwise.
    program: Cow<'a, str>,
    /// The command line of the run.
    pub asked: RunRequest,
    /// The scene as JSON, overrides and defaults included.
    scene: String,
    /// [`crate::continuum::digest::digest`] of the plan.
    digest: u64,
    /// The engine's state after the last step.
    pub engine: EngineState<'a>,
    /// Largest one-step motion over the spacing, at the last step; infinite before the first.
    pub residual: f64,
    /// The records so far.
    pub records: Cow<'a, Records>,
    /// State of the report, where there is to be one.
    pub animation: Option<AnimationState<'a>>,
    /// Time taken for the steps so far.
    pub stepping: Duration,
    /// Where each rank had a part of the body: the number of the first particle of this state in the whole body, and the
    /// states of the other ranks, in files beside this one. Empty where this state is that of the whole.
    parts: Parts,
}

/// See [`Checkpoint::parts`].
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Parts {
    first: usize,
    others: Vec<OtherPart>,
}

/// The state of another rank.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct OtherPart {
    file: String,
    first: usize,
    count: usize,
}

/// The command line of the run, which `--resume` does not repeat.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunRequest {
    /// Name of a bundled scene, or the absolute path of a file.
    pub scene: String,
    /// Overrides, as given.
    pub set: Vec<String>,
    /// Whether former outputs may be replaced.
    pub force: bool,
}

impl RunRequest {
    /// The arguments of `flockform` that run it anew.
    pub fn arguments(&self) -> impl Iterator<Item = String> {
        let set = self.set.iter().flat_map(|set| ["--set".to_owned(), set.clone()]);
        ["run".to_owned(), self.scene.clone()].into_iter().chain(set)
    }
}

impl<'a> Checkpoint<'a> {
    /// A checkpoint of a run with a plan of this `digest`.
    pub fn new(
        (asked, scene, digest): (&RunRequest, &Scene, u64),
        (engine, residual): (EngineState<'a>, f64),
        (records, animation): (Cow<'a, Records>, Option<AnimationState<'a>>),
        stepping: Duration,
    ) -> Self {
        Self {
            program: Cow::Borrowed(PROGRAM_VERSION),
            asked: asked.clone(),
            scene: as_json(scene),
            digest,
            engine,
            residual,
            records,
            animation,
            stepping,
            parts: Parts::default(),
        }
    }

    /// Writes the checkpoint of a body of which each rank has a part, by all ranks together: the others write their states, each
    /// that of the particles from the number `first` of the whole body on, into the `folder` of the first one, which names them and
    /// does the rest, as in [`Checkpoint::write`]. Where one of them cannot be written nothing is left of it, and the former one is
    /// as it was, which has to be of another step.
    ///
    /// # Errors
    /// A state that cannot be written, by any rank, or what the first one says of its own: `ready`. The same for all.
    pub fn write_in_parts(
        mut self,
        folder: Option<&Path>,
        (first, team): (usize, &Team),
        ready: Result<(), ExportError>,
    ) -> Result<(), ExportError> {
        let step = self.engine.step();
        let name = |rank: usize| part_name(step, rank);
        let write = |path: &Path| -> io::Result<()> { self.write_to(create(path)?)?.sync_all() };
        let mut written = write_each(folder, name, team, |path| match folder {
            Some(_) => ready,
            None => write(path).map_err(ExportError::io("write", path)),
        });
        let parts = team.each([first as u64, self.engine.count() as u64]).into_iter().enumerate();
        let part = |(rank, [first, count]): (usize, [u64; 2])| OtherPart {
            file: name(rank),
            first: first as usize,
            count: count as usize,
        };
        self.parts.others = parts.skip(1).map(part).collect();
        written = written.and_then(|()| folder.map_or(Ok(()), |folder| self.write(folder)));
        let has_failed = team.of_first([u64::from(written.is_err())]) == [1];
        if has_failed && let Some(folder) = folder {
            // On a full disk they would be in the way of the next ones.
            remove_parts(folder, |part| !part.starts_with(&part_name(step, "")));
        }
        match written {
            Ok(()) if has_failed => Err(ExportError::OnRank { rank: 0, path: FILE.into() }),
            written => written,
        }
    }

    /// Takes the place of the former checkpoint in the folder when it is whole on the disk, as those of all parts are; parts of
    /// the former one are removed.
    pub fn write(&self, folder: &Path) -> Result<(), ExportError> {
        let (part, path) = (folder.join(PART), folder.join(FILE));
        let write = || {
            self.write_to(create(&part)?)?.sync_all()?;
            fs::rename(&part, &path)?;
            // A name outlives a power cut only when its folder is on the disk.
            File::open(folder)?.sync_all()
        };
        write().map_err(|error| {
            // On a full disk half of one is in the way of what is to come.
            let _ = fs::remove_file(&part);
            ExportError::io("write", &path)(error)
        })?;
        remove_parts(folder, |name| self.parts.others.iter().any(|other| other.file == name));
        Ok(())
    }

    /// As it is written, so that it is never in memory beside the run; the header comes last, over its place.
    fn write_to(&self, mut file: File) -> io::Result<File> {
        file.write_all(&[0; HEADER])?;
        let payload = Payload { file, sum: crc32fast::Hasher::new(), length: 0, failure: None };
        let mut buffered = BufWriter::with_capacity(1 << 20, payload);
        let written = postcard::to_io(self, &mut buffered).map(|_| ());
        let flushed = buffered.flush();
        // What is left in the buffer after a failure is of no use.
        let Payload { mut file, sum, length, failure } = buffered.into_parts().0;
        if let Some(failure) = failure {
            return Err(failure);
        }
        written.map_err(io::Error::other).and(flushed)?;
        let header =
            [&MAGIC[..], &VERSION.to_le_bytes(), &length.to_le_bytes(), &sum.finalize().to_le_bytes()];
        file.rewind()?;
        file.write_all(&header.concat())?;
        Ok(file)
    }

    /// A fingerprint of the state that a run goes on from, to distinguish checkpoints: see [`fnv1a`].
    pub fn fingerprint(&self) -> u64 {
        let state = postcard::to_stdvec(&(&self.engine, self.residual, &self.parts));
        fnv1a(&state.expect("a checkpoint can be written"))
    }

    /// Refuses to go on with another scene, or with files of it that have changed.
    ///
    /// # Errors
    /// The first key that differs.
    pub fn require_of(&self, folder: &Path, scene: &Scene, digest: u64) -> Result<(), CheckpointError> {
        let path = folder.join(FILE);
        let now = as_json(scene);
        if self.scene != now {
            let parsed = |text: &str| serde_json::from_str::<Value>(text).unwrap_or_default();
            let differs = first_difference(&parsed(&self.scene), &parsed(&now), String::new());
            let what = differs.unwrap_or_else(|| "it is written otherwise".to_owned());
            return Err(CheckpointError::foreign(path, &what));
        }
        if self.digest != digest {
            let what = "the keys are the same, but the body, or a file that the scene names, is not";
            return Err(CheckpointError::foreign(path, what));
        }
        Ok(())
    }
}

impl Checkpoint<'static> {
    /// Reads the checkpoint of a folder; `None` if there is none.
    ///
    /// # Errors
    /// One that cannot be read, is not whole, or was written by another version.
    pub fn read(folder: &Path) -> Result<Option<Self>, CheckpointError> {
        let path = folder.join(FILE);
        match read_regular(&path) {
            Ok(bytes) => Self::of_bytes(&path, &bytes).map(Some),
            Err(source) if source.kind() == ErrorKind::NotFound => Ok(None),
            Err(source) => Err(CheckpointError::Unreadable { path, source }),
        }
    }

    /// Puts the state of a body, or of a part of one, together from those of all ranks that the checkpoint names.
    ///
    /// # Errors
    /// A file that cannot be read or is of another step, and a body that it does not fit.
    pub fn join(&mut self, folder: &Path, setup: &Setup) -> Result<(), CheckpointError> {
        if self.parts.others.is_empty() && setup.body.part.is_none() {
            return Ok(());
        }
        let Parts { first, others } = std::mem::take(&mut self.parts);
        let exact = setup.body.exact();
        let needed = setup.body.index_from(exact.start)..setup.body.index_from(exact.end);
        let mut pieces = vec![(first, self.engine.clone())];
        for OtherPart { file, first, count } in others {
            // Those with nothing but particles along an outline are beside it.
            if first > needed.end || first + count < needed.start {
                continue;
            }
            let path = folder.join(file);
            let bytes = read_regular(&path)
                .map_err(|source| CheckpointError::Unreadable { path: path.clone(), source })?;
            let piece = Self::of_bytes(&path, &bytes)?;
            if (piece.engine.step(), piece.engine.count()) != (self.engine.step(), count) {
                return Err(CheckpointError::corrupted(path, "it is of another step, or of other particles"));
            }
            pieces.push((first, piece.engine));
        }
        let joined = EngineState::of_pieces(&pieces, setup);
        self.engine =
            joined.map_err(|error| CheckpointError::foreign(folder.join(FILE), &error.to_string()))?;
        Ok(())
    }

    fn of_bytes(path: &Path, bytes: &[u8]) -> Result<Self, CheckpointError> {
        let unfit = |what: String, help| CheckpointError::Unfit { path: path.to_owned(), what, help };
        let begins = bytes.len().min(MAGIC.len());
        if bytes[..begins] != MAGIC[..begins] {
            let help = "give the folder of a run; remove the file to start again";
            return Err(unfit("is no checkpoint of flockform".to_owned(), help));
        }
        let found = bytes.len() as u64;
        let truncated = |needed| unfit(format!("is truncated: it has {found} bytes of {needed}"), RESTORE);
        if found < HEADER as u64 {
            return Err(truncated(HEADER as u64));
        }
        let of_another = |found: &str, known: &str| {
            let help = "resume with the program that wrote it, or remove it and start the run again";
            unfit(format!("is of {found}, this is {known}: the same bits cannot be promised"), help)
        };
        let four = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        let version = four(8);
        if version != VERSION {
            return Err(of_another(&format!("layout {version}"), &format!("layout {VERSION}")));
        }
        let length = u64::from_le_bytes(bytes[12..20].try_into().expect("eight bytes"));
        let needed = length.saturating_add(HEADER as u64);
        if found < needed {
            return Err(truncated(needed));
        }
        let corrupted = |what: &str| CheckpointError::corrupted(path.to_owned(), what);
        if found > needed {
            return Err(corrupted("bytes follow its end"));
        }
        if crc32fast::hash(&bytes[HEADER..]) != four(20) {
            return Err(corrupted("its checksum differs"));
        }
        // The version comes first, since another one may hold other things behind it.
        let program: &str = postcard::take_from_bytes(&bytes[HEADER..])
            .map(|(program, _)| program)
            .map_err(|_| corrupted("it names no version of flockform"))?;
        if program != PROGRAM_VERSION {
            let (found, known) = (format!("flockform {program}"), format!("flockform {PROGRAM_VERSION}"));
            return Err(of_another(&found, &known));
        }
        postcard::from_bytes(&bytes[HEADER..])
            .map_err(|error| corrupted(&format!("its checksum is right, but {error}")))
    }
}

/// The part behind the header, on its way to the disk.
struct Payload {
    file: File,
    sum: crc32fast::Hasher,
    length: u64,
    /// The error of the system: postcard has one error for all faults of a writer.
    failure: Option<io::Error>,
}

impl Write for Payload {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Err(failure) = self.file.write_all(bytes) {
            let kind = failure.kind();
            self.failure = Some(failure);
            return Err(kind.into());
        }
        self.sum.update(bytes);
        self.length += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Removes the checkpoint files of a folder.
pub fn remove(folder: &Path) {
    for name in [PART, FILE] {
        match fs::remove_file(folder.join(name)) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                tracing::warn!("{} is left in {}: {error}", name, folder.display());
            }
            _ => {}
        }
    }
    remove_parts(folder, |_| false);
}

/// The name of a rank's part of the checkpoint of a step.
fn part_name(step: usize, rank: impl Display) -> String {
    format!("{FILE}.{step}.{rank}")
}

/// Whether a file of this name is a rank's part of a checkpoint.
pub(super) fn is_part(name: &str) -> bool {
    let numbers = name.strip_prefix(FILE).and_then(|rest| rest.strip_prefix('.'));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    numbers.and_then(|numbers| numbers.split_once('.')).is_some_and(|(a, b)| is_number(a) && is_number(b))
}

fn remove_parts(folder: &Path, is_kept: impl Fn(&str) -> bool) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if is_part(&name)
            && !is_kept(&name)
            && let Err(error) = fs::remove_file(entry.path())
        {
            tracing::warn!("{name} is left in {}: {error}", folder.display());
        }
    }
}

fn as_json(scene: &Scene) -> String {
    serde_json::to_string(&scene.raw).expect("a scene was read from text")
}
