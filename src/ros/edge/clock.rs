//! The clock: the computer's time, or the simulator's from `/clock`.

use std::time::{Duration, Instant};

use super::topic::MOST_AT_ONCE;
use super::{EdgeError, Node, Quality, Subscription};
use crate::messages::rosgraph_msgs;
use crate::swarm::pace::system_time;

/// The node's clock.
pub struct Clock {
    simulated: Option<Simulated>,
}

/// Silence of a simulator that is worth a word.
const PATIENCE: Duration = Duration::from_secs(3);

struct Simulated {
    /// Time of the computer at which the simulator last spoke, or the subscription was made.
    since: Instant,
    subscription: Subscription<rosgraph_msgs::Clock>,
    reading: Reading,
}

/// The last received time of a simulator. Pure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    now: Option<f64>,
    jump: f64,
}

impl Reading {
    /// Another time from the simulator \[s\].
    pub fn receive(&mut self, time: f64) {
        if let Some(before) = self.now
            && time < before
        {
            self.jump += before - time;
        }
        self.now = Some(time);
    }

    /// Simulated time \[s\], if any was heard.
    pub fn now(&self) -> Option<f64> {
        self.now
    }

    /// How far time went back since last asked \[s\], if it did.
    pub(crate) fn jump_back(&mut self) -> Option<f64> {
        let jump = std::mem::take(&mut self.jump);
        (jump > 0.0).then_some(jump)
    }
}

impl Clock {
    /// The computer's time.
    pub fn system() -> Self {
        Self { simulated: None }
    }

    /// The simulator's time (`use_sim_time`), from `/clock` or what the node's rules make of it.
    ///
    /// # Errors
    /// As [`Node::subscription`].
    pub fn simulated(node: &Node) -> Result<Self, EdgeError> {
        let subscription = node.subscription(&node.topic("/clock")?, Quality::BEST_EFFORT)?;
        let reading = Reading::default();
        Ok(Self { simulated: Some(Simulated { since: Instant::now(), subscription, reading }) })
    }

    /// Hears what came since it was last read, and returns the time, as [`Clock::now`].
    pub fn read(&mut self) -> Option<f64> {
        if let Some(Simulated { since, subscription, reading }) = &mut self.simulated {
            for (message, _) in std::iter::from_fn(|| subscription.take()).take(MOST_AT_ONCE) {
                *since = Instant::now();
                reading.receive(message.clock.seconds());
            }
        }
        self.now()
    }

    /// Hears what came. Returns how far time went back \[s\] since it was last asked, if it did: everything stamped
    /// before then is from another run.
    pub fn poll(&mut self) -> Option<f64> {
        self.read();
        self.simulated.as_mut()?.reading.jump_back()
    }

    /// Seconds since the epoch; `None` while the simulator has not spoken.
    pub fn now(&self) -> Option<f64> {
        match &self.simulated {
            Some(simulated) => simulated.reading.now(),
            None => Some(system_time()),
        }
    }

    /// The simulator's topic, if nothing has come on it for some seconds.
    pub fn silent(&self) -> Option<&str> {
        let Simulated { since, subscription, .. } = self.simulated.as_ref()?;
        (since.elapsed() > PATIENCE).then(|| subscription.topic())
    }

    /// Whether time comes from `/clock`.
    pub(crate) fn is_simulated(&self) -> bool {
        self.simulated.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_backwards_is_reported_once() {
        let mut reading = Reading::default();
        assert_eq!(reading.now(), None);
        for time in [10.0, 10.5, 2.0, 2.5] {
            reading.receive(time);
        }
        assert_eq!(reading.now(), Some(2.5));
        assert_eq!(reading.jump_back(), Some(8.5));
        assert_eq!(reading.jump_back(), None);
    }
}
