//! Checks of a formation that has been laid out.

use super::Formation;
use crate::flock::vectors::distance;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;

/// Refuses places at which two robots would be closer than the swarm's own limit.
pub fn require_apart(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let Some(clearance) = swarm.raw.limits.clearance else { return Ok(()) };
    for i in 0..formation.count() {
        for j in 0..i {
            let needed = formation.radii[i] + formation.radii[j] + clearance;
            let apart = distance(formation.places.get(i), formation.places.get(j));
            if apart < needed {
                let [apart, needed] = [apart, needed].map(rounded);
                let message = format!(
                    "the places of `{}` and `{}` are {apart} m apart, and their radii and the clearance need {needed} m",
                    formation.names[j], formation.names[i]
                );
                return Err(swarm.refuse(
                    "limits.clearance",
                    message,
                    "widen the formation, or lower the clearance or the radius",
                ));
            }
        }
    }
    Ok(())
}

/// A length of which the digits of rounding errors are left out \[m\]: micrometres are kept.
fn rounded(length: f64) -> f64 {
    (length * 1e6).round() / 1e6
}

/// Refuses places where no pose would be believed.
pub fn require_in_range(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let (middle, range) = (formation.middle(), swarm.raw.poses.range);
    let off = |m: usize| distance(formation.places.get(m), middle);
    let farthest = (0..formation.count()).max_by(|&a, &b| off(a).total_cmp(&off(b)));
    match farthest.filter(|&m| off(m) > range) {
        None => Ok(()),
        Some(m) => {
            let key = match swarm.raw.robots.len() {
                0 => "poses.range".into(),
                _ => format!("robots[{m}].place"),
            };
            let message = format!(
                "`{}` is {:.4e} m from the formation's middle, and poses farther than poses.range ({range} m) are rejected",
                formation.names[m],
                off(m)
            );
            Err(swarm.refuse(&key, message, "give places nearer to each other, or raise poses.range"))
        }
    }
}

/// Refuses more liars than could ever be outvoted by the robots that measure.
pub fn require_witnesses(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let Some(ranges) = &swarm.raw.ranges else { return Ok(()) };
    let others = formation.count().saturating_sub(1);
    if ranges.max_liars < others {
        return Ok(());
    }
    let message = format!(
        "a pose is contradicted by more robots than this, and there are {others} that could measure it: no lie would ever be \
         found"
    );
    Err(swarm.refuse("ranges.max_liars", message, "lower it, or leave ranges out"))
}
