//! Where a corotated material comes to rest: Newton's method on the energy of its cells.
//!
//! The force on a particle is minus the gradient of the energy that the cells around it store (see
//! [`crate::flock::rules::Element`]), and the tangent is its second derivative: a symmetric operator over the rule's own
//! neighbours. It is positive definite wherever the body rests stably, so every solver will do; on the way to there it need
//! not be, and an increment whose system has no positive solution is taken in smaller parts.
//!
//! An equilibrium counts where its own tangent is positive: a straight column is in equilibrium under any load, and buckles.
//!
//! Leaders go their way and loads grow in increments, halved where Newton's method does not settle or a cell turns too far
//! at once: that keeps to the equilibrium that the unstrained body grows into.
//!
//! A displacement known to the last digit of a double leaves a residual of `eps |K| |u|`. The bending of a beam needs so much
//! less force than its stretching that this exceeds the load itself where the beam is some thousands of times as long as
//! high, so Newton's method has settled where its residual is no more than that.

use std::time::Duration;

use rayon::prelude::*;

use super::equilibrium::{
    Choice, Precision, Request, SolveError, Solved, Solver, System, solve_shared as solve_linear,
};
use super::linear::NotLinear;
use super::operator::{Operator, OperatorError, Row};
use super::order::Order;
use super::shared::SystemPart;
use super::stopwatch::Stopwatch;
use crate::flock::block::{Block, apply, plus};
use crate::flock::body::Body;
use crate::flock::law::{Flock, MatrixWeights, Weights};
use crate::flock::rules::{Corner, Mean, OWN, Rotation, Turn, patch_row};
use crate::flock::vectors::Vectors;
use crate::geometry::point::{distance, minus};
use crate::ranks::{Team, added};

/// Parts of a way at whose ends the force that moves the body is looked at: odd, so that leaders that turn there and back, or
/// round and round, are not met where they began each time.
const LOOKS: u32 = 7;
/// Newton steps of one increment.
const MOST_STEPS: usize = 16;
/// Steps in a row that do not halve the residual after which rounding is taken to have the last word.
const STALLED: usize = 2;
/// Parts into which a way is cut at most because leaders turn on it.
const MOST_PARTS: u32 = 1024;
/// Leaders go straight on enough where twice as many parts of their way are together no longer than this many times \[1\].
const STRAIGHT: f64 = 1.1;
/// Linear systems of a whole way.
const MOST_SOLVES: usize = 500;
/// Least part of the way taken at once.
const LEAST_STRIDE: f64 = 1.0 / 1024.0;
/// Residual at which the next increment may begin; where rounding leaves more, the part of the displacements that a step is.
const ON_THE_WAY: f64 = 1e-3;
/// Cosine of the largest turn of a cell in one increment: 60 degrees.
const LEAST_COSINE: f64 = 0.5;
/// Size of a last step, over that of the displacements, up to which its tangent is that of where it led to.
const NEAR: f64 = 1e-2;
const DIRECT: Choice = Choice::This(Solver::Direct);
/// Residual of each linear system: more digits than a Newton step has.
const OF_A_STEP: f64 = 1e-5;

/// Why there is no corotated equilibrium to be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorotatedError {
    /// The rule has no operator.
    #[error(transparent)]
    NotLinear(#[from] NotLinear),
    /// A system of Newton's method could not be solved in the unstrained body, or the solve was interrupted.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The rule has feedback.
    #[error("feedback is a term of the sweep, which the corotated equilibrium does not have")]
    Feedback,
    /// Single precision was asked for.
    #[error("Newton's method on a corotated material computes in double precision only")]
    DoubleOnly,
    /// Increments of the way got too small, or there were too many.
    #[error(
        "the rotations do not settle beyond {:.1} % of the way of leaders and loads ({solves} systems solved{}): the body snaps, buckles or is torn there{}",
        100.0 * part,
        if *cut_short > 0 { format!(", {cut_short} of them no further than most_iterations allows") } else { String::new() },
        if *cut_short > 0 { ", or was never brought to rest" } else { "" }
    )]
    Unsettled {
        /// Share of the way of leaders and loads that was reached \[1\].
        part: f64,
        /// Systems that were solved.
        solves: usize,
        /// Those of which the iterations that were asked for came to no end.
        cut_short: usize,
    },
}

/// Whether a rule is what this file is about.
pub fn is_corotated(flock: &Flock) -> bool {
    flock.rule.mean == Mean::Material { rotation: Rotation::Corotated }
}

/// Followers up to which a factorisation is taken: the rows of the tangent differ from particle to particle, which
/// multigrid on a lattice gains nothing from.
pub const DIRECT_UP_TO: usize = 200_000;

/// The solver of the linear systems, and why.
///
/// # Errors
/// If single precision is asked for.
pub fn choose(followers: usize, request: &Request) -> Result<(Solver, String), CorotatedError> {
    let (solver, why) = match request.solver {
        Choice::This(solver) => (solver, "asked for".into()),
        Choice::Auto if followers <= DIRECT_UP_TO => {
            (Solver::Direct, format!("{followers} followers are few enough to factorise"))
        }
        Choice::Auto => (
            Solver::Multigrid,
            format!("the number of its iterations does not grow with {followers} followers"),
        ),
    };
    if request.precision == Precision::F32 {
        return Err(CorotatedError::DoubleOnly);
    }
    Ok((solver, format!("{why}; once a step of Newton's method, until the rotations settle")))
}

/// How leaders and loads get to where they are.
pub struct Way<'a> {
    /// Where what is held is after a part of the whole way \[length\], shape \[count\]; as much of the
    /// loads is then on the body.
    pub held: &'a (dyn Fn(f64) -> Vectors + Sync),
    /// The equilibrium to start from and the part that it belongs to; the reference and 0 where there is none.
    pub start: Option<(&'a Vectors, f64)>,
    /// The part to come to \[1\].
    pub end: f64,
}

impl<'a> Way<'a> {
    /// From the reference to the end.
    pub fn whole(held: &'a (dyn Fn(f64) -> Vectors + Sync)) -> Self {
        Self { held, start: None, end: 1.0 }
    }

    /// The part of the whole way that belongs to a part of this one.
    fn part(&self, of_this: f64) -> f64 {
        let start = self.start.map_or(0.0, |(_, part)| part);
        if of_this == 1.0 { self.end } else { start + of_this * (self.end - start) }
    }
}

/// The equilibrium at the end of the way. `held_axes` are single components of followers that are held, shape
/// \[count\]\[x, y\], or empty; the way says where they are as well.
///
/// # Errors
/// As [`solve_linear`]; names the part of the way from which on the rotations do not settle.
pub fn solve(
    flock: &Flock,
    body: &Body,
    follows: Vec<bool>,
    held_axes: Vec<[bool; 2]>,
    way: &Way<'_>,
    request: &Request,
) -> Result<Solved, CorotatedError> {
    solve_in_parts((flock, body), follows, held_axes, way, request, None)
}

/// The same of a body of which each rank of the team has a part, and that is all that is given here; all find the same, or fail
/// alike.
///
/// # Errors
/// As [`solve`].
pub fn solve_in_parts(
    (flock, body): (&Flock, &Body),
    follows: Vec<bool>,
    held_axes: Vec<[bool; 2]>,
    way: &Way<'_>,
    request: &Request,
    team: Option<&Team>,
) -> Result<Solved, CorotatedError> {
    let Weights::Matrix(weights) = &flock.weights else {
        return Err(NotLinear::Rule { rule: "a material without its weights".into() }.into());
    };
    if flock.rule.feedback.is_some() {
        return Err(CorotatedError::Feedback);
    }
    let tolerance = request.tolerance;
    if tolerance.is_nan() || tolerance <= 0.0 || tolerance >= 1.0 {
        return Err(SolveError::Tolerance { tolerance }.into());
    }
    let part = |team: &Team| SystemPart { team: team.clone(), first: body.first(), owned: body.owned() };
    let part = team.map(part);
    let own = body.owned().filter(|&i| follows[i]).count();
    let followers = team.map_or(own, |team| team.sum([own as u64])[0] as usize);
    let (solver, why) = choose(followers, request)?;
    let step = Request { solver: Choice::This(solver), tolerance: OF_A_STEP, ..*request };
    let order = Order::new(body);
    // A sweep whose system is not positive definite just ends short of its tolerance.
    let sees = |solver: Solver| !matches!(solver, Solver::Jacobi | Solver::GaussSeidel | Solver::Chebyshev);
    let question = match sees(solver) {
        true => step,
        false => Request { solver: Choice::This(choose(followers, &Request::default())?.0), ..step },
    };
    let rule = Corotated { flock, weights, body, order, follows, held_axes, way, step, question, part };
    let mut newton = Newton {
        rule: &rule,
        size: rule.size(),
        residuals: vec![1.0],
        times: [Duration::ZERO; 2],
        last_step: f64::INFINITY,
        cut_short: 0,
    };
    let displacement = if newton.size == 0.0 { (way.held)(way.end) } else { newton.go(tolerance)? };
    let residuals = if newton.size == 0.0 { vec![0.0] } else { newton.residuals };
    let converged = residuals.last().is_some_and(|last| *last <= 2.0 * tolerance);
    // Where rounding has the last word, the last step is made of what it left.
    let known_to = (!converged).then_some(newton.last_step);
    let phases = vec![("set-up", newton.times[0]), ("solve", newton.times[1])];
    Ok(Solved {
        displacement,
        solver,
        why,
        iterations: residuals.len() - 1,
        residuals,
        phases,
        converged,
        known_to,
    })
}

/// A corotated body and what is done to it.
struct Corotated<'a> {
    flock: &'a Flock,
    weights: &'a MatrixWeights,
    body: &'a Body,
    order: Order<'a>,
    follows: Vec<bool>,
    held_axes: Vec<[bool; 2]>,
    way: &'a Way<'a>,
    /// How a linear system is solved.
    step: Request,
    /// How one is solved to see whether it is positive definite.
    question: Request,
    /// Where each rank has a part of the body.
    part: Option<SystemPart>,
}

/// Force and stiffness of the cells around a particle.
struct Local {
    /// Without the load.
    force: [f64; 2],
    /// Second derivatives of the energy: to itself, and to its neighbours.
    diagonal: Block,
    blocks: Vec<Block>,
    /// Of one of its cells.
    turn: Turn,
}

impl Corotated<'_> {
    /// A neighbour from where a particle is, both displaced by `u`.
    fn corner(&self, i: usize, slot: usize, u: &Vectors) -> Corner {
        let (reference, j) = (&self.flock.reference, self.flock.neighbours.of(i)[slot] as usize);
        Corner {
            reference: minus(reference.get(j), reference.get(i)),
            displacement: minus(u.get(j), u.get(i)),
        }
    }

    /// `None` where a cell has no direction left.
    fn local(&self, i: usize, u: &Vectors) -> Option<Local> {
        let mut force = [0.0; 2];
        let mut diagonal = Block::default();
        let mut blocks = vec![Block::default(); self.flock.neighbours.of(i).len()];
        let mut turn = None;
        for cell in self.weights.cells_around(i) {
            let corner = |slot| self.corner(i, slot, u);
            let row = cell.element.row(cell.own, |k| cell.corner(k, corner))?;
            add(&mut force, row.force);
            for (&slot, block) in cell.slots.iter().zip(&row.tangent) {
                let sum = if slot == OWN { &mut diagonal } else { &mut blocks[slot as usize] };
                *sum = plus(sum, block);
            }
            turn = turn.or(Some(row.turn));
        }
        for (stiffness, cells) in self.weights.patches_around(i) {
            let row = patch_row(stiffness, cells, |slot| self.corner(i, slot, u))?;
            add(&mut force, row.force);
            for (slot, block) in row.tangent {
                let sum = if slot == OWN { &mut diagonal } else { &mut blocks[slot as usize] };
                *sum = plus(sum, &block);
            }
        }
        Some(Local { force, diagonal, blocks, turn: turn? })
    }

    /// Components of a particle that are not given.
    fn free(&self, i: usize) -> [bool; 2] {
        let held = self.held_axes.get(i).copied().unwrap_or_default();
        held.map(|held| self.follows[i] && !held)
    }

    /// Puts what is not free where it is.
    fn hold(&self, u: &mut Vectors, held: &Vectors) {
        for i in 0..u.len() {
            let (free, at, there) = (self.free(i), u.get(i), held.get(i));
            u.set(i, [0, 1].map(|axis| if free[axis] { at[axis] } else { there[axis] }));
        }
    }

    fn load(&self, i: usize) -> [f64; 2] {
        self.flock.forces.as_ref().map_or([0.0; 2], |forces| forces.get(i))
    }

    /// The force left on every follower after `part` of the way; zero on the others, and on those of a part that see less here
    /// than in the whole body.
    fn forces(&self, u: &Vectors, part: f64) -> Option<(Vec<Option<Local>>, Vectors)> {
        let exact = self.body.exact();
        let of_particle = |i: usize| match self.follows[i] && exact.contains(&i) {
            false => Some(None),
            true => self.local(i, u).map(Some),
        };
        let locals: Option<Vec<Option<Local>>> = (0..u.len()).into_par_iter().map(of_particle).collect();
        if self.any(locals.is_none()) {
            return None;
        }
        let locals = locals?;
        let left = |(i, local): (usize, &Option<Local>)| match local {
            None => [0.0; 2],
            Some(local) => {
                let (load, free) = (self.load(i), self.free(i));
                [0, 1].map(|axis| if free[axis] { local.force[axis] + part * load[axis] } else { 0.0 })
            }
        };
        let left = locals.iter().enumerate().map(left).collect();
        Some((locals, left))
    }

    /// The force that the last digits of the displacements stand for, `eps | |K| |u| + |f| |`: no displacement in doubles can
    /// be asked to leave less.
    fn rounding(&self, locals: &[Option<Local>], u: &Vectors, part: f64) -> f64 {
        let size = |block: &Block, u: [f64; 2]| apply(&block.map(|row| row.map(f64::abs)), u.map(f64::abs));
        let of_particle = |(i, local): (usize, &Option<Local>)| {
            let (Some(local), free) = (local, self.free(i)) else { return [0.0; 2] };
            let mut sum = self.load(i).map(|load| (part * load).abs());
            add(&mut sum, size(&local.diagonal, u.get(i)));
            for (&j, block) in self.flock.neighbours.of(i).iter().zip(&local.blocks) {
                add(&mut sum, size(block, u.get(j as usize)));
            }
            [0, 1].map(|axis| if free[axis] { sum[axis] } else { 0.0 })
        };
        f64::EPSILON * self.norm(&locals.iter().enumerate().map(of_particle).collect())
    }

    /// The force that moves the body: the largest on the way, since leaders that come back leave none at its end.
    fn size(&self) -> f64 {
        let on_the_way = (0..=LOOKS).map(|k| self.way.part(f64::from(k) / f64::from(LOOKS)));
        on_the_way.chain([1.0]).map(|part| self.size_at(part)).fold(0.0, f64::max)
    }

    /// The largest part of the way on which leaders go straight on, or nearly so: one that turns once round is where it began, and
    /// the body is not.
    fn straight_part(&self) -> f64 {
        let path = |parts: u32| {
            let place = |k: u32| (self.way.held)(self.way.part(f64::from(k) / f64::from(parts)));
            let (mut sum, mut last) = (0.0, place(0));
            for k in 1..=parts {
                let next = place(k);
                let moved = |i: usize| distance(next.get(i), last.get(i));
                sum += self.largest(self.body.owned().map(moved).fold(0.0, f64::max));
                last = next;
            }
            sum
        };
        let (mut parts, mut finer) = (1, LOOKS);
        let mut known = path(1);
        while parts < MOST_PARTS {
            let found = path(finer);
            if found <= STRAIGHT * known {
                break;
            }
            (parts, finer, known) = (finer, 2 * finer, found);
        }
        1.0 / f64::from(parts)
    }

    /// The force with leaders as they are after a part of the whole way, all followers at zero and all cells in the axes of the
    /// reference.
    fn size_at(&self, part: f64) -> f64 {
        let mut u = Vectors::zeros(self.follows.len());
        self.hold(&mut u, &(self.way.held)(part));
        let owned = self.body.owned();
        let force = |i: usize| {
            if !(self.follows[i] && owned.contains(&i)) {
                return [0.0; 2];
            }
            let mut force = self.load(i);
            let others = self.flock.neighbours.of(i).iter().zip(self.weights.stiffness_of(i));
            for (&j, block) in others {
                add(&mut force, apply(block, minus(u.get(j as usize), u.get(i))));
            }
            let free = self.free(i);
            [0, 1].map(|axis| if free[axis] { force[axis] } else { 0.0 })
        };
        self.norm(&(0..u.len()).map(force).collect())
    }

    /// The norm over the whole body.
    fn norm(&self, points: &Vectors) -> f64 {
        let size = |i: usize| points.get(i).into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let largest = self.body.owned().map(size).fold(0.0, f64::max);
        let largest = self.largest(largest);
        // In a unit of their size squares neither vanish nor overflow: a power of two, which keeps all bits.
        let unit = if largest.is_normal() { largest.log2().floor().exp2() } else { 1.0 };
        let square = |i: usize| {
            let [x, y] = points.get(i).map(|x| x / unit);
            (self.body.index_after_all(i), [x * x + y * y])
        };
        let own = self.body.owned().map(square);
        let [sum] = match &self.part {
            None => own.map(|(_, square)| square).fold([0.0], added),
            Some(part) => part.team.sum_in_order([0.0], own, self.body.has_some_after_all()),
        };
        unit * sum.sqrt()
    }

    /// The largest of all ranks.
    fn largest(&self, own: f64) -> f64 {
        self.part.as_ref().map_or(own, |part| part.team.largest([own])[0])
    }

    /// Whether it is so on any rank.
    fn any(&self, own: bool) -> bool {
        self.part.as_ref().map_or(own, |part| part.team.any(own))
    }

    /// Second derivatives of the energy, forces per displacement, in the order of a system.
    fn tangent(&self, locals: &[Option<Local>]) -> Result<Operator, OperatorError> {
        let lattice = &self.body.lattice;
        let grid = [lattice.vector([1, 0]), lattice.vector([0, 1])];
        let row = |i: usize| {
            let Some(local) = &locals[i] else { return Row::default() };
            let mut row = Row { diagonal: local.diagonal, entries: Vec::new() };
            for (&j, block) in self.flock.neighbours.of(i).iter().zip(&local.blocks) {
                if *block != Block::default() {
                    let (here, there) = (self.body.sites[i], self.body.sites[j as usize]);
                    let offset = [there[0] - here[0], there[1] - here[1]];
                    row.entries.push((offset, block.map(|row| row.map(|entry| -entry))));
                }
            }
            row
        };
        let (order, follows) = (&self.order, self.order.by_place(self.follows.clone()));
        let (sites, outliers) = order.sites();
        let row = |place: usize| row(order.particle(place));
        let operator = Operator::from_rows_along_outline((&sites[..], outliers), grid, follows, row);
        let operator = operator.map_err(|error| order.error(error))?;
        Ok(operator.with_held_axes(order.by_place(self.held_axes.clone())))
    }

    /// The system of a step, or of the part of it that is here: the forces that are left, and the leaders' moves.
    fn system(&self, locals: &[Option<Local>], [left, led]: [Vectors; 2]) -> Result<System, OperatorError> {
        let own = self.tangent(locals);
        let whole = |own: Operator| self.order.system(own, [left, led]);
        let Some(part) = &self.part else { return own.map(whole) };
        // Neighbours are those of the rule: nothing else can be wrong with a row.
        let lost = match &own {
            Err(OperatorError::NotFinite { particle }) => Some([*particle, 0]),
            _ => None,
        };
        match part.first_found(lost) {
            Some([particle, _]) => Err(OperatorError::NotFinite { particle }),
            None => Ok(whole(own?).of_part(part.clone())),
        }
    }
}

/// Newton's method along the way.
struct Newton<'a> {
    rule: &'a Corotated<'a>,
    /// Residual force at the start.
    size: f64,
    residuals: Vec<f64>,
    /// Set-up, and solves.
    times: [Duration; 2],
    /// Size of the last step over that of the displacements \[1\].
    last_step: f64,
    /// Systems of steps of which the iterations that were asked for came to no end.
    cut_short: usize,
}

impl Newton<'_> {
    fn go(&mut self, tolerance: f64) -> Result<Vectors, CorotatedError> {
        let way = self.rule.way;
        let mut u =
            way.start.map_or_else(|| Vectors::zeros(self.rule.follows.len()), |(start, _)| start.clone());
        let longest = self.rule.straight_part();
        let (mut done, mut stride) = (0.0, longest);
        while done < 1.0 {
            let part = f64::min(done + stride.min(longest), 1.0);
            let goal = if part == 1.0 { tolerance } else { tolerance.max(ON_THE_WAY) };
            match self.increment(&u, way.part(part), goal) {
                Ok(Some(next)) => (u, done, stride) = (next, part, 2.0 * stride),
                Ok(None) => stride = 0.5 * (part - done),
                // An error in the unstrained body is an error of the scene.
                Err(error) if self.residuals.len() == 1 => return Err(error),
                Err(error @ CorotatedError::Solve(SolveError::Interrupted)) => return Err(error),
                Err(error) => {
                    tracing::debug!(part, %error, "an increment fails");
                    stride = 0.5 * (part - done);
                }
            }
            let solves = self.residuals.len() - 1;
            if done < 1.0 && (stride < LEAST_STRIDE || solves >= MOST_SOLVES) {
                let (part, cut_short) = (way.part(done), self.cut_short);
                return Err(CorotatedError::Unsettled { part, solves, cut_short });
            }
        }
        Ok(u)
    }

    /// From an equilibrium on the way to that after another part of it; `None` if it does not get there.
    fn increment(
        &mut self,
        from: &Vectors,
        after: f64,
        goal: f64,
    ) -> Result<Option<Vectors>, CorotatedError> {
        let rule = self.rule;
        let mut u = from.clone();
        let now = (rule.way.held)(after);
        // The leaders' move is part of the first step, so that the followers go with them.
        let mut led: Vectors = u.iter().zip(now.iter()).map(|(here, there)| minus(there, here)).collect();
        let Some((mut locals, mut left)) = rule.forces(&u, after) else { return Ok(None) };
        let turns: Vec<Option<Turn>> = locals.iter().map(|l| l.as_ref().map(|l| l.turn)).collect();
        let (mut best, mut stalled) = (f64::INFINITY, 0);
        let (mut is_settled, mut is_rounding) = (false, false);
        for _ in 0..MOST_STEPS {
            let led = std::mem::replace(&mut led, Vectors::zeros(now.len()));
            match self.step(&mut u, (&locals, left), led) {
                // There is nothing left that another step could find.
                Err(CorotatedError::Solve(SolveError::NotPositive { .. })) if is_rounding => break,
                stepped => stepped?,
            }
            rule.hold(&mut u, &now);
            let Some(found) = rule.forces(&u, after) else { return Ok(None) };
            (locals, left) = found;
            let residual = rule.norm(&left) / self.size;
            self.residuals.push(residual);
            let rounding = rule.rounding(&locals, &u, after) / self.size;
            tracing::debug!(after, residual, rounding, "a step of Newton's method");
            // Where rounding has the last word, further steps do not make it less.
            stalled = if residual > 0.5 * best { stalled + 1 } else { 0 };
            best = best.min(residual);
            is_rounding = residual <= rounding && self.last_step <= ON_THE_WAY;
            let is_enough = residual <= goal.max(ON_THE_WAY) || is_rounding;
            is_settled |= is_enough;
            if residual <= goal || (is_rounding && stalled >= STALLED) {
                break;
            }
            if residual.is_nan() || residual > 1e6 {
                return Ok(None);
            }
        }
        let near = |(a, b): (&Option<Turn>, &Option<Local>)| match (a, b) {
            (Some(a), Some(b)) => a.cosine_to(b.turn) >= LEAST_COSINE,
            _ => true,
        };
        let is_far = rule.any(!turns.iter().zip(&locals).all(near));
        // An iteration sees of a system what its right-hand side has in it, which is all where that is rounding; a factorisation sees
        // all, and a sweep nothing.
        let sees = rule.question.solver == rule.step.solver;
        let is_seen = sees && self.last_step <= NEAR && (is_rounding || rule.step.solver == DIRECT);
        let is_taken = is_settled && !is_far && (is_seen || self.is_stable(&locals)?);
        Ok(is_taken.then_some(u))
    }

    /// One step of Newton's method, the leaders moving by `led`.
    fn step(
        &mut self,
        u: &mut Vectors,
        (locals, left): (&[Option<Local>], Vectors),
        led: Vectors,
    ) -> Result<(), CorotatedError> {
        let rule = self.rule;
        let solved = self.solved(locals, [left, led], &rule.step)?;
        let is_spent = solved.residuals.len() > rule.step.most_iterations;
        self.cut_short += usize::from(is_spent && !solved.converged);
        self.last_step = rule.norm(&solved.displacement) / rule.norm(u).max(f64::MIN_POSITIVE);
        for (i, by) in solved.displacement.iter().enumerate() {
            let at = u.get(i);
            u.set(i, [at[0] + by[0], at[1] + by[1]]);
        }
        Ok(())
    }

    /// Whether the energy has a minimum here: whether forces without any symmetry are borne.
    fn is_stable(&mut self, locals: &[Option<Local>]) -> Result<bool, CorotatedError> {
        let rule = self.rule;
        let force = |(i, local): (usize, &Option<Local>)| {
            let free = rule.free(i).map(|free| free && local.is_some());
            let of_axis = |axis: usize| {
                let share = (2 * rule.body.index(i) + axis) as f64 * 0.618_033_988_749_895;
                if free[axis] { share.fract() - 0.5 } else { 0.0 }
            };
            [0, 1].map(of_axis)
        };
        let forces = locals.iter().enumerate().map(force).collect();
        match self.solved(locals, [forces, Vectors::zeros(locals.len())], &rule.question) {
            Err(CorotatedError::Solve(
                SolveError::NotPositive { .. } | SolveError::Diverged { .. } | SolveError::Loose { .. },
            )) => Ok(false),
            solved => solved.map(|_| true),
        }
    }

    /// The linear system at these forces and stiffnesses, solved for the forces that are left and the leaders' moves.
    fn solved(
        &mut self,
        locals: &[Option<Local>],
        left_and_led: [Vectors; 2],
        request: &Request,
    ) -> Result<Solved, CorotatedError> {
        let (begin, rule) = (Stopwatch::start(), self.rule);
        let system = rule.system(locals, left_and_led).map_err(NotLinear::Operator)?;
        let assembled = begin.elapsed();
        let solved = solve_linear(&system, request, rule.part.as_ref().map(|part| &part.team))?;
        self.times[0] += assembled + solved.phases[0].1;
        self.times[1] += solved.phases[1].1;
        Ok(solved)
    }
}

fn add(sum: &mut [f64; 2], [x, y]: [f64; 2]) {
    *sum = [sum[0] + x, sum[1] + y];
}
