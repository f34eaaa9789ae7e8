//! Requests of viewers, as JSON.

use serde::Deserialize;

use crate::scene::raw::RawSide;
use crate::swarm::design::Edit;

/// Longest request of a viewer \[byte\].
pub(crate) const MOST_BYTES: usize = 4096;

/// Something that a viewer asks for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Command {
    /// Goes on.
    Play {},
    /// Stands still.
    Pause {},
    /// Takes one step, and stands still.
    Step {},
    /// Begins anew; what was done is kept for [`Command::Undo`] alone.
    Reset {},
    /// Returns to the moment before the last thing that was done.
    Undo {},
    /// Writes the file that replays what was done.
    Save {},
    /// Steps at this multiple of the usual speed \[1\].
    Speed {
        /// From 0.01 to 1000.
        value: f64,
    },
    /// Takes hold of a particle or robot, by its number from 0, with all that are held as it is.
    Grab {
        /// Number of the particle.
        particle: usize,
        /// Whether to take this one alone.
        #[serde(default)]
        alone: bool,
    },
    /// Takes hold of an obstacle, by its number from 0.
    GrabObstacle {
        /// Number of the obstacle.
        obstacle: usize,
    },
    /// Moves what is held, from where it was taken \[length\].
    Drag {
        /// Along x and y.
        by: [f64; 2],
    },
    /// Brings the leaders that are held closer together or farther apart, about their middle as they were taken.
    Squeeze {
        /// Factors along x and y \[1\], from 0.1 to 10.
        by: [f64; 2],
    },
    /// Lets go.
    Release {},
    /// Breaks the bonds that cross a line as the body stands \[length\].
    Cut {
        /// One end.
        from: [f64; 2],
        /// The other end.
        to: [f64; 2],
    },
    /// Loads a side of the body, in place of the load that a hand gave it before.
    Load {
        /// The side.
        side: RawSide,
        /// How far the side would go, were the body held at the opposite one and kept from contracting \[length\].
        by: [f64; 2],
    },
    /// Changes a key as `--set` does.
    Set {
        /// Such as `rule.feedback.factor`.
        key: String,
        /// In TOML.
        value: String,
    },
    /// Gives a robot a fault, or takes it away.
    Fault {
        /// Number of the robot, from 0.
        robot: usize,
        /// The kind of fault; none makes it sound.
        what: Option<Fault>,
    },
    /// Changes the formation; the flight begins anew.
    Design {
        /// The change.
        edit: Edit,
    },
    /// Has a node hold every robot, as its service `~/emergency_stop` does.
    EmergencyStop {},
    /// Ends an emergency stop, as `~/resume` does.
    Resume {},
    /// Has a node send targets, as the transition of its lifecycle does.
    Activate {},
    /// Has a node send no targets.
    Deactivate {},
    /// Moves the leaders, as `~/set_formation` does.
    SetFormation {
        /// A manoeuvre of the file; with a name the other values are not used.
        #[serde(default)]
        name: String,
        /// Shift from the nominal places \[m\].
        #[serde(default)]
        translate: [f64; 2],
        /// Counter-clockwise \[rad\].
        #[serde(default)]
        rotate: f64,
        /// Factors along x and y \[1\].
        #[serde(default = "unstretched")]
        stretch: [f64; 2],
        /// Shift of x for every unit of y, and of y for every unit of x \[1\].
        #[serde(default)]
        shear: [f64; 2],
        /// Time until the formation is there \[s\].
        #[serde(default)]
        duration: f64,
    },
    /// Needs the values of this quantity with every frame.
    Ask {
        /// Key of a quantity.
        quantity: String,
    },
    /// Has drawn a frame.
    Drawn {
        /// Time that drawing took \[ms\].
        ms: f64,
    },
}

fn unstretched() -> [f64; 2] {
    [1.0; 2]
}

/// Faults that a viewer can give a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// Stands still and sends no poses.
    Dead,
    /// Moves on but sends no poses.
    Silent,
    /// Stands still and sends its poses.
    Stuck,
}

impl Command {
    /// Reads a request.
    ///
    /// # Errors
    /// A sentence for its sender.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.len() > MOST_BYTES {
            return Err(format!("a request is at most {MOST_BYTES} bytes long"));
        }
        let command: Self = serde_json::from_str(text).map_err(|error| format!("no request: {error}"))?;
        command.check().map(|()| command)
    }

    /// Whether it moves what a hand holds.
    pub(super) fn moves_hand(&self) -> bool {
        matches!(self, Command::Drag { .. } | Command::Squeeze { .. })
    }

    fn check(&self) -> Result<(), String> {
        let is_text = |text: &str| text.len() <= 200 && !text.contains(char::is_control);
        let text = "give texts of at most 200 characters, without control characters, and keys without `=`";
        let (holds, help) = match self {
            Command::Speed { value } => ((0.01..=1000.0).contains(value), "give a speed of 0.01 to 1000"),
            Command::Set { key, value } => (is_text(key) && is_text(value) && !key.contains('='), text),
            Command::Ask { quantity: name }
            | Command::SetFormation { name, .. }
            | Command::Design { edit: Edit::Rename { name, .. } } => (is_text(name), text),
            Command::Drawn { ms } => ((0.0..=1e6).contains(ms), "give a time of 0 to 1e6 ms"),
            Command::Squeeze { by } => {
                (by.iter().all(|factor| (0.1..=10.0).contains(factor)), "give factors of 0.1 to 10")
            }
            Command::Cut { from, to } => (from != to, "give a cut two different ends"),
            _ => (true, ""),
        };
        if holds { Ok(()) } else { Err(format!("out of range: {help}")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_and_others_refused() {
        let grab = Command::parse(r#"{"do":"grab","particle":3}"#);
        assert_eq!(grab, Ok(Command::Grab { particle: 3, alone: false }));
        let moved = Command::parse(r#"{"do":"set-formation","translate":[1,0],"duration":2}"#);
        assert!(matches!(moved, Ok(Command::SetFormation { stretch: [1.0, 1.0], duration: 2.0, .. })));
        let placed = Command::parse(r#"{"do":"design","edit":{"what":"place","at":[1,0],"leads":false}}"#);
        assert!(matches!(placed, Ok(Command::Design { edit: Edit::Place { leads: false, .. } })));
        let speed = Command::parse(r#"{"do":"speed","value":0}"#).expect_err("none");
        assert_eq!(speed, "out of range: give a speed of 0.01 to 1000");
        let wrong = [
            "",
            r#"{"do":"design"}"#,
            r#"{"do":"design","edit":{"what":"place","at":[1e999,0],"leads":false}}"#,
            r#"{"do":"design","edit":{"what":"rename","robot":0,"name":"a\u0007"}}"#,
            r#"{"do":"design","edit":{"what":"remove","robot":0,"more":1}}"#,
            "[]",
            r#"{"do":"format"}"#,
            r#"{"do":"grab","particle":-1}"#,
            r#"{"do":"grab","particle":1e3}"#,
            r#"{"do":"drag","by":[1e999,0]}"#,
            r#"{"do":"drag","by":[null,0]}"#,
            r#"{"do":"play","more":1}"#,
            r#"{"do":"speed","value":0}"#,
            r#"{"do":"cut","from":[0,0],"to":[0,0]}"#,
            r#"{"do":"squeeze","by":[1,0]}"#,
            r#"{"do":"set-formation","translate":[1e999,0]}"#,
            r#"{"do":"set-formation","name":"a\u0007"}"#,
            "{\"do\":\"set\",\"key\":\"a\\n\",\"value\":\"1\"}",
        ];
        for text in wrong {
            assert!(Command::parse(text).is_err(), "{text}");
        }
        assert!(Command::parse(&format!(r#"{{"do":"ask","quantity":"{}"}}"#, "x".repeat(5000))).is_err());
    }
}
