//! The start of an engine: body, rule, roles and motions.

use std::sync::Arc;

use super::probes::ProbeSeries;
use crate::flock::action::Action;
use crate::flock::body::Body;
use crate::flock::condition::Condition;
use crate::flock::fracture::{Break, Ghosts, Threshold};
use crate::flock::law::{Flock, Weights};
use crate::flock::motion::Motion;
use crate::flock::role::Role;
use crate::flock::rules::{Axis, Rule};
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::material::free_edge::FreeEdge;
use crate::sweep::Update;

/// Everything an engine needs.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The particles and their reference positions.
    pub body: Body,
    /// The rule with neighbours, weights and loads.
    pub flock: Flock,
    /// The order and the damping of the sweep.
    pub update: Update,
    /// Radius within which neighbours are found anew at every step \[length\].
    pub present_radius: Option<f64>,
    /// Roles before the first step, shape \[count\].
    pub roles: Vec<Role>,
    /// Role changes in the order they were written.
    pub changes: Vec<RoleChange>,
    /// Bonds cut before the first step.
    pub cuts: Vec<Break>,
    /// Actions on the body while it is stepped, by ascending step.
    pub actions: Vec<Action<Arc<Conduct>>>,
    /// Between the particles, where the body has a material.
    pub cells: Option<Cells>,
    /// The material, inclusions left aside.
    pub elastic: Option<Elastic>,
    /// Forces of each load on the particles \[force\], shape \[loads\]\[count\]; their sum is the flock's.
    pub loads: Vec<Vectors>,
    /// Steps over which the loads grow; they act from the first one on where there is no ramp.
    pub ramp: Option<usize>,
    /// Of a body fitted to its outline whose rule is a material.
    pub free_edge: Option<Arc<FreeEdge>>,
    /// Histories that the engine goes on with, those of other ranks among them; only where each rank has a part of the body.
    pub probes: Option<Vec<ProbeSeries>>,
}

/// A role that some particles take.
#[derive(Clone, Debug)]
pub struct RoleChange {
    /// Indices of the particles.
    pub particles: Vec<usize>,
    /// Their new role.
    pub role: Role,
    /// The one component that is held or led while the particles follow along the other.
    pub axis: Option<Axis>,
    /// First step at which it holds.
    pub from: usize,
    /// The condition that a particle must meet as well to take the role; none where all take it.
    pub when: Option<Condition>,
    /// How leaders move; none for those led by a reference solution that is not known yet.
    pub motion: Option<Motion>,
}

impl RoleChange {
    /// A role that these particles take from a step on, with both components and without a motion.
    pub fn new(particles: Vec<usize>, role: Role, from: usize) -> Self {
        Self { particles, role, axis: None, from, when: None, motion: None }
    }

    /// Whether the particles have the role before the first step.
    pub(crate) fn is_at_once(&self) -> bool {
        self.from <= 1 && self.when.is_none()
    }
}

/// What `of` makes, for each component of each particle, of the change that gives it its role before the first step,
/// the last one that names it, shape \[count\]\[x, y\].
pub(crate) fn of_first_roles<T: Copy + Default>(
    changes: &[RoleChange],
    count: usize,
    of: impl Fn(usize, &RoleChange) -> T,
) -> Vec<[T; 2]> {
    let mut last = vec![[T::default(); 2]; count];
    for (k, change) in changes.iter().enumerate().filter(|(_, change)| change.is_at_once()) {
        for &i in &change.particles {
            match change.axis {
                None => last[i] = [of(k, change); 2],
                Some(axis) => last[i][axis as usize] = of(k, change),
            }
        }
    }
    last
}

/// How particles follow: the part of a setup that may change while a body is stepped.
#[derive(Clone, Debug)]
pub struct Conduct {
    /// The mean and the terms added to it.
    pub rule: Rule,
    /// How much each neighbour counts.
    pub weights: Weights,
    /// Sum of the loads on each particle \[force\], shape \[count\].
    pub forces: Option<Vectors>,
    /// Rest offsets \[length\], shape \[count\].
    pub rest: Option<Vectors>,
    /// Whether rest offsets keep an unloaded body in place.
    pub keeps_rest: bool,
    /// When bonds break, and what stands in for them.
    pub fracture: Option<(Option<Threshold>, Ghosts)>,
    /// The order and the damping of the sweep.
    pub update: Update,
    /// Between the particles, where the body has a material.
    pub cells: Option<Cells>,
    /// The material, inclusions left aside.
    pub elastic: Option<Elastic>,
    /// Forces of each load on the particles \[force\], shape \[loads\]\[count\].
    pub loads: Vec<Vectors>,
    /// Of a body fitted to its outline whose rule is a material.
    pub free_edge: Option<Arc<FreeEdge>>,
}

impl Setup {
    /// Particles that see each other through `flock`; those that do not follow are led from outside.
    pub fn new(body: Body, flock: Flock, roles: Vec<Role>, update: Update) -> Self {
        Self {
            body,
            flock,
            update,
            present_radius: None,
            roles,
            changes: Vec::new(),
            cuts: Vec::new(),
            actions: Vec::new(),
            cells: None,
            elastic: None,
            loads: Vec::new(),
            ramp: None,
            free_edge: None,
            probes: None,
        }
    }
}
