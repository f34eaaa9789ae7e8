//! Means, thresholds and materials that do not suit the body, roles without effect, and probes of the frame.

use super::layout;
#[cfg(feature = "export")]
use crate::engine::Engine;
use crate::engine::setup::Setup;
use crate::flock::body::Body;
use crate::flock::fracture::{Ghosts, Threshold};
use crate::flock::lattice::LatticeKind;
use crate::flock::law::Flock;
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::role::Role;
use crate::flock::rules::Mean;
use crate::flock::vectors::{Vectors, distance};
use crate::material::elastic::{Elastic, STRETCH};
use crate::scene::Scene;

/// Counts of a body, or of a part of one.
struct Doubts {
    followers: usize,
    /// Those of which a neighbour has a coordinate that the mean does not take.
    unmoved: usize,
    /// Bonds between particles of the body that are as long as the fracture distance before anything moves.
    long: usize,
}

impl Doubts {
    fn of(body: &Body, flock: &Flock, roles: &[Role], places: &Vectors) -> Self {
        let follows = |&i: &usize| roles[i] == Role::Follower && !flock.neighbours.of(i).is_empty();
        let followers: Vec<usize> = body.owned().filter(follows).collect();
        let lacks = |&&i: &&usize| flock.lacks_mean(i, places).contains(&true);
        let least = match flock.bonds.as_ref().and_then(|bonds| bonds.threshold) {
            // Rounding decides whether one that is exactly as long breaks.
            Some(Threshold::Distance(distance)) => distance * (1.0 - 1e-9),
            _ => f64::INFINITY,
        };
        let length = |i: usize, k: usize| distance(body.reference.get(i), body.reference.get(k));
        let is_long =
            |i: usize, k: usize| !body.is_frame[k] && length(i, k) >= least && (i < k || !sees(flock, k, i));
        let long = |i: usize| flock.neighbours.of(i).iter().filter(|&&k| is_long(i, k as usize)).count();
        Self {
            followers: followers.len(),
            unmoved: followers.iter().filter(lacks).count(),
            long: if least.is_finite() {
                body.owned().filter(|&i| !body.is_frame[i]).map(long).sum()
            } else {
                0
            },
        }
    }

    fn cautions(&self, scene: &Scene) -> Vec<String> {
        let Self { followers, unmoved, long } = *self;
        let unmoved = (unmoved > 0).then(|| {
            format!(
                "{unmoved} of {followers} followers have a neighbour at a negative coordinate, of which there is no mean \
                 about the axes' zero: along that axis they do not move; move the body by body.anchor, or use \
                 rule.mean.origin = \"moving\""
            )
        });
        let long = scene.raw.fracture.as_ref().and_then(|fracture| fracture.distance).filter(|_| long > 0);
        let long = long.map(|df| {
            format!(
                "fracture.distance = {df} is no more than the length of {} bonds of the undeformed body, which break at \
                 once; raise it above the longest",
                self.long
            )
        });
        unmoved.into_iter().chain(long).collect()
    }
}

fn sees(flock: &Flock, from: usize, other: usize) -> bool {
    flock.neighbours.of(from).contains(&(other as u32))
}

/// Names materials that resist one strain so much more than another that their cells lock.
fn locking(scene: &Scene) -> impl Iterator<Item = String> {
    let inclusions = scene.inclusions.iter().map(|part| &part.material);
    let [x, y] = scene.lattice.vector([1, 0]);
    let are_rectangles =
        matches!(scene.lattice.kind(), LatticeKind::Square { .. } | LatticeKind::Rectangular { .. });
    let found = |elastic: &Elastic| Some((elastic.fibres(), elastic.locks((are_rectangles, y.atan2(x)))?));
    let locking: Vec<_> = scene.material.iter().chain(inclusions).filter_map(found).collect();
    let in_shear = locking.iter().any(|(fibres, _)| fibres.is_none()).then(|| {
        let by = match are_rectangles {
            true => {
                "pulled with 4 cells across at -0.9 displacements are off by 3 %, and stresses by 11 %; use a smaller spacing"
            }
            false => {
                "the body is too stiff, pulled by 13 % at -0.9 with 4 cells across, and by 18 % at -0.99 with 16; use a \
                 square lattice, or a smaller spacing"
            }
        };
        format!(
            "near poisson = -1 in plane stress a material resists shear far more than dilatation, and its cells lock: {by}, \
             and see `flockform compare`"
        )
    });
    let with_fibres = locking.iter().find(|(fibres, _)| fibres.is_some()).map(|(_, (times, strain))| {
        let by = match are_rectangles {
            true if *strain != STRETCH => {
                "lock: bent with two strains 40 and 80 times as stiff as the third and 10 cells across displacements are off by 1 %, and \
                 stresses by 22 %, with 20 by 15 %; use a smaller spacing"
            }
            true => {
                "whose sides do not lie along its fibres lock: bent with fibres 14 times as stiff at 30 degrees and 4 cells across \
                 displacements are off by 2 %, and stresses by 12 %; use lattice.orientation along the fibres, or a smaller spacing"
            }
            false => {
                "that are no rectangles lock: the body is too stiff (on a honeycomb perhaps too soft), bent by 28 % with fibres 14 \
                 times as stiff at 30 degrees and 4 cells across, by 13 % with 8, and more with stiffer fibres; use a square \
                 lattice, best with lattice.orientation along the fibres, or a smaller spacing"
            }
        };
        format!(
            "an orthotropic material resists {strain} {times:.0} times as much as another strain, and cells {by}, and see \
             `flockform compare`"
        )
    });
    in_shear.into_iter().chain(with_fibres)
}

/// Says that ghosts are not mirrored where no neighbour lies opposite, and what mirrored ones do to means that are none of places.
fn unmirrored(scene: &Scene) -> Option<String> {
    scene.fracture.filter(|fracture| fracture.ghosts == Ghosts::Mirrored)?;
    let is_honeycomb = matches!(scene.lattice.kind(), LatticeKind::Honeycomb { .. });
    if matches!(scene.mean, Mean::Power { .. }) {
        return Some(format!(
            "fracture.ghosts = \"mirrored\" with a {}: an image moves with its particle, and the mean of a neighbour and its image is not \
             their middle, so that a fragment may run away or turn inside out; use \"lattice\"",
            scene.mean
        ));
    }
    let lacking = match scene.is_of_points() {
        true => "points have hardly any neighbours that lie opposite",
        false if is_honeycomb => "the nearest neighbours on a honeycomb do not lie opposite each other",
        false => return None,
    };
    Some(format!("{lacking}: fracture.ghosts = \"mirrored\" is \"lattice\" there"))
}

/// Says that a mean of all particles in range draws them together.
fn contracting(scene: &Scene) -> Option<String> {
    let is_anew = matches!(scene.neighbourhood, Neighbourhood::Dynamic { .. });
    let keeps = matches!(scene.mean, Mean::Spaced { .. } | Mean::Median | Mean::Material { .. });
    (is_anew && !keeps).then(|| {
        format!(
            "the {} of all particles in range keeps no distance: the body contracts; use rule.mean.kind = \"spaced\"",
            scene.mean
        )
    })
}

/// Names probed points of the frame; `any` says whether one of the ranks has found something.
fn framed_probes(scene: &Scene, body: &Body, any: impl Fn(bool) -> bool) -> Option<String> {
    scene.frame?;
    let is_framed = |id: &&usize| any(body.particle(**id).is_some_and(|particle| body.is_frame[particle]));
    let framed: Vec<&usize> = scene.record.probes.iter().filter(is_framed).collect();
    framed.first().map(|first| {
        format!(
            "record.probes has points of the frame, {} in all, the first {first}: their PE1 is always 0 and their PE2 in no \
             sum; name particles of the body",
            framed.len()
        )
    })
}

/// The warnings that the scene alone gives.
fn of_rule(scene: &Scene) -> impl Iterator<Item = String> {
    locking(scene).chain(unmirrored(scene)).chain(contracting(scene))
}

/// The warnings before a run.
pub(crate) fn planned(scene: &Scene, setup: &Setup) -> Vec<String> {
    let Setup { body, flock, roles, changes, .. } = setup;
    let mut cautions: Vec<String> = of_rule(scene).collect();
    // A part does not see the others.
    if body.part.is_some() {
        return cautions;
    }
    cautions.extend(Doubts::of(body, flock, roles, &body.reference).cautions(scene));
    cautions.extend(layout::roles::cautions(changes, body, None));
    cautions.extend(framed_probes(scene, body, |own| own));
    cautions
}

/// The warnings after a run, made by all ranks together where each has a part of the body.
#[cfg(feature = "export")]
pub(crate) fn seen(scene: &Scene, engine: &Engine) -> Vec<String> {
    let Doubts { followers, unmoved, long } =
        Doubts::of(engine.body(), engine.flock(), engine.roles(), engine.present());
    let [followers, unmoved, long] = [followers, unmoved, long].map(|own| engine.count_of_parts(own));
    let mut cautions = Doubts { followers, unmoved, long }.cautions(scene);
    cautions.extend(of_rule(scene));
    cautions.extend(layout::roles::cautions(engine.changes(), engine.body(), engine.parted()));
    cautions.extend(framed_probes(scene, engine.body(), |own| engine.any_of_parts(own)));
    cautions
}
