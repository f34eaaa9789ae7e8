//! Commands from outside while robots fly: leaders sent to places, obstacles moved, poses made worse.

use super::Flight;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawCommand, RawCommandKind};
use crate::swarm::control::Control;
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
    /// Moves an obstacle at once.
    MoveObstacle {
        /// Its number.
        obstacle: usize,
        /// From its place in the file \[m\].
        by: [f64; 2],
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

impl FlightCommand {
    /// Performs on the loop its part of the command; false where it concerns a robot that no program leads, or a place
    /// where no pose would be believed or an obstacle would be none.
    pub fn perform(&self, control: &mut Control) -> bool {
        match *self {
            Self::Lead { member, to } => control.take_over(member, to),
            Self::MoveObstacle { obstacle, by } => control.move_obstacle(obstacle, by).is_ok(),
            Self::Channel { noise, .. } => {
                let limits = Limits { deviation: noise, ..control.limits().clone() };
                control.set_limits(limits).is_ok()
            }
        }
    }
}

impl Flight {
    /// Performs a command before the next period; false as [`FlightCommand::perform`].
    pub fn perform(&mut self, command: &FlightCommand) -> bool {
        if let FlightCommand::Channel { noise, delay, loss } = *command {
            self.fleet.set_channels(noise, delay, loss);
        }
        command.perform(&mut self.control)
    }

    /// Performs what the file has for this period.
    pub(super) fn perform_due(&mut self) {
        for command in due(&self.commands, self.fleet.period()).cloned().collect::<Vec<_>>() {
            self.perform(&command);
        }
    }
}

/// Those of the commands that are for the time after so many periods.
pub fn due(commands: &[(u64, FlightCommand)], periods: u64) -> impl Iterator<Item = &FlightCommand> {
    commands.iter().filter(move |(after, _)| *after == periods).map(|(_, command)| command)
}

/// The commands of a swarm file.
///
/// # Errors
/// Names a robot that no program leads, a place where no pose would be believed, and a period that comes before the one
/// of the command above.
pub fn of(swarm: &Swarm, control: &Control) -> Result<Vec<(u64, FlightCommand)>, SceneError> {
    let formation = control.formation();
    let commands = &swarm.raw.flight.commands;
    if let Some(k) = commands.windows(2).position(|pair| pair[0].after > pair[1].after) {
        let key = format!("flight.commands[{}].after", k + 1);
        return Err(swarm.refuse(&key, "comes before the command above it", "list by ascending period"));
    }
    let command = |(k, raw): (usize, &RawCommand)| {
        let key = |part: &str| format!("flight.commands[{k}].what.{part}");
        let refuse = |part: &str, message: String, help: &str| Err(swarm.refuse(&key(part), message, help));
        let what = match &raw.what {
            RawCommandKind::Lead { robot, to } => {
                let member = formation.require(swarm, &key("robot"), robot)?;
                if !formation.is_led(member) {
                    let message = format!("no program of this swarm leads `{robot}`");
                    return refuse("robot", message, "name a robot of [[leaders]]");
                }
                if !control.is_believed(*to) {
                    let range = swarm.raw.poses.range;
                    let message =
                        format!("lies more than poses.range = {range} m from the formation's middle");
                    let help = "no pose is believed there: lead to a nearer place, or raise poses.range";
                    return refuse("to", message, help);
                }
                FlightCommand::Lead { member, to: *to }
            }
            RawCommandKind::MoveObstacle { obstacle, by } => {
                let count = swarm.raw.obstacles.len();
                if *obstacle >= count {
                    let message =
                        format!("there is no such obstacle: the swarm has {count}, numbered from 0");
                    return refuse("obstacle", message, "name one of [[obstacles]]");
                }
                let moved = control.filter().obstacles().with_moved(*obstacle, *by);
                if let Err(error) = moved {
                    return refuse("by", error.to_string(), "move it less far");
                }
                FlightCommand::MoveObstacle { obstacle: *obstacle, by: *by }
            }
            RawCommandKind::Channel { noise, delay, loss } => {
                FlightCommand::Channel { noise: *noise, delay: *delay, loss: *loss }
            }
        };
        Ok((raw.after, what))
    };
    commands.iter().enumerate().map(command).collect()
}
