//! How ranks would share a run, before any of them is started.

use super::equilibrium::of_plan;
use super::memory::{iterates_in_parts, readable_bytes, solving, stepped};
use super::parts::{Parting, laid_out_whole_for};
use super::plan::Plan;
use crate::engine::setup::Setup;
use crate::engine::several::looks_at_every_step;
use crate::engine::shared::seen_in_a_step;
use crate::flock::part::Part;
use crate::scene::{Scene, SceneError};
use crate::solve::corotated::is_corotated;
use crate::solve::equilibrium::{Request, SolverShares, choose, shared_by};
use crate::solve::order::outliers_of;
use crate::sweep::domain::{Domain, Share};
use crate::sweep::{Order, Sweep};

/// Bytes of a position.
const PLACE: usize = 16;

/// Bytes that every rank takes, whatever it shows or writes: the body, and what steps or solves it.
pub fn bytes_each(scene: &Scene, plan: &Plan) -> usize {
    stepped(plan) + solving(scene, plan)
}

/// The data that are exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchanged {
    /// Halos, before so many steps are taken together; bytes that the rank with the largest receives.
    Halos {
        /// Steps taken together at most.
        steps: usize,
        /// Bytes received.
        bytes: usize,
    },
    /// All positions after each step; bytes that each rank receives.
    Everything {
        /// Bytes received, less those that a rank has itself.
        bytes: usize,
    },
    /// Halos in each iteration of a solver, before each pass over the particles and the coarser grids; bytes that the rank
    /// with the largest receives before it applies the operator.
    Iterations {
        /// Bytes received.
        bytes: usize,
    },
    /// Nothing but whether to end: each rank computes the whole body.
    Interrupts,
}

/// The parts of a body that ranks share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shares {
    /// Particles of each rank, shape \[ranks\].
    pub particles: Vec<usize>,
    /// Between the ranks.
    pub exchanged: Exchanged,
    /// Bytes that each rank takes for the body and what steps or solves it; the first one takes more for the results.
    pub bytes: usize,
}

/// The parts of a body of which each rank lays out one.
#[derive(Clone, Debug)]
pub struct PartShares {
    /// Particles of each rank, shape \[ranks\].
    pub particles: Vec<usize>,
    /// Most steps that the rank which has most takes together; 0 where it looks at each.
    pub steps: usize,
    /// Whether it is solved and not stepped.
    pub is_solved: bool,
    /// Whether the ranks share the iterations of its solver, as far as it can be known.
    pub iterates_in_parts: bool,
    /// Bytes that it receives before as many, or in each step, or each iteration of a solver.
    pub halo_bytes: usize,
    /// What it lays out.
    pub largest: Plan,
}

impl PartShares {
    /// The parts of so many ranks, counted without laying out more than the largest of them; `None` where a key of the scene
    /// [asks for the whole](laid_out_whole_for).
    ///
    /// # Errors
    /// The body that cannot be laid out.
    pub fn new(scene: &Scene, ranks: usize) -> Result<Option<Self>, SceneError> {
        if ranks < 2 || laid_out_whole_for(scene).is_some() {
            return Ok(None);
        }
        let parting = Parting::alone(scene, ranks)?;
        let rank = parting.largest();
        let largest = Plan::of_part_alone(scene, &parting, rank)?;
        let (steps, halo) = match scene.equilibrium {
            Some(_) => (0, around(&largest.setup)),
            None => Self::swept_together(&largest.setup, rank, ranks),
        };
        let is_solved = scene.equilibrium.is_some();
        let iterates_in_parts = iterates_in_parts(scene, &largest);
        let (particles, halo_bytes) = (parting.counts(), PLACE * halo);
        Ok(Some(Self { particles, steps, is_solved, iterates_in_parts, halo_bytes, largest }))
    }

    /// Most steps that a rank takes together, and particles that it receives before these.
    fn swept_together(setup: &Setup, rank: usize, ranks: usize) -> (usize, usize) {
        let Setup { body, flock, update, roles, probes, changes, .. } = setup;
        let part = body.part.as_ref().map(Part::held);
        let share = Share { rank, ranks, part, ..Share::whole() };
        let mut sweep = Sweep::compile_share(*update, flock, roles, share);
        // Bonds that are broken may be those of other parts.
        let looks = flock.bonds.is_some() || looks_at_every_step(false, flock, changes);
        let takes_several = !looks && sweep.takes_several(body.frame.as_ref());
        let seen = seen_in_a_step(body, &flock.neighbours);
        let needs = |domain: &mut Domain| {
            domain.needs(takes_several, seen.clone()).most(usize::from(probes.is_some()))
        };
        sweep.domain_mut().map_or((0, 0), needs)
    }

    /// Particles of the body.
    pub fn total(&self) -> usize {
        self.particles.iter().sum()
    }

    /// For the plan: names and values, with the bytes that the rank takes which takes most, with a report and with tables alone,
    /// and whether parts are drawn.
    pub fn facts(&self, bytes: [usize; 2], are_drawn: bool) -> Vec<(String, String)> {
        let (least, most) = (self.particles.iter().min(), self.particles.iter().max());
        let (least, most) = (least.copied().unwrap_or_default(), most.copied().unwrap_or_default());
        let body = &self.largest.setup.body;
        let around = body.count() - body.owned().len();
        // Of two steps: what is looked at may be how far a particle has moved.
        let looked_at = 2 * PLACE * (body.exact().len() - body.owned().len());
        let exchanged = match self.steps {
            _ if self.is_solved && !self.iterates_in_parts => {
                "; each is given the whole matrix and solves for the whole body".to_owned()
            }
            _ if self.is_solved => {
                format!(
                    "; where there are groups of columns enough, it iterates on about as many and receives about \
                     {} bytes in each iteration",
                    self.halo_bytes
                )
            }
            0 => format!("; of others it receives {} bytes in each step", self.halo_bytes),
            steps => format!(
                "; of others it receives {} bytes before every {steps} steps, {looked_at} where a step is looked at",
                self.halo_bytes
            ),
        };
        let condition = if are_drawn { "" } else { "with --figures none " };
        let parts = format!(
            "{condition}each rank lays out and holds its part alone, {least} to {most} particles and up to {around} around \
             them{exchanged}"
        );
        let [all, tables] = bytes.map(readable_bytes);
        let memory = match are_drawn {
            true => format!("at most about {all}; {tables} with --figures none --no-report"),
            false => format!("at most about {all} with --figures none; {tables} with --no-report as well"),
        };
        let facts = [("parts", parts), ("memory of a part", memory)];
        facts.map(|(name, value)| (name.to_owned(), value)).into()
    }
}

/// Particles of others in the columns that those of a part see.
fn around(Setup { body, flock, .. }: &Setup) -> usize {
    let outliers = outliers_of(body);
    let (owned, column) = (body.owned(), |i: usize| outliers.column(body.sites[i]));
    let seen = |i: usize| flock.neighbours.of(i).iter().map(move |&k| column(k as usize));
    let columns = owned.clone().flat_map(seen);
    let ends = columns.fold([i32::MAX, i32::MIN], |[low, high], column| [low.min(column), high.max(column)]);
    (0..body.count()).filter(|&i| !owned.contains(&i) && (ends[0]..=ends[1]).contains(&column(i))).count()
}

impl Shares {
    /// The shares of so many ranks.
    ///
    /// # Errors
    /// An equilibrium that the scene cannot have.
    pub fn new(scene: &Scene, plan: &Plan, ranks: usize) -> Result<Self, SceneError> {
        if let Some(asked) = &scene.equilibrium {
            return Self::of_solver(scene, &asked.request, plan, ranks);
        }
        let Setup { body, flock, changes, update, roles, present_radius, .. } = &plan.setup;
        if update.order == Order::Sequential {
            return Ok(Self::whole(scene, plan, ranks));
        }
        let share = Share { ranks, ..Share::whole() };
        let sweep = Sweep::compile_share(*update, flock, roles, share);
        let particles = sweep.domain().map_or_else(|| vec![plan.count()], |domain| domain.counts());
        let looks = looks_at_every_step(present_radius.is_some(), flock, changes);
        let exchanged = if looks || !sweep.takes_several(body.frame.as_ref()) {
            let least = particles.iter().min().copied().unwrap_or_default();
            Exchanged::Everything { bytes: PLACE * (plan.count() - least) }
        } else {
            let steps = sweep.steps_together();
            let largest = sweep.halo_sizes(steps).into_iter().max().unwrap_or_default();
            Exchanged::Halos { steps, bytes: PLACE * largest }
        };
        Ok(Self { particles, exchanged, bytes: bytes_each(scene, plan) })
    }

    fn of_solver(scene: &Scene, request: &Request, plan: &Plan, ranks: usize) -> Result<Self, SceneError> {
        let all = Self::whole(scene, plan, ranks);
        if is_corotated(&plan.setup.flock) {
            return Ok(all);
        }
        let system = of_plan(scene, plan)?;
        let (solver, _) = choose(&system, request);
        let shares = shared_by(&system, solver, ranks);
        Ok(match shares {
            None => all,
            Some(SolverShares { particles, received }) => {
                Self { particles, exchanged: Exchanged::Iterations { bytes: PLACE * received }, ..all }
            }
        })
    }

    /// Ranks each of which computes all.
    fn whole(scene: &Scene, plan: &Plan, ranks: usize) -> Self {
        let (particles, exchanged) = (vec![plan.count(); ranks], Exchanged::Interrupts);
        Self { particles, exchanged, bytes: bytes_each(scene, plan) }
    }

    /// For the plan: names and values.
    pub fn facts(&self) -> Vec<(String, String)> {
        let (least, most) = (self.particles.iter().min(), self.particles.iter().max());
        let (least, most) = (least.copied().unwrap_or_default(), most.copied().unwrap_or_default());
        let ranks = self.particles.len();
        let idle = self.particles.iter().filter(|&&count| count == 0).count();
        let idle = if idle == 0 { String::new() } else { format!("; {idle} have nothing to do") };
        let moved = match self.exchanged {
            Exchanged::Iterations { .. } => {
                format!("{ranks}, which iterate on {least} to {most} particles each{idle}")
            }
            Exchanged::Interrupts => {
                format!("{ranks}, each of which computes all {most} particles: no faster than one")
            }
            _ => format!("{ranks}, which move {least} to {most} particles each{idle}"),
        };
        let exchanged = match self.exchanged {
            Exchanged::Halos { steps, bytes } => {
                format!("halos of at most {bytes} bytes before every {steps} steps that nothing looks at")
            }
            Exchanged::Everything { bytes } => {
                format!("all positions after each step, {bytes} bytes to each rank")
            }
            Exchanged::Iterations { bytes } => {
                format!(
                    "halos of at most {bytes} bytes in each iteration, smaller ones for the coarser grids, and sums"
                )
            }
            Exchanged::Interrupts => "nothing but whether to end".to_owned(),
        };
        let memory = format!("{} beside the results: each holds the whole body", readable_bytes(self.bytes));
        let facts = [("ranks", moved), ("exchanged", exchanged), ("memory of each rank", memory)];
        facts.map(|(name, value)| (name.to_owned(), value)).into()
    }
}
