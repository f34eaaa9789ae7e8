//! Who is there.

use std::time::Instant;

use flockform::messages::std_srvs;
use flockform::ros::edge::{Edge, EdgeError, Options, Quality};
use ros2_client::builtin_topics::ros_discovery;
use ros2_client::dds::rustdds::policy::{Durability, History};
use ros2_client::dds::rustdds::{Duration, QosPolicyBuilder, TopicKind};
use serde::{Deserialize, Serialize};

use super::support::*;

/// What `ros2 node list` and `ros2 node info` go by.
#[test]
fn nodes_of_one_participant_are_announced_each_with_what_it_owns() {
    let peers = peers();
    let one = peers.ours.node("/swarm", "one").expect("a node");
    let two = one.another_node("/swarm", "two").expect("a node");
    assert_eq!(two.name(), "/swarm/two");
    assert_eq!(two.private("get_state").as_deref(), Ok("/swarm/two/get_state"));
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
        .reliable(Duration::ZERO)
        .history(History::KeepAll)
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
    assert!(matches!(peers.ours.node("/", "a b").err(), Some(EdgeError::Name(_))));
    assert!(matches!(peers.ours.node("relative", "a").err(), Some(EdgeError::Name(_))));
    let node = peers.ours.node("/", "names").expect("a node");
    let relative = node.publisher::<PoseStamped>("relative", Quality::BEST_EFFORT).err();
    assert!(matches!(relative, Some(EdgeError::Name(_))));
}
