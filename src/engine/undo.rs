//! A step taken back: the engine is again what it was before, to the bit.

use super::Engine;
use super::leaders::{Guided, Led};
use super::state::{bits_of, is_set};
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::sweep::Activity;

/// What an engine was before a step, as far as the step writes over it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Before {
    step: usize,
    /// Positions before the step before \[length\].
    pub(super) places: Vectors,
    settled: Option<Vectors>,
    activity: Activity,
    guided: Vec<Guided>,
    /// Number of bonds broken.
    breaks: usize,
    /// Roles, where particles take others.
    roles: Option<Roles>,
    /// All of the engine, where the step changes the conduct: it compiles the sweep anew then, which costs more than this
    /// copy.
    engine: Option<Box<Engine>>,
}

/// What a step writes over in which particles take roles.
#[derive(Clone, Debug)]
struct Roles {
    roles: Vec<Role>,
    taken_by: Vec<u32>,
    leaders: Vec<Led>,
}

impl Before {
    /// Notes what every step writes over.
    fn note(&mut self, engine: &Engine) {
        self.step = engine.step;
        self.places.clone_from(&engine.previous);
        self.settled.clone_from(&engine.settled);
        self.activity.clone_from(&engine.activity);
        self.guided.clone_from(&engine.guided);
        self.breaks = engine.breaks.len();
        self.forget_engine();
    }

    pub(super) fn forget_engine(&mut self) {
        (self.roles, self.engine) = (None, None);
    }

    /// Notes the roles of an engine of which particles are about to take others.
    pub(super) fn note_roles(&mut self, engine: &Engine) {
        if self.engine.is_none() {
            let Engine { roles, taken_by, leaders, .. } = engine;
            let (roles, taken_by, leaders) = (roles.clone(), taken_by.clone(), leaders.clone());
            self.roles = Some(Roles { roles, taken_by, leaders });
        }
    }

    /// Notes all of an engine whose conduct is about to change.
    pub(super) fn note_all(&mut self, engine: &Engine) {
        self.engine.get_or_insert_with(|| Box::new(engine.clone()));
    }
}

impl Engine {
    /// Moves the body by one step that [`Engine::undo_step`] can take back; a shared body must have been
    /// [gathered](Engine::gather).
    pub(crate) fn advance_noting(&mut self, before: &mut Before) {
        before.note(self);
        self.advance_from(Some(before));
    }

    /// Takes the last step back, before which this was noted. A shared body must have been [gathered](Engine::gather), and
    /// every rank must call it.
    pub(crate) fn undo_step(&mut self, before: &mut Before) {
        let Before { step, places, settled, activity, guided, breaks, roles, engine } =
            std::mem::take(before);
        match engine {
            Some(engine) => *self = *engine,
            None => std::mem::swap(&mut self.present, &mut self.previous),
        }
        (self.step, self.previous, self.guided) = (step, places, guided);
        let takes_roles = roles.is_some();
        if let Some(Roles { roles, taken_by, leaders }) = roles {
            (self.roles, self.taken_by, self.leaders) = (roles, taken_by, leaders);
            self.led = self.leaders.iter().map(|led| led.particle).collect();
            self.find_members();
        }
        if self.mend_since(breaks) || takes_roles {
            self.compile_sweep();
        }
        self.follow_ramp();
        self.move_components();
        self.find_neighbours_of_last_step();
        self.forget_probes_after(step);
        self.forget_others();
        (self.settled, self.activity) = (settled, activity);
        self.activity.forget();
    }

    /// Mends the bonds that have broken since `known` of them were; false if none have.
    fn mend_since(&mut self, known: usize) -> bool {
        if self.breaks.len() == known {
            return false;
        }
        let here = |index: u32| self.body.exact_particle(index as usize);
        let mended: Vec<usize> = self.breaks[known..].iter().flat_map(|b| b.pair).filter_map(here).collect();
        self.breaks.truncate(known);
        let bits = bits_of(&self.breaks, self.body.first(), &self.flock.neighbours);
        self.flock.bonds.iter_mut().for_each(|bonds| bonds.set_broken(|bond| is_set(&bits, bond)));
        self.flock.renew_rest(mended);
        // None are kept where all are zero.
        self.flock.rest.take_if(|rest| rest.iter().all(|offset| offset == [0.0; 2]));
        true
    }
}
