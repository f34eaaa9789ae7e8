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

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::ExportError;
use super::manifest::create;
use super::parts::write_each;
use super::report::AnimationState;
use crate::continuum::digest::fnv1a;
use crate::continuum::record::{LoadStep, ProbeSeries, Snapshot};
use crate::engine::setup::Setup;
use crate::engine::state::EngineState;
use crate::ranks::Team;
use crate::scene::Scene;

/// Its name in the folder of the run.
pub const FILE: &str = "checkpoint";
pub(super) const PART: &str = "checkpoint.part";
const MAGIC: [u8; 8] = *b"FLOCKFRM";
const VERSION: u32 = 5;
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
    /// Configurations that are to be drawn at the end.
    pub snapshots: Cow<'a, [Snapshot]>,
    /// Histories of the probed particles so far.
    pub probes: Cow<'a, [ProbeSeries]>,
    /// The response to the load so far, where it changes.
    pub load_steps: Cow<'a, [LoadStep]>,
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

/// The records of a run so far.
type Recorded<'a> = (&'a [Snapshot], &'a [ProbeSeries], &'a [LoadStep], Option<AnimationState<'a>>);

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

/// Error resuming a run from a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Neither of the two folders has a checkpoint.
    #[error(
        "there is nothing to resume: neither {} nor {} holds a checkpoint\n  help: start the run again; one that ends by itself leaves none, and the first is written after --checkpoint-every",
        .unfinished.display(), .out.display()
    )]
    Nothing {
        /// The folder of an unfinished run.
        unfinished: PathBuf,
        /// The folder of outputs.
        out: PathBuf,
    },
    /// The system refuses to read the checkpoint.
    #[error("{} cannot be read: {source}", .path.display())]
    Unreadable {
        /// Path of the checkpoint.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The file does not begin as a checkpoint does.
    #[error("{} is no checkpoint of flockform\n  help: give the folder of a run; remove the file to start again", .path.display())]
    NotOne {
        /// Path of the checkpoint.
        path: PathBuf,
    },
    /// The file ends before its payload does.
    #[error(
        "{} is truncated: it has {found} bytes of {needed}\n  help: restore it from a copy, or remove it and start the run again",
        .path.display()
    )]
    Truncated {
        /// Path of the checkpoint.
        path: PathBuf,
        /// Its size \[byte\].
        found: u64,
        /// The size that its header asks for \[byte\].
        needed: u64,
    },
    /// The payload is not what was written.
    #[error(
        "{} is corrupted: {what}\n  help: restore it from a copy, or remove it and start the run again",
        .path.display()
    )]
    Corrupted {
        /// Path of the checkpoint.
        path: PathBuf,
        /// The fault in it.
        what: String,
    },
    /// Another version of the layout or of the program wrote the file.
    #[error(
        "{} is of {found}, this is {known}: the same bits cannot be promised\n  help: resume with the program that wrote it, or remove it and start the run again",
        .path.display()
    )]
    Version {
        /// Path of the checkpoint.
        path: PathBuf,
        /// The version that wrote it.
        found: String,
        /// The version that reads it.
        known: String,
    },
    /// The checkpoint is of another scene, or files that the scene names have changed.
    #[error(
        "{} belongs to another scene: {what}\n  help: resume with the scene that was run, or start this one with another --out",
        .path.display()
    )]
    Foreign {
        /// The file or its folder.
        path: PathBuf,
        /// The difference.
        what: String,
    },
}

impl<'a> Checkpoint<'a> {
    /// A checkpoint of a run with a plan of this `digest`.
    pub fn new(
        (asked, scene, digest): (&RunRequest, &Scene, u64),
        (engine, residual): (EngineState<'a>, f64),
        (snapshots, probes, load_steps, animation): Recorded<'a>,
        stepping: Duration,
    ) -> Self {
        Self {
            program: Cow::Borrowed(PROGRAM_VERSION),
            asked: asked.clone(),
            scene: as_json(scene),
            digest,
            engine,
            residual,
            snapshots: Cow::Borrowed(snapshots),
            probes: Cow::Borrowed(probes),
            load_steps: Cow::Borrowed(load_steps),
            animation,
            stepping,
            parts: Parts::default(),
        }
    }

    /// The checkpoint of a body of which each rank has a part, made by all ranks together: the others write their states, each
    /// that of the particles from the number `first` of the whole body on, into the `folder` of the first one, which names them.
    ///
    /// # Errors
    /// A state that cannot be written, by any rank, or what the first one says of its own: `ready`.
    pub fn with_parts(
        mut self,
        folder: Option<&Path>,
        (first, team): (usize, &Team),
        ready: Result<(), ExportError>,
    ) -> Result<Self, ExportError> {
        let step = self.engine.step();
        let name = |rank: usize| part_name(step, rank);
        let write = |path: &Path| -> io::Result<()> { self.write_to(create(path)?)?.sync_all() };
        write_each(folder, name, team, |path| match folder {
            Some(_) => ready,
            None => write(path).map_err(ExportError::io("write", path)),
        })?;
        let parts = team.each([first as u64, self.engine.count() as u64]).into_iter().enumerate();
        let part = |(rank, [first, count]): (usize, [u64; 2])| OtherPart {
            file: name(rank),
            first: first as usize,
            count: count as usize,
        };
        self.parts.others = parts.skip(1).map(part).collect();
        Ok(self)
    }

    /// Takes the place of the former checkpoint in the folder when it is whole on the disk, as those of all parts are; parts of
    /// the former one are removed.
    pub fn write(&self, folder: &Path) -> Result<(), ExportError> {
        let (part, path) = (folder.join(PART), folder.join(FILE));
        let write = || {
            self.write_to(create(&part)?)?.sync_all()?;
            fs::rename(&part, &path)?;
            sync_folder(folder)
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
    /// [`CheckpointError::Foreign`] names the first key that differs.
    pub fn require_of(&self, folder: &Path, scene: &Scene, digest: u64) -> Result<(), CheckpointError> {
        let path = folder.join(FILE);
        let now = as_json(scene);
        if self.scene != now {
            let parsed = |text: &str| serde_json::from_str::<Value>(text).unwrap_or_default();
            let differs = first_difference(&parsed(&self.scene), &parsed(&now), String::new());
            let what = differs.unwrap_or_else(|| "it is written otherwise".to_owned());
            return Err(CheckpointError::Foreign { path, what });
        }
        if self.digest != digest {
            let what =
                "the keys are the same, but the body, or a file that the scene names, is not".to_owned();
            return Err(CheckpointError::Foreign { path, what });
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
        match fs::read(&path) {
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
            let bytes = fs::read(&path)
                .map_err(|source| CheckpointError::Unreadable { path: path.clone(), source })?;
            let piece = Self::of_bytes(&path, &bytes)?;
            if (piece.engine.step(), piece.engine.count()) != (self.engine.step(), count) {
                let what = "it is of another step, or of other particles".to_owned();
                return Err(CheckpointError::Corrupted { path, what });
            }
            pieces.push((first, piece.engine));
        }
        let joined = EngineState::of_pieces(&pieces, setup);
        self.engine = joined
            .map_err(|error| CheckpointError::Foreign { path: folder.join(FILE), what: error.to_string() })?;
        Ok(())
    }

    fn of_bytes(path: &Path, bytes: &[u8]) -> Result<Self, CheckpointError> {
        let path = || path.to_owned();
        let begins = bytes.len().min(MAGIC.len());
        if bytes[..begins] != MAGIC[..begins] {
            return Err(CheckpointError::NotOne { path: path() });
        }
        if bytes.len() < HEADER {
            let (found, needed) = (bytes.len() as u64, HEADER as u64);
            return Err(CheckpointError::Truncated { path: path(), found, needed });
        }
        let four = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        let version = four(8);
        if version != VERSION {
            let (found, known) = (format!("layout {version}"), format!("layout {VERSION}"));
            return Err(CheckpointError::Version { path: path(), found, known });
        }
        let length = u64::from_le_bytes(bytes[12..20].try_into().expect("eight bytes"));
        let (found, needed) = (bytes.len() as u64, length.saturating_add(HEADER as u64));
        if found < needed {
            return Err(CheckpointError::Truncated { path: path(), found, needed });
        }
        let corrupted = |what: &str| CheckpointError::Corrupted { path: path(), what: what.to_owned() };
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
            return Err(CheckpointError::Version { path: path(), found, known });
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
fn part_name(step: usize, rank: usize) -> String {
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

/// A name that was given in a folder outlives a power cut only when the folder itself is on the disk.
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

fn as_json(scene: &Scene) -> String {
    serde_json::to_string(&scene.raw).expect("a scene was read from text")
}

/// The first key with another value, and both values.
fn first_difference(then: &Value, now: &Value, key: String) -> Option<String> {
    if then == now {
        return None;
    }
    let at = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match (then, now) {
        (Value::Object(a), Value::Object(b)) => {
            let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
            names.into_iter().find_map(|name| {
                let of = |map: &serde_json::Map<_, _>| map.get(name).cloned().unwrap_or_default();
                first_difference(&of(a), &of(b), at(name))
            })
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let pairs = a.iter().zip(b).enumerate();
            pairs.into_iter().find_map(|(n, (a, b))| first_difference(a, b, format!("{key}[{n}]")))
        }
        _ => Some(format!("`{key}` was {}, is {}", shortly(then), shortly(now))),
    }
}

fn shortly(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::continuum::digest::digest;
    use crate::continuum::plan::Plan;
    use crate::engine::Engine;
    use crate::scene::bundled;

    fn scene(sets: &[&str]) -> Scene {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        bundled("tension").expect("bundled").load(&sets).expect("valid")
    }

    fn written(folder: &Path) -> (EngineState<'static>, Vec<u8>) {
        let scene = scene(&[]);
        let plan = Plan::new(&scene).expect("fits");
        let sum = digest(&plan);
        let mut engine = Engine::new(plan.setup);
        let mut probe = ProbeSeries::new(66);
        for _ in 0..25 {
            engine.advance();
            probe.record(&engine);
        }
        let asked = RunRequest { scene: "tension".into(), set: vec!["a.b=1".into()], force: false };
        let state = EngineState::of(&engine);
        let (snapshots, probes) = ([Snapshot::of(&engine)], [probe]);
        let checkpoint = Checkpoint::new(
            (&asked, &scene, sum),
            (state.clone(), f64::INFINITY),
            (&snapshots, &probes, &[], None),
            Duration::from_millis(1500),
        );
        checkpoint.write(folder).expect("written");
        (state.into_owned(), fs::read(folder.join(FILE)).expect("there"))
    }

    #[test]
    fn a_checkpoint_is_read_back_to_the_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(Checkpoint::read(folder.path()).expect("readable").is_none());
        let (state, _) = written(folder.path());
        let read = Checkpoint::read(folder.path()).expect("readable").expect("there");
        assert_eq!(read.engine, state);
        assert_eq!(read.residual, f64::INFINITY);
        assert_eq!(read.stepping, Duration::from_millis(1500));
        let mut other = read.clone();
        assert_eq!(other.fingerprint(), read.fingerprint());
        other.residual = 1.0;
        assert_ne!(other.fingerprint(), read.fingerprint());
        assert_eq!((read.snapshots.len(), read.probes[0].pe1.len()), (1, 25));
        assert_eq!(read.snapshots[0].step, 25);
        let left: Vec<_> = fs::read_dir(folder.path()).expect("readable").flatten().collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }

    #[test]
    fn every_truncation_and_every_flipped_bit_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let (_, bytes) = written(folder.path());
        let path = folder.path().join(FILE);
        for length in (0..bytes.len()).step_by(97).chain(0..40) {
            let error = Checkpoint::of_bytes(&path, &bytes[..length]).expect_err("truncated");
            assert!(matches!(error, CheckpointError::Truncated { .. }), "{length}: {error}");
        }
        for at in (0..bytes.len()).step_by(61).chain(0..40) {
            let mut bytes = bytes.clone();
            bytes[at] ^= 0x10;
            let error = Checkpoint::of_bytes(&path, &bytes).expect_err("corrupted").to_string();
            let expected = match at {
                0..8 => "is no checkpoint of flockform",
                8..12 => "layout",
                12..20 => "",
                _ => "is corrupted: its checksum differs",
            };
            assert!(error.contains(expected) && error.contains("help:"), "byte {at}: {error}");
        }
        let longer = [&bytes[..], &[0]].concat();
        let error = Checkpoint::of_bytes(&path, &longer).expect_err("too long").to_string();
        assert!(error.contains("bytes follow its end"), "{error}");
    }

    #[test]
    fn another_program_s_checkpoint_is_refused_by_its_version() {
        let folder = tempfile::tempdir().expect("a folder");
        let (_, mut bytes) = written(folder.path());
        // The payload begins with the length of the version and the version.
        assert_eq!(&bytes[HEADER + 1..HEADER + 1 + PROGRAM_VERSION.len()], PROGRAM_VERSION.as_bytes());
        bytes[HEADER + 1] = b'9';
        let sum = crc32fast::hash(&bytes[HEADER..]);
        bytes[20..24].copy_from_slice(&sum.to_le_bytes());
        let error = Checkpoint::of_bytes(&folder.path().join(FILE), &bytes).expect_err("other").to_string();
        assert!(error.contains("flockform 9.") && error.contains(PROGRAM_VERSION), "{error}");
    }

    #[test]
    fn a_foreign_scene_is_refused_by_its_key() {
        let folder = tempfile::tempdir().expect("a folder");
        written(folder.path());
        let read = Checkpoint::read(folder.path()).expect("readable").expect("there");
        let held = |sets: &[&str]| {
            let scene = scene(sets);
            read.require_of(folder.path(), &scene, digest(&Plan::new(&scene).expect("fits")))
        };
        held(&[]).expect("the same");
        let error = held(&["lattice.spacing=2.0"]).expect_err("another").to_string();
        assert!(error.contains("`lattice.spacing` was 1.0, is 2.0"), "{error}");
        let error = held(&["roles[1].motion.per_step=[0.5, 0.0]"]).expect_err("another").to_string();
        assert!(error.contains("`roles[1].motion.per_step[0]` was 0.6, is 0.5"), "{error}");
        let error = read.require_of(folder.path(), &scene(&[]), 0).expect_err("changed file").to_string();
        assert!(error.contains("a file that the scene names"), "{error}");
    }
}
