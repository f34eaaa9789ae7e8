//! The session that viewers share: a body or a swarm, and what they have done with it.

use std::path::Path;

use serde_json::Value;

use super::command::Command;
use super::monitor::Monitor;
use crate::export::report::view::View;
use crate::flock::vectors::Vectors;
use crate::scene::{Place, Problem, SceneError};

/// A viewer, by the number of its connection.
pub type Viewer = u64;

/// Pairs of particles whose bond is broken, in the order in which they broke.
pub type Broken = Vec<[u32; 2]>;

/// The state of every particle or robot at a moment.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Step, or seconds.
    pub clock: f64,
    /// Displacements \[length\], shape \[count\].
    pub displacements: Vectors,
    /// Other quantities, those alone that a viewer looks at, shape \[channels\]\[count\].
    pub channels: Vec<Option<Vec<f64>>>,
}

/// Why something was not done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused(pub String);

impl From<&str> for Refused {
    fn from(words: &str) -> Self {
        Self(words.to_owned())
    }
}

impl From<String> for Refused {
    fn from(words: String) -> Self {
        Self(words)
    }
}

impl From<SceneError> for Refused {
    /// A viewer that sets a key has not typed `--set`.
    fn from(error: SceneError) -> Self {
        let words = |problem: &Problem| {
            let text = problem.to_string();
            let is_set = matches!(problem.place, Place::Override { .. });
            let place = format!("{}: ", problem.place);
            text.strip_prefix(&place).filter(|_| is_set).map_or_else(|| text.clone(), str::to_owned)
        };
        let lines: Vec<String> = error.problems().iter().map(words).collect();
        Self(lines.join("\n"))
    }
}

/// A body or a swarm under the hands of viewers. What a kind of session does not have is empty.
pub trait Session: Send {
    /// Takes a step, or flies a period.
    ///
    /// # Errors
    /// Why it goes on no further.
    fn advance(&mut self) -> Result<(), String> {
        Ok(())
    }

    /// Does what a viewer asks.
    ///
    /// # Errors
    /// Why it cannot be done; nothing has changed then.
    fn perform(&mut self, viewer: Viewer, command: &Command) -> Result<(), Refused>;

    /// Lets go of what a viewer holds, if it holds anything.
    fn release(&mut self, _viewer: Viewer) {}

    /// The file that replays what was done, as TOML; it names other files as they are found from `folder`, without one
    /// as the file does that the session began with.
    ///
    /// # Errors
    /// Why it cannot be written, or that nothing would take it.
    fn saved(&self, folder: Option<&Path>) -> Result<String, String>;

    /// The state of every particle, of a body with those channels alone that are wanted.
    fn frame(&self, wanted: &[bool]) -> Frame;

    /// Quantities that the page cannot compute from displacements.
    fn channels(&self) -> Vec<&'static str> {
        super::swarm::CHANNELS.to_vec()
    }

    /// Roles by number, shape \[count\].
    fn roles(&self) -> Vec<u8>;

    /// Bonds that are broken now, as the page's view knows them.
    fn broken(&self) -> Broken {
        Broken::new()
    }

    /// Changes whenever a page has to be built anew: with other particles, robots or neighbours.
    fn layout(&self) -> u64 {
        0
    }

    /// States that can be returned to.
    fn undoable(&self) -> usize {
        0
    }

    /// Keys that were changed and hold now, `KEY=VALUE`, in their order.
    fn sets(&self) -> Vec<String> {
        Vec::new()
    }

    /// Numbers that act though the file leaves them out, by key.
    fn defaults(&self) -> Vec<(String, Value)> {
        Vec::new()
    }

    /// What a hand can do to a body of this kind, by the tools' names.
    fn tools(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Steps or periods in a second at the usual speed \[1/s\].
    fn rate(&self) -> f64 {
        0.0
    }

    /// Sentences on what is wrong now, and the robots that they concern.
    fn alarms(&self) -> (Vec<String>, Vec<usize>) {
        Default::default()
    }

    /// How far each obstacle is from its place in the file \[length\].
    fn obstacles(&self) -> Vec<[f64; 2]> {
        Vec::new()
    }

    /// Robots with a fault, and its kind.
    fn faults(&self) -> Vec<(usize, &'static str)> {
        Vec::new()
    }

    /// How exactly followers keep to the leaders' motion, in words; `None` where the formation cannot be designed.
    fn exactness(&self) -> Option<Vec<String>> {
        None
    }

    /// The page's view of what there is now.
    fn view(&self) -> View;

    /// Short name and title of the file.
    fn title(&self) -> (&str, &str);

    /// The command that runs a saved file.
    fn runner(&self) -> &'static str;

    /// Whether it is of particles rather than robots.
    fn is_body(&self) -> bool {
        false
    }

    /// The file as it was read, defaults and overrides included.
    fn raw(&self) -> Value;

    /// The monitor, where another loop flies the robots.
    fn monitor(&self) -> Option<&Monitor> {
        None
    }

    /// The same, to take up its states.
    fn monitor_mut(&mut self) -> Option<&mut Monitor> {
        None
    }
}
