//! The state of a node that outlasts its process, so that the next process resumes from it.

use serde::{Deserialize, Serialize};

use super::FormationNode;
use crate::ros::edge::lifecycle::State;
use crate::ros::edge::parameters::Value;
use crate::swarm::control::ControlSnapshot;

/// A node's state. Poses are not in it: they come again, and those of before would be too old; robots of which none comes are
/// where they were.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct NodeSnapshot {
    /// Label of its lifecycle's state.
    state: String,
    control: ControlSnapshot,
    /// Parameters that are numbers.
    parameters: Vec<(String, f64)>,
    /// Parameters that are names.
    names: Vec<(String, String)>,
}

impl NodeSnapshot {
    /// The part of it that is the loop's.
    pub fn control(&self) -> &ControlSnapshot {
        &self.control
    }
}

impl FormationNode {
    /// The state for [`FormationNode::restore`].
    pub fn kept(&self) -> NodeSnapshot {
        let number = |(name, value): (&str, &Value)| Some((name.to_owned(), value.as_number()?));
        let text = |(name, value): (&str, &Value)| Some((name.to_owned(), value.as_str()?.to_owned()));
        NodeSnapshot {
            state: self.lifecycle.state().name().to_owned(),
            control: self.control.kept(),
            parameters: self.parameters.iter().filter_map(number).collect(),
            names: self.parameters.iter().filter_map(text).collect(),
        }
    }

    /// Goes on from what another process left.
    pub fn restore(&mut self, kept: NodeSnapshot) {
        let now = self.time();
        let is_named = |(name, value): &(String, String)| {
            self.parameters.get(name).and_then(Value::as_str) == Some(value.as_str())
        };
        if !kept.names.iter().all(is_named) {
            // Names change while the node is not configured.
            self.go_to(State::Unconfigured, now);
        }
        for (name, value) in kept.parameters {
            let is_whole = self.parameters.get(&name).and_then(Value::as_integer).is_some();
            let value = if is_whole { Value::Integer(value as i64) } else { Value::Double(value) };
            self.set(&name, value);
        }
        kept.names.into_iter().for_each(|(name, value)| self.set(&name, Value::String(value)));
        // Requests wait for the first tick, which knows what peers may do.
        let changes = self.parameters.changes(now);
        self.apply(&changes, now);
        if let Some(state) = State::ALL.into_iter().find(|state| state.name() == kept.state) {
            self.go_to(state, now);
        }
        self.control.restore(kept.control);
    }

    fn set(&mut self, name: &str, value: Value) {
        // The same file gave them; another's limits win over what does not keep them.
        if let Err(error) = self.parameters.set(name, value) {
            tracing::warn!("not as it was before: {error}");
        }
    }

    fn go_to(&mut self, state: State, now: f64) {
        self.follow(now, |lifecycle, act| lifecycle.go_to(state, now, act));
    }
}
