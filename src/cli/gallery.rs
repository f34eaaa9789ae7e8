//! `flockform gallery`: every bundled scene and swarm, and one page that leads to their reports.

use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use flockform::export::report::gallery::{Exhibit, write_gallery};
use flockform::export::report::page;
use flockform::scene::{Bundled, SceneError, bundled};

use super::names::{FileName, Kind, not_bundled};
use super::output::OutputArguments;
use super::{FAILED, Refusal, interrupt, say};

#[derive(Debug, Args)]
pub struct GalleryArguments {
    /// Bundled scenes and swarms to run [default: all]
    #[arg(value_name = "NAME", value_parser = FileName::ANY, hide_possible_values = true)]
    names: Vec<String>,
    #[command(flatten)]
    output: OutputArguments,
}

/// How often a run is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// Runs the bundled scenes and swarms, each in a process of its own, and writes the page.
pub fn gallery(arguments: &GalleryArguments) -> Result<ExitCode, Refusal> {
    let exhibits = exhibits(&arguments.names)?;
    let folder = arguments.output.folder("gallery")?;
    let interrupted = interrupt::keeps();
    for (n, exhibit) in exhibits.iter().enumerate() {
        if !arguments.output.quiet {
            note!("{:>3} of {}  {}", n + 1, exhibits.len(), exhibit.name);
        }
        run(exhibit, folder.path(exhibit.folder()), interrupted)?;
        if interrupted.load(Ordering::Relaxed) {
            interrupt::print_last_words();
            return Ok(ExitCode::from(FAILED));
        }
    }
    write_gallery(&folder, &exhibits)?;
    let kept = interrupt::commit(folder)?;
    if !arguments.output.quiet {
        say(&format!("open {}\n", kept.join("index.html").display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Those named, or all, in the order in which they are listed.
fn exhibits(names: &[String]) -> Result<Vec<Exhibit>, Refusal> {
    let all = || bundled::SCENES.iter().chain(bundled::SWARMS);
    if let Some(name) = names.iter().find(|name| !all().any(|one| one.name == **name)) {
        return Err(not_bundled(&Kind::ALL, name));
    }
    let is_asked = |one: &&Bundled| names.is_empty() || names.iter().any(|name| name == one.name);
    let exhibits =
        [(Kind::Scene, "scenes"), (Kind::Swarm, "swarms")].into_iter().flat_map(|(kind, folder)| {
            kind.bundled().iter().filter(is_asked).map(move |one| -> Result<Exhibit, SceneError> {
                let [title, notes] = kind.described(one)?;
                Ok(Exhibit::new(folder, one.name, &title, &notes))
            })
        });
    Ok(exhibits.collect::<Result<_, _>>()?)
}

/// A run that fails by design (a body that grows without bound) has a report too; one without is no exhibit.
fn run(exhibit: &Exhibit, out: PathBuf, interrupted: &AtomicBool) -> Result<(), Refusal> {
    let failed = |reason: String| Refusal::Exhibit { name: exhibit.name.clone(), reason };
    let command = if exhibit.kind == "scenes" { "run" } else { "swarm" };
    let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
    let mut child = Command::new(program);
    child.args([command, &exhibit.name, "--quiet", "--out"]).arg(&out).stderr(Stdio::piped());
    let mut child = child.spawn().map_err(|error| failed(error.to_string()))?;
    while child.try_wait().is_ok_and(|status| status.is_none()) {
        if interrupted.load(Ordering::Relaxed) {
            // Its folder goes with the gallery's.
            let _ = child.kill().and_then(|()| child.wait());
            return Ok(());
        }
        std::thread::sleep(LOOK);
    }
    let output = child.wait_with_output().map_err(|error| failed(error.to_string()))?;
    if out.join(page::FILE).is_file() {
        return Ok(());
    }
    Err(failed(String::from_utf8_lossy(&output.stderr).trim().to_owned()))
}
