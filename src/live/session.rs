//! The session that viewers share: a body or a swarm, and what they have done with it.

use super::body::Body;
use super::command::Command;
use super::monitor::Monitor;
use super::swarm::Swarm;
use crate::export::report::view::View;
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
    /// Displacements along x and y \[length\], shape \[2\]\[count\].
    pub places: [Vec<f32>; 2],
    /// Other quantities, those alone that a viewer looks at, shape \[channels\]\[count\].
    pub channels: Vec<Option<Vec<f32>>>,
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

/// A body or a swarm under the hands of viewers.
pub enum Session {
    /// Particles that are stepped.
    Body(Box<Body>),
    /// Robots that fly.
    Swarm(Box<Swarm>),
    /// Robots that another loop flies.
    Monitor(Box<Monitor>),
}

impl Session {
    /// Takes a step, or flies a period.
    ///
    /// # Errors
    /// Why it goes on no further.
    pub fn advance(&mut self) -> Result<(), String> {
        match self {
            Session::Body(body) => body.advance(),
            Session::Swarm(swarm) => {
                swarm.advance();
                Ok(())
            }
            Session::Monitor(_) => Ok(()),
        }
    }

    /// Does what a viewer asks.
    ///
    /// # Errors
    /// Why it cannot be done; nothing has changed then.
    pub fn perform(&mut self, viewer: Viewer, command: &Command) -> Result<(), Refused> {
        match self {
            Session::Body(body) => body.perform(viewer, command),
            Session::Swarm(swarm) => swarm.perform(viewer, command),
            Session::Monitor(monitor) => monitor.perform(viewer, command),
        }
    }

    /// Lets go of what a viewer that is gone held.
    pub fn release(&mut self, viewer: Viewer) {
        match self {
            Session::Body(body) => body.release(viewer),
            Session::Swarm(swarm) => swarm.release(viewer),
            Session::Monitor(_) => {}
        }
    }

    /// The file that replays what was done, as TOML.
    ///
    /// # Errors
    /// Why it cannot be written.
    pub fn saved(&self) -> Result<String, String> {
        match self {
            Session::Body(body) => body.saved(),
            Session::Swarm(swarm) => swarm.saved(),
            Session::Monitor(_) => Err("what a node flies is kept by --record".into()),
        }
    }

    /// The state of every particle, of a body with those channels alone that are wanted.
    pub fn frame(&self, wanted: &[bool]) -> Frame {
        match self {
            Session::Body(body) => body.frame(wanted),
            Session::Swarm(swarm) => swarm.frame(),
            Session::Monitor(monitor) => monitor.frame(),
        }
    }

    /// Quantities that the page cannot compute from displacements.
    pub fn channels(&self) -> Vec<&'static str> {
        match self {
            Session::Body(body) => body.channels(),
            Session::Swarm(_) | Session::Monitor(_) => super::swarm::CHANNELS.to_vec(),
        }
    }

    /// Roles by number, shape \[count\].
    pub fn roles(&self) -> Vec<u8> {
        match self {
            Session::Body(body) => body.engine().roles().iter().map(|role| role.number()).collect(),
            Session::Swarm(swarm) => swarm.roles(),
            Session::Monitor(monitor) => monitor.roles(),
        }
    }

    /// Bonds that are broken now.
    pub fn broken(&self) -> Broken {
        match self {
            Session::Body(body) => body.broken(),
            Session::Swarm(_) | Session::Monitor(_) => Broken::new(),
        }
    }

    /// How many bonds are broken now.
    pub fn broken_count(&self) -> usize {
        match self {
            Session::Body(body) => body.engine().breaks().len(),
            Session::Swarm(_) | Session::Monitor(_) => 0,
        }
    }

    /// Changes whenever a page has to be built anew.
    pub fn layout(&self) -> u64 {
        match self {
            Session::Body(body) => body.layout(),
            Session::Swarm(swarm) => swarm.layout(),
            Session::Monitor(_) => 0,
        }
    }

    /// Things that can be undone.
    pub fn undoable(&self) -> usize {
        match self {
            Session::Body(body) => body.undoable(),
            Session::Swarm(swarm) => swarm.undoable(),
            Session::Monitor(_) => 0,
        }
    }

    /// Keys that were changed and hold now, `KEY=VALUE`, in their order.
    pub fn sets(&self) -> Vec<String> {
        match self {
            Session::Body(body) => body.sets(),
            Session::Swarm(swarm) => swarm.sets(),
            Session::Monitor(_) => Vec::new(),
        }
    }

    /// Numbers that act though the file leaves them out, by key.
    pub fn defaults(&self) -> Vec<(String, serde_json::Value)> {
        match self {
            Session::Body(body) => body.defaults(),
            Session::Swarm(_) | Session::Monitor(_) => Vec::new(),
        }
    }

    /// What a hand can do to a body of this kind, by the tools' names.
    pub fn tools(&self) -> Vec<&'static str> {
        let Session::Body(body) = self else { return Vec::new() };
        let tools = [("cut", body.takes_cuts()), ("load", body.takes_loads())];
        tools.into_iter().filter(|(_, is)| *is).map(|(name, _)| name).collect()
    }

    /// Steps or periods in a second at the usual speed \[1/s\].
    pub fn rate(&self) -> f64 {
        /// As fast as screens are drawn.
        const STEPS: f64 = 60.0;
        match self {
            Session::Body(_) => STEPS,
            Session::Swarm(swarm) => 1.0 / swarm.period(),
            Session::Monitor(_) => 0.0,
        }
    }

    /// Sentences on what is wrong now, and the robots that they concern.
    pub fn alarms(&self) -> (Vec<String>, Vec<usize>) {
        match self {
            Session::Body(_) => (Vec::new(), Vec::new()),
            Session::Swarm(swarm) => swarm.alarms(),
            Session::Monitor(monitor) => monitor.alarms(),
        }
    }

    /// How far each obstacle is from its place in the file \[length\].
    pub fn obstacles(&self) -> Vec<[f64; 2]> {
        match self {
            Session::Body(_) => Vec::new(),
            Session::Swarm(swarm) => swarm.obstacles(),
            Session::Monitor(monitor) => monitor.obstacles(),
        }
    }

    /// Robots with a fault, and its kind.
    pub fn faults(&self) -> Vec<(usize, &'static str)> {
        match self {
            Session::Body(_) => Vec::new(),
            Session::Swarm(swarm) => swarm.faults(),
            Session::Monitor(monitor) => monitor.faults(),
        }
    }

    /// Remarks on a formation that can be designed.
    pub fn design(&self) -> Option<Vec<String>> {
        match self {
            Session::Swarm(swarm) => swarm.exactness(),
            Session::Body(_) | Session::Monitor(_) => None,
        }
    }

    /// The page's view of what there is now.
    pub fn view(&self) -> View {
        match self {
            Session::Body(body) => body.view(),
            Session::Swarm(swarm) => swarm.view(),
            Session::Monitor(monitor) => monitor.view(),
        }
    }

    /// Short name and title of the file.
    pub fn title(&self) -> (&str, &str) {
        match self {
            Session::Body(body) => (&body.scene().name, &body.scene().raw.title),
            Session::Swarm(swarm) => (&swarm.swarm().name, &swarm.swarm().raw.title),
            Session::Monitor(monitor) => (&monitor.swarm().name, &monitor.swarm().raw.title),
        }
    }

    /// The command that runs a saved file.
    pub fn runner(&self) -> &'static str {
        match self {
            Session::Body(_) => "run",
            Session::Swarm(_) => "swarm",
            Session::Monitor(_) => "node",
        }
    }

    /// The file as it was read, defaults and overrides included.
    pub fn raw(&self) -> serde_json::Value {
        match self {
            Session::Body(body) => serde_json::to_value(&body.scene().raw),
            Session::Swarm(swarm) => serde_json::to_value(&swarm.swarm().raw),
            Session::Monitor(monitor) => serde_json::to_value(&monitor.swarm().raw),
        }
        .unwrap_or_default()
    }
}
