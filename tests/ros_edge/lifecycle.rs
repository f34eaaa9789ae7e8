//! The lifecycle from outside.

use flockform::messages::lifecycle_msgs;
use flockform::messages::std_msgs::Empty;
use flockform::ros::edge::Quality;
use flockform::ros::edge::lifecycle::{Goal, Lifecycle, State};
use ros2_client::ServiceMapping;

use super::support::*;

#[test]
fn a_lifecycle_is_driven_from_outside() {
    use lifecycle_msgs::{
        ChangeState, GetAvailableStates, GetAvailableTransitions, GetState, TransitionEvent,
    };
    let mut peers = peers();
    let node = peers.ours.node("/", "managed").expect("a node");
    let mut lifecycle = Lifecycle::open(&node, [true; 2]).expect("services");
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
        true
    });
    assert_eq!(done, [Goal::Configure, Goal::Activate]);
    assert!(lifecycle.is_active());

    let mut tick = || lifecycle.poll(2.0, &|_| true, &mut |_| true);
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
