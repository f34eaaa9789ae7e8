//! Forces within a body whose rule is a material, and the reactions of what holds it.
//!
//! The neighbours of a particle pull it (see [`Flock::force_under`](crate::flock::law::Flock::force_under)). A follower at rest is in balance: that pull
//! and the load on it cancel. On a particle that is led or clamped they do not; what is missing is the force of
//! whatever holds it, its reaction.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Engine;
use super::setup::RoleChange;
use crate::flock::law::Weights;
use crate::flock::role::Role;
use crate::flock::rules::{Mean, Rotation};
use crate::flock::vectors::Vectors;
use crate::geometry::point::{cross, dot, minus, plus};

/// The resultant of the loads on a body. Moments are positive counter-clockwise; their arms end where the particles
/// were in the reference configuration under small rotations, and where they are at present if the rule is corotated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadResultant {
    /// \[force\]
    pub force: [f64; 2],
    /// About the origin of the coordinates \[force length\].
    pub moment_about_origin: f64,
    /// Mean displacement along the resultant, each particle weighted by its part of the load: the displacement in
    /// which the resultant does the work of the load \[length\]. Absent where the forces cancel.
    pub displacement: Option<f64>,
}

/// The reaction that holds the particles of an entry of `roles`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reaction {
    /// The key of the entry, such as `roles[0]`.
    pub key: String,
    /// `clamped` or `leader`.
    pub role: String,
    /// How many particles it holds; one that a later entry names too counts there.
    pub particles: usize,
    /// Middle of these particles \[length\]: in the reference configuration under small rotations, at present if the rule
    /// is corotated.
    pub centre: [f64; 2],
    /// Their mean displacement \[length\].
    pub displacement: [f64; 2],
    /// Force on the body \[force\].
    pub force: [f64; 2],
    /// About `centre` \[force length\].
    pub moment: f64,
    /// About the origin of the coordinates \[force length\].
    pub moment_about_origin: f64,
}

/// The forces of a body at its present places.
#[derive(Clone, Debug)]
pub struct Forces {
    /// Of the neighbours on each particle \[force\], shape \[count\].
    pub internal: Vectors,
    /// Of the loads on each particle \[force\], shape \[count\].
    pub loads: Vectors,
    /// \[length\], shape \[count\].
    pub displacement: Vectors,
    /// Where forces act, for their moments \[length\], shape \[count\].
    places: Vectors,
}

impl Forces {
    /// `None` where the rule has no stiffness.
    pub fn of(engine: &Engine) -> Option<Self> {
        let (flock, present) = (engine.flock(), engine.present());
        let displacement = engine.displacements();
        if !matches!(flock.weights, Weights::Matrix(_)) {
            return None;
        }
        let internal = |i| flock.force_under(i, &displacement);
        let internal: Vec<[f64; 2]> = (0..present.len()).into_par_iter().map(internal).collect();
        let places = match flock.rule.mean {
            Mean::Material { rotation: Rotation::Corotated } => present.clone(),
            _ => Vectors::clone(&flock.reference),
        };
        let loads = flock.forces.clone().unwrap_or_else(|| Vectors::zeros(present.len()));
        Some(Self { internal: internal.into_iter().collect(), loads, displacement, places })
    }

    /// The force that the body does not balance on a particle \[force\]: on one that is held, less its reaction.
    pub fn left_on(&self, particle: usize) -> [f64; 2] {
        plus(self.internal.get(particle), self.loads.get(particle))
    }

    /// The force of what holds a particle on it \[force\].
    pub fn reaction(&self, particle: usize) -> [f64; 2] {
        self.left_on(particle).map(|force| -force)
    }

    /// Reactions of the entries of `roles` that hold particles at present, in their order.
    pub fn reactions(&self, engine: &Engine) -> Vec<Reaction> {
        let entries = held(engine).into_iter().enumerate().filter(|(_, held)| !held.is_empty());
        entries.map(|(k, held)| self.reaction_of(engine, k, &held)).collect()
    }

    fn reaction_of(&self, engine: &Engine, entry: usize, held: &[Held]) -> Reaction {
        let mean =
            |points: &Vectors| held.iter().map(|one| points.get(one.particle)).collect::<Vectors>().middle();
        let centre = mean(&self.places);
        let moment = |about: [f64; 2]| {
            let of = |one: &Held| cross(minus(self.places.get(one.particle), about), self.held_by(*one));
            held.iter().map(of).sum::<f64>()
        };
        Reaction {
            key: format!("roles[{entry}]"),
            role: engine.changes()[entry].role.name().to_owned(),
            particles: held.len(),
            centre,
            displacement: mean(&self.displacement),
            force: held.iter().fold([0.0; 2], |sum, &one| plus(sum, self.held_by(one))),
            moment: moment(centre),
            moment_about_origin: moment([0.0; 2]),
        }
    }

    /// The reaction along the components that are held.
    fn held_by(&self, one: Held) -> [f64; 2] {
        let reaction = self.reaction(one.particle);
        [0, 1].map(|axis| if one.axes[axis] { reaction[axis] } else { 0.0 })
    }

    /// The resultant of all loads; `None` without loads.
    pub fn load(&self, engine: &Engine) -> Option<LoadResultant> {
        engine.whole_load().map(|whole| self.resultant(engine, whole))
    }

    /// The resultant of each load.
    pub fn each_load(&self, engine: &Engine) -> Vec<LoadResultant> {
        engine.each_load().iter().map(|whole| self.resultant(engine, whole)).collect()
    }

    /// Of the part of a load that is on the body.
    fn resultant(&self, engine: &Engine, whole: &Vectors) -> LoadResultant {
        let factor = engine.load_factor();
        let [x, y] = whole.iter().fold([0.0; 2], plus);
        let moments = self.places.iter().zip(whole.iter()).map(|(at, force)| cross(at, force));
        let (size, most) = (f64::hypot(x, y), whole.iter().map(|[x, y]| f64::hypot(x, y)).sum::<f64>());
        // Forces that cancel leave rounding.
        let displacement = (size > 1e-9 * most).then(|| work(whole, &self.displacement) / size);
        let force = [factor * x, factor * y];
        LoadResultant { force, moment_about_origin: factor * moments.sum::<f64>(), displacement }
    }

    /// The loads, as they are now, times the displacements \[force length\].
    pub fn work_of_loads(&self) -> f64 {
        work(&self.loads, &self.displacement)
    }

    /// The reactions, as they are now, times the displacements \[force length\].
    pub fn work_of_supports(&self, engine: &Engine) -> f64 {
        work(&self.supports(engine), &self.displacement)
    }

    /// The reaction on each particle along what is held of it \[force\], shape \[count\].
    pub fn supports(&self, engine: &Engine) -> Vectors {
        let mut supports = Vectors::zeros(self.internal.len());
        for one in held(engine).into_iter().flatten() {
            supports.set(one.particle, plus(supports.get(one.particle), self.held_by(one)));
        }
        supports
    }

    /// The largest force that is left on a follower, along components that are free \[force\]: none where the body is
    /// at rest.
    pub fn largest_left(&self, engine: &Engine) -> f64 {
        let mut free = vec![[true; 2]; engine.roles().len()];
        for Held { particle, axes } in held(engine).into_iter().flatten() {
            (0..2).filter(|&axis| axes[axis]).for_each(|axis| free[particle][axis] = false);
        }
        let left = |i: usize| {
            let left = self.left_on(i);
            let [x, y] = [0, 1].map(|axis| if free[i][axis] { left[axis] } else { 0.0 });
            f64::hypot(x, y)
        };
        let followers = (0..free.len()).filter(|&i| engine.roles()[i] == Role::Follower);
        followers.map(left).fold(0.0, f64::max)
    }
}

fn work(forces: &Vectors, displacement: &Vectors) -> f64 {
    forces.iter().zip(displacement.iter()).map(|(force, by)| dot(force, by)).sum()
}

/// A particle that is held along these axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    /// Index of the particle.
    pub particle: usize,
    /// Whether it is held along x and along y.
    pub axes: [bool; 2],
}

/// The particles that each role change holds at present, shape \[changes\]. Of several changes that name a particle
/// or a component of it, the last one by its step holds it.
pub fn held(engine: &Engine) -> Vec<Vec<Held>> {
    let (changes, roles) = (engine.changes(), engine.roles());
    let mut order: Vec<usize> =
        (0..changes.len()).filter(|&k| changes[k].from <= engine.step().max(1)).collect();
    order.sort_by_key(|&k| changes[k].from);
    let mut holder = vec![[None; 2]; roles.len()];
    for k in order {
        let RoleChange { particles, role, axis, .. } = &changes[k];
        // A particle of which one component is held follows along the other.
        let present = if axis.is_some() { Role::Follower } else { *role };
        for &i in particles.iter().filter(|&&i| roles[i] == present) {
            match axis {
                Some(axis) => holder[i][*axis as usize] = Some(k),
                None if role.is_led() => holder[i] = [Some(k); 2],
                None => holder[i] = [None; 2],
            }
        }
    }
    let mut held = vec![Vec::new(); changes.len()];
    for (particle, by) in holder.into_iter().enumerate() {
        let mut entries: Vec<usize> = by.into_iter().flatten().collect();
        entries.dedup();
        for k in entries {
            held[k].push(Held { particle, axes: by.map(|holder| holder == Some(k)) });
        }
    }
    held
}
