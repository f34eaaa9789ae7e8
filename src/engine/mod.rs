//! The engine: a body is moved, one step after the other.
//!
//! A [`setup::Setup`] becomes an [`Engine`]: in each step roles change and leaders move (`leaders`), bonds break, loads
//! grow ([`load`]) and the rule is swept; where nothing in between depends on how the body stands, several steps are
//! taken at once ([`several`]). An [`observer::Observer`] looks at it on its way. Several ranks can share a body
//! ([`shared`]). [`forces`] are those within a body
//! that is a material, and what holds it; [`path`] sums up the work done between equilibria. [`state`] takes an engine
//! out on its way and puts it back, for checkpoints; `undo` takes a step back that diverged.

pub(crate) mod actions;
pub mod forces;
mod leaders;
pub mod load;
pub mod movement;
pub mod observer;
pub mod path;
pub mod probes;
pub(crate) mod serde_impls;
pub mod setup;
pub mod several;
pub mod shared;
pub mod state;
mod undo;

use std::sync::Arc;

use crate::flock::action::Action;
use crate::flock::body::Body;
use crate::flock::fracture::Break;
use crate::flock::grid::CellGrid;
use crate::flock::law::Flock;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::pseudo_energy::{pe1, pe2};
use crate::flock::role::Role;
use crate::flock::strain::{Strain, strain};
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::material::free_edge::{Edge, FreeEdge};
use crate::ranks::Team;
use crate::sweep::domain::Share;
use crate::sweep::{Activity, Order, Sweep, Update};
use actions::Solid;
use leaders::{Guided, Led};
use load::Load;
use movement::Movement;
use path::Path;
use probes::ProbeSeries;
use setup::{Conduct, RoleChange, Setup};
use shared::Known;
pub(crate) use undo::Before;

/// A body on its way; positions in \[length, world frame\], shape \[count\].
#[derive(Clone, Debug)]
pub struct Engine {
    body: Body,
    flock: Flock,
    update: Update,
    sweep: Sweep,
    /// Whether the sweep takes several steps of this body, its frame included.
    takes_several: bool,
    roles: Vec<Role>,
    changes: Vec<RoleChange>,
    /// Which of the changes that have taken a particle was written last, counted from 1; 0 for none, shape \[count\].
    /// Empty where no change has a condition.
    taken_by: Vec<u32>,
    /// By ascending step.
    actions: Vec<Action<Arc<Conduct>>>,
    /// By particle.
    leaders: Vec<Led>,
    /// The particles of `leaders`.
    led: Vec<usize>,
    /// Single components that are led, by axis.
    led_components: Vec<(Led, usize)>,
    /// Where particles that are led from outside will be after the next step.
    guided: Vec<Guided>,
    present: Vectors,
    /// The positions before the last step; the next ones are written over them.
    previous: Vectors,
    breaks: Vec<Break>,
    present_neighbours: Option<PresentNeighbours>,
    /// Where something moved in the last step.
    activity: Activity,
    step: usize,
    /// Between the particles, where the scene has a material.
    cells: Option<Cells>,
    /// The material as it is now, inclusions left aside.
    elastic: Option<Elastic>,
    /// The body as a solid before the first step, once an action has changed it.
    first: Option<Solid>,
    free_edge: Option<Arc<FreeEdge>>,
    load: Load,
    /// Displacements of a body that was put to rest \[length\]; positions have lost their last digits.
    settled: Option<Vectors>,
    /// Of a body that is put to rest part by part.
    path: Option<Path>,
    /// Histories of the probed particles of this part; none where the body is whole or none are probed.
    probes: Option<Vec<ProbeSeries>>,
    /// The ranks that share the body.
    team: Option<(Team, Share)>,
    /// Which positions are known here, where ranks share the body.
    known: Known,
}

/// Buffers of a neighbourhood that is found anew at every step.
#[derive(Clone, Debug)]
struct PresentNeighbours {
    radius: f64,
    grid: CellGrid,
    members: Vec<bool>,
}

impl Engine {
    /// Whether it has been stepped or put to rest.
    pub(crate) fn has_moved(&self) -> bool {
        self.step > 0 || self.settled.is_some()
    }

    /// The body before its first step, with the roles and the part of the loads that hold from the start.
    ///
    /// # Panics
    /// If particles and roles are not as many.
    pub fn new(setup: Setup) -> Self {
        let Setup {
            body,
            flock,
            update,
            present_radius,
            roles,
            changes,
            cuts,
            actions,
            cells,
            elastic,
            loads,
            ramp,
            free_edge,
            probes,
        } = setup;
        assert_eq!(roles.len(), body.reference.len(), "roles, for so many particles");
        let present_neighbours = present_radius.map(|radius| PresentNeighbours {
            radius,
            grid: CellGrid::default(),
            members: roles.iter().map(|role| role.is_body()).collect(),
        });
        let mut engine = Self {
            sweep: Sweep::uncompiled(update, &flock, &roles),
            takes_several: false,
            present: Vectors::clone(&body.reference),
            previous: Vectors::clone(&body.reference),
            body,
            flock,
            update,
            roles,
            taken_by: Vec::new(),
            changes,
            actions,
            leaders: Vec::new(),
            led: Vec::new(),
            led_components: Vec::new(),
            guided: Vec::new(),
            breaks: cuts,
            present_neighbours,
            activity: Activity::default(),
            step: 0,
            cells,
            elastic,
            first: None,
            free_edge,
            load: Load::new(ramp, loads),
            settled: None,
            path: None,
            probes: None,
            team: None,
            known: Known::All,
        };
        engine.follow_ramp();
        // The plan has given the roles that hold from the start; their motions begin here.
        for change in 0..engine.changes.len() {
            if engine.changes[change].is_at_once() {
                engine.lead_components(change);
                if engine.changes[change].axis.is_none() {
                    let all: Vec<usize> = (0..engine.changes[change].particles.len()).collect();
                    engine.start_leading(change, &all, 0);
                }
            }
        }
        engine.taken_by = engine.taken_until_now();
        engine.after_role_change();
        engine.begin_probes(probes);
        engine
    }

    /// Steps taken so far; of a body that was put to rest, the step or increment that it rests at.
    pub fn step(&self) -> usize {
        self.step
    }

    /// The particles, their sites and their reference positions.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The rule with neighbours, weights, loads and broken bonds, as they are now.
    pub fn flock(&self) -> &Flock {
        &self.flock
    }

    /// The neighbour lists, unless they are found anew at every step.
    pub fn lasting_neighbours(&self) -> Option<&Neighbours> {
        self.present_neighbours.is_none().then_some(&self.flock.neighbours)
    }

    /// Role of each particle at this step, shape \[count\].
    pub fn roles(&self) -> &[Role] {
        &self.roles
    }

    /// Role changes in the order they were written.
    pub fn changes(&self) -> &[RoleChange] {
        &self.changes
    }

    /// The known tractions along the outline, where stress can be recovered from it.
    pub(crate) fn free_edge(&self) -> Option<&Edge> {
        self.free_edge.as_ref()?.of(&self.body, self.cells.as_ref()?)
    }

    /// Cells between the particles, where the scene has a material.
    pub fn cells(&self) -> Option<&Cells> {
        self.cells.as_ref()
    }

    /// The material as it is now, inclusions left aside.
    pub fn elastic(&self) -> Option<&Elastic> {
        self.elastic.as_ref()
    }

    /// The order and the damping of the sweep.
    pub fn update(&self) -> Update {
        self.update
    }

    /// Present positions \[length, world frame\], shape \[count\].
    pub fn present(&self) -> &Vectors {
        &self.present
    }

    /// Where one particle is from its place in the reference configuration \[length\]: to the digits of the solver in a body
    /// that was put to rest and has not moved since.
    pub fn displacement(&self, particle: usize) -> [f64; 2] {
        if let Some(settled) = &self.settled {
            return settled.get(particle);
        }
        let ([x, y], [px, py]) = (self.present.get(particle), self.body.reference.get(particle));
        [x - px, y - py]
    }

    /// Those of all, shape \[count\].
    pub fn displacements(&self) -> Vectors {
        (0..self.present.len()).map(|i| self.displacement(i)).collect()
    }

    /// Positions before the last step \[length, world frame\], shape \[count\].
    pub fn previous(&self) -> &Vectors {
        &self.previous
    }

    /// Bonds broken so far, in the order they broke.
    pub fn breaks(&self) -> &[Break] {
        &self.breaks
    }

    /// PE1 of one particle \[length^2\]; zero for the frame and for ghosts, which have no neighbours.
    pub fn pe1(&self, particle: usize) -> f64 {
        pe1(&self.flock, particle, &self.present)
    }

    /// PE2 of one particle \[length\].
    pub fn pe2(&self, particle: usize) -> f64 {
        pe2(particle, &self.present, &self.previous)
    }

    /// Sums of PE1 \[length^2\] and PE2 \[length\] over the body, in order of index.
    pub fn energies(&self) -> [f64; 2] {
        // Without the sign of a zero.
        self.sum_of_particles(|i| [self.pe1(i), self.pe2(i)]).map(|sum| 0.0 + sum)
    }

    /// Strain of one particle's surroundings; `None` for a particle that sees too few.
    pub fn strain(&self, particle: usize) -> Option<Strain> {
        strain(&self.flock, particle, &self.present)
    }

    /// Moves the body by one step.
    pub fn advance(&mut self) {
        self.advance_from(None);
    }

    fn advance_from(&mut self, mut before: Option<&mut Before>) {
        if self.steps_at_once(1) == 1 {
            self.advance_by(1, None);
            return;
        }
        // Particles that take a role are where they are then, in both buffers, also where steps together move them along.
        if self.takes_roles_next() {
            self.gather()
        } else {
            self.gather_seen()
        }
        if let Some(before) = before.as_deref_mut().filter(|_| self.acts_next()) {
            before.note_all(self);
        }
        self.step += 1;
        self.settled = None;
        self.act();
        self.follow_ramp();
        self.take_roles(before);
        self.break_bonds();
        self.find_present_neighbours();
        if self.update.order == Order::Sequential {
            self.previous.clone_from(&self.present);
        }
        self.move_leaders();
        self.move_components();
        // A particle that waits for the one before it waits on every rank: each moves all of them.
        if self.team.is_none() || self.update.order == Order::Sequential {
            self.sweep.step(&self.flock, self.body.frame.as_ref(), &self.present, &mut self.previous);
        } else {
            self.step_shared();
        }
        std::mem::swap(&mut self.present, &mut self.previous);
        self.place_components();
        self.activity.forget();
        // The counts of all ranks are added up.
        if self.body.part.is_some() || self.team.as_ref().is_none_or(|(team, _)| team.is_first()) {
            self.activity.count_whole(self.sweep.followers());
        }
        self.record_probes();
    }

    /// Puts particles where they have been seen \[length\], in place of where the last step sent them; frame
    /// points follow. A body whose particles are seen where they were sent goes on as if it had not been observed.
    /// A leader or a clamped particle stays where it was seen, unless a program of its own leads it; one of which a single
    /// component is held ([`RoleChange::axis`]) goes back to that hold: at once where it has a motion, else in each step by the
    /// part of the way that the damping is.
    ///
    /// # Panics
    /// If there is no such particle.
    pub fn observe(&mut self, seen: impl IntoIterator<Item = (usize, [f64; 2])>) {
        self.settled = None;
        for (particle, place) in seen {
            self.present.set(particle, place);
            if self.stays(particle) {
                self.guided.push(Guided { particle, place, is_there: true });
            }
        }
        self.activity.forget();
        if let Some(frame) = self.body.frame.as_ref().filter(|frame| !frame.rule.looks_before_the_sweep()) {
            let body = self.present.clone();
            frame.follow(&self.body.reference, &body, &mut self.present);
        }
    }

    /// Puts a leader or a clamped particle at `place` \[length\] in the next step. There it stays, unless a program of its own leads it,
    /// also one that has come to its end; a follower is not to be led and goes its way, and so does a particle of which a single
    /// component is held ([`RoleChange::axis`]), which follows along the other.
    ///
    /// # Panics
    /// If there is no such particle.
    pub fn lead(&mut self, particle: usize, place: [f64; 2]) {
        assert!(particle < self.roles.len(), "particle {particle} of {}", self.roles.len());
        self.guided.push(Guided { particle, place, is_there: false });
    }

    /// Goes another part of the way to each target from the next step on \[1\]; no state of the engine has it.
    ///
    /// # Panics
    /// If it is not in 0 to 2, beyond which no step comes nearer to its target.
    pub fn set_damping(&mut self, damping: f64) {
        assert!((0.0..=2.0).contains(&damping), "damping {damping} is not in 0 to 2");
        self.update.damping = damping;
        self.compile_sweep();
    }

    /// Displaces all particles by `displacement` \[length\], shape \[count\], as if the body had come to rest
    /// there by `step`; frame points copy the particles that they serve.
    ///
    /// # Panics
    /// Displacements of more or fewer particles.
    pub fn place_at_rest(&mut self, step: usize, displacement: &Vectors) {
        assert_eq!(displacement.len(), self.body.reference.len(), "displacements, for so many particles");
        self.step = step;
        let reference = &self.body.reference;
        let place = |(here, by): ([f64; 2], [f64; 2])| [here[0] + by[0], here[1] + by[1]];
        self.present = reference.iter().zip(displacement.iter()).map(place).collect();
        if let Some(frame) = &self.body.frame {
            let seen = self.present.clone();
            frame.follow(reference, &seen, &mut self.present);
        }
        self.previous.clone_from(&self.present);
        self.hold_components();
        // A frame stands where the body leaves it, which no solver says.
        self.settled = self.body.frame.is_none().then(|| displacement.clone());
        self.activity.forget();
    }

    /// Counts the way to the equilibrium that the body was put to, under the load that is on it now, as gone.
    pub(crate) fn extend_path(&mut self) {
        let mut path = self.path.take().unwrap_or_default();
        path.extend(self);
        self.path = Some(path);
    }

    /// The equilibria that it has come through; `None` for a body that is stepped, or put to rest at once.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_ref()
    }

    /// Whether a role change or a leader's motion is still to come, so that rest is no equilibrium.
    pub(crate) fn is_scheduled(&self) -> bool {
        // Once its step is past, a condition that does not hold at rest never will.
        let waits = |change: &RoleChange| change.from > self.step.max(1);
        self.changes.iter().any(waits)
            || self.next_action().is_some()
            || self.load.is_growing(self.step)
            || self.any_leader_goes_on()
            || self.moves_components()
    }

    fn any_leader_goes_on(&self) -> bool {
        self.any_of_parts(self.leaders.iter().any(|led| self.goes_on(led)))
    }

    /// Looks over the last step.
    pub fn movement(&self) -> Movement {
        let (all, spacing) =
            ([&self.present, &self.previous, &self.body.reference], self.body.lattice.spacing());
        match (&self.team, self.sweep.domain()) {
            (Some((team, _)), Some(domain)) => {
                Movement::among(domain.owned(), all, spacing, |own| team.largest(own))
            }
            _ => Movement::among(0..self.present.len(), all, spacing, |own| own),
        }
    }

    fn after_role_change(&mut self) {
        // A particle that is no longer moved must agree in both buffers.
        self.previous.clone_from(&self.present);
        self.release_ghosts();
        self.find_members();
        self.compile_sweep();
    }

    /// Finds which particles neighbours that are found anew may be.
    fn find_members(&mut self) {
        if let Some(present) = &mut self.present_neighbours {
            present.members = self.roles.iter().map(|role| role.is_body()).collect();
        }
    }

    /// Of a part only once the ranks share the body.
    fn release_ghosts(&mut self) {
        let is_ready = self.body.part.is_none() || self.team.is_some();
        let Some(bonds) = self.flock.bonds.as_mut().filter(|_| is_ready) else { return };
        let known = self.breaks.len();
        let places = (&*self.body.reference, &self.present);
        bonds.release_ghosts(self.step, &self.flock.neighbours, places, &self.roles, &mut self.breaks);
        self.share_breaks(known);
    }

    fn compile_sweep(&mut self) {
        self.activity.forget();
        self.flock.renew_rest_of_torn();
        self.agree_on_rest();
        let share = self.team.as_ref().map_or_else(Share::whole, |(_, share)| *share);
        self.sweep = if self.present_neighbours.is_some() {
            let mut sweep = Sweep::uncompiled(self.update, &self.flock, &self.roles);
            sweep.share_with(share);
            sweep
        } else {
            Sweep::compile_share(self.update, &self.flock, &self.roles, share)
        };
        self.takes_several = self.sweep.takes_several(self.body.frame.as_ref());
        self.agree_on_needs();
    }

    fn break_bonds(&mut self) {
        let Some(bonds) = self.flock.bonds.as_mut().filter(|bonds| bonds.threshold.is_some()) else { return };
        let known = self.breaks.len();
        let places = (&*self.body.reference, &self.present);
        bonds.break_stretched(self.step, &self.flock.neighbours, places, &self.roles, &mut self.breaks);
        self.share_breaks(known);
        self.set_torn_aside(known);
    }

    /// Sweeps the ends of the bonds that have broken since `known` of them were as those of a torn body.
    fn set_torn_aside(&mut self, known: usize) {
        if self.breaks.len() > known {
            tracing::debug!("step {}: {} bonds break", self.step, self.breaks.len() - known);
            self.takes_several = false;
            let here = |index: u32| self.body.exact_particle(index as usize);
            let torn = self.breaks[known..].iter().flat_map(|b| b.pair).filter_map(here);
            self.flock.renew_rest(torn.clone());
            self.sweep.set_aside(torn, &self.flock);
            self.agree_on_rest();
        }
    }

    fn find_present_neighbours(&mut self) {
        let Some(PresentNeighbours { radius, grid, members }) = &mut self.present_neighbours else { return };
        self.flock.neighbours.rebuild_within(grid, &self.present, members, *radius);
    }
}
