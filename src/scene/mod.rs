//! A scene file becomes a validated [`Scene`]: complete, in radians and steps, with every key checked.
//!
//! [`document`] reads TOML and overrides and checks every key against the JSON Schema of
//! [`raw::RawScene`]; [`validate`] turns the raw scene into this one. Errors name file, line, key, value
//! and remedy. Conditions that need the body itself (whether a region is empty, say) are checked by the
//! plan, which reports through [`Scene::refuse`] in the same form.

pub mod bundled;
pub mod document;
#[cfg(feature = "live")]
mod files;
pub mod points;
pub mod raw;
mod rows;
pub mod swarm;
pub mod table;
pub mod text;
pub mod units;
pub mod validate;

use std::sync::Arc;

use crate::flock::action::Action;
use crate::flock::body::Cut;
use crate::flock::cloud::Cloud;
use crate::flock::condition::Condition;
use crate::flock::fracture::{Ghosts, Threshold};
use crate::flock::frame::FrameRule;
use crate::flock::lattice::Lattice;
use crate::flock::motion::Motion;
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::region::{Region, Side};
use crate::flock::role::Role;
use crate::flock::rules::{Axis, Feedback, Mean, Rotation};
use crate::geometry::portion::Selection;
use crate::geometry::shape::{Segment, Shape};
use crate::material::elastic::Elastic;
use crate::material::outline_loads::{Profile, Push};
use crate::solve::equilibrium::Request;
use crate::sweep::Update;

pub use bundled::{Bundled, bundled};
pub use document::Document;
use document::find;
pub use document::problem::{Place, Problem, SceneError};
use raw::RawScene;
pub use raw::{RawRecord as Record, RawStop as Stop};
pub use validate::actions::{MOST_ACTIONS, is_changeable};

/// A continuum scene, ready to be planned.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name: the bundled scene's, or the file's without its ending.
    pub name: String,
    /// The scene as written, overrides and defaults included.
    pub raw: RawScene,
    /// Of a body of points a lattice that is as wide, which stands in for its spacing alone.
    pub lattice: Lattice,
    /// Where the particles come from.
    pub body: BodySource,
    /// Whether the body keeps the outline of its shape.
    pub is_fitted: bool,
    /// How frame points follow the body; none without a frame.
    pub frame: Option<FrameRule>,
    /// Which others a particle sees.
    pub neighbourhood: Neighbourhood,
    /// The mean of the neighbours' positions that is the target.
    pub mean: Mean,
    /// Fixed weights of the neighbours, on top of the mean's own; all equal where there are none.
    pub weights: Option<Weights>,
    /// Whether particles with unbalanced neighbours are kept in place at rest.
    pub keeps_rest: bool,
    /// The effect of a pull along one axis across it (Eq. 2).
    pub poisson: Option<PoissonTerm>,
    /// The step beyond the target (Eq. 4).
    pub feedback: Option<Feedback>,
    /// The order and the damping of the sweep.
    pub update: Update,
    /// The material of the body, if the scene gives one.
    pub material: Option<Elastic>,
    /// Parts of the body that are of another material; the later one counts where they overlap.
    pub inclusions: Vec<Inclusion>,
    /// Loads on the body, in the order of the file.
    pub loads: Vec<Load>,
    /// Roles in the order in which they are written; of those of one step the later one wins.
    pub roles: Vec<RoleEntry>,
    /// When bonds break and what stands in for them; none where the scene does not say.
    pub fracture: Option<Fracture>,
    /// Ends of each cut \[length\].
    pub cuts: Vec<Segment>,
    /// Everything that is done to the body while it is stepped, by ascending step; where particles follow otherwise, as
    /// those of a scene that differs in nothing else.
    pub actions: Vec<Action<Box<Scene>>>,
    /// When the run ends.
    pub stop: Stop,
    /// How the equilibrium is found, where the scene is not stepped.
    pub equilibrium: Option<Equilibrium>,
    /// In which parts loads and motions come, where the scene says so.
    pub load_steps: Option<LoadSteps>,
    /// The parts of the run that are recorded.
    pub record: Record,
    document: Document,
}

impl Scene {
    /// The error that refuses this scene for what stands at `key`.
    pub fn refuse(&self, key: &str, message: impl Into<String>, help: impl Into<String>) -> SceneError {
        SceneError::from(self.document.problem(key, message, Some(help.into())))
    }

    /// The regions of roles, and of loads that have one, each with its key.
    pub(crate) fn regions(&self) -> impl Iterator<Item = (String, &SceneRegion)> {
        let of_roles = self.roles.iter().map(|entry| &entry.region).enumerate();
        let of_loads = self.loads.iter().enumerate().filter_map(|(k, load)| match load {
            Load::Outline { region, .. } | Load::Force { region, .. } => Some((k, region)),
            Load::Body { .. } => None,
        });
        let named = |of: &'static str| move |(k, region)| (format!("{of}[{k}].region"), region);
        of_roles.map(named("roles")).chain(of_loads.map(named("loads")))
    }

    /// Refuses a scene that has no equilibrium but the one that it comes to by steps.
    ///
    /// # Errors
    /// Names the key.
    #[cfg(feature = "python")]
    pub(crate) fn require_stepless(&self) -> Result<(), SceneError> {
        validate::equilibrium::check(&self.raw, &|key, message, help| self.refuse(key, message, help))
    }

    /// The first key of a region, if any, that picks particles by their ids.
    pub fn picks_by_ids(&self) -> Option<String> {
        let by_ids = |region: &SceneRegion| matches!(region, SceneRegion::Known(Region::Ids(_)));
        self.regions().find(|(_, region)| by_ids(region)).map(|(key, _)| key)
    }

    /// Which role entry, if any, first leads particles to where finite elements have them.
    pub(crate) fn led_by_reference(&self) -> Option<usize> {
        self.roles.iter().position(|entry| matches!(entry.motion, Some(LeaderMotion::Reference { .. })))
    }

    /// Which of the materials of the body sees farthest.
    pub(crate) fn farthest_seeing(&self) -> Option<&Elastic> {
        farthest_seeing(self.material.as_ref(), &self.inclusions)
    }

    /// The factor by which feedback enlarges each update, as a damping above 1 would \[1\].
    pub(crate) fn over_relaxation(&self) -> f64 {
        self.feedback.map_or(1.0, |feedback| feedback.over_relaxation())
    }

    /// Which turns of the body are no strain.
    pub fn rotation(&self) -> Rotation {
        self.mean.rotation()
    }

    /// Whether the body was given as points instead of cut from a lattice.
    pub(crate) fn is_of_points(&self) -> bool {
        matches!(self.body, BodySource::Points(_))
    }

    /// The unit in which a run counts: `increment` if it solves one part of the load after the other, else `step`.
    pub fn counts(&self) -> &'static str {
        match self.load_steps {
            Some(LoadSteps::Solved(_)) => "increment",
            _ => "step",
        }
    }

    /// Steps, or increments, that a run takes at most.
    pub fn most_steps(&self) -> usize {
        match &self.load_steps {
            Some(LoadSteps::Solved(parts)) => parts.len(),
            _ => self.stop.steps,
        }
    }

    /// Whether a key that is given takes whole numbers alone.
    pub fn takes_whole_numbers(&self, key: &str) -> bool {
        let raw = serde_json::to_value(&self.raw).unwrap_or_default();
        find(&raw, key).is_some_and(|value| value.is_u64() || value.is_i64())
    }

    /// Whether its equilibrium is solved for without states in between.
    pub fn is_solved_at_once(&self) -> bool {
        self.equilibrium.is_some() && self.load_steps.is_none()
    }

    /// The unit of length, for axes and tables.
    pub fn unit(&self) -> &str {
        &self.raw.unit
    }
}

/// Of what a body and its inclusions are made of: what needs neighbours that are farthest away.
fn farthest_seeing<'a>(body: Option<&'a Elastic>, inclusions: &'a [Inclusion]) -> Option<&'a Elastic> {
    let mut all = body.into_iter().chain(inclusions.iter().map(|part| &part.material));
    all.find(|elastic| elastic.averaged().is_some()).or(body)
}

/// Where the particles of the body come from.
#[derive(Clone, Debug, PartialEq)]
pub enum BodySource {
    /// Cut from the lattice.
    Cut(Cut),
    /// Given one by one.
    Points(Arc<Cloud>),
}

/// A part of the body that is of another material.
#[derive(Clone, Debug, PartialEq)]
pub struct Inclusion {
    /// Which part.
    pub shape: Shape,
    /// Its material, with the body's plane and thickness.
    pub material: Elastic,
}

/// Fixed weights of neighbours.
#[derive(Clone, Debug, PartialEq)]
pub enum Weights {
    /// One for each neighbour, in the neighbourhood's order.
    List(Vec<f64>),
    /// A power of the reference distance.
    Distance {
        /// The power of the distance \[1\].
        power: f64,
    },
    /// Such that each particle's neighbours reproduce its place.
    Solved,
    /// A second gradient whose boundary layers have this decay length \[length\].
    Gradient {
        /// Decay length of a boundary layer along a row of bonds \[length\].
        length: f64,
    },
}

/// The Poisson term (Eq. 2) before the body's width is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoissonTerm {
    /// Response `K` \[1\]; negative draws the sides together where particles move along the axis, else apart.
    pub k: f64,
    /// The axis whose displacement acts.
    pub axis: Axis,
    /// Coordinate of the central axis \[length\]; the middle of the body where `None`.
    pub centre: Option<f64>,
    /// Exponent of the distance from the axis \[1\]: 1 is linear, 0 its sign alone.
    pub exponent: f64,
}

/// Something that pushes the body.
#[derive(Clone, Debug, PartialEq)]
pub enum Load {
    /// On the part of the outline in the region; stresses \[force / length^2\].
    Outline {
        /// Where the load acts.
        region: SceneRegion,
        /// The load there.
        push: Push,
        /// How it varies along a line; the same everywhere where there is none.
        profile: Option<Profile>,
    },
    /// On each particle of the region \[force\].
    Force {
        /// Which particles it pushes.
        region: SceneRegion,
        /// On each of them, along x and y.
        force: [f64; 2],
    },
    /// On all of the body \[force / length^3\].
    Body {
        /// Along x and y.
        force: [f64; 2],
    },
}

/// A role for the particles of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct RoleEntry {
    /// Which particles take the role.
    pub region: SceneRegion,
    /// Their new role.
    pub role: Role,
    /// The one component that is held or led; both where `None`.
    pub axis: Option<Axis>,
    /// First step at which it holds.
    pub from: usize,
    /// The condition that a particle must meet as well to take the role; none where all take it.
    pub when: Option<Condition>,
    /// How leaders move; none for other roles.
    pub motion: Option<LeaderMotion>,
}

/// A region before the lattice's spacing has set what it leaves open.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneRegion {
    /// A region that names all of its own bounds.
    Known(Region),
    /// The outermost particles on a side, as deep as the body has them.
    Outermost(Side),
    /// A part of the outline of the shape, and the particles on it.
    Outline(Selection),
}

/// How leaders move.
#[derive(Clone, Debug, PartialEq)]
pub enum LeaderMotion {
    /// The same program for every leader.
    Program(Motion),
    /// Displacements read from a file, reached in even parts over `steps`.
    Table {
        /// The rows of the file.
        rows: table::DisplacementTable,
        /// Steps to get there.
        steps: usize,
    },
    /// To where finite elements have the particles, in even parts over `steps`.
    Reference {
        /// Steps to get there.
        steps: usize,
    },
}

/// When bonds break and what stands in for them; without a threshold none breaks by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fracture {
    /// How long a bond may become.
    pub threshold: Option<Threshold>,
    /// The substitute for neighbours that are lost.
    pub ghosts: Ghosts,
}

/// How the equilibrium is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equilibrium {
    /// Solver, tolerance and precision.
    pub request: Request,
    /// Relative error of the followers' displacements that is asked for \[1\].
    pub accuracy: Option<f64>,
}

/// In which parts loads and leaders' motions come.
#[derive(Clone, Debug, PartialEq)]
pub enum LoadSteps {
    /// Each part solved to equilibrium: parts of the whole, from 0 to 1, in their order \[1\].
    Solved(Vec<f64>),
    /// The loads grow over `ramp` steps of the sweep, or act from the first one on; a row is kept `every` so many.
    Stepped {
        /// Steps over which the loads grow; none where they act from the first one on.
        ramp: Option<usize>,
        /// Steps from one row of the response to the next.
        every: usize,
    },
}
