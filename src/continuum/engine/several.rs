//! Several steps of a body at once, where nothing in between depends on how it stands.

use super::{Engine, Led as Leader};
use crate::continuum::layout::RoleChange;
use crate::flock::interaction::Interaction;
use crate::flock::points::{Points, distance};
use crate::solve::sweep::{Activity, Led, MOST_STEPS};

impl Engine {
    /// How many steps, at most `most`, can be taken by [`Engine::advance_by`] from here; 0 where the next one
    /// must be taken by [`Engine::advance`]: a frame that looks after the sweep, bonds that may break, neighbours
    /// found anew and roles that change look at every step.
    pub fn steps_at_once(&self, most: usize) -> usize {
        let finds_neighbours = self.present_neighbours.is_some();
        let looks = looks_at_every_step(finds_neighbours, &self.interaction, &self.changes);
        if looks || !self.guided.is_empty() || !self.takes_several || self.moves_components() {
            return 0;
        }
        let to_come = self.changes.iter().map(|change| change.from).filter(|&from| from > self.step.max(1));
        let until = to_come.min().map_or(usize::MAX, |from| from - 1 - self.step);
        most.min(until).min(MOST_STEPS)
    }

    /// Takes so many steps, as many as [`Engine::steps_at_once`] allows; the bits are those of single ones. For each,
    /// whether somebody is known to have moved farther in it than `farther` \[length\].
    pub fn advance_by(&mut self, count: usize, farther: Option<f64>) -> Vec<bool> {
        let (leaders, changes, step) = (&self.leaders, &self.changes, self.step);
        let place = |which: usize, level: usize| {
            leaders[which].place(changes, step + level).expect("leaders have a motion")
        };
        let led = Led { particles: &self.led, place: &place };
        let places = (&mut self.present, &mut self.previous);
        let frame = self.body.frame.as_ref();
        let told =
            self.sweep.steps(&self.interaction, frame, places, (count, led, farther), &mut self.activity);
        self.step += count;
        self.settled = None;
        told
    }

    /// Puts the body back to where it stood at an earlier step, with the same roles, as if it had not gone on.
    pub fn return_to(&mut self, step: usize, places: &Points, activity: Activity) {
        self.step = step;
        self.settled = None;
        self.follow_ramp();
        self.present.clone_from(places);
        self.activity = activity;
        self.activity.forget();
    }

    /// What was swept so far.
    pub fn activity(&self) -> &Activity {
        &self.activity
    }

    /// How far from its reference place a leader gets in the next steps at most \[length\].
    pub fn leaders_reach(&self, steps: usize) -> f64 {
        let farthest = |leader: &Leader| {
            let reference = self.body.reference.get(leader.particle);
            let far = |step: usize| {
                leader.place(&self.changes, step).map_or(0.0, |place| distance(place, reference))
            };
            (self.step + 1..=self.step + steps).map(far).fold(0.0, f64::max)
        };
        self.leaders.iter().map(farthest).fold(0.0, f64::max)
    }

    /// Whether everybody's target in the reference configuration is where they stand, to rounding. A mean then
    /// takes nobody farther from there, along an axis, than somebody is already.
    pub fn rests_at_reference(&self) -> bool {
        let reference = &self.body.reference;
        let near = 1e-9 * self.body.lattice.spacing();
        let rests = |j: usize| distance(self.interaction.target(j, reference), reference.get(j)) <= near;
        self.body.matter().all(rests)
    }
}

/// Whether something of a body depends on how it stands in each step: then steps are taken one at a time.
pub fn looks_at_every_step(
    finds_neighbours: bool,
    interaction: &Interaction,
    changes: &[RoleChange],
) -> bool {
    finds_neighbours
        || interaction.bonds.as_ref().is_some_and(|bonds| bonds.threshold.is_some())
        || changes.iter().any(|change| change.when.is_some())
}
