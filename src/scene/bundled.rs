//! The scenes that the binary carries: `launch-configs/scenes/*.toml`.

use super::{Scene, SceneError};

/// A scene in the binary.
#[derive(Clone, Copy, Debug)]
pub struct Bundled {
    pub name: &'static str,
    pub text: &'static str,
}

macro_rules! scenes {
    ($($name:literal),* $(,)?) => {
        &[$(Bundled { name: $name, text: include_str!(concat!("../../launch-configs/scenes/", $name, ".toml")) }),*]
    };
}

/// Every bundled scene, in the order in which `flockform scenes` lists them.
pub const SCENES: &[Bundled] = scenes![
    "tension",
    "tension-immediate",
    "feedback-grow",
    "feedback-oscillate",
    "feedback-overrelax",
    "shear",
    "second-gradient",
    "gradient-layer",
    "fracture",
    "fracture-slow",
    "fracture-hexagonal",
    "notched-plate",
    "drop",
    "grips",
    "lattice-square",
    "lattice-rectangular",
    "lattice-centred-rectangular",
    "lattice-hexagonal",
    "lattice-oblique",
    "lattice-honeycomb",
    "beam",
    "beam-5",
    "beam-10",
    "beam-loaded",
    "beam-second",
    "beam-hexagonal",
    "beam-paper",
    "beam-paper-5",
    "beam-paper-10",
    "beam-paper-ring",
    "beam-paper-second",
    "beam-paper-reduced",
    "beam-paper-hexagonal",
    "beam-paper-hexagonal-reduced",
];

/// The bundled scene of this name.
pub fn bundled(name: &str) -> Option<Bundled> {
    SCENES.iter().copied().find(|scene| scene.name == name)
}

impl Bundled {
    /// Reads the scene; `overrides` are `KEY.PATH=VALUE` texts applied on top.
    pub fn load(&self, overrides: &[String]) -> Result<Scene, SceneError> {
        Scene::parse(self.name, &format!("{}.toml (bundled)", self.name), self.text, overrides, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_file_is_bundled_and_loads() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/launch-configs/scenes");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .expect("the folder is part of the checkout")
            .map(|entry| {
                entry.expect("readable").path().file_stem().expect("named").to_string_lossy().into_owned()
            })
            .collect();
        files.sort();
        let mut names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
        names.sort_unstable();
        assert_eq!(files, names);
        for scene in SCENES {
            let loaded = scene.load(&[]).unwrap_or_else(|error| panic!("{error}"));
            assert!(!loaded.raw.title.is_empty(), "{} has a title", scene.name);
        }
    }
}
