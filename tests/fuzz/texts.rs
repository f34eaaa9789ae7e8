//! TOML of scenes and swarms, and YAML of parameters.

use flockform::ros::arguments::RosArguments;
use flockform::scene::bundled::{SCENES, SWARMS};
use flockform::scene::swarm::Swarm;
use flockform::scene::{Bundled, Scene};
use flockform::swarm::control::Control;
use proptest::prelude::*;

use super::*;
use crate::folders::temporary;

/// One of these, damaged.
fn one_of(all: &'static [Bundled]) -> impl Strategy<Value = (usize, Vec<Damage>)> {
    (0..all.len(), damage())
}

#[test]
fn a_damaged_scene_is_read_or_refused_in_words() {
    let folder = temporary();
    let path = folder.path().join("scene.toml");
    fuzz(&one_of(SCENES), |(which, damage)| {
        std::fs::write(&path, damaged(SCENES[which].text.as_bytes(), &damage)).expect("writable");
        if let Err(error) = Scene::from_file(&path, &[]) {
            assert!(error.to_string().len() > 10, "{error}");
        }
    });
}

#[test]
fn a_damaged_swarm_is_set_up_or_refused() {
    let folder = temporary();
    let path = folder.path().join("swarm.toml");
    fuzz(&one_of(SWARMS), |(which, damage)| {
        std::fs::write(&path, damaged(SWARMS[which].text.as_bytes(), &damage)).expect("writable");
        if let Ok(swarm) = Swarm::from_file(&path, &[]) {
            let _ = Control::new(&swarm);
        }
    });
}

const PARAMETERS: &str = include_str!("../../launch-configs/parameters/formation.yaml");

#[test]
fn a_damaged_parameter_file_is_read_or_refused() {
    let folder = temporary();
    let path = folder.path().join("parameters.yaml");
    fuzz(&damage(), |damage| {
        std::fs::write(&path, damaged(PARAMETERS.as_bytes(), &damage)).expect("writable");
        let arguments = ["--ros-args", "--params-file", &path.display().to_string()].map(str::to_owned);
        if let Ok((_, ros)) = RosArguments::parse(arguments, &|_| None) {
            let _ = ros.parameters_for("/flockform");
        }
    });
}
