//! The places at which robots start: clear of obstacles and of each other.

use super::Flight;
use crate::flock::rounding::ROUNDING;
use crate::flock::vectors::distance;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::text::decimals;

/// Refuses robots that start inside an obstacle or, where robots are kept apart, inside another robot.
///
/// # Errors
/// Names the first such robot.
pub fn require_free(swarm: &Swarm, flight: &Flight) -> Result<(), SceneError> {
    let control = flight.control();
    let formation = control.formation();
    let (places, obstacles) = (flight.fleet().places(), control.filter().obstacles());
    for m in 0..formation.count() {
        let overlap = formation.radii[m] - obstacles.distance(places.get(m));
        if overlap > ROUNDING {
            let message = format!(
                "`{}` starts at {:?}, {} m deep in an obstacle",
                formation.names[m],
                places.get(m),
                decimals(overlap, 3)
            );
            let help = "move the obstacle, or start the robot elsewhere: flight.start";
            return Err(swarm.refuse(&key(swarm, &formation.names[m], m), message, help));
        }
    }
    if swarm.raw.limits.clearance.is_none() {
        return Ok(());
    }
    for start in &swarm.raw.flight.start {
        let Some(i) = formation.number(&start.robot) else { continue };
        for j in (0..formation.count()).filter(|&j| j != i) {
            let apart = distance(places.get(i), places.get(j));
            let needed = formation.radii[i] + formation.radii[j];
            if apart < needed - ROUNDING {
                let [first, second] = [i, j].map(|m| &formation.names[m]);
                let [apart, needed] = [apart, needed].map(|length| decimals(length, 3));
                let message =
                    format!("`{first}` starts {apart} m from `{second}`, and their radii need {needed} m");
                return Err(swarm.refuse(&key(swarm, first, i), message, "start the robots farther apart"));
            }
        }
    }
    Ok(())
}

/// The key that has the place at which a robot starts.
fn key(swarm: &Swarm, name: &str, member: usize) -> String {
    match swarm.raw.flight.start.iter().rposition(|start| start.robot == name) {
        Some(k) => format!("flight.start[{k}].place"),
        None if member < swarm.raw.robots.len() => format!("robots[{member}].place"),
        None => "obstacles".into(),
    }
}
