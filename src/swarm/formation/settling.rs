//! The places at which a formation comes to rest: `X_F = (1 - P_FF)^-1 P_FL X_L`, the fixed point of a linear rule.
//!
//! The answer of every follower to a displacement of every leader is computed once, by a dense factorisation;
//! a swarm has hundreds of members. Later a period costs a product of that with the leaders' displacements.

use nalgebra::DMatrix;

use crate::engine::Engine;
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::solve::equilibrium::System;
use crate::solve::linear::system;

/// Most followers for a dense factorisation: more would take seconds.
const MOST_FOLLOWERS: usize = 600;

#[derive(Clone, Debug)]
pub struct Settling {
    /// Number of each particle among the followers or among the leaders, shape \[particles\].
    number: Vec<Option<usize>>,
    follows: Vec<bool>,
    leaders: Vec<usize>,
    /// Displacement of the followers for one of the leaders, shape \[2 followers, 2 leaders\].
    answer: DMatrix<f64>,
    /// Displacement of the followers while no leader is displaced \[m\]; zero where the rule keeps the rest.
    offset: DMatrix<f64>,
}

/// Why no place of rest behind the leaders is known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(in crate::swarm) enum NoRest {
    /// A scene's body or a recording sends the robots.
    #[error("the robots are not sent by a rule over their neighbours")]
    NoRule,
    /// There is no such product.
    #[error("their rule is not linear")]
    NotLinear,
    /// It would take long.
    #[error("it is computed for {MOST_FOLLOWERS} followers at most, and there are {0}")]
    TooMany(usize),
    /// Some follow no leader.
    #[error("the leaders do not decide it alone")]
    Undecided,
}

impl Settling {
    /// Of the roles that the members have.
    ///
    /// # Errors
    /// Says why there is none.
    pub fn of(engine: &Engine) -> Result<Self, NoRest> {
        let roles = engine.roles();
        let follows: Vec<bool> = roles.iter().map(|&role| role == Role::Follower).collect();
        let leads = |&i: &usize| roles[i].is_led();
        let leaders: Vec<usize> = (0..roles.len()).filter(leads).collect();
        let followers: Vec<usize> = (0..roles.len()).filter(|&i| follows[i]).collect();
        if followers.len() > MOST_FOLLOWERS {
            return Err(NoRest::TooMany(followers.len()));
        }
        let held = Vectors::zeros(roles.len());
        let system = system(engine.flock(), engine.body(), follows.clone(), held, &[]);
        let system = system.map_err(|_| NoRest::NotLinear)?;
        let mut number = vec![None; roles.len()];
        followers.iter().enumerate().for_each(|(n, &i)| number[i] = Some(n));
        leaders.iter().enumerate().for_each(|(n, &i)| number[i] = Some(n));
        let (k_ff, k_fl, forces) = dense(engine, &system, &followers, leaders.len(), &number, &follows);
        let factors = (!followers.is_empty()).then(|| k_ff.lu());
        let solved = |right: DMatrix<f64>| match &factors {
            Some(factors) => factors.solve(&right),
            None => Some(right),
        };
        let (answer, offset) = solved(k_fl).zip(solved(forces)).ok_or(NoRest::Undecided)?;
        let is_finite = answer.iter().chain(offset.iter()).all(|value| value.is_finite());
        if is_finite { Ok(Self { number, follows, leaders, answer, offset }) } else { Err(NoRest::Undecided) }
    }

    /// Displacement of each follower \[m\] when leaders have those that `of_particle` gives; `None` for others.
    /// Shape \[particles\].
    pub fn displacements(&self, of_particle: impl Fn(usize) -> Option<[f64; 2]>) -> Vec<Option<[f64; 2]>> {
        let mut led = DMatrix::zeros(2 * self.leaders.len(), 1);
        for (n, &i) in self.leaders.iter().enumerate() {
            let [x, y] = of_particle(i).unwrap_or_default();
            (led[2 * n], led[2 * n + 1]) = (x, y);
        }
        let found = &self.answer * led + &self.offset;
        let of = |(number, &follows): (&Option<usize>, &bool)| {
            let n = number.filter(|_| follows)?;
            Some([found[2 * n], found[2 * n + 1]])
        };
        self.number.iter().zip(&self.follows).map(of).collect()
    }
}

/// `K_FF`, `-K_FL` and the forces on the followers.
fn dense(
    engine: &Engine,
    system: &System,
    followers: &[usize],
    leaders: usize,
    number: &[Option<usize>],
    follows: &[bool],
) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let sites = &engine.body().sites;
    let rows = 2 * followers.len();
    let mut k_ff = DMatrix::zeros(rows, rows);
    let mut k_fl = DMatrix::zeros(rows, 2 * leaders);
    let mut forces = DMatrix::zeros(rows, 1);
    for (n, &i) in followers.iter().enumerate() {
        let row = system.operator.row(i);
        let push = system.forces.get(i);
        for a in 0..2 {
            forces[2 * n + a] = push[a];
            for b in 0..2 {
                k_ff[(2 * n + a, 2 * n + b)] += row.diagonal[a][b];
            }
        }
        for &(offset, block) in &row.entries {
            let site = [sites[i][0] + offset[0], sites[i][1] + offset[1]];
            let Ok(j) = sites.binary_search(&site) else { continue };
            let Some(m) = number[j] else { continue };
            let (matrix, sign) = if follows[j] { (&mut k_ff, -1.0) } else { (&mut k_fl, 1.0) };
            for a in 0..2 {
                for b in 0..2 {
                    matrix[(2 * n + a, 2 * m + b)] += sign * block[a][b];
                }
            }
        }
    }
    (k_ff, k_fl, forces)
}
