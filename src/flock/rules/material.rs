//! The mean of a material: `x_i = sum_j W_ij x_j`, 2x2 weights that sum to the identity.
//!
//! Eq. 1 with matrices for numbers. The weights come from Young's modulus and Poisson's ratio (room
//! `material`); what they sum to is the identity by construction, so nothing is divided. A load `f` on
//! the particle adds `D^-1 f`, how far it moves while its neighbours stay.
//!
//! Small strain means small rotation too: a body turned as a whole is strained by this formula. The corotated
//! material, in the file beside this one, is not.

use crate::flock::block::{Block, apply};

/// Which turns of the body cost nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rotation {
    /// Those that are small, to first order.
    #[default]
    Small,
    /// All.
    Corotated,
}

/// `sum_j W_ij x_j` over pairs of weight and position; `None` without any.
#[inline]
pub fn mean(pairs: impl Iterator<Item = (Block, [f64; 2])>) -> Option<[f64; 2]> {
    pairs.map(|(block, position)| apply(&block, position)).reduce(|[a, b], [x, y]| [a + x, b + y])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_couple_the_components_of_a_position() {
        let halves = [[[0.75, 0.25], [0.125, 0.5]], [[0.25, -0.25], [-0.125, 0.5]]];
        let places = [[-1.0, 0.5], [2.0, 1.0]];
        let [x, y] = mean(halves.into_iter().zip(places)).expect("has neighbours");
        assert_eq!([x, y], [-0.75 + 0.125 + 0.5 - 0.25, -0.125 + 0.25 - 0.25 + 0.5]);
    }
}
