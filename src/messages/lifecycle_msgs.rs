//! Package `lifecycle_msgs`.

use super::std_msgs::Empty;
use super::{messages, services, structs};

messages! { "lifecycle_msgs";
    State { id: u8, label: String }
    Transition { id: u8, label: String }
    TransitionDescription { transition: Transition, start_state: State, goal_state: State }

    TransitionEvent {
        /// Nanoseconds since the Unix epoch.
        timestamp: u64,
        transition: Transition,
        start_state: State,
        goal_state: State,
    }
}

services! { "lifecycle_msgs";
    ChangeState: ChangeStateRequest => ChangeStateResponse;
    GetState: Empty => GetStateResponse;
    GetAvailableStates: Empty => GetAvailableStatesResponse;
    /// Served twice: as `~/get_available_transitions` (from the present state) and as `~/get_transition_graph` (all).
    GetAvailableTransitions: Empty => GetAvailableTransitionsResponse;
}

structs! {
    /// Request of [`ChangeState`]; where the id is 0 and a label is given, the label counts.
    ChangeStateRequest { transition: Transition }

    /// Response of [`ChangeState`].
    #[derive(Copy)] ChangeStateResponse { success: bool }

    /// Response of [`GetState`].
    GetStateResponse { current_state: State }

    /// Response of [`GetAvailableStates`].
    GetAvailableStatesResponse { available_states: Vec<State> }

    /// Response of [`GetAvailableTransitions`].
    GetAvailableTransitionsResponse { available_transitions: Vec<TransitionDescription> }
}
