//! Large replies, sent whole beside the fragments of RustDDS.
//!
//! RustDDS cuts a reply that the smallest packet of its readers does not hold into fragments, and writes a byte too many before the
//! identity of the request in each (`.github/upstream.md`). Fast DDS takes none of them, and no later reply of that
//! service either. So the same sample goes out once more, as one DATA of the same number: whichever a reader understands first
//! counts, and it drops the other.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::rpc::SampleIdentity;
use ros2_client::dds::rustdds::{GUID, WriteOptions};

use super::graph::{Graph, entity, prefix};
use super::packet::{Content, data, related_to};
use super::payload::Payload;
use super::places::{Places, is_fast_dds};

/// Payloads that RustDDS never cuts \[bytes\]: devices with the smallest packets of IPv6 take them in one.
const NEVER_CUT: usize = 1000;

/// Payloads that a packet of UDP holds, with what stands before them \[bytes\].
pub(super) const LARGEST: usize = 65_000;

/// When a sample is sent again \[s\]. Its parts may be lost on the way, and RustDDS repeats only what is not understood.
const AGAIN: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(1)];

/// Samples that wait to be sent again \[1\].
const MOST_WAITING: usize = 32;

/// Sends the replies of the services of a participant.
pub(super) struct WholeReplies {
    places: Arc<Places>,
    graph: Arc<Graph>,
    again: Mutex<VecDeque<Sent>>,
}

struct Sent {
    first: Instant,
    times: usize,
    packet: Vec<u8>,
    to: Vec<[u8; 12]>,
}

/// What stands in a reply.
pub(super) struct Reply {
    inline_qos: Vec<u8>,
    payload: Vec<u8>,
}

impl Reply {
    /// Of a sample that Fast DDS would not take in fragments.
    pub fn of(payload: &Payload, options: &WriteOptions) -> Option<Self> {
        let SampleIdentity { writer_guid, sequence_number } = options.related_sample_identity()?;
        if !(NEVER_CUT..=LARGEST).contains(&payload.bytes.len()) {
            return None;
        }
        let inline_qos = related_to(writer_guid.to_bytes(), i64::from(sequence_number));
        Some(Self { inline_qos, payload: payload.serialized() })
    }
}

impl WholeReplies {
    pub fn new(places: Arc<Places>, graph: Arc<Graph>) -> Self {
        Self { places, graph, again: Mutex::default() }
    }

    /// Sends what RustDDS has written as the sample of this number, to the participants on Fast DDS that it reaches.
    pub fn send(&self, writer: GUID, number: i64, reply: &Reply) {
        let mut to = self.graph.matched_participants(writer);
        to.retain(|&prefix| is_fast_dds(prefix));
        let Ok(number) = u32::try_from(number) else { return };
        if to.is_empty() {
            return;
        }
        let content = Content::Both { inline_qos: &reply.inline_qos, payload: &reply.payload };
        let packet = data(prefix(writer), [entity(writer), [0; 4]], number, &content);
        to.iter().for_each(|&to| self.places.send(to, &packet));
        let mut again = self.again.lock().unwrap_or_else(PoisonError::into_inner);
        if again.len() >= MOST_WAITING {
            again.pop_front();
        }
        again.push_back(Sent { first: Instant::now(), times: 0, packet, to });
    }

    /// Sends again what is due.
    pub fn repeat(&self) {
        let mut again = self.again.lock().unwrap_or_else(PoisonError::into_inner);
        for sent in again.iter_mut().filter(|sent| sent.first.elapsed() > AGAIN[sent.times]) {
            sent.to.iter().for_each(|&to| self.places.send(to, &sent.packet));
            sent.times += 1;
        }
        again.retain(|sent| sent.times < AGAIN.len());
    }
}
