//! Newton's method along the way of leaders and loads.

use std::time::Duration;

use super::body::{Corotated, GOLDEN, Local, Stored};
use super::{CorotatedError, DIRECT};
use crate::flock::rules::Turn;
use crate::flock::vectors::Vectors;
use crate::geometry::point::minus;
use crate::solve::balance::is_too_much;
use crate::solve::equilibrium::{Request, SolveError, Solved, solve_shared};
use crate::solve::linear::NotLinear;
use crate::solve::stopwatch::Stopwatch;

/// Newton steps of one increment.
const MOST_STEPS: usize = 16;
/// Steps in a row that do not halve the residual after which rounding is taken to have the last word.
const STALLED: usize = 2;
/// Linear systems of a whole way.
pub(super) const MOST_SOLVES: usize = 500;
/// A part of the way that is all of it but for rounding.
const WHOLE: f64 = 1.0 - 1e-12;
/// Least part of the way taken at once.
const LEAST_STRIDE: f64 = 1.0 / 1024.0;
/// Residual at which the next increment may begin; where rounding leaves more, the part of the displacements that a step is.
const ON_THE_WAY: f64 = 1e-3;
/// Cosine of the largest turn of a cell in one increment: 60 degrees.
const LEAST_COSINE: f64 = 0.5;
/// Size of a last step, over that of the displacements, up to which its tangent is that of where it led to.
const NEAR: f64 = 1e-2;

/// Newton's method along the way.
pub(super) struct Newton<'a> {
    rule: &'a Corotated<'a>,
    /// Residual force at the start.
    pub size: f64,
    pub residuals: Vec<f64>,
    /// Set-up, and solves.
    pub times: [Duration; 2],
    /// Size of the last step over that of the displacements \[1\].
    pub last_step: f64,
    /// The part by which loads and reactions at the end of the way are not in balance, or another step would change the
    /// displacements, if it is too much \[1\].
    pub off: Option<f64>,
    /// Systems of steps of which the iterations that were asked for came to no end.
    cut_short: usize,
}

impl<'a> Newton<'a> {
    pub fn new(rule: &'a Corotated<'a>) -> Self {
        Self {
            rule,
            size: rule.size(),
            residuals: vec![1.0],
            times: [Duration::ZERO; 2],
            last_step: f64::INFINITY,
            off: None,
            cut_short: 0,
        }
    }

    pub fn go(&mut self, tolerance: f64) -> Result<Vectors, CorotatedError> {
        let way = self.rule.way;
        let start =
            way.start.map_or_else(|| Vectors::zeros(self.rule.follows.len()), |(start, _)| start.clone());
        let longest = self.rule.straight_part();
        let (mut done, mut stride) = (0.0, longest);
        let unsettled = |done: f64, newton: &Self| {
            let (part, solves, cut_short) = (way.part(done), newton.residuals.len() - 1, newton.cut_short);
            CorotatedError::Unsettled { part, solves, cut_short }
        };
        let mut here = self.rule.stored(start, way.part(done)).ok_or_else(|| unsettled(done, self))?;
        while done < 1.0 {
            let next = done + stride.min(longest);
            let part = if next < WHOLE { next } else { 1.0 };
            let goal = if part == 1.0 { tolerance } else { tolerance.max(ON_THE_WAY) };
            match self.increment(&here, way.part(part), goal) {
                Ok(Some(next)) => (here, done, stride) = (next, part, 2.0 * stride),
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
                return Err(unsettled(done, self));
            }
        }
        Ok(here.displacement)
    }

    /// From an equilibrium on the way to that after another part of it; `None` if it does not get there.
    fn increment(&mut self, from: &Stored, after: f64, goal: f64) -> Result<Option<Stored>, CorotatedError> {
        let rule = self.rule;
        let mut u = from.displacement.clone();
        let now = (rule.way.held)(after);
        // The leaders' move is part of the first step, so that the followers go with them.
        let mut led: Vectors = u.iter().zip(now.iter()).map(|(here, there)| minus(there, here)).collect();
        let Some((mut locals, mut left)) = rule.forces(&u, after) else { return Ok(None) };
        let turns: Vec<Option<Turn>> = locals.iter().map(|l| l.as_ref().map(|l| l.turn)).collect();
        let near = |(a, b): (&Option<Turn>, &Option<Local>)| match (a, b) {
            (Some(a), Some(b)) => a.cosine_to(b.turn) >= LEAST_COSINE,
            _ => true,
        };
        let (mut best, mut stalled) = (f64::INFINITY, 0);
        let (mut is_settled, mut is_rounding) = (false, false);
        let before = (goal < ON_THE_WAY).then(|| (rule.outer(from), rule.whole.norm(&from.displacement)));
        let mut last = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let led = std::mem::replace(&mut led, Vectors::zeros(now.len()));
            let step = match self.step(&mut u, (&locals, left), led) {
                // There is nothing left that another step could find.
                Err(CorotatedError::Solve(SolveError::NotPositive { .. })) if is_rounding => break,
                stepped => stepped?,
            };
            // As much less as this one is than the last.
            let next = step * (step / last).min(1.0);
            last = step;
            rule.hold(&mut u, &now);
            let Some(found) = rule.forces(&u, after) else { return Ok(None) };
            (locals, left) = found;
            // A step already turns cells about as far as they will be: the rest of them would be for nothing.
            if rule.whole.any(!turns.iter().zip(&locals).all(near)) {
                return Ok(None);
            }
            let residual = rule.whole.norm(&left) / self.size;
            self.residuals.push(residual);
            let rounding = rule.rounding(&locals, &u, after) / self.size;
            tracing::debug!(after, residual, rounding, "a step of Newton's method");
            // Where rounding has the last word, further steps do not make it less.
            stalled = if residual > 0.5 * best { stalled + 1 } else { 0 };
            best = best.min(residual);
            is_rounding = residual <= rounding && self.last_step <= ON_THE_WAY;
            let is_enough = residual <= goal.max(ON_THE_WAY) || is_rounding;
            is_settled |= is_enough;
            self.off = None;
            if residual <= goal || (is_rounding && stalled >= STALLED) {
                let off = before.as_ref().map(|(before, way)| {
                    let of_forces = rule.outer_at(&u, after).off(Some(before));
                    of_forces.max(next / rule.whole.norm(&u).max(*way))
                });
                self.off = off.filter(|&off| is_too_much(off, goal));
                if self.off.is_none() || stalled >= STALLED {
                    break;
                }
            }
            if residual.is_nan() || residual > 1e6 {
                return Ok(None);
            }
        }
        // An iteration sees of a system what its right-hand side has in it, which is all where that is rounding; a factorisation sees
        // all, and a sweep nothing.
        let sees = rule.question.solver == rule.step.solver;
        let is_seen = sees && self.last_step <= NEAR && (is_rounding || rule.step.solver == DIRECT);
        let is_taken = is_settled && (is_seen || self.is_stable(&locals)?);
        let found = if is_taken { rule.stored(u, after) } else { None };
        Ok(found.filter(|found| rule.keeps_energy(from, found)))
    }

    /// One step of Newton's method, the leaders moving by `led`; its size \[length\].
    fn step(
        &mut self,
        u: &mut Vectors,
        (locals, left): (&[Option<Local>], Vectors),
        led: Vectors,
    ) -> Result<f64, CorotatedError> {
        let rule = self.rule;
        let solved = self.solved(locals, [left, led], &rule.step)?;
        let is_spent = solved.residuals.len() > rule.step.most_iterations;
        self.cut_short += usize::from(is_spent && !solved.converged);
        let step = rule.whole.norm(&solved.displacement);
        self.last_step = step / rule.whole.norm(u).max(f64::MIN_POSITIVE);
        for (i, by) in solved.displacement.iter().enumerate() {
            let at = u.get(i);
            u.set(i, [at[0] + by[0], at[1] + by[1]]);
        }
        Ok(step)
    }

    /// Whether the energy has a minimum here: whether forces without any symmetry are borne.
    fn is_stable(&mut self, locals: &[Option<Local>]) -> Result<bool, CorotatedError> {
        let rule = self.rule;
        let force = |(i, local): (usize, &Option<Local>)| {
            let free = rule.free(i).map(|free| free && local.is_some());
            let of_axis = |axis: usize| {
                let share = (2 * rule.whole.body.index(i) + axis) as f64 * GOLDEN;
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
        let solved = solve_shared(&system, request, rule.whole.team())?;
        self.times[0] += assembled + solved.phases[0].1;
        self.times[1] += solved.phases[1].1;
        Ok(solved)
    }
}
