//! Package `lifecycle_msgs`.

use serde::{Deserialize, Serialize};

use super::std_msgs::Empty;
use super::{Message, ServiceType};

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

impl Message for TransitionEvent {
    const PACKAGE: &str = "lifecycle_msgs";
    const NAME: &str = "TransitionEvent";
}

/// `srv/ChangeState`.
pub struct ChangeState;

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

impl ServiceType for ChangeState {
    const PACKAGE: &str = "lifecycle_msgs";
    const NAME: &str = "ChangeState";
    type Request = ChangeStateRequest;
    type Response = ChangeStateResponse;
}

/// `srv/GetState`.
pub struct GetState;

/// Response of [`GetState`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetStateResponse {
    pub current_state: State,
}

impl ServiceType for GetState {
    const PACKAGE: &str = "lifecycle_msgs";
    const NAME: &str = "GetState";
    type Request = Empty;
    type Response = GetStateResponse;
}

/// `srv/GetAvailableStates`.
pub struct GetAvailableStates;

/// Response of [`GetAvailableStates`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetAvailableStatesResponse {
    pub available_states: Vec<State>,
}

impl ServiceType for GetAvailableStates {
    const PACKAGE: &str = "lifecycle_msgs";
    const NAME: &str = "GetAvailableStates";
    type Request = Empty;
    type Response = GetAvailableStatesResponse;
}

/// `srv/GetAvailableTransitions`, served twice: as `~/get_available_transitions` (from the present state)
/// and as `~/get_transition_graph` (all).
pub struct GetAvailableTransitions;

/// Response of [`GetAvailableTransitions`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetAvailableTransitionsResponse {
    pub available_transitions: Vec<TransitionDescription>,
}

impl ServiceType for GetAvailableTransitions {
    const PACKAGE: &str = "lifecycle_msgs";
    const NAME: &str = "GetAvailableTransitions";
    type Request = Empty;
    type Response = GetAvailableTransitionsResponse;
}
