//! Participants that the tests share, and bounded waits.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use flockform::messages::builtin_interfaces::Time;
use flockform::messages::{Message, ServiceType};
use flockform::ros::edge::{Edge, Options, Publisher, Subscription};
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::qos::{History, WhenFull};
use ros2_client::{
    Client, Context, NodeName, NodeOptions, QosProfile, RmwRequestId, ServiceMapping, ServiceTypeName,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::waits::within;

/// Domain of this process, so that test runs side by side do not meet.
pub fn domain() -> u16 {
    100 + (std::process::id() % 101) as u16
}

pub struct Peers {
    /// The side under test.
    pub ours: Edge,
    /// Another process, as far as DDS is concerned.
    pub theirs: Edge,
    /// A peer with another implementation of nodes and services.
    pub foreign: ros2_client::Node,
    pub context: Context,
}

pub fn peers() -> MutexGuard<'static, Peers> {
    static PEERS: OnceLock<Mutex<Peers>> = OnceLock::new();
    let open = || {
        let options = Options { domain: domain(), loopback_only: true };
        let participant = DomainParticipantBuilder::new(domain())
            .with_only_networks([std::net::IpAddr::from([127, 0, 0, 1])])
            .build()
            .expect("sockets");
        let context = Context::from_domain_participant(participant).expect("a context");
        let name = NodeName::new("/", "foreign").expect("a name");
        let foreign = context.new_node(name, NodeOptions::new().enable_rosout(false)).expect("a node");
        let ours = Edge::open(options).expect("sockets");
        let theirs = Edge::open(options).expect("sockets");
        Mutex::new(Peers { ours, theirs, foreign, context })
    };
    PEERS.get_or_init(open).lock().unwrap_or_else(PoisonError::into_inner)
}

pub const PATIENCE: Duration = Duration::from_secs(10);

/// What `look` finds within ten seconds.
pub fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    within(PATIENCE, what, look)
}

/// Waits until a publisher and a subscription, each alone on its topic, see each other.
pub fn meet<M: Message>(publisher: &Publisher<M>, subscription: &Subscription<M>) {
    until("a match", || (publisher.matched() == 1 && subscription.matched() == 1).then_some(()));
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    pub stamp: Time,
    pub frame_id: String,
    pub position: [f64; 3],
    pub orientation: [f64; 4],
}

impl Message for PoseStamped {
    const PACKAGE: &str = "geometry_msgs";
    const NAME: &str = "PoseStamped";
}

pub fn pose(x: f64) -> PoseStamped {
    PoseStamped {
        stamp: Time { sec: 7, nanosec: 8 },
        frame_id: "map".into(),
        position: [x, 2.0, 3.0],
        orientation: [0.0, 0.0, 0.0, 1.0],
    }
}

/// A struct of ours as ros2-client wants it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Foreign<T>(T);

impl<T: Serialize + DeserializeOwned> ros2_client::Message for Foreign<T> {}

pub type ForeignClient<S> =
    Client<Foreign<<S as ServiceType>::Request>, Foreign<<S as ServiceType>::Response>>;

pub fn client<S: ServiceType>(peers: &mut Peers, mapping: ServiceMapping, name: &str) -> ForeignClient<S>
where
    S::Request: Clone,
{
    let qos = QosProfile::publisher_default()
        .reliability_reliable(WhenFull::DEFAULT)
        .history(History::KeepLast { depth: 10 });
    let (namespace, base) = name.rsplit_once('/').expect("fully qualified");
    let namespace = if namespace.is_empty() { "/" } else { namespace };
    let name = ros2_client::Name::new(namespace, base).expect("a name");
    peers
        .foreign
        .create_client(mapping, &name, &ServiceTypeName::new(S::PACKAGE, S::NAME), qos.clone(), qos)
        .expect("a client")
}

/// Asks, and asks again five times a second: a request sent before discovery is lost. `tick` serves.
pub fn call<S: ServiceType>(
    client: &ForeignClient<S>,
    request: &S::Request,
    tick: &mut dyn FnMut(),
) -> S::Response
where
    S::Request: Clone,
{
    let mut sent: Vec<(RmwRequestId, Instant)> = Vec::new();
    until("an answer", || {
        if sent.last().is_none_or(|(_, at)| at.elapsed() > Duration::from_millis(200)) {
            sent.push((client.send_request(Foreign(request.clone())).expect("sent"), Instant::now()));
        }
        tick();
        let answers = std::iter::from_fn(|| client.receive_response().ok().flatten());
        answers
            .into_iter()
            .find(|(id, _)| sent.iter().any(|(asked, _)| asked == id))
            .map(|(_, answer)| answer.0)
    })
}

pub const MAPPINGS: [ServiceMapping; 2] = [ServiceMapping::Enhanced, ServiceMapping::Cyclone];
