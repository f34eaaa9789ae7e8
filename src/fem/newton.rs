//! The equilibrium of a body that turns far: Newton's method on the first derivatives of its energy, along as many
//! parts of the way as it takes.

use super::assemble::{System, assemble, nodal_loads};
use super::error::FemError;
use super::problem::Problem;
use super::solution::Solution;
use super::solve::solve_tangent;

/// Steps of Newton's method for a part of the way, at most.
const MOST_STEPS: usize = 25;
/// Force left over that at the start, at rest \[1\].
const AT_REST: f64 = 1e-11;
/// The same where rounding keeps it from becoming that small, as in slender bodies: then a step moves nothing by more
/// than a part of the displacement \[1\].
const NEAR_REST: f64 = 1e-5;
const LAST_STEP: f64 = 1e-9;
/// A part of the way in which anything turns further than this is taken in smaller parts \[rad\]: far away there may be
/// another equilibrium.
const MOST_TURN: f64 = 1.0;
/// The shortest part of the way.
const LEAST_STRIDE: f64 = 1.0 / 1024.0;

/// Parts of a way at which the force that moves the body is looked at: leaders that come back leave none at its end.
const LOOKS: u32 = 7;

/// What is prescribed after a part of the way, shape [2 * nodes].
pub(crate) type Held<'a> = dyn Fn(f64) -> Vec<Option<f64>> + 'a;

/// From displacements near the equilibrium \[m\], shape [2 * nodes], or, without one or where that leads nowhere, from the reference.
/// Supports go the way they are `led`, or straight to where they are prescribed.
pub(crate) fn solve_turning(
    problem: &Problem,
    start: Option<Vec<f64>>,
    led: Option<&Held<'_>>,
) -> Result<Solution, FemError> {
    let loads = nodal_loads(problem);
    let size_of = |prescribed: &[Option<f64>]| norm(&assemble(problem, prescribed, &loads, None).load);
    let looks = led.into_iter().flat_map(|led| (1..LOOKS).map(move |k| led(f64::from(k) / f64::from(LOOKS))));
    let size = looks.map(|held| size_of(&held)).fold(size_of(&problem.prescribed), f64::max);
    let way = Way { problem, led, loads, size };
    let at_rest = way.solution(vec![0.0; problem.prescribed.len()])?;
    if way.size == 0.0 {
        return Ok(at_rest);
    }
    if let Some(start) = start
        && let Some(found) = way.part(way.solution(start)?, 1.0)?
    {
        return Ok(found);
    }
    // In one stride an end that comes back has not moved.
    let longest = if led.is_some() { 1.0 / f64::from(LOOKS) } else { 1.0 };
    let (mut at, mut done, mut stride) = (at_rest, 0.0, longest);
    while done < 1.0 {
        let part = f64::min(done + stride.min(longest), 1.0);
        match way.part(at.clone(), part)? {
            Some(found) => (at, done, stride) = (found, part, 2.0 * stride),
            None if stride < 2.0 * LEAST_STRIDE => return Err(FemError::Lost { part: done }),
            None => stride = 0.5 * (part - done),
        }
    }
    Ok(at)
}

struct Way<'a> {
    problem: &'a Problem,
    led: Option<&'a Held<'a>>,
    /// \[N\], shape \[nodes\]
    loads: Vec<[f64; 2]>,
    /// Of the force that is left on the body before anything of it has moved, the largest on the way \[N\].
    size: f64,
}

impl Way<'_> {
    fn solution(&self, u: Vec<f64>) -> Result<Solution, FemError> {
        let (ux, uy) = u.chunks(2).map(|u| (u[0], u[1])).unzip();
        Solution::of(self.problem, ux, uy)
    }

    /// What is prescribed after a part of the way.
    fn held(&self, part: f64) -> Vec<Option<f64>> {
        match self.led {
            Some(led) if part < 1.0 => led(part),
            _ => self.problem.prescribed.iter().map(|end| end.map(|end| part * end)).collect(),
        }
    }

    /// The equilibrium at a part of the way, from a state on it; `None` if Newton's method does not get there.
    fn part(&self, mut at: Solution, part: f64) -> Result<Option<Solution>, FemError> {
        let turned = at.turns();
        let held = self.held(part);
        let mut last_step = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let forces = at.nodal_forces();
            let left: Vec<[f64; 2]> = (self.loads.iter().zip(&forces))
                .map(|(load, own)| [0, 1].map(|k| part * load[k] - own[k]))
                .collect();
            let u = |c: usize| [at.ux(), at.uy()][c % 2][c / 2];
            let step = |c: usize| held[c].map(|there| there - u(c));
            let steps: Vec<Option<f64>> = (0..held.len()).map(step).collect();
            let free = (0..steps.len()).filter(|&c| steps[c].is_none()).map(|c| left[c / 2][c % 2]);
            let residual = norm(&free.collect::<Vec<_>>()) / self.size;
            let is_there = steps.iter().flatten().all(|step| *step == 0.0);
            if is_there && (residual <= AT_REST || residual <= NEAR_REST && last_step <= LAST_STEP) {
                let near = at.turns().iter().zip(&turned).all(|(a, b)| apart(*a, *b) <= MOST_TURN);
                return Ok(near.then_some(at));
            }
            if !residual.is_finite() || residual > 1e6 {
                return Ok(None);
            }
            let system = assemble(self.problem, &steps, &left, Some(&at));
            let moved = match self.moved(&system, &steps) {
                // Nothing resists a motion.
                Err(FemError::Singular { .. }) => return Ok(None),
                moved => moved?,
            };
            let next = moved.iter().enumerate().map(|(c, by)| held[c].unwrap_or_else(|| u(c) + by));
            let next: Vec<f64> = next.collect();
            last_step = norm(&moved) / norm(&next);
            at = match self.solution(next) {
                Err(FemError::NotFinite { .. }) => return Ok(None),
                found => found?,
            };
        }
        Ok(None)
    }

    fn moved(&self, system: &System, steps: &[Option<f64>]) -> Result<Vec<f64>, FemError> {
        let found = solve_tangent(system, &self.problem.mesh)?;
        Ok((0..steps.len())
            .map(|c| system.unknown[c].map_or_else(|| steps[c].unwrap_or(0.0), |i| found[i]))
            .collect())
    }
}

/// Between two angles \[rad\].
fn apart(a: f64, b: f64) -> f64 {
    let turn = (a - b).abs() % std::f64::consts::TAU;
    turn.min(std::f64::consts::TAU - turn)
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}
