//! Package `lifecycle_msgs`.

use serde::{Deserialize, Serialize};

use super::std_msgs::Empty;
use super::{messages, service};

/// `msg/State`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct State {
    pub id: u8,
    pub label: String,
}

/// `msg/Transition`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Transition {
    pub id: u8,
    pub label: String,
}

/// `msg/TransitionDescription`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TransitionDescription {
    pub transition: Transition,
    pub start_state: State,
    pub goal_state: State,
}

/// `msg/TransitionEvent`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TransitionEvent {
    /// Nanoseconds since the Unix epoch.
    pub timestamp: u64,
    pub transition: Transition,
    pub start_state: State,
    pub goal_state: State,
}

messages!("lifecycle_msgs": TransitionEvent);

service!(ChangeState, "lifecycle_msgs", ChangeStateRequest => ChangeStateResponse);

/// Request of [`ChangeState`]; where the id is 0 and a label is given, the label counts.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangeStateRequest {
    pub transition: Transition,
}

/// Response of [`ChangeState`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangeStateResponse {
    pub success: bool,
}

service!(GetState, "lifecycle_msgs", Empty => GetStateResponse);

/// Response of [`GetState`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetStateResponse {
    pub current_state: State,
}

service!(GetAvailableStates, "lifecycle_msgs", Empty => GetAvailableStatesResponse);

/// Response of [`GetAvailableStates`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetAvailableStatesResponse {
    pub available_states: Vec<State>,
}

service!(
    /// Served twice: as `~/get_available_transitions` (from the present state) and as `~/get_transition_graph` (all).
    GetAvailableTransitions, "lifecycle_msgs", Empty => GetAvailableTransitionsResponse
);

/// Response of [`GetAvailableTransitions`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetAvailableTransitionsResponse {
    pub available_transitions: Vec<TransitionDescription>,
}
