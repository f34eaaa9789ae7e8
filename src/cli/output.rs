//! Where a command's results go, and how much it says.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use flockform::export::figures::Formats;
use flockform::export::{ExportError, OutputFolder, unfinished};

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

impl OutputArguments {
    /// The folder asked for, or a free one of this name.
    pub fn folder(&self, name: &str) -> Result<OutputFolder, ExportError> {
        let out = self.out.clone().unwrap_or_else(|| free_folder(name));
        OutputFolder::create(&out, self.force)
    }
}

/// The first of out/NAME, out/NAME-2, ... that is not taken.
fn free_folder(name: &str) -> PathBuf {
    let taken = |path: &Path| {
        path.read_dir().is_ok_and(|mut entries| entries.next().is_some()) || unfinished(path).exists()
    };
    let numbered = (2..).map(|n| PathBuf::from(format!("out/{name}-{n}")));
    std::iter::once(PathBuf::from(format!("out/{name}")))
        .chain(numbered)
        .find(|path| !taken(path))
        .expect("endless")
}
