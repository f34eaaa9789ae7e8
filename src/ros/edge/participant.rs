//! The participant of a process, and the nodes in it.

use std::collections::BTreeSet;
use std::fmt;
use std::net::IpAddr;
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ros2_client::NodeName;
use ros2_client::builtin_topics::ros_discovery;
use ros2_client::dds::rustdds::no_key::{DataWriter, SimpleDataReader};
use ros2_client::dds::rustdds::{
    DomainParticipant, DomainParticipantBuilder, GUID, Publisher as DdsPublisher, QosPolicies,
    QosPolicyBuilder, RTPSEntity, Subscriber as DdsSubscriber, Topic, TopicKind,
};

use super::graph::{Beside, Graph, Watcher, prefix};
use super::outbox::{Outbox, Outlet};
use super::payload::{Payload, Verbatim};
use super::places::Places;
use super::pulse::{self, Pulse};
use super::whole::WholeReplies;
use super::{EdgeError, Publisher, Quality, Service, Subscription, farewell, names};
use crate::messages::names::{NameError, Names, check_full_name};
use crate::messages::{Message, ServiceType};

/// Where to take part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// `ROS_DOMAIN_ID`, 0 to 232. Default 0.
    pub domain: u16,
    /// Peers on this computer only. Default false.
    pub loopback_only: bool,
}

impl fmt::Display for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reach = if self.loopback_only { ", for peers on this computer alone" } else { "" };
        write!(f, "ROS domain {}{reach}", self.domain)
    }
}

pub(super) type Reader = SimpleDataReader<Payload, Verbatim>;
pub(super) type Writer = DataWriter<Payload, Verbatim>;

/// One DDS participant. Clones share it; it leaves the network when the last clone, node and endpoint
/// made from it is gone.
#[derive(Clone)]
pub struct Edge {
    shared: Arc<Shared>,
}

/// How long leaving the network may take \[s\].
const LEAVING: Duration = Duration::from_secs(3);

pub(super) struct Shared {
    // Fields drop in this order: the watcher holds the participant too.
    watcher: Option<Watcher>,
    pub outbox: Outbox,
    publisher: DdsPublisher,
    subscriber: DdsSubscriber,
    participant: Option<DomainParticipant>,
    guid: GUID,
    options: Options,
    /// Whether peers and their samples are authenticated; those of our own making are then not.
    pub is_secured: bool,
    pub graph: Arc<Graph>,
    beside: Option<Beside>,
    /// When a reader was last replaced.
    renewed: Mutex<Option<Instant>>,
}

/// Least time between two readers that take the place of others: each takes its time from the loop \[s\].
const BETWEEN_RENEWALS: Duration = Duration::from_millis(40);

impl Edge {
    /// Joins a domain, in the clear.
    ///
    /// # Errors
    /// A domain out of range, or a computer that gives no sockets.
    pub fn open(options: Options) -> Result<Self, EdgeError> {
        let refused = |reason: String| EdgeError::Participant { domain: options.domain, reason };
        let shared = Self::join(options, DomainParticipantBuilder::new(options.domain), false, &refused)?;
        Ok(Self { shared: Arc::new(shared) })
    }

    /// Joins a domain with the keys of an enclave.
    ///
    /// # Errors
    /// As [`Edge::open`], and keys, permissions or a governance that do not admit it to the domain.
    #[cfg(feature = "security")]
    pub fn open_in_enclave(options: Options, enclave: &std::path::Path) -> Result<Self, EdgeError> {
        use ros2_client::dds::rustdds::DomainParticipantSecurityConfigFiles as Files;
        let domain = options.domain;
        let refused = |reason: String| {
            let place = enclave.display().to_string();
            match is_forbidden(&reason) {
                true => EdgeError::Enclave { domain, place, reason },
                false => EdgeError::Participant { domain, reason },
            }
        };
        let files = Files::with_ros_default_names(enclave, String::new());
        let builder = DomainParticipantBuilder::new(domain).builtin_security(files);
        let shared = Self::join(options, builder, true, &refused)?;
        Ok(Self { shared: Arc::new(shared) })
    }

    fn join(
        options: Options,
        mut builder: DomainParticipantBuilder,
        is_secured: bool,
        refused: &dyn Fn(String) -> EdgeError,
    ) -> Result<Shared, EdgeError> {
        if options.domain > 232 {
            return Err(EdgeError::Domain { domain: options.domain });
        }
        super::loopback::warn_without_multicast(options.loopback_only);
        if options.loopback_only {
            builder = builder.with_only_networks([IpAddr::from([127, 0, 0, 1])]);
        }
        let before = super::door::sockets().unwrap_or_default();
        let participant = builder.build().map_err(|error| refused(error.to_string()))?;
        let secured = is_secured.then(|| prefix(participant.guid()));
        match super::door::guard(&before, options.loopback_only, secured) {
            Ok(_) => {}
            // Without the filter, packets that had to be excluded would enter.
            Err(error) if options.loopback_only => {
                return Err(refused(format!("the kernel cannot keep other computers out: {error}")));
            }
            Err(error) => {
                tracing::warn!("packets are not filtered before the middleware reads them: {error}")
            }
        }
        Shared::join(participant, options, is_secured).map_err(|error| refused(error.to_string()))
    }

    pub(super) fn with_participant<T>(
        &self,
        open: impl FnOnce(&Shared, &DomainParticipant) -> Result<T, EdgeError>,
    ) -> Result<T, EdgeError> {
        // It is taken out when the last of us is dropped.
        let closed =
            || EdgeError::Endpoint { topic: "participant".into(), reason: "the edge is closed".into() };
        open(&self.shared, self.shared.participant.as_ref().ok_or_else(closed)?)
    }

    /// A node of this participant.
    ///
    /// # Errors
    /// A namespace that is not `/` or a fully qualified name, or a name with other characters than
    /// letters, digits and underscores.
    pub fn node(&self, namespace: &str, name: &str) -> Result<Node, EdgeError> {
        let qualified = if namespace == "/" { format!("/{name}") } else { format!("{namespace}/{name}") };
        check_full_name("node name", &qualified)?;
        let names = Names::new(name, namespace, &[])?;
        let refused = |error| NameError {
            what: "node name",
            name: qualified.clone(),
            reason: format!("{error:?}"),
            help: "give another name",
        };
        let parsed = NodeName::new(namespace, name).map_err(refused)?;
        self.shared.graph.add_node(parsed);
        Ok(Node { shared: self.shared.clone(), name: qualified, names, commands: Mutex::default() })
    }

    /// A node of these names, whose rules its topics and services follow.
    ///
    /// # Errors
    /// As [`Edge::node`].
    pub(crate) fn named_node(&self, names: &Names) -> Result<Node, EdgeError> {
        let mut node = self.node(names.namespace(), names.node_name())?;
        node.names = names.clone();
        Ok(node)
    }
}

impl Shared {
    fn join(
        participant: DomainParticipant,
        options: Options,
        is_secured: bool,
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let plain = QosPolicyBuilder::new().build();
        let publisher = participant.create_publisher(&plain)?;
        let subscriber = participant.create_subscriber(&plain)?;
        let announcements = participant.create_topic(
            ros_discovery::TOPIC_NAME.into(),
            ros_discovery::TYPE_NAME.into(),
            &ros_discovery::QOS_PUB,
            TopicKind::NoKey,
        )?;
        let writer = publisher.create_datawriter_no_key_cdr(&announcements, None)?;
        // Participants that were here first have already announced themselves.
        let policies = Quality::transient_local(1).policies();
        let reader = subscriber.create_simple_datareader_no_key(&announcements, Some(policies))?;
        let graph = Arc::new(Graph::default());
        let guid = participant.guid();
        // What is not authenticated is not taken there.
        let places = (!is_secured).then(|| Places::open(guid, options.domain, options.loopback_only));
        let places = places.transpose().unwrap_or_else(|error| {
            tracing::warn!(
                "first calls of clients on Fast DDS may take 3 s, and large replies not arrive: {error}"
            );
            None
        });
        let beside = places.map(Arc::new).map(|places| Beside {
            replies: Arc::new(WholeReplies::new(places.clone(), graph.clone())),
            places,
        });
        let watcher = Watcher::start(graph.clone(), &participant, guid, writer, reader, beside.clone())?;
        Ok(Self {
            watcher: Some(watcher),
            outbox: Outbox::start()?,
            publisher,
            subscriber,
            participant: Some(participant),
            guid,
            options,
            is_secured,
            graph,
            beside,
            renewed: Mutex::default(),
        })
    }

    /// Whether another reader may be replaced now, which is then noted.
    pub fn may_renew(&self) -> bool {
        let mut renewed = self.renewed.lock().unwrap_or_else(PoisonError::into_inner);
        let may = renewed.is_none_or(|renewed| renewed.elapsed() > BETWEEN_RENEWALS);
        if may {
            *renewed = Some(Instant::now());
        }
        may
    }

    /// GUID of the participant.
    pub fn guid(&self) -> GUID {
        self.guid
    }

    /// Says that the participant has left; it may announce itself no more.
    pub fn say_farewell(&self) {
        let places = self.beside.as_ref().map(|beside| beside.places.discovery()).unwrap_or_default();
        farewell::send(prefix(self.guid), self.options.domain, self.options.loopback_only, &places);
    }

    fn topic(&self, name: &str, kind: &str, policies: &QosPolicies) -> Result<Topic, EdgeError> {
        let participant = self.participant.as_ref().ok_or_else(|| refused(name, "the edge is closed"))?;
        participant
            .create_topic(name.to_owned(), kind.to_owned(), policies, TopicKind::NoKey)
            .map_err(|error| refused(name, &error.to_string()))
    }

    pub fn reader(&self, topic: &str, kind: &str, quality: Quality) -> Result<Reader, EdgeError> {
        let policies = quality.policies();
        let dds = self.topic(topic, kind, &policies)?;
        patiently(|| self.subscriber.create_simple_datareader_no_key(&dds, Some(policies.clone())))
            .map_err(|error| refused(topic, &error.to_string()))
    }

    pub fn writer(&self, topic: &str, kind: &str, quality: Quality) -> Result<Writer, EdgeError> {
        let policies = quality.policies();
        let dds = self.topic(topic, kind, &policies)?;
        patiently(|| self.publisher.create_datawriter_no_key(&dds, Some(policies.clone())))
            .map_err(|error| refused(topic, &error.to_string()))
    }
}

/// An endpoint that RustDDS refused, with its reason.
fn refused(topic: &str, reason: &str) -> EdgeError {
    let (topic, reason) = (topic.to_owned(), reason.to_owned());
    match is_forbidden(&reason) {
        true => EdgeError::Forbidden { topic, reason },
        false => EdgeError::Endpoint { topic, reason },
    }
}

/// Whether keys, permissions or governance are the reason of an error of RustDDS, which has one kind of error for that.
fn is_forbidden(reason: &str) -> bool {
    reason.contains("Not allowed by security")
}

/// RustDDS hands new endpoints to a thread of its own through a channel of bounded length, and refuses those that it
/// does not hold: hundreds of robots in one process come faster than they are taken in.
fn patiently<T, E: std::fmt::Display>(mut create: impl FnMut() -> Result<T, E>) -> Result<T, E> {
    const ATTEMPTS: usize = 200;
    for _ in 1..ATTEMPTS {
        match create() {
            Err(error) if error.to_string().contains("full channel") => {
                std::thread::sleep(Duration::from_millis(10));
            }
            done => return done,
        }
    }
    create()
}

impl Drop for Shared {
    fn drop(&mut self) {
        self.watcher.take();
        self.outbox.close();
        let (done, finished) = channel();
        let participant = self.participant.take();
        // RustDDS joins its threads without a limit; ours is not kept by a thread of its that hangs.
        let left = std::thread::Builder::new().name("ros leave".into()).spawn(move || {
            drop(participant);
            let _ = done.send(());
        });
        if left.is_err() || finished.recv_timeout(LEAVING).is_err() {
            tracing::warn!("the DDS participant did not leave within {} s", LEAVING.as_secs());
        }
        // It announces itself no more.
        self.say_farewell();
    }
}

/// A ROS 2 node: a name under which endpoints are announced.
pub struct Node {
    shared: Arc<Shared>,
    name: String,
    names: Names,
    /// Topics on which the node itself publishes nothing.
    commands: Mutex<BTreeSet<String>>,
}

impl Node {
    /// Fully qualified name, e.g. `/swarm/flockform`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Name of its logger.
    pub fn logger(&self) -> String {
        self.names.logger()
    }

    /// Where it takes part.
    pub fn options(&self) -> Options {
        self.shared.options
    }

    /// Has a watchdog end the process when the middleware is dead or deaf: see [`pulse`].
    ///
    /// # Errors
    /// A computer that gives no socket or thread.
    pub fn watch(&self) -> Result<Arc<Pulse>, EdgeError> {
        Edge { shared: self.shared.clone() }.with_participant(pulse::start)
    }

    /// Other nodes of this name that others announce \[1\]. ROS 2 lets them all be, and each answers for all.
    pub fn twins(&self) -> usize {
        self.shared.graph.twins(&self.name)
    }

    /// Fully qualified name of a topic, by the node's rules: see [`Names::topic`].
    ///
    /// # Errors
    /// A name that ROS 2 does not allow.
    pub fn topic(&self, name: &str) -> Result<String, EdgeError> {
        Ok(self.names.topic(name)?)
    }

    /// Fully qualified name of a service of the node, `~/leaf`, by its rules.
    ///
    /// # Errors
    /// A name that ROS 2 does not allow.
    pub fn private(&self, leaf: &str) -> Result<String, EdgeError> {
        Ok(self.names.service(&format!("~/{leaf}"))?)
    }

    /// Another node of the same participant: see [`Edge::node`]. The two do not hear each other for certain:
    /// RustDDS carries even what stays in the process over the network's multicast.
    pub fn another_node(&self, namespace: &str, name: &str) -> Result<Node, EdgeError> {
        Edge { shared: self.shared.clone() }.node(namespace, name)
    }

    /// Refuses every publisher of this node on a topic from now on: it would command itself.
    pub(in crate::ros) fn keep_for_commands(&self, topic: &str) {
        self.commands.lock().unwrap_or_else(PoisonError::into_inner).insert(topic.to_owned());
    }

    /// A publisher on a fully qualified topic.
    ///
    /// # Errors
    /// A bad name, a topic that is kept for commands, or an endpoint that RustDDS refuses (the same topic with another type).
    pub fn publisher<M: Message>(&self, topic: &str, quality: Quality) -> Result<Publisher<M>, EdgeError> {
        check_full_name("topic name", topic)?;
        if self.commands.lock().unwrap_or_else(PoisonError::into_inner).contains(topic) {
            return Err(EdgeError::OwnCommands { topic: topic.to_owned(), kind: M::NAME });
        }
        let kind = names::dds_message(M::PACKAGE, M::NAME);
        let writer = self.shared.writer(&names::dds_topic(topic), &kind, quality)?;
        self.shared.graph.add_writer(&self.name, writer.guid(), topic);
        let outlet = Outlet::new(topic, writer, quality.depth, None);
        Ok(Publisher::new(topic.to_owned(), outlet, self.shared.clone()))
    }

    /// A subscription on a fully qualified topic.
    ///
    /// # Errors
    /// As [`Node::publisher`].
    pub fn subscription<M: Message>(
        &self,
        topic: &str,
        quality: Quality,
    ) -> Result<Subscription<M>, EdgeError> {
        check_full_name("topic name", topic)?;
        Subscription::open(&self.shared, &self.name, topic, quality)
    }

    /// A service under a fully qualified name.
    ///
    /// # Errors
    /// As [`Node::publisher`].
    pub fn service<S: ServiceType>(&self, name: &str) -> Result<Service<S>, EdgeError> {
        check_full_name("service name", name)?;
        let [requests, replies] = names::dds_service(name);
        let [request, response] = names::dds_service_types(S::PACKAGE, S::NAME);
        // Replies first: a client that sees the requests' reader may ask at once.
        let writer = self.shared.writer(&replies, &response, Service::<S>::QUALITY)?;
        let reader = self.shared.reader(&requests, &request, Service::<S>::QUALITY)?;
        self.shared.graph.add_writer(&self.name, writer.guid(), name);
        self.shared.graph.add_reader(&self.name, reader.guid(), name);
        let replies = self.shared.beside.as_ref().map(|beside| beside.replies.clone());
        let outlet = Outlet::new(name, writer, Service::<S>::QUALITY.depth, replies);
        Ok(Service::new(name.to_owned(), reader, outlet, self.shared.clone()))
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.shared.graph.remove_node(&self.name);
    }
}
