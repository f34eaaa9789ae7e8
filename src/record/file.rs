//! Writes an MCAP file: schemas and channels as they are met, an index at the end.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Read};
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, WriteOptions, Writer};

use super::RecordError;
use super::rosbag2::{self, Channel, Span};
use crate::messages::builtin_interfaces::Time;
use crate::messages::definitions;
use crate::messages::recorder::RecordedMessage;
use crate::swarm::control::ControlSnapshot;

/// Name of the metadata record that says what was recorded.
pub(crate) const METADATA: &str = "flockform";
/// Key of it for the state that the loop took over.
pub(crate) const TAKEN_OVER: &str = "taken_over";
/// Name of the attachment that is the swarm file.
pub const SWARM: &str = "swarm.toml";
/// Most bytes before compression that are written at once.
const CHUNK: u64 = 256 << 10;
/// Time of the recording after which what there is of it is written, so that a killed program loses no more \[ns\].
const FLUSHED_EVERY: u64 = 1_000_000_000;

/// The subject of a recording.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Command of the program.
    pub source: &'static str,
    /// Name of the swarm or scene.
    pub name: String,
    /// Text of the swarm file.
    pub swarm: Option<String>,
    /// Overrides of it, as given.
    pub set: Vec<String>,
    /// The folder of the files that it names.
    pub folder: Option<PathBuf>,
    /// The robot that the loop was alone for.
    pub member: Option<String>,
    /// Namespace of the node's fleet.
    pub namespace: Option<String>,
    /// The state that the loop took over from the process before it.
    pub taken_over: Option<ControlSnapshot>,
}

/// A recording under way.
pub struct Recording {
    path: PathBuf,
    part: PathBuf,
    force: bool,
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<String, Channel>,
    span: Span,
    /// When what there was had been written \[ns\].
    flushed: Option<u64>,
    failure: Option<mcap::McapError>,
    messages: u64,
}

impl Recording {
    /// # Errors
    /// A file of this name, without `force`; with it, one that is no MCAP file; a folder that cannot be written to.
    pub fn create(path: &Path, about: &About, force: bool) -> Result<Self, RecordError> {
        let unnamed = "does not name a file that could be made: give it a name that ends in .mcap";
        let name = path.file_name().ok_or_else(|| refused(path, unnamed))?;
        require_free(path, force)?;
        let io = RecordError::io;
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(io("create", folder))?;
        }
        let (part, file) = create_part(path, name)?;
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("flockform ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            // The loop that is recorded may have the machine's cores for itself.
            .compression_threads(0);
        let write = |source| RecordError::Write { path: part.clone(), source };
        let mut writer = options.create(BufWriter::new(file)).map_err(write)?;
        describe(&mut writer, about).map_err(write)?;
        let (path, channels, span) = (path.to_owned(), BTreeMap::new(), Span::default());
        Ok(Self { path, part, force, writer, channels, span, flushed: None, failure: None, messages: 0 })
    }

    /// The file that is written, until it is whole.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Adds a message. After one that cannot be written no other is tried: [`Recording::finish`] says why.
    pub fn write(&mut self, taped: &RecordedMessage<'_>) {
        if self.failure.is_some() {
            return;
        }
        if let Err(error) = self.try_to_write(taped) {
            tracing::warn!(
                "the recording ends here, and what there is of it is in {}: {}",
                self.part.display(),
                super::reason(&error)
            );
            self.failure = Some(error);
        }
    }

    fn try_to_write(&mut self, taped: &RecordedMessage<'_>) -> Result<(), mcap::McapError> {
        if !self.channels.contains_key(taped.topic) {
            let channel = add_channel(&mut self.writer, taped)?;
            self.channels.insert(taped.topic.to_owned(), channel);
        }
        let Some(channel) = self.channels.get_mut(taped.topic) else { return Ok(()) };
        let header = MessageHeader {
            channel_id: channel.id,
            // From 0 again after the largest of 32 bits.
            sequence: channel.messages as u32,
            log_time: nanoseconds(taped.time),
            publish_time: nanoseconds(taped.published),
        };
        channel.messages += 1;
        self.span.add(header.log_time);
        self.messages += 1;
        let flushed = *self.flushed.get_or_insert(header.log_time);
        // Either way: a clock may have been set back.
        if header.log_time.abs_diff(flushed) >= FLUSHED_EVERY {
            self.writer.flush()?;
            self.flushed = Some(header.log_time);
        }
        self.writer.write_to_known_channel(&header, taped.payload)
    }

    /// Adds the text of the swarm file that was flown, where it was not known at the beginning.
    pub fn attach_swarm(&mut self, text: &str) {
        self.failure = self.failure.take().or_else(|| attach_swarm(&mut self.writer, text).err());
    }

    /// Messages so far.
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// Removes the file: there was nothing to record.
    ///
    /// # Errors
    /// The file cannot be removed.
    pub fn discard(self) -> Result<(), RecordError> {
        let Self { part, writer, .. } = self;
        // Closed first: it writes its end as it goes.
        drop(writer);
        std::fs::remove_file(&part).map_err(RecordError::io("remove", &part))
    }

    /// Closes the file and gives it its name.
    ///
    /// # Errors
    /// Error writing the file; `NAME.part` has what was written before.
    pub fn finish(mut self) -> Result<PathBuf, RecordError> {
        let write = |source| RecordError::Write { path: self.part.clone(), source };
        if let Some(failure) = self.failure.take() {
            return Err(write(failure));
        }
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let bag = rosbag2::metadata(&name, self.span, self.channels.iter());
        self.writer.write_metadata(&bag).map_err(write)?;
        self.writer.finish().map_err(write)?;
        let file = self.writer.into_inner();
        let synced = file.into_inner().map_err(|error| error.into_error()).and_then(|file| file.sync_all());
        let (part, path) = (self.part, self.path);
        let io = |action| RecordError::io(action, &path);
        synced.map_err(io("write"))?;
        // Checked again: another program may have written there meanwhile.
        if require_free(&path, self.force).is_err() {
            return Err(RecordError::Kept { part, path });
        }
        std::fs::rename(&part, &path).map_err(io("rename the recording to"))?;
        Ok(path)
    }
}

/// Refuses a place that is taken, but for a recording that may be replaced.
fn require_free(path: &Path, force: bool) -> Result<(), RecordError> {
    let Ok(found) = path.symlink_metadata() else { return Ok(()) };
    if !force || !found.is_file() {
        return Err(refused(path, "exists: remove it, or give the recording another name"));
    }
    let mut magic = [0; mcap::MAGIC.len()];
    let begin = File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    if begin.is_ok() && magic == *mcap::MAGIC {
        return Ok(());
    }
    let why = "is no MCAP file: --force replaces recordings only\n  help: move it away, or give the recording another name";
    Err(refused(path, why))
}

fn refused(path: &Path, why: &str) -> RecordError {
    RecordError::Refused(format!("{} {why}", path.display()))
}

/// A new file `NAME.part`, or `NAME.2.part` and so on: a killed program may have left its recording in the first.
fn create_part(path: &Path, name: &OsStr) -> Result<(PathBuf, File), RecordError> {
    let mut n = 1;
    loop {
        let mut part = name.to_owned();
        part.push(if n == 1 { ".part".to_owned() } else { format!(".{n}.part") });
        let part = path.with_file_name(part);
        match File::create_new(&part) {
            Ok(file) => return Ok((part, file)),
            Err(error) if error.kind() == ErrorKind::AlreadyExists && n < 10_000 => n += 1,
            Err(error) => return Err(RecordError::io("create", &part)(error)),
        }
    }
}

/// Of a time in \[s\], as the header stamps of the messages have it.
fn nanoseconds(seconds: f64) -> u64 {
    let Time { sec, nanosec } = Time::from_seconds(seconds);
    u64::try_from(sec).unwrap_or(0) * 1_000_000_000 + u64::from(nanosec)
}

fn add_channel(
    writer: &mut Writer<BufWriter<File>>,
    taped: &RecordedMessage<'_>,
) -> Result<Channel, mcap::McapError> {
    let RecordedMessage { package, name, topic, reliable, .. } = *taped;
    let definition = definitions::concatenated(&format!("{package}/{name}")).unwrap_or_default();
    let kind = format!("{package}/msg/{name}");
    let schema = writer.add_schema(&kind, "ros2msg", definition.as_bytes())?;
    let quality = (rosbag2::OFFERED_QOS.to_owned(), format!("{:#}", rosbag2::offered_qos(reliable)));
    let id = writer.add_channel(schema, topic, "cdr", &[quality].into())?;
    Ok(Channel { id, kind, reliable, messages: 0 })
}

fn describe(writer: &mut Writer<BufWriter<File>>, about: &About) -> Result<(), mcap::McapError> {
    let mut metadata: BTreeMap<String, String> = [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("source", about.source.to_owned()),
        ("name", about.name.clone()),
        ("set", serde_json::to_string(&about.set).unwrap_or_default()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into();
    let folder = about.folder.as_ref().map(|folder| folder.display().to_string());
    let state = about.taken_over.as_ref().and_then(|state| serde_json::to_string(state).ok());
    for (key, value) in [
        ("member", &about.member),
        ("namespace", &about.namespace),
        ("folder", &folder),
        (TAKEN_OVER, &state),
    ] {
        if let Some(value) = value {
            metadata.insert(key.to_owned(), value.clone());
        }
    }
    writer.write_metadata(&Metadata { name: METADATA.to_owned(), metadata })?;
    about.swarm.as_ref().map_or(Ok(()), |swarm| attach_swarm(writer, swarm))
}

fn attach_swarm(writer: &mut Writer<BufWriter<File>>, text: &str) -> Result<(), mcap::McapError> {
    writer.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: SWARM.to_owned(),
        media_type: "application/toml".to_owned(),
        data: text.as_bytes().into(),
    })
}
