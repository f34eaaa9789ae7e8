//! Publishers and subscriptions, both without waiting.

use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::Arc;

use ros2_client::dds::rustdds::{Timestamp, WriteOptionsBuilder};

use super::EdgeError;
use super::outbox::Outlet;
use super::participant::{Reader, Shared};
use super::payload::Payload;
use crate::messages::wire::decode;
use crate::messages::{Message, said};

/// When a sample was sent and when it came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamps {
    /// By the sender's clock \[s since the Unix epoch\], if it says so.
    pub sent: Option<f64>,
    /// By this computer's clock \[s since the Unix epoch\].
    pub received: f64,
}

/// Sends messages of one type on one topic.
pub struct Publisher<M> {
    topic: String,
    outlet: Arc<Outlet>,
    shared: Arc<Shared>,
    kind: PhantomData<fn(M)>,
}

impl<M: Message> Publisher<M> {
    pub(super) fn new(topic: String, outlet: Arc<Outlet>, shared: Arc<Shared>) -> Self {
        Self { topic, outlet, shared, kind: PhantomData }
    }

    /// Sends one message to the matched subscriptions, without waiting.
    ///
    /// # Errors
    /// Failures of earlier messages: peers that have not acknowledged for long, a middleware that takes none.
    pub fn publish(&self, message: &M) -> Result<(), EdgeError> {
        let refused = |reason: String| EdgeError::Send { topic: self.topic.clone(), reason };
        let payload = Payload::of(message).map_err(refused)?;
        let options = WriteOptionsBuilder::new().source_timestamp(Timestamp::now()).build();
        self.shared.outbox.post(&self.outlet, payload, options)
    }

    /// Subscriptions elsewhere that receive this \[1\].
    pub fn matched(&self) -> usize {
        self.shared.graph.matched(self.outlet.guid())
    }

    pub fn topic(&self) -> &str {
        &self.topic
    }
}

impl<M> Drop for Publisher<M> {
    fn drop(&mut self) {
        self.shared.graph.remove_endpoint(self.outlet.guid());
    }
}

/// Receives messages of one type on one topic.
pub struct Subscription<M> {
    topic: String,
    reader: Reader,
    shared: Arc<Shared>,
    refused: Cell<u64>,
    kind: PhantomData<fn() -> M>,
}

/// Samples looked at in one call: a flood of bad ones must not hold the loop.
const MOST_AT_ONCE: usize = 1024;

impl<M: Message> Subscription<M> {
    pub(super) fn new(topic: String, reader: Reader, shared: Arc<Shared>) -> Self {
        Self { topic, reader, shared, refused: Cell::new(0), kind: PhantomData }
    }

    /// The oldest message not yet taken, or none. Payloads that are no `M` are skipped and counted.
    pub fn take(&self) -> Option<(M, Stamps)> {
        for _ in 0..MOST_AT_ONCE {
            let (payload, stamps) = match next(&self.reader) {
                Taken::Nothing => return None,
                Taken::Unreadable => {
                    self.refuse("an encoding other than plain CDR");
                    continue;
                }
                Taken::Sample(sample) => (sample.payload, sample.stamps),
            };
            match decode(&payload.bytes, payload.order) {
                Ok(message) => return Some((message, stamps)),
                Err(error) => self.refuse(&error.to_string()),
            }
        }
        None
    }

    /// The newest message not yet taken; older ones are dropped.
    pub fn take_last(&self) -> Option<(M, Stamps)> {
        let mut last = None;
        for _ in 0..MOST_AT_ONCE {
            match self.take() {
                None => break,
                newer => last = newer,
            }
        }
        last
    }

    fn refuse(&self, reason: &str) {
        let before = self.refused.replace(self.refused.get() + 1);
        if before == 0 {
            tracing::warn!(
                "{}: a message was refused: {} (only the first is reported)",
                self.topic,
                said(reason)
            );
        }
    }

    /// Payloads refused since the beginning \[1\].
    pub fn refused(&self) -> u64 {
        self.refused.get()
    }

    /// Publishers elsewhere that send to this \[1\].
    pub fn matched(&self) -> usize {
        self.shared.graph.matched(self.reader.guid())
    }

    pub fn topic(&self) -> &str {
        &self.topic
    }
}

impl<M> Drop for Subscription<M> {
    fn drop(&mut self) {
        self.shared.graph.remove_endpoint(self.reader.guid());
    }
}

pub(super) struct Sample {
    pub payload: Payload,
    pub stamps: Stamps,
    pub identity: ros2_client::RmwRequestId,
    pub related: Option<ros2_client::RmwRequestId>,
}

pub(super) enum Taken {
    Nothing,
    Unreadable,
    Sample(Sample),
}

/// Skips the samples that an earlier reader of the participant left on the topic. RustDDS keeps one cache a topic, and
/// a new reader starts at its beginning; a volatile subscription gets nothing from before it was made.
pub(super) fn forget_earlier(reader: &Reader) {
    for _ in 0..MOST_AT_ONCE {
        if matches!(next(reader), Taken::Nothing) {
            return;
        }
    }
}

/// Takes the next sample out of a reader.
pub(super) fn next(reader: &Reader) -> Taken {
    reader.drain_read_notifications();
    match reader.try_take_one() {
        Ok(None) => Taken::Nothing,
        Err(_) => Taken::Unreadable,
        Ok(Some(change)) => {
            let info = ros2_client::MessageInfo::from(&change);
            let seconds = |time: ros2_client::ROSTime| time.to_nanos() as f64 * 1e-9;
            Taken::Sample(Sample {
                stamps: Stamps {
                    sent: info.source_timestamp().map(seconds),
                    received: info.received_timestamp().map_or(0.0, seconds),
                },
                identity: ros2_client::RmwRequestId {
                    writer_gid: info.publisher_gid(),
                    sequence_number: info.sequence_number(),
                },
                related: info.related_request_id(),
                payload: change.into_value(),
            })
        }
    }
}
