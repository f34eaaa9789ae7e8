//! Commands of peers and of the program around the node: they go one way, within the same limits.

use std::sync::mpsc::{Receiver, SyncSender};

use crate::messages::flockform_msgs::{LoopEvent, SetFormationRequest};
use crate::messages::formation::leaders::{as_event, set_formation};
use crate::scene::swarm::raw::RawCommands;
use crate::swarm::control::{Control, Mode};

/// A command, as a service of the node takes it.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeCommand {
    /// `~/emergency_stop`.
    EmergencyStop,
    /// `~/resume`.
    Resume,
    /// `~/set_formation`.
    SetFormation(SetFormationRequest),
    /// `~/change_state`, by the label of the transition; one is made in a period, after that of a peer.
    ChangeState(&'static str),
}

/// The outcome of a command: what was done, or the reason why not.
pub type Answer = Result<String, String>;

/// Commands of the program around the node that are taken in a period at most.
pub(super) const MOST_AT_ONCE: usize = 8;

/// Commands of the program around the node.
pub struct CommandQueue {
    /// With a number that the answer bears again.
    pub commands: Receiver<(u64, NodeCommand)>,
    /// Answers; one for which there is no room is dropped.
    pub answers: SyncSender<(u64, Answer)>,
}

/// An event of the loop, for a recorder: kind, text, values.
pub(super) type Event = (u8, String, Vec<f64>);

/// The loop as far as commands change it.
pub(super) struct Commanded<'a> {
    pub control: &'a mut Control,
    pub allowed: RawCommands,
    pub is_configured: bool,
    /// The robot of a node that serves no other.
    pub alone: Option<&'a str>,
    /// Whether the node has been shut down, which is for good.
    pub is_finalized: bool,
    /// Commands that were done.
    pub events: Vec<Event>,
}

impl Commanded<'_> {
    /// Does what is asked, if the swarm file allows it.
    pub fn perform(&mut self, command: &NodeCommand) -> Answer {
        let may = match command {
            NodeCommand::EmergencyStop => self.allowed.may_stop(),
            _ => self.allowed.may_do_all(),
        };
        if !may {
            return Err(not_allowed(self.allowed));
        }
        if self.is_finalized && !matches!(command, NodeCommand::ChangeState(_)) {
            return Err("the node is finalized, and moves no robot: start it again".to_owned());
        }
        let done = match command {
            NodeCommand::EmergencyStop => {
                self.control.emergency_stop();
                self.events.push((LoopEvent::EMERGENCY_STOP, String::new(), Vec::new()));
                Ok("all robots of this node come to rest, and hold their places until ~/resume".to_owned())
            }
            NodeCommand::Resume if self.control.resume() => {
                self.events.push((LoopEvent::RESUME, String::new(), Vec::new()));
                Ok("the formation goes on".to_owned())
            }
            NodeCommand::Resume => Err("there is no emergency stop to lift".to_owned()),
            NodeCommand::SetFormation(_) if !self.is_configured => {
                Err("the node is not configured".to_owned())
            }
            NodeCommand::SetFormation(request) => {
                let done = set_formation(self.control, request)?;
                self.events.push(as_event(request));
                Ok(match self.control.mode() {
                    Mode::Running => done,
                    Mode::EmergencyStopped => format!("{done}; it waits for ~/resume"),
                    Mode::Inactive => format!("{done}; it waits until the node is active"),
                })
            }
            NodeCommand::ChangeState(label) => {
                Err(format!("{label}: another transition is made in this period"))
            }
        };
        let of = |done| match self.alone {
            None => done,
            Some(robot) => format!("{done}; this node serves `{robot}` alone"),
        };
        done.map(of)
    }
}

/// The reason why a command is refused.
pub(super) fn not_allowed(allowed: RawCommands) -> String {
    format!("the swarm file has node.commands = \"{}\"", allowed.name())
}
