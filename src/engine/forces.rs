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
    pub(crate) fn left_on(&self, particle: usize) -> [f64; 2] {
        plus(self.internal.get(particle), self.loads.get(particle))
    }

    /// The force of what holds a particle on it \[force\].
    pub fn reaction(&self, particle: usize) -> [f64; 2] {
        self.left_on(particle).map(|force| -force)
    }

    /// Reactions of the entries of `roles` that hold particles at present, in their order.
    pub fn reactions(&self, engine: &Engine) -> Vec<Reaction> {
        let owned = engine.body().owned();
        let own = |held: Vec<Held>| held.into_iter().filter(|one| owned.contains(&one.particle)).collect();
        let entries = held(engine).into_iter().map(own).enumerate();
        entries.filter_map(|(k, held): (usize, Vec<Held>)| self.reaction_of(engine, k, &held)).collect()
    }

    /// `None` where no part of the body has a particle that the entry holds; `held` are those of this one.
    fn reaction_of(&self, engine: &Engine, entry: usize, held: &[Held]) -> Option<Reaction> {
        let particles = engine.count_of_parts(held.len());
        let sum = |of: &dyn Fn(Held) -> [f64; 2]| {
            engine.sum_over([0.0; 2], held.iter().map(|&one| (one.particle, of(one))))
        };
        let mean = |points: &Vectors| sum(&|one| points.get(one.particle)).map(|s| s / particles as f64);
        if particles == 0 {
            return None;
        }
        let centre = mean(&self.places);
        let moments = held.iter().map(|&one| {
            let of = |about| cross(minus(self.places.get(one.particle), about), self.held_by(one));
            (one.particle, [of(centre), of([0.0; 2])])
        });
        let [moment, moment_about_origin] = engine.sum_over([-0.0; 2], moments);
        Some(Reaction {
            key: format!("roles[{entry}]"),
            role: engine.changes()[entry].role.name().to_owned(),
            particles,
            centre,
            displacement: mean(&self.displacement),
            force: sum(&|one| self.held_by(one)),
            moment,
            moment_about_origin,
        })
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
    pub(crate) fn each_load(&self, engine: &Engine) -> Vec<LoadResultant> {
        engine.each_load().iter().map(|whole| self.resultant(engine, whole)).collect()
    }

    /// Of the part of a load that is on the body.
    fn resultant(&self, engine: &Engine, whole: &Vectors) -> LoadResultant {
        let factor = engine.load_factor();
        let of = |i: usize| {
            let force = whole.get(i);
            let work = dot(force, self.displacement.get(i));
            [force[0], force[1], cross(self.places.get(i), force), f64::hypot(force[0], force[1]), work]
        };
        let start = [0.0, 0.0, -0.0, -0.0, -0.0];
        let [x, y, moment, most, work] = engine.sum_over(start, engine.body().owned().map(|i| (i, of(i))));
        let size = f64::hypot(x, y);
        // Forces that cancel leave rounding.
        let displacement = (size > 1e-9 * most).then(|| work / size);
        LoadResultant { force: [factor * x, factor * y], moment_about_origin: factor * moment, displacement }
    }

    /// Forces times the displacements \[force length\].
    pub(crate) fn work_of(&self, forces: &Vectors, engine: &Engine) -> f64 {
        let work = |i: usize| [dot(forces.get(i), self.displacement.get(i))];
        let [work] = engine.sum_over([-0.0], engine.body().owned().map(|i| (i, work(i))));
        work
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
    pub(crate) fn largest_left(&self, engine: &Engine) -> f64 {
        let left = self.left_on_followers(engine).into_iter().map(|(_, left)| left);
        let [largest] = engine.largest_of_parts([left.fold(0.0, f64::max)]);
        largest
    }

    /// What is left on all followers over the loads, or, without loads, over the reactions, sizes added up \[1\].
    pub(crate) fn share_left(&self, engine: &Engine) -> f64 {
        let left = self.left_on_followers(engine).into_iter().map(|(i, left)| (i, [left]));
        let [left] = engine.sum_over([0.0], left);
        let [loads, supports] = self.sizes(engine);
        left / if loads > 0.0 { loads } else { supports }
    }

    /// Loads, and reactions, on all particles, sizes added up \[force\].
    fn sizes(&self, engine: &Engine) -> [f64; 2] {
        let supports = self.supports(engine);
        let of = |i: usize| [&self.loads, &supports].map(|forces| forces.get(i)).map(|[x, y]| x.hypot(y));
        engine.sum_over([0.0; 2], engine.body().owned().map(|i| (i, of(i))))
    }

    /// Followers, and the size of the force that is left on each along components that are free \[force\].
    fn left_on_followers(&self, engine: &Engine) -> Vec<(usize, f64)> {
        let mut free = vec![[true; 2]; engine.roles().len()];
        for Held { particle, axes } in held(engine).into_iter().flatten() {
            (0..2).filter(|&axis| axes[axis]).for_each(|axis| free[particle][axis] = false);
        }
        let left = |i: usize| {
            let left = self.left_on(i);
            let [x, y] = [0, 1].map(|axis| if free[i][axis] { left[axis] } else { 0.0 });
            f64::hypot(x, y)
        };
        let followers = engine.body().owned().filter(|&i| engine.roles()[i] == Role::Follower);
        followers.map(|i| (i, left(i))).collect()
    }
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
        let RoleChange { particles, role, axis, when, .. } = &changes[k];
        // A particle of which one component is held follows along the other.
        let present = if axis.is_some() { Role::Follower } else { *role };
        // By a condition only those that met it.
        let is_taken = |i: usize| when.is_none() || engine.taken_by[i] as usize == k + 1;
        for &i in particles.iter().filter(|&&i| roles[i] == present && is_taken(i)) {
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
