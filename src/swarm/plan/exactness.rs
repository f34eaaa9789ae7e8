//! How exactly followers come to rest where their leaders' affine motion has their places.

use serde::Serialize;

use super::not_linear;
use crate::flock::manoeuvre::{Affine, Posture, highest};
use crate::flock::role::Role;
use crate::flock::rounding::ROUNDING;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::swarm::Swarm;
use crate::swarm::formation::Formation;

/// How far followers come to rest from their places behind leaders that move as one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exactness {
    /// The motions of the leaders that every follower takes part in exactly: `shift`, `turn`, `stretch`, `shear`.
    pub exact: Vec<&'static str>,
    /// The error of each manoeuvre.
    pub manoeuvres: Vec<ManoeuvreError>,
    /// Robots without which others do not keep their places, where with all of them every follower does in all of these motions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needed: Option<Vec<Needed>>,
}

/// A robot that others cannot do without.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Needed {
    /// Its name.
    pub name: String,
    /// Names of those that fall behind where it is lost.
    pub by: Vec<String>,
}

/// How far followers are from their places in a manoeuvre that is flown slowly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ManoeuvreError {
    /// Name of the manoeuvre.
    pub name: String,
    /// Largest distance of a follower from its place \[m\]; 0 where it is rounding.
    pub largest: f64,
}

impl Exactness {
    /// `None` where the rule is not linear, no program of the swarm leads, nothing follows, or the followers are too many.
    pub fn of(swarm: &Swarm, formation: &Formation) -> Option<Self> {
        let about = formation.middle();
        let is_led = formation.is_led_here() && (0..formation.count()).any(|m| formation.is_led(m));
        let is_led = is_led && (0..formation.count()).any(|m| !formation.leads(m));
        (is_led && not_linear(formation, swarm).is_none())
            .then(|| formation.settled(&formation.places))??;
        let is_exact = |postures: &[Posture]| {
            postures.iter().all(|posture| largest(formation, posture.affine(about)) == Some(0.0))
        };
        let nominal = Posture::NOMINAL;
        // The answer of the rule to displacements is linear, so two members of each family stand for all of it.
        let families = [
            ("shift", [[1.0, 0.0], [0.0, 1.0]].map(|translate| Posture { translate, ..nominal })),
            ("turn", [1.0, -2.0].map(|rotate| Posture { rotate, ..nominal })),
            ("stretch", [[2.0, 1.0], [1.0, 2.0]].map(|stretch| Posture { stretch, ..nominal })),
            ("shear", [[1.0, 0.0], [0.0, 1.0]].map(|shear| Posture { shear, ..nominal })),
        ];
        let exact: Vec<&str> =
            families.iter().filter(|(_, postures)| is_exact(postures)).map(|(name, _)| *name).collect();
        let needed = (exact.len() == families.len()).then(|| needed(formation));
        let manoeuvres = formation.manoeuvres.iter().filter_map(|one| on_the_way(formation, &one.name));
        Some(Self { exact, manoeuvres: manoeuvres.collect(), needed })
    }

    /// Whether there are manoeuvres and followers keep their places in each.
    pub(super) fn is_every_manoeuvre_exact(&self) -> bool {
        !self.manoeuvres.is_empty() && self.manoeuvres.iter().all(|one| one.largest == 0.0)
    }
}

/// Whether a shift of all robots along an axis takes the targets of all followers along, so that they come to rest where it has their
/// places.
pub(super) fn keeps_to_shift(formation: &Formation, axis: usize) -> bool {
    let Some(engine) = formation.engine() else { return false };
    let (flock, reference) = (engine.flock(), &engine.body().reference);
    // So far that the rounding of places far from the origin is little of it.
    let way = formation.spacing() + reference.iter().map(|p| distance(p, [0.0; 2])).fold(0.0, f64::max);
    let along = |[x, y]: [f64; 2]| if axis == 0 { [x + way, y] } else { [x, y + way] };
    let shifted: Vectors = reference.iter().map(along).collect();
    let is_off = |i: usize| {
        let (unmoved, moved) = (flock.target(i, reference), flock.target(i, &shifted));
        distance(along(unmoved), moved) > ROUNDING * way
    };
    !engine.roles().iter().enumerate().any(|(i, &role)| role == Role::Follower && is_off(i))
}

fn needed(formation: &Formation) -> Vec<Needed> {
    let mut is_heard = vec![true; formation.count()];
    let mut all: Vec<Needed> =
        formation.names.iter().map(|name| Needed { name: name.clone(), by: Vec::new() }).collect();
    for m in (0..formation.count()).filter(|&m| !formation.leads(m)) {
        for lost in formation.depends_on(m) {
            is_heard[lost] = false;
            if !formation.keeps_place(m, &is_heard) {
                all[lost].by.push(formation.names[m].clone());
            }
            is_heard[lost] = true;
        }
    }
    all.retain(|one| !one.by.is_empty());
    all
}

fn on_the_way(formation: &Formation, name: &str) -> Option<ManoeuvreError> {
    /// Parts of a leg at whose ends the places are compared.
    const PARTS: usize = 16;
    let manoeuvre = formation.manoeuvre(name, 0.0)?;
    let mut found: f64 = 0.0;
    let mut start = 0.0;
    for leg in &manoeuvre.legs {
        let begun = start;
        start += leg.seconds + leg.hold;
        // It is known, as it was of the families.
        let at = |part: f64| largest(formation, manoeuvre.affine(begun + leg.seconds * part)).unwrap_or(0.0);
        found = found.max(highest(PARTS, at));
    }
    Some(ManoeuvreError { name: name.to_owned(), largest: found })
}

/// Largest distance of a follower at rest from where the leaders' motion has its place \[m\].
fn largest(formation: &Formation, affine: Affine) -> Option<f64> {
    let places: Vectors = formation.places.iter().map(|place| affine.apply(place)).collect();
    let rest = formation.settled(&places)?;
    let found = (0..places.len()).map(|m| distance(places.get(m), rest.get(m))).fold(0.0, f64::max);
    Some(if found > ROUNDING * formation.spacing() { found } else { 0.0 })
}
