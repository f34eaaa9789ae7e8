//! Arguments that name a scene or a swarm: a bundled one, a file, or a dict; and the keys that are set in it.

use std::path::{Path, PathBuf};

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple};

use super::beside::Progress;
use super::run::interrupt_by;
use crate::scene::bundled::{SCENES, SWARMS, bundled_swarm};
use crate::scene::document::MAX_DEPTH;
use crate::scene::swarm::Swarm;
use crate::scene::text::{is_path, nearest};
use crate::scene::{Bundled, Place, Problem, Scene, SceneError, bundled};
use crate::study::trade::{Chosen, choose};

/// TOML text of a file that is given as a dict.
const UNTITLED: &str = "title = \"Given in Python\"";
const DICT: &str = "the dict";
const CALL: &str = "the call";

/// Where a file comes from, and the overrides on top of it.
#[derive(Clone, Debug)]
pub(super) struct Source {
    origin: Origin,
    set: Vec<String>,
}

#[derive(Clone, Debug)]
enum Origin {
    Bundled(Bundled),
    File(PathBuf),
    /// The keys of a dict, as overrides of a file that has none.
    Keys(Vec<String>),
}

/// The names of all bundled files, and the lookup of one.
type Shelf<'a> = (&'a str, &'a [Bundled], fn(&str) -> Option<Bundled>);

impl Source {
    /// The scene that an argument names.
    pub(super) fn scene(given: &Bound<'_, PyAny>, set: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Self::of(given, set, ("scene", SCENES, bundled))
    }

    /// The swarm that an argument names.
    pub(super) fn swarm(given: &Bound<'_, PyAny>, set: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Self::of(given, set, ("swarm", SWARMS, bundled_swarm))
    }

    fn of(
        given: &Bound<'_, PyAny>,
        set: Option<&Bound<'_, PyAny>>,
        (kind, all, find): Shelf<'_>,
    ) -> PyResult<Self> {
        let set = set.map(overrides).transpose()?.unwrap_or_default();
        if let Ok(keys) = given.cast::<PyMapping>() {
            return Ok(Self { origin: Origin::Keys(assignments(keys, &quoted)?), set });
        }
        let Ok(path) = given.extract::<PathBuf>() else {
            let message = format!("{kind}: give the name of a bundled {kind}, a path or a dict");
            return Err(PyTypeError::new_err(message));
        };
        let origin = match path.to_str().and_then(find) {
            Some(bundled) => Origin::Bundled(bundled),
            None if is_path(&path.to_string_lossy()) => Origin::File(path),
            None => return Err(not_bundled(kind, all, &path.to_string_lossy())),
        };
        Ok(Self { origin, set })
    }

    /// Reads the scene, with more overrides after the given ones.
    pub(super) fn load(&self, more: &[String]) -> Result<Scene, SceneError> {
        let set = [&self.set, more].concat();
        match &self.origin {
            Origin::Bundled(bundled) => bundled.load(&set),
            Origin::File(path) => Scene::from_file(path, &set),
            Origin::Keys(keys) => {
                Scene::parse("python", DICT, UNTITLED, &[keys, &set[..]].concat(), Some(Path::new(".")))
            }
        }
    }

    /// Reads the scene to be run, by the rule and the solver that were chosen for it where it asks for an accuracy. Its
    /// solver ends when the wait for it does.
    pub(super) fn chosen(&self, progress: &Progress) -> Result<Scene, SceneError> {
        let Chosen { mut scene, .. } = choose(self.load(&[])?, &|more: &[String]| self.load(more))?;
        interrupt_by(&mut scene, progress);
        Ok(scene)
    }

    /// Reads the swarm.
    pub(super) fn load_swarm(&self) -> Result<Swarm, SceneError> {
        match &self.origin {
            Origin::Bundled(bundled) => bundled.load_swarm(&self.set),
            Origin::File(path) => Swarm::from_file(path, &self.set),
            Origin::Keys(keys) => {
                let keys = [keys, &self.set[..]].concat();
                Swarm::parse("python", DICT, UNTITLED, &keys, Some(Path::new(".")))
            }
        }
    }
}

fn not_bundled(kind: &str, all: &[Bundled], word: &str) -> PyErr {
    let names: Vec<&str> = all.iter().map(|one| one.name).collect();
    let nearest = nearest(word, &names);
    let nearest = nearest.map_or_else(String::new, |name| format!("; the nearest name is `{name}`"));
    let list = kind.to_uppercase() + "S";
    let (message, help) = match kind {
        "swarm" if bundled(word).is_some() => {
            ("is a bundled scene, no swarm".to_owned(), "flockform.run and flockform.Body take it".to_owned())
        }
        "scene" if bundled_swarm(word).is_some() => {
            ("is a bundled swarm, no scene".to_owned(), "flockform.Swarm takes it".to_owned())
        }
        _ => (
            format!("there is no bundled {kind} and no file of this name{nearest}"),
            format!("flockform.{list} lists the names; a path ends in .toml"),
        ),
    };
    let mut error = SceneError::default();
    error.push(Problem {
        place: Place::File { file: CALL.to_owned() },
        key: kind.to_owned(),
        found: Some(word.to_owned()),
        message,
        help: Some(help),
    });
    error.into()
}

/// The overrides of a `set` argument: a dict of key paths and values, or texts as on the command line.
fn overrides(given: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    let wrong = || PyTypeError::new_err("set: give a dict, or a list of texts KEY.PATH=VALUE");
    if let Ok(keys) = given.cast::<PyMapping>() {
        return assignments(keys, &str::to_owned);
    }
    if given.is_instance_of::<PyString>() {
        return Err(wrong());
    }
    given.extract::<Vec<String>>().map_err(|_| wrong())
}

fn assignments(keys: &Bound<'_, PyMapping>, written: &dyn Fn(&str) -> String) -> PyResult<Vec<String>> {
    let assignment = |item: Bound<'_, PyAny>| {
        let (key, value): (String, Bound<'_, PyAny>) =
            item.extract().map_err(|_| PyTypeError::new_err("keys of a scene are texts"))?;
        Ok(format!("{}={}", written(&key), toml(&key, &value, 0)?))
    };
    keys.items()?.iter().map(assignment).collect()
}

/// A key as it stands in a path, with quotes where it needs them.
fn quoted(key: &str) -> String {
    let is_bare = key.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    if is_bare { key.to_owned() } else { format!("\"{key}\"") }
}

/// A text as TOML writes it, which has the escapes of JSON and one more: that of DEL.
fn text(words: String) -> String {
    serde_json::Value::from(words).to_string().replace('\u{7f}', "\\u007F")
}

/// A value as TOML writes it; arrays and numbers of numpy are lists and numbers.
fn toml(key: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<String> {
    if depth > MAX_DEPTH {
        return Err(PyValueError::new_err(format!("{key}: values are nested more than {MAX_DEPTH} deep")));
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(value.extract::<bool>()?.to_string());
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.str()?.to_string());
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(format!("{:?}", value.extract::<f64>()?).to_lowercase());
    }
    if value.is_instance_of::<PyString>() {
        return Ok(text(value.extract::<String>()?));
    }
    if let Ok(table) = value.cast::<PyDict>() {
        let entries = table.iter().map(|(name, value)| {
            let name: String =
                name.extract().map_err(|_| PyTypeError::new_err(format!("{key}: keys are texts")))?;
            Ok(format!("{}={}", text(name), toml(key, &value, depth + 1)?))
        });
        return Ok(format!("{{{}}}", entries.collect::<PyResult<Vec<_>>>()?.join(",")));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?.map(|item| toml(key, &item?, depth + 1));
        return Ok(format!("[{}]", items.collect::<PyResult<Vec<_>>>()?.join(",")));
    }
    if let Ok(plain) = value.call_method0("tolist") {
        return toml(key, &plain, depth + 1);
    }
    if let Ok(path) = value.call_method0("__fspath__") {
        return toml(key, &path, depth + 1);
    }
    let found = value.get_type().name()?;
    let message = format!("{key}: a {found} is no value of a scene; give numbers, texts, lists or dicts");
    Err(PyTypeError::new_err(message))
}
