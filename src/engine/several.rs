//! Several steps of a body at once, where nothing in between depends on how it stands.

use super::leaders::Led as Leader;
use super::movement::Movement;
use super::shared::{Known, take_steps};
use super::{Before, Engine};
use crate::engine::setup::RoleChange;
use crate::flock::law::Flock;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::Point;
use crate::sweep::{Activity, Led};

/// Takes as many steps at once as can be known to hold neither the last one nor a divergence.
pub struct StepBatch {
    tolerance: Option<f64>,
    /// Largest distance from the reference place over the spacing \[1\]: that of any particle now, and the bound on it.
    displacement: f64,
    bound: f64,
    /// How far a step takes particles from the reference, if that is known.
    reach: Option<Reach>,
    /// The engine before the last step, if that may have diverged; the places where a batch began, if it may have gone too far.
    before: Before,
    is_noted: bool,
    /// Steps to be taken one at a time.
    single_steps: usize,
}

impl StepBatch {
    /// For a body that comes to rest once nothing moves farther than `tolerance`, and diverges once something is farther
    /// from its reference place than `bound`, both over the spacing \[1\].
    pub fn new(engine: &Engine, tolerance: Option<f64>, bound: f64) -> Self {
        let reach = if engine.steps_at_once(1) > 0 { engine.reach_of_a_step() } else { None };
        let displacement = engine.movement().largest_displacement;
        let before = Before::default();
        Self { tolerance, displacement, bound, reach, before, is_noted: false, single_steps: 0 }
    }

    /// The step until which nothing looks at the body: the least over `look`, the next one that an observer looks at,
    /// what the [engine](Engine::steps_at_once) has to come, and the bound on movement.
    fn quiet_until(&self, engine: &Engine, look: usize) -> usize {
        let (Some(reach), 0) = (self.reach, self.single_steps) else { return engine.step() };
        let count = engine.steps_at_once(look - engine.step());
        engine.step() + if self.may_diverge(engine, reach, count) { 0 } else { count }
    }

    /// Whether so many steps may take a particle beyond the bound.
    fn may_diverge(&self, engine: &Engine, reach: Reach, count: usize) -> bool {
        let spacing = engine.body().lattice.spacing();
        let from = f64::max(self.displacement * spacing, engine.leaders_reach(count));
        let farthest = reach.after(count, from) / spacing;
        // That is along each axis; along both at once, within the diagonal.
        farthest * std::f64::consts::SQRT_2 * (1.0 + 1e-9) > self.bound
    }

    /// Takes the last step back, which diverged.
    pub fn undo(&mut self, engine: &mut Engine) {
        if self.is_noted {
            engine.undo_step(&mut self.before);
        } else {
            // Nothing but positions that are no numbers: those of leaders whose motion is not known there.
            engine.return_to(engine.step - 1, &engine.previous.clone(), engine.activity.clone());
        }
    }

    /// Takes at least one step, and none beyond `look`; returns how the last one moved the body.
    pub fn advance(&mut self, engine: &mut Engine, look: usize) -> Movement {
        let (step, until) = (engine.step(), self.quiet_until(engine, look));
        self.is_noted = false;
        self.before.forget_engine();
        if until < step + 2 {
            self.single_steps = self.single_steps.saturating_sub(1);
            let acts = engine.acts_next();
            let may_diverge = |reach| self.may_diverge(engine, reach, 1);
            self.is_noted = engine.steps_at_once(1) == 0 || self.reach.is_none_or(may_diverge);
            if self.is_noted {
                engine.gather_seen();
                engine.advance_noting(&mut self.before);
            } else {
                engine.advance();
            }
            // Another rule takes particles another distance.
            if acts && self.reach.is_some() {
                self.reach = engine.reach_of_a_step();
            }
        } else if let Some(tolerance) = self.tolerance {
            let activity = engine.activity.clone();
            self.before.places.clone_from(&engine.present);
            let farther = tolerance * engine.body.lattice.spacing() * (1.0 + 1e-9);
            let moved = engine.advance_by(until - step, Some(farther));
            // The last one is looked at.
            if moved[..moved.len() - 1].contains(&false) {
                engine.return_to(step, &self.before.places, activity);
                self.single_steps = moved.len() - 1;
                engine.advance();
            }
        } else {
            engine.advance_by(until - step, None);
        }
        let movement = engine.movement();
        self.displacement = movement.largest_displacement;
        movement
    }
}

impl Engine {
    /// How many steps, at most `most`, [`Engine::advance_steps`] takes at once from here; 0 where the next one
    /// is taken by itself: a frame that looks after the sweep, bonds that may break, neighbours
    /// found anew and roles that change look at every step.
    pub fn steps_at_once(&self, most: usize) -> usize {
        let finds_neighbours = self.present_neighbours.is_some();
        let looks = looks_at_every_step(finds_neighbours, &self.flock, &self.changes);
        let waits = looks || !self.guided.is_empty() || !self.takes_several || self.moves_components();
        if waits || self.load.is_growing(self.step) {
            return 0;
        }
        let to_come = self.changes.iter().map(|change| change.from).filter(|&from| from > self.step.max(1));
        let to_come = to_come.chain(self.next_action());
        let until = to_come.min().map_or(usize::MAX, |from| from - 1 - self.step);
        most.min(until).min(self.sweep.steps_together().saturating_sub(self.spare_bands()))
    }

    /// Whether particles take a role at the next step whatever the body does.
    pub(super) fn takes_roles_next(&self) -> bool {
        self.changes.iter().any(|change| change.when.is_none() && change.from == self.step + 1)
    }

    /// Bands that are to be known beyond those that steps taken together need: the ones that probes look at after the last.
    fn spare_bands(&self) -> usize {
        usize::from(self.probes.is_some() && self.sweep.domain().is_some())
    }

    /// Moves the body by so many steps, several at once where nothing looks at it in between; the bits are those of single ones.
    pub fn advance_steps(&mut self, count: usize) {
        let mut to_go = count;
        while to_go > 0 {
            to_go -= self.advance_at_most(to_go);
        }
    }

    /// Takes as many steps as can be taken at once, at least one and at most `most`; returns how many.
    pub(crate) fn advance_at_most(&mut self, most: usize) -> usize {
        let count = self.steps_at_once(most);
        if count == 0 {
            self.advance();
        } else {
            self.advance_by(count, None);
        }
        count.max(1)
    }

    /// Takes so many steps, as many as [`Engine::steps_at_once`] allows; more than that would leave out what is due in between.
    /// Returns for each whether a particle is known to have moved farther in it than `farther` \[length\].
    pub(crate) fn advance_by(&mut self, count: usize, farther: Option<f64>) -> Vec<bool> {
        if count == 0 {
            return Vec::new();
        }
        let spare = self.spare_bands();
        let mut moved = Vec::with_capacity(count);
        // Probes see each step, and the bands that those to come need are moved along.
        let each = if self.probes().is_empty() { count } else { 1 };
        for taken in (0..count).step_by(each) {
            let beyond = count - taken - each + spare;
            let led = Led { particles: &self.led, places: &self.leaders_ahead(each) };
            let frame = self.body.frame.as_ref();
            let steps = self.sweep.steps_to_take(&self.flock, frame, (each, led, farther), beyond);
            // A step by itself may have been made ready for already.
            let is_known = self.known == Known::All || (self.known == Known::Seen && count + spare == 1);
            let ranks = self.team.as_ref().zip(self.sweep.domain()).filter(|_| taken == 0 && !is_known);
            let halo = ranks.map(|((team, _), domain)| (team, domain.halo(count + spare)));
            let places = [&mut self.present, &mut self.previous];
            moved.extend(take_steps(&steps, (halo, beyond), places, &mut self.activity));
            if each % 2 == 1 {
                std::mem::swap(&mut self.present, &mut self.previous);
            }
            self.forget_others();
            self.step += each;
            self.record_probes();
        }
        self.settled = None;
        if farther.is_some() { self.on_any_rank(moved) } else { moved }
    }

    /// Puts the body back to where it stood at an earlier step, with the same roles, as if it had not gone on.
    pub(super) fn return_to(&mut self, step: usize, places: &Vectors, activity: Activity) {
        self.step = step;
        self.settled = None;
        self.forget_probes_after(step);
        self.follow_ramp();
        self.present.clone_from(places);
        self.forget_others();
        self.activity = activity;
        self.activity.forget();
    }

    /// Activity of the sweeps so far.
    pub fn activity(&self) -> &Activity {
        &self.activity
    }

    /// How far from its reference place a leader gets in the next steps at most \[length\].
    fn leaders_reach(&self, steps: usize) -> f64 {
        let places = self.leaders_ahead(steps);
        let far = |(place, &particle): (&Point, &usize)| distance(*place, self.body.reference.get(particle));
        let farthest = places.iter().zip(self.led.iter().cycle()).map(far).fold(0.0, f64::max);
        let [farthest] = self.largest_of_parts([farthest]);
        farthest
    }

    /// Where leaders stand after each of the next steps \[length\], shape \[steps\]\[leaders\].
    fn leaders_ahead(&self, steps: usize) -> Vec<Point> {
        let to_come = self.step + 1..=self.step + steps;
        let place = |step| move |led: &Leader| led.place(&self.changes, step).expect("leaders have a motion");
        to_come.flat_map(|step| self.leaders.iter().map(place(step))).collect()
    }

    /// How far from the reference a step can take a particle if before it none is farther than 1, and how far if none has
    /// moved \[length\]; `None` where nothing is known.
    fn reach_of_a_step(&self) -> Option<Reach> {
        let reference = &self.body.reference;
        let moved = |j: usize| distance(self.flock.target(j, reference), reference.get(j));
        let gain = self.sweep.gain()?.max(1.0);
        let own = self.body.owned().filter(|&i| !self.body.is_frame[i]);
        let [gain, offset] = self.largest_of_parts([gain, own.map(moved).fold(0.0, f64::max)]);
        Some(Reach { gain, offset })
    }
}

/// A bound on what a step does.
#[derive(Clone, Copy)]
struct Reach {
    /// How many times as far from the reference a particle gets as any was \[1\].
    gain: f64,
    /// Distance added by loads, and by rest offsets that are missing \[length\].
    offset: f64,
}

impl Reach {
    /// How far particles get in so many steps that begin no farther than `from` \[length\], while leaders keep within that.
    fn after(&self, steps: usize, from: f64) -> f64 {
        (0..steps).fold(from, |reach, _| self.gain * reach + self.offset)
    }
}

/// Whether something of a body depends on how it stands in each step: then steps are taken one at a time.
pub(crate) fn looks_at_every_step(finds_neighbours: bool, flock: &Flock, changes: &[RoleChange]) -> bool {
    finds_neighbours
        || flock.bonds.as_ref().is_some_and(|bonds| bonds.threshold.is_some())
        || changes.iter().any(|change| change.when.is_some())
}
