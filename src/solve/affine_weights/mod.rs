//! Weights solved from the nominal shape, so that any affine motion of the leaders is followed exactly.
//!
//! A follower whose weights add up to one and reproduce its own nominal place, `sum_k w_k p_k = p_j`, keeps
//! doing so under every affine map: translation, rotation, stretch, shear. Equal weights do that in the
//! interior of a lattice; here the weights are those nearest to equal ones that do it anywhere, edges and
//! irregular shapes included (Zhao, "Affine formation maneuver control of multiagent systems", IEEE TAC
//! 63(12), 2018, calls such weights a stress). They are not negative where the own place lies among the
//! neighbours: targets then stay in the convex hull of what was received, and the formation comes to rest
//! as soon as every follower is linked to a leader by positive weights. Elsewhere some are negative, and then
//! [`settles`] must be asked: followers outside the hull of the leaders extrapolate, and on lattices a corner
//! that follows is enough for an error to grow that no damping stops: 10 by 10 with 8 neighbours and three
//! leaders in the middle has an eigenvalue of 1.0019, which damping only brings nearer to one. The remedy is
//! in [`Solved::negative`]: let those lead.

mod nearest;

use crate::flock::law::{Flock, Weights};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::role::Role;
use crate::flock::rules::{Mean, Rule};
use crate::flock::vectors::Vectors;
use crate::geometry::point::{minus, plus};
use crate::solve::spectrum::{LinearSweep, SpectralRadius};
use crate::sweep::Update;
use nearest::{Unreachable, nearest};

/// Weights of all bonds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solved {
    /// Parallel to [`Neighbours::index`] \[1\]; equal for those that do not follow.
    pub weights: Vec<f64>,
    /// Followers with a negative weight: they lie outside the hull of their neighbours.
    pub negative: Vec<usize>,
}

/// Why a shape has no weights. Members are named by index; the texts are about them and do not name them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WeightsError {
    /// A follower without neighbours.
    #[error("follows and has no neighbours")]
    NoNeighbours {
        /// Index of the follower.
        member: usize,
    },
    /// A follower whose place, or that of a neighbour, is not finite.
    #[error("has a place, or a neighbour with one, that is not finite")]
    NotFinite {
        /// Index of the follower.
        member: usize,
    },
    /// A follower that lies off the point or line on which all its neighbours stand.
    #[error(
        "cannot be placed by its {neighbours} neighbours: they stand in one point or on one line, {off:.3e} of \
         their spread away from it"
    )]
    Unreachable {
        /// Index of the follower.
        member: usize,
        /// Number of its neighbours.
        neighbours: usize,
        /// How far off it lies, over the spread of its neighbours \[1\].
        off: f64,
    },
    /// A follower whose weights are so large that errors of its neighbours' places would drown its own.
    #[error(
        "has neighbours that stand nearly on one line: its weights would multiply errors of their places by \
         {factor:.3e}, at most {most} is allowed"
    )]
    Amplifies {
        /// Index of the follower.
        member: usize,
        /// Sum of its weights' moduli \[1\].
        factor: f64,
        /// Greatest sum that is allowed \[1\].
        most: f64,
    },
    /// The weights let some error of the followers' places stay or grow.
    #[error(
        "the formation does not come to rest: the slowest error is multiplied by {radius:.6} in every period, and \
         less than 1 is needed: those at the corners, whose weights are negative, have to lead"
    )]
    DoesNotSettle {
        /// Factor of the slowest error in every period \[1\].
        radius: f64,
    },
}

impl WeightsError {
    /// The error as a sentence whose subject is the member concerned.
    pub fn described(&self, name: impl Fn(usize) -> String) -> String {
        match self {
            Self::NoNeighbours { member }
            | Self::NotFinite { member }
            | Self::Unreachable { member, .. }
            | Self::Amplifies { member, .. } => format!("{} {self}", name(*member)),
            Self::DoesNotSettle { .. } => self.to_string(),
        }
    }
}

/// Sum of the weights' moduli up to which they are of use.
const MOST_AMPLIFICATION: f64 = 1000.0;

/// Part of the spread of its neighbours to which weights reproduce a place \[1\].
const REPRODUCED: f64 = 1e-9;

/// Weights of every follower for the nominal places `reference` \[m\], shape \[count\]. Sums and places are
/// met to 1e-12 of the distance to the farthest neighbour, or to a few units in the last place of the
/// coordinates where those are coarser.
pub fn solve(reference: &Vectors, neighbours: &Neighbours, follows: &[bool]) -> Result<Solved, WeightsError> {
    let mut solved = Solved::default();
    for (member, &follows) in follows.iter().enumerate() {
        let near = neighbours.of(member);
        let count = near.len();
        if !follows {
            solved.weights.extend(std::iter::repeat_n(1.0 / count as f64, count));
            continue;
        }
        let weights = weights_of(member, reference, near)?;
        let factor = weights.iter().map(|w| w.abs()).sum::<f64>();
        if factor > MOST_AMPLIFICATION {
            return Err(WeightsError::Amplifies { member, factor, most: MOST_AMPLIFICATION });
        }
        if weights.iter().any(|&w| w < 0.0) {
            solved.negative.push(member);
        }
        solved.weights.extend(weights);
    }
    Ok(solved)
}

/// Weights of the neighbours that are left of a particle, one for each neighbour, where those of all reproduce its place in the
/// reference and those of some can: of these the nearest to equal ones, none of them negative. `None` where there are none.
pub fn of_those_left(flock: &Flock, particle: usize, is_left: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
    let weight = |bond: usize| match &flock.weights {
        Weights::Equal => Some(1.0),
        Weights::Scalar(weights) => Some(weights[bond]),
        Weights::Matrix(_) => None,
    };
    let bonds = flock.neighbours.bonds(particle);
    let weights: Vec<f64> =
        bonds.map(weight).collect::<Option<_>>().filter(|_| flock.rule.mean == Mean::Barycentre)?;
    let (near, own) = (flock.neighbours.of(particle), flock.reference.get(particle));
    let offsets: Vec<[f64; 2]> = near.iter().map(|&k| minus(flock.reference.get(k as usize), own)).collect();
    let spread = offsets.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let moments = weights.iter().zip(&offsets).map(|(weight, at)| at.map(|x| weight * x));
    let moment = moments.fold([0.0; 2], plus);
    let sum: f64 = weights.iter().sum();
    if !(moment.iter().all(|x| x.abs() <= REPRODUCED * spread * sum.abs())) {
        return None;
    }
    let slots: Vec<usize> = (0..near.len()).filter(|&slot| is_left(near[slot] as usize)).collect();
    let left: Vec<u32> = slots.iter().map(|&slot| near[slot]).collect();
    let found = weights_of(particle, &flock.reference, &left).ok()?;
    let mut all = vec![0.0; near.len()];
    slots.iter().zip(&found).for_each(|(&slot, &weight)| all[slot] = weight);
    found.iter().all(|&weight| weight >= 0.0).then_some(all)
}

fn weights_of(member: usize, reference: &Vectors, near: &[u32]) -> Result<Vec<f64>, WeightsError> {
    let own = reference.get(member);
    let places: Vec<[f64; 2]> = near.iter().map(|&k| reference.get(k as usize)).collect();
    if places.is_empty() {
        return Err(WeightsError::NoNeighbours { member });
    }
    let largest = places.iter().chain([&own]).flatten().fold(0.0, |most: f64, p| most.max(p.abs()));
    if !places.iter().chain([&own]).flatten().all(|p| p.is_finite()) {
        return Err(WeightsError::NotFinite { member });
    }
    // Relative to the own place: far from the origin nothing is lost that the coordinates still hold.
    let offsets: Vec<[f64; 2]> = places.iter().map(|p| [p[0] - own[0], p[1] - own[1]]).collect();
    nearest(&offsets, largest).map_err(|Unreachable { off }| WeightsError::Unreachable {
        member,
        neighbours: places.len(),
        off,
    })
}

/// How fast a formation with these weights comes to rest when all take their targets at once, undamped: the
/// factor by which the slowest error shrinks in every period. Refused unless that is below one. Without
/// followers it is zero.
pub fn settles(
    weights: &[f64],
    neighbours: &Neighbours,
    follows: &[bool],
) -> Result<SpectralRadius, WeightsError> {
    let role = |follows: &bool| if *follows { Role::Follower } else { Role::Leader };
    let roles: Vec<Role> = follows.iter().map(role).collect();
    let flock = Flock::new(
        Rule::BARYCENTRE,
        Vectors::zeros(roles.len()).into(),
        neighbours.clone(),
        Weights::Scalar(weights.to_vec()),
    );
    let none = SpectralRadius { radius: 0.0, iterations: 0, converged: true };
    let sweep = LinearSweep::new(&flock, None, &roles, Update::default(), MOST_SWEEPS);
    let found = sweep.map_or(none, |sweep| sweep.radius());
    // Followers that no leader reaches keep an error for ever: exactly one, found as one to rounding.
    if found.radius < 1.0 - 1e-9 {
        Ok(found)
    } else {
        Err(WeightsError::DoesNotSettle { radius: found.radius })
    }
}

const MOST_SWEEPS: usize = 4000;

#[cfg(test)]
mod tests;
