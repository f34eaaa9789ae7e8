//! A swarm that a loop of its own flies: its state as of the last tick, and what viewers ask of it.
//!
//! The loop never waits for a viewer. A [`Feed`] copies the loop's state when one is wanted, and only reads a flag
//! otherwise: without a viewer nothing is copied. Commands go to the loop over the [`CommandLink`] that the program
//! gives, and the loop's answers come back over it.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::command::Command;
use super::session::{Frame, Refused, Session, Viewer};
use super::swarm;
use crate::export::report::FlightRecorder;
use crate::export::report::view::View;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm as File;
use crate::swarm::control::{Control, Mode};
use crate::swarm::flight::Alarm;

/// A loop that has sent no state for so long is reported as silent.
const SILENT_AFTER: Duration = Duration::from_secs(1);

/// The loop's end: where it offers its state.
pub struct Feed {
    is_wanted: Arc<AtomicBool>,
    states: SyncSender<Control>,
}

impl Feed {
    /// Copies the state if a viewer waits for one; never blocks.
    pub fn offer(&self, control: &Control) {
        if self.is_wanted.swap(false, Ordering::Relaxed) {
            let _ = self.states.try_send(control.clone());
        }
    }
}

/// Sends a command to the loop without waiting for it, or returns the reason why not.
pub type SendCommand = Box<dyn Fn(Viewer, &Command) -> Result<(), Refused> + Send>;

/// The way of commands to the loop, and of its answers back.
pub struct CommandLink {
    /// Called in the thread of the session.
    pub send: SendCommand,
    /// For each viewer what was done, or the reason why not.
    pub answers: Receiver<(Viewer, Result<String, String>)>,
}

/// The viewers' end.
pub struct Monitor {
    file: File,
    control: Control,
    is_wanted: Arc<AtomicBool>,
    states: Receiver<Control>,
    /// Since when a state is waited for.
    asked: Option<Instant>,
    is_silent: bool,
    /// Absent where viewers may only read.
    commands: Option<CommandLink>,
}

impl Monitor {
    /// Of a loop that flies this swarm; without a link viewers may only read.
    ///
    /// # Errors
    /// Names the key of a swarm that cannot be laid out.
    pub fn new(file: File, commands: Option<CommandLink>) -> Result<(Self, Feed), SceneError> {
        let control = Control::new(&file)?;
        let (sender, states) = sync_channel(1);
        let is_wanted = Arc::new(AtomicBool::new(false));
        let feed = Feed { is_wanted: Arc::clone(&is_wanted), states: sender };
        Ok((Self { file, control, is_wanted, states, asked: None, is_silent: false, commands }, feed))
    }

    /// Takes up the loop's latest state, and asks for the next while it is watched. Returns whether there is something
    /// new to show.
    pub(super) fn poll(&mut self, is_watched: bool) -> bool {
        let state = self.states.try_iter().last();
        if !is_watched {
            // A state that was wanted before the last viewer left is old when the next one comes.
            self.asked = None;
            return false;
        }
        let is_new = state.is_some();
        if let Some(state) = state {
            self.control = state;
            self.asked = None;
        }
        let asked = *self.asked.get_or_insert_with(|| {
            self.is_wanted.store(true, Ordering::Relaxed);
            Instant::now()
        });
        let was_silent = std::mem::replace(&mut self.is_silent, asked.elapsed() > SILENT_AFTER);
        is_new || self.is_silent != was_silent
    }

    /// Answers of the loop since the last call.
    pub(super) fn answers(&self) -> impl Iterator<Item = (Viewer, Result<String, String>)> + '_ {
        self.commands.iter().flat_map(|link| link.answers.try_iter())
    }

    /// Whether viewers may send commands.
    pub(crate) fn takes_commands(&self) -> bool {
        self.commands.is_some()
    }

    /// Names of the manoeuvres that a command may start.
    pub fn manoeuvres(&self) -> Vec<&str> {
        self.control.formation().manoeuvres.iter().map(|manoeuvre| manoeuvre.name.as_str()).collect()
    }

    /// The loop's mode, and the posture that its leaders have by their program.
    pub fn status(&self) -> Value {
        let formation = self.control.formation();
        let posture = formation.posture(formation.middle(), self.control.program_time());
        let mode = match self.control.mode() {
            Mode::Running => "running",
            Mode::EmergencyStopped => "emergency stop: every robot comes to rest and holds its place",
            Mode::Inactive => "inactive: no targets are sent",
        };
        json!({
            "mode": mode,
            "translate": posture.translate,
            "rotate": posture.rotate,
            "stretch": posture.stretch,
            "shear": posture.shear,
        })
    }
}

impl Session for Monitor {
    fn perform(&mut self, viewer: Viewer, command: &Command) -> Result<(), Refused> {
        let link = self.commands.as_ref();
        let link = link.ok_or("this view is for reading alone: start the node with --allow-commands")?;
        (link.send)(viewer, command)
    }

    fn saved(&self, _folder: Option<&Path>) -> Result<String, String> {
        Err("what a node flies is kept by --record".into())
    }

    /// The clock is that of the leaders' programs.
    fn frame(&self, _wanted: &[bool]) -> Frame {
        let mut clearance = Vec::new();
        self.control.clearance(&mut clearance);
        let (control, places) = (&self.control, self.control.last_places());
        let target = |m: usize| control.target(m);
        let mut frame = swarm::frame(control, &places, &clearance, &target, control.program_time());
        // Poses alone tell no motion.
        frame.channels.extend([None, None]);
        frame
    }

    fn roles(&self) -> Vec<u8> {
        swarm::roles(&self.control)
    }

    /// A silent loop too.
    fn alarms(&self) -> (Vec<String>, Vec<usize>) {
        let alarms = Alarm::of_poses(&self.file, &self.control);
        let (words, robots) = swarm::in_words(&alarms, &self.control.formation().names);
        let silent = "the control loop has sent no state for more than 1 s: what is shown is old".to_owned();
        (self.is_silent.then_some(silent).into_iter().chain(words).collect(), robots)
    }

    fn obstacles(&self) -> Vec<[f64; 2]> {
        self.control.filter().obstacles().moved().collect()
    }

    /// Robots without a usable pose, and what is known of it.
    fn faults(&self) -> Vec<(usize, &'static str)> {
        let health = |m: usize| self.control.health(m);
        let count = self.control.formation().count();
        (0..count).filter(|&m| !health(m).is_usable()).map(|m| (m, health(m).name())).collect()
    }

    fn view(&self) -> View {
        FlightRecorder::still(&self.file, &self.control, &self.control.last_places(), false)
    }

    fn title(&self) -> (&str, &str) {
        (&self.file.name, &self.file.raw.title)
    }

    fn runner(&self) -> &'static str {
        "node"
    }

    fn raw(&self) -> Value {
        serde_json::to_value(&self.file.raw).unwrap_or_default()
    }

    fn monitor(&self) -> Option<&Monitor> {
        Some(self)
    }

    fn monitor_mut(&mut self) -> Option<&mut Monitor> {
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::examples::bundled;

    fn monitor() -> (Monitor, Feed, Control) {
        let file = bundled("square", &[]);
        let control = Control::new(&file).expect("laid out");
        let (monitor, feed) = Monitor::new(file, None).expect("laid out");
        (monitor, feed, control)
    }

    /// A loop that waits for a viewer would wait for ever.
    fn within_a_minute(work: impl FnOnce() + Send + 'static) {
        let (done, ended) = sync_channel(1);
        std::thread::spawn(move || {
            work();
            done.send(())
        });
        assert!(ended.recv_timeout(Duration::from_secs(60)).is_ok(), "it failed, or does not end");
    }

    #[test]
    fn a_state_is_copied_when_a_viewer_waits_for_one_and_never_otherwise() {
        within_a_minute(|| {
            let (mut monitor, feed, mut control) = monitor();
            let mut tick = || {
                control.tick(control.ticks() as f64 * 0.05);
                feed.offer(&control);
            };
            (0..3).for_each(|_| tick());
            assert!(!monitor.poll(false) && monitor.states.try_recv().is_err(), "without a viewer");
            assert!(!monitor.poll(true), "wanted from now on");
            (0..3).for_each(|_| tick());
            assert!(monitor.poll(true) && monitor.control.ticks() == 4, "the first after that");
            (0..3).for_each(|_| tick());
            assert!(monitor.poll(true) && monitor.control.ticks() == 7);
            // One that was still wanted when the last viewer left is not shown to the next.
            tick();
            assert!(!monitor.poll(false) && !monitor.poll(true));
        });
    }

    #[test]
    fn a_loop_does_not_wait_for_a_viewer_that_takes_nothing() {
        within_a_minute(|| {
            let (mut monitor, feed, control) = monitor();
            monitor.poll(true);
            for _ in 0..100 {
                feed.is_wanted.store(true, Ordering::Relaxed);
                feed.offer(&control);
            }
            assert!(monitor.poll(true) && !monitor.poll(true), "one state is kept");
        });
    }

    #[test]
    fn a_silent_loop_is_reported() {
        let (mut monitor, feed, control) = monitor();
        monitor.poll(true);
        monitor.asked = Instant::now().checked_sub(2 * SILENT_AFTER);
        assert!(monitor.poll(true) && !monitor.poll(true), "said once");
        assert!(monitor.alarms().0[0].contains("no state"));
        feed.offer(&control);
        assert!(monitor.poll(true) && monitor.alarms().0.is_empty());
    }
}
