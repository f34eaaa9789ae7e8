//! Actions on a body while it is stepped: bonds are cut, particles follow by other rules, a hand leads some of them.
//!
//! Those of a plan are performed as their steps begin. A session performs and steers them from outside between two
//! steps; planned for the step that comes next, they give the same bits.

use std::sync::Arc;

use super::Engine;
use super::load::Load;
use super::setup::{Conduct, RoleChange, Setup};
use crate::flock::action::ActionKind;
use crate::flock::fracture::Bonds;
use crate::flock::law::Flock;
use crate::flock::motion::Motion;
use crate::flock::rules::{Mean, Rotation};
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::material::free_edge::{Edge, FreeEdge};
use crate::sweep::Update;

/// The body as a solid, before an action changes it.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    mean: Mean,
    cells: Option<Cells>,
    elastic: Option<Elastic>,
    free_edge: Option<Arc<FreeEdge>>,
}

/// What stress at a step is found by, beside the places at that step.
pub(crate) struct Stressed<'a> {
    /// Between the particles.
    pub cells: &'a Cells,
    /// The material, inclusions left aside.
    pub elastic: &'a Elastic,
    /// The turns that are no strain.
    pub rotation: Rotation,
    /// The known tractions along the outline, where stress can be recovered from it.
    pub edge: Option<&'a Edge>,
    /// Part of the loads that is on the body \[1\].
    pub load: f64,
}

impl Conduct {
    /// That of a body before its first step.
    pub fn of(setup: Setup) -> Self {
        let Setup { flock, update, cells, elastic, loads, free_edge, .. } = setup;
        Self::new(flock, update, (cells, elastic), loads, free_edge)
    }

    /// That of particles that follow as `flock` does, and what acts on them.
    pub fn new(
        flock: Flock,
        update: Update,
        (cells, elastic): (Option<Cells>, Option<Elastic>),
        loads: Vec<Vectors>,
        free_edge: Option<Arc<FreeEdge>>,
    ) -> Self {
        let Flock { rule, weights, forces, rest, keeps_rest, bonds, .. } = flock;
        let fracture = bonds.map(|bonds| (bonds.threshold, bonds.ghosts));
        Self { rule, weights, forces, rest, keeps_rest, fracture, update, cells, elastic, loads, free_edge }
    }
}

impl Engine {
    /// Performs what is planned for this step.
    pub(super) fn act(&mut self) {
        let due = self.actions.iter().filter(|action| action.at == self.step);
        for what in due.map(|action| action.what.clone()).collect::<Vec<_>>() {
            self.perform(&what, self.step);
        }
    }

    /// Whether an action is planned for a step after this one, and the first such step.
    pub(super) fn next_action(&self) -> Option<usize> {
        self.actions.iter().map(|action| action.at).filter(|&at| at > self.step).min()
    }

    /// Whether an action is planned for the next step.
    pub(super) fn acts_next(&self) -> bool {
        self.next_action() == Some(self.step + 1)
    }

    /// Performs an action between two steps, which holds from step `at` on, the next one.
    pub fn perform(&mut self, what: &ActionKind<Arc<Conduct>>, at: usize) {
        match what {
            ActionKind::Follow(conduct) => self.conduct(conduct),
            ActionKind::Cut(cut) => {
                let flock = &mut self.flock;
                let bonds = flock.bonds.get_or_insert_with(|| Bonds::uncut(&flock.neighbours));
                let known = self.breaks.len();
                let places = (&*self.body.reference, &self.present);
                bonds.cut_present(at, *cut, &flock.neighbours, places, &self.roles, &mut self.breaks);
                self.share_breaks(known);
                self.set_torn_aside(known);
            }
        }
    }

    fn conduct(&mut self, conduct: &Conduct) {
        let Conduct {
            rule,
            weights,
            forces,
            rest,
            keeps_rest,
            fracture,
            update,
            cells,
            elastic,
            loads,
            free_edge,
        } = conduct.clone();
        let flock = &mut self.flock;
        let before = Solid {
            mean: flock.rule.mean,
            cells: std::mem::replace(&mut self.cells, cells),
            elastic: std::mem::replace(&mut self.elastic, elastic),
            free_edge: std::mem::replace(&mut self.free_edge, free_edge),
        };
        self.first.get_or_insert(before);
        (flock.rule, flock.weights, flock.forces) = (rule, weights, forces);
        (flock.rest, flock.keeps_rest) = (rest, keeps_rest);
        match (&mut flock.bonds, fracture) {
            (Some(bonds), Some((threshold, ghosts))) => (bonds.threshold, bonds.ghosts) = (threshold, ghosts),
            (Some(bonds), None) => bonds.threshold = None,
            (None, Some((threshold, ghosts))) => {
                let bonds = flock.bonds.insert(Bonds::new(threshold, ghosts, &flock.neighbours));
                bonds.owned = self.body.owned();
            }
            (None, None) => {}
        }
        self.update = update;
        let factor = self.load_factor();
        self.load = Load::new(self.load.ramp(), loads);
        self.set_load_factor(factor);
        self.settled = None;
        self.compile_sweep();
    }

    /// How the particles follow at a step by the plan, where an action has changed that by then.
    fn planned_conduct(&self, step: usize) -> Option<&Arc<Conduct>> {
        self.actions.iter().rev().filter(|action| action.at <= step).find_map(|action| match &action.what {
            ActionKind::Follow(conduct) => Some(conduct),
            ActionKind::Cut(_) => None,
        })
    }

    /// Follows by what the plan has for this step: part of putting a state back.
    pub(super) fn conduct_until_now(&mut self) {
        if let Some(conduct) = self.planned_conduct(self.step).cloned() {
            self.conduct(&conduct);
        }
    }

    /// What its stress at a step that has been taken is found by; `None` without a material.
    pub(crate) fn stressed_at(&self, step: usize) -> Option<Stressed<'_>> {
        let now = (self.flock.rule.mean, &self.cells, &self.elastic, &self.free_edge);
        let is_now = step == self.step || self.planned_conduct(self.step).is_none();
        let (mean, cells, elastic, free_edge) = match (self.planned_conduct(step), &self.first) {
            _ if is_now => now,
            (Some(then), _) => (then.rule.mean, &then.cells, &then.elastic, &then.free_edge),
            (None, Some(first)) => (first.mean, &first.cells, &first.elastic, &first.free_edge),
            (None, None) => now,
        };
        let cells = cells.as_ref()?;
        Some(Stressed {
            cells,
            elastic: elastic.as_ref()?,
            rotation: mean.rotation(),
            edge: free_edge.as_ref().and_then(|edge| edge.of(&self.body, cells)),
            load: self.load_factor_at(step),
        })
    }

    /// Adds a role that particles take at a step to come, and returns its number among the changes, which no state of the engine has.
    ///
    /// # Panics
    /// If that step has been taken, a particle is none, or the change is of a single component, which is held from the start.
    pub fn add_role_change(&mut self, change: RoleChange) -> usize {
        assert!(change.from > self.step || change.when.is_some(), "step {} has been taken", change.from);
        assert!(change.axis.is_none(), "a single component is held from the start");
        let count = self.roles.len();
        assert!(change.particles.iter().all(|&particle| particle < count), "a particle of {count}");
        let (number, size, is_at_once) = (self.changes.len(), change.particles.len(), change.is_at_once());
        self.changes.push(change);
        if self.taken_by.is_empty() {
            self.taken_by = self.taken_until_now();
        }
        if is_at_once {
            self.take_role(number, &Vec::from_iter(0..size), 0);
            self.after_role_change();
        }
        number
    }

    /// Gives the leaders of a change another motion, which says the same of the steps so far.
    pub fn steer(&mut self, change: usize, motion: Motion) {
        self.changes[change].motion = Some(motion);
    }
}
