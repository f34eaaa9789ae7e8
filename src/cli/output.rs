//! Where a command's results go, and how much it says.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use flockform::export::figures::Formats;
use flockform::export::report::page;
use flockform::export::shell::quoted;
use flockform::export::{ExportError, OutputFolder};

use super::interrupt;

#[derive(Debug, Args)]
pub struct OutputArguments {
    /// Folder for the results; must be empty or new [default: out/NAME, numbered if taken]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Replace an earlier output of flockform in DIR
    #[arg(long)]
    pub force: bool,
}

/// Whether there shall be a report.html, and whether it is shown.
#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Write no report.html, and keep no frames for it
    #[arg(long)]
    pub no_report: bool,
    /// Open report.html at the end, with the program that this computer opens such files with
    #[arg(long, conflicts_with = "no_report")]
    open: bool,
}

impl ReportArguments {
    /// Opens the report in a finished folder if that is asked for; a computer without an opener is no failure.
    pub fn show(&self, folder: &Path) {
        let report = folder.join(page::FILE);
        if !self.open || !report.is_file() {
            return;
        }
        if let Err(error) = open(&report) {
            note!("cannot open {}: {error}; open it by hand", report.display());
        }
    }
}

/// Opens a file with the program that this computer opens such files with.
pub fn open(file: &Path) -> std::io::Result<()> {
    let mut opener = Command::new(if cfg!(target_os = "macos") { "open" } else { "xdg-open" });
    opener.arg(file).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().map(drop)
}

/// Which figures there shall be.
#[derive(Debug, Args)]
pub struct FigureArguments {
    /// Files to draw figures as; none leaves everything that is no figure
    #[arg(long, value_name = "FORMATS", value_enum, default_value = "all")]
    pub figures: Formats,
}

/// The folder, which an interrupt leaves nothing of.
pub fn create(out: &Path, force: bool) -> Result<OutputFolder, ExportError> {
    let folder = OutputFolder::create(out, force)?;
    interrupt::removes(folder.made().map(Path::to_owned));
    Ok(folder)
}

impl OutputArguments {
    /// The folder asked for, or the first of out/NAME, out/NAME-2, ... that is not taken.
    pub fn folder(&self, name: &str) -> Result<OutputFolder, ExportError> {
        let mut folder = self.empty(name)?;
        folder.set_command(own_command_line());
        Ok(folder)
    }

    fn empty(&self, name: &str) -> Result<OutputFolder, ExportError> {
        if let Some(out) = &self.out {
            return create(out, self.force);
        }
        let name = folder_name(name);
        let mut path = PathBuf::from(format!("out/{name}"));
        for n in 2.. {
            // Making it decides: another run may want the same name at this moment.
            match create(&path, false) {
                Err(
                    ExportError::NotEmpty(_)
                    | ExportError::Unfinished(_)
                    | ExportError::InTheWay(_)
                    | ExportError::Busy(_),
                ) => {}
                created => return created,
            }
            path.set_file_name(format!("{name}-{n}"));
        }
        unreachable!("endless")
    }
}

/// The name of a scene or swarm as that of a folder below another: of `..toml` it is `.`, which names no folder of its own.
fn folder_name(name: &str) -> String {
    let name = name.replace(['/', '\\'], "-");
    if name.chars().all(|c| c == '.') { "unnamed".into() } else { name }
}

/// Options that change nothing of a report, and whether a value follows.
const WITHOUT_EFFECT: [(&str, bool); 11] = [
    ("--out", true),
    ("--force", false),
    ("--quiet", false),
    ("--verbose", false),
    ("--open", false),
    ("--json", false),
    ("--figures", true),
    ("--film", true),
    ("--film-colour", true),
    ("--record", true),
    ("--publish", true),
];

/// The command that this process was started by, for the reader: as far as it is text.
pub fn own_command_line() -> String {
    command_line(std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()))
}

/// The command with these arguments as a shell takes it, without options that change nothing of its report.
pub fn command_line(arguments: impl IntoIterator<Item = String>) -> String {
    let mut words = vec!["flockform".to_owned()];
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        let name = argument.split_once('=').map_or(argument.as_str(), |(name, _)| name);
        match WITHOUT_EFFECT.iter().find(|(known, _)| *known == name) {
            // Of these one word may have several.
            None if name.starts_with("-v") || name.starts_with("-q") => {}
            None => words.push(quoted(&argument)),
            Some((known, takes_value)) if *takes_value && *known == argument => drop(arguments.next()),
            Some(_) => {}
        }
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_lie_below_the_folder_of_all_whatever_the_file_is_called() {
        let names = ["", ".", "..", "../up", "tension", "a.b"];
        let folders = ["unnamed", "unnamed", "unnamed", "..-up", "tension", "a.b"];
        assert_eq!(names.map(folder_name), folders);
    }

    #[test]
    fn a_command_line_can_be_typed_again() {
        let of = |line: &[&str]| command_line(line.iter().map(|&word| word.to_owned()));
        assert_eq!(
            of(&[
                "swarm",
                "square",
                "-q",
                "--out",
                "a b",
                "--set",
                "title=it's",
                "-vv",
                "--force",
                "--out=c"
            ]),
            r"flockform swarm square --set 'title=it'\''s'"
        );
        assert_eq!(
            of(&[
                "compare",
                "my scene.toml",
                "--truth-error",
                "0.01",
                "--open",
                "--film=a.gif",
                "--film-colour",
                "stretch"
            ]),
            "flockform compare 'my scene.toml' --truth-error 0.01"
        );
    }
}
