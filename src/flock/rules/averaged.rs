//! Dilatations averaged over patches of cells that turn.
//!
//! A nearly incompressible material resists, instead of the dilatation of each cell, the mean one of the cells around each
//! particle, a *patch*; room `material` says why. The dilatation of a cell is the trace of its stretch less 2, `q_c - 2`, which
//! no rotation changes. With `w_c` the share of a cell's area that counts for the patch, a patch stores
//!
//! ```text
//! W = k t^2 / 2      t = sum_c w_c (q_c - 2)      force on a particle: -k t v      v = sum_c w_c R_c g
//! ```
//!
//! A particle feels the patches around itself and around those that share a cell with it, so its neighbours are up to two cells away.

use super::corotated::{Corner, Element, OWN};
use crate::flock::block::{Block, plus};

/// A cell of a patch that a particle feels.
#[derive(Clone, Copy, Debug)]
pub struct PatchCell<'a> {
    /// Stiffness and shape of the cell.
    pub element: &'a Element,
    /// `w`, the area with which it counts \[length^2\].
    pub share: f64,
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
    let (mut dilatation, mut v) = (0.0, [0.0; 2]);
    for PatchCell { element, share, slots } in cells {
        let turn = element.turn(|corner| corner_of(slots[corner], &neighbour))?;
        dilatation += share * turn.growth();
        if let Some(own) = slots.iter().position(|&slot| slot == OWN) {
            let [x, y] = turn.forth(element.gradients[own]);
            v = [v[0] + share * x, v[1] + share * y];
        }
    }
    let hold = [0, 1].map(|a| [0, 1].map(|b| k * v[a] * v[b]));
    Some((v.map(|v| -k * dilatation * v), hold))
}

/// `pull` with its derivatives: `k v_i v_j' + k t sum_c w_c (R S g_i) (R S g_j)' / q_c`, `S` a quarter turn; symmetric.
pub fn row<'a>(
    k: f64,
    cells: impl Iterator<Item = PatchCell<'a>> + Clone,
    neighbour: impl Fn(usize) -> Corner,
) -> Option<PatchRow> {
    let (mut dilatation, mut v) = (0.0, Vec::<(u32, [f64; 2])>::new());
    let mut add_to = |slot: u32, [x, y]: [f64; 2]| match v.iter_mut().find(|(known, _)| *known == slot) {
        Some((_, sum)) => *sum = [sum[0] + x, sum[1] + y],
        None => v.push((slot, [x, y])),
    };
    for PatchCell { element, share, slots } in cells.clone() {
        let turn = element.turn(|corner| corner_of(slots[corner], &neighbour))?;
        dilatation += share * turn.growth();
        for (&slot, &gradient) in slots.iter().zip(&element.gradients) {
            add_to(slot, turn.forth(gradient).map(|g| share * g));
        }
    }
    let own = v.iter().find(|(slot, _)| *slot == OWN).map_or([0.0; 2], |(_, v)| *v);
    let outer = |by: f64, a: [f64; 2], b: [f64; 2]| a.map(|a| b.map(|b| by * a * b));
    let mut tangent: Vec<(u32, Block)> = v.iter().map(|&(slot, v)| (slot, outer(k, own, v))).collect();
    for PatchCell { element, share, slots } in cells {
        let turn = element.turn(|corner| corner_of(slots[corner], &neighbour))?;
        let Some(at) = slots.iter().position(|&slot| slot == OWN) else { continue };
        let across = |corner: usize| {
            let [x, y] = turn.forth(element.gradients[corner]);
            [-y, x]
        };
        let by = k * dilatation * share / turn.trace();
        for (corner, slot) in slots.iter().enumerate() {
            if let Some((_, block)) = tangent.iter_mut().find(|(known, _)| known == slot) {
                *block = plus(block, &outer(by, across(at), across(corner)));
            }
        }
    }
    Some(PatchRow {
        force: own.map(|v| -k * dilatation * v),
        energy: 0.5 * k * dilatation * dilatation,
        tangent,
    })
}

#[cfg(test)]
mod tests;
