//! `flockform node`: the control loop over ROS 2.
//!
//! One thread ticks at a steady rate, that of a simulator's clock where it goes by one: it takes what arrived, calls [`Control::tick`] and lays what it publishes into
//! bounded queues. Everything it holds is polled; a peer that is slow, gone or wrong cannot hold it up, and a
//! middleware that does ends the process ([`pulse`](super::edge::pulse)).

mod commands;
mod drive;
mod endpoints;
mod error;
mod kept;
mod link;
mod origin;
pub(super) mod pose;
pub(super) mod settings;
mod transitions;
pub(super) mod uses;

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Instant;

use super::arguments::{NameError, Names, RosArguments};
use super::edge::clock::Clock;
use super::edge::descriptions::TypeDescriptions;
use super::edge::lifecycle::{Lifecycle, State, Transition};
use super::edge::loggers::{LogLevel, Loggers};
use super::edge::parameters::{Change, Parameters};
use super::edge::pulse::Pulse;
use super::edge::rosout::Rosout;
use super::edge::{EdgeError, Publisher, Quality, Service, Subscription};
use super::network;
use crate::messages::Message;
use crate::messages::diagnostic_msgs::DiagnosticArray;
use crate::messages::flockform_msgs::{LoopEvent, SetFormation, SetFormationResponse};
pub use crate::messages::formation::NAME;
use crate::messages::formation::diagnostics::{self, Statistics};
use crate::messages::rcl_interfaces::Log;
use crate::messages::recorder::{self, MessageRecorder, RecordSink};
use crate::messages::std_msgs::Empty;
use crate::messages::std_srvs;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawService;
use crate::swarm::control::scope::NodeScope;
use crate::swarm::control::{Control, Mode};
use crate::swarm::pace::{Pace, system_time};
use crate::swarm::plan::cautions;
use crate::swarm::transport::complaints::Complaints;
use crate::swarm::transport::{ControllerEnd, listen, targets};
pub use commands::{Answer, CommandQueue, NodeCommand};
use commands::{Commanded, MOST_AT_ONCE, not_allowed};
use endpoints::Endpoints;
pub use error::NodeError;
pub use kept::NodeSnapshot;
pub use link::Link;
use origin::Origin;
use settings::Settings;

/// Events that wait for the time at most: a peer that goes on asking before there is one.
const MOST_UNTIMED: usize = 10_000;

/// A formation's node.
pub struct FormationNode {
    clock: Clock,
    pace: Pace,
    control: Control,
    settings: Settings,
    parameters: Parameters,
    lifecycle: Lifecycle,
    /// Why the last `configure` failed.
    failure: Option<NodeError>,
    stop: Service<std_srvs::Trigger>,
    /// The same by topic; none where nothing may stop the node.
    stop_requests: Option<Subscription<Empty>>,
    resume: Service<std_srvs::Trigger>,
    set_formation: Service<SetFormation>,
    /// Of the program around the node, where it has any.
    queue: Option<CommandQueue>,
    descriptions: Option<TypeDescriptions>,
    /// Of a log whose level can change.
    loggers: Option<Loggers>,
    rosout: Option<Rosout>,
    /// Of a configured node.
    endpoints: Option<Endpoints>,
    /// As `endpoints.is_some()`, for the parameters that only a node that is not configured can change.
    is_configured: Arc<AtomicBool>,
    /// Whether the loop has begun anew since the last tick; it is recorded.
    is_new: bool,
    /// Whether a command has changed what outlasts the process since that was last asked.
    is_changed: Cell<bool>,
    /// Gets a copy of what goes through; with the topics while there are any.
    recorder: Option<MessageRecorder>,
    /// Kinds, texts and values of events for the recorder from before a simulator's clock has said the time.
    untimed: Vec<(u8, String, Vec<f64>)>,
    diagnostics: Publisher<DiagnosticArray>,
    statistics: Statistics,
    /// Poses that had come when the watchdog last asked.
    came: u64,
    complaints: Complaints,
    /// Whether the present silence of the clock was reported.
    has_missed_clock: bool,
    /// Whether the node was active at the last tick; a change is recorded.
    was_active: bool,
    /// Of the watchdog, where there is one.
    pulse: Option<Arc<Pulse>>,
    // Dropped after all that was made from it.
    origin: Origin,
}

impl FormationNode {
    /// Takes part in the network: for all members, or for one, which hears those that [`NodeScope`] says.
    ///
    /// # Errors
    /// An obstacle in the swarm file, the ROS arguments or the network.
    pub fn open(swarm: &Swarm, arguments: &RosArguments, member: Option<&str>) -> Result<Self, NodeError> {
        let mut control = Control::new(swarm)?;
        let part = NodeScope::take(swarm, &mut control, member)?;
        let names = names(arguments, member)?;
        let edge = network::join(arguments)?;
        let node = edge.named_node(&names)?;
        let raw = &swarm.raw.node;
        let stop_topic = raw.commands.may_stop().then(|| names.fleet_topic(&raw.emergency_stop_topic));
        let stop_topic = stop_topic.transpose()?;
        stop_topic.iter().for_each(|topic| node.keep_for_commands(topic));

        let is_configured = Arc::default();
        let (settings, store) = settings::declare(&control, arguments, &names, swarm, &part, &is_configured)?;
        check_commands(swarm, settings.autostart)?;
        let clock = if settings.use_sim_time { Clock::simulated(&node)? } else { Clock::system() };
        let service = |leaf: &str| names.service(&format!("~/{leaf}")).map_err(NodeError::from);
        control.set_active(false);
        let mut this = Self {
            pace: if clock.is_simulated() {
                Pace::following(settings.rate)
            } else {
                Pace::new(settings.rate)
            },
            parameters: Parameters::open(&node, store, raw.serves(RawService::Parameters))?,
            lifecycle: Lifecycle::open(
                &node,
                [RawService::Lifecycle, RawService::TransitionEvents].map(|kind| raw.serves(kind)),
            )?,
            failure: None,
            stop: node.service(&service("emergency_stop")?)?,
            stop_requests: stop_topic
                .map(|topic| node.subscription(&topic, Quality::reliable(1)))
                .transpose()?,
            resume: node.service(&service("resume")?)?.from_now_on(),
            set_formation: node.service(&service("set_formation")?)?.from_now_on(),
            queue: None,
            descriptions: raw
                .serves(RawService::TypeDescription)
                .then(|| TypeDescriptions::new(&node))
                .transpose()?,
            loggers: None,
            rosout: None,
            endpoints: None,
            is_configured,
            is_new: false,
            is_changed: Cell::new(false),
            recorder: None,
            untimed: Vec::new(),
            diagnostics: node.publisher(&names.topic("/diagnostics")?, Quality::reliable(5))?,
            statistics: Statistics::default(),
            came: 0,
            complaints: Complaints::default(),
            has_missed_clock: false,
            was_active: false,
            pulse: None,
            origin: Origin {
                simulated_time: clock.is_simulated(),
                swarm: swarm.clone(),
                fresh: control.clone(),
                names,
                part,
                node,
            },
            clock,
            settings,
            control,
        };
        this.settings.apply_all(this.parameters.iter(), &mut this.control, &mut this.pace);
        cautions::of_real_robots(&this.control, &this.origin.part)
            .for_each(|caution| tracing::warn!("{caution}"));
        this.origin.take_names(&this.parameters);
        this.origin.check_topics()?;
        if this.settings.autostart {
            this.start()?;
        }
        Ok(this)
    }

    fn start(&mut self) -> Result<(), NodeError> {
        let now = self.time();
        self.follow(now, |lifecycle, act| lifecycle.autostart(now, act));
        self.failure.take().map_or(Ok(()), Err)
    }

    /// By its clock, or by the computer's where it has none yet \[s\].
    fn time(&self) -> f64 {
        self.clock.now().unwrap_or_else(system_time)
    }

    /// Gives a copy of everything from now on to `sink`.
    ///
    /// # Errors
    /// A name that no topic can have.
    pub fn record(&mut self, sink: RecordSink) -> Result<(), NameError> {
        let origin = &self.origin;
        let recorder = MessageRecorder::new(&origin.names, &origin.swarm.raw.node.frame_id, sink)?;
        *self.recorder() = Some(recorder);
        self.record_parameters(self.time());
        self.is_new = false;
        Ok(())
    }

    /// Lets peers read and set the level of this log, where the swarm file asks for that, and publishes its lines.
    ///
    /// # Errors
    /// A service or a topic that the middleware refuses.
    pub fn share_log(
        &mut self,
        level: Option<LogLevel>,
        lines: Option<Receiver<Log>>,
    ) -> Result<(), EdgeError> {
        let Origin { node, swarm, .. } = &self.origin;
        let level = level.filter(|_| swarm.raw.node.serves(RawService::LoggerLevels));
        self.loggers = level.map(|level| Loggers::new(node, level)).transpose()?;
        self.rosout = lines.map(|lines| Rosout::new(node, lines)).transpose()?;
        Ok(())
    }

    /// Takes commands of this queue from now on, as those of peers.
    pub fn take_commands(&mut self, queue: CommandQueue) {
        self.queue = Some(queue);
    }

    /// Has a watchdog end this process when the middleware is dead or deaf: for programs that are started again.
    ///
    /// # Errors
    /// A computer that gives no socket or thread.
    pub fn watch_middleware(&mut self) -> Result<(), EdgeError> {
        self.pulse = Some(self.origin.node.watch()?);
        Ok(())
    }

    /// Ticks until `stop` is set.
    pub fn run(&mut self, stop: &AtomicBool) {
        self.run_while(stop, &mut |_| true);
    }

    /// Ticks until `stop` is set or `look` has seen enough; false if the watchdog came first. `look` is shown the node
    /// after each tick and, under a simulator's clock, at least once in a period of the computer's.
    pub fn run_while(&mut self, stop: &AtomicBool, look: &mut dyn FnMut(&Self) -> bool) -> bool {
        while !stop.load(Ordering::Relaxed) {
            let due = self.wait();
            match due {
                Some(missed) => {
                    self.statistics.missed += missed;
                    self.tick();
                }
                None => {
                    self.attend();
                    self.diagnose(self.time(), false);
                }
            }
            let hears_any = self.pulse.is_some() && self.hears_any();
            if let Some(pulse) = &self.pulse {
                match &self.endpoints {
                    // Poses come in by ticks: while a simulator's time stands, that there are none means nothing.
                    Some(endpoints) if due.is_some() || hears_any => {
                        pulse.note_peers(hears_any, || endpoints.link.left());
                    }
                    _ => pulse.listens_to_none(),
                }
            }
            if self.pulse.as_ref().is_some_and(|pulse| pulse.is_given_up()) {
                self.control.set_active(false);
                self.publish(self.time(), false);
                return false;
            }
            if !look(self) {
                break;
            }
        }
        self.pulse.iter().for_each(|pulse| pulse.leave());
        let now = self.time();
        self.follow(now, |lifecycle, act| lifecycle.shut_down(now, act));
        // Robots that are driven by velocities would go on for ever.
        self.publish(now, self.lifecycle.is_active());
        self.record_untimed(now);
        self.rosout.iter().for_each(Rosout::publish);
        true
    }

    pub fn control(&self) -> &Control {
        &self.control
    }

    /// Namespace of the fleet and its topics.
    pub fn fleet(&self) -> &str {
        self.origin.names.fleet()
    }

    /// Overrides by which the swarm file that the node was opened with has the names that its parameters give.
    pub fn overrides(&self, swarm: &Swarm) -> Vec<String> {
        self.origin.overrides(swarm)
    }

    /// Where the node can be reached, in words.
    pub fn reached_at(&self) -> String {
        self.origin.reached_at()
    }

    /// Whether a pose is of use, or any came since this was last asked: one that is not believed is heard as well.
    fn hears_any(&mut self) -> bool {
        let heard = || self.origin.part.heard.iter();
        let refused = self.endpoints.as_ref().map_or(0, |endpoints| endpoints.link.refused());
        let came = heard().map(|&m| self.control.watch().counts(m).all()).sum::<u64>() + refused;
        let is_any = came != self.came || heard().any(|&m| self.control.health(m).is_usable());
        self.came = came;
        is_any
    }

    /// Where the recorder is: with the topics of a configured node.
    fn recorder(&mut self) -> &mut Option<MessageRecorder> {
        match &mut self.endpoints {
            Some(endpoints) => &mut endpoints.link.recorder,
            None => &mut self.recorder,
        }
    }

    /// Sleeps until a tick is due, as [`Pace::follow`].
    fn wait(&mut self) -> Option<u64> {
        let Self { pace, clock, pulse, .. } = self;
        pace.follow(&mut || {
            let _inside = pulse.as_ref().map(|pulse| pulse.inside());
            clock.read()
        })
    }

    /// What is done whether or not a simulator's time goes on: commands, the log, a word about a clock that is silent.
    fn attend(&mut self) {
        let pulse = self.pulse.clone();
        let _inside = pulse.as_ref().map(|pulse| pulse.inside());
        if let Some(jump) = self.clock.poll() {
            tracing::warn!("time went back by {jump} s: waiting for poses of the new time");
        }
        let stamp = self.time();
        if self.clock.now().is_some() || self.untimed.len() > MOST_UNTIMED {
            self.record_untimed(stamp);
        }
        self.answer(stamp);
        if !self.lifecycle.is_active() {
            self.publish(stamp, false);
        }
        self.rosout.iter().for_each(Rosout::publish);
        self.watch_clock(stamp);
    }

    /// One period: what arrived, the targets, what is published.
    pub fn tick(&mut self) {
        let begun = Instant::now();
        self.attend();
        // Without a clock poses have no age, and none can be accepted.
        let Some(now) = self.clock.now() else { return };
        let pulse = self.pulse.clone();
        let inside = pulse.as_ref().map(|pulse| pulse.inside());
        if let Some(endpoints) = &mut self.endpoints {
            listen(&mut self.control, &mut endpoints.link, &mut self.complaints, now);
            endpoints.warn_of_silence(&self.control, &self.origin);
        }
        drop(inside);
        self.record_event(now, LoopEvent::TICK, "", &[now]);
        self.control.tick(now);
        self.publish(now, self.lifecycle.is_active());
        self.statistics.tick(begun.elapsed().as_secs_f64());
        self.report(now);
    }

    /// Says that the clock is silent: once in the log, and in diagnostics.
    fn watch_clock(&mut self, stamp: f64) {
        let trouble = self.no_clock();
        let was_missed = std::mem::replace(&mut self.has_missed_clock, trouble.is_some());
        let Some(trouble) = trouble else { return };
        if !was_missed {
            tracing::warn!("{trouble}");
        }
        self.diagnose(stamp, false);
    }

    fn no_clock(&self) -> Option<String> {
        let topic = self.clock.silent()?;
        let since = if self.clock.now().is_some() { " for three seconds" } else { "" };
        Some(format!(
            "use_sim_time is true and no time has come on {topic}{since}: no robot moves until one does"
        ))
    }

    fn apply(&mut self, changes: &[Change], now: f64) {
        for change in changes {
            let Change { name, value } = change;
            self.settings.apply(name, value, &mut self.control, &mut self.pace);
            let name = if name == "rate" { "period" } else { name };
            let value = recorder::parameters(&self.control).into_iter().find(|(one, _)| *one == name);
            if let Some((name, value)) = value {
                self.record_event(now, LoopEvent::PARAMETER, name, &[value]);
            }
        }
    }

    fn answer(&mut self, now: f64) {
        let allowed = self.origin.swarm.raw.node.commands;
        let may_switch = |edge: &Transition| {
            allowed.may_do_all() || (allowed.may_stop() && ["deactivate", "shutdown"].contains(&edge.label))
        };
        let own: Vec<(u64, NodeCommand)> =
            self.queue.iter().flat_map(|queue| queue.commands.try_iter().take(MOST_AT_ONCE)).collect();
        let own_transition = own.iter().find_map(|(_, command)| match command {
            NodeCommand::ChangeState(label) => Some(*label),
            _ => None,
        });
        let pulse = self.pulse.clone();
        let changed = self.follow(now, |lifecycle, act| {
            let mut act = |goal| match &pulse {
                Some(pulse) => pulse.untimed(|| act(goal)),
                None => act(goal),
            };
            lifecycle.poll(now, &may_switch, &mut act);
            // After those of peers, which it cannot keep out.
            own_transition.is_some_and(|label| lifecycle.change(0, label, now, &may_switch, &mut act))
        });
        self.record_beginning(now);
        if self.lifecycle.is_active() != self.was_active {
            self.was_active = self.lifecycle.is_active();
            self.is_changed.set(true);
            let kind = if self.was_active { LoopEvent::ACTIVE } else { LoopEvent::INACTIVE };
            self.record_event(now, kind, "", &[]);
        }
        let not_allowed = not_allowed(allowed);
        let locked = (!allowed.may_do_all()).then_some(not_allowed.as_str());
        if let Some(loggers) = &self.loggers {
            loggers.serve(locked);
        }
        self.descriptions.iter().for_each(TypeDescriptions::serve);
        let changes = self.parameters.poll(now, locked);
        self.apply(&changes, now);
        let mut commanded = Commanded {
            control: &mut self.control,
            allowed,
            is_configured: self.endpoints.is_some(),
            alone: self.origin.alone(),
            is_finalized: self.lifecycle.state() == State::Finalized,
            events: Vec::new(),
        };
        // A peer that goes on asking asks for what is so already.
        if self.stop_requests.as_ref().is_some_and(|requests| requests.take_last().is_some())
            && commanded.control.mode() != Mode::EmergencyStopped
            && commanded.perform(&NodeCommand::EmergencyStop).is_ok()
        {
            tracing::warn!("emergency stop by topic");
        }
        let outcome = |answer: Answer| {
            let (success, message) = (answer.is_ok(), answer.unwrap_or_else(|refused| refused));
            std_srvs::Outcome { success, message }
        };
        self.stop.serve(|_| outcome(commanded.perform(&NodeCommand::EmergencyStop)));
        self.resume.serve(|_| outcome(commanded.perform(&NodeCommand::Resume)));
        self.set_formation.serve(|request| {
            let answer = outcome(commanded.perform(&NodeCommand::SetFormation(request)));
            SetFormationResponse { success: answer.success, message: answer.message }
        });
        let mut transition = own_transition.map(|label| match (changed, locked) {
            (true, _) => Ok(format!("{label}: done")),
            (false, Some(reason)) => Err(reason.to_owned()),
            (false, None) => {
                Err(format!("{label}: not possible, the node is {}", self.lifecycle.state().name()))
            }
        });
        for (number, command) in own {
            let is_transition = matches!(command, NodeCommand::ChangeState(_));
            let answer = is_transition.then(|| transition.take()).flatten();
            let answer = answer.unwrap_or_else(|| commanded.perform(&command));
            self.queue.iter().for_each(|queue| drop(queue.answers.try_send((number, answer.clone()))));
        }
        if !changes.is_empty() || !commanded.events.is_empty() {
            self.is_changed.set(true);
        }
        for (kind, text, values) in commanded.events {
            self.record_event(now, kind, &text, &values);
        }
    }

    /// Whether a command has changed what outlasts the process since this was last asked.
    pub fn has_changed(&self) -> bool {
        self.is_changed.take()
    }

    /// Problems of the network around the node, and of its clock.
    fn troubles(&self) -> Vec<String> {
        let node = &self.origin.node;
        let twins = node.twins();
        let twin = |of: &str| format!("{twins} other node{of} the name {}", node.name());
        let twin = match twins {
            0 => None,
            1 => Some(twin(" has")),
            _ => Some(twin("s have")),
        };
        twin.into_iter().chain(self.no_clock()).collect()
    }

    /// An event at `now` \[s\]; where the clock has no time yet, at the first that it has: a recording has one kind of time.
    fn record_event(&mut self, now: f64, kind: u8, text: &str, values: &[f64]) {
        let has_time = self.clock.now().is_some();
        match self.recorder() {
            Some(recorder) if has_time => recorder.event(now, kind, text, values),
            Some(_) => self.untimed.push((kind, text.to_owned(), values.to_vec())),
            None => {}
        }
    }

    /// The events from before there was a time.
    fn record_untimed(&mut self, now: f64) {
        for (kind, text, values) in std::mem::take(&mut self.untimed) {
            if let Some(recorder) = self.recorder() {
                recorder.event(now, kind, &text, &values);
            }
        }
    }

    /// A loop that has begun anew, with its parameters.
    fn record_beginning(&mut self, now: f64) {
        if !std::mem::take(&mut self.is_new) {
            return;
        }
        self.record_event(now, LoopEvent::CONFIGURE, "", &[]);
        self.record_parameters(now);
    }

    fn record_parameters(&mut self, now: f64) {
        for (name, value) in recorder::parameters(&self.control) {
            self.record_event(now, LoopEvent::PARAMETER, name, &[value]);
        }
    }

    /// Publishes targets and velocities.
    fn publish(&mut self, now: f64, active: bool) {
        let Some(endpoints) = &mut self.endpoints else { return };
        if active {
            let sent = endpoints.link.send(now, &targets(&self.control, &self.origin.part));
            self.statistics.sent(sent);
        }
        endpoints.drive(&self.control, active, now, &mut self.statistics);
    }

    fn diagnosis(&mut self, now: f64) -> DiagnosticArray {
        let refused = self.endpoints.as_ref().map_or(0, |endpoints| endpoints.link.refused());
        let troubles = self.troubles();
        let names = [self.origin.node.name(), &self.origin.swarm.name];
        let (header, is_configured) = (self.origin.header(now), self.endpoints.is_some());
        self.statistics.message(&self.control, names, header, refused, is_configured, &troubles)
    }

    /// Publishes state and markers at `state_rate`, and diagnostics.
    fn report(&mut self, now: f64) {
        if let Some(endpoints) = &mut self.endpoints
            && self.statistics.is_due(diagnostics::STATE, now, self.settings.state_rate)
        {
            endpoints.report(&self.control, &self.origin, now, &mut self.statistics);
        }
        self.diagnose(now, true);
    }

    /// Publishes diagnostics once a second of the computer's time, which goes on when a simulator's stands; not recorded then, for
    /// the time of a recording is the loop's.
    fn diagnose(&mut self, stamp: f64, is_recorded: bool) {
        if !self.statistics.is_due(diagnostics::DIAGNOSTICS, system_time(), 1.0) {
            return;
        }
        let message = self.diagnosis(stamp);
        if is_recorded {
            let recorder = match &mut self.endpoints {
                Some(endpoints) => &mut endpoints.link.recorder,
                None => &mut self.recorder,
            };
            copy(recorder, &self.diagnostics, &message, stamp);
        }
        self.statistics.sent(self.diagnostics.publish(&message));
    }
}

fn copy<M: Message>(recorder: &mut Option<MessageRecorder>, topic: &Publisher<M>, message: &M, now: f64) {
    if let Some(recorder) = recorder {
        recorder.take(topic.topic(), message, [now; 2]);
    }
}

/// Refuses a node that no peer could make active.
fn check_commands(swarm: &Swarm, autostart: bool) -> Result<(), SceneError> {
    let commands = swarm.raw.node.commands;
    let has_lifecycle = swarm.raw.node.serves(RawService::Lifecycle);
    if autostart || (commands.may_do_all() && has_lifecycle) {
        return Ok(());
    }
    if commands.may_do_all() {
        let what =
            "without \"lifecycle\" no peer can make the node active, and autostart is false".to_owned();
        return Err(swarm.refuse(
            "node.services",
            what,
            "leave the parameter autostart true, or add \"lifecycle\"",
        ));
    }
    let what = format!("\"{}\" lets no peer make the node active, and autostart is false", commands.name());
    Err(swarm.refuse("node.commands", what, "leave the parameter autostart true, or allow \"all\""))
}

/// The names of a formation's node: `__ns` gives the fleet's namespace, below which the node of one member has its own.
///
/// # Errors
/// A name that ROS 2 does not allow.
pub fn names(arguments: &RosArguments, member: Option<&str>) -> Result<Names, NameError> {
    let names = arguments.names(NAME, "/")?;
    match member {
        Some(member) => names.of_robot(member),
        None => Ok(names),
    }
}

/// Names of topics under the rules given to a node.
pub type TopicOf<'a> = &'a dyn Fn(&str, usize) -> Result<String, NodeError>;
