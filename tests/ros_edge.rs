//! The edge on loopback: two participants of ours in one process, and ros2-client as the foreign peer.
//!
//! The tests share the participants and take turns: DDS discovery is slow on a busy computer, and each
//! participant costs sockets and threads. Every wait is bounded.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use flockform::ros::edge::clock::Clock;
use flockform::ros::edge::lifecycle::{Goal, Lifecycle, Outcome, State};
use flockform::ros::edge::parameters::{Change, Declaration, Parameters, Store, Value};
use flockform::ros::edge::services::{Empty, Time, lifecycle_msgs, rcl_interfaces, rosgraph_msgs, std_srvs};
use flockform::ros::edge::{
    Edge, EdgeError, Message, Node, Options, Publisher, Quality, ServiceType, Subscription,
};
use ros2_client::builtin_topics::ros_discovery;
use ros2_client::dds::rustdds::policy::Durability;
use ros2_client::dds::rustdds::{self, DomainParticipantBuilder, QosPolicyBuilder, TopicKind};
use ros2_client::qos::{History, WhenFull};
use ros2_client::{
    Client, Context, NodeName, NodeOptions, QosProfile, RmwRequestId, ServiceMapping, ServiceTypeName,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Domain of this process, so that test runs side by side do not meet.
fn domain() -> u16 {
    100 + (std::process::id() % 101) as u16
}

struct Peers {
    /// The side under test.
    ours: Edge,
    /// Another process, as far as DDS is concerned.
    theirs: Edge,
    /// A peer with another implementation of nodes and services.
    foreign: ros2_client::Node,
    context: Context,
}

fn peers() -> MutexGuard<'static, Peers> {
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

const PATIENCE: Duration = Duration::from_secs(10);

/// What `look` finds within ten seconds.
fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let since = Instant::now();
    while since.elapsed() < PATIENCE {
        if let Some(found) = look() {
            return found;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    panic!("{what}: not within {PATIENCE:?}");
}

/// Waits until a publisher and a subscription, each alone on its topic, see each other.
fn meet<M: Message>(publisher: &Publisher<M>, subscription: &Subscription<M>) {
    until("a match", || (publisher.matched() == 1 && subscription.matched() == 1).then_some(()));
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct PoseStamped {
    stamp: Time,
    frame_id: String,
    position: [f64; 3],
    orientation: [f64; 4],
}

impl Message for PoseStamped {
    const PACKAGE: &str = "geometry_msgs";
    const NAME: &str = "PoseStamped";
}

fn pose(x: f64) -> PoseStamped {
    PoseStamped {
        stamp: Time { sec: 7, nanosec: 8 },
        frame_id: "map".into(),
        position: [x, 2.0, 3.0],
        orientation: [0.0, 0.0, 0.0, 1.0],
    }
}

#[test]
fn poses_go_in_and_targets_go_out() {
    let peers = peers();
    let node = peers.ours.node("/", "swarm").expect("a node");
    let robot = peers.theirs.node("/robot_1", "driver").expect("a node");
    let poses_in = node.subscription::<PoseStamped>("/robot_1/pose", Quality::BEST_EFFORT).expect("in");
    let targets_out = node.publisher("/robot_1/target_pose", Quality::reliable(10)).expect("out");
    let poses_out = robot.publisher("/robot_1/pose", Quality::BEST_EFFORT).expect("out");
    let targets_in =
        robot.subscription::<PoseStamped>("/robot_1/target_pose", Quality::reliable(10)).expect("in");
    meet(&poses_out, &poses_in);
    meet(&targets_out, &targets_in);

    assert_eq!(poses_in.take(), None, "nothing was sent");
    poses_out.publish(&pose(1.5)).expect("sent");
    let (came, stamps) = until("a pose", || poses_in.take());
    assert_eq!(came, pose(1.5));
    let sent = stamps.sent.expect("stamped");
    assert!((0.0..10.0).contains(&(stamps.received - sent)), "{stamps:?}");

    for x in [1.0, 2.0, 3.0] {
        targets_out.publish(&pose(x)).expect("sent");
    }
    for x in [1.0, 2.0, 3.0] {
        assert_eq!(until("a target", || targets_in.take()).0, pose(x));
    }
    // The newest alone, once all have come.
    for x in [4.0, 5.0] {
        poses_out.publish(&pose(x)).expect("sent");
    }
    until("the last pose", || poses_in.take_last().filter(|(pose, _)| pose.position[0] == 5.0));
    assert_eq!(poses_in.take(), None);
}

/// What `ros2 node list` and `ros2 node info` go by.
#[test]
fn nodes_of_one_participant_are_announced_each_with_what_it_owns() {
    let peers = peers();
    let one = peers.ours.node("/swarm", "one").expect("a node");
    let two = one.another_node("/swarm", "two").expect("a node");
    assert_eq!(two.name(), "/swarm/two");
    assert_eq!(two.private("get_state"), "/swarm/two/get_state");
    let _out = one.publisher::<PoseStamped>("/announced", Quality::BEST_EFFORT).expect("out");
    let _in = two.subscription::<PoseStamped>("/announced", Quality::BEST_EFFORT).expect("in");
    let _service = two.service::<std_srvs::Trigger>("/swarm/two/stop").expect("a service");

    let participant = peers.context.domain_participant();
    let topic = participant
        .create_topic(
            ros_discovery::TOPIC_NAME.into(),
            ros_discovery::TYPE_NAME.into(),
            &ros_discovery::QOS_PUB,
            TopicKind::NoKey,
        )
        .expect("a topic");
    // Every participant announces on this topic: the last sample alone would be anyone's.
    let every = QosPolicyBuilder::new()
        .durability(Durability::TransientLocal)
        .reliable(rustdds::Duration::ZERO)
        .history(rustdds::policy::History::KeepAll)
        .build();
    let mut reader = participant
        .create_subscriber(&ros_discovery::QOS_PUB)
        .expect("a subscriber")
        .create_datareader_no_key_cdr::<Announcement>(&topic, Some(every))
        .expect("a reader");
    // Node: its readers and writers, the writer of the announcement itself included.
    let owned = |nodes: &[AnnouncedNode], name: &str| {
        let node = nodes.iter().find(|node| node.namespace == "/swarm" && node.name == name)?;
        Some([node.readers.len(), node.writers.len()])
    };
    until("both nodes", || {
        let nodes = reader.take_next_sample().ok()??.into_value().nodes;
        (owned(&nodes, "one")? == [0, 2] && owned(&nodes, "two")? == [2, 2]).then_some(())
    });
    drop(two);
    until("one node", || {
        let nodes = reader.take_next_sample().ok()??.into_value().nodes;
        (owned(&nodes, "one")? == [0, 2] && owned(&nodes, "two").is_none()).then_some(())
    });
}

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`.
#[derive(Debug, Serialize, Deserialize)]
struct Announcement {
    participant: [u8; 16],
    nodes: Vec<AnnouncedNode>,
}

/// `rmw_dds_common/msg/NodeEntitiesInfo`.
#[derive(Debug, Serialize, Deserialize)]
struct AnnouncedNode {
    namespace: String,
    name: String,
    readers: Vec<[u8; 16]>,
    writers: Vec<[u8; 16]>,
}

/// Goes by the name of a pose and is none.
#[derive(Serialize, Deserialize)]
struct Lie([u8; 3]);

impl Message for Lie {
    const PACKAGE: &str = PoseStamped::PACKAGE;
    const NAME: &str = PoseStamped::NAME;
}

#[test]
fn payloads_that_lie_are_counted_and_skipped() {
    let peers = peers();
    let node = peers.ours.node("/", "listener").expect("a node");
    let liar = peers.theirs.node("/", "liar").expect("a node");
    let come = node.subscription::<PoseStamped>("/lies", Quality::reliable(10)).expect("in");
    let lies = liar.publisher("/lies", Quality::reliable(10)).expect("out");
    let truths = liar.publisher("/lies", Quality::reliable(10)).expect("out");
    until("a match", || (come.matched() == 2 && lies.matched() == 1 && truths.matched() == 1).then_some(()));
    lies.publish(&Lie([1, 2, 3])).expect("sent");
    until("a refusal", || {
        assert_eq!(come.take(), None);
        (come.refused() == 1).then_some(())
    });
    truths.publish(&pose(1.0)).expect("sent");
    assert_eq!(until("the truth", || come.take()).0, pose(1.0));
}

#[test]
fn who_comes_late_gets_what_was_kept() {
    let peers = peers();
    let node = peers.ours.node("/", "early").expect("a node");
    let kept = node.publisher("/kept", Quality::transient_local(1)).expect("out");
    kept.publish(&pose(9.0)).expect("sent");
    let late = peers.theirs.node("/", "late").expect("a node");
    let come = late.subscription::<PoseStamped>("/kept", Quality::transient_local(1)).expect("in");
    assert_eq!(until("what was kept", || come.take()).0, pose(9.0));
}

#[test]
fn a_participant_that_leaves_is_missed_at_once() {
    let peers = peers();
    let node = peers.ours.node("/", "stays").expect("a node");
    let out = node.publisher::<PoseStamped>("/leaving", Quality::BEST_EFFORT).expect("out");
    let guest = Edge::open(Options { domain: domain(), loopback_only: true }).expect("sockets");
    let visitor = guest.node("/", "leaves").expect("a node");
    let come = visitor.subscription::<PoseStamped>("/leaving", Quality::BEST_EFFORT).expect("in");
    meet(&out, &come);
    let since = Instant::now();
    drop((come, visitor, guest));
    assert!(since.elapsed() < PATIENCE, "{:?}", since.elapsed());
    until("its absence", || (out.matched() == 0).then_some(()));
}

#[test]
fn names_and_domains_out_of_range_are_refused() {
    let refused = Edge::open(Options { domain: 233, loopback_only: true }).err();
    assert_eq!(refused, Some(EdgeError::Domain { domain: 233 }));
    let peers = peers();
    assert!(matches!(peers.ours.node("/", "a b").err(), Some(EdgeError::Name { .. })));
    assert!(matches!(peers.ours.node("relative", "a").err(), Some(EdgeError::Name { .. })));
    let node = peers.ours.node("/", "names").expect("a node");
    let relative = node.publisher::<PoseStamped>("relative", Quality::BEST_EFFORT).err();
    assert!(matches!(relative, Some(EdgeError::Name { .. })));
}

/// A struct of ours as ros2-client wants it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
struct Foreign<T>(T);

impl<T: Serialize + DeserializeOwned> ros2_client::Message for Foreign<T> {}

type ForeignClient<S> = Client<Foreign<<S as ServiceType>::Request>, Foreign<<S as ServiceType>::Response>>;

fn client<S: ServiceType>(peers: &mut Peers, mapping: ServiceMapping, name: &str) -> ForeignClient<S>
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

/// Asks, and asks again every two seconds: a request sent before discovery is lost. `tick` serves.
fn call<S: ServiceType>(
    client: &ForeignClient<S>,
    request: &S::Request,
    tick: &mut dyn FnMut(),
) -> S::Response
where
    S::Request: Clone,
{
    let mut sent: Vec<(RmwRequestId, Instant)> = Vec::new();
    until("an answer", || {
        if sent.last().is_none_or(|(_, at)| at.elapsed() > Duration::from_secs(2)) {
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

const MAPPINGS: [ServiceMapping; 2] = [ServiceMapping::Enhanced, ServiceMapping::Cyclone];

#[test]
fn one_service_answers_clients_of_either_mapping() {
    let mut peers = peers();
    let node = peers.ours.node("/", "server").expect("a node");
    let service = node.service::<std_srvs::SetBool>("/server/switch").expect("a service");
    let clients = MAPPINGS.map(|mapping| client::<std_srvs::SetBool>(&mut peers, mapping, "/server/switch"));
    until("both clients", || (service.matched() == 2).then_some(()));
    for data in [true, false, true] {
        for client in &clients {
            let mut serve = || {
                service.serve(|request| std_srvs::Outcome {
                    success: request.data,
                    message: format!("was {}", request.data),
                });
            };
            let answer = call::<std_srvs::SetBool>(client, &std_srvs::SetBoolRequest { data }, &mut serve);
            assert_eq!(answer, std_srvs::Outcome { success: data, message: format!("was {data}") });
        }
    }
    assert_eq!(service.refused(), 0);
}

fn parameters(node: &Node) -> Parameters {
    let mut store = Store::default();
    for declaration in [
        Declaration::new("rate", 50.0).describe("ticks per second [Hz]").range(1.0..=500.0),
        Declaration::new("gains.p", 1.0).checked("not 0.5", |_, value| {
            if value == &Value::Double(0.5) { Err("0.5 is unlucky".into()) } else { Ok(()) }
        }),
        Declaration::new("use_sim_time", false).read_only(),
    ] {
        store.declare(declaration, None).expect("declared once");
    }
    Parameters::new(node, store).expect("services")
}

fn settings(settings: &[(&str, Value)]) -> rcl_interfaces::Settings {
    let parameters = settings
        .iter()
        .map(|(name, value)| rcl_interfaces::Parameter { name: (*name).into(), value: value.to_wire() })
        .collect();
    rcl_interfaces::Settings { parameters }
}

fn names(names: &[&str]) -> rcl_interfaces::Names {
    rcl_interfaces::Names { names: names.iter().map(|&name| name.into()).collect() }
}

#[test]
fn parameters_are_got_and_described_from_outside() {
    use rcl_interfaces::{DescribeParameters, GetParameterTypes, GetParameters, ListParameters};
    let mut peers = peers();
    let node = peers.ours.node("/", "described").expect("a node");
    let mut parameters = parameters(&node);
    for mapping in MAPPINGS {
        let get = client::<GetParameters>(&mut peers, mapping, "/described/get_parameters");
        let types = client::<GetParameterTypes>(&mut peers, mapping, "/described/get_parameter_types");
        let describe = client::<DescribeParameters>(&mut peers, mapping, "/described/describe_parameters");
        let list = client::<ListParameters>(&mut peers, mapping, "/described/list_parameters");
        let mut tick = || assert_eq!(parameters.poll(0.0), []);
        let some = names(&["rate", "none"]);
        let got = call::<GetParameters>(&get, &some, &mut tick).values;
        assert_eq!(got, [Value::Double(50.0).to_wire(), rcl_interfaces::ParameterValue::default()]);
        assert_eq!(call::<GetParameterTypes>(&types, &some, &mut tick).types, [3, 0]);
        let described = call::<DescribeParameters>(&describe, &some, &mut tick).descriptors;
        assert_eq!(described[0].description, "ticks per second [Hz]");
        assert_eq!(described[0].floating_point_range[0].to_value, 500.0);
        let all = rcl_interfaces::ListParametersRequest::default();
        let listed = call::<ListParameters>(&list, &all, &mut tick);
        assert_eq!(listed.names, ["gains.p", "rate", "use_sim_time"]);
        assert_eq!(listed.prefixes, ["gains"]);
    }
}

#[test]
fn parameters_are_set_from_outside_within_their_bounds() {
    use rcl_interfaces::{ParameterEvent, SetParameters, SetParametersAtomically};
    let mut peers = peers();
    let node = peers.ours.node("/", "tuned").expect("a node");
    let mut parameters = parameters(&node);
    let observer = peers.theirs.node("/", "observer").expect("a node");
    let events =
        observer.subscription::<ParameterEvent>("/parameter_events", Quality::reliable(100)).expect("in");
    until("a match", || (events.matched() >= 1).then_some(()));
    let set = client::<SetParameters>(&mut peers, ServiceMapping::Cyclone, "/tuned/set_parameters");
    let atomically = client::<SetParametersAtomically>(
        &mut peers,
        ServiceMapping::Enhanced,
        "/tuned/set_parameters_atomically",
    );

    let wanted = settings(&[
        ("rate", Value::Integer(100)),
        ("rate", Value::Double(0.0)),
        ("rate", Value::String("fast".into())),
        ("gains.p", Value::Double(0.5)),
        ("use_sim_time", Value::Bool(true)),
        ("none", Value::Bool(true)),
    ]);
    let mut changes = Vec::new();
    let mut tick = || changes.extend(parameters.poll(3.5));
    let results = call::<SetParameters>(&set, &wanted, &mut tick).results;
    let reasons: Vec<&str> = results.iter().map(|result| result.reason.as_str()).collect();
    assert!(results[0].successful, "{reasons:?}");
    assert!(results[1..].iter().all(|result| !result.successful && !result.reason.is_empty()), "{reasons:?}");
    assert!(reasons[3].contains("unlucky"), "{reasons:?}");

    let half = settings(&[("rate", Value::Double(200.0)), ("gains.p", Value::Double(0.5))]);
    let result = call::<SetParametersAtomically>(&atomically, &half, &mut tick).result;
    assert!(!result.successful && result.reason.contains("unlucky"), "{}", result.reason);
    let rate = Change { name: "rate".into(), value: Value::Double(100.0) };
    assert!(!changes.is_empty() && changes.iter().all(|change| *change == rate), "{changes:?}");

    let event = until("an event", || {
        let (event, _) = events.take()?;
        (event.node == "/tuned" && !event.changed_parameters.is_empty()).then_some(event)
    });
    assert_eq!(event.changed_parameters, settings(&[("rate", Value::Double(100.0))]).parameters);
    assert_eq!(event.stamp, Time { sec: 3, nanosec: 500_000_000 });
}

#[test]
fn a_lifecycle_is_driven_from_outside() {
    use lifecycle_msgs::{
        ChangeState, GetAvailableStates, GetAvailableTransitions, GetState, TransitionEvent,
    };
    let mut peers = peers();
    let node = peers.ours.node("/", "managed").expect("a node");
    let mut lifecycle = Lifecycle::new(&node).expect("services");
    let observer = peers.theirs.node("/", "manager").expect("a node");
    let events = observer
        .subscription::<TransitionEvent>("/managed/transition_event", Quality::reliable(10))
        .expect("in");
    until("a match", || (events.matched() == 1).then_some(()));
    let mapping = ServiceMapping::Cyclone;
    let change = client::<ChangeState>(&mut peers, mapping, "/managed/change_state");
    let state = client::<GetState>(&mut peers, ServiceMapping::Enhanced, "/managed/get_state");
    let states = client::<GetAvailableStates>(&mut peers, mapping, "/managed/get_available_states");
    let next = client::<GetAvailableTransitions>(&mut peers, mapping, "/managed/get_available_transitions");
    let graph = client::<GetAvailableTransitions>(&mut peers, mapping, "/managed/get_transition_graph");

    let mut done = Vec::new();
    lifecycle.autostart(1.0, &mut |goal| {
        done.push(goal);
        Outcome::Success
    });
    assert_eq!(done, [Goal::Configure, Goal::Activate]);
    assert!(lifecycle.is_active());

    let mut tick = || lifecycle.poll(2.0, &mut |_| Outcome::Success);
    let current = call::<GetState>(&state, &Empty, &mut tick).current_state;
    assert_eq!(current, lifecycle_msgs::State { id: 3, label: "active".into() });
    assert_eq!(call::<GetAvailableStates>(&states, &Empty, &mut tick).available_states.len(), 11);
    assert_eq!(call::<GetAvailableTransitions>(&graph, &Empty, &mut tick).available_transitions.len(), 25);
    let labels: Vec<String> = call::<GetAvailableTransitions>(&next, &Empty, &mut tick)
        .available_transitions
        .into_iter()
        .map(|description| description.transition.label)
        .collect();
    assert_eq!(labels, ["deactivate", "shutdown"]);

    let asked = |id: u8, label: &str| lifecycle_msgs::ChangeStateRequest {
        transition: lifecycle_msgs::Transition { id, label: label.into() },
    };
    assert!(!call::<ChangeState>(&change, &asked(1, ""), &mut tick).success, "configure an active node");
    assert!(call::<ChangeState>(&change, &asked(0, "shutdown"), &mut tick).success);
    assert_eq!(lifecycle.state(), State::Finalized);
    let goals = std::iter::from_fn(|| Some(until("an event", || events.take()).0.goal_state.label));
    let expected = ["configuring", "inactive", "activating", "active", "shuttingdown", "finalized"];
    assert_eq!(goals.take(6).collect::<Vec<_>>(), expected);
}

#[test]
fn simulated_time_comes_from_the_clock_topic() {
    let peers = peers();
    let node = peers.ours.node("/", "simulated").expect("a node");
    let simulator = peers.theirs.node("/", "simulator").expect("a node");
    let mut clock = Clock::simulated(&node).expect("a subscription");
    let time = simulator.publisher::<rosgraph_msgs::Clock>("/clock", Quality::BEST_EFFORT).expect("out");
    assert_eq!(clock.now(), None);
    // The foreign node hears `/clock` as another type and must not match.
    until("a match", || (time.matched() >= 1).then_some(()));
    let mut tell = |seconds: f64| {
        let mut jump = None;
        until("simulated time", || {
            let clock_message = rosgraph_msgs::Clock { clock: Time::from_seconds(seconds) };
            time.publish(&clock_message).expect("sent");
            jump = jump.or(clock.poll());
            (clock.now() == Some(seconds)).then_some(())
        });
        jump
    };
    assert_eq!(tell(10.0), None);
    assert_eq!(tell(10.5), None);
    assert_eq!(tell(2.5), Some(8.0));
}
