//! The node's parameters: what of the swarm file can be changed while it flies.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::NodeError;
use crate::messages::names::Names;
use crate::messages::recorder::set_parameter;
use crate::ros::arguments::{Parameter, RosArguments};
use crate::ros::edge::parameters::{Declaration, Store, Value};
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawNode;
use crate::swarm::control::Control;
use crate::swarm::control::scope::NodeScope;
use crate::swarm::pace::Pace;

/// Values of the parameters that are read where they are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// \[Hz\]
    pub rate: f64,
    /// \[Hz\]
    pub state_rate: f64,
    pub use_sim_time: bool,
    pub autostart: bool,
}

/// No limit, as a parameter that cannot be infinite says it.
const NONE: f64 = 0.0;

/// A name of the swarm file's `[node]`.
pub(super) type Field = fn(&mut RawNode) -> &mut String;

/// Parameters that are names of the swarm file's `[node]`. They can be changed while the node is not configured.
pub(super) const TOPICS: [(&str, Field); 6] = [
    ("frame_id", |raw| &mut raw.frame_id),
    ("pose_topic", |raw| &mut raw.pose_topic),
    ("target_topic", |raw| &mut raw.target_topic),
    ("leader_topic", |raw| &mut raw.leader_topic),
    ("ranges_topic", |raw| &mut raw.ranges_topic),
    ("velocity_topic", |raw| &mut raw.velocity_topic),
];

/// Declares every parameter, with what the arguments give; names can be changed while the node is not configured.
pub(super) fn declare(
    control: &Control,
    arguments: &RosArguments,
    names: &Names,
    swarm: &Swarm,
    part: &NodeScope,
    is_configured: &Arc<AtomicBool>,
) -> Result<(Settings, Store), NodeError> {
    let limits = control.limits();
    // Slower, and every pose would be too old before the next period.
    let slowest = (1.0 / control.watch().limits().age_limit).max(1.0).min(1.0 / control.period());
    let mut raw = swarm.raw.node.clone();
    let mut declarations = vec![
        Declaration::new("rate", 1.0 / control.period()).range(slowest..=500.0).describe("targets a second [Hz]"),
        Declaration::new("state_rate", 10.0)
            .range(0.1..=100.0)
            .describe("formation states and markers a second, at most one a target [Hz]"),
        at_most("speed_limit", limits.speed).describe("highest speed of a robot [m/s]"),
        at_most("acceleration_limit", limits.acceleration)
            .checked("of robots that brake by themselves as in the swarm file", {
                let braking = limits.braking();
                move |_, value| match braking.is_none_or(|own| value.as_double() == Some(own)) {
                    true => Ok(()),
                    false => Err("robots of the model \"double-integrator\" brake as limits.acceleration says, whatever is \
                                  asked of them: change it in the swarm file, with the robots"
                        .into()),
                }
            })
            .describe("highest acceleration of a robot [m/s^2]"),
        Declaration::new("clearance", limits.clearance)
            .range(limits.clearance..=limits.clearance.max(1000.0))
            .checked("no less than limits.clearance of the swarm file, and only where that has one, or obstacles", {
                let (has_effect, own) =
                    (limits.keeps_apart || !control.filter().obstacles().is_empty(), limits.clearance);
                move |_, value| match has_effect || value.as_double() == Some(own) {
                    true => Ok(()),
                    false => Err("robots are kept apart from each other only where the swarm file has limits.clearance: give it \
                                  there, 0.0 is enough"
                        .into()),
                }
            })
            .describe(match limits.keeps_apart {
                true => "free space kept between two robots, or a robot and an obstacle [m]",
                false => "free space kept between a robot and an obstacle [m]",
            }),
        Declaration::new("damping", control.damping())
            .range(0.0..=2.0)
            .describe("part of the way to its target that a follower goes in a sweep [1]"),
        Declaration::new("sweeps", control.sweeps() as i64)
            .integer_range(1..=most_sweeps(control, part))
            .describe("applications of the rule in a period [1]"),
        Declaration::new("autostart", true)
            .read_only()
            .describe("become active without waiting for a lifecycle manager"),
        Declaration::new("use_sim_time", false).read_only().describe("take the time from /clock"),
    ];
    let robot = control.formation().names[0].clone();
    declarations.extend(TOPICS.map(|(name, field)| {
        let declaration = while_unconfigured(name, field(&mut raw), is_configured);
        if name == "frame_id" {
            declaration.describe("frame of every pose (REP 105)")
        } else {
            topic(declaration, names.clone(), robot.clone())
        }
    }));
    let store = store(declarations, &arguments.parameters_for(&names.fully_qualified()))?;
    let number = |name: &str| store.get(name).and_then(Value::as_double).unwrap_or_default();
    let flag = |name: &str| store.get(name).and_then(Value::as_bool).unwrap_or_default();
    let settings = Settings {
        rate: number("rate"),
        state_rate: number("state_rate"),
        use_sim_time: flag("use_sim_time"),
        autostart: flag("autostart"),
    };
    Ok((settings, store))
}

/// A name that only a node that is not configured can change.
fn while_unconfigured(name: &str, value: &str, is_configured: &Arc<AtomicBool>) -> Declaration {
    let is_configured = Arc::clone(is_configured);
    let words = "changes while the node is not configured";
    Declaration::new(name, value).checked(words, move |_, _| match is_configured.load(Ordering::Relaxed) {
        true => {
            Err("the node is configured: `deactivate` and `cleanup` come first, `configure` after".into())
        }
        false => Ok(()),
    })
}

/// Of a topic of the robots, which is tried with one of them.
fn topic(declaration: Declaration, names: Names, robot: String) -> Declaration {
    declaration.describe("topic of each robot; {name} stands for the robot's name").checked(
        "a topic's name",
        move |_, value| {
            let pattern = value.as_str().unwrap_or_default();
            names.robot_topic(pattern, &robot).map(drop).map_err(|error| error.to_string())
        },
    )
}

/// Declares parameters with the values given for them; a name that is none of theirs is only warned of.
pub(in crate::ros) fn store(declarations: Vec<Declaration>, given: &[Parameter]) -> Result<Store, NodeError> {
    let mut store = Store::default();
    let names: Vec<String> = declarations.iter().map(|one| one.name().to_owned()).collect();
    for declaration in declarations {
        let start = given.iter().rev().find(|one| one.name == declaration.name());
        store.declare(declaration, start.map(|one| one.value.clone()))?;
    }
    for one in given.iter().filter(|one| !names.contains(&one.name)) {
        tracing::warn!("parameter `{}` is not one of this node's: {}", one.name, names.join(", "));
    }
    Ok(store)
}

/// 1000, or what the swarm file has if that is more: more could keep the loop for longer than its period. The node of one robot computes that one's target alone, which makes one sweep.
fn most_sweeps(control: &Control, part: &NodeScope) -> i64 {
    if part.mine.len() == control.formation().count() { (control.sweeps() as i64).max(1000) } else { 1 }
}

/// A limit that can be tightened and not loosened: the swarm file's value is the upper bound for every caller.
fn at_most(name: &str, limit: f64) -> Declaration {
    if limit == f64::INFINITY {
        let words = "0 for none, as the swarm file has it";
        return Declaration::new(name, NONE).range(NONE..=1000.0).checked(words, |_, _| Ok(()));
    }
    Declaration::new(name, limit).range(0.0..=limit).checked(
        "above 0, and no more than the swarm file's limit",
        |_, value| match value.as_double() {
            Some(number) if number > 0.0 => Ok(()),
            _ => Err("0 would be no limit, and the swarm file sets one".into()),
        },
    )
}

impl Settings {
    /// Applies all that the arguments gave.
    pub fn apply_all<'a>(
        &mut self,
        parameters: impl Iterator<Item = (&'a str, &'a Value)>,
        control: &mut Control,
        pace: &mut Pace,
    ) {
        for (name, value) in parameters {
            self.apply(name, value, control, pace);
        }
    }

    pub fn apply(&mut self, name: &str, value: &Value, control: &mut Control, pace: &mut Pace) {
        let Some(number) = value.as_number() else { return };
        match name {
            "rate" => {
                self.rate = number;
                pace.set_rate(number);
                control.set_period(1.0 / number);
            }
            "state_rate" => self.state_rate = number,
            name => {
                let is_none = number == NONE && name.ends_with("_limit");
                let value = if is_none { f64::INFINITY } else { number };
                if let Err(error) = set_parameter(control, name, value) {
                    tracing::warn!("{error}");
                }
            }
        }
    }
}
