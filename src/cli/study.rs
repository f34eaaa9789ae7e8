//! Common parts of the studies of a scene: their arguments, and how they end.

use std::path::PathBuf;

use clap::Args;
use flockform::export::{ExportError, OutputFolder};

use super::names::SceneArguments;
use super::output::{OutputArguments, ReportArguments};
use super::{Refusal, interrupt, print, say};

#[derive(Debug, Args)]
pub struct StudyArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    #[command(flatten)]
    pub output: OutputArguments,
    #[command(flatten)]
    pub report: ReportArguments,
    /// Print the results as JSON instead of a table
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

impl StudyArguments {
    /// Writes the report, gives the folder its name, and prints JSON or a table.
    pub fn finish(
        &self,
        folder: OutputFolder,
        report: impl FnOnce(&OutputFolder) -> Result<PathBuf, ExportError>,
        json: impl FnOnce() -> serde_json::Value,
        table: impl FnOnce() -> String,
    ) -> Result<(), Refusal> {
        if !self.report.no_report {
            report(&folder)?;
        }
        let kept = interrupt::commit(folder)?;
        if self.json {
            print(&format!("{:#}\n", json()))?;
        } else if !self.output.quiet {
            say(&format!("{}results in {}\n", table(), kept.display()))?;
        }
        self.report.show(&kept);
        Ok(())
    }
}
