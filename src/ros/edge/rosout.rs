//! A node's log as a topic: `/rosout`.

use std::sync::mpsc::Receiver;

use super::{EdgeError, Node, Publisher, Quality};
use crate::messages::rcl_interfaces::Log;

/// As long as no writer takes them lines beyond these are dropped \[1\].
pub const MOST_WAITING: usize = 256;
/// Lines sent in one call \[1\]: a talkative period must not fill the queue of what is to be sent.
const MOST_AT_ONCE: usize = 16;
/// As `rcl` offers it but for its 1000: RustDDS keeps what it offers to late joiners in memory.
const QUALITY: Quality = Quality::transient_local(100);

/// The lines of a log, on their way to the topic.
pub struct Rosout {
    lines: Receiver<Log>,
    publisher: Publisher<Log>,
}

impl Rosout {
    /// # Errors
    /// As [`Node::publisher`].
    pub fn new(node: &Node, lines: Receiver<Log>) -> Result<Self, EdgeError> {
        Ok(Self { lines, publisher: node.publisher(&node.topic("/rosout")?, QUALITY)? })
    }

    /// Sends what was logged since the last call.
    pub fn publish(&self) {
        for line in self.lines.try_iter().take(MOST_AT_ONCE) {
            // The console has it, and a line about a lost line would be lost too.
            let _ = self.publisher.publish(&line);
        }
    }
}
