//! An engine on its way, taken out and put back to the bit.
//!
//! The contents of a plan (the body, its neighbours, weights, loads, the leaders' motions) are no part of the
//! state: they are planned again, and the digest of the plan shows whether they came out the same.

use std::borrow::Cow;
use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use super::Engine;
use super::leaders::{Guided, Led};
use super::serde_impls;
use super::setup::Setup;
use crate::flock::fracture::{Bonds, Break};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::sweep::Activity;

/// Everything that steps have changed; of a living engine it is borrowed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EngineState<'a> {
    step: usize,
    /// Positions now and before the last step \[length\], shape \[count\].
    #[serde(with = "serde_impls::points")]
    present: Cow<'a, Vectors>,
    #[serde(with = "serde_impls::points")]
    previous: Cow<'a, Vectors>,
    #[serde(with = "serde_impls::roles")]
    roles: Cow<'a, [Role]>,
    /// Of each particle the last change that has taken it; empty where no change has a condition.
    taken_by: Cow<'a, [u32]>,
    /// How many role changes there are, those that were added by hand among them.
    changes: usize,
    leaders: Vec<Led>,
    guided: Cow<'a, [Guided]>,
    #[serde(with = "serde_impls::breaks")]
    breaks: Cow<'a, [Break]>,
    /// Where something moved in the last step, and what was swept so far.
    activity: Activity,
    /// Whether each bond is broken, eight to a byte; absent where none can break.
    broken: Option<Vec<u8>>,
    /// Indices in the whole body of the last particles, which come there after those of all parts.
    after_all: Vec<usize>,
}

/// A state that belongs to another plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the state has {found} {what}, the plan {planned}: it belongs to another body{}", self.or_to_a_change())]
pub struct WrongState {
    /// The quantity that is counted.
    pub what: &'static str,
    /// How many the state has.
    pub found: usize,
    /// How many the plan has.
    pub planned: usize,
}

const CHANGES: &str = "role changes";

impl WrongState {
    /// The other cause where there are more role changes than planned.
    fn or_to_a_change(&self) -> &'static str {
        if self.what == CHANGES && self.found > self.planned {
            ", or to this one with role changes that were added by hand, which no state has\n  \
             help: add them to the changes of the plan's setup before it takes the state"
        } else {
            ""
        }
    }
}

impl<'a> EngineState<'a> {
    /// The state of an engine between two steps; of a part of a body that of its own particles, which are numbered as in the
    /// whole body.
    ///
    /// It has nothing that was given by hand beside a plan but broken bonds and places: role changes that were added
    /// ([`Engine::add_role_change`], to be added to [`Setup::changes`] of the plan that takes the state), motions that were
    /// steered, a damping, a rule that was performed. Nor has it histories of probes, and of a body that was put to rest neither
    /// the increments that led there nor the digits of displacements that its places have lost.
    pub fn of(engine: &'a Engine) -> Self {
        let (body, owned) = (&engine.body, engine.body.owned());
        let leading = |led: &Led| Led { particle: body.index(led.particle), ..*led };
        let own = body.part.as_ref().map_or_else(Vec::new, |_| body.owned_in_order());
        let flock = &engine.flock;
        let packed = |byte: usize, bonds: &Bonds| {
            let all = 8 * byte..(8 * byte + 8).min(flock.neighbours.index.len());
            all.fold(0, |bits, bond| bits | u8::from(bonds.is_broken(bond)) << (bond % 8))
        };
        let bytes = flock.neighbours.index.len().div_ceil(8);
        let of = |points: &'a Vectors| match body.part {
            None => Cow::Borrowed(points),
            Some(_) => Cow::Owned(own.iter().map(|&i| points.get(i)).collect()),
        };
        let leaders = engine.leaders.iter().filter(|led| owned.contains(&led.particle));
        Self {
            step: engine.step,
            present: of(&engine.present),
            previous: of(&engine.previous),
            roles: match body.part {
                None => Cow::Borrowed(&engine.roles),
                Some(_) => Cow::Owned(own.iter().map(|&i| engine.roles[i]).collect()),
            },
            taken_by: match body.part {
                None => Cow::Borrowed(&engine.taken_by),
                Some(_) => own.iter().filter_map(|&i| engine.taken_by.get(i).copied()).collect(),
            },
            changes: engine.changes.len(),
            leaders: leaders.map(leading).collect(),
            guided: Cow::Borrowed(&engine.guided),
            breaks: Cow::Borrowed(&engine.breaks),
            activity: engine.activity.clone(),
            // Those of a part are known by its broken pairs, which are those of the whole body.
            broken: (flock.bonds.as_ref().filter(|_| engine.body.part.is_none()))
                .map(|bonds| (0..bytes).map(|byte| packed(byte, bonds)).collect()),
            after_all: own.iter().filter_map(|&i| body.index_after_all(i)).collect(),
        }
    }

    /// Steps taken.
    pub fn step(&self) -> usize {
        self.step
    }

    /// Particles that it is of.
    pub fn count(&self) -> usize {
        self.present.len()
    }

    /// The state of a body, or of a part of one, put together from states of parts; each with the number of its first particle
    /// in the whole body. They may be more than are needed.
    ///
    /// # Errors
    /// Particles that none of them has.
    pub fn of_pieces(
        pieces: &[(usize, EngineState<'_>)],
        setup: &Setup,
    ) -> Result<EngineState<'static>, WrongState> {
        let body = &setup.body;
        let exact = body.exact();
        // Those that are there for the others to have neighbours are never looked at.
        let (mut present, mut roles) = (Vectors::clone(&body.reference), setup.roles.clone());
        let (mut previous, mut leaders, mut known) = (present.clone(), Vec::new(), 0);
        let has_taken = pieces.iter().any(|(_, state)| !state.taken_by.is_empty());
        let mut taken_by = vec![0; if has_taken { body.count() } else { 0 }];
        for (begin, state) in pieces {
            let regular = state.count().saturating_sub(state.after_all.len());
            let index = |i: usize| if i < regular { begin + i } else { state.after_all[i - regular] };
            let here = |i: usize| body.exact_particle(index(i));
            for (i, to) in (0..state.count()).filter_map(|i| Some((i, here(i)?))) {
                present.set(to, state.present.get(i));
                previous.set(to, state.previous.get(i));
                roles[to] = state.roles[i];
                if let (Some(to), Some(&last)) = (taken_by.get_mut(to), state.taken_by.get(i)) {
                    *to = last;
                }
                known += 1;
            }
            leaders.extend(state.leaders.iter().filter_map(|led| {
                let particle = body.exact_particle(led.particle)?;
                let which = setup.changes.get(led.change)?.particles.binary_search(&particle).ok()?;
                Some(Led { particle, which, ..*led })
            }));
        }
        if known != exact.len() {
            return Err(WrongState { what: "particles", found: known, planned: exact.len() });
        }
        leaders.sort_unstable_by_key(|led: &Led| led.particle);
        let breaks = pieces.first().map_or_else(Vec::new, |(_, state)| state.breaks.to_vec());
        let mut activity = pieces.first().map_or_else(Activity::default, |(_, state)| state.activity.clone());
        activity.forget();
        Ok(EngineState {
            step: pieces.first().map_or(0, |(_, state)| state.step),
            present: Cow::Owned(present),
            previous: Cow::Owned(previous),
            roles: Cow::Owned(roles),
            taken_by: Cow::Owned(taken_by),
            changes: pieces.first().map_or(0, |(_, state)| state.changes),
            leaders,
            guided: Cow::Owned(Vec::new()),
            broken: setup
                .flock
                .bonds
                .as_ref()
                .map(|_| bits_of(&breaks, body.first(), &setup.flock.neighbours)),
            breaks: Cow::Owned(breaks),
            activity,
            after_all: Vec::new(),
        })
    }

    /// The engine of this plan, in this state.
    ///
    /// # Errors
    /// A state of another body. A plan with as many of everything is taken for the right one: hold its
    /// digest against that of the plan that was run.
    pub fn engine(self, setup: Setup) -> Result<Engine, WrongState> {
        let mut engine = Engine::new(setup);
        engine.step = self.step;
        engine.conduct_until_now();
        if self.broken.is_some() {
            // Where the plan has none, a cut by hand made them.
            let flock = &mut engine.flock;
            flock.bonds.get_or_insert_with(|| Bonds::uncut(&flock.neighbours));
        }
        self.require_fits(&engine)?;
        engine.follow_ramp();
        engine.move_components();
        engine.present = self.present.into_owned();
        engine.previous = self.previous.into_owned();
        engine.roles = self.roles.into_owned();
        engine.taken_by = self.taken_by.into_owned();
        engine.leaders = self.leaders;
        engine.led = engine.leaders.iter().map(|led| led.particle).collect();
        engine.guided = self.guided.into_owned();
        engine.breaks = self.breaks.into_owned();
        if let (Some(bonds), Some(broken)) = (&mut engine.flock.bonds, &self.broken) {
            bonds.set_broken(|bond| is_set(broken, bond));
        }
        engine.rebuild_caches();
        engine.activity = self.activity;
        Ok(engine)
    }

    fn require_fits(&self, engine: &Engine) -> Result<(), WrongState> {
        let count = engine.body.count();
        let require = |what, found, planned| {
            if found == planned { Ok(()) } else { Err(WrongState { what, found, planned }) }
        };
        require("particles", self.present.len(), count)?;
        require("former places", self.previous.len(), count)?;
        require("roles", self.roles.len(), count)?;
        // Those that the plan has beside came after the state.
        require(CHANGES, self.changes.max(engine.changes.len()), engine.changes.len())?;
        require("particles that changes took", self.taken_by.len(), engine.taken_by.len())?;
        let bits = engine.flock.bonds.as_ref().map(|_| engine.flock.neighbours.index.len().div_ceil(8));
        require("bytes of bonds", self.broken.as_ref().map_or(0, Vec::len), bits.unwrap_or(0))?;
        // A number from a file is an index only when it is below what it counts; one that is not says that there are more.
        let require_below = |what, index: usize, planned: usize| {
            let found = index.saturating_add(1);
            if index < planned { Ok(()) } else { Err(WrongState { what, found, planned }) }
        };
        for led in &self.leaders {
            require_below(CHANGES, led.change, engine.changes.len())?;
            let change = &engine.changes[led.change];
            require("leaders without a motion", usize::from(change.motion.is_none()), 0)?;
            require_below("particles of a role change", led.which, change.particles.len())?;
            require("as the number of a led particle", led.particle, change.particles[led.which])?;
            require_below("steps of a leader", led.since, self.step.saturating_add(1))?;
        }
        // Found by bisection.
        let disordered = self.leaders.windows(2).filter(|pair| pair[0].particle >= pair[1].particle);
        require("leaders out of order", disordered.count(), 0)?;
        for one in self.guided.iter() {
            require_below("guided particles", one.particle, count)?;
        }
        for particle in self.breaks.iter().flat_map(|one| one.pair) {
            require_below("particles of broken bonds", particle as usize, engine.body.total())?;
        }
        Ok(())
    }
}

/// Whether each bond is of one of these pairs, eight to a byte.
pub(super) fn bits_of(breaks: &[Break], first: usize, neighbours: &Neighbours) -> Vec<u8> {
    let pairs: HashSet<[u32; 2]> = breaks.iter().map(|one| one.pair).collect();
    let mut bits = vec![0; neighbours.index.len().div_ceil(8)];
    for j in (0..neighbours.count()).filter(|_| !pairs.is_empty()) {
        for bond in neighbours.bonds(j) {
            let [a, b] = [j, neighbours.index[bond] as usize].map(|i| (first + i) as u32);
            bits[bond / 8] |= u8::from(pairs.contains(&[a.min(b), a.max(b)])) << (bond % 8);
        }
    }
    bits
}

/// One of bits that are eight to a byte.
pub(super) fn is_set(bits: &[u8], bit: usize) -> bool {
    bits[bit / 8] >> (bit % 8) & 1 == 1
}

impl Engine {
    /// Finds again what follows from roles, bonds and positions that were put in from outside.
    fn rebuild_caches(&mut self) {
        self.find_members();
        self.find_neighbours_of_last_step();
        self.compile_sweep();
    }

    /// Finds the neighbours that the last step found, where it began.
    pub(super) fn find_neighbours_of_last_step(&mut self) {
        let Some(super::PresentNeighbours { radius, grid, members }) = &mut self.present_neighbours else {
            return;
        };
        if self.step > 0 {
            self.flock.neighbours.rebuild_within(grid, &self.previous, members, *radius);
        }
    }
}
