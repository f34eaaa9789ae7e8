//! Where a corotated material comes to rest: Newton's method on the rule's own targets.
//!
//! With `R_i` the turn of the neighbours of particle `i`, the force that is left on it is
//! `g_i = R_i h_i + f_i`, `h_i = sum_j K_ij (R_i' (x_j - x_i) - (X_j - X_i))`: `D_i`, in turned axes, times
//! how far the rule's target is from it. The turn depends on the neighbours alone, so `-dg` is an operator
//! over the same neighbours, with blocks `R_i K_ij R_i' + v_i w_ij'`; `w_ij = S R_i (X_j - X_i) / m_i` is what
//! a neighbour's move adds to the angle, `v_i = S R_i h_i - R_i sum_j K_ij S R_i' (x_j - x_i)` what the angle
//! does to the force, `S` a quarter turn and `m_i` the size of [`Turn`]'s fit.
//!
//! Turns that differ from neighbour to neighbour leave no symmetry: the linear systems are factorised, or swept.
//! Leaders go their way and loads grow in increments, halved where Newton's method does not settle or a
//! particle turns too far at once: that keeps to the equilibrium that the unstrained body grows into.

use std::time::{Duration, Instant};

use super::equilibrium::{
    Choice, Precision, Request, SolveError, Solved, Solver, System, choose_unsymmetric, solve as solve_linear,
};
use super::linear::NotLinear;
use super::operator::{Operator, OperatorError, Row};
use crate::flock::block::{Block, apply, plus};
use crate::flock::body::Body;
use crate::flock::interaction::{Interaction, MatrixWeights, Weights};
use crate::flock::points::Points;
use crate::flock::rules::{Mean, Rotation, Turn};

/// Newton steps of one increment.
const MOST_STEPS: usize = 16;
/// Linear systems of a whole way.
const MOST_SOLVES: usize = 500;
/// Least part of the way taken at once.
const LEAST_STRIDE: f64 = 1.0 / 1024.0;
/// Residual at which the next increment may begin.
const ON_THE_WAY: f64 = 1e-3;
/// Cosine of the largest turn of a particle in one increment: 60 degrees.
const LEAST_COSINE: f64 = 0.5;
/// Residual of each linear system: more digits than a Newton step has.
const OF_A_STEP: f64 = 1e-5;

/// Why there is no corotated equilibrium to be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorotatedError {
    #[error(transparent)]
    NotLinear(#[from] NotLinear),
    #[error(transparent)]
    Solve(#[from] SolveError),
    #[error("feedback is a term of the sweep, which the corotated equilibrium does not have")]
    Feedback,
    #[error(
        "{solver} needs neighbours that feel each other alike, and axes that turn from particle to particle leave none; direct, gauss-seidel and jacobi do not ask for it"
    )]
    NotSymmetric { solver: Solver },
    #[error(
        "the rotations do not settle beyond {:.1} % of the way of leaders and loads ({solves} systems solved): the body snaps, buckles or is torn there",
        100.0 * part
    )]
    Unsettled { part: f64, solves: usize },
}

/// Whether a rule is what this file is about.
pub fn is_corotated(interaction: &Interaction) -> bool {
    interaction.rule.mean == Mean::Material { rotation: Rotation::Corotated }
}

/// The solver of the linear systems, and why.
///
/// # Errors
/// If the one asked for needs symmetry, or single precision is asked for.
pub fn choose(followers: usize, request: &Request) -> Result<(Solver, String), CorotatedError> {
    let (solver, why) = match request.solver {
        Choice::This(solver) => (solver, "asked for".into()),
        Choice::Auto => choose_unsymmetric(followers, "axes turn from particle to particle"),
    };
    if solver.needs_symmetry() {
        return Err(CorotatedError::NotSymmetric { solver });
    }
    if request.precision == Precision::F32 {
        return Err(SolveError::DoubleOnly { solver }.into());
    }
    Ok((solver, format!("{why}; once a step of Newton's method, until the rotations settle")))
}

/// How leaders and loads get to where they are.
pub struct Way<'a> {
    /// Where those who do not follow are after a part of the whole way \[length\], shape \[count\]; as much of the
    /// loads is then on the body.
    pub held: &'a dyn Fn(f64) -> Points,
    /// The equilibrium to start from and the part that it belongs to; the reference and 0 where there is none.
    pub start: Option<(&'a Points, f64)>,
    /// The part to come to \[1\].
    pub end: f64,
}

impl Way<'_> {
    /// Part of the whole way after a part of this one.
    fn part(&self, of_this: f64) -> f64 {
        let start = self.start.map_or(0.0, |(_, part)| part);
        if of_this == 1.0 { self.end } else { start + of_this * (self.end - start) }
    }
}

/// The equilibrium at the end of the way.
///
/// # Errors
/// As [`solve_linear`]; names the part of the way from which on the rotations do not settle.
pub fn solve(
    interaction: &Interaction,
    body: &Body,
    follows: Vec<bool>,
    way: &Way<'_>,
    request: &Request,
) -> Result<Solved, CorotatedError> {
    let Weights::Matrix(weights) = &interaction.weights else {
        return Err(NotLinear::Rule { rule: "a material without its weights" }.into());
    };
    if interaction.rule.feedback.is_some() {
        return Err(CorotatedError::Feedback);
    }
    let tolerance = request.tolerance;
    if tolerance.is_nan() || tolerance <= 0.0 || tolerance >= 1.0 {
        return Err(SolveError::Tolerance { tolerance }.into());
    }
    let followers = follows.iter().filter(|&&follows| follows).count();
    let (solver, why) = choose(followers, request)?;
    let step = Request { solver: Choice::This(solver), tolerance: OF_A_STEP, ..*request };
    let rule = Corotated { interaction, weights, body, follows, way, step };
    let mut newton = Newton {
        rule: &rule,
        size: rule.size(),
        residuals: vec![1.0],
        times: [Duration::ZERO; 2],
        last_step: f64::INFINITY,
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
    interaction: &'a Interaction,
    weights: &'a MatrixWeights,
    body: &'a Body,
    follows: Vec<bool>,
    way: &'a Way<'a>,
    /// How a linear system is solved.
    step: Request,
}

/// A particle among its neighbours.
struct Local {
    turn: Turn,
    /// `g` without the load.
    force: [f64; 2],
    /// What a small turn adds to the force.
    by_angle: [f64; 2],
}

fn quarter([x, y]: [f64; 2]) -> [f64; 2] {
    [-y, x]
}

impl Corotated<'_> {
    /// Neighbours of a particle: index, stiffness, and where they are from it in the reference and, displaced
    /// by `u`, now.
    fn around<'b>(
        &'b self,
        i: usize,
        u: &'b Points,
    ) -> impl Iterator<Item = (usize, &'b Block, [f64; 2], [f64; 2])> + Clone {
        let reference = &self.interaction.reference;
        let others = self.interaction.neighbours.of(i).iter().zip(self.weights.stiffness_of(i));
        others.map(move |(&j, block)| {
            let j = j as usize;
            let then = minus(reference.get(j), reference.get(i));
            let by = minus(u.get(j), u.get(i));
            (j, block, then, [then[0] + by[0], then[1] + by[1]])
        })
    }

    /// `None` where the neighbours have no direction left.
    fn local(&self, i: usize, u: &Points, turn: Option<Turn>) -> Option<Local> {
        let pairs = self.around(i, u).map(|(_, _, then, now)| (then, now));
        let turn = turn.map_or_else(|| Turn::fit(pairs), Some)?;
        let (mut pull, mut swing) = ([0.0; 2], [0.0; 2]);
        for (_, block, then, now) in self.around(i, u) {
            let back = turn.back(now);
            add(&mut pull, apply(block, minus(back, then)));
            add(&mut swing, apply(block, quarter(back)));
        }
        let force = turn.forth(pull);
        Some(Local { turn, force, by_angle: minus(quarter(force), turn.forth(swing)) })
    }

    fn load(&self, i: usize) -> [f64; 2] {
        self.interaction.forces.as_ref().map_or([0.0; 2], |forces| forces.get(i))
    }

    /// The force left on every follower after `part` of the way; zero on the others.
    fn forces(&self, u: &Points, part: f64) -> Option<(Vec<Option<Local>>, Points)> {
        let mut left = Points::zeros(u.len());
        let mut locals = Vec::with_capacity(u.len());
        for i in 0..u.len() {
            if !self.follows[i] {
                locals.push(None);
                continue;
            }
            let local = self.local(i, u, None)?;
            let load = self.load(i);
            left.set(i, [local.force[0] + part * load[0], local.force[1] + part * load[1]]);
            locals.push(Some(local));
        }
        Some((locals, left))
    }

    /// The force at the start, all followers at zero and everybody in the axes of the reference.
    fn size(&self) -> f64 {
        let mut u = (self.way.held)(1.0);
        (0..u.len()).filter(|&i| self.follows[i]).for_each(|i| u.set(i, [0.0; 2]));
        let followers = (0..u.len()).filter(|&i| self.follows[i]);
        let all: Points = followers
            .map(|i| {
                let force = self.local(i, &u, Some(Turn::NONE)).map_or([f64::NAN; 2], |local| local.force);
                let load = self.load(i);
                [force[0] + load[0], force[1] + load[1]]
            })
            .collect();
        norm(&all)
    }

    /// `-dg` at these places: forces per displacement.
    fn tangent(&self, u: &Points, locals: &[Option<Local>]) -> Result<Operator, OperatorError> {
        let lattice = &self.body.lattice;
        let grid = [lattice.vector([1, 0]), lattice.vector([0, 1])];
        let row = |i: usize| {
            let mut row = Row::default();
            let Some(local) = &locals[i] else { return row };
            for (j, block, then, _) in self.around(i, u) {
                let [x, y] = quarter(local.turn.forth(then)).map(|w| w / local.turn.size());
                let [a, b] = local.by_angle;
                let block = plus(&local.turn.turned(block), &[[a * x, a * y], [b * x, b * y]]);
                let (here, there) = (self.body.sites[i], self.body.sites[j]);
                row.diagonal = plus(&row.diagonal, &block);
                row.entries.push(([there[0] - here[0], there[1] - here[1]], block));
            }
            row
        };
        Operator::from_rows(&self.body.sites, grid, self.follows.clone(), row)
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
}

impl Newton<'_> {
    fn go(&mut self, tolerance: f64) -> Result<Points, CorotatedError> {
        let way = self.rule.way;
        let mut u =
            way.start.map_or_else(|| Points::zeros(self.rule.follows.len()), |(start, _)| start.clone());
        let (mut done, mut stride) = (0.0, 1.0);
        while done < 1.0 {
            let part = f64::min(done + stride, 1.0);
            let goal = if part == 1.0 { tolerance } else { tolerance.max(ON_THE_WAY) };
            match self.increment(&u, way.part(part), goal) {
                Ok(Some(next)) => (u, done, stride) = (next, part, 2.0 * stride),
                Ok(None) => stride = 0.5 * (part - done),
                // What is wrong with the unstrained body is wrong with the scene.
                Err(error) if self.residuals.len() == 1 => return Err(error),
                Err(_) => stride = 0.5 * (part - done),
            }
            let solves = self.residuals.len() - 1;
            if done < 1.0 && (stride < LEAST_STRIDE || solves >= MOST_SOLVES) {
                return Err(CorotatedError::Unsettled { part: way.part(done), solves });
            }
        }
        Ok(u)
    }

    /// From an equilibrium on the way to that after another part of it; `None` if it does not get there.
    fn increment(&mut self, from: &Points, after: f64, goal: f64) -> Result<Option<Points>, CorotatedError> {
        let rule = self.rule;
        let mut u = from.clone();
        let now = (rule.way.held)(after);
        // The leaders' move is part of the first step, so that the followers go with them.
        let mut led: Points = u.iter().zip(now.iter()).map(|(here, there)| minus(there, here)).collect();
        let Some((mut locals, mut left)) = rule.forces(&u, after) else { return Ok(None) };
        let turns: Vec<Option<Turn>> = locals.iter().map(|l| l.as_ref().map(|l| l.turn)).collect();
        let mut best = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            self.step(&mut u, (&locals, left), std::mem::replace(&mut led, Points::zeros(now.len())))?;
            (0..u.len()).filter(|&i| !rule.follows[i]).for_each(|i| u.set(i, now.get(i)));
            let Some(found) = rule.forces(&u, after) else { return Ok(None) };
            (locals, left) = found;
            let residual = norm(&left) / self.size;
            self.residuals.push(residual);
            // Where rounding has the last word, another step does not make it less.
            if residual <= goal || (residual <= ON_THE_WAY && residual > 0.5 * best) {
                best = best.min(residual);
                break;
            }
            best = best.min(residual);
            if residual.is_nan() || residual > 1e6 {
                return Ok(None);
            }
        }
        let near = |(a, b): (&Option<Turn>, &Option<Local>)| match (a, b) {
            (Some(a), Some(b)) => a.cosine_to(b.turn) >= LEAST_COSINE,
            _ => true,
        };
        let arrived = best <= goal.max(ON_THE_WAY) && turns.iter().zip(&locals).all(near);
        Ok(arrived.then_some(u))
    }

    /// One step of Newton's method, the leaders moving by `led`.
    fn step(
        &mut self,
        u: &mut Points,
        (locals, left): (&[Option<Local>], Points),
        led: Points,
    ) -> Result<(), CorotatedError> {
        let begin = Instant::now();
        let operator = self.rule.tangent(u, locals).map_err(NotLinear::Operator)?;
        let system = System::new(operator, left, led);
        let assembled = begin.elapsed();
        let solved = solve_linear(&system, &self.rule.step)?;
        self.times[0] += assembled + solved.phases[0].1;
        self.times[1] += solved.phases[1].1;
        self.last_step = norm(&solved.displacement) / norm(u).max(f64::MIN_POSITIVE);
        for (i, by) in solved.displacement.iter().enumerate() {
            let at = u.get(i);
            u.set(i, [at[0] + by[0], at[1] + by[1]]);
        }
        Ok(())
    }
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn add(sum: &mut [f64; 2], [x, y]: [f64; 2]) {
    *sum = [sum[0] + x, sum[1] + y];
}

fn norm(points: &Points) -> f64 {
    points.iter().map(|[x, y]| x * x + y * y).sum::<f64>().sqrt()
}
