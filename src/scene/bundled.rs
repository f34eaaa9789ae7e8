//! The scenes and swarms that the binary carries: `launch-configs/scenes/*.toml` and `launch-configs/swarms/*.toml`.

use super::swarm::Swarm;
use super::{Scene, SceneError};

/// A scene or a swarm in the binary.
#[derive(Clone, Copy, Debug)]
pub struct Bundled {
    /// The name by which commands find it.
    pub name: &'static str,
    /// The file as it was written.
    pub text: &'static str,
}

macro_rules! files {
    ($folder:literal: $($name:literal),* $(,)?) => {
        &[$(Bundled { name: $name, text: include_str!(concat!("../../launch-configs/", $folder, "/", $name, ".toml")) }),*]
    };
}

/// Every bundled scene, in the order in which `flockform list scenes` lists them.
pub const SCENES: &[Bundled] = files! { "scenes":
    "tension", "tension-immediate", "feedback-grow", "feedback-oscillate", "feedback-overrelax",
    "poisson-term", "distance-weights", "geometric-mean", "power-mean", "shear", "second-gradient",
    "gradient-layer", "fracture", "fracture-slow", "fracture-hexagonal", "notched-plate", "drop", "grips",
    "lattice-square", "lattice-rectangular", "lattice-centred-rectangular", "lattice-hexagonal",
    "lattice-oblique", "lattice-honeycomb", "bar", "cook", "plate-hole", "inclusion", "ring", "l-bracket",
    "rubber-block", "elastica", "beam", "beam-5", "beam-10", "beam-loaded", "beam-second", "beam-hexagonal",
    "beam-paper", "beam-paper-5", "beam-paper-10", "beam-paper-ring", "beam-paper-second",
    "beam-paper-reduced", "beam-paper-hexagonal", "beam-paper-hexagonal-reduced",
};

/// Every bundled swarm, in the order in which `flockform list swarms` lists them.
pub const SWARMS: &[Bundled] =
    files! { "swarms": "square", "gap", "patch", "antipodal", "faulty-robot", "bridge" };

/// The bundled swarm of this name.
pub fn bundled_swarm(name: &str) -> Option<Bundled> {
    SWARMS.iter().copied().find(|swarm| swarm.name == name)
}

/// The bundled scene of this name.
pub fn bundled(name: &str) -> Option<Bundled> {
    SCENES.iter().copied().find(|scene| scene.name == name)
}

impl Bundled {
    /// Reads the swarm; `overrides` are `KEY.PATH=VALUE` texts applied on top.
    ///
    /// # Errors
    /// Overrides that make the swarm invalid.
    pub fn load_swarm(&self, overrides: &[String]) -> Result<Swarm, SceneError> {
        Swarm::parse(self.name, &format!("{}.toml (bundled)", self.name), self.text, overrides, None)
    }

    /// Reads the scene; `overrides` are `KEY.PATH=VALUE` texts applied on top.
    pub fn load(&self, overrides: &[String]) -> Result<Scene, SceneError> {
        Scene::parse(self.name, &format!("{}.toml (bundled)", self.name), self.text, overrides, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of the files in a folder of `launch-configs`.
    fn files(folder: &str) -> Vec<String> {
        let folder = format!("{}/launch-configs/{folder}", env!("CARGO_MANIFEST_DIR"));
        let name = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.expect("readable").path().file_stem().expect("named").to_string_lossy().into_owned()
        };
        let entries = std::fs::read_dir(folder).expect("the folder is part of the checkout");
        let mut files: Vec<String> = entries.map(name).collect();
        files.sort();
        files
    }

    fn names(all: &[Bundled]) -> Vec<&str> {
        let mut names: Vec<&str> = all.iter().map(|one| one.name).collect();
        names.sort_unstable();
        names
    }

    #[test]
    fn every_scene_file_is_bundled_and_loads() {
        assert_eq!(files("scenes"), names(SCENES));
        for scene in SCENES {
            let loaded = scene.load(&[]).unwrap_or_else(|error| panic!("{error}"));
            assert!(!loaded.raw.title.is_empty(), "{} has a title", scene.name);
        }
    }

    #[test]
    fn every_swarm_file_is_bundled_and_loads() {
        assert_eq!(files("swarms"), names(SWARMS));
        for swarm in SWARMS {
            let loaded = swarm.load_swarm(&[]).unwrap_or_else(|error| panic!("{error}"));
            assert!(!loaded.raw.title.is_empty(), "{} has a title", swarm.name);
        }
    }
}
