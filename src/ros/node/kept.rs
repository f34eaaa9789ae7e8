//! The state of a node that outlasts its process, so that the next process resumes from it.

use serde::{Deserialize, Serialize};

use super::FormationNode;
use crate::ros::edge::lifecycle::State;
use crate::ros::edge::parameters::Value;
use crate::swarm::control::KeptControl;
use crate::swarm::pace::system_time;

/// A node's state. Poses are not in it: they come again, and those of before would be too old.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct KeptNode {
    /// Label of its lifecycle's state.
    state: String,
    control: KeptControl,
    /// Parameters that are numbers.
    parameters: Vec<(String, f64)>,
}

impl FormationNode {
    pub fn kept(&self) -> KeptNode {
        let number = |(name, value): (&str, &Value)| Some((name.to_owned(), value.as_double()?));
        KeptNode {
            state: self.lifecycle.state().label().to_owned(),
            control: self.control.kept(),
            parameters: self.parameters.iter().filter_map(number).collect(),
        }
    }

    /// Goes on from what another process left.
    pub fn restore(&mut self, kept: KeptNode) {
        for (name, value) in kept.parameters {
            // The same file gave them; another's limits win over what does not keep them.
            if let Err(error) = self.parameters.set(&name, value) {
                tracing::warn!("not as it was before: {error}");
            }
        }
        let now = self.clock.now().unwrap_or_else(system_time);
        let changes = self.parameters.poll(now, None);
        self.apply(&changes, now);
        if let Some(state) = State::ALL.into_iter().find(|state| state.label() == kept.state) {
            let control = &mut self.control;
            self.lifecycle.go_to(state, now, &mut |goal| super::act(control, goal));
        }
        self.control.restore(kept.control);
    }
}
