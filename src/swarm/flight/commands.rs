//! Commands from outside while robots fly: leaders sent to places, obstacles moved, poses made worse.

use super::Flight;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawCommand, RawCommandKind};
use crate::swarm::control::Control;
use crate::swarm::safety::Limits;

/// Performs on the loop its part of a command; false where it concerns a robot that no program leads, or a place
/// where no pose would be believed or an obstacle would be none.
pub fn perform(what: &RawCommandKind, control: &mut Control) -> bool {
    match what {
        RawCommandKind::Lead { robot, to } => {
            control.formation().number(robot).is_some_and(|member| control.take_over(member, *to))
        }
        RawCommandKind::MoveObstacle { obstacle, by } => control.move_obstacle(*obstacle, *by).is_ok(),
        RawCommandKind::Channel { noise, .. } => {
            let limits = Limits { deviation: *noise, ..control.limits().clone() };
            control.set_limits(limits).is_ok()
        }
    }
}

impl Flight {
    /// Performs a command before the next period; false as [`perform`].
    pub(crate) fn perform(&mut self, what: &RawCommandKind) -> bool {
        if let RawCommandKind::Channel { noise, delay, loss } = what {
            self.fleet.set_channels(*noise, *delay, *loss);
        }
        perform(what, &mut self.control)
    }

    /// Performs what the file has for this period.
    pub(super) fn perform_due(&mut self) {
        for what in due(&self.commands, self.fleet.period()).cloned().collect::<Vec<_>>() {
            self.perform(&what);
        }
    }
}

/// Those of the commands that are for the time after so many periods.
pub fn due(commands: &[RawCommand], periods: u64) -> impl Iterator<Item = &RawCommandKind> {
    commands.iter().filter(move |command| command.after == periods).map(|command| &command.what)
}

/// Refuses commands of a swarm file that cannot be performed.
///
/// # Errors
/// Names a robot that no program leads, a place where no pose would be believed, and a period that comes before the one
/// of the command above.
pub fn check(swarm: &Swarm, control: &Control) -> Result<(), SceneError> {
    let formation = control.formation();
    let commands = &swarm.raw.flight.commands;
    if let Some(k) = commands.windows(2).position(|pair| pair[0].after > pair[1].after) {
        let key = format!("flight.commands[{}].after", k + 1);
        return Err(swarm.refuse(&key, "comes before the command above it", "list by ascending period"));
    }
    for (k, command) in commands.iter().enumerate() {
        let key = |part: &str| format!("flight.commands[{k}].what.{part}");
        let refuse = |part: &str, message: String, help: &str| Err(swarm.refuse(&key(part), message, help));
        match &command.what {
            RawCommandKind::Lead { robot, to } => {
                if !formation.is_led(formation.require(swarm, &key("robot"), robot)?) {
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
            }
            RawCommandKind::MoveObstacle { obstacle, by } => {
                let count = swarm.raw.obstacles.len();
                if *obstacle >= count {
                    let message =
                        format!("there is no such obstacle: the swarm has {count}, numbered from 0");
                    return refuse("obstacle", message, "name one of [[obstacles]]");
                }
                if let Err(error) = control.filter().obstacles().with_moved(*obstacle, *by) {
                    return refuse("by", error.to_string(), "move it less far");
                }
            }
            RawCommandKind::Channel { .. } => {}
        }
    }
    Ok(())
}
