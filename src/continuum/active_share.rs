//! How far motion can have come: one neighbour a step.

use super::plan::Plan;
use crate::engine::setup::Setup;
use crate::engine::several::looks_at_every_step;
use crate::flock::role::Role;
use crate::geometry::lists::Lists;
use crate::sweep::Sweep;

/// Share of the followers' updates that the motion of the leaders can reach within `stop.steps` \[1\]; the others
/// are known to change nothing and are left out. `None` where every update is made: the sweep of this scene does not
/// look for what stands still.
pub fn active_share(plan: &Plan, sweep: &Sweep) -> Option<f64> {
    let Setup { body, flock, changes, present_radius, actions, .. } = &plan.setup;
    let looks = looks_at_every_step(present_radius.is_some(), flock, changes);
    // A load moves all of a body at once, and so may an action.
    if looks || flock.forces.is_some() || !actions.is_empty() || !sweep.takes_several(body.frame.as_ref()) {
        return None;
    }
    let steps = plan.stop.steps;
    let begins = first_motions(plan, steps);
    let reached = |begin: usize| (steps + 1).saturating_sub(begin) as f64;
    let updates: f64 = begins.iter().map(|&begin| reached(begin)).sum();
    Some(updates / (steps as f64 * plan.count() as f64))
}

/// The step in which each particle can move first, beyond the last one for those that nothing reaches.
fn first_motions(plan: &Plan, steps: usize) -> Vec<usize> {
    let mut begins = vec![steps + 1; plan.count()];
    let (flock, roles) = (&plan.setup.flock, &plan.setup.roles);
    let is_at_rest = |i: usize| flock.target(i, &flock.reference) == flock.reference.get(i);
    let unbalanced = (0..plan.count()).filter(|&i| roles[i] == Role::Follower && !is_at_rest(i));
    // Particles that are moved, those that are released, and those that do not rest where they stand.
    let mut starts: Vec<(usize, usize)> = plan
        .setup
        .changes
        .iter()
        .filter(|change| change.motion.is_some() || change.from > 1)
        .flat_map(|change| change.particles.iter().map(|&particle| (change.from.max(1), particle)))
        .chain(unbalanced.map(|i| (1, i)))
        .collect();
    starts.sort_unstable();
    let (seen_by, mut to_come) = (seen_by(plan), starts.into_iter().peekable());
    let mut front: Vec<usize> = Vec::new();
    for step in 1..=steps {
        let mut moved = std::mem::take(&mut front);
        while let Some((_, particle)) = to_come.next_if(|&(from, _)| from <= step) {
            moved.push(particle);
        }
        moved.retain(|&particle| {
            let first = begins[particle] > step;
            begins[particle] = begins[particle].min(step);
            first
        });
        if moved.is_empty() && to_come.peek().is_none() {
            break;
        }
        for &particle in &moved {
            front.extend(seen_by.of(particle).iter().map(|&seer| seer as usize));
        }
    }
    begins
}

/// The particles that see each one: the frame sees those it serves.
fn seen_by(plan: &Plan) -> Lists {
    let neighbours = &plan.setup.flock.neighbours;
    let pairs = || {
        let lists = (0..plan.count()).flat_map(|j| neighbours.of(j).iter().map(move |&k| (k, j as u32)));
        let points = plan.setup.body.frame.iter().flat_map(|frame| (0..frame.len()).map(move |k| (frame, k)));
        let served = points
            .flat_map(|(frame, k)| frame.served_by(k).iter().map(move |&served| (served, frame.points[k])));
        lists.chain(served)
    };
    Lists::sorted(plan.count(), pairs)
}
