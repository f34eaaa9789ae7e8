//! A formation under design: its robots one by one in a file, and what a hand changes there.

use serde::Deserialize;

use super::formation::Formation;
use crate::flock::vectors::distance;
use crate::scene::raw::RawNeighbours;
use crate::scene::swarm::raw::*;
use crate::scene::swarm::{Shape, Swarm};

/// Neighbours that a robot is linked to when it is placed or no longer leads.
const NEAREST: usize = 4;

/// A change of a formation. Robots are named by their number, from 0.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "what", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Edit {
    /// Another robot, linked to the nearest ones.
    Place {
        /// \[m\]
        at: [f64; 2],
        /// Whether it leads.
        leads: bool,
    },
    /// Gives a robot another place; its links stay.
    Move {
        /// The robot.
        robot: usize,
        /// From its place \[m\].
        by: [f64; 2],
    },
    /// Links two robots, each to the other, or takes their links away.
    Link {
        /// The robots.
        robots: [usize; 2],
    },
    /// Gives a robot another name.
    Rename {
        /// The robot.
        robot: usize,
        /// A name that no other has.
        name: String,
    },
    /// Has a robot lead, by the first program of the file where it does not lead yet, or follow.
    Lead {
        /// The robot.
        robot: usize,
        /// Whether it leads.
        leads: bool,
    },
    /// Takes a robot away.
    Remove {
        /// The robot.
        robot: usize,
    },
}

/// The file of a swarm with each robot placed and linked by itself.
///
/// # Errors
/// Why a formation of its shape cannot be given so.
pub fn by_robots(swarm: &Swarm, formation: &Formation) -> Result<RawSwarm, String> {
    let mut raw = swarm.raw.clone();
    let linked = match &swarm.shape {
        Shape::Places(_) => raw.links,
        Shape::Body(_) => match raw.neighbours.take() {
            Some(RawNeighbours::Dynamic { radius }) => Some(RawLinks::Present { radius }),
            _ => None,
        },
        Shape::Scene(scene) | Shape::Inside(scene) | Shape::Recorded(scene, _) => {
            return Err(format!(
                "the places are those of scene `{}`: change the scene, or give robots one by one",
                scene.name
            ));
        }
    };
    raw.links = match linked {
        Some(RawLinks::Present { radius }) => Some(RawLinks::Present { radius }),
        _ => Some(RawLinks::Listed {}),
    };
    let is_listed = matches!(raw.links, Some(RawLinks::Listed {}));
    let names = &formation.names;
    let robot = |m: usize| {
        let neighbours = formation.neighbours(m).filter(|_| is_listed).map(|k| names[k].clone()).collect();
        let radius = Some(formation.radii[m]).filter(|&radius| radius != raw.radius);
        RawRobot { name: names[m].clone(), place: formation.places.get(m), radius, neighbours }
    };
    raw.robots = (0..formation.count()).map(robot).collect();
    for (k, entry) in raw.leaders.iter_mut().enumerate() {
        let led = (0..names.len()).filter(|&m| formation.entry(m) == Some(k));
        (entry.robots, entry.region) = (led.map(|m| names[m].clone()).collect(), None);
    }
    raw.leaders.retain(|entry| !entry.robots.is_empty());
    (raw.lattice, raw.body) = (None, None);
    Ok(raw)
}

impl Edit {
    /// Changes a file that gives robots one by one.
    ///
    /// # Errors
    /// Why it cannot be changed so. What the file's own checks find is found when it is read.
    pub fn perform(&self, raw: &mut RawSwarm) -> Result<(), String> {
        let count = raw.robots.len();
        let known = |robot: usize| if robot < count { Ok(robot) } else { Err("there is no such robot") };
        match self {
            Edit::Place { at, leads } => {
                let taken = |name: &String| raw.robots.iter().any(|robot| robot.name == *name);
                let mut names = (1..).map(|n| format!("{}{n}", raw.prefix));
                let name = names.find(|name| !taken(name)).ok_or("no name is free")?;
                raw.robots.push(RawRobot { name, place: *at, radius: None, neighbours: Vec::new() });
                link_to_nearest(raw, count);
                if *leads {
                    lead(raw, count);
                }
            }
            Edit::Move { robot, by } => {
                let robot = &mut raw.robots[known(*robot)?];
                let moved = |[x, y]: [f64; 2]| [x + by[0], y + by[1]];
                robot.place = moved(robot.place);
                let start = raw.flight.start.iter_mut().filter(|start| start.robot == robot.name);
                start.for_each(|start| start.place = moved(start.place));
            }
            Edit::Link { robots: [a, b] } => {
                let (a, b) = (known(*a)?, known(*b)?);
                if !matches!(raw.links, Some(RawLinks::Listed {})) {
                    return Err("neighbours are found anew in every period: there is nothing to link".into());
                }
                if a == b {
                    return Err("a robot does not follow itself: link it to another".into());
                }
                let names = [a, b].map(|k| raw.robots[k].name.clone());
                let is_linked =
                    [(a, 1), (b, 0)].map(|(k, other)| raw.robots[k].neighbours.contains(&names[other]));
                if is_linked.contains(&true) {
                    raw.robots[a].neighbours.retain(|name| *name != names[1]);
                    raw.robots[b].neighbours.retain(|name| *name != names[0]);
                } else {
                    link(raw, a, b);
                }
            }
            Edit::Rename { robot, name } => {
                let robot = known(*robot)?;
                if raw.robots.iter().enumerate().any(|(other, raw)| other != robot && raw.name == *name) {
                    return Err(format!("two robots are called `{name}`: give each a name of its own"));
                }
                let before = std::mem::replace(&mut raw.robots[robot].name, name.clone());
                mentions(raw)
                    .filter(|mention| **mention == before)
                    .for_each(|mention| mention.clone_from(name));
            }
            Edit::Lead { robot, leads } => {
                let robot = known(*robot)?;
                let name = raw.robots[robot].name.clone();
                let is_led = raw.leaders.iter().any(|entry| entry.robots.contains(&name));
                if *leads && !is_led {
                    lead(raw, robot);
                } else if !*leads {
                    raw.leaders.iter_mut().for_each(|entry| entry.robots.retain(|led| *led != name));
                    raw.leaders.retain(|entry| !entry.robots.is_empty());
                    if raw.robots[robot].neighbours.is_empty() {
                        link_to_nearest(raw, robot);
                    }
                }
            }
            Edit::Remove { robot } => {
                let RawRobot { name, .. } = raw.robots.remove(known(*robot)?);
                raw.robots.iter_mut().for_each(|robot| robot.neighbours.retain(|other| *other != name));
                raw.leaders.iter_mut().for_each(|entry| entry.robots.retain(|led| *led != name));
                raw.leaders.retain(|entry| !entry.robots.is_empty());
                raw.flight.start.retain(|start| start.robot != name);
                raw.flight.faults.retain(|fault| fault.robot != name);
                let is_of = |what: &RawCommandKind| matches!(what, RawCommandKind::Lead { robot, .. } if *robot == name);
                raw.flight.commands.retain(|command| !is_of(&command.what));
            }
        }
        Ok(())
    }
}

/// Every place of a file that names a robot, but for the robots' own names.
fn mentions(raw: &mut RawSwarm) -> impl Iterator<Item = &mut String> {
    let neighbours = raw.robots.iter_mut().flat_map(|robot| &mut robot.neighbours);
    let leaders = raw.leaders.iter_mut().flat_map(|entry| &mut entry.robots);
    let starts = raw.flight.start.iter_mut().map(|start| &mut start.robot);
    let faults = raw.flight.faults.iter_mut().map(|fault| &mut fault.robot);
    let commands = raw.flight.commands.iter_mut().filter_map(|command| match &mut command.what {
        RawCommandKind::Lead { robot, .. } => Some(robot),
        _ => None,
    });
    neighbours.chain(leaders).chain(starts).chain(faults).chain(commands)
}

fn link(raw: &mut RawSwarm, a: usize, b: usize) {
    for (robot, other) in [(a, b), (b, a)] {
        let name = raw.robots[other].name.clone();
        let neighbours = &mut raw.robots[robot].neighbours;
        if !neighbours.contains(&name) {
            neighbours.push(name);
        }
    }
}

/// Where links are listed, those to the nearest robots, and to others as near as the last of them.
fn link_to_nearest(raw: &mut RawSwarm, robot: usize) {
    if !matches!(raw.links, Some(RawLinks::Listed {})) {
        return;
    }
    let apart = |k: usize| distance(raw.robots[k].place, raw.robots[robot].place);
    let mut others: Vec<(f64, usize)> =
        (0..raw.robots.len()).filter(|&k| k != robot).map(|k| (apart(k), k)).collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(last, _)) = others.get(NEAREST.min(others.len()).wrapping_sub(1)) else { return };
    let near = others.into_iter().filter(|(apart, _)| *apart <= last * (1.0 + 1e-9));
    near.for_each(|(_, k)| link(raw, robot, k));
}

/// By the first program of the file, or else from outside.
fn lead(raw: &mut RawSwarm, robot: usize) {
    let name = raw.robots[robot].name.clone();
    match raw.leaders.first_mut() {
        Some(entry) => entry.robots.push(name),
        None => {
            let program = RawProgram::External {};
            raw.leaders.push(RawLeaders { robots: vec![name], region: None, program });
        }
    }
}
