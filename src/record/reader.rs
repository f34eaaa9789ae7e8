//! Reads recordings: the messages that a loop received and sent, in the order of the file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::read::{ChunkFlattener, Options};
use mcap::records::Record;

use super::RecordError;
use super::file::{METADATA, SWARM};
use crate::ros::edge::Message;
use crate::ros::edge::wire::{Order, decode};

/// A message as it stands in the file.
#[derive(Clone, Debug)]
pub struct Entry {
    pub topic: Arc<str>,
    /// `package/Name`.
    pub kind: Arc<str>,
    pub payload: Vec<u8>,
    /// When it was sent, or came \[s\].
    pub published: f64,
}

impl Entry {
    /// The message, if it is an `M`.
    pub fn decode<M: Message>(&self) -> Option<M> {
        let is_one = self.kind.split_once('/').is_some_and(|(p, n)| p == M::PACKAGE && n == M::NAME);
        let order = match self.payload.get(..2)? {
            [0, 1] => Order::Little,
            [0, 0] => Order::Big,
            _ => return None,
        };
        is_one.then(|| decode(self.payload.get(4..)?, order).ok()).flatten()
    }
}

/// A recording in memory, compressed as it is.
pub struct Reader {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// The metadata of a recording.
#[derive(Clone, Debug, Default)]
pub struct Described {
    pub metadata: BTreeMap<String, String>,
    pub swarm: Option<String>,
}

impl Reader {
    /// # Errors
    /// A file that cannot be read or is no MCAP file.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let bytes = std::fs::read(path).map_err(RecordError::io("read", path))?;
        if !bytes.starts_with(mcap::MAGIC) {
            return Err(RecordError::NoMcap { path: path.to_owned(), source: mcap::McapError::BadMagic });
        }
        let this = Self { path: path.to_owned(), bytes };
        this.records()?;
        Ok(this)
    }

    fn records(&self) -> Result<ChunkFlattener<'_>, RecordError> {
        // The file of a killed program has no end, and is worth reading nevertheless.
        ChunkFlattener::new_with_options(&self.bytes, Options::IgnoreEndMagic | Options::ValidateChunkCrcs)
            .map_err(|source| RecordError::NoMcap { path: self.path.clone(), source })
    }

    /// The header before the first message.
    pub fn described(&self) -> Result<Described, RecordError> {
        let mut described = Described::default();
        for record in self.records()? {
            match record {
                Ok(Record::Metadata(metadata)) if metadata.name == METADATA => {
                    described.metadata = metadata.metadata;
                }
                Ok(Record::Attachment { header, data, .. }) if header.name == SWARM => {
                    described.swarm = Some(String::from_utf8_lossy(&data).into_owned());
                }
                Ok(Record::Message { .. }) | Err(_) => break,
                Ok(_) => {}
            }
        }
        Ok(described)
    }

    /// Shows every CDR message to `see`, in the order of the file, until it is damaged or ends. Returns what is
    /// wrong with its end, if anything is.
    pub fn each(&self, see: &mut dyn FnMut(&Entry)) -> Result<Option<String>, RecordError> {
        let mut kinds: BTreeMap<u16, Arc<str>> = BTreeMap::new();
        let mut channels: BTreeMap<u16, (Arc<str>, Arc<str>)> = BTreeMap::new();
        let mut is_closed = false;
        for record in self.records()? {
            match record {
                Err(error) => return Ok(Some(error.to_string())),
                Ok(Record::Schema { header, .. }) => {
                    kinds.insert(header.id, header.name.replace("/msg/", "/").into());
                }
                Ok(Record::Channel(channel)) if channel.message_encoding == "cdr" => {
                    if let Some(kind) = kinds.get(&channel.schema_id) {
                        channels.insert(channel.id, (channel.topic.into(), Arc::clone(kind)));
                    }
                }
                Ok(Record::Message { header, data }) => {
                    if let Some((topic, kind)) = channels.get(&header.channel_id) {
                        let (topic, kind) = (Arc::clone(topic), Arc::clone(kind));
                        let published = header.publish_time as f64 * 1e-9;
                        see(&Entry { topic, kind, payload: data.into_owned(), published });
                    }
                }
                Ok(Record::DataEnd(_)) => is_closed = true,
                Ok(_) => {}
            }
        }
        Ok((!is_closed).then(|| "it was never closed".to_owned()))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}
