//! `flockform live`: a body or a swarm under the reader's hands, shown in a browser on this computer.

use std::fs::OpenOptions;
use std::io::Write;
use std::ops::ControlFlow;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use flockform::continuum::plan::Plan;
use flockform::continuum::run::run;
use flockform::live::body::Body;
use flockform::live::server::Server;
use flockform::live::session::Session;
use flockform::live::swarm::Swarm;
use flockform::record::body::BodyMessages;
use flockform::record::{About, Recording, Shared};
use flockform::scene::Scene;
use flockform::scene::swarm::Swarm as SwarmFile;
use flockform::swarm::control::Control;
use flockform::swarm::flight::{Flight, Sample};

use super::names::{FileName, Kind, Overrides, SceneArguments, folder_in_full, folder_of};
use super::recording::{self, RecordArguments};
use super::swarm::{SwarmFileArguments, fly_recorded};
use super::{Refusal, interrupt, output, print, say};

#[derive(Debug, Args)]
pub struct LiveArguments {
    /// Name of a bundled scene or swarm, or path of a file
    #[arg(value_parser = FileName::ANY, hide_possible_values = true, group = "page")]
    file: String,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    page: PageArguments,
    #[command(flatten)]
    record: RecordArguments,
    /// Folder for what is saved [default: that of the file, or the working folder for a bundled one]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// The page in a browser; the argument that asks for one is in the group `page`.
#[derive(Debug, Args)]
pub struct PageArguments {
    /// Port on this computer, from 1024: those below are the system's [default: a free one]
    #[arg(long, value_name = "PORT", value_parser = clap::value_parser!(u16).range(1024..), requires = "page")]
    port: Option<u16>,
    /// Open the page, with the program that this computer opens such files with
    #[arg(long, requires = "page")]
    open: bool,
}

/// Serves a session until it is interrupted.
pub fn live(arguments: &LiveArguments) -> Result<ExitCode, Refusal> {
    let session = arguments.session()?;
    let folder = arguments.saved_in()?;
    let (about, from) = (arguments.about(&*session), folder_of(&arguments.file));
    let server = arguments.page.server()?;
    let recording = arguments.record.open(&about, 1)?;
    let door = arguments.page.announce(&server)?;
    let command = output::own_command_line();
    let stop = interrupt::serves();
    let served = server.serve(session, command, folder, stop).map_err(|source| arguments.page.refuse(source));
    close(door);
    let session = match served {
        Ok(session) => session,
        Err(refusal) => {
            // What was done cannot be recorded any more.
            let recording = recording.and_then(|recording| recording.take());
            recording.map_or(Ok(()), Recording::discard)?;
            return Err(refusal);
        }
    };
    if let Some(recording) = recording {
        if session.frame(&[]).clock == 0.0 {
            // Its file would be run to its end, and no period of it was flown.
            let what = if session.is_body() { "no step was taken" } else { "no period was flown" };
            recording.take().map_or(Ok(()), Recording::discard)?;
            say(&format!("{what}: nothing is recorded\n"))?;
            return Ok(ExitCode::SUCCESS);
        }
        let recorded = record(&*session, &recording, from.as_deref());
        say(&recording::close(Some(recording))?)?;
        recorded?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Records what was done: the messages of a run of the file that replays it. What was undone is not in it.
fn record(session: &dyn Session, recording: &Shared, folder: Option<&Path>) -> Result<(), Refusal> {
    let text = session.saved(None).map_err(Refusal::LiveRecord)?;
    let (name, _) = session.title();
    if session.is_body() {
        let scene = Scene::parse(name, "the session", &text, &[], folder)?;
        let mut messages = BodyMessages::new(&scene, Some(recording.sink()))?;
        let outcome = run(Plan::new(&scene)?, &mut |engine, residual| {
            messages.step(engine, residual);
            ControlFlow::Continue(())
        });
        messages.finish(&outcome.engine, outcome.residual);
    } else {
        let swarm = SwarmFile::parse(name, "the session", &text, &[], folder)?;
        recording.attach_swarm(&text);
        let mut watch = |_: &Flight, _: &Sample| ControlFlow::Continue(());
        fly_recorded(&swarm, &Control::new(&swarm)?, Some(recording), &mut watch)?;
    }
    Ok(())
}

impl PageArguments {
    pub fn server(&self) -> Result<Server, Refusal> {
        Server::open(self.port).map_err(|source| self.refuse(source))
    }

    fn refuse(&self, source: std::io::Error) -> Refusal {
        Refusal::Live { port: self.port, source }
    }

    /// Prints the address, and opens it if that is asked for: for [`close`].
    ///
    /// # Errors
    /// Standard output that takes no address: nothing else says it.
    pub fn announce(&self, server: &Server) -> Result<Option<PathBuf>, Refusal> {
        let address = server.address();
        print(&format!("{address}\n"))?;
        note!("open this address in a browser on this computer; it ends with an interrupt (Ctrl-C)");
        Ok(self.open.then(|| open(&address)).flatten())
    }
}

/// Removes the file by which the page was opened.
pub fn close(door: Option<PathBuf>) {
    if let Some(door) = door {
        let _ = std::fs::remove_file(door);
    }
}

impl LiveArguments {
    fn session(&self) -> Result<Box<dyn Session>, Refusal> {
        let (file, set, folder) = (&self.file, &self.overrides.set, folder_of(&self.file));
        Ok(match Kind::of_either(file)? {
            Kind::Scene => {
                let scene = SceneArguments::new(file, set).load()?;
                Box::new(Body::new(scene, folder)?)
            }
            Kind::Swarm => {
                let swarm = SwarmFileArguments::new(file, set).load()?;
                Box::new(Swarm::new(swarm, folder)?)
            }
        })
    }

    /// The description of the session for a recording, as of the command that replays it; its swarm file is known at
    /// the end.
    fn about(&self, session: &dyn Session) -> About {
        let folder = folder_in_full(&self.file);
        About { source: session.runner(), name: session.title().0.to_owned(), folder, ..About::default() }
    }

    fn saved_in(&self) -> Result<PathBuf, Refusal> {
        let folder = self.out.clone().or_else(|| folder_of(&self.file)).unwrap_or_default();
        let folder = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder };
        if folder.is_dir() { Ok(folder) } else { Err(Refusal::LiveFolder(folder)) }
    }
}

/// Opens the address by way of a file that this user alone can read: the command line of the opener, which others see,
/// then has no token. Returns the file, to be removed.
fn open(address: &str) -> Option<PathBuf> {
    let door = std::env::temp_dir().join(format!("flockform-live-{}.html", std::process::id()));
    let _ = std::fs::remove_file(&door);
    let file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&door);
    let page = format!("<!doctype html><meta http-equiv=\"refresh\" content=\"0;url={address}\">\n");
    let written = file.and_then(|mut file| file.write_all(page.as_bytes()));
    if let Err(error) = written.and_then(|()| output::open(&door)) {
        note!("cannot open a browser: {error}; open the address by hand");
    }
    Some(door)
}
