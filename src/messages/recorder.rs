//! Copies of the messages, commands and targets of a loop, for recordings.

use crate::messages::Message;
use crate::messages::builtin_interfaces::Time;
use crate::messages::flockform_msgs::LoopEvent;
use crate::messages::names::{NameError, Names};
use crate::messages::std_msgs::Header;
use crate::messages::wire::encode;
use crate::swarm::control::Control;
use crate::swarm::safety::SafetyError;

/// Topic of [`LoopEvent`]s, below the node's name.
pub(crate) const EVENTS: &str = "~/events";

/// Encapsulation header of plain CDR in little endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A message on its way.
#[derive(Clone, Copy, Debug)]
pub struct RecordedMessage<'a> {
    pub topic: &'a str,
    /// Package and name of its type.
    pub package: &'static str,
    pub name: &'static str,
    /// CDR, with its encapsulation header.
    pub payload: &'a [u8],
    /// Whether lost samples are sent again; of what others sent, whether the loop asks for it.
    pub reliable: bool,
    /// By the loop's clock \[s\].
    pub time: f64,
    /// When it was sent, or came \[s\].
    pub published: f64,
}

/// Takes the copies.
pub type RecordSink = Box<dyn FnMut(&RecordedMessage<'_>) + Send>;

/// A sink that takes messages.
pub struct MessageRecorder {
    sink: RecordSink,
    payload: Vec<u8>,
    events: String,
    frame_id: String,
}

impl MessageRecorder {
    /// For the loop of a node of this name, whose poses are in this frame.
    ///
    /// # Errors
    /// A name that no topic can have.
    pub fn new(names: &Names, frame_id: &str, sink: RecordSink) -> Result<Self, NameError> {
        let events = names.topic(EVENTS)?;
        Ok(Self { sink, payload: Vec::new(), events, frame_id: frame_id.to_owned() })
    }

    /// A message that the loop sends at its time `time` \[s\], which goes out at `published` \[s\].
    pub fn take<M: Message>(&mut self, topic: &str, message: &M, times: [f64; 2]) {
        self.copy(topic, message, times, true);
    }

    /// A pose or the place of a leader, taken at the loop's time `time` \[s\], which was sent or came at `published`
    /// \[s\]: the newest counts, and a lost one is not sent again.
    pub fn take_received<M: Message>(&mut self, topic: &str, message: &M, times: [f64; 2]) {
        self.copy(topic, message, times, false);
    }

    fn copy<M: Message>(&mut self, topic: &str, message: &M, [time, published]: [f64; 2], reliable: bool) {
        self.payload.clear();
        self.payload.extend(ENCAPSULATION);
        if let Err(error) = encode(message, &mut self.payload) {
            tracing::warn!("{topic} is not recorded: {error}");
            return;
        }
        let (package, name, payload) = (M::PACKAGE, M::NAME, &self.payload[..]);
        (self.sink)(&RecordedMessage { topic, package, name, payload, reliable, time, published });
    }

    /// A command that the loop took, or another input of it.
    pub fn event(&mut self, time: f64, kind: u8, text: &str, values: &[f64]) {
        let header = Header { stamp: Time::from_seconds(time), frame_id: self.frame_id.clone() };
        let event = LoopEvent { header, kind, text: text.to_owned(), values: values.to_vec() };
        let topic = std::mem::take(&mut self.events);
        self.take(&topic, &event, [time; 2]);
        self.events = topic;
    }

    /// The parameters that targets depend on, as they are.
    pub fn parameters(&mut self, time: f64, control: &Control) {
        for (name, value) in parameters(control) {
            self.event(time, LoopEvent::PARAMETER, name, &[value]);
        }
    }
}

/// Of a loop: names and values in SI units.
pub fn parameters(control: &Control) -> [(&'static str, f64); 6] {
    let limits = control.limits();
    [
        ("period", control.period()),
        ("damping", control.damping()),
        ("sweeps", control.sweeps() as f64),
        ("speed_limit", limits.speed),
        ("acceleration_limit", limits.acceleration),
        ("clearance", limits.clearance),
    ]
}

/// Gives a loop a value as [`parameters`] names it; false for a name or a value that is none.
///
/// # Errors
/// A limit that is none.
pub fn set_parameter(control: &mut Control, name: &str, value: f64) -> Result<bool, SafetyError> {
    let mut limits = control.limits().clone();
    match name {
        "period" => return Ok(control.set_period(value)),
        "damping" => return Ok(control.set_damping(value)),
        "sweeps" if value >= 1.0 => control.set_sweeps(value as usize),
        "speed_limit" => limits.speed = value,
        "acceleration_limit" => limits.acceleration = value,
        "clearance" => limits.clearance = value,
        _ => return Ok(false),
    }
    if limits != *control.limits() {
        control.set_limits(limits)?;
    }
    Ok(true)
}
