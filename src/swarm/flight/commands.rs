//! What is done from outside while robots fly: leaders sent to places, poses made worse.

use super::{Flight, faults};
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawCommandKind;
use crate::swarm::formation::Formation;
use crate::swarm::safety::Limits;

/// Something that is done between two periods.
#[derive(Clone, Debug, PartialEq)]
pub enum FlightCommand {
    /// Sends a leader to a place \[m\].
    Lead {
        /// Its number.
        member: usize,
        /// Where it goes.
        to: [f64; 2],
    },
    /// Sends poses with this noise \[m\], delay \[period\] and loss \[1\].
    Channel {
        /// Standard deviation of each coordinate.
        noise: f64,
        /// Delay of poses.
        delay: u32,
        /// Part of the poses that is lost.
        loss: f64,
    },
}

impl Flight {
    /// Performs a command before the next period; false where it concerns a robot that no program leads, or a place
    /// where no pose would be believed.
    pub fn perform(&mut self, command: &FlightCommand) -> bool {
        match *command {
            FlightCommand::Lead { member, to } => self.control.take_over(member, to),
            FlightCommand::Channel { noise, delay, loss } => {
                self.fleet.set_channels(noise, delay, loss);
                let limits = Limits { deviation: noise, ..self.control.limits().clone() };
                self.control.set_limits(limits).is_ok()
            }
        }
    }

    /// Performs what the file has for this period.
    pub(super) fn perform_due(&mut self) {
        let period = self.fleet.period();
        let due = self.commands.iter().filter(|(after, _)| *after == period);
        for (_, command) in due.cloned().collect::<Vec<_>>() {
            self.perform(&command);
        }
    }
}

/// The commands of a swarm file.
///
/// # Errors
/// Names a robot that no program leads, and a period that comes before the one of the command above.
pub fn of(swarm: &Swarm, formation: &Formation) -> Result<Vec<(u64, FlightCommand)>, SceneError> {
    let commands = &swarm.raw.flight.commands;
    if let Some(k) = commands.windows(2).position(|pair| pair[0].after > pair[1].after) {
        let message = "comes before the command above it";
        return Err(swarm.refuse(
            &format!("flight.commands[{}].after", k + 1),
            message,
            "list by ascending period",
        ));
    }
    let command = |(k, raw): (usize, &crate::scene::swarm::raw::RawCommand)| {
        let what = match &raw.what {
            RawCommandKind::Lead { robot, to } => {
                let key = format!("flight.commands[{k}].what.robot");
                let member = faults::member(swarm, formation, &key, robot)?;
                if !formation.is_led(member) {
                    let message = format!("no program of this swarm leads `{robot}`");
                    return Err(swarm.refuse(&key, message, "name a robot of [[leaders]]"));
                }
                FlightCommand::Lead { member, to: *to }
            }
            RawCommandKind::Channel { noise, delay, loss } => {
                FlightCommand::Channel { noise: *noise, delay: *delay, loss: *loss }
            }
        };
        Ok((raw.after, what))
    };
    commands.iter().enumerate().map(command).collect()
}
