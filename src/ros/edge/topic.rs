//! Publishers and subscriptions, both without waiting.

use std::cell::{Cell, RefCell};
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::{Timestamp, WriteOptionsBuilder};

use super::outbox::Outlet;
use super::participant::{Reader, Shared};
use super::payload::Payload;
use super::{EdgeError, Quality, names};
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
    node: String,
    quality: Quality,
    reader: RefCell<Reader>,
    shared: Arc<Shared>,
    refused: Refused,
    silence: Cell<Option<Silence>>,
    kind: PhantomData<fn() -> M>,
}

/// A topic that messages come on steadily, and how long it has brought none.
#[derive(Clone, Copy)]
struct Silence {
    /// Of the last message; none before the first.
    since: Option<Instant>,
    /// When the reader is replaced \[s\].
    patience: Duration,
}

/// Least and largest silence after which a reader is replaced \[s\], and how many times as long as between the last two messages.
const PATIENCE: [Duration; 2] = [Duration::from_secs(2), Duration::from_secs(60)];
const OVER_PERIOD: u32 = 4;

/// Samples looked at in one call: a flood of bad ones must not hold the loop.
pub(super) const MOST_AT_ONCE: usize = 1024;

impl<M: Message> Subscription<M> {
    /// Of a node, by its full name.
    pub(super) fn open(
        shared: &Arc<Shared>,
        node: &str,
        topic: &str,
        quality: Quality,
    ) -> Result<Self, EdgeError> {
        Ok(Self {
            reader: RefCell::new(Self::reader(shared, node, topic, quality)?),
            topic: topic.to_owned(),
            node: node.to_owned(),
            quality,
            shared: shared.clone(),
            refused: Refused::default(),
            silence: Cell::new(None),
            kind: PhantomData,
        })
    }

    fn reader(shared: &Shared, node: &str, topic: &str, quality: Quality) -> Result<Reader, EdgeError> {
        let kind = names::dds_message(M::PACKAGE, M::NAME);
        let reader = shared.reader(&names::dds_topic(topic), &kind, quality)?;
        if !quality.transient_local {
            forget_earlier(&reader);
        }
        shared.graph.add_reader(node, reader.guid(), topic);
        Ok(reader)
    }

    /// The same, for messages that come steadily: a forged gap in the name of a publisher leaves the middleware deaf to it for
    /// ever, and where it falls silent though it is there a new reader finds it again.
    pub fn steady(self) -> Self {
        self.silence.set(Some(Silence { since: None, patience: PATIENCE[0] }));
        self
    }

    /// Notes whether a message came, and takes a new reader after a long silence.
    fn note(&self, came: bool) {
        let Some(Silence { since, patience }) = self.silence.get() else { return };
        let quiet = since.map(|since| since.elapsed());
        if came {
            let patience = (OVER_PERIOD * quiet.unwrap_or_default()).clamp(PATIENCE[0], PATIENCE[1]);
            return self.silence.set(Some(Silence { since: Some(Instant::now()), patience }));
        }
        if quiet.is_none_or(|quiet| quiet < patience) || self.matched() == 0 || !self.shared.may_renew() {
            return;
        }
        match Self::reader(&self.shared, &self.node, &self.topic, self.quality) {
            Ok(reader) => {
                let before = self.reader.replace(reader);
                self.shared.graph.remove_endpoint(before.guid());
                tracing::debug!("{}: silent though its publisher is there: a new reader listens", self.topic);
            }
            Err(error) => tracing::debug!("{}: silent, and no new reader: {error}", self.topic),
        }
        // One that has stopped for reasons of its own is looked for less and less often.
        let patience = (2 * patience).min(PATIENCE[1]);
        self.silence.set(Some(Silence { since: Some(Instant::now()), patience }));
    }

    /// The oldest message not yet taken, or none. Payloads that are no `M` are skipped and counted.
    pub fn take(&self) -> Option<(M, Stamps)> {
        for _ in 0..MOST_AT_ONCE {
            let taken = next(&self.reader.borrow());
            self.note(!matches!(taken, Taken::Nothing));
            let (payload, stamps) = match taken {
                Taken::Nothing => return None,
                Taken::Unreadable => {
                    self.refused.note(&self.topic, "message", "an encoding other than plain CDR");
                    continue;
                }
                Taken::Sample(sample) => (sample.payload, sample.stamps),
            };
            match decode(&payload.bytes, payload.order) {
                Ok(message) => return Some((message, stamps)),
                Err(error) => self.refused.note(&self.topic, "message", &error.to_string()),
            }
        }
        None
    }

    /// The newest message not yet taken; older ones are dropped.
    pub fn take_last(&self) -> Option<(M, Stamps)> {
        std::iter::from_fn(|| self.take()).take(MOST_AT_ONCE).last()
    }

    /// Payloads refused since the beginning \[1\].
    pub fn refused(&self) -> u64 {
        self.refused.count()
    }

    /// Publishers elsewhere that send to this \[1\].
    pub fn matched(&self) -> usize {
        self.shared.graph.matched(self.reader.borrow().guid())
    }

    /// Whether all publishers that there were have taken leave; `None` where there was none.
    pub(in crate::ros) fn is_left(&self) -> Option<bool> {
        self.shared.graph.is_left(self.reader.borrow().guid())
    }

    pub fn topic(&self) -> &str {
        &self.topic
    }
}

impl<M> Drop for Subscription<M> {
    fn drop(&mut self) {
        self.shared.graph.remove_endpoint(self.reader.get_mut().guid());
    }
}

/// Payloads of a topic or a service that were refused.
#[derive(Default)]
pub(super) struct Refused(Cell<u64>);

impl Refused {
    /// Counts one, and warns of the first.
    pub fn note(&self, name: &str, what: &str, reason: &str) {
        if self.0.replace(self.0.get() + 1) == 0 {
            tracing::warn!("{name}: a {what} was refused: {} (only the first is reported)", said(reason));
        }
    }

    pub fn count(&self) -> u64 {
        self.0.get()
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

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, UdpSocket};

    use super::super::graph::{entity, prefix};
    use super::super::packet::{PARTICIPANTS, participant_port};
    use super::super::{Edge, Options};
    use super::*;
    use crate::messages::std_msgs::Empty;

    /// All samples up to 2^62 are said to be of no concern (RTPS 2.3, section 8.3.7.4), in the name of a writer.
    fn gap(of: ros2_client::dds::rustdds::GUID) -> Vec<u8> {
        let mut packet = b"RTPS\x02\x03\x01\x12".to_vec();
        packet.extend(prefix(of));
        packet.extend([8, 1, 28, 0]);
        packet.extend([0; 4]);
        packet.extend(entity(of));
        for [high, low] in [[0_u32, 1], [1 << 30, 0]] {
            packet.extend([high.to_le_bytes(), low.to_le_bytes()].concat());
        }
        packet.extend([0; 4]);
        packet
    }

    #[test]
    fn a_steady_topic_that_a_forged_gap_has_silenced_is_heard_again() {
        let domain = 100 + (std::process::id() % 101) as u16;
        let edge = || Edge::open(Options { domain, loopback_only: true }).expect("sockets");
        let (ours, theirs) = (edge(), edge());
        let [here, there] =
            [(&ours, "here"), (&theirs, "there")].map(|(edge, name)| edge.node("/", name).expect("a node"));
        let publishers = ["/steady", "/other"]
            .map(|topic| there.publisher::<Empty>(topic, Quality::BEST_EFFORT).expect("a writer"));
        let subscription = |topic| here.subscription::<Empty>(topic, Quality::BEST_EFFORT).expect("a reader");
        let topics = [subscription("/steady").steady(), subscription("/other")];
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a socket");
        let during = |time: f64, forges: bool| {
            let since = Instant::now();
            let mut counts = [0; 2];
            while since.elapsed().as_secs_f64() < time {
                for publisher in &publishers {
                    publisher.publish(&Empty {}).expect("sent");
                    let gap = gap(publisher.outlet.guid());
                    let ports = (0..PARTICIPANTS).filter_map(|one| participant_port(domain, one));
                    for port in ports.filter(|_| forges) {
                        let _ = socket.send_to(&gap, (Ipv4Addr::LOCALHOST, port));
                    }
                }
                std::thread::sleep(Duration::from_millis(20));
                for (count, topic) in counts.iter_mut().zip(&topics) {
                    *count += std::iter::from_fn(|| topic.take()).count();
                }
            }
            counts
        };
        assert!(during(2.0, false).iter().all(|&count| count > 10));
        during(0.1, true);
        assert_eq!(during(1.0, false), [0; 2], "the gap is believed");
        let [steady, other] = during(4.0, false);
        assert!(steady > 10 && other == 0, "{steady}, {other}");
        // As soon the second time: what has passed makes it no more patient.
        during(0.1, true);
        let [steady, _] = during(3.5, false);
        assert!(steady > 10, "{steady}");
    }
}
