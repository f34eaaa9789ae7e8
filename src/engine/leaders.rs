//! Roles that particles take on the way, and leaders under their programs.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use super::setup::RoleChange;
use super::{Before, Engine};
use crate::flock::condition::Quantity;
use crate::flock::role::Role;
use crate::flock::vectors::distance;

/// A particle under a leader's program.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Led {
    pub particle: usize,
    /// Which role change made it a leader, and its number among that change's particles.
    pub change: usize,
    pub which: usize,
    /// Step before the first one led.
    pub since: usize,
    pub base: [f64; 2],
}

impl Led {
    /// Where its program has it after so many steps \[length\].
    pub fn place(&self, changes: &[RoleChange], step: usize) -> Option<[f64; 2]> {
        let motion = changes[self.change].motion.as_ref()?;
        let [dx, dy] = motion.displacement((step - self.since) as f64, self.which, self.base);
        Some([self.base[0] + dx, self.base[1] + dy])
    }
}

/// A particle that is put somewhere from outside, as long as no program leads it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Guided {
    pub particle: usize,
    pub place: [f64; 2],
    /// Whether it is there in one of the two sets of places that steps lead between.
    pub is_there: bool,
}

impl Engine {
    /// Takes the roles of this step; `before` it, where that is to be noted.
    pub(super) fn take_roles(&mut self, mut before: Option<&mut Before>) {
        let mut changed = false;
        for change in 0..self.changes.len() {
            // The ranks that have no particle of it compile their sweeps with the others.
            let Some(taking) = self.taking(change) else { continue };
            if let Some(before) = before.take() {
                before.note_roles(self);
            }
            self.take_role(change, &taking, self.step - 1);
            let role = self.changes[change].role.name();
            tracing::debug!("step {}: {} particles become {role}", self.step, taking.len());
            changed = true;
        }
        if changed {
            self.after_role_change();
        }
    }

    /// Gives these particles of a change its role, and puts them under its motion.
    pub(super) fn take_role(&mut self, change: usize, taking: &[usize], since: usize) {
        for &which in taking {
            let particle = self.changes[change].particles[which];
            self.roles[particle] = self.changes[change].role;
            if let Some(last) = self.taken_by.get_mut(particle) {
                *last = (*last).max(change as u32 + 1);
            }
        }
        self.start_leading(change, taking, since);
    }

    /// What [`Engine::taken_by`] is after the steps so far by the changes that have no condition.
    pub(super) fn taken_until_now(&self) -> Vec<u32> {
        if self.changes.iter().all(|change| change.when.is_none()) {
            return Vec::new();
        }
        let mut taken_by = vec![0; self.roles.len()];
        let has_begun = |change: &&RoleChange| change.from <= self.step.max(1) && change.when.is_none();
        let is_taken = |change: &&RoleChange| has_begun(change) && change.axis.is_none();
        for (change, number) in self.changes.iter().zip(1..).filter(|(change, _)| is_taken(change)) {
            change.particles.iter().for_each(|&particle| taken_by[particle] = number);
        }
        taken_by
    }

    /// Which of a change's particles take its role at this step; `None` if none of the whole body do. By a condition it
    /// takes each of them once, and none that a later one has taken.
    fn taking(&self, change: usize) -> Option<Vec<usize>> {
        let RoleChange { particles, from, when, .. } = &self.changes[change];
        match when {
            // Those from the start hold already.
            None => (*from == self.step && *from > 1).then(|| (0..particles.len()).collect()),
            Some(condition) if *from <= self.step => {
                let owned = self.body.owned();
                let meets = |&which: &usize| {
                    let particle = particles[which];
                    owned.contains(&particle)
                        && self.taken_by.get(particle).is_none_or(|&last| last as usize <= change)
                        && condition.holds(self.quantity(condition.quantity, particle))
                };
                let own: Vec<usize> = (0..particles.len()).filter(meets).collect();
                let Some(team) = self.parted() else { return Some(own).filter(|own| !own.is_empty()) };
                let index = |which: usize| self.body.index(particles[which]) as u64;
                let own: Vec<u64> = own.into_iter().map(index).collect();
                let all = team.gather_all(&own);
                let here =
                    |&index: &u64| particles.binary_search(&self.body.exact_particle(index as usize)?).ok();
                (!all.is_empty()).then(|| all.iter().filter_map(here).collect())
            }
            Some(_) => None,
        }
    }

    /// Puts these particles of a change under its motion, if it has one, and under no other.
    pub(super) fn start_leading(&mut self, change: usize, taking: &[usize], since: usize) {
        let RoleChange { particles, motion, .. } = &self.changes[change];
        let mut taken = vec![false; self.roles.len()];
        taking.iter().for_each(|&which| taken[particles[which]] = true);
        self.leaders.retain(|led| !taken[led.particle]);
        if motion.is_some() {
            self.leaders.extend(taking.iter().map(|&which| {
                let particle = particles[which];
                Led { particle, change, which, since, base: self.present.get(particle) }
            }));
            self.leaders.sort_unstable_by_key(|led| led.particle);
        }
        self.led = self.leaders.iter().map(|led| led.particle).collect();
    }

    /// Puts components of a change's particles, one of them or both, under its motion, if it has one, and under no other.
    pub(super) fn lead_components(&mut self, change: usize) {
        let RoleChange { particles, motion, axis, .. } = &self.changes[change];
        let taken: HashSet<usize> = particles.iter().copied().collect();
        let is_of = |of: usize| axis.is_none_or(|axis| axis as usize == of);
        self.led_components.retain(|(led, of)| !is_of(*of) || !taken.contains(&led.particle));
        if let (Some(_), Some(axis)) = (motion, axis) {
            let base = |particle: usize| self.body.reference.get(particle);
            let led = |(which, &particle): (usize, &usize)| {
                (Led { particle, change, which, since: 0, base: base(particle) }, *axis as usize)
            };
            self.led_components.extend(particles.iter().enumerate().map(led));
        }
    }

    /// The rule keeps held components where their rest offsets say.
    pub(super) fn move_components(&mut self) {
        for (led, axis) in &self.led_components {
            if self.roles[led.particle].is_led() {
                continue;
            }
            if let Some(place) = led.place(&self.changes, self.step) {
                self.flock.hold_at(led.particle, *axis, place[*axis]);
            }
        }
    }

    /// The rule keeps led components where they are.
    pub(super) fn hold_components(&mut self) {
        for (Led { particle, .. }, axis) in &self.led_components {
            self.flock.hold_at(*particle, *axis, self.present.get(*particle)[*axis]);
        }
    }

    /// Puts them there after a step: damping leads a rest offset only part of the way.
    pub(super) fn place_components(&mut self) {
        for (led, axis) in &self.led_components {
            if self.roles[led.particle].is_led() {
                continue;
            }
            if let Some(place) = led.place(&self.changes, self.step) {
                let component = if *axis == 0 { &mut self.present.x } else { &mut self.present.y };
                component[led.particle] = place[*axis];
            }
        }
    }

    /// Whether the motion of a single component goes on after this step.
    pub(super) fn moves_components(&self) -> bool {
        // By the changes: of a body in parts the particles may all be on other ranks.
        (0..self.changes.len()).any(|k| self.changes[k].axis.is_some() && self.motion_goes_on(k, 0))
    }

    /// Whether a leader's motion goes on after this step.
    pub(super) fn goes_on(&self, led: &Led) -> bool {
        self.motion_goes_on(led.change, led.since)
    }

    fn motion_goes_on(&self, change: usize, since: usize) -> bool {
        let duration = self.changes[change].motion.as_ref().map(|motion| motion.duration());
        match duration {
            None => false,
            Some(None) => true,
            Some(Some(duration)) => since.saturating_add(duration) > self.step,
        }
    }

    pub(super) fn move_leaders(&mut self) {
        for led in &self.leaders {
            if let Some(place) = led.place(&self.changes, self.step) {
                self.previous.set(led.particle, place);
            }
        }
        let mut guided = std::mem::take(&mut self.guided);
        // What is put somewhere now has the last word.
        guided.sort_by_key(|one| !one.is_there);
        guided.retain_mut(|&mut Guided { particle, place, ref mut is_there }| {
            let (was_there, has_program) = (std::mem::replace(is_there, true), self.has_program(particle));
            if !(was_there && has_program) {
                self.previous.set(particle, place);
            }
            !was_there && !has_program
        });
        self.guided = guided;
    }

    fn has_program(&self, particle: usize) -> bool {
        self.leaders.binary_search_by_key(&particle, |led| led.particle).is_ok()
    }

    /// Whether nothing moves a particle but what puts it somewhere from outside.
    pub(super) fn stays(&self, particle: usize) -> bool {
        let is_swept = matches!(self.roles[particle], Role::Follower | Role::Frame);
        !is_swept && !self.has_program(particle)
    }

    fn quantity(&self, quantity: Quantity, particle: usize) -> f64 {
        match quantity {
            Quantity::X => self.present.x[particle],
            Quantity::Y => self.present.y[particle],
            Quantity::Displacement => distance(self.present.get(particle), self.body.reference.get(particle)),
            Quantity::Pe1 => self.pe1(particle),
            Quantity::Pe2 => self.pe2(particle),
        }
    }
}
