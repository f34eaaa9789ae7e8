//! The ROS graph: the remote endpoints that match ours, and the announcements of our nodes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use ros2_client::dds::rustdds::no_key::DataWriterCdr;
use ros2_client::dds::rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, DomainParticipantStatusListener, GUID, LostReason,
    StatusEvented, Timestamp,
};
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::{Gid, NodeName};

use super::nudge::Nudges;
use super::participant::Reader;
use super::places::Places;
use super::topic::{Taken, next};
use super::whole::WholeReplies;
use crate::messages::wire::decode;

/// How often the watcher looks \[s\]. Nodes announced within one look go out as one sample.
const LOOK: Duration = Duration::from_millis(20);

/// Looks from one sweep to the next \[1\]. Between them every endpoint that was being made gets its name.
const SWEEP: u32 = 250;

/// Announcements taken in one look \[1\].
const MOST_AT_ONCE: usize = 64;

/// First twelve bytes of a GUID: the participant.
pub(super) fn prefix(guid: GUID) -> [u8; 12] {
    let bytes = guid.to_bytes();
    std::array::from_fn(|i| bytes[i])
}

/// Which end of its participant this is.
pub(super) fn entity(guid: GUID) -> [u8; 4] {
    let bytes = guid.to_bytes();
    std::array::from_fn(|i| bytes[12 + i])
}

#[derive(Default)]
pub(super) struct Graph {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Local endpoint to the remote endpoints that match it.
    matched: BTreeMap<GUID, BTreeSet<GUID>>,
    /// Local endpoint to the participants that have matched it and are not lost without a word.
    met: BTreeMap<GUID, BTreeSet<[u8; 12]>>,
    /// Participants that were met, have taken leave and have not announced themselves since.
    left: BTreeSet<[u8; 12]>,
    /// Local endpoint to its ROS 2 name, for messages to people.
    names: BTreeMap<GUID, String>,
    /// Node's fully qualified name to what it owns.
    nodes: BTreeMap<String, Owned>,
    nodes_changed: bool,
    /// Matched local endpoints without a name when last swept: new, not of a node, or gone.
    nameless: BTreeSet<GUID>,
    /// Other participants' nodes that bear names of ours.
    twins: BTreeMap<[u8; 12], Vec<String>>,
}

struct Owned {
    name: NodeName,
    readers: Vec<GUID>,
    writers: Vec<GUID>,
}

impl Graph {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn add_node(&self, name: NodeName) {
        let mut state = self.state();
        let owned = Owned { name: name.clone(), readers: Vec::new(), writers: Vec::new() };
        state.nodes.insert(name.fully_qualified_name(), owned);
        state.nodes_changed = true;
    }

    pub fn remove_node(&self, node: &str) {
        let mut state = self.state();
        state.nodes.remove(node);
        state.nodes_changed = true;
    }

    pub fn add_reader(&self, node: &str, reader: GUID, name: &str) {
        self.add(node, reader, name, |owned| &mut owned.readers);
    }

    pub fn add_writer(&self, node: &str, writer: GUID, name: &str) {
        self.add(node, writer, name, |owned| &mut owned.writers);
    }

    /// Forgets a local endpoint that is gone.
    pub fn remove_endpoint(&self, endpoint: GUID) {
        let mut state = self.state();
        state.names.remove(&endpoint);
        state.matched.remove(&endpoint);
        state.met.remove(&endpoint);
        for owned in state.nodes.values_mut() {
            owned.readers.retain(|reader| *reader != endpoint);
            owned.writers.retain(|writer| *writer != endpoint);
        }
        state.nodes_changed = true;
    }

    fn add(&self, node: &str, endpoint: GUID, name: &str, list: fn(&mut Owned) -> &mut Vec<GUID>) {
        let mut state = self.state();
        state.names.insert(endpoint, name.to_owned());
        if let Some(owned) = state.nodes.get_mut(node) {
            list(owned).push(endpoint);
            state.nodes_changed = true;
        }
    }

    /// Remote endpoints that match a local one \[1\].
    pub fn matched(&self, local: GUID) -> usize {
        self.state().matched.get(&local).map_or(0, BTreeSet::len)
    }

    /// Prefixes of the participants whose endpoints match a local one.
    pub fn matched_participants(&self, local: GUID) -> Vec<[u8; 12]> {
        let state = self.state();
        let all: BTreeSet<_> = state.matched.get(&local).into_iter().flatten().copied().map(prefix).collect();
        all.into_iter().collect()
    }

    /// Whether some endpoint of that participant matches the local one.
    pub fn matches_participant(&self, local: GUID, participant: [u8; 12]) -> bool {
        self.state()
            .matched
            .get(&local)
            .is_some_and(|all| all.iter().any(|&guid| prefix(guid) == participant))
    }

    /// Whether all whom a local endpoint has met have taken leave; `None` of one that has met nobody.
    pub fn is_left(&self, local: GUID) -> Option<bool> {
        let state = self.state();
        let met = state.met.get(&local).filter(|met| !met.is_empty())?;
        Some(met.is_subset(&state.left))
    }

    /// Nodes of others that bear this name \[1\].
    pub fn twins(&self, node: &str) -> usize {
        self.state().twins.values().flatten().filter(|name| *name == node).count()
    }

    /// Takes the announcement of the nodes of another participant.
    fn receive(&self, info: &ParticipantEntitiesInfo, own: GUID) {
        let from: [u8; 12] = std::array::from_fn(|i| info.gid().to_bytes16()[i]);
        if from == prefix(own) {
            return;
        }
        let mut state = self.state();
        let names = info.nodes().iter().map(NodeEntitiesInfo::fully_qualified_name);
        let ours: Vec<String> = names.filter(|name| state.nodes.contains_key(name)).collect();
        let known = state.twins.get(&from).map_or(&[][..], |all| all);
        for name in ours.iter().filter(|name| !known.contains(name)) {
            tracing::error!(
                "another node is called {name}: both take its commands and both move its robots; end one of them, or \
                 give it robots of its own in another namespace (-r __ns:=/NAME): under another name alone it would move \
                 these robots all the same"
            );
        }
        match ours.is_empty() {
            true => state.twins.remove(&from),
            false => state.twins.insert(from, ours),
        };
    }

    fn note(&self, event: DomainParticipantStatusEvent) {
        use DomainParticipantStatusEvent as Event;
        let mut state = self.state();
        match event {
            Event::RemoteReaderMatched { local_writer: local, remote_reader: remote }
            | Event::RemoteWriterMatched { local_reader: local, remote_writer: remote } => {
                state.matched.entry(local).or_default().insert(remote);
                let State { met, left, .. } = &mut *state;
                let met = met.entry(local).or_default();
                // Of those that are gone none is asked for any more.
                met.retain(|one| !left.contains(one));
                met.insert(prefix(remote));
            }
            Event::ParticipantDiscovered { dpd } => {
                // A leave in its name was not its own.
                state.left.remove(&prefix(dpd.guid));
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                state.matched.values_mut().for_each(|all| {
                    all.remove(&guid);
                });
            }
            Event::ParticipantLost { id, reason } => {
                let gone: &[u8] = id.as_ref();
                match reason {
                    LostReason::Disposed => {
                        let of_ours = state.met.values().flatten().find(|one| &one[..] == gone).copied();
                        state.left.extend(of_ours);
                    }
                    LostReason::Timeout { .. } => {
                        state.met.values_mut().for_each(|met| met.retain(|one| &one[..] != gone));
                    }
                }
                state.matched.values_mut().for_each(|all| all.retain(|&guid| prefix(guid) != gone));
                state.twins.retain(|from, _| from != gone);
            }
            Event::RemoteReaderQosIncompatible { local_writer: local, .. }
            | Event::RemoteWriterQosIncompatible { local_reader: local, .. } => {
                if let Some(name) = state.names.get(&local) {
                    tracing::warn!(
                        "{name}: a peer asks for another quality of service (reliability, durability) than \
                         we offer, so nothing flows between us and it"
                    );
                }
            }
            _ => {}
        }
    }

    /// Forgets the matches of local endpoints that had no name at the last sweep either: a match that is read after its
    /// endpoint was removed would stay for ever.
    fn sweep(&self) {
        let mut state = self.state();
        let State { matched, met, left, names, nameless, .. } = &mut *state;
        matched.retain(|endpoint, _| names.contains_key(endpoint) || !nameless.contains(endpoint));
        met.retain(|endpoint, _| matched.contains_key(endpoint));
        left.retain(|one| met.values().any(|met| met.contains(one)));
        *nameless = matched.keys().filter(|endpoint| !names.contains_key(endpoint)).copied().collect();
    }

    /// Our nodes as `ros_discovery_info` wants them, if they changed since last asked.
    fn news(&self, participant: GUID, own_writer: GUID) -> Option<ParticipantEntitiesInfo> {
        let mut state = self.state();
        if !std::mem::take(&mut state.nodes_changed) {
            return None;
        }
        let nodes = state.nodes.values().map(|owned| {
            let mut info = NodeEntitiesInfo::new(owned.name.clone());
            owned.readers.iter().for_each(|&reader| info.add_reader(Gid::from(reader)));
            owned.writers.iter().for_each(|&writer| info.add_writer(Gid::from(writer)));
            info.add_writer(Gid::from(own_writer));
            info
        });
        Some(ParticipantEntitiesInfo::new(Gid::from(participant), nodes.collect()))
    }
}

/// What is sent beside RustDDS, in the clear.
#[derive(Clone)]
pub(super) struct Beside {
    pub places: Arc<Places>,
    pub replies: Arc<WholeReplies>,
}

/// The thread that watches; it ends when dropped.
pub(super) struct Watcher {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watcher {
    pub fn start(
        graph: Arc<Graph>,
        participant: &DomainParticipant,
        guid: GUID,
        writer: DataWriterCdr<ParticipantEntitiesInfo>,
        reader: Reader,
        beside: Option<Beside>,
    ) -> std::io::Result<Self> {
        let (stop, stopped) = channel();
        let listener = participant.status_listener();
        let thread = std::thread::Builder::new()
            .name("ros graph".into())
            .spawn(move || watch(&graph, &listener, guid, &writer, &reader, beside.as_ref(), &stopped))?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.stop.take();
        if let Some(thread) = self.thread.take() {
            // It wakes within one look; what it panicked with has been printed.
            let _ = thread.join();
        }
    }
}

/// Our reader and the writer of another that have found each other.
fn writer_matched(event: &DomainParticipantStatusEvent) -> Option<(GUID, GUID)> {
    match event {
        DomainParticipantStatusEvent::RemoteWriterMatched { local_reader, remote_writer } => {
            Some((*local_reader, *remote_writer))
        }
        _ => None,
    }
}

fn watch(
    graph: &Graph,
    listener: &DomainParticipantStatusListener,
    guid: GUID,
    writer: &DataWriterCdr<ParticipantEntitiesInfo>,
    reader: &Reader,
    beside: Option<&Beside>,
    stopped: &Receiver<()>,
) {
    use ros2_client::dds::rustdds::RTPSEntity;
    let mut look = 0_u32;
    let mut nudges = Nudges::default();
    while stopped.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
        look = look.wrapping_add(1);
        if look.is_multiple_of(SWEEP) {
            graph.sweep();
        }
        if let Some(beside) = beside {
            beside.places.listen();
            beside.replies.repeat();
            nudges.repeat(&beside.places);
        }
        // As many as RustDDS keeps for us.
        for event in std::iter::from_fn(|| listener.try_recv_status()).take(2048) {
            if let (Some(beside), Some((reader, writer))) = (beside, writer_matched(&event)) {
                nudges.ask(&beside.places, reader, writer);
            }
            graph.note(event);
        }
        for _ in 0..MOST_AT_ONCE {
            let payload = match next(reader) {
                Taken::Nothing => break,
                Taken::Unreadable => continue,
                Taken::Sample(sample) => sample.payload,
            };
            // An unreadable announcement names no twin of ours.
            if let Ok(info) = decode::<ParticipantEntitiesInfo>(&payload.bytes, payload.order) {
                graph.receive(&info, guid);
            }
        }
        if let Some(news) = graph.news(guid, writer.guid())
            && let Err(error) = writer.write(news, Some(Timestamp::now()))
        {
            tracing::warn!("our nodes could not be announced: {error:?}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_match_without_a_name_is_forgotten_at_the_second_sweep() {
        let graph = Graph::default();
        let [named, gone] = [1, 2].map(|k| GUID::from_bytes([k; 16]));
        for local in [named, gone] {
            graph.state().matched.entry(local).or_default().insert(GUID::from_bytes([9; 16]));
        }
        graph.sweep();
        assert_eq!(graph.matched(named), 1, "it may get its name yet");
        graph.add_reader("/node", named, "/pose");
        graph.sweep();
        assert_eq!([graph.matched(named), graph.matched(gone)], [1, 0]);
    }

    #[test]
    fn who_takes_leave_is_not_silent_who_is_lost_is_and_so_is_one_in_whose_name_another_took_leave() {
        use DomainParticipantStatusEvent as Event;
        let graph = Graph::default();
        let local_reader = GUID::from_bytes([1; 16]);
        let [first, second] = [2, 3].map(|k| GUID::from_bytes([k; 16]));
        let meet = |remote_writer| graph.note(Event::RemoteWriterMatched { local_reader, remote_writer });
        let lose = |guid: GUID, reason| graph.note(Event::ParticipantLost { id: guid.prefix, reason });
        let timeout = || LostReason::Timeout { lease: Duration::ZERO.into(), elapsed: Duration::ZERO.into() };
        assert_eq!(graph.is_left(local_reader), None, "it has met nobody");
        lose(first, LostReason::Disposed);
        meet(first);
        meet(second);
        assert_eq!(graph.is_left(local_reader), Some(false));
        lose(first, LostReason::Disposed);
        assert_eq!(graph.is_left(local_reader), Some(false), "one of two");
        lose(second, timeout());
        assert_eq!(graph.is_left(local_reader), Some(true), "the other is lost, and who is there has left");
        meet(second);
        assert_eq!(graph.is_left(local_reader), Some(false));
        lose(second, timeout());
        assert_eq!(graph.is_left(local_reader), None, "no leave");
    }
}
