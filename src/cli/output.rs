//! Where a command's results go, and how much it says.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use flockform::export::figures::Formats;
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

/// Whether there shall be a report.html.
#[derive(Debug, Args)]
pub struct ReportArguments {
    /// Write no report.html, and keep no frames for it
    #[arg(long)]
    pub no_report: bool,
}

/// Which figures there shall be.
#[derive(Debug, Args)]
pub struct FigureArguments {
    /// Files to draw figures as; none leaves the tables, the summary and report.html
    #[arg(long, value_name = "FORMATS", value_enum, default_value = "all")]
    figures: Figures,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Figures {
    None,
    Png,
    Svg,
    All,
}

impl FigureArguments {
    pub fn formats(&self) -> Formats {
        match self.figures {
            Figures::None => Formats::None,
            Figures::Png => Formats::Png,
            Figures::Svg => Formats::Svg,
            Figures::All => Formats::All,
        }
    }
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
        if let Some(out) = &self.out {
            return create(out, self.force);
        }
        let mut path = PathBuf::from(format!("out/{name}"));
        for n in 2.. {
            // Making it decides: another run may want the same name at this moment.
            match create(&path, false) {
                Err(ExportError::NotEmpty(_) | ExportError::Unfinished(_) | ExportError::Busy(_)) => {}
                created => return created,
            }
            path.set_file_name(format!("{name}-{n}"));
        }
        unreachable!("endless")
    }
}
