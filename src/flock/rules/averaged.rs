//! Strains averaged over patches of cells that turn.
//!
//! A nearly incompressible material resists, instead of the dilatation of each cell, the mean one of the cells around each
//! particle, a *patch*; room `material` says why, and which other strains are averaged alike. A strain of a cell is `e = N : (U - 1)`,
//! `U` its stretch, which no rotation changes, and `N` the weights; of a dilatation they are 1 and `e` is the trace less 2, `q - 2`.
//! With `w_c` the share of a cell's area that counts for the patch, a patch stores
//!
//! ```text
//! W = k t^2 / 2      t = sum_c w_c e_c      force on a particle: -k t v      v = sum_c w_c R_c (N - b S) g
//! ```
//!
//! where `S` is a quarter turn and `b = N : (S U) / q` comes from the change of `R`, by `R S g / q` with the place of a corner.
//!
//! A particle feels the patches around itself and around those that share a cell with it, so its neighbours are up to two cells away.

use super::corotated::{Corner, Element, OWN, Turn, quarter};
use crate::flock::block::{Block, plus};
use crate::geometry::point::dot;

/// A cell of a patch that a particle feels.
#[derive(Clone, Copy, Debug)]
pub struct PatchCell<'a> {
    /// Stiffness and shape of the cell.
    pub element: &'a Element,
    /// `w`, the area with which it counts \[length^2\].
    pub share: f64,
    /// `N`, the weights of its strain (xx, yy, engineering xy) \[1\]: 1, 1, 0 of a dilatation.
    pub weights: [f64; 3],
    /// Which of the particle's neighbours each of its corners is, shape \[corners\]; [`OWN`] for itself.
    pub slots: &'a [u32],
}

/// The force of one patch on a particle, and its derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PatchRow {
    /// \[force, world frame\]
    pub force: [f64; 2],
    /// The energy that the patch stores \[force length\].
    pub energy: f64,
    /// Second derivatives of the energy to the particle and to its neighbours, or itself \[force / length\].
    pub tangent: Vec<(u32, Block)>,
}

/// How a strain of these weights changes with the place of a corner whose shape function has this gradient \[1 / length\]: `N g`.
pub fn weighted([xx, yy, xy]: [f64; 3], [x, y]: [f64; 2]) -> [f64; 2] {
    [xx * x + xy * y, xy * x + yy * y]
}

/// The weighted strain of a cell, and what its derivatives need.
struct Strained {
    turn: Turn,
    weights: [f64; 3],
    /// `e` \[1\].
    strain: f64,
    /// `b` \[1\].
    by_turn: f64,
}

impl PatchCell<'_> {
    /// `None` where the cell has no direction left.
    fn strained(&self, neighbour: impl Fn(usize) -> Corner) -> Option<Strained> {
        let corner = |k: usize| corner_of(self.slots[k], &neighbour);
        let turn = self.element.turn(corner)?;
        let [xx, yy, xy] = self.weights;
        let (mean, apart) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let (mut strain, mut by_turn) = (mean * turn.growth(), 0.0);
        // All but the dilatation, which turns with nothing.
        if apart != 0.0 || xy != 0.0 {
            for (k, &gradient) in self.element.gradients.iter().enumerate() {
                let (moved, gradient) = (turn.strained(corner(k)), weighted([apart, -apart, xy], gradient));
                strain += dot(moved, gradient);
                by_turn += dot(quarter(moved), gradient);
            }
        }
        Some(Strained { turn, weights: self.weights, strain, by_turn: by_turn / turn.trace() })
    }
}

impl Strained {
    /// `R (N - b S) g`, by which the strain changes with the place of a corner of this gradient.
    fn by_place(&self, gradient: [f64; 2]) -> [f64; 2] {
        let ([x, y], [a, b]) = (weighted(self.weights, gradient), quarter(gradient));
        self.turn.forth([x - self.by_turn * a, y - self.by_turn * b])
    }
}

fn corner_of(slot: u32, neighbour: impl Fn(usize) -> Corner) -> Corner {
    if slot == OWN { Corner::default() } else { neighbour(slot as usize) }
}

/// Force of a patch of stiffness `k` \[force / length^3\] on a particle \[force, world frame\], and what holds it, `k v v'`
/// \[force / length\]; `None` where a cell has collapsed to a point.
pub fn pull<'a>(
    k: f64,
    cells: impl Iterator<Item = PatchCell<'a>>,
    neighbour: impl Fn(usize) -> Corner,
) -> Option<([f64; 2], Block)> {
    let (mut strain, mut v) = (0.0, [0.0; 2]);
    for cell in cells {
        let strained = cell.strained(&neighbour)?;
        strain += cell.share * strained.strain;
        if let Some(own) = cell.slots.iter().position(|&slot| slot == OWN) {
            let [x, y] = strained.by_place(cell.element.gradients[own]);
            v = [v[0] + cell.share * x, v[1] + cell.share * y];
        }
    }
    let hold = [0, 1].map(|a| [0, 1].map(|b| k * v[a] * v[b]));
    Some((v.map(|v| -k * strain * v), hold))
}

/// `pull` with its derivatives: `k v_i v_j' + k t sum_c w_c H_ij`. With `N = a + D`, `D` without a trace, `s_i = S g_i` and
/// `d_i = S D g_i + b g_i`, `H_ij = R (a s_i s_j' + d_i s_j' + s_i d_j' - (D : U) s_i s_j' / q) R' / q`: symmetric.
pub fn row<'a>(
    k: f64,
    cells: impl Iterator<Item = PatchCell<'a>> + Clone,
    neighbour: impl Fn(usize) -> Corner,
) -> Option<PatchRow> {
    let (mut strain, mut v) = (0.0, Vec::<(u32, [f64; 2])>::new());
    let mut add_to = |slot: u32, [x, y]: [f64; 2]| match v.iter_mut().find(|(known, _)| *known == slot) {
        Some((_, sum)) => *sum = [sum[0] + x, sum[1] + y],
        None => v.push((slot, [x, y])),
    };
    for cell in cells.clone() {
        let strained = cell.strained(&neighbour)?;
        strain += cell.share * strained.strain;
        for (&slot, &gradient) in cell.slots.iter().zip(&cell.element.gradients) {
            add_to(slot, strained.by_place(gradient).map(|g| cell.share * g));
        }
    }
    let own = v.iter().find(|(slot, _)| *slot == OWN).map_or([0.0; 2], |(_, v)| *v);
    let outer = |by: f64, a: [f64; 2], b: [f64; 2]| a.map(|a| b.map(|b| by * a * b));
    let mut tangent: Vec<(u32, Block)> = v.iter().map(|&(slot, v)| (slot, outer(k, own, v))).collect();
    for cell in cells {
        let PatchCell { element, share, weights: [xx, yy, xy], slots } = cell;
        let Strained { turn, strain: of_cell, by_turn, .. } = cell.strained(&neighbour)?;
        let Some(at) = slots.iter().position(|&slot| slot == OWN) else { continue };
        let (mean, apart) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let across = |corner: usize| quarter(turn.forth(element.gradients[corner]));
        let along = |corner: usize| {
            let gradient = element.gradients[corner];
            let ([a, b], [x, y]) = (quarter(weighted([apart, -apart, xy], gradient)), gradient);
            turn.forth([a + by_turn * x, b + by_turn * y])
        };
        let by = k * strain * share / turn.trace();
        let by_across = by * (mean - (of_cell - mean * turn.growth()) / turn.trace());
        for (corner, slot) in slots.iter().enumerate() {
            if let Some((_, block)) = tangent.iter_mut().find(|(known, _)| known == slot) {
                *block = plus(block, &outer(by_across, across(at), across(corner)));
                if apart != 0.0 || xy != 0.0 {
                    *block = plus(block, &outer(by, along(at), across(corner)));
                    *block = plus(block, &outer(by, across(at), along(corner)));
                }
            }
        }
    }
    Some(PatchRow { force: own.map(|v| -k * strain * v), energy: 0.5 * k * strain * strain, tangent })
}

#[cfg(test)]
mod tests;
