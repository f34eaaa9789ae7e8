//! The journal of a sweep: what was asked for, and every run that has ended.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::super::error::{ExportError, write_file};
use super::super::manifest::{read_regular, require_regular};
use super::super::{OutputFolder, out_of, summary, unfinished};
use crate::scene::Scene;
use crate::study::design::{Design, DesignError, Factor, Sampling, Shard};

/// The file with the request, by which an unfinished sweep is known.
pub(in crate::export) const REQUEST: &str = "sweep.json";
const RUNS: &str = "runs.jsonl";

/// The command line of a sweep, which `--resume` and `--merge` do not repeat.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SweepRequest {
    /// Name of a bundled scene, or the absolute path of a file.
    pub scene: String,
    /// Overrides of every run, as given.
    pub set: Vec<String>,
    /// Keys and their values, as given.
    pub vary: Vec<String>,
    /// Number of runs, how they are drawn, and the seed; a grid where there is none.
    pub samples: Option<(usize, Sampling, u64)>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// The part of the runs that this sweep makes.
    pub shard: Shard,
    /// Whether former outputs may be replaced.
    pub force: bool,
}

impl SweepRequest {
    /// The runs asked for, those of other shards included; `is_whole` says of a key, and of where its range begins, that it takes
    /// whole numbers alone.
    ///
    /// # Errors
    /// Names what is no variation.
    pub fn design(&self, is_whole: impl Fn(&str, f64) -> bool) -> Result<Design, DesignError> {
        let factor = |text: &String| Ok(text.parse::<Factor>()?.in_whole_numbers(&is_whole));
        let factors: Vec<Factor> = self.vary.iter().map(factor).collect::<Result<_, _>>()?;
        match self.samples {
            None => Design::grid(factors),
            Some((count, sampling, seed)) => Design::sampled(factors, count, sampling, seed),
        }
    }

    /// The request for all runs, of which this one asks for a part.
    pub fn whole(&self) -> Self {
        Self { shard: Shard::WHOLE, force: false, ..self.clone() }
    }
}

/// A sweep that has begun: the request, and which scene it is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JournalHeader {
    program: String,
    version: String,
    /// Of the scene without the variations, as text.
    scene_crc32: u32,
    /// The command line.
    pub request: SweepRequest,
}

impl JournalHeader {
    /// A sweep of this scene, which is the one without the variations.
    pub fn new(request: SweepRequest, scene: &Scene) -> Self {
        let (program, version) = (summary::PROGRAM.to_owned(), summary::VERSION.to_owned());
        Self { program, version, scene_crc32: crc32(&scene.raw), request }
    }

    /// Refuses to add the runs of `now` where they are of another scene or of another program.
    ///
    /// # Errors
    /// Says which of the two it is.
    pub fn require_same(&self, folder: &Path, now: &Self) -> Result<(), SweepError> {
        let what = if self.version != now.version {
            format!("of version {} of the program", self.version)
        } else if self.scene_crc32 != now.scene_crc32 {
            format!("of another `{}`", self.request.scene)
        } else {
            return Ok(());
        };
        Err(SweepError::foreign(folder, &what))
    }

    /// The sweep of which this one is a part, or all.
    pub fn whole(&self) -> Self {
        Self { request: self.request.whole(), ..self.clone() }
    }
}

fn crc32(of: &impl Serialize) -> u32 {
    // What was read can be written.
    crc32fast::hash(serde_json::to_string(of).unwrap_or_default().as_bytes())
}

/// What is written, with a checksum: one bit that changes on the disk may leave another number, which reads as well.
#[derive(Serialize, Deserialize)]
struct Summed<T> {
    crc32: u32,
    #[serde(flatten)]
    of: T,
}

impl<T: Serialize> Summed<T> {
    fn new(of: T) -> Self {
        Self { crc32: crc32(&of), of }
    }
}

impl<T: Serialize + DeserializeOwned> Summed<T> {
    /// # Errors
    /// What is no such text, or another one than was written.
    fn read(text: &[u8]) -> io::Result<T> {
        let Self { crc32: written, of } = serde_json::from_slice(text)?;
        match crc32(&of) == written {
            true => Ok(of),
            false => Err(io::Error::other("it is damaged: its checksum differs")),
        }
    }
}

/// A run that has ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// Its number in the design, from 0.
    pub run: usize,
    /// The reason for its end, by name; `refused` for one that could not begin.
    pub stop_reason: String,
    /// The outputs as text, empty where there is none: numbers read back as the same.
    pub outputs: Vec<String>,
    /// The cause of a refusal or a divergence.
    pub reason: String,
    /// What its summary cautions against.
    pub cautions: Vec<String>,
    /// Checksum of each file that its scene named, by path; none of a file that could not be read.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub files: BTreeMap<String, Option<u32>>,
}

impl Row {
    /// How a run ended that could not begin.
    pub const REFUSED: &str = "refused";

    /// Whether it could not begin: another time it may.
    pub fn is_refused(&self) -> bool {
        self.stop_reason == Self::REFUSED
    }
}

/// Checksums of the files of a run, as they are now: see [`Row::files`].
pub fn checksums(files: &[PathBuf]) -> BTreeMap<String, Option<u32>> {
    files.iter().map(|file| (file.to_string_lossy().into_owned(), checksum(file))).collect()
}

fn checksum(file: &Path) -> Option<u32> {
    // A pipe has been read by now, and has no more.
    fs::metadata(file).ok().filter(fs::Metadata::is_file)?;
    Some(crc32fast::hash(&fs::read(file).ok()?))
}

/// The runs of these sweeps, which are parts of one, by their number; one that ran before one that was refused.
///
/// # Errors
/// Names the folders of two different results of one run, or of runs with different files, and files that are not what
/// they were.
pub fn gather(parts: &[StoredSweep]) -> Result<BTreeMap<usize, Row>, SweepError> {
    let mut rows: BTreeMap<usize, (&Row, &StoredSweep)> = BTreeMap::new();
    let mut files: BTreeMap<&str, (Option<u32>, &StoredSweep)> = BTreeMap::new();
    for (part, row) in parts.iter().flat_map(|part| part.rows.iter().map(move |row| (part, row))) {
        for (file, &sum) in &row.files {
            let (known, of) = *files.entry(file).or_insert((sum, part));
            if known != sum {
                return Err(SweepError::apart(
                    &of.folder,
                    &part.folder,
                    &format!("{file} changed between them"),
                ));
            }
        }
        match rows.get(&row.run) {
            Some((known, of)) if !known.is_refused() && !row.is_refused() && *known != row => {
                let why = format!("they have two results of run {}", row.run);
                return Err(SweepError::apart(&of.folder, &part.folder, &why));
            }
            Some((known, _)) if !known.is_refused() => {}
            _ => _ = rows.insert(row.run, (row, part)),
        }
    }
    for (file, (sum, part)) in files {
        if checksum(Path::new(file)) != sum {
            return Err(SweepError::foreign(
                &part.folder,
                &format!("of another body: {file} is not what it was"),
            ));
        }
    }
    Ok(rows.into_iter().map(|(run, (row, _))| (run, row.clone())).collect())
}

/// Error in the name of an output, or reading a sweep that has begun: the fault and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{fault}\n  help: {help}")]
pub struct SweepError {
    fault: String,
    help: String,
}

impl SweepError {
    fn new(fault: String, help: impl Into<String>) -> Self {
        Self { fault, help: help.into() }
    }

    pub(super) fn of_output(fault: &str, help: impl Into<String>) -> Self {
        Self::new(format!("--outputs {fault}"), help)
    }

    /// Sweeps in two folders that are not parts of one: `why`, in words.
    pub fn apart(one: &Path, other: &Path, why: &str) -> Self {
        if one == other {
            return Self::foreign(one, &format!("not of one sweep: {why}"));
        }
        let fault = format!("{} and {} are not parts of one sweep: {why}", one.display(), other.display());
        Self::new(
            fault,
            "merge the shards of one command line, of one version of the program and with the same files",
        )
    }

    fn unreadable(path: &Path, fault: impl Display) -> Self {
        let fault = format!("{} cannot be read: {fault}", path.display());
        Self::new(fault, "restore it from a copy, or start the sweep again")
    }

    /// Runs of something else: `what` says of what, in words.
    fn foreign(folder: &Path, what: &str) -> Self {
        let fault = format!("the runs in {} are {what}", folder.display());
        Self::new(fault, "restore what was changed, or start the sweep again")
    }
}

/// A sweep on disk.
#[derive(Debug)]
pub struct StoredSweep {
    /// Where it stands.
    pub folder: PathBuf,
    /// Where its results go.
    pub out: PathBuf,
    /// The request and its scene.
    pub begun: JournalHeader,
    /// The runs that have ended, in that order.
    pub rows: Vec<Row>,
    /// Bytes of the journal that hold them: what follows was being written.
    pub whole: u64,
}

/// Reads the sweep to `dir`, of either name: an unfinished one stands beside the place of its results.
///
/// # Errors
/// A folder without a sweep, or files that cannot be read.
pub fn read(dir: &Path) -> Result<StoredSweep, SweepError> {
    let out = out_of(dir);
    let candidates = [unfinished(&out), out.clone()];
    let holds = |folder: &&PathBuf| fs::symlink_metadata(folder.join(REQUEST)).is_ok();
    let Some(folder) = candidates.iter().find(holds).cloned() else {
        let [unfinished, out] = candidates.map(|folder| folder.display().to_string());
        let fault = format!("neither {unfinished} nor {out} holds a sweep");
        return Err(SweepError::new(fault, "give the --out of a sweep, finished or not"));
    };
    let begun: JournalHeader = parsed(&folder.join(REQUEST), Summed::read)?;
    let (rows, whole) = parsed(&folder.join(RUNS), whole_rows)?;
    let design = begun.request.design(|_, _| false);
    let design = design.map_err(|error| SweepError::unreadable(&folder.join(REQUEST), error))?;
    // A row of a run that the design does not have would be of another request.
    let (runs, outputs) = (design.runs.len(), begun.request.outputs.len());
    if outputs == 0 || rows.iter().any(|row| row.run >= runs || row.outputs.len() != outputs) {
        return Err(SweepError::foreign(&folder, "not those of its sweep.json"));
    }
    Ok(StoredSweep { folder, out, begun, rows, whole })
}

/// Contents of a file of a sweep.
fn parsed<T>(path: &Path, parse: impl FnOnce(&[u8]) -> io::Result<T>) -> Result<T, SweepError> {
    read_regular(path).and_then(|text| parse(&text)).map_err(|error| SweepError::unreadable(path, error))
}

/// The rows without the last line where a kill cut that, and how many bytes they take.
///
/// # Errors
/// Names a damaged line before the last, which no kill leaves behind.
fn whole_rows(text: &[u8]) -> io::Result<(Vec<Row>, u64)> {
    let (mut rows, mut whole) = (Vec::new(), 0);
    for (n, line) in text.split_inclusive(|&byte| byte == b'\n').enumerate() {
        let next = whole + line.len();
        match Summed::read(line) {
            Ok(row) if line.ends_with(b"\n") => rows.push(row),
            _ if next == text.len() => break,
            _ => return Err(io::Error::other(format!("line {} is damaged", n + 1))),
        }
        whole = next;
    }
    Ok((rows, whole as u64))
}

/// The list of a sweep's runs, to which any thread adds.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    kept: Mutex<Kept>,
}

#[derive(Debug)]
struct Kept {
    file: File,
    /// Of the runs that it holds: see [`Row::files`].
    checksums: BTreeMap<String, Option<u32>>,
}

impl Kept {
    /// Refuses a run with other files than those before.
    fn require_same_files(&mut self, journal: &Path, row: &Row) -> Result<(), SweepError> {
        for (name, &sum) in &row.files {
            if *self.checksums.entry(name.clone()).or_insert(sum) != sum {
                let folder = journal.parent().unwrap_or(journal);
                return Err(SweepError::apart(folder, folder, &format!("{name} changed between them")));
            }
        }
        Ok(())
    }
}

impl Journal {
    /// Begins one, with runs that were made before, and puts the folder in the open.
    ///
    /// # Errors
    /// A file that cannot be written, or an unfinished sweep in the place.
    pub fn begin(
        folder: &mut OutputFolder,
        begun: &JournalHeader,
        rows: &[Row],
    ) -> Result<Self, ExportError> {
        summary::write_json(folder, REQUEST, &Summed::new(begun))?;
        let path = folder.path(RUNS);
        let lines: Result<Vec<String>, _> = rows.iter().map(line).collect();
        write_file(&path, lines.map_err(ExportError::io("write", &path))?.concat())?;
        // It takes its name when it can be gone on with.
        folder.keep_unfinished()?;
        Self::open(folder.folder(), rows)
    }

    /// Goes on with the journal of a sweep that was killed or interrupted, after its last whole row.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn resume(folder: &OutputFolder, found: &StoredSweep) -> Result<Self, ExportError> {
        let mut journal = Self::open(folder.folder(), &found.rows)?;
        let kept = journal.kept.get_mut().unwrap_or_else(PoisonError::into_inner);
        kept.file.set_len(found.whole).map_err(ExportError::io("write", &journal.path))?;
        Ok(journal)
    }

    fn open(folder: &Path, rows: &[Row]) -> Result<Self, ExportError> {
        let path = folder.join(RUNS);
        require_regular(&path).map_err(ExportError::io("write", &path))?;
        let file = OpenOptions::new().append(true).open(&path).map_err(ExportError::io("write", &path))?;
        let checksums = rows.iter().flat_map(|row| row.files.clone()).collect();
        Ok(Self { path, kept: Mutex::new(Kept { file, checksums }) })
    }

    /// Adds a run; once this returns, a kill does not lose it.
    ///
    /// # Errors
    /// A run with other files than those before, or the system refuses to write.
    pub fn add(&self, row: &Row) -> Result<(), ExportError> {
        let line = line(row).map_err(ExportError::io("write", &self.path))?;
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.require_same_files(&self.path, row)?;
        let add = |file: &mut File| {
            let before = file.metadata()?.len();
            // A part of a row would damage the journal for the rows that other threads still add.
            file.write_all(line.as_bytes()).inspect_err(|_| {
                let _ = file.set_len(before);
            })
        };
        add(&mut kept.file).map_err(ExportError::io("write", &self.path))
    }
}

fn line(row: &Row) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string(&Summed::new(row))? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(run: usize) -> Row {
        let outputs = vec!["0.1".into(), String::new()];
        Row {
            run,
            stop_reason: "steps".into(),
            outputs,
            reason: "a\nline".into(),
            cautions: vec!["so".into()],
            files: BTreeMap::from([("a.csv".into(), Some(7)), ("b.csv".into(), None)]),
        }
    }

    #[test]
    fn rows_are_read_up_to_the_one_that_a_kill_cut() {
        let lines: Vec<String> = (0..3).map(|run| line(&row(run)).unwrap()).collect();
        let all = lines.concat();
        let read = |text: &str| whole_rows(text.as_bytes()).unwrap();
        assert_eq!(read(&all), ((0..3).map(row).collect(), all.len() as u64));
        let two = lines[..2].concat();
        for cut in two.len()..all.len() {
            assert_eq!(read(&all[..cut]), ((0..2).map(row).collect(), two.len() as u64), "{cut}");
        }
    }

    #[test]
    fn a_run_with_another_file_than_those_before_is_refused_at_once() {
        let place = std::env::temp_dir().join(format!("flockform-journal-{}", std::process::id()));
        std::fs::create_dir(&place).expect("writable");
        std::fs::write(place.join(RUNS), "").expect("writable");
        let journal = Journal::open(&place, &[row(0)]).expect("a journal");
        let changed = Row { files: BTreeMap::from([("a.csv".into(), Some(8))]), ..row(2) };
        let refused = journal.add(&changed).expect_err("another file").to_string();
        journal.add(&row(1)).expect("the same files");
        let written = std::fs::read(place.join(RUNS)).expect("readable");
        std::fs::remove_dir_all(&place).expect("removed");
        assert!(refused.contains("a.csv changed between them") && refused.contains("help: restore"));
        assert_eq!(whole_rows(&written).expect("whole").0, [row(1)]);
    }

    #[test]
    fn a_bit_that_changed_is_found_or_changes_nothing() {
        let text: Vec<u8> = (0..2).flat_map(|run| line(&row(run)).unwrap().into_bytes()).collect();
        let rows = [row(0), row(1)];
        let request = SweepRequest {
            scene: "tension".into(),
            set: vec!["stop.steps=2".into()],
            vary: vec!["update.damping=0.5:1:2".into()],
            samples: Some((2, Sampling::Random, 7)),
            outputs: vec!["residual".into()],
            shard: Shard { number: 1, of: 2 },
            force: false,
        };
        let begun = JournalHeader { program: "p".into(), version: "1".into(), scene_crc32: 8, request };
        let written = serde_json::to_vec_pretty(&Summed::new(&begun)).unwrap();
        for bit in 0..8 * text.len() {
            let mut text = text.clone();
            text[bit / 8] ^= 1 << (bit % 8);
            // A last line may be one that a kill cut: it is made again.
            assert!(
                whole_rows(&text).is_ok_and(|(read, _)| rows.starts_with(&read))
                    || whole_rows(&text).is_err()
            );
        }
        for bit in 0..8 * written.len() {
            let mut text = written.clone();
            text[bit / 8] ^= 1 << (bit % 8);
            assert!(Summed::<JournalHeader>::read(&text).map_or(true, |read| read == begun), "{bit}");
        }
    }

    #[test]
    fn a_damaged_row_with_others_behind_it_is_named() {
        let line = |run| line(&row(run)).unwrap();
        let text = format!("{}{}\n{}", line(0), &line(1)[..9], line(2));
        let error = whole_rows(text.as_bytes()).expect_err("damaged").to_string();
        assert!(error.contains("line 2"), "{error}");
    }
}
