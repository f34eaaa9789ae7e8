//! The node's part in the transitions of its lifecycle.
//!
//! `configure` opens the formation: it takes the topics and the frame from the parameters, begins the loop anew and opens
//! the topics of the robots. `cleanup` closes them; the loop keeps its state until the next `configure`. What stays
//! throughout are the services, the parameters, `/diagnostics`, where robots were last heard to be, and the emergency stop,
//! which outlasts every transition.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::endpoints::Endpoints;
use super::origin::Origin;
use super::settings::Settings;
use super::{FormationNode, NodeError};
use crate::messages::formation::diagnostics::Statistics;
use crate::messages::recorder::MessageRecorder;
use crate::ros::edge::lifecycle::{Goal, Lifecycle, Outcome};
use crate::ros::edge::parameters::Parameters;
use crate::swarm::control::Control;
use crate::swarm::pace::Pace;

/// The state that transitions change, beside the machine that asks for them.
pub(super) struct Transitions<'a> {
    origin: &'a mut Origin,
    control: &'a mut Control,
    endpoints: &'a mut Option<Endpoints>,
    recorder: &'a mut Option<MessageRecorder>,
    parameters: &'a Parameters,
    settings: &'a mut Settings,
    pace: &'a mut Pace,
    statistics: &'a mut Statistics,
    is_configured: &'a Arc<AtomicBool>,
    is_new: &'a mut bool,
    /// When the transitions are made \[s\].
    now: f64,
    /// Why the last `configure` failed.
    pub failure: Option<NodeError>,
}

impl FormationNode {
    /// The lifecycle, and what its transitions change at `now` \[s\].
    pub(super) fn transitions(&mut self, now: f64) -> (&mut Lifecycle, Transitions<'_>) {
        let transitions = Transitions {
            origin: &mut self.origin,
            control: &mut self.control,
            endpoints: &mut self.endpoints,
            recorder: &mut self.recorder,
            parameters: &self.parameters,
            settings: &mut self.settings,
            pace: &mut self.pace,
            statistics: &mut self.statistics,
            is_configured: &self.is_configured,
            is_new: &mut self.is_new,
            now,
            failure: None,
        };
        (&mut self.lifecycle, transitions)
    }
}

impl Transitions<'_> {
    /// Performs the action of a transition.
    pub fn act(&mut self, goal: Goal) -> Outcome {
        match goal {
            Goal::Configure => return self.configure(),
            Goal::Activate => self.control.set_active(true),
            Goal::Deactivate | Goal::ShutDown => self.control.set_active(false),
            Goal::CleanUp | Goal::Recover => self.clean_up(),
        }
        Outcome::Success
    }

    fn configure(&mut self) -> Outcome {
        self.origin.take_names(self.parameters);
        let open = || Endpoints::open(self.origin, &self.origin.fresh);
        match self.origin.check_topics().and_then(|()| open()) {
            Ok(mut endpoints) => {
                tracing::info!("{}", self.origin.robots_reached_at());
                self.begin_anew();
                endpoints.link.recorder = self.recorder.take();
                *self.endpoints = Some(endpoints);
                *self.is_new = true;
                self.is_configured.store(true, Ordering::Relaxed);
                Outcome::Success
            }
            Err(error) => {
                tracing::error!("not configured: {error}");
                self.failure = Some(error);
                Outcome::Failure
            }
        }
    }

    /// The loop as it was before its first tick, but for an emergency stop, the robots' last places and the parameters.
    fn begin_anew(&mut self) {
        self.control.begin_anew(&self.origin.fresh);
        self.control.set_active(false);
        self.settings.apply_all(self.parameters.iter(), self.control, self.pace);
    }

    fn clean_up(&mut self) {
        self.control.set_active(false);
        if let Some(mut endpoints) = self.endpoints.take() {
            // It may have been active until just now.
            endpoints.drive(self.control, false, &self.origin.header(self.now), self.statistics);
            *self.recorder = endpoints.link.recorder.take();
        }
        self.is_configured.store(false, Ordering::Relaxed);
    }
}
