//! The members whose targets a loop computes and those whose poses it needs for that: all, or one robot's.

use super::Control;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawHears;

/// The members that a loop serves, and those whose poses it receives. By number, ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeScope {
    /// Members whose targets the loop sends.
    pub mine: Vec<usize>,
    /// Members whose poses the loop receives.
    pub heard: Vec<usize>,
}

/// The reason for which a robot cannot be served alone.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NodeScopeError {
    /// No robot is called so.
    #[error("--member {name}: there is no such robot\n  help: they are called `{first}` to `{last}`")]
    Member {
        /// The name that was given.
        name: String,
        /// Name of the first robot.
        first: String,
        /// Name of the last robot.
        last: String,
    },
    /// The robot's target depends on more than its neighbours.
    #[error("--member {name}: {why}\n  help: run one node for all, without --member")]
    NotAlone {
        /// Name of the robot.
        name: String,
        /// The setting that it depends on.
        why: &'static str,
    },
}

impl NodeScope {
    /// Returns the scope of one robot, or of all, and restricts the loop to it: no other poses are expected.
    ///
    /// # Errors
    /// A name that is no robot's, or a robot whose target depends on more than its neighbours.
    pub fn take(swarm: &Swarm, control: &mut Control, member: Option<&str>) -> Result<Self, NodeScopeError> {
        let member = member.map(|name| only(swarm, control, name)).transpose()?;
        Ok(Self::restrict(swarm, control, member))
    }

    /// The same of a robot that can be served alone, or of all.
    pub(crate) fn restrict(swarm: &Swarm, control: &mut Control, member: Option<usize>) -> Self {
        let all = || (0..control.formation().count()).collect();
        let part = match member {
            None => Self { mine: all(), heard: all() },
            Some(m) => Self { mine: vec![m], heard: heard(swarm, control, m) },
        };
        control.listen_to(&part.heard);
        control.serve(&part.mine);
        part
    }
}

/// The members whose poses the loop of one needs, by number, ascending. Its target follows from its neighbours; to keep
/// a clearance it has to see everyone, for programs and commands may bring any two together, and ranges find a lie by the places
/// of those that measured them.
fn heard(swarm: &Swarm, control: &Control, member: usize) -> Vec<usize> {
    let formation = control.formation();
    let keeps_clear = control.limits().keeps_apart && swarm.raw.node.hears == RawHears::All;
    let finds_anew = formation.engine().is_some_and(|engine| engine.lasting_neighbours().is_none());
    if keeps_clear || finds_anew || swarm.raw.ranges.is_some() {
        return (0..formation.count()).collect();
    }
    let mut heard = formation.depends_on(member);
    heard.push(member);
    heard.sort_unstable();
    heard
}

/// The number of the robot that the loop is alone for.
fn only(swarm: &Swarm, control: &Control, name: &str) -> Result<usize, NodeScopeError> {
    let formation = control.formation();
    let number = formation.number(name).ok_or_else(|| NodeScopeError::Member {
        name: name.to_owned(),
        first: formation.names[0].clone(),
        last: formation.names[formation.count() - 1].clone(),
    })?;
    let refuse = |why| Err(NodeScopeError::NotAlone { name: name.to_owned(), why });
    if swarm.raw.control.sweeps > 1 {
        return refuse("control.sweeps above 1 needs to see the whole formation");
    }
    if !formation.can_be_followed_alone() {
        return refuse(
            "robots that a body carries, or that are swept one after another, depend on all others",
        );
    }
    Ok(number)
}
