//! Work that loads and supports do on a body while it goes from one equilibrium to the next.
//!
//! By the trapezoid rule: mean force times way between two equilibria, particle by particle. In a body that stores what is
//! done to it, the sum from the unloaded body on is the strain energy, up to an error that falls with the square of the
//! increments. A body that is stepped is at rest nowhere on its way, and nothing is summed up.

use serde::{Deserialize, Serialize};

use super::Engine;
use super::forces::Forces;
use crate::flock::vectors::Vectors;
use crate::geometry::point::{dot, plus};

/// Forces at their last value times displacements \[force length\]. In equilibrium under small rotations the strain
/// energy is half of the sum of both; in a body that turns this is no energy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// Of the loads.
    pub loads: f64,
    /// Of the reactions: of leaders that were moved.
    pub supports: f64,
}

/// From the unloaded body to the last equilibrium.
#[derive(Clone, Debug, Default)]
pub struct Path {
    done: Work,
    most: f64,
    largest_force: f64,
    unbalanced: f64,
    last: Option<Acting>,
}

/// Forces on each particle \[force\] and its displacement \[length\], shape \[count\].
#[derive(Clone, Debug)]
struct Acting {
    loads: Vectors,
    supports: Vectors,
    displacement: Vectors,
}

impl Path {
    /// The sum so far.
    pub fn done(&self) -> Work {
        self.done
    }

    /// The largest size of the sum of both at any equilibrium so far \[force length\].
    pub fn most(&self) -> f64 {
        self.most
    }

    /// The largest force of a load or a support on a particle at any equilibrium so far \[force\].
    pub fn largest_force(&self) -> f64 {
        self.largest_force
    }

    /// What the forces may have done that a tolerance left out of balance, sizes added up \[force length\].
    pub fn unbalanced(&self) -> f64 {
        self.unbalanced
    }

    /// Adds the way to where the engine's body is at rest now.
    pub fn extend(&mut self, engine: &Engine) {
        let Some(forces) = Forces::of(engine) else { return };
        let supports = forces.supports(engine);
        let left: Vectors = (0..supports.len()).map(|i| plus(forces.left_on(i), supports.get(i))).collect();
        let now = Acting { supports, loads: forces.loads, displacement: forces.displacement };
        let rest = || Vectors::zeros(now.displacement.len());
        let unloaded = || Acting { loads: rest(), supports: rest(), displacement: rest() };
        let last = self.last.take().unwrap_or_else(unloaded);
        let done = |i: usize| {
            let ([x, y], [a, b]) = (now.displacement.get(i), last.displacement.get(i));
            let way = [x - a, y - b];
            let work = |before: &Vectors, after: &Vectors| {
                let (f, g) = (before.get(i), after.get(i));
                0.5 * ((f[0] + g[0]) * way[0] + (f[1] + g[1]) * way[1])
            };
            let out_of_balance = dot(left.get(i), way).abs();
            (i, [work(&last.loads, &now.loads), work(&last.supports, &now.supports), out_of_balance])
        };
        let [loads, supports, unbalanced] =
            engine.sum_over([-0.0, -0.0, 0.0], engine.body().owned().map(done));
        self.done.loads += loads;
        self.done.supports += supports;
        self.unbalanced += unbalanced;
        self.most = self.most.max((self.done.loads + self.done.supports).abs());
        let force = |i: usize| [&now.loads, &now.supports].map(|of| of.get(i).map(f64::abs)).concat();
        let own = engine.body().owned().flat_map(force).fold(0.0, f64::max);
        let [largest] = engine.largest_of_parts([own]);
        self.largest_force = self.largest_force.max(largest);
        self.last = Some(now);
    }
}
