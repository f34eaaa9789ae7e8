//! The uses of the robots' topics: one of each topic.

use std::collections::BTreeMap;

use super::NodeError;

/// Topics by name, each with its use in words.
#[derive(Debug, Default)]
pub(in crate::ros) struct Uses(BTreeMap<String, String>);

impl Uses {
    /// Adds the use of a topic for a robot. A second use of the topic would take one robot for another, or targets for
    /// poses.
    ///
    /// # Errors
    /// A topic that has a use.
    pub fn add(&mut self, topic: String, purpose: &str, robot: &str) -> Result<(), NodeError> {
        let added = format!("{purpose} of {robot}");
        match self.0.remove(&topic) {
            Some(other) => Err(NodeError::SharedTopic { topic, uses: [other, added] }),
            None => {
                self.0.insert(topic, added);
                Ok(())
            }
        }
    }
}
