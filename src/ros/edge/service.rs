//! Services that answer peers of either kind.
//!
//! ROS 2 has two ways to say which request a reply belongs to, and a peer understands only its own. On
//! Fast DDS the identity of the request travels beside the payload (the *enhanced* mapping of OMG's RPC
//! over DDS); on Cyclone DDS it stands in the payload, 16 bytes before the request: half the client's GUID
//! and a sequence number. Topics and types have the same names, so requests of both kinds arrive at one
//! reader. Each is recognized by its own marks and answered in its own way: no setting is needed.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ros2_client::RmwRequestId;
use ros2_client::dds::rustdds::rpc::SampleIdentity;
use ros2_client::dds::rustdds::{GUID, SequenceNumber, Timestamp, WriteOptionsBuilder};

use super::graph::prefix;
use super::outbox::Outlet;
use super::participant::{Reader, Shared};
use super::payload::Payload;
use super::topic::{Refused, Taken, next};
use super::whole::LARGEST;
use super::{EdgeError, Quality};
use crate::messages::ServiceType;
use crate::messages::wire::{BadPayload, Order, decode, encode};
use crate::swarm::pace::system_time;

/// Bytes before a request or reply of Cyclone DDS.
const HEADER: usize = 16;

/// How long a request waits until the client's reader of replies is known \[s\]. A client may ask before we
/// have seen where to answer, and a reply sent then is lost.
const PATIENCE: Duration = Duration::from_secs(1);

/// Samples looked at and requests answered in one call.
const MOST_AT_ONCE: usize = 256;

/// Which request a reply answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RequestId(Mark);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Mark {
    /// Beside the payload.
    Enhanced(RmwRequestId),
    /// In the payload, little endian, to be sent back as it came.
    Cyclone([u8; HEADER]),
}

/// A service's server.
pub struct Service<S: ServiceType> {
    name: String,
    reader: Reader,
    outlet: Arc<Outlet>,
    shared: Arc<Shared>,
    waiting: RefCell<VecDeque<Waiting<S::Request>>>,
    refused: Refused,
    /// Time before which no request counts, by the clock of the system \[s\].
    from: Option<f64>,
    kind: PhantomData<S>,
}

struct Waiting<Request> {
    since: Instant,
    client: [u8; 12],
    id: RequestId,
    request: Request,
}

impl<S: ServiceType> Service<S> {
    /// The quality of ROS 2 services: every sample counts, none is kept for late joiners.
    pub(crate) const QUALITY: Quality = Quality::reliable(10);

    pub(super) fn new(name: String, reader: Reader, outlet: Arc<Outlet>, shared: Arc<Shared>) -> Self {
        let waiting = RefCell::new(VecDeque::new());
        Self {
            name,
            reader,
            outlet,
            shared,
            waiting,
            refused: Refused::default(),
            from: None,
            kind: PhantomData,
        }
    }

    /// Refuses what was sent before now. A client keeps what a server that died has not acknowledged, and sends it to the next one,
    /// which would do again what was done long ago.
    #[must_use]
    pub fn from_now_on(self) -> Self {
        Self { from: Some(system_time()), ..self }
    }

    /// The next request and its client, or none. Payloads that are no request are skipped and counted.
    pub fn take(&self) -> Option<(RequestId, S::Request)> {
        self.receive();
        let mut waiting = self.waiting.borrow_mut();
        let ready = waiting.iter().position(|asked| {
            asked.client == prefix(self.shared.guid())
                || self.shared.graph.matches_participant(self.outlet.guid(), asked.client)
                || asked.since.elapsed() > PATIENCE
        })?;
        waiting.remove(ready).map(|asked| (asked.id, asked.request))
    }

    fn receive(&self) {
        let refuse = |reason: &str| self.refused.note(&self.name, "request", reason);
        for _ in 0..MOST_AT_ONCE {
            let sample = match next(&self.reader) {
                Taken::Nothing => return,
                Taken::Unreadable => {
                    refuse("an encoding other than plain CDR");
                    continue;
                }
                Taken::Sample(sample) => sample,
            };
            let before = self.from.zip(sample.stamps.sent).map_or(0.0, |(from, sent)| from - sent);
            if before > 0.0 {
                refuse(&format!(
                    "it was sent {before:.1} s before this server began, to an earlier one or by a clock that is behind"
                ));
                continue;
            }
            match read::<S::Request>(&sample.payload, sample.identity, sample.related) {
                Ok((id, request)) => {
                    let client = prefix(GUID::from(sample.identity.writer_gid));
                    let asked = Waiting { since: Instant::now(), client, id, request };
                    self.waiting.borrow_mut().push_back(asked);
                }
                Err(error) => refuse(&error.to_string()),
            }
        }
    }

    /// Answers a request, without waiting.
    ///
    /// # Errors
    /// Failures of earlier replies: clients that have not acknowledged for long, a middleware that takes none.
    pub fn reply(&self, id: &RequestId, response: &S::Response) -> Result<(), EdgeError> {
        let refused = |reason: String| EdgeError::Send { topic: self.name.clone(), reason };
        let options = WriteOptionsBuilder::new().source_timestamp(Timestamp::now());
        let mut bytes = Vec::new();
        let mut body = Vec::new();
        encode(response, &mut body).map_err(refused)?;
        let options = match &id.0 {
            // In pieces no reader takes it, and a client that was sent such pieces takes no later reply either.
            Mark::Enhanced(_) if body.len() > LARGEST => {
                let length = body.len();
                return Err(refused(format!(
                    "a reply of {length} bytes is longer than a packet holds: ask for less at once"
                )));
            }
            Mark::Enhanced(identity) => options.related_sample_identity(SampleIdentity::from(*identity)),
            Mark::Cyclone(header) => {
                bytes.extend_from_slice(header);
                options
            }
        };
        // The header is as long as the widest alignment, twice: what follows is aligned as if it stood alone.
        bytes.append(&mut body);
        let payload = Payload { order: Order::Little, bytes };
        self.shared.outbox.post(&self.outlet, payload, options.build())
    }

    /// Answers the requests that wait, without waiting. A reply that cannot be sent is logged.
    pub fn serve(&self, mut answer: impl FnMut(S::Request) -> S::Response) {
        for _ in 0..MOST_AT_ONCE {
            let Some((id, request)) = self.take() else { return };
            if let Err(error) = self.reply(&id, &answer(request)) {
                tracing::warn!("{error}");
            }
        }
    }

    /// Requests refused since the beginning \[1\].
    pub fn refused(&self) -> u64 {
        self.refused.count()
    }

    /// Clients elsewhere that can ask and be answered \[1\].
    pub fn matched(&self) -> usize {
        let graph = &self.shared.graph;
        graph.matched(self.reader.guid()).min(graph.matched(self.outlet.guid()))
    }

    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Reads a request in the way its sender wrote it.
fn read<Request: serde::de::DeserializeOwned>(
    payload: &Payload,
    identity: RmwRequestId,
    related: Option<RmwRequestId>,
) -> Result<(RequestId, Request), BadPayload> {
    let mark = mark::<Request>(payload, identity, related)?;
    let body = match mark {
        Mark::Enhanced(_) => &payload.bytes[..],
        Mark::Cyclone(_) => &payload.bytes[HEADER..],
    };
    Ok((RequestId(mark), decode(body, payload.order)?))
}

/// Vendor number of Eclipse Cyclone DDS; every DDS puts its own at the head of its GUIDs.
const CYCLONE: [u8; 2] = [0x01, 0x10];

fn mark<Request>(
    payload: &Payload,
    identity: RmwRequestId,
    related: Option<RmwRequestId>,
) -> Result<Mark, BadPayload> {
    let header = payload.bytes.first_chunk::<HEADER>().map(|bytes| little(*bytes, payload.order));
    let vendor = identity.writer_gid.as_bytes()[..2] == CYCLONE;
    let same = header.zip(related).is_some_and(|(header, related)| repeats(&header, related));
    match header {
        Some(header) if vendor || same => Ok(Mark::Cyclone(header)),
        None if vendor => Err(BadPayload {
            kind: std::any::type_name::<Request>(),
            length: payload.bytes.len(),
            reason: format!("a request of Cyclone DDS begins with {HEADER} bytes of identity"),
        }),
        _ => {
            let mut id = related.unwrap_or(identity);
            // Fast DDS names the reader of the reply and leaves the number to the sample.
            if id.sequence_number == i64::from(SequenceNumber::UNKNOWN) {
                id.sequence_number = identity.sequence_number;
            }
            Ok(Mark::Enhanced(id))
        }
    }
}

/// The header's two words in little endian.
fn little(mut header: [u8; HEADER], order: Order) -> [u8; HEADER] {
    if order == Order::Big {
        header[..8].reverse();
        header[8..].reverse();
    }
    header
}

/// Whether a header says the same as the identity beside the payload. Clients of ros2-client that play
/// Cyclone send both, the number's two halves the other way round.
fn repeats(header: &[u8; HEADER], related: RmwRequestId) -> bool {
    let [number_low, number_high] = [8, 12].map(|at| {
        u64::from(u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]))
    });
    let number = related.sequence_number.cast_unsigned();
    header[..8] == related.writer_gid.to_bytes16()[8..]
        && (number == number_high << 32 | number_low || number == number_low << 32 | number_high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ros2_client::Gid;

    const FAST: [u8; 2] = [0x01, 0x0f];
    const RUST: [u8; 2] = [0x01, 0x12];

    fn identity(vendor: [u8; 2], number: i64) -> RmwRequestId {
        let mut bytes: [u8; 16] = std::array::from_fn(|i| i as u8 + 0x40);
        bytes[..2].copy_from_slice(&vendor);
        RmwRequestId { writer_gid: Gid::from(bytes), sequence_number: number }
    }

    fn little_endian(bytes: Vec<u8>) -> Payload {
        Payload { order: Order::Little, bytes }
    }

    #[test]
    fn a_request_of_cyclone_carries_its_identity_in_the_payload() {
        let mut bytes: Vec<u8> = (0..16).collect();
        bytes.extend(7_u64.to_le_bytes());
        let (id, request) = read::<u64>(&little_endian(bytes), identity(CYCLONE, 1), None).expect("readable");
        assert_eq!(id, RequestId(Mark::Cyclone(std::array::from_fn(|i| i as u8))));
        assert_eq!(request, 7);
    }

    #[test]
    fn a_big_endian_header_goes_back_in_the_replys_order() {
        let mut bytes: Vec<u8> = 5_u64.to_be_bytes().into();
        bytes.extend(6_i64.to_be_bytes());
        bytes.extend(7_u64.to_be_bytes());
        let payload = Payload { order: Order::Big, bytes };
        let (id, request) = read::<u64>(&payload, identity(CYCLONE, 1), None).expect("readable");
        let mut expected = [0; HEADER];
        expected[0] = 5;
        expected[8] = 6;
        assert_eq!(id, RequestId(Mark::Cyclone(expected)));
        assert_eq!(request, 7);
    }

    #[test]
    fn a_short_request_of_cyclone_is_refused() {
        assert!(read::<u8>(&little_endian(vec![0; 15]), identity(CYCLONE, 1), None).is_err());
    }

    #[test]
    fn a_request_of_fast_dds_is_answered_to_the_reader_it_names() {
        let named = RmwRequestId { sequence_number: i64::from(SequenceNumber::UNKNOWN), ..identity(FAST, 0) };
        let payload = little_endian(7_u64.to_le_bytes().into());
        let (id, request) = read::<u64>(&payload, identity(FAST, 3), Some(named)).expect("readable");
        assert_eq!(id, RequestId(Mark::Enhanced(RmwRequestId { sequence_number: 3, ..named })));
        assert_eq!(request, 7);
    }

    #[test]
    fn a_reply_that_no_packet_holds_is_not_sent_in_pieces_that_silence_a_client() {
        use crate::messages::std_srvs::{Outcome, Trigger};
        let domain = 100 + (std::process::id() % 101) as u16;
        let options = crate::ros::edge::Options { domain, loopback_only: true };
        let edge = crate::ros::edge::Edge::open(options).expect("sockets");
        let node = edge.node("/", "replies").expect("a node");
        let service = node.service::<Trigger>("/replies/at_length").expect("a service");
        let reply = |mark: Mark, length: usize| {
            service.reply(&RequestId(mark), &Outcome { success: true, message: "x".repeat(length) })
        };
        let enhanced = || Mark::Enhanced(identity(FAST, 3));
        assert_eq!(reply(enhanced(), 60_000), Ok(()));
        let refused = reply(enhanced(), 65_000).expect_err("too long").to_string();
        assert!(refused.contains("/replies/at_length") && refused.contains("ask for less"), "{refused}");
        assert_eq!(reply(Mark::Cyclone([0; HEADER]), 65_000), Ok(()));
    }

    /// As clients send what a server that died has not acknowledged.
    #[test]
    fn what_was_asked_before_a_service_began_is_refused_where_it_changes_something() {
        use crate::messages::std_srvs::Trigger;
        let domain = 100 + (std::process::id() % 101) as u16;
        let options = crate::ros::edge::Options { domain, loopback_only: true };
        let [ours, theirs] = [(); 2].map(|()| crate::ros::edge::Edge::open(options).expect("sockets"));
        let [ours, theirs] =
            [(&ours, "ours"), (&theirs, "theirs")].map(|(edge, name)| edge.node("/", name).expect("a node"));
        let reads = ours.service::<Trigger>("/asked/to_read").expect("a service");
        let changes = ours.service::<Trigger>("/asked/to_change").expect("a service").from_now_on();
        let shared = theirs.service::<Trigger>("/asked/nothing").expect("a service").shared;
        let client = |of: &Service<Trigger>| {
            let [requests, _] = crate::ros::edge::names::dds_service(of.name());
            let [kind, _] = crate::ros::edge::names::dds_service_types(Trigger::PACKAGE, Trigger::NAME);
            let writer = shared.writer(&requests, &kind, Service::<Trigger>::QUALITY).expect("a writer");
            Outlet::new(of.name(), writer, 10, None)
        };
        let ask = |client: &Arc<Outlet>, ago: u64| {
            let mut bytes = Vec::new();
            encode(&<Trigger as ServiceType>::Request::default(), &mut bytes).expect("encodes");
            let sent = Timestamp::from_ticks(Timestamp::now().to_ticks() - (ago << 32));
            let options = WriteOptionsBuilder::new().source_timestamp(sent).build();
            shared.outbox.post(client, Payload { order: Order::Little, bytes }, options).expect("sent");
        };
        for (service, is_done) in [(&reads, true), (&changes, false)] {
            let client = client(service);
            let since = Instant::now();
            let mut done = 0;
            while done == 0 && service.refused() == 0 {
                assert!(since.elapsed() < Duration::from_secs(20), "{}: nothing came", service.name());
                ask(&client, 60);
                std::thread::sleep(Duration::from_millis(50));
                done += usize::from(service.take().is_some());
            }
            assert_eq!(done > 0, is_done, "{}", service.name());
            ask(&client, 0);
            let since = Instant::now();
            while service.take().is_none() {
                assert!(since.elapsed() < Duration::from_secs(20), "{}: a new one is taken", service.name());
                std::thread::sleep(Duration::from_millis(50));
            }
        }
    }

    #[test]
    fn a_request_that_names_no_reader_is_answered_to_its_writer() {
        let payload = little_endian(vec![0; 32]);
        let (id, _) = read::<u64>(&payload, identity(RUST, 3), None).expect("readable");
        assert_eq!(id, RequestId(Mark::Enhanced(identity(RUST, 3))));
    }

    #[test]
    fn a_client_that_plays_cyclone_is_known_by_saying_its_identity_twice() {
        for halves in [[0_u32, 9], [9, 0]] {
            let client = identity(RUST, 9);
            let mut bytes = client.writer_gid.to_bytes16()[8..].to_vec();
            halves.iter().for_each(|half| bytes.extend(half.to_le_bytes()));
            bytes.extend(7_u64.to_le_bytes());
            let payload = little_endian(bytes);
            let (id, request) = read::<u64>(&payload, identity(RUST, 2), Some(client)).expect("readable");
            assert!(matches!(id, RequestId(Mark::Cyclone(_))));
            assert_eq!(request, 7);
            // Another number beside the payload: not the same identity, so no header.
            let other = RmwRequestId { sequence_number: 8, ..client };
            let (id, _) = read::<u64>(&payload, identity(RUST, 2), Some(other)).expect("readable");
            assert!(matches!(id, RequestId(Mark::Enhanced(_))));
        }
    }
}
