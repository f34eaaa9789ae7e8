//! `--record FILE.mcap`: a recording beside what a command does.

use std::path::PathBuf;

use clap::Args;
use flockform::export::OutputFolder;
use flockform::record::Shared;
use flockform::record::{About, RecordError, Recording};

use super::{Refusal, interrupt};

#[derive(Debug, Args)]
pub struct RecordArguments {
    /// Record the messages received and sent as an MCAP file, for Foxglove, `ros2 bag play` and `flockform replay`
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,
}

impl RecordArguments {
    /// Whether a recording is asked for.
    pub fn is_asked(&self) -> bool {
        self.record.is_some()
    }

    /// The recording beside these results, if one is asked for; a file in its place is replaced with `force` alone.
    pub fn open_beside(
        &self,
        results: &OutputFolder,
        about: &About,
        force: bool,
    ) -> Result<Option<Shared>, Refusal> {
        self.record.iter().try_for_each(|path| results.require_outside(path))?;
        let path = self.record.as_deref();
        let recording = path.map(|path| Recording::create(path, about, force)).transpose()?;
        // An end that keeps no results keeps no part of their recording either.
        interrupt::removes(recording.iter().map(|recording| recording.part().to_owned()));
        Ok(recording.map(Shared::new))
    }

    /// The same beside nothing. A process that goes on where another ended leaves that one's file (`.mcap.part`) and writes
    /// FILE.2.mcap, and so on: the first of these names that is free.
    pub fn open(&self, about: &About, life: u32) -> Result<Option<Shared>, RecordError> {
        let of_life = |path: &PathBuf| {
            let mut names = (life..).map(|life| path.with_extension(format!("{life}.mcap")));
            if life == 1 { Some(path.clone()) } else { names.find(|path| path.symlink_metadata().is_err()) }
        };
        let path = self.record.as_ref().and_then(of_life);
        path.map(|path| Recording::create(&path, about, false).map(Shared::new)).transpose()
    }

    /// Refuses a recording of what has none.
    pub fn require_none(&self, what: &str) -> Result<(), RecordError> {
        let refused =
            || format!("--record: {what} is not recorded\n  help: leave --record out, or use ROS 2");
        self.record.as_ref().map_or(Ok(()), |_| Err(RecordError::Refused(refused())))
    }
}

/// Closes a recording; what was recorded, in words.
pub fn close(shared: Option<Shared>) -> Result<String, RecordError> {
    let Some(recording) = shared.and_then(|shared| shared.take()) else { return Ok(String::new()) };
    let messages = recording.messages();
    let path = recording.finish()?;
    Ok(format!("{messages} messages recorded in {}\n", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_goes_on_where_another_ended_takes_the_first_free_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let record = Some(folder.path().join("f.mcap"));
        let arguments = RecordArguments { record };
        let part = |life| {
            let recording = arguments.open(&About::default(), life).expect("a free name");
            recording.and_then(|shared| shared.take()).expect("one is asked for").part().to_owned()
        };
        assert_eq!(part(2), folder.path().join("f.2.mcap.part"));
        std::fs::write(folder.path().join("f.2.mcap"), "of an earlier flight").expect("written");
        assert_eq!(part(2), folder.path().join("f.3.mcap.part"));
        assert_eq!(part(4), folder.path().join("f.4.mcap.part"));
        std::fs::write(folder.path().join("f.mcap"), "of an earlier flight").expect("written");
        let refused = arguments.open(&About::default(), 1).err().map(|error| error.to_string());
        assert!(refused.is_some_and(|said| said.contains("f.mcap") && said.contains("exists")));
    }
}
