//! The machine behind its services.

use super::machine::{Goal, Machine, State, Transition};
use crate::messages::lifecycle_msgs as msgs;
use crate::ros::edge::{EdgeError, Node, Publisher, Quality, Service};

/// A node's lifecycle and the services `~/change_state`, `~/get_state`, `~/get_available_states`,
/// `~/get_available_transitions`, `~/get_transition_graph`, with the topic `~/transition_event`. By default it has none of them.
#[derive(Default)]
pub struct Lifecycle {
    machine: Machine,
    /// None where peers have no part in it.
    services: Option<Services>,
    events: Option<Publisher<msgs::TransitionEvent>>,
}

struct Services {
    changes: Service<msgs::ChangeState>,
    state: Service<msgs::GetState>,
    states: Service<msgs::GetAvailableStates>,
    transitions: Service<msgs::GetAvailableTransitions>,
    graph: Service<msgs::GetAvailableTransitions>,
}

impl Services {
    fn new(node: &Node) -> Result<Self, EdgeError> {
        Ok(Self {
            changes: node.service(&node.private("change_state")?)?.from_now_on(),
            state: node.service(&node.private("get_state")?)?,
            states: node.service(&node.private("get_available_states")?)?,
            transitions: node.service(&node.private("get_available_transitions")?)?,
            graph: node.service(&node.private("get_transition_graph")?)?,
        })
    }

    fn answer_questions(&self, now: State) {
        self.state.serve(|_| msgs::GetStateResponse { current_state: state(now) });
        self.states
            .serve(|_| msgs::GetAvailableStatesResponse { available_states: State::ALL.map(state).into() });
        self.transitions.serve(|_| msgs::GetAvailableTransitionsResponse {
            available_transitions: Transition::from(now).map(description).collect(),
        });
        self.graph.serve(|_| msgs::GetAvailableTransitionsResponse {
            available_transitions: Transition::ALL.map(description).into(),
        });
    }
}

impl Lifecycle {
    /// An unconfigured node, with services and with events where that is asked for.
    ///
    /// # Errors
    /// As [`Node::service`].
    pub fn open(node: &Node, [is_served, has_events]: [bool; 2]) -> Result<Self, EdgeError> {
        let services = is_served.then(|| Services::new(node)).transpose()?;
        let events = has_events.then(|| node.topic("~/transition_event")).transpose()?;
        let events = events.map(|topic| node.publisher(&topic, Quality::reliable(10))).transpose()?;
        Ok(Self { machine: Machine::default(), services, events })
    }

    pub fn state(&self) -> State {
        self.machine.state()
    }

    /// Whether the node may move robots.
    pub fn is_active(&self) -> bool {
        self.state() == State::Active
    }

    /// Takes an unconfigured node to active, doing what each step asks for. Stops where a step does not
    /// succeed.
    pub fn autostart(&mut self, now: f64, act: &mut dyn FnMut(Goal) -> bool) {
        for label in ["configure", "activate"] {
            let Some(edge) = self.machine.asked(0, label) else { return };
            self.run(edge, now, act);
        }
    }

    /// Takes the node to finalized from wherever it stands, as a signal to end does.
    pub(crate) fn shut_down(&mut self, now: f64, act: &mut dyn FnMut(Goal) -> bool) {
        if let Some(edge) = self.machine.asked(0, "shutdown") {
            self.run(edge, now, act);
        }
    }

    /// Takes the node to a state that it had before, by the edges that lead there.
    pub(crate) fn go_to(&mut self, goal: State, now: f64, act: &mut dyn FnMut(Goal) -> bool) {
        // No way is longer, and where there is none nothing happens.
        for _ in 0..3 {
            let label = match (self.state(), goal) {
                (State::Unconfigured, State::Inactive | State::Active) => "configure",
                (State::Inactive, State::Active) => "activate",
                (State::Active, State::Inactive | State::Unconfigured) => "deactivate",
                (State::Inactive, State::Unconfigured) => "cleanup",
                (_, State::Finalized) => "shutdown",
                _ => return,
            };
            let Some(edge) = self.machine.asked(0, label) else { return };
            self.run(edge, now, act);
        }
    }

    /// Answers the questions since the last tick and at most one request for a transition, so that every state lasts a
    /// tick: `act` does what the transition asks for if it `may` be asked for from outside. `now` \[s\] stamps the
    /// events.
    pub fn poll(&mut self, now: f64, may: &dyn Fn(&Transition) -> bool, act: &mut dyn FnMut(Goal) -> bool) {
        if let Some((id, request)) = self.services.as_ref().and_then(|services| services.changes.take()) {
            let asked = request.transition;
            let success = self.change(asked.id, &asked.label, now, may, act);
            if let Some(services) = &self.services
                && let Err(error) = services.changes.reply(&id, &msgs::ChangeStateResponse { success })
            {
                tracing::warn!("{error}");
            }
        }
        let state = self.state();
        self.services.iter().for_each(|services| services.answer_questions(state));
    }

    /// Makes a transition as a peer's request does, by its label where the id is 0; says whether what it asks for was done.
    pub fn change(
        &mut self,
        id: u8,
        label: &str,
        now: f64,
        may: &dyn Fn(&Transition) -> bool,
        act: &mut dyn FnMut(Goal) -> bool,
    ) -> bool {
        let edge = self.machine.asked(id, label).filter(may);
        edge.is_some_and(|edge| self.run(edge, now, act))
    }

    /// Follows an edge to the next primary state; says whether what it asks for was done.
    fn run(&mut self, edge: Transition, now: f64, act: &mut dyn FnMut(Goal) -> bool) -> bool {
        let Some(goal) = self.machine.begin(edge) else { return false };
        self.publish_event(edge, now);
        let is_done = act(goal);
        if let Some(end) = self.machine.end(is_done) {
            self.publish_event(end, now);
        }
        is_done
    }

    fn publish_event(&self, edge: Transition, now: f64) {
        let Some(events) = &self.events else { return };
        let msgs::TransitionDescription { transition, start_state, goal_state } = description(edge);
        let timestamp = (now * 1e9) as u64;
        let event = msgs::TransitionEvent { timestamp, transition, start_state, goal_state };
        if let Err(error) = events.publish(&event) {
            tracing::warn!("{error}");
        }
    }
}

fn state(state: State) -> msgs::State {
    msgs::State { id: state.id(), label: state.name().into() }
}

fn description(edge: Transition) -> msgs::TransitionDescription {
    msgs::TransitionDescription {
        transition: msgs::Transition { id: edge.id, label: edge.label.into() },
        start_state: state(edge.start),
        goal_state: state(edge.goal),
    }
}
