//! The journal of a sweep: what was asked for, and every run that has ended.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::super::error::{ExportError, write_file};
use super::super::{OutputFolder, summary, unfinished};
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
    /// The runs asked for, those of other shards included.
    ///
    /// # Errors
    /// Names what is no variation.
    pub fn design(&self) -> Result<Design, DesignError> {
        let factors: Vec<Factor> = self.vary.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
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
pub struct Begun {
    program: String,
    version: String,
    /// Of the scene without the variations, as text.
    scene_crc32: u32,
    /// The command line.
    pub request: SweepRequest,
}

impl Begun {
    /// A sweep of this scene, which is the one without the variations.
    pub fn new(request: SweepRequest, scene: &Scene) -> Self {
        let (program, version) = (summary::PROGRAM.to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        Self { program, version, scene_crc32: crc32(scene), request }
    }

    /// Refuses to add runs of another scene or of another program.
    ///
    /// # Errors
    /// Says which of the two it is.
    pub fn require_of(&self, folder: &Path, scene: &Scene) -> Result<(), SweepError> {
        let now = Self::new(self.request.clone(), scene);
        let what = if self.version != now.version {
            format!("of version {} of the program", self.version)
        } else if self.scene_crc32 != now.scene_crc32 {
            format!("of another `{}`", self.request.scene)
        } else {
            return Ok(());
        };
        Err(SweepError::Foreign { folder: folder.to_owned(), what })
    }

    /// The sweep of which this one is a part, or all.
    pub fn whole(&self) -> Self {
        Self { request: self.request.whole(), ..self.clone() }
    }
}

fn crc32(scene: &Scene) -> u32 {
    // A scene that was read can be written.
    crc32fast::hash(serde_json::to_string(&scene.raw).unwrap_or_default().as_bytes())
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
}

/// Error reading a sweep that has begun.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The folder holds none.
    #[error(
        "neither {} nor {} holds a sweep\n  help: give the --out of a sweep, finished or not",
        .unfinished.display(), .out.display()
    )]
    Nothing {
        /// The folder of an unfinished sweep.
        unfinished: PathBuf,
        /// The folder of outputs.
        out: PathBuf,
    },
    /// A file cannot be read, or is not what was written.
    #[error("{} cannot be read: {source}\n  help: restore it from a copy, or start the sweep again", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The fault.
        source: io::Error,
    },
    /// Two sweeps that are not parts of one.
    #[error(
        "{} and {} are not parts of one sweep\n  help: merge the shards of one command line, of one version of the program",
        .one.display(), .other.display()
    )]
    Apart {
        /// The folder of one.
        one: PathBuf,
        /// The folder of the other.
        other: PathBuf,
    },
    /// The runs are of something else.
    #[error("the runs in {} are {what}\n  help: restore what was changed, or start the sweep again", .folder.display())]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// The origin of the runs, in words.
        what: String,
    },
}

/// A sweep on disk.
#[derive(Debug)]
pub struct Found {
    /// Where it stands.
    pub folder: PathBuf,
    /// Where its results go.
    pub out: PathBuf,
    /// The request and its scene.
    pub begun: Begun,
    /// The runs that have ended, in that order.
    pub rows: Vec<Row>,
    /// Bytes of the journal that hold them: what follows was being written.
    pub whole: u64,
}

/// Reads the sweep to `dir`, of either name: an unfinished one stands beside the place of its results.
///
/// # Errors
/// A folder without a sweep, or files that cannot be read.
pub fn read(dir: &Path) -> Result<Found, SweepError> {
    let stem = dir.file_stem().filter(|_| dir.extension().is_some_and(|ending| ending == "unfinished"));
    let out = stem.map_or_else(|| dir.to_owned(), |stem| dir.with_file_name(stem));
    let candidates = [unfinished(&out), out.clone()];
    let Some(folder) = candidates.into_iter().find(|folder| folder.join(REQUEST).is_file()) else {
        return Err(SweepError::Nothing { unfinished: unfinished(&out), out });
    };
    let unreadable = |path: PathBuf| move |source: io::Error| SweepError::Unreadable { path, source };
    let path = folder.join(REQUEST);
    let text = fs::read_to_string(&path).map_err(unreadable(path.clone()))?;
    let begun: Begun = serde_json::from_str(&text).map_err(|error| unreadable(path.clone())(error.into()))?;
    let path = folder.join(RUNS);
    let text = fs::read(&path).map_err(unreadable(path.clone()))?;
    let (rows, whole) = whole_rows(&text);
    // A row of a run that the design does not have would be of another request.
    let count =
        begun.request.design().map_err(|error| unreadable(path.clone())(io::Error::other(error)))?.runs.len();
    if rows.iter().any(|row| row.run >= count || row.outputs.len() != begun.request.outputs.len()) {
        return Err(SweepError::Foreign { folder, what: "not those of its sweep.json".to_owned() });
    }
    Ok(Found { folder, out, begun, rows, whole })
}

/// The rows up to the first that is not whole, and how many bytes they take.
fn whole_rows(text: &[u8]) -> (Vec<Row>, u64) {
    let (mut rows, mut whole) = (Vec::new(), 0);
    for line in text.split_inclusive(|&byte| byte == b'\n') {
        match serde_json::from_slice(line) {
            Ok(row) if line.ends_with(b"\n") => rows.push(row),
            _ => break,
        }
        whole += line.len() as u64;
    }
    (rows, whole)
}

/// The list of a sweep's runs, to which any thread adds.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: Mutex<File>,
}

impl Journal {
    /// Begins one, with runs that were made before, and puts the folder in the open.
    ///
    /// # Errors
    /// A file that cannot be written, or an unfinished sweep in the place.
    pub fn begin(folder: &mut OutputFolder, begun: &Begun, rows: &[Row]) -> Result<Self, ExportError> {
        let path = folder.path(REQUEST);
        let mut text = serde_json::to_string_pretty(begun).map_err(ExportError::io("write", &path))?;
        text.push('\n');
        write_file(&path, text)?;
        let path = folder.path(RUNS);
        let lines: Result<Vec<String>, _> = rows.iter().map(line).collect();
        write_file(&path, lines.map_err(ExportError::io("write", &path))?.concat())?;
        // It takes its name when it can be gone on with.
        folder.keep_unfinished()?;
        Self::open(folder)
    }

    /// Goes on with the journal of a sweep that was killed or interrupted, after its last whole row.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn resume(folder: &OutputFolder, found: &Found) -> Result<Self, ExportError> {
        let journal = Self::open(folder)?;
        {
            let file = journal.file.lock().unwrap_or_else(PoisonError::into_inner);
            file.set_len(found.whole).map_err(ExportError::io("write", &journal.path))?;
        }
        Ok(journal)
    }

    fn open(folder: &OutputFolder) -> Result<Self, ExportError> {
        let path = folder.path(RUNS);
        let file = OpenOptions::new().append(true).open(&path).map_err(ExportError::io("write", &path))?;
        Ok(Self { path, file: Mutex::new(file) })
    }

    /// Adds a run; once this returns, a kill does not lose it.
    ///
    /// # Errors
    /// The system refuses to write.
    pub fn add(&self, row: &Row) -> Result<(), ExportError> {
        let line = line(row).map_err(ExportError::io("write", &self.path))?;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(line.as_bytes()).map_err(ExportError::io("write", &self.path))
    }
}

fn line(row: &Row) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string(row)? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read_up_to_the_one_that_a_kill_cut() {
        let row = |run: usize| Row {
            run,
            stop_reason: "steps".into(),
            outputs: vec!["0.1".into(), String::new()],
            reason: "a\nline".into(),
        };
        let lines: Vec<String> = (0..3).map(|run| line(&row(run)).unwrap()).collect();
        let all = lines.concat();
        assert_eq!(whole_rows(all.as_bytes()), ((0..3).map(row).collect(), all.len() as u64));
        let two = lines[..2].concat();
        for cut in two.len()..all.len() {
            assert_eq!(
                whole_rows(&all.as_bytes()[..cut]),
                ((0..2).map(row).collect(), two.len() as u64),
                "{cut}"
            );
        }
    }
}
