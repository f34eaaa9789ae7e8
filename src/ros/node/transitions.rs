//! The node's part in the transitions of its lifecycle.
//!
//! `configure` opens the formation: it takes the topics and the frame from the parameters, begins the loop anew and opens
//! the topics of the robots. `cleanup` closes them; the loop keeps its state until the next `configure`. What stays
//! throughout are the services, the parameters, `/diagnostics`, where robots were last heard to be, and the emergency stop,
//! which outlasts every transition.

use std::sync::atomic::Ordering;

use super::FormationNode;
use super::endpoints::Endpoints;
use crate::ros::edge::lifecycle::{Goal, Lifecycle};

impl FormationNode {
    /// Lets the lifecycle go its way at `now` \[s\], while this node performs what its transitions ask for.
    pub(super) fn follow<T>(
        &mut self,
        now: f64,
        go: impl FnOnce(&mut Lifecycle, &mut dyn FnMut(Goal) -> bool) -> T,
    ) -> T {
        let mut lifecycle = std::mem::take(&mut self.lifecycle);
        let done = go(&mut lifecycle, &mut |goal| self.act(goal, now));
        self.lifecycle = lifecycle;
        done
    }

    /// Performs the action of a transition; false where it fails.
    fn act(&mut self, goal: Goal, now: f64) -> bool {
        match goal {
            Goal::Configure => return self.configure(),
            Goal::Activate => self.control.set_active(true),
            Goal::Deactivate | Goal::ShutDown => self.control.set_active(false),
            Goal::CleanUp => self.clean_up(now),
        }
        true
    }

    fn configure(&mut self) -> bool {
        self.origin.take_names(&self.parameters);
        let open = || Endpoints::open(&self.origin, &self.origin.fresh);
        match self.origin.check_topics().and_then(|()| open()) {
            Ok(mut endpoints) => {
                tracing::info!("{}", self.origin.robots_reached_at());
                self.begin_anew();
                endpoints.link.recorder = self.recorder.take();
                self.endpoints = Some(endpoints);
                self.is_new = true;
                self.is_configured.store(true, Ordering::Relaxed);
                true
            }
            Err(error) => {
                // A line of the log is one line.
                tracing::error!("not configured: {}", error.to_string().replace("\n  help: ", "; "));
                self.failure = Some(error);
                false
            }
        }
    }

    /// The loop as it was before its first tick, but for an emergency stop, the robots' last places and the parameters.
    fn begin_anew(&mut self) {
        self.control.begin_anew(&self.origin.fresh);
        self.control.set_active(false);
        self.settings.apply_all(self.parameters.iter(), &mut self.control, &mut self.pace);
    }

    fn clean_up(&mut self, now: f64) {
        self.control.set_active(false);
        if let Some(mut endpoints) = self.endpoints.take() {
            // It may have been active until just now.
            endpoints.drive(&self.control, false, now, &mut self.statistics);
            self.recorder = endpoints.link.recorder.take();
        }
        self.is_configured.store(false, Ordering::Relaxed);
    }
}
