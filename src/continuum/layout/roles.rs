//! From the roles of a scene to what its particles are made to do.

use std::collections::BTreeMap;

use super::Layout;
use crate::engine::setup::RoleChange;
use crate::flock::body::Body;
use crate::flock::motion::Motion;
use crate::flock::role::Role;
use crate::flock::rules::Axis;
use crate::flock::vectors::Vectors;
use crate::scene::{LeaderMotion, RoleEntry, Scene, SceneError};
use crate::solve::linear::HeldComponent;

/// A reference solution: displacements \[length\] of the body at these places of it at rest \[length\], shape \[count\].
pub type ReferenceMotion<'a> = &'a dyn Fn(&Vectors) -> Vec<[f64; 2]>;

impl Layout {
    /// Role changes in the order in which they are written. Leaders led by a reference
    /// solution have no motion where that is not known.
    ///
    /// # Errors
    /// Names a region without particles, an id that does not exist, a table that misses a particle.
    pub fn role_changes(
        &self,
        scene: &Scene,
        solution: Option<ReferenceMotion<'_>>,
    ) -> Result<Vec<RoleChange>, SceneError> {
        let change = |(k, entry): (usize, &RoleEntry)| {
            let particles = self.pick(scene, &format!("roles[{k}]"), &entry.region)?;
            let motion = self.motion(scene, k, entry, &particles, solution)?;
            let RoleEntry { role, axis, from, when, .. } = *entry;
            Ok(RoleChange { particles, role, axis, from, when, motion })
        };
        let changes = scene.roles.iter().enumerate().map(change).collect::<Result<Vec<_>, SceneError>>()?;
        // A part of a body may have just the corner that two regions share.
        if self.body.part.is_none() {
            require_free_components(scene, &changes, self.body.count())?;
        }
        Ok(changes)
    }

    fn motion(
        &self,
        scene: &Scene,
        entry_number: usize,
        entry: &RoleEntry,
        particles: &[usize],
        solution: Option<ReferenceMotion<'_>>,
    ) -> Result<Option<Motion>, SceneError> {
        let reference = &self.body.reference;
        let (displacements, steps) = match &entry.motion {
            None => return Ok(None),
            Some(LeaderMotion::Program(motion)) => return Ok(Some(motion.clone())),
            Some(LeaderMotion::Table { rows, steps }) => {
                let of_rows = rows.of(particles, &self.body);
                let displacements = of_rows.map_err(|message| {
                    let key = format!("roles[{entry_number}].motion.file");
                    let help = "give every particle of the region a row, or narrow the region";
                    scene.refuse(&key, message, help)
                })?;
                (displacements, *steps)
            }
            Some(LeaderMotion::Reference { steps }) => {
                let Some(solution) = solution else { return Ok(None) };
                (solution(&particles.iter().map(|&i| reference.get(i)).collect()), *steps)
            }
        };
        Ok(Some(Motion::Table { displacements, steps: steps as f64 }))
    }
}

/// The entries that hold or lead one component from the start, by number, and of each of their particles the entry above
/// that holds it altogether.
fn covered(changes: &[RoleChange], count: usize) -> Vec<(usize, Vec<Option<usize>>)> {
    let mut holder = vec![None; count];
    let mut covered = Vec::new();
    for (k, change) in changes.iter().enumerate().filter(|(_, change)| change.is_at_once()) {
        if change.axis.is_some() {
            covered.push((k, change.particles.iter().map(|&i| holder[i]).collect()));
        } else {
            let holds = change.role != Role::Follower;
            change.particles.iter().for_each(|&i| holder[i] = holds.then_some(k));
        }
    }
    covered
}

/// Refuses single components of particles all of which an entry above holds altogether: nothing would be left of them.
fn require_free_components(scene: &Scene, changes: &[RoleChange], count: usize) -> Result<(), SceneError> {
    for (k, held) in covered(changes, count) {
        let held: Option<Vec<usize>> = held.into_iter().collect();
        if let Some([first, others @ ..]) = held.as_deref() {
            let hold = if others.iter().all(|by| by == first) { "holds" } else { "and others above hold" };
            let message = format!("is without effect: roles[{first}] {hold} these particles altogether");
            let help = "leave it out, or take its particles out of the other region";
            return Err(scene.refuse(&format!("roles[{k}].axis"), message, help));
        }
    }
    Ok(())
}

/// A warning for each entry that leads one component of particles some of which an entry above holds altogether.
pub fn cautions(changes: &[RoleChange], count: usize) -> Vec<String> {
    let leads = |(k, _): &(usize, Vec<Option<usize>>)| changes[*k].role == Role::Leader;
    let caution = |(k, held): (usize, Vec<Option<usize>>)| {
        let first = held.iter().flatten().next()?;
        let stay = held.iter().flatten().count();
        Some(format!(
            "roles[{k}] leads one component of {} particles, but {stay} of these stay as roles[{first}] has them, which holds them \
             altogether; take them out of its region to have them led",
            held.len()
        ))
    };
    covered(changes, count).into_iter().filter(leads).filter_map(caution).collect()
}

/// Displacement \[length\] of each particle that does not follow, at `step`; `None` for followers and for leaders
/// led by a reference solution that is not known, shape \[count\]. Only roles that hold from the start count.
pub fn held(changes: &[RoleChange], body: &Body, step: f64) -> Vec<Option<[f64; 2]>> {
    let mut held = vec![None; body.count()];
    for change in changes.iter().filter(|change| change.is_at_once()) {
        for (which, &i) in change.particles.iter().enumerate().filter(|_| change.axis.is_none()) {
            let base = body.reference.get(i);
            held[i] = match (change.role, &change.motion) {
                (Role::Leader, Some(motion)) => Some(motion.displacement(step, which, base)),
                (Role::Clamped, _) => Some([0.0; 2]),
                _ => None,
            };
        }
    }
    held
}

/// The single components that are held at `step`, by particle and axis; later roles win, and none of a particle that is
/// held altogether.
pub fn held_components(changes: &[RoleChange], body: &Body, step: f64) -> Vec<HeldComponent> {
    let mut components: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for change in changes.iter().filter(|change| change.is_at_once()) {
        for (which, &i) in change.particles.iter().enumerate() {
            let Some(axis) = change.axis else {
                components.retain(|(particle, _), _| *particle != i);
                continue;
            };
            let moved = match &change.motion {
                Some(motion) => motion.displacement(step, which, body.reference.get(i)),
                None => [0.0; 2],
            };
            components.insert((i, axis as usize), moved[axis as usize]);
        }
    }
    let component = |((particle, axis), displacement)| {
        let axis = if axis == 0 { Axis::X } else { Axis::Y };
        HeldComponent { particle, axis, displacement }
    };
    components.into_iter().map(component).collect()
}
