//! `flockform install`: this program and its files where ROS 2 tools look for a package.

use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use flockform::continuum::digest::fnv1a;
use flockform::export::shell::quoted;
use flockform::scene::bundled::SWARMS;

use super::{Refusal, interrupt, print};

#[derive(Debug, Args)]
pub struct InstallArguments {
    /// Folder to install into: a new one, or the install folder of a workspace
    #[arg(long, value_name = "DIR")]
    prefix: PathBuf,
    /// Replace files of other origin, and files changed since they were installed
    #[arg(long)]
    force: bool,
}

/// Error installing the package.
#[derive(Debug, thiserror::Error)]
pub enum InstallError {
    #[error(
        "{} {} not flockform's, or changed since flockform installed it\n  help: choose another --prefix, move it away, or replace it with --force",
        list(paths), if paths.len() == 1 { "is" } else { "are each" }
    )]
    Foreign { paths: Vec<PathBuf> },
    #[error("cannot install {}: {error}\n  help: choose a --prefix that you can write to", path.display())]
    Write { path: PathBuf, error: io::Error },
    #[error("cannot read this program to copy it: {0}")]
    OwnProgram(io::Error),
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

macro_rules! embedded {
    ($($place:literal from $file:literal),+ $(,)?) => {
        &[$(($place, include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/", $file)))),+]
    };
}

/// The files of `share/flockform`, beside the swarms.
const SHARED: &[(&str, &str)] = embedded![
    "package.xml" from "package.xml",
    "launch/formation_launch.xml" from "launch-configs/formation_launch.xml",
    "launch/formation_launch.py" from "launch-configs/formation_launch.py",
    "launch/node_launch.xml" from "launch-configs/node_launch.xml",
    "launch/demo_launch.xml" from "launch-configs/demo_launch.xml",
    "views/formation.rviz" from "launch-configs/views/formation.rviz",
    "views/formation.foxglove.json" from "launch-configs/views/formation.foxglove.json",
    "parameters/formation.yaml" from "launch-configs/parameters/formation.yaml",
    "msgs/flockform_msgs/package.xml" from "msgs/flockform_msgs/package.xml",
    "msgs/flockform_msgs/CMakeLists.txt" from "msgs/flockform_msgs/CMakeLists.txt",
    "msgs/flockform_msgs/msg/FormationState.msg" from "msgs/flockform_msgs/msg/FormationState.msg",
    "msgs/flockform_msgs/msg/LoopEvent.msg" from "msgs/flockform_msgs/msg/LoopEvent.msg",
    "msgs/flockform_msgs/msg/MemberState.msg" from "msgs/flockform_msgs/msg/MemberState.msg",
    "msgs/flockform_msgs/msg/Ranges.msg" from "msgs/flockform_msgs/msg/Ranges.msg",
    "msgs/flockform_msgs/srv/SetFormation.srv" from "msgs/flockform_msgs/srv/SetFormation.srv",
];

/// Files that a shell sources; those a workspace already has are kept.
const ENVIRONMENT: &[(&str, &str)] = embedded![
    "setup.bash" from "launch-configs/environment/setup.bash",
    "local_setup.bash" from "launch-configs/environment/setup.bash",
    "setup.zsh" from "launch-configs/environment/setup.zsh",
    "local_setup.zsh" from "launch-configs/environment/setup.zsh",
];

const SHARE: &str = "share/flockform";
const LIBRARY: &str = "lib/flockform";
const EXECUTABLE: &str = "lib/flockform/flockform";
/// The ament index knows a package by an empty file of its name.
const INDEX_MARKER: &str = "share/ament_index/resource_index/packages/flockform";
/// Checksum and path of each file that was installed.
const MANIFEST: &str = "share/flockform/installed-files";

/// A file to install; its path is below the prefix.
struct Installed {
    path: PathBuf,
    bytes: Vec<u8>,
    executable: bool,
}

/// Installs everything or nothing: files are written beside their places first, then moved there.
pub fn install(arguments: &InstallArguments) -> Result<ExitCode, Refusal> {
    let prefix = &std::path::absolute(&arguments.prefix)
        .map_err(|error| InstallError::Write { path: arguments.prefix.clone(), error })?;
    let earlier = Manifest::read(prefix);
    let mut files = package_files()?;
    files.extend(environment_files().filter(|file| earlier.allows(prefix, file)));
    let foreign: Vec<PathBuf> = files
        .iter()
        .filter(|file| !arguments.force && !earlier.allows(prefix, file))
        .map(|file| prefix.join(&file.path))
        .collect();
    if !foreign.is_empty() {
        return Err(InstallError::Foreign { paths: foreign }.into());
    }
    files.push(Manifest::of(&files).into_file());
    let staged = files.iter().map(|file| Staged::write(prefix, file)).collect::<Result<Vec<_>, _>>()?;
    let _saving = interrupt::saving();
    staged.into_iter().try_for_each(Staged::move_into_place)?;
    earlier.remove_what_is_gone(prefix, &files);
    print(&format!(
        "Installed into {prefix}. Then, where ROS 2 is set up:\n  source {setup}\n  \
         ros2 launch flockform formation_launch.xml\n",
        prefix = prefix.display(),
        setup = quoted(&prefix.join("setup.bash").to_string_lossy())
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn package_files() -> Result<Vec<Installed>, InstallError> {
    let program = std::env::current_exe().and_then(fs::read).map_err(InstallError::OwnProgram)?;
    let mut files = vec![
        Installed { path: EXECUTABLE.into(), bytes: program, executable: true },
        text_file(INDEX_MARKER.into(), ""),
    ];
    let share = Path::new(SHARE);
    files.extend(SHARED.iter().map(|(place, text)| text_file(share.join(place), text)));
    let swarms = share.join("swarms");
    files.extend(
        SWARMS.iter().map(|swarm| text_file(swarms.join(format!("{}.toml", swarm.name)), swarm.text)),
    );
    Ok(files)
}

fn environment_files() -> impl Iterator<Item = Installed> {
    ENVIRONMENT.iter().map(|(place, text)| text_file(place.into(), text))
}

fn text_file(path: PathBuf, text: &str) -> Installed {
    Installed { path, bytes: text.into(), executable: false }
}

/// The files of an earlier install, by path below the prefix.
struct Manifest(Vec<(u64, PathBuf)>);

impl Manifest {
    /// Of what is installed; empty where nothing is.
    fn read(prefix: &Path) -> Self {
        let text = fs::read_to_string(prefix.join(MANIFEST)).unwrap_or_default();
        let entry = |line: &str| {
            let (sum, path) = line.split_once(' ')?;
            Some((u64::from_str_radix(sum, 16).ok()?, PathBuf::from(path)))
        };
        Self(text.lines().filter_map(entry).collect())
    }

    fn of(files: &[Installed]) -> Self {
        Self(files.iter().map(|file| (fnv1a(&file.bytes), file.path.clone())).collect())
    }

    fn into_file(self) -> Installed {
        let line = |(sum, path): &(u64, PathBuf)| format!("{sum:016x} {}\n", path.display());
        text_file(MANIFEST.into(), &self.0.iter().map(line).collect::<String>())
    }

    /// Whether the file's place is free, or holds what was installed there or is to be.
    fn allows(&self, prefix: &Path, file: &Installed) -> bool {
        let place = prefix.join(&file.path);
        match fs::read(&place) {
            Ok(bytes) => bytes == file.bytes || self.has(&file.path, &bytes),
            Err(_) => fs::symlink_metadata(&place).is_err(),
        }
    }

    fn has(&self, path: &Path, bytes: &[u8]) -> bool {
        let sum = fnv1a(bytes);
        self.0.iter().any(|(installed, at)| *installed == sum && at == path)
    }

    /// Removes files of an earlier install that are in this one no more, unless they were changed.
    fn remove_what_is_gone(&self, prefix: &Path, files: &[Installed]) {
        for (_, path) in &self.0 {
            let place = prefix.join(path);
            let is_gone = is_own_place(prefix, path) && !files.iter().any(|file| file.path == *path);
            if is_gone && fs::read(&place).is_ok_and(|bytes| self.has(path, &bytes)) {
                // A file left over does no harm.
                let _ = fs::remove_file(place);
            }
        }
    }
}

/// Whether a path of a list leads to one of the package's own folders. A forged list must not reach beyond them, with
/// `..` or through a symbolic link.
fn is_own_place(prefix: &Path, path: &Path) -> bool {
    let is_plain = path.components().all(|part| matches!(part, Component::Normal(_)));
    let is_below = |folder| path.starts_with(folder) && path != Path::new(folder);
    let parents = path.ancestors().skip(1).take_while(|above| !above.as_os_str().is_empty());
    is_plain
        && [SHARE, LIBRARY].into_iter().any(is_below)
        && parents.into_iter().all(|above| !prefix.join(above).is_symlink())
}

/// A file written beside its place; removed again unless it is moved there.
struct Staged {
    beside: PathBuf,
    place: PathBuf,
}

impl Staged {
    fn write(prefix: &Path, file: &Installed) -> Result<Self, InstallError> {
        let place = prefix.join(&file.path);
        let name = place.file_name().unwrap_or_default().to_string_lossy();
        let beside = place.with_file_name(format!(".{name}.partial-{}", std::process::id()));
        let staged = Self { beside, place };
        staged.fill(file).map_err(|error| staged.refusal(error))?;
        Ok(staged)
    }

    fn fill(&self, file: &Installed) -> io::Result<()> {
        if let Some(folder) = self.place.parent() {
            fs::create_dir_all(folder)?;
        }
        // A killed install may have had this number; what else has the name, a link above all, is not written through.
        let _ = fs::remove_file(&self.beside);
        interrupt::removes([self.beside.clone()]);
        File::create_new(&self.beside)?.write_all(&file.bytes)?;
        let mode = if file.executable { 0o755 } else { 0o644 };
        fs::set_permissions(&self.beside, fs::Permissions::from_mode(mode))
    }

    fn move_into_place(self) -> Result<(), InstallError> {
        fs::rename(&self.beside, &self.place).map_err(|error| self.refusal(error))
    }

    fn refusal(&self, error: io::Error) -> InstallError {
        InstallError::Write { path: self.place.clone(), error }
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // Fails where the file was moved, which is what it is for.
        let _ = fs::remove_file(&self.beside);
    }
}
