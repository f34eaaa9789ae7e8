//! The corotated material: cells that turn.
//!
//! Small strain means small rotation too: a body turned as a whole is strained by the plain formula. Corotated, each
//! cell has a rotation `R` of its own, that of its mean deformation gradient `F = 1 + sum_k u_k g_k'`, and stores
//!
//! ```text
//! W = y' K y / 2      y = R' x - X      F = R U, U symmetric (in the plane: tan of the angle = (F21 - F12) / (F11 + F22))
//! ```
//!
//! over its corners at `x`, `X` in the reference. The forces on the corners are the full gradient of this energy, with
//! the change of `R`:
//!
//! ```text
//! f_i = -R (K y)_i + M R S g_i / q      M = sum_k (R' x_k) x (K y)_k      q = tr U
//! ```
//!
//! `M` is the moment that `K y` has about any point, `R S g_i / q` the change of the cell's angle with the place of the
//! corner, `S` a quarter turn. The second term gives back by the corners exactly the moment that the first one leaves, so
//! that forces and moments of every cell balance whatever it is made of, rest states are minima of an energy, and the
//! tangent is symmetric. Without that term this holds only where `K` resists what is not affine alike in all directions:
//! measured at the clamp of a bent beam, 4e-5 of the load's moment is lost with isotropic cells cut by an outline, and
//! 19 % with fibres. A rotation that minimises the energy is no way out: stretched cells would turn to and fro instead
//! (under tension the energy of `U - 1` has a maximum at `R`).
//!
//! The projection is that of C. C. Rankin and B. Nour-Omid, *The use of projectors to improve finite element performance*,
//! Computers and Structures 30, 1988; C. A. Felippa and B. Haugen, *A unified formulation of small-strain corotational
//! finite elements*, CMAME 194, 2005.
//!
//! The rule stays neighbours in, target out: the corners of the cells around a particle are its neighbours, and
//! `x_i <- x_i + D^-1 (sum of f_i + load)`, `D = sum R K_ii R'`. A body turned by any angle moves as the unturned one does,
//! in turned axes; where rotations are small this is the plain material rule.

use smallvec::SmallVec;

use super::ParticleState;
use super::averaged::{self, PatchCell};
use crate::flock::block::{self, Block, apply, inverse, product, transposed};
use crate::geometry::point::{cross, dot, plus};

/// Something of each corner of a cell; on the stack unless an outline has glued cells together.
type Corners<T> = SmallVec<[T; 6]>;

/// The stiffness of a cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Element {
    /// `K_ij` by rows \[force / length\], shape \[corners, corners\]; symmetric, and no force under a rigid motion.
    pub stiffness: Vec<Block>,
    /// Mean gradients of the corners' shape functions \[1 / length\], shape \[corners\].
    pub gradients: Vec<[f64; 2]>,
}

/// A corner of a cell, seen from any point that belongs to the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// Where it was from there \[length\].
    pub reference: [f64; 2],
    /// How far it has moved since, less what that point has \[length, world frame\].
    pub displacement: [f64; 2],
}

/// The rotation of a cell and its stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    cos: f64,
    sin: f64,
    /// `cos - 1`, with all its digits.
    versed: f64,
    /// Trace of the stretch: 2 in the reference.
    trace: f64,
    /// That less 2, with all its digits.
    growth: f64,
}

impl Turn {
    /// From `F21 - F12` and `F11 + F22 - 2`.
    #[inline]
    fn of_gradient(skew: f64, dilatation: f64) -> Option<Self> {
        let trace = 2.0 + dilatation;
        let size = f64::hypot(skew, trace);
        let (cos, sin) = (trace / size, skew / size);
        let is_forward = trace > 0.0;
        let versed = if is_forward { -sin * (skew / (size + trace)) } else { cos - 1.0 };
        let growth = if is_forward { dilatation + skew * (skew / (size + trace)) } else { size - 2.0 };
        (size > 0.0 && size.is_finite()).then_some(Self { cos, sin, versed, trace: size, growth })
    }

    /// Trace of the stretch \[1\].
    pub fn trace(self) -> f64 {
        self.trace
    }

    /// Trace of the stretch less 2: the dilatation \[1\].
    pub fn growth(self) -> f64 {
        self.growth
    }

    /// Cosine of the angle between two turns.
    pub(crate) fn cosine_to(self, other: Self) -> f64 {
        self.cos * other.cos + self.sin * other.sin
    }

    /// A matrix in the turned axes: `R block R'`.
    #[inline]
    pub fn turned(self, block: &Block) -> Block {
        let forth = [[self.cos, -self.sin], [self.sin, self.cos]];
        product(&product(&forth, block), &transposed(forth))
    }

    /// A vector in the turned axes: `R vector`.
    #[inline]
    pub(crate) fn forth(self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y]
    }

    /// `R' (X + u) - X`.
    #[inline]
    pub(super) fn strained(self, Corner { reference: [x, y], displacement: [u, v] }: Corner) -> [f64; 2] {
        [
            self.versed * x + self.sin * y + self.cos * u + self.sin * v,
            self.versed * y - self.sin * x + self.cos * v - self.sin * u,
        ]
    }
}

/// The force on one corner of a cell, and its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct CellRow {
    /// The cell's own rotation, and the trace of its stretch.
    pub turn: Turn,
    /// Force of the cell on the corner \[force, world frame\].
    pub force: [f64; 2],
    /// The energy that the cell stores \[force length\].
    pub energy: f64,
    /// Second derivatives of the energy to the corner and each corner \[force / length\], shape \[corners\].
    pub tangent: Corners<Block>,
}

impl Element {
    /// Number of corners.
    pub fn corners(&self) -> usize {
        self.gradients.len()
    }

    #[inline]
    fn block(&self, a: usize, b: usize) -> &Block {
        &self.stiffness[a * self.corners() + b]
    }

    /// The rotation of the cell; `None` where it has no direction left, all corners in one point.
    pub fn turn(&self, corner: impl Fn(usize) -> Corner) -> Option<Turn> {
        let (mut skew, mut dilatation) = (0.0, 0.0);
        for (k, &[gx, gy]) in self.gradients.iter().enumerate() {
            let [u, v] = corner(k).displacement;
            skew += gx * v - gy * u;
            dilatation += gx * u + gy * v;
        }
        Turn::of_gradient(skew, dilatation)
    }

    /// The force of the cell on the corner `own` \[force, world frame\], and its rotation; `None` as [`Element::turn`].
    pub fn force_on(&self, own: usize, corner: impl Fn(usize) -> Corner) -> Option<(Turn, [f64; 2])> {
        let (turn, y, z) = self.places(corner)?;
        let l = self.stiffness_times(&y);
        let moment = z.iter().zip(&l).fold(0.0, |sum, (&z, &l)| sum + cross(z, l));
        Some((turn, turn.forth(self.balanced(own, l[own], moment / turn.trace))))
    }

    /// `-(K y - M S g / q)` of a corner, from `K y` and `M / q`.
    #[inline]
    fn balanced(&self, own: usize, pull: [f64; 2], moment: f64) -> [f64; 2] {
        let by_angle = quarter(self.gradients[own]);
        [moment * by_angle[0] - pull[0], moment * by_angle[1] - pull[1]]
    }

    /// The rotation of the cell, and `y = R' x - X` and `z = R' x` of its corners.
    #[allow(clippy::type_complexity)]
    fn places(
        &self,
        corner: impl Fn(usize) -> Corner,
    ) -> Option<(Turn, Corners<[f64; 2]>, Corners<[f64; 2]>)> {
        let corners: Corners<Corner> = (0..self.corners()).map(corner).collect();
        let turn = self.turn(|k| corners[k])?;
        let y: Corners<_> = corners.iter().map(|&corner| turn.strained(corner)).collect();
        let z = y.iter().zip(&corners).map(|(&y, corner)| plus(y, corner.reference)).collect();
        Some((turn, y, z))
    }

    /// `K v`.
    #[inline]
    fn stiffness_times(&self, v: &[[f64; 2]]) -> Corners<[f64; 2]> {
        let row =
            |row: &[Block]| row.iter().zip(v).fold([0.0; 2], |sum, (block, &v)| plus(sum, apply(block, v)));
        self.stiffness.chunks_exact(v.len()).map(row).collect()
    }

    /// [`Element::force_on`] with its derivatives.
    ///
    /// With `z = R' x`, `l = K y`, `w = S g / q`, `a = K S z`, `b = S l - a + (M / q) g` and `c = (S z) . a - z . l`, all in the
    /// axes of the cell, the second derivatives are `K_ik + b_i w_k' + w_i b_k' + c w_i w_k'`: symmetric as `K` is.
    pub fn row(&self, own: usize, corner: impl Fn(usize) -> Corner) -> Option<CellRow> {
        let (turn, y, z) = self.places(corner)?;
        let count = self.corners();
        let turned: Corners<_> = z.iter().map(|&z| quarter(z)).collect();
        let (l, a) = (self.stiffness_times(&y), self.stiffness_times(&turned));
        let sum = |term: &dyn Fn(usize) -> f64| (0..count).map(term).sum::<f64>();
        let moment = sum(&|k| cross(z[k], l[k])) / turn.trace;
        let c = sum(&|k| dot(turned[k], a[k]) - dot(z[k], l[k]));
        let w = |k: usize| quarter(self.gradients[k]).map(|g| g / turn.trace);
        let b = |k: usize| {
            let turned = quarter(l[k]);
            [0, 1].map(|d| turned[d] - a[k][d] + moment * self.gradients[k][d])
        };
        let (b_own, w_own) = (b(own), w(own));
        let tangent = (0..count).map(|k| {
            let (b_k, w_k, stiffness) = (b(k), w(k), self.block(own, k));
            let entry = |d: usize, e: usize| {
                stiffness[d][e] + (b_own[d] * w_k[e] + w_own[d] * b_k[e]) + c * (w_own[d] * w_k[e])
            };
            turn.turned(&[[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]])
        });
        let force = turn.forth(self.balanced(own, l[own], moment));
        let energy = 0.5 * sum(&|k| dot(y[k], l[k]));
        Some(CellRow { turn, force, energy, tangent: tangent.collect() })
    }
}

/// A cell around a particle.
#[derive(Clone, Copy, Debug)]
pub struct CellAround<'a> {
    /// Stiffness and shape of the cell.
    pub element: &'a Element,
    /// Which of its corners the particle is.
    pub own: usize,
    /// Which of the particle's neighbours each corner is, shape \[corners\]; [`OWN`] for itself.
    pub slots: &'a [u32],
}

/// Stands for the particle itself among the neighbours.
pub const OWN: u32 = u32::MAX;

impl CellAround<'_> {
    /// Corners from where the particle is, `neighbour` by `neighbour`.
    pub fn corner(&self, k: usize, neighbour: impl Fn(usize) -> Corner) -> Corner {
        if self.slots[k] == OWN { Corner::default() } else { neighbour(self.slots[k] as usize) }
    }

    /// Force on the particle \[force, world frame\] and what holds it, `R K_ii R'` \[force / length\].
    fn pull(&self, neighbour: impl Fn(usize) -> Corner) -> Option<([f64; 2], Block)> {
        let (turn, force) = self.element.force_on(self.own, |k| self.corner(k, &neighbour))?;
        Some((force, turn.turned(self.element.block(self.own, self.own))))
    }
}

/// Force of its cells and patches on a particle \[force, world frame\], and `D` \[force / length\]; a cell that has collapsed
/// to a point adds nothing.
pub fn pull<'a, P: Iterator<Item = PatchCell<'a>>>(
    cells: impl Iterator<Item = CellAround<'a>>,
    patches: impl Iterator<Item = (f64, P)>,
    neighbour: impl Fn(usize) -> Corner,
) -> ([f64; 2], Block) {
    let cells = cells.filter_map(|cell| cell.pull(&neighbour));
    let patches = patches.filter_map(|(k, cells)| averaged::pull(k, cells, &neighbour));
    cells.chain(patches).fold(Default::default(), |(sum, holds), (force, hold)| {
        (plus(sum, force), block::plus(&holds, &hold))
    })
}

/// The target of a particle under this force of its cells and its load, held by `hold`; `None` where nothing holds it.
/// Components that are `held` are where its rest offset says.
pub fn target(own: &ParticleState, (force, hold): ([f64; 2], Block), held: [bool; 2]) -> Option<[f64; 2]> {
    let load = own.load.map_or([0.0; 2], |load| load.force);
    let force = [force[0] + load[0], force[1] + load[1]];
    if held == [false; 2] {
        let [x, y] = apply(&inverse(&hold)?, force);
        return Some([own.present[0] + x, own.present[1] + y]);
    }
    let component = |axis: usize| match held[axis] {
        true => own.rest[axis],
        false => own.present[axis] + force[axis] / hold[axis][axis],
    };
    Some([component(0), component(1)])
}

#[inline]
pub(super) fn quarter([x, y]: [f64; 2]) -> [f64; 2] {
    [-y, x]
}

#[cfg(test)]
mod tests;
