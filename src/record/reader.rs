//! Reads recordings: the messages that a loop received and sent, in the order of the file.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::RecordError;
use super::file::{METADATA, SWARM};
use crate::messages::Message;
use crate::messages::wire::{Order, decode};

/// A message as it stands in the file.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name of the topic.
    pub topic: Arc<str>,
    /// `package/Name`.
    pub kind: Arc<str>,
    /// The encoded message, its encapsulation header included.
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
        let no_mcap = || RecordError::NoMcap { path: path.to_owned(), source: McapError::BadMagic };
        let found = std::fs::metadata(path).map_err(|error| {
            let part = path.with_added_extension("part");
            match part.is_file() {
                true => RecordError::Refused(format!(
                    "{} is missing: a program that did not end has left what it recorded in {}; name that file",
                    path.display(),
                    part.display()
                )),
                false => RecordError::io("read", path)(error),
            }
        })?;
        // A device has no end.
        if !found.is_file() {
            return Err(no_mcap());
        }
        Self::of_bytes(path, std::fs::read(path).map_err(RecordError::io("read", path))?)
    }

    /// A recording that is in memory already; `path` is what it is called.
    ///
    /// # Errors
    /// A file that is no MCAP file.
    pub fn of_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, RecordError> {
        let path = path.to_owned();
        if !bytes.starts_with(mcap::MAGIC) {
            return Err(RecordError::NoMcap { path, source: McapError::BadMagic });
        }
        Ok(Self { path, bytes })
    }

    /// Shows every record, those in chunks too, until `see` has enough or the file is damaged. A length in the file
    /// never leads to an allocation larger than the file, or [`LARGEST`].
    fn scan(&self, see: &mut dyn FnMut(Record<'_>) -> ControlFlow<()>) -> Result<(), McapError> {
        let options = LinearReaderOptions::default()
            // The file of a killed program has no end, and is worth reading nevertheless.
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(self.bytes.len().max(LARGEST));
        let mut reader = LinearReader::new_with_options(options);
        let mut rest = &self.bytes[..];
        while let Some(event) = reader.next_event() {
            match event? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let (next, further) = rest.split_at(wanted.min(rest.len()));
                    reader.insert(next.len()).copy_from_slice(next);
                    reader.notify_read(next.len());
                    rest = further;
                }
                // The parser of the crate counts back from the end of one that is too short.
                LinearReadEvent::Record { opcode: op::ATTACHMENT, data } if !is_attachment(data) => {
                    return Err(McapError::UnexpectedEof);
                }
                LinearReadEvent::Record { data, opcode } => {
                    if see(mcap::parse_record(opcode, data)?).is_break() {
                        break;
                    }
                }
            }
        }
        Ok(())
    }

    /// The header before the first message.
    pub fn described(&self) -> Described {
        let mut described = Described::default();
        // What comes before damage is as good as ever.
        let _ = self.scan(&mut |record| {
            match record {
                Record::Metadata(metadata) if metadata.name == METADATA => {
                    described.metadata = metadata.metadata;
                }
                Record::Attachment { header, data, .. } if header.name == SWARM => {
                    described.swarm = Some(String::from_utf8_lossy(&data).into_owned());
                }
                Record::Message { .. } => return ControlFlow::Break(()),
                _ => {}
            }
            ControlFlow::Continue(())
        });
        described
    }

    /// Refuses what can be read, with the damage that ends it, if the file is damaged: what is lacking may have come after.
    pub(super) fn refused(&self, why: &str) -> RecordError {
        let path = self.path.display();
        RecordError::Refused(match self.each(&mut |_| {}) {
            Some(damage) => format!("{path} breaks off: {damage}; of what comes before that: {path}{why}"),
            None => format!("{path}{why}"),
        })
    }

    /// Shows every CDR message to `see`, in the order of the file, until it is damaged or ends. Returns what is
    /// wrong with its end, if anything is: damage behind the last message is none.
    pub fn each(&self, see: &mut dyn FnMut(&Entry)) -> Option<String> {
        let mut kinds: BTreeMap<u16, Arc<str>> = BTreeMap::new();
        let mut channels: BTreeMap<u16, (Arc<str>, Arc<str>)> = BTreeMap::new();
        let mut is_closed = false;
        let scanned = self.scan(&mut |record| {
            match record {
                Record::Schema { header, .. } => {
                    kinds.insert(header.id, header.name.replace("/msg/", "/").into());
                }
                Record::Channel(channel) if channel.message_encoding == "cdr" => {
                    if let Some(kind) = kinds.get(&channel.schema_id) {
                        channels.insert(channel.id, (channel.topic.into(), Arc::clone(kind)));
                    }
                }
                Record::Message { header, data } => {
                    if let Some((topic, kind)) = channels.get(&header.channel_id) {
                        let (topic, kind) = (Arc::clone(topic), Arc::clone(kind));
                        let published = header.publish_time as f64 * 1e-9;
                        see(&Entry { topic, kind, payload: data.into_owned(), published });
                    }
                }
                Record::DataEnd(_) => is_closed = true,
                _ => {}
            }
            ControlFlow::Continue(())
        });
        match scanned {
            Err(error) => (!is_closed).then(|| error.to_string()),
            Ok(()) => (!is_closed).then(|| "it was never closed".to_owned()),
        }
    }

    /// The file that is read.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Largest record or chunk that a small file may hold, uncompressed \[byte\].
const LARGEST: usize = 64 << 20;

/// Whether an attachment has room for all that comes before and after its data: two times, two strings with their
/// lengths, the length of the data, and a checksum.
fn is_attachment(body: &[u8]) -> bool {
    let after_string = |from: usize| {
        let length = body.get(from..from.checked_add(4)?)?;
        (from + 4).checked_add(u32::from_le_bytes(length.try_into().ok()?) as usize)
    };
    let data = after_string(16).and_then(after_string);
    data.and_then(|data| data.checked_add(8 + 4)).is_some_and(|end| end <= body.len())
}
