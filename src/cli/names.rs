//! Scene and swarm files, by the name of a bundled one or by path.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Args, ValueEnum};
use flockform::continuum::memory::at_least;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::text::{is_path, nearest, renamed};
use flockform::scene::{self, Bundled, Scene, SceneError, bundled};

use super::{Refusal, memory};

/// The kinds of file that the program reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// A body
    Scene,
    /// A formation of robots
    Swarm,
}

impl Kind {
    pub const ALL: [Kind; 2] = [Kind::Scene, Kind::Swarm];

    pub fn name(self) -> &'static str {
        match self {
            Kind::Scene => "scene",
            Kind::Swarm => "swarm",
        }
    }

    /// The command that runs such a file.
    pub fn command(self) -> &'static str {
        match self {
            Kind::Scene => "run",
            Kind::Swarm => "swarm",
        }
    }

    pub fn bundled(self) -> &'static [Bundled] {
        match self {
            Kind::Scene => bundled::SCENES,
            Kind::Swarm => bundled::SWARMS,
        }
    }

    /// Title and notes of a bundled file of this kind.
    pub fn described(self, one: &Bundled) -> Result<[String; 2], SceneError> {
        match self {
            Kind::Scene => one.load(&[]).map(|scene| [scene.raw.title, scene.raw.notes]),
            Kind::Swarm => one.load_swarm(&[]).map(|swarm| [swarm.raw.title, swarm.raw.notes]),
        }
    }

    /// Number of the keys that a file of this kind has at its top level.
    fn keys_of(self, file: &toml::Table) -> usize {
        let schema = match self {
            Kind::Scene => scene::validate::schema(),
            Kind::Swarm => scene::swarm::schema(),
        };
        file.keys().filter(|key| schema["properties"].get(key.as_str()).is_some()).count()
    }

    /// The kind of the bundled file of this name, or of the file at this path; by its keys, unless it has as many of
    /// both kinds. A pipe, which can be read only once, has none.
    pub fn of(word: &str) -> Option<Self> {
        let is_bundled = |kind: &Kind| kind.bundled().iter().any(|one| one.name == word);
        if let Some(kind) = Kind::ALL.into_iter().find(is_bundled) {
            return Some(kind);
        }
        std::fs::metadata(word).ok().filter(std::fs::Metadata::is_file)?;
        let file: toml::Table = std::fs::read_to_string(word).ok()?.parse().ok()?;
        let [scene, swarm] = Kind::ALL.map(|kind| kind.keys_of(&file));
        match scene.cmp(&swarm) {
            std::cmp::Ordering::Greater => Some(Kind::Scene),
            std::cmp::Ordering::Less => Some(Kind::Swarm),
            std::cmp::Ordering::Equal => None,
        }
    }

    /// The kind of what a command takes of either kind; a file of neither is taken for a scene.
    ///
    /// # Errors
    /// A word that is neither a path nor a bundled name.
    pub fn of_either(word: &str) -> Result<Self, Refusal> {
        match Kind::of(word) {
            None if !is_path(word) => Err(not_found(&Kind::ALL, word)),
            kind => Ok(kind.unwrap_or(Kind::Scene)),
        }
    }

    /// The error that names the kind of a file that is of the other one.
    pub fn refuse_other(self, word: &str) -> Option<Refusal> {
        let other = Kind::of(word).filter(|&kind| kind != self)?;
        Some(Refusal::OtherKind { name: from_here(word), kind: other.name(), command: other.command() })
    }

    /// A word as a path; one that is no file is taken for a misspelt name of a bundled file.
    ///
    /// # Errors
    /// A bundled file of the other kind, or neither file nor name.
    pub fn path(self, word: &str) -> Result<PathBuf, Refusal> {
        if is_path(word) {
            return Ok(PathBuf::from(word));
        }
        Err(self.refuse_other(word).unwrap_or_else(|| not_found(&[self], word)))
    }
}

/// The folder of a file, in which the files that it names are looked up; none of a bundled one.
pub fn folder_of(word: &str) -> Option<PathBuf> {
    let is_bundled = bundled(word).is_some() || bundled_swarm(word).is_some();
    Path::new(word).parent().filter(|_| !is_bundled).map(Path::to_owned)
}

/// The same, wherever the program stands.
pub fn folder_in_full(word: &str) -> Option<PathBuf> {
    std::path::absolute(folder_of(word)?.join(".")).ok()
}

/// The error for a word that is neither a file nor the name of a bundled one of these kinds.
fn not_found(kinds: &[Kind], word: &str) -> Refusal {
    refusal_of(kinds, word, true)
}

/// The error of a command that takes names of bundled files alone, of these kinds.
pub fn not_bundled(kinds: &[Kind], word: &str) -> Refusal {
    refusal_of(kinds, word, false)
}

fn refusal_of(kinds: &[Kind], word: &str, takes_files: bool) -> Refusal {
    let named = |kind: Kind| kind.bundled().iter().map(|one| one.name).collect::<Vec<_>>();
    let all: Vec<&str> = kinds.iter().flat_map(|&kind| named(kind)).collect();
    let nearest = renamed(word, &all).or_else(|| nearest(word, &all));
    let kind = |name: &str| kinds.iter().find(|kind| named(**kind).contains(&name));
    let nearest = nearest.and_then(|name| Some((kind(name)?.name(), name)));
    let nearest =
        nearest.map_or_else(String::new, |(kind, name)| format!("the nearest bundled {kind} is `{name}`; "));
    let lists: Vec<_> = kinds.iter().map(|kind| format!("`flockform list {}s`", kind.name())).collect();
    let (kinds, lists) = (kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>(), lists.join(" and "));
    let kinds = kinds.join(" or ");
    let fault = match takes_files {
        true => format!("there is no {kinds} file and no bundled {kinds} `{word}`"),
        false => format!("there is no bundled {kinds} `{word}`, and no file is taken here"),
    };
    Refusal::NotBundled(format!("{fault}\n  help: {nearest}see {lists} for all of them"))
}

/// A word on the command line that names a bundled file or is a path; shells complete the names.
#[derive(Clone, Debug)]
pub struct FileName(&'static [Kind]);

impl FileName {
    pub const SCENE: Self = Self(&[Kind::Scene]);
    pub const SWARM: Self = Self(&[Kind::Swarm]);
    pub const ANY: Self = Self(&Kind::ALL);
}

impl TypedValueParser for FileName {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        let refuse = |fault: &str| {
            let message = format!("{:?} {fault}\n  help: rename the file", value.to_string_lossy());
            command.clone().error(clap::error::ErrorKind::ValueValidation, message)
        };
        if value.to_str().is_none() {
            return Err(refuse("is not UTF-8"));
        }
        let word = StringValueParser::new().parse_ref(command, argument, value)?;
        // Messages repeat it, and a file from elsewhere may be named to forge some.
        match word.contains(char::is_control) {
            true => Err(refuse("has control characters in it")),
            false => Ok(word),
        }
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = self.0.iter().flat_map(|kind| kind.bundled()).map(|one| one.name);
        Some(Box::new(names.map(PossibleValue::new)))
    }
}

/// Changes to a scene or swarm file; where that may be left out, the command requires it for them.
#[derive(Clone, Debug, Args)]
pub struct Overrides {
    /// Override a key, validated like the file: `lattice.spacing=0.5`, `roles[1].from=30`
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    pub set: Vec<String>,
}

/// A scene and the changes to it.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// Name of a bundled scene (see `flockform list scenes`) or path of a scene file
    #[arg(value_parser = FileName::SCENE, hide_possible_values = true)]
    pub scene: String,
    #[command(flatten)]
    pub overrides: Overrides,
}

impl SceneArguments {
    pub fn new(scene: &str, set: &[String]) -> Self {
        Self { scene: scene.to_owned(), overrides: Overrides { set: set.to_vec() } }
    }

    pub fn load(&self) -> Result<Scene, Refusal> {
        self.load_part(|_| 1)
    }

    /// The same for a process that has one of so many parts of the body.
    pub fn load_part(&self, parts: impl Fn(&Scene) -> usize) -> Result<Scene, Refusal> {
        if bundled(&self.scene).is_none() {
            Kind::Scene.path(&self.scene)?;
        }
        let refuse = |error: SceneError| Kind::Scene.refuse_other(&self.scene).unwrap_or(error.into());
        let scene = self.load_scene(&[]).map_err(refuse)?;
        memory::require(&scene, at_least(&scene) / parts(&scene) as f64)?;
        Ok(scene)
    }

    /// The scene with these overrides after the user's own.
    pub fn load_scene(&self, more: &[String]) -> Result<Scene, SceneError> {
        let overrides = [&self.overrides.set, more].concat();
        match bundled(&self.scene) {
            Some(bundled) => bundled.load(&overrides),
            None => Scene::from_file(Path::new(&self.scene), &overrides),
        }
    }
}

/// The text of a bundled file and its kind.
///
/// # Errors
/// A name that no bundled file has.
pub fn bundled_file(name: &str) -> Result<(Kind, Bundled), Refusal> {
    let scene = bundled(name).map(|one| (Kind::Scene, one));
    let found = scene.or_else(|| bundled_swarm(name).map(|one| (Kind::Swarm, one)));
    found.ok_or_else(|| not_bundled(&Kind::ALL, name))
}

/// A name as it is, or a path as seen from the working folder.
fn from_here(word: &str) -> String {
    let here = std::env::current_dir().ok();
    let below = here.and_then(|here| Some(Path::new(word).strip_prefix(here).ok()?.display().to_string()));
    below.unwrap_or_else(|| word.to_owned())
}

/// A scene's name as it is, or its path in full, for a command that is gone on with from another folder. A path through a
/// folder whose name is no text stays as it is given, and leads there from this folder alone.
pub fn in_full(scene: &str) -> String {
    let place = Path::new(scene);
    let is_path = bundled(scene).is_none() && place.exists();
    let path = std::path::absolute(place).ok().filter(|_| is_path);
    path.and_then(|path| path.into_os_string().into_string().ok()).unwrap_or_else(|| scene.to_owned())
}
