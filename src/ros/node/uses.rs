//! The uses of a node's topics: one of each topic.

use std::collections::BTreeMap;

use super::NodeError;
use crate::messages::names::Names;

/// Topics by name, each with its use in words.
#[derive(Debug, Default)]
pub(in crate::ros) struct Uses(BTreeMap<String, String>);

impl Uses {
    /// Adds the use of a topic for a robot or for the node. A second use of the topic would take one robot for another, or
    /// targets for poses; a recording has one type of each.
    ///
    /// # Errors
    /// A topic that has a use.
    pub fn add(&mut self, topic: String, purpose: &str, of: &str) -> Result<(), NodeError> {
        let added = format!("{purpose} of {of}");
        match self.0.remove(&topic) {
            Some(other) => Err(NodeError::SharedTopic { topic, uses: [other, added] }),
            None => {
                self.0.insert(topic, added);
                Ok(())
            }
        }
    }

    /// Adds topics of a node's own: names as the node resolves them, purposes, and whether each is used.
    ///
    /// # Errors
    /// A name that ROS 2 does not allow; a topic that has a use.
    pub fn add_own(&mut self, names: &Names, own: &[(&str, &str, bool)]) -> Result<(), NodeError> {
        let mut used = own.iter().filter(|(.., is_used)| *is_used);
        used.try_for_each(|(name, purpose, _)| self.add(names.topic(name)?, purpose, "this node"))
    }
}
