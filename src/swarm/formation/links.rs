//! The neighbours of robots that stand on no lattice.

use crate::flock::neighbourhood::Neighbours;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::RawLinks;

/// Neighbours of each robot by its place, in order of number; empty where they are found anew every period.
pub fn neighbours(swarm: &Swarm, places: &Vectors) -> Result<Neighbours, SceneError> {
    let links = swarm.raw.links.clone().unwrap_or(RawLinks::Nearest { count: 6 });
    let lists: Vec<Vec<u32>> = match links {
        RawLinks::Nearest { count } => (0..places.len()).map(|i| nearest(places, i, count)).collect(),
        RawLinks::Within { radius } => (0..places.len())
            .map(|i| others(places, i).filter(|&k| apart(places, i, k) <= radius).collect())
            .collect(),
        RawLinks::Listed {} => listed(swarm)?,
        RawLinks::Present { .. } => vec![Vec::new(); places.len()],
    };
    Ok(Neighbours::from_lists(lists))
}

fn others(places: &Vectors, i: usize) -> impl Iterator<Item = u32> {
    (0..places.len() as u32).filter(move |&k| k as usize != i)
}

fn apart(places: &Vectors, i: usize, k: u32) -> f64 {
    distance(places.get(i), places.get(k as usize))
}

/// Part of a distance within which two are equal: places are given to a few digits.
const EQUAL: f64 = 1e-4;

/// The `count` nearest, and all as near as the last of them.
fn nearest(places: &Vectors, i: usize, count: usize) -> Vec<u32> {
    let mut distances: Vec<f64> = others(places, i).map(|k| apart(places, i, k)).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let Some(&last) = distances.get(count.min(distances.len()).wrapping_sub(1)) else { return Vec::new() };
    let as_near = last * (1.0 + EQUAL);
    others(places, i).filter(|&k| apart(places, i, k) <= as_near).collect()
}

fn listed(swarm: &Swarm) -> Result<Vec<Vec<u32>>, SceneError> {
    let robots = &swarm.raw.robots;
    let list = |(i, robot): (usize, &crate::scene::swarm::raw::RawRobot)| {
        let number = |(n, name): (usize, &String)| {
            let key = format!("robots[{i}].neighbours[{n}]");
            let k = robots.iter().position(|other| other.name == *name);
            let k =
                k.ok_or_else(|| swarm.refuse(&key, "there is no such robot", "name a robot of this file"))?;
            if k == i {
                return Err(swarm.refuse(&key, "a robot does not follow itself", "name others"));
            }
            Ok(k as u32)
        };
        let mut list = robot.neighbours.iter().enumerate().map(number).collect::<Result<Vec<_>, _>>()?;
        list.sort_unstable();
        list.dedup();
        Ok(list)
    };
    robots.iter().enumerate().map(list).collect()
}
