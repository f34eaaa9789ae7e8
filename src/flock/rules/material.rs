//! The mean of a material: `x_i = sum_j W_ij x_j`, 2x2 weights that sum to the identity.
//!
//! Eq. 1 with matrices for numbers. The weights come from Young's modulus and Poisson's ratio (room
//! `material`); what they sum to is the identity by construction, so nothing is divided. A load `f` on
//! the particle adds `D^-1 f`, how far it moves while its neighbours stay.
//!
//! Small strain means small rotation too: a body turned as a whole is strained by the plain formula.
//! Corotated, each particle finds the turn `R` of its neighbours about itself and applies the rule in
//! the turned axes: `x_i = sum_j R W_ij R' x_j + R rest_i + R D^-1 R' f`. A turn of the whole body by any
//! angle is then no strain. The idea is the stiffness warping of M. Mueller et al., *Stable real-time
//! deformations*, 2002, per particle so that a follower needs nobody but its neighbours; where the turn
//! changes from one particle to the next, forces balance up to strain times that change.

use super::{Neighbour, Own};
use crate::flock::block::{Block, apply, product};

/// Which turns of the body cost nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rotation {
    /// Those that are small, to first order.
    #[default]
    Small,
    /// All.
    Corotated,
}

/// A turn about a point, fitted to neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    cos: f64,
    sin: f64,
    size: f64,
}

impl Turn {
    pub const NONE: Turn = Turn { cos: 1.0, sin: 0.0, size: 1.0 };

    /// The turn that brings the neighbours' reference places about the particle nearest to their
    /// present ones (least squares; G. Wahba's problem, closed in the plane); none where they have no
    /// direction left, all in one point.
    pub fn of(own: &Own, neighbours: impl Iterator<Item = Neighbour>) -> Option<Self> {
        Self::fit(neighbours.map(|n| {
            let then = [n.reference[0] - own.reference[0], n.reference[1] - own.reference[1]];
            (then, [n.position[0] - own.present[0], n.position[1] - own.present[1]])
        }))
    }

    /// [`Turn::of`] over pairs of where a neighbour was and is from the particle \[length\].
    pub fn fit(pairs: impl Iterator<Item = ([f64; 2], [f64; 2])>) -> Option<Self> {
        let (mut cos, mut sin) = (0.0, 0.0);
        for (then, now) in pairs {
            cos += then[0] * now[0] + then[1] * now[1];
            sin += then[0] * now[1] - then[1] * now[0];
        }
        let size = f64::hypot(cos, sin);
        (size > 0.0 && size.is_finite()).then(|| Self { cos: cos / size, sin: sin / size, size })
    }

    /// What was fitted: the sum of products of the neighbours' distances then and now, along the turn
    /// \[length^2\].
    pub fn size(self) -> f64 {
        self.size
    }

    /// \[rad\], counter-clockwise, from -pi to pi.
    pub fn angle(self) -> f64 {
        self.sin.atan2(self.cos)
    }

    /// Cosine of the angle between two turns.
    pub fn cosine_to(self, other: Self) -> f64 {
        self.cos * other.cos + self.sin * other.sin
    }

    /// A matrix in the turned axes: `R block R'`.
    pub fn turned(self, block: &Block) -> Block {
        let (forth, back) =
            ([[self.cos, -self.sin], [self.sin, self.cos]], [[self.cos, self.sin], [-self.sin, self.cos]]);
        product(&product(&forth, block), &back)
    }

    pub fn forth(self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y]
    }

    pub fn back(self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cos * x + self.sin * y, self.cos * y - self.sin * x]
    }
}

/// `sum_j W_ij x_j` over pairs of weight and position; `None` without any.
#[inline]
pub fn mean(pairs: impl Iterator<Item = (Block, [f64; 2])>) -> Option<[f64; 2]> {
    pairs.map(|(block, position)| apply(&block, position)).reduce(|[a, b], [x, y]| [a + x, b + y])
}

/// The mean in turned axes: `sum_j R W_ij R' x_j`.
pub fn turned_mean(turn: Turn, neighbours: impl Iterator<Item = Neighbour>) -> Option<[f64; 2]> {
    let pulls = neighbours.map(|n| apply(&n.matrix, turn.back(n.position)));
    pulls.reduce(|[a, b], [x, y]| [a + x, b + y]).map(|sum| turn.forth(sum))
}

#[cfg(test)]
mod tests {
    use super::super::{Mean, Rule};
    use super::*;

    /// Two neighbours that hold the particle by unlike matrices summing to the identity.
    fn pair() -> [Neighbour; 2] {
        let halves = [[[0.75, 0.25], [0.125, 0.5]], [[0.25, -0.25], [-0.125, 0.5]]];
        let places = [[-1.0, 0.5], [2.0, 1.0]];
        [0, 1].map(|k| Neighbour { reference: places[k], matrix: halves[k], ..Neighbour::at(places[k]) })
    }

    fn rule(rotation: Rotation) -> Rule {
        Rule { mean: Mean::Material { rotation }, ..Rule::BARYCENTRE }
    }

    #[test]
    fn matrices_couple_the_components_of_a_position() {
        let pair = pair();
        let [x, y] = mean(pair.iter().map(|n| (n.matrix, n.position))).expect("has neighbours");
        assert_eq!([x, y], [-0.75 + 0.125 + 0.5 - 0.25, -0.125 + 0.25 - 0.25 + 0.5]);
    }

    #[test]
    fn a_turned_body_is_strained_unless_the_rule_is_corotated() {
        let here = [0.25, 0.5];
        let quarter = |[x, y]: [f64; 2]| [7.0 - y, x - 3.0];
        for (rotation, strained) in [(Rotation::Small, true), (Rotation::Corotated, false)] {
            let rule = rule(rotation);
            let rest = rule.rest_offset(here, pair().into_iter());
            let own = Own { present: quarter(here), reference: here, rest, load: None };
            let turned = pair().map(|n| Neighbour { position: quarter(n.reference), ..n });
            let target = rule.target(&own, turned.into_iter());
            let apart = crate::flock::points::distance(target, quarter(here));
            assert_eq!(apart > 0.1, strained, "{rotation:?}: {apart}");
            assert!(strained || apart < 1e-14);
        }
    }
}
