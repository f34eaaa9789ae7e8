//! The state machine. Pure.

named! {
    /// Primary and transition states, in the order that ROS 2 lists them; the numbers are those of `lifecycle_msgs/msg/State`.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[repr(u8)]
    pub enum State {
        Unknown = 0 => "unknown",
        #[default]
        Unconfigured = 1 => "unconfigured",
        Inactive = 2 => "inactive",
        Active = 3 => "active",
        Finalized = 4 => "finalized",
        Configuring = 10 => "configuring",
        CleaningUp = 11 => "cleaningup",
        ShuttingDown = 12 => "shuttingdown",
        Activating = 13 => "activating",
        Deactivating = 14 => "deactivating",
        ErrorProcessing = 15 => "errorprocessing",
    }
}

impl State {
    /// Number in `lifecycle_msgs/msg/State`.
    pub fn id(self) -> u8 {
        self as u8
    }
}

/// An edge of the machine; the numbers are those of `lifecycle_msgs/msg/Transition`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    pub id: u8,
    pub label: &'static str,
    pub start: State,
    pub goal: State,
}

const fn edge(id: u8, label: &'static str, start: State, goal: State) -> Transition {
    Transition { id, label, start, goal }
}

const SUCCESS: &str = "transition_success";
const FAILURE: &str = "transition_failure";
const ERROR: &str = "transition_error";

impl Transition {
    /// Every edge: what may be asked for, then what follows by itself.
    pub const ALL: [Transition; 25] = {
        use State::*;
        [
            edge(1, "configure", Unconfigured, Configuring),
            edge(10, SUCCESS, Configuring, Inactive),
            edge(11, FAILURE, Configuring, Unconfigured),
            edge(12, ERROR, Configuring, ErrorProcessing),
            edge(2, "cleanup", Inactive, CleaningUp),
            edge(20, SUCCESS, CleaningUp, Unconfigured),
            edge(21, FAILURE, CleaningUp, Inactive),
            edge(22, ERROR, CleaningUp, ErrorProcessing),
            edge(3, "activate", Inactive, Activating),
            edge(30, SUCCESS, Activating, Active),
            edge(31, FAILURE, Activating, Inactive),
            edge(32, ERROR, Activating, ErrorProcessing),
            edge(4, "deactivate", Active, Deactivating),
            edge(40, SUCCESS, Deactivating, Inactive),
            edge(41, FAILURE, Deactivating, Active),
            edge(42, ERROR, Deactivating, ErrorProcessing),
            edge(5, "shutdown", Unconfigured, ShuttingDown),
            edge(6, "shutdown", Inactive, ShuttingDown),
            edge(7, "shutdown", Active, ShuttingDown),
            edge(50, SUCCESS, ShuttingDown, Finalized),
            edge(51, FAILURE, ShuttingDown, Finalized),
            edge(52, ERROR, ShuttingDown, ErrorProcessing),
            edge(60, SUCCESS, ErrorProcessing, Unconfigured),
            edge(61, FAILURE, ErrorProcessing, Finalized),
            edge(62, ERROR, ErrorProcessing, Finalized),
        ]
    };

    /// Edges from a state.
    pub fn from(state: State) -> impl Iterator<Item = Transition> {
        Self::ALL.into_iter().filter(move |edge| edge.start == state)
    }
}

/// The action of a node in a transition state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    Configure,
    CleanUp,
    Activate,
    Deactivate,
    ShutDown,
}

/// Where a node stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Machine {
    state: State,
}

impl Machine {
    pub fn state(&self) -> State {
        self.state
    }

    /// The edge that a request means in the present state: by id, or by label where the id is 0 and a label
    /// is given.
    pub fn asked(&self, id: u8, label: &str) -> Option<Transition> {
        let by_label = id == 0 && !label.is_empty();
        // From a transition state nothing can be asked for: its edges follow by themselves.
        Transition::from(self.state)
            .filter(|edge| edge.id < 10)
            .find(|edge| if by_label { edge.label == label } else { edge.id == id })
    }

    /// Begins a transition; says what to do for it.
    pub fn begin(&mut self, edge: Transition) -> Option<Goal> {
        if edge.start != self.state {
            return None;
        }
        self.state = edge.goal;
        self.goal()
    }

    /// The action that the present state requires.
    pub fn goal(&self) -> Option<Goal> {
        match self.state {
            State::Configuring => Some(Goal::Configure),
            State::CleaningUp => Some(Goal::CleanUp),
            State::Activating => Some(Goal::Activate),
            State::Deactivating => Some(Goal::Deactivate),
            State::ShuttingDown => Some(Goal::ShutDown),
            _ => None,
        }
    }

    /// Ends what was begun, which is done or has failed; returns the edge taken, `None` outside transition states. No action of a
    /// node of ours ends in an error, which ROS 2 has edges for as well.
    pub fn end(&mut self, is_done: bool) -> Option<Transition> {
        self.goal()?;
        let label = if is_done { SUCCESS } else { FAILURE };
        let edge = Transition::from(self.state).find(|edge| edge.label == label)?;
        self.state = edge.goal;
        Some(edge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn go(machine: &mut Machine, label: &str, is_done: bool) -> Option<Goal> {
        let edge = machine.asked(0, label)?;
        let goal = machine.begin(edge);
        machine.end(is_done).expect("in a transition state");
        goal
    }

    #[test]
    fn a_node_lives_from_unconfigured_to_finalized() {
        let mut machine = Machine::default();
        let life = [
            ("configure", Goal::Configure, State::Inactive),
            ("activate", Goal::Activate, State::Active),
            ("deactivate", Goal::Deactivate, State::Inactive),
            ("cleanup", Goal::CleanUp, State::Unconfigured),
            ("shutdown", Goal::ShutDown, State::Finalized),
        ];
        for (label, goal, state) in life {
            assert_eq!(go(&mut machine, label, true), Some(goal));
            assert_eq!(machine.state(), state);
        }
        assert_eq!(Transition::from(State::Finalized).count(), 0);
    }

    #[test]
    fn what_fails_goes_back() {
        let mut machine = Machine::default();
        go(&mut machine, "configure", false);
        assert_eq!(machine.state(), State::Unconfigured);
        assert_eq!(machine.end(true), None, "nothing has begun");
    }

    #[test]
    fn only_what_the_state_allows_can_be_asked_for() {
        let mut machine = Machine::default();
        assert_eq!(machine.asked(3, ""), None, "activate before configure");
        assert_eq!(machine.asked(7, ""), None, "the shutdown of another state");
        assert_eq!(machine.asked(5, "").map(|edge| edge.goal), Some(State::ShuttingDown));
        assert_eq!(machine.asked(1, "activate").map(|edge| edge.label), Some("configure"), "the id counts");
        machine.begin(machine.asked(1, "").expect("allowed"));
        assert_eq!(machine.asked(10, ""), None, "edges out of a transition state follow by themselves");
        assert_eq!(machine.asked(0, SUCCESS), None);
    }

    #[test]
    fn every_edge_has_its_own_number_and_joins_two_states_of_the_list() {
        for (i, edge) in Transition::ALL.iter().enumerate() {
            assert!(State::ALL.contains(&edge.start) && State::ALL.contains(&edge.goal));
            assert!(Transition::ALL[..i].iter().all(|other| other.id != edge.id), "{}", edge.id);
        }
    }
}
