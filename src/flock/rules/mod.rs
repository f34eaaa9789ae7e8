//! The flocking rule: neighbours in, target position out (the paper's Choice 3).
//!
//! [`Rule::target`] is the one function that moves a particle of a body and a robot of a swarm. A
//! rule is a mean of the neighbours' positions and, where the scene names them, terms added to it:
//! the rest offset, the Poisson term (Eq. 2) and feedback (Eq. 4), in that order. Each stands in a
//! file of its own.

mod averaged;
mod barycentre;
mod corotated;
mod distance;
mod feedback;
mod material;
mod median;
mod poisson;
mod power;
mod spaced;

use std::fmt;

use super::block::{Block, IDENTITY, apply};

pub use averaged::{PatchCell, PatchRow, row as patch_row, weighted};
pub use corotated::{CellAround, CellRow, Corner, Element, OWN, Turn, pull};
pub use feedback::{Feedback, FeedbackReference};
pub use material::Rotation;
pub use poisson::{Axis, Poisson};
pub use power::Origin;

/// One neighbour as a rule sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Present position \[length, world frame\].
    pub position: [f64; 2],
    /// Fixed weight; 1 where the scene gives none.
    pub weight: f64,
    /// Fixed weight of a material; only [`Mean::Material`] looks.
    pub matrix: Block,
}

impl Neighbour {
    /// A neighbour that counts once.
    #[inline]
    pub fn at(position: [f64; 2]) -> Self {
        Self { position, weight: 1.0, matrix: IDENTITY }
    }
}

/// A push on a particle of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// \[force\]
    pub force: [f64; 2],
    /// How far a force moves the particle while its neighbours stay, `D^-1` \[length / force\].
    pub compliance: Block,
}

/// The particle whose target is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleState {
    /// Position before this step \[length, world frame\].
    pub present: [f64; 2],
    /// Position in the reference configuration \[length, world frame\].
    pub reference: [f64; 2],
    /// Added to the mean \[length\]: see [`Rule::rest_offset`]. Zero for the literal formulas.
    pub rest: [f64; 2],
    /// The push on the particle; none where nothing pushes.
    pub load: Option<Load>,
}

/// Which mean of the neighbours' positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mean {
    /// The centre of gravity (Eq. 1), weighted by the neighbours' fixed weights.
    Barycentre,
    /// Weighted by this power of the present distance (Eq. 3; the paper's power is 1).
    Distance {
        /// Exponent of the distance \[1\]; negative where near neighbours count more.
        power: f64,
    },
    /// The power mean of each coordinate; exponent 0 is the geometric mean.
    Power {
        /// Exponent of the power mean \[1\].
        exponent: f64,
        /// From where coordinates are measured.
        origin: Origin,
    },
    /// The median of each coordinate, which outliers do not move.
    Median,
    /// The mean of the places at `spacing` \[length\] from each neighbour, towards the particle,
    /// weighted by this power of the present distance.
    Spaced {
        /// Distance that each neighbour proposes \[length\].
        spacing: f64,
        /// Exponent of the present distance \[1\].
        power: f64,
    },
    /// Weighted by the neighbours' matrices, which sum to the identity: a rule that is a material. Corotated it looks at
    /// the cells between them instead: see [`Rule::target_by_cells`].
    Material {
        /// Whether cells turn.
        rotation: Rotation,
    },
}

impl Mean {
    /// Which turns of the surroundings are no strain.
    pub(crate) fn rotation(&self) -> Rotation {
        match self {
            Mean::Material { rotation } => *rotation,
            _ => Rotation::Small,
        }
    }

    /// The damping with which a synchronous update of it settles \[1\]. Rules with a spacing are stiff, so that it takes half a step; the waves
    /// of weights by distance grow beyond 2 over `2 (1 + p)` at most, whatever the neighbours.
    pub(crate) fn settling_damping(&self) -> f64 {
        match self {
            Mean::Distance { power } => 1.0 / (1.0 + power.max(1.0)),
            Mean::Spaced { .. } => 0.5,
            _ => 1.0,
        }
    }

    /// Whether a synchronous update of it may overshoot, so that waves grow or go on for ever: of a mean of these others with weights that do
    /// not depend on the distance none does.
    pub(crate) fn overshoots(&self) -> bool {
        match self {
            Mean::Distance { power } => *power > 0.0,
            Mean::Spaced { power, .. } => *power != 0.0,
            _ => false,
        }
    }

    /// Whether its targets are affine in the neighbours' positions, by weights that do not change.
    pub(crate) fn is_affine(&self) -> bool {
        matches!(self, Mean::Barycentre | Mean::Material { rotation: Rotation::Small })
    }
}

/// Its name in reports and messages.
impl fmt::Display for Mean {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Mean::Barycentre => f.write_str("barycentre (Eq. 1)"),
            Mean::Distance { power } => write!(f, "mean weighted by distance^{power} (Eq. 3)"),
            Mean::Power { exponent: 0.0, .. } => f.write_str("geometric mean"),
            Mean::Power { exponent, .. } => write!(f, "power mean with exponent {exponent}"),
            Mean::Median => f.write_str("median"),
            Mean::Spaced { spacing, .. } => write!(f, "cohesion with separation at {spacing}"),
            Mean::Material { rotation: Rotation::Small } => f.write_str("material (small rotations)"),
            Mean::Material { rotation: Rotation::Corotated } => f.write_str("material (corotated)"),
        }
    }
}

/// A composed rule; what a scene does not name is `None` and not evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// The mean of the neighbours' positions.
    pub mean: Mean,
    /// Eq. 2: what a pull along one axis does across it.
    pub poisson: Option<Poisson>,
    /// Eq. 4: the step beyond the target.
    pub feedback: Option<Feedback>,
}

impl Rule {
    /// The paper's plain rule (Eq. 1).
    pub const BARYCENTRE: Rule = Rule { mean: Mean::Barycentre, poisson: None, feedback: None };

    /// A material and nothing else, for small rotations.
    pub const MATERIAL: Rule =
        Rule { mean: Mean::Material { rotation: Rotation::Small }, poisson: None, feedback: None };

    /// Where the particle moves \[length, world frame\]. A particle without neighbours stays: no target
    /// is computed from nothing. Finite input gives finite output unless the result itself overflows.
    #[inline]
    pub fn target(
        &self,
        own: &ParticleState,
        neighbours: impl Iterator<Item = Neighbour> + Clone,
    ) -> [f64; 2] {
        self.completed(own, self.means(own.present, neighbours))
    }

    /// The coordinates of which these neighbours of a particle at `present` have no mean.
    pub(crate) fn lacks_mean(
        &self,
        present: [f64; 2],
        neighbours: impl Iterator<Item = Neighbour> + Clone,
    ) -> [bool; 2] {
        self.means(present, neighbours).map(|mean| mean.is_none())
    }

    /// The same as [`Rule::target`] for a material of small rotations, which needs only pairs of weight and
    /// position: for sweeps, which have them at hand.
    #[inline]
    pub(crate) fn target_of_material(
        &self,
        own: &ParticleState,
        pairs: impl Iterator<Item = (Block, [f64; 2])>,
    ) -> [f64; 2] {
        self.completed(own, by_axis(material::mean(pairs)))
    }

    /// The target by a corotated material: where the force of the cells around the particle and its load leave it, its
    /// neighbours staying; `pulled` is what [`pull`] says of them. The reference configuration is at rest to the last
    /// bit. Components that are `held` stay where the rest offset has them; weights, and other rest offsets, are not
    /// looked at.
    pub fn target_by_cells(
        &self,
        own: &ParticleState,
        pulled: ([f64; 2], Block),
        held: [bool; 2],
    ) -> [f64; 2] {
        match corotated::target(own, pulled, held) {
            Some(target) => self.with_terms(own, target),
            None => own.present,
        }
    }

    /// The target from the bare means: rest offset, load and terms added. A coordinate without a mean stays.
    #[inline]
    fn completed(&self, own: &ParticleState, means: [Option<f64>; 2]) -> [f64; 2] {
        let stays = means.map(|mean| mean.is_none());
        if stays == [true; 2] {
            return own.present;
        }
        let mut target = [0, 1].map(|k| means[k].map_or(own.present[k], |mean| mean + own.rest[k]));
        if let Some(Load { force, compliance }) = &own.load {
            let push = apply(compliance, *force);
            target = [target[0] + push[0], target[1] + push[1]];
        }
        let target = self.with_terms(own, target);
        [0, 1].map(|k| if stays[k] { own.present[k] } else { target[k] })
    }

    /// The rest offset of a held component that feedback takes to `place`, and no farther.
    pub(crate) fn held_offset(&self, place: f64, reference: f64) -> f64 {
        match self.feedback {
            Some(Feedback { factor, reference: FeedbackReference::Initial }) if factor != -1.0 => {
                (place + factor * reference) / (1.0 + factor)
            }
            _ => place,
        }
    }

    #[inline]
    fn with_terms(&self, own: &ParticleState, mut target: [f64; 2]) -> [f64; 2] {
        if let Some(poisson) = &self.poisson {
            poisson.add(own, &mut target);
        }
        if let Some(feedback) = &self.feedback {
            feedback.overshoot(own, &mut target);
        }
        target
    }

    /// The bare mean of each coordinate, before any term; `None` without neighbours or without any weight.
    #[inline]
    fn means(
        &self,
        present: [f64; 2],
        neighbours: impl Iterator<Item = Neighbour> + Clone,
    ) -> [Option<f64>; 2] {
        by_axis(match self.mean {
            Mean::Power { exponent, origin } => return power::means(exponent, origin, neighbours),
            Mean::Barycentre => barycentre::mean(neighbours),
            Mean::Distance { power } => distance::mean(power, present, neighbours),
            Mean::Median => median::mean(neighbours),
            Mean::Spaced { spacing, power } => spaced::mean(spacing, power, present, neighbours),
            Mean::Material { .. } => material::mean(neighbours.map(|n| (n.matrix, n.position))),
        })
    }

    /// The offset that makes a particle with these neighbours stay at `reference`: reference minus
    /// mean. It is zero (up to rounding) for the barycentre of a complete stencil; where neighbours
    /// are missing, reduced to an odd number or unevenly weighted it is what keeps the body from
    /// collapsing towards the side with more of them. The reference configuration is then one of rest
    /// to the last bit, except where the mean is so much larger than the coordinate that no double
    /// makes up the difference exactly: there to one unit in the last place of the mean.
    /// `neighbours` are those of the reference configuration.
    pub fn rest_offset(
        &self,
        reference: [f64; 2],
        neighbours: impl Iterator<Item = Neighbour> + Clone,
    ) -> [f64; 2] {
        let means = self.means(reference, neighbours);
        [0, 1].map(|k| means[k].map_or(0.0, |mean| exact_difference(reference[k], mean)))
    }
}

/// A mean that has all coordinates or none.
#[inline]
fn by_axis(mean: Option<[f64; 2]>) -> [Option<f64>; 2] {
    mean.map_or([None; 2], |mean| mean.map(Some))
}

/// The number nearest to `sum - part` for which `part + it` rounds to `sum` exactly, where there is
/// one.
fn exact_difference(sum: f64, part: f64) -> f64 {
    let difference = sum - part;
    [difference, difference.next_up(), difference.next_down()]
        .into_iter()
        .find(|candidate| part + candidate == sum)
        .unwrap_or(difference)
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn at(points: &[[f64; 2]]) -> impl Iterator<Item = Neighbour> + Clone + '_ {
        points.iter().map(|&position| Neighbour::at(position))
    }

    const EVERY_MEAN: [Mean; 9] = [
        Mean::Barycentre,
        Mean::Distance { power: 1.0 },
        Mean::Distance { power: -2.0 },
        Mean::Power { exponent: 0.0, origin: Origin::Moving { margin: 1.0 } },
        Mean::Power { exponent: 3.0, origin: Origin::Moving { margin: 1.0 } },
        Mean::Power { exponent: -1.0, origin: Origin::World },
        Mean::Power { exponent: 0.0, origin: Origin::World },
        Mean::Median,
        Mean::Spaced { spacing: 1.0, power: -4.0 },
    ];

    fn own(present: [f64; 2]) -> ParticleState {
        ParticleState { present, reference: present, rest: [0.0; 2], load: None }
    }

    #[test]
    fn a_particle_without_neighbours_stays() {
        for mean in EVERY_MEAN {
            let rule = Rule { mean, ..Rule::BARYCENTRE };
            assert_eq!(rule.target(&own([3.0, 4.0]), at(&[])), [3.0, 4.0], "{mean:?}");
        }
    }

    #[test]
    fn the_rest_offset_makes_the_reference_a_fixed_point_to_the_bit() {
        let around = [[1.1, 1.7], [2.3, 0.8], [1.4, 1.9]];
        let here = [1.3, 1.6];
        for mean in EVERY_MEAN {
            let rule = Rule { mean, ..Rule::BARYCENTRE };
            let rest = rule.rest_offset(here, at(&around));
            if rest.iter().all(|r| r.is_finite()) {
                let own = ParticleState { present: here, reference: here, rest, load: None };
                assert_eq!(rule.target(&own, at(&around)), here, "{mean:?}");
            }
        }
    }

    #[test]
    fn coincident_points_give_finite_targets() {
        for mean in EVERY_MEAN {
            let rule = Rule { mean, ..Rule::BARYCENTRE };
            for here in [[2.0, 2.0], [1.0, 5.0]] {
                let target = rule.target(&own(here), at(&[[2.0, 2.0]; 3]));
                assert!(target.iter().all(|t| t.is_finite()), "{mean:?} at {here:?}: {target:?}");
            }
        }
    }
}
