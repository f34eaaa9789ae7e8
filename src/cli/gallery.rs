//! `flockform gallery`: every bundled scene and swarm, and one page that leads to their reports.

use std::path::PathBuf;
use std::process::{Command, ExitCode};
use std::sync::atomic::Ordering;

use clap::Args;
use flockform::export::report::gallery::{Exhibit, write_gallery};
use flockform::export::report::page;
use flockform::scene::{Bundled, SceneError, bundled};

use super::output::OutputArguments;
use super::run::interrupt_flag;
use super::{FAILED, Refusal, print};

#[derive(Debug, Args)]
pub struct GalleryArguments {
    /// Bundled scenes and swarms to run [default: all]
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Runs the bundled scenes and swarms, each in a process of its own, and writes the page.
pub fn gallery(arguments: &GalleryArguments) -> Result<ExitCode, Refusal> {
    let exhibits = exhibits(&arguments.names)?;
    let folder = arguments.output.folder("gallery")?;
    let interrupted = interrupt_flag();
    for (n, exhibit) in exhibits.iter().enumerate() {
        if !arguments.output.quiet {
            eprintln!("{:>3} of {}  {}", n + 1, exhibits.len(), exhibit.name);
        }
        run(exhibit, folder.path(exhibit.folder()))?;
        if interrupted.load(Ordering::Relaxed) {
            return Ok(ExitCode::from(FAILED));
        }
    }
    write_gallery(&folder, &exhibits)?;
    let kept = folder.commit()?;
    if !arguments.output.quiet {
        print(&format!("open {}\n", kept.join("index.html").display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// Those named, or all, in the order in which they are listed.
fn exhibits(names: &[String]) -> Result<Vec<Exhibit>, Refusal> {
    let all = || bundled::SCENES.iter().chain(bundled::SWARMS);
    if let Some(name) = names.iter().find(|name| !all().any(|one| one.name == **name)) {
        let likeness = |other: &str| strsim::jaro_winkler(other, name);
        let nearest = all().map(|one| one.name).max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
        return Err(Refusal::NotBundled {
            what: "scene",
            name: name.clone(),
            nearest: nearest.unwrap_or_default(),
        });
    }
    let is_asked = |one: &&Bundled| names.is_empty() || names.iter().any(|name| name == one.name);
    let scene = |one: &Bundled| -> Result<Exhibit, SceneError> {
        let raw = one.load(&[])?.raw;
        Ok(Exhibit::new("scenes", one.name, &raw.title, &raw.notes))
    };
    let swarm = |one: &Bundled| -> Result<Exhibit, SceneError> {
        let raw = one.load_swarm(&[])?.raw;
        Ok(Exhibit::new("swarms", one.name, &raw.title, &raw.notes))
    };
    let scenes = bundled::SCENES.iter().filter(is_asked).map(scene);
    Ok(scenes.chain(bundled::SWARMS.iter().filter(is_asked).map(swarm)).collect::<Result<_, _>>()?)
}

/// A run that fails by design (a body that grows without bound) has a report too; one without is no exhibit.
fn run(exhibit: &Exhibit, out: PathBuf) -> Result<(), Refusal> {
    let failed = |reason: String| Refusal::Exhibit { name: exhibit.name.clone(), reason };
    let command = if exhibit.kind == "scenes" { "run" } else { "swarm" };
    let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
    let mut child = Command::new(program);
    child.args([command, &exhibit.name, "--quiet", "--out"]).arg(&out);
    let output = child.output().map_err(|error| failed(error.to_string()))?;
    if out.join(page::FILE).is_file() {
        return Ok(());
    }
    Err(failed(String::from_utf8_lossy(&output.stderr).trim().to_owned()))
}
