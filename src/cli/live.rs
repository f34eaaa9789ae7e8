//! `flockform live`: a body or a swarm under the reader's hands, shown in a browser on this computer.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use flockform::live::body::Body;
use flockform::live::server::Server;
use flockform::live::session::Session;
use flockform::live::swarm::Swarm as LiveSwarm;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::scene::{Scene, bundled};

use super::names::{FileName, Kind, is_path, not_bundled};
use super::{Refusal, interrupt, output, print};

#[derive(Debug, Args)]
pub struct LiveArguments {
    /// Name of a bundled scene or swarm, or path of a file
    #[arg(value_parser = FileName::ANY, hide_possible_values = true)]
    file: String,
    /// Override a key, validated like the file: `lattice.spacing=0.5`
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Port on this computer, from 1024: those below are the system's [default: a free one]
    #[arg(long, value_name = "PORT", value_parser = clap::value_parser!(u16).range(1024..))]
    port: Option<u16>,
    /// Open the page, with the program that this computer opens such files with
    #[arg(long)]
    open: bool,
    /// Folder for what is saved [default: that of the file, or the working folder for a bundled one]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Serves a session until it is interrupted.
pub fn live(arguments: &LiveArguments) -> Result<ExitCode, Refusal> {
    let session = arguments.session()?;
    let folder = arguments.saved_in()?;
    let refuse = |source| Refusal::Live { port: arguments.port, source };
    let server = Server::open(arguments.port).map_err(refuse)?;
    let address = server.address();
    print(&format!("{address}\n"));
    eprintln!("open this address in a browser on this computer; it ends with an interrupt (Ctrl-C)");
    let door = arguments.open.then(|| open(&address)).flatten();
    let stop = interrupt::serves();
    let served = server.serve(session, folder, stop).map_err(refuse);
    if let Some(door) = door {
        let _ = std::fs::remove_file(door);
    }
    served.map(|()| ExitCode::SUCCESS)
}

impl LiveArguments {
    fn session(&self) -> Result<Session, Refusal> {
        let is_bundled = bundled(&self.file).is_some() || bundled_swarm(&self.file).is_some();
        if !is_bundled && !is_path(&self.file) {
            return Err(not_bundled(&Kind::ALL, &self.file));
        }
        let (file, set) = (self.file.clone(), self.set.clone());
        if Kind::of(&self.file) == Some(Kind::Swarm) {
            let load = move |more: &[String]| {
                let all = [&set[..], more].concat();
                match bundled_swarm(&file) {
                    Some(bundled) => bundled.load_swarm(&all),
                    None => Swarm::from_file(Path::new(&file), &all),
                }
            };
            return Ok(Session::Swarm(Box::new(LiveSwarm::new(Box::new(load))?)));
        }
        let load = move |more: &[String]| {
            let all = [&set[..], more].concat();
            match bundled(&file) {
                Some(bundled) => bundled.load(&all),
                None => Scene::from_file(Path::new(&file), &all),
            }
        };
        Ok(Session::Body(Box::new(Body::new(Box::new(load), self.beside())?)))
    }

    /// The folder of the file, in which the files that it names are looked up; none of a bundled one.
    fn beside(&self) -> Option<PathBuf> {
        let is_bundled = bundled(&self.file).is_some() || bundled_swarm(&self.file).is_some();
        let folder = Path::new(&self.file).parent().map(Path::to_owned);
        folder.filter(|_| !is_bundled)
    }

    fn saved_in(&self) -> Result<PathBuf, Refusal> {
        let folder = self.out.clone().or_else(|| self.beside()).unwrap_or_default();
        let folder = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder };
        if folder.is_dir() { Ok(folder) } else { Err(Refusal::LiveFolder(folder)) }
    }
}

/// Opens the address by way of a file that this user alone can read: the command line of the opener, which others see,
/// then has no token. Returns the file, to be removed.
fn open(address: &str) -> Option<PathBuf> {
    let door = std::env::temp_dir().join(format!("flockform-live-{}.html", std::process::id()));
    let _ = std::fs::remove_file(&door);
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let page = format!("<!doctype html><meta http-equiv=\"refresh\" content=\"0;url={address}\">\n");
    let written = options.open(&door).and_then(|mut file| file.write_all(page.as_bytes()));
    if let Err(error) = written.and_then(|()| output::open(&door)) {
        eprintln!("cannot open a browser: {error}; open the address by hand");
    }
    Some(door)
}
