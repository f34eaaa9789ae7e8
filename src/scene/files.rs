//! Files that a scene or a swarm names, which are looked up in the folder of its own file: saved in another folder, it
//! names them as they are found from there.

use std::path::{Component, Path, PathBuf};

use super::bundled;
use super::raw::{RawMotion, RawScene, RawShape};
use super::swarm::raw::{RawProgram, RawSwarm};

impl RawScene {
    /// Names the files that are looked up in the folder `from` as they are found from the folder `to`.
    pub(crate) fn name_files_from(&mut self, from: Option<&Path>, to: &Path) {
        name_from(from, to, self.files_mut());
    }

    /// The files that it names, as they are found from where the program stands, when they are looked up in `folder`.
    pub fn files(&self, folder: Option<&Path>) -> Vec<PathBuf> {
        let folder = folder.unwrap_or(Path::new(""));
        self.clone().files_mut().map(|file| folder.join(file)).collect()
    }

    fn files_mut(&mut self) -> impl Iterator<Item = &mut String> {
        let motions = self.roles.iter_mut().filter_map(|entry| match &mut entry.motion {
            Some(RawMotion::Csv { file, .. }) => Some(file),
            _ => None,
        });
        motions.chain(file_of(&mut self.body.shape))
    }
}

impl RawSwarm {
    /// Names the files that are looked up in the folder `from` as they are found from the folder `to`.
    pub(crate) fn name_files_from(&mut self, from: Option<&Path>, to: &Path) {
        let programs = self.leaders.iter_mut().filter_map(|entry| match &mut entry.program {
            RawProgram::File { path, .. } => Some(path),
            _ => None,
        });
        let of_scene = self.scene.iter_mut().flat_map(|scene| {
            let file = Some(&mut scene.name).filter(|name| bundled(name).is_none());
            file.into_iter().chain(&mut scene.recording)
        });
        let shape = self.body.iter_mut().filter_map(|body| file_of(&mut body.shape));
        name_from(from, to, programs.chain(of_scene).chain(shape));
    }
}

fn file_of(shape: &mut RawShape) -> Option<&mut String> {
    match shape {
        RawShape::Points { file, .. } => Some(file),
        _ => None,
    }
}

fn name_from<'a>(from: Option<&Path>, to: &Path, files: impl Iterator<Item = &'a mut String>) {
    let way = way(to, from.unwrap_or(Path::new("")));
    // An absolute name stays what it is.
    files.for_each(|file| *file = way.join(&*file).to_string_lossy().into_owned());
}

/// The way from one folder to another: relative where both are on one drive.
fn way(from: &Path, to: &Path) -> PathBuf {
    let resolved = |folder: &Path| {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        folder.canonicalize().or_else(|_| std::path::absolute(folder)).unwrap_or(folder.to_path_buf())
    };
    let (from, to) = (resolved(from), resolved(to));
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return to;
    }
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(to.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_between_folders_goes_up_as_far_as_they_differ() {
        for (from, to, expected) in [
            ("/a/b", "/a/b", ""),
            ("/a/b/out", "/a/b", ".."),
            ("/a", "/a/b", "b"),
            ("/a/c/d", "/a/b", "../../b"),
        ] {
            let found = way(Path::new(&format!("/no{from}")), Path::new(&format!("/no{to}")));
            assert_eq!(found, Path::new(expected), "{from} {to}");
        }
    }
}
