//! From the roles of a scene to what its particles are made to do.

use std::collections::{BTreeMap, HashSet};

use super::Layout;
use crate::engine::setup::RoleChange;
use crate::flock::body::Body;
use crate::flock::motion::Motion;
use crate::flock::role::Role;
use crate::flock::rules::Axis;
use crate::flock::vectors::Vectors;
use crate::ranks::{Team, gathered};
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
            require_free_components(scene, &changes, &self.body, None)?;
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

/// The particles of an entry that holds or leads one component from the start.
struct Covered {
    entry: usize,
    /// Those that no entry above holds altogether.
    free: u64,
    /// Those that an entry above does, by its number; none is left out.
    held: Vec<(usize, u64)>,
}

/// Found by all ranks together where each has a part of the body.
fn covered(changes: &[RoleChange], body: &Body, team: Option<&Team>) -> Vec<Covered> {
    let mut holder = vec![None; body.count()];
    let (mut entries, mut counts) = (Vec::new(), Vec::new());
    for (k, change) in changes.iter().enumerate().filter(|(_, change)| change.is_at_once()) {
        if change.axis.is_none() {
            let holds = change.role != Role::Follower;
            change.particles.iter().for_each(|&i| holder[i] = holds.then_some(k));
            continue;
        }
        // By the entry above, and last those of none.
        let mut own = vec![0; changes.len() + 1];
        let particles = change.particles.iter().filter(|i| body.owned().contains(i));
        particles.for_each(|&i| own[holder[i].unwrap_or(changes.len())] += 1);
        entries.push(k);
        counts.push(own);
    }
    let own = counts.concat();
    let each = own.len();
    let all = gathered(team, own);
    let count = |n: usize| all.iter().skip(n).step_by(each).sum::<u64>();
    let covered = |(n, entry): (usize, usize)| {
        let count = |above: usize| count(n * (changes.len() + 1) + above);
        let held = (0..changes.len()).map(|above| (above, count(above))).filter(|(_, held)| *held > 0);
        Covered { entry, free: count(changes.len()), held: held.collect() }
    };
    entries.into_iter().enumerate().map(covered).collect()
}

/// Refuses single components of particles all of which an entry above holds altogether: nothing would be left of them; and
/// entries that take particles later of which one component is held. On all ranks alike, where each has a part of the body.
pub fn require_free_components(
    scene: &Scene,
    changes: &[RoleChange],
    body: &Body,
    team: Option<&Team>,
) -> Result<(), SceneError> {
    for Covered { entry, free, held } in covered(changes, body, team) {
        if let (0, Some(((first, _), others))) = (free, held.split_first()) {
            let hold = if others.is_empty() { "holds" } else { "and others above hold" };
            let message = format!("is without effect: roles[{first}] {hold} these particles altogether");
            let help = "leave it out, or take its particles out of the other region";
            return Err(scene.refuse(&format!("roles[{entry}].axis"), message, help));
        }
    }
    let held: HashSet<usize> = held_components(changes, body, 0.0).iter().map(|held| held.particle).collect();
    for (k, change) in changes.iter().enumerate().filter(|(_, change)| !change.is_at_once()) {
        let takes_held = change.particles.iter().any(|i| body.owned().contains(i) && held.contains(i));
        if team.map_or(takes_held, |team| team.any(takes_held)) {
            let message = "takes particles later of which one component is held from the start and for good";
            let help = "take them out of its region, or leave axis out of the entry that holds them";
            return Err(scene.refuse(&format!("roles[{k}].region"), message.to_owned(), help));
        }
    }
    Ok(())
}

/// A warning for each entry that leads one component of particles some of which an entry above holds altogether.
pub fn cautions(changes: &[RoleChange], body: &Body, team: Option<&Team>) -> Vec<String> {
    let leads = |of: &Covered| changes[of.entry].role == Role::Leader;
    let caution = |Covered { entry, free, held }: Covered| {
        let (first, _) = held.first()?;
        let stay: u64 = held.iter().map(|(_, held)| held).sum();
        Some(format!(
            "roles[{entry}] leads one component of {} particles, but {stay} of these stay as roles[{first}] has them, which holds them \
             altogether; take them out of its region to have them led",
            free + stay
        ))
    };
    covered(changes, body, team).into_iter().filter(leads).filter_map(caution).collect()
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
                components.remove(&(i, 0));
                components.remove(&(i, 1));
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
