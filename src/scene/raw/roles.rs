//! Roles as written: the leaders, their times and motions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::RawAxis;

/// A role for the particles of a region.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawRoles {
    /// The particles that take the role.
    pub region: RawRegion,
    /// The behaviour of these particles.
    pub role: RawRole,
    /// The one component that is held or led, for rollers and planes of symmetry; the particle follows along the
    /// other. Both unless given. For the rule `material`.
    pub axis: Option<RawAxis>,
    /// First step at which the role holds [step]; 0 and 1 both mean from the start.
    #[serde(default)]
    pub from: usize,
    /// The role is taken, particle by particle, when this first holds (from step `from` on): once, and by no particle
    /// that a later entry has taken before. A run with `stop.tolerance` goes on until `from`, and no longer.
    pub when: Option<RawWhen>,
    /// How leaders move; only they do.
    pub motion: Option<RawMotion>,
}

/// The behaviour of a particle.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawRole {
    /// Takes the position the rule computes.
    Follower,
    /// Is moved by its motion.
    Leader,
    /// Stays where it is.
    Clamped,
    /// Leaves the body: all its bonds break.
    Ghost,
}

/// Picks particles by where they are in the reference configuration.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawRegion {
    /// The whole body.
    All {},
    /// The outermost particles on a side.
    Edge {
        /// The side on which the particles are outermost.
        side: RawSide,
        /// How far in from the outermost coordinate [length]. Unless given it is a flat side itself, along a fitted outline; half
        /// a spacing where that is curved; and of whole cells half a row of the lattice, or as much as rows are staggered.
        #[schemars(range(min = 0))]
        depth: Option<f64>,
    },
    /// The particles in a box.
    Box {
        /// Lower left corner [length].
        min: [f64; 2],
        /// Upper right corner [length].
        max: [f64; 2],
    },
    /// The particles in a disc.
    Disc {
        /// Centre [length].
        centre: [f64; 2],
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// The particles with these ids.
    Ids {
        /// Counted from 1, column by column from the bottom, the frame included; of a body of points, those of its
        /// file [1].
        #[schemars(length(min = 1), inner(range(min = 1)))]
        ids: Vec<usize>,
    },
    /// Every particle that lacks a neighbour: the outline, rims of holes included.
    Boundary {},
    /// A part of the outline of the body's shape, or the particles on it. `flockform plan` prints its pieces.
    Outline {
        /// The outline of this hole, counted from 1 in the order of `body.holes`; the outer one unless given [1].
        hole: Option<usize>,
        /// Numbers of its edges and arcs, counted from 1; all of them unless given. Those of a polygon begin at its
        /// vertices, those of a rectangle are bottom, right, top and left [1].
        #[serde(default)]
        #[schemars(inner(range(min = 1)))]
        pieces: Vec<usize>,
        /// Of arcs alone: between these directions from their centres, counter-clockwise [degree].
        angles: Option<[f64; 2]>,
        /// Instead of all of the above: from the place of the outline nearest to the first point to that nearest to
        /// the second, the shorter way [length].
        between: Option<[[f64; 2]; 2]>,
    },
}

/// A side of the body.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawSide {
    /// Lowest x.
    Left,
    /// Highest x.
    Right,
    /// Lowest y.
    Bottom,
    /// Highest y.
    Top,
}

/// A condition on one particle.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawWhen {
    /// The quantity that is compared with the bounds.
    pub quantity: RawQuantity,
    /// Holds above this value [unit of the quantity].
    pub above: Option<f64>,
    /// Holds below this value [unit of the quantity].
    pub below: Option<f64>,
}

/// The quantity that a condition tests.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawQuantity {
    /// Present x [length].
    X,
    /// Present y [length].
    Y,
    /// Distance from the place in the reference configuration [length].
    Displacement,
    /// First pseudo-energy [length^2].
    Pe1,
    /// Length of the last move [length].
    Pe2,
}

/// How leaders move; steps are counted from when they became leaders, displacements from where they stood then.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawMotion {
    /// The same displacement every step.
    Velocity {
        /// Way in each step [length per step].
        per_step: [f64; 2],
    },
    /// Displacements at given steps; the last one is held.
    Keyframes {
        /// Places by ascending step.
        #[schemars(length(min = 1))]
        frames: Vec<RawKeyframe>,
        /// How the motion goes from one keyframe to the next; straight unless given.
        #[serde(default)]
        interpolation: RawInterpolation,
    },
    /// Rotation, stretch and shear about a point, reached in even parts over a number of steps.
    Affine {
        /// The point that stays [length].
        #[serde(default)]
        about: [f64; 2],
        /// Rotation, applied after stretch and shear [degree].
        #[serde(default)]
        rotate: f64,
        /// Factors along x and y [1].
        #[serde(default = "super::defaults::ones")]
        stretch: [f64; 2],
        /// Shear: x moves with y, and y moves with x [1].
        #[serde(default)]
        shear: [f64; 2],
        /// Steps to get there [step].
        #[schemars(range(min = 1))]
        steps: usize,
    },
    /// To and fro.
    Sinusoid {
        /// Largest displacement from the middle of the motion. With a phase the motion begins away from the middle, and gets
        /// up to twice as far from there [length].
        amplitude: [f64; 2],
        /// Time of one oscillation [step].
        #[schemars(extend("exclusiveMinimum" = 0))]
        period: f64,
        /// Part of a period by which the motion is ahead [1].
        #[serde(default)]
        phase: f64,
    },
    /// Displacements read from a CSV file with the columns `x,y,ux,uy` (matched to particles by their
    /// reference position) or `id,ux,uy`, reached in even parts over a number of steps.
    Csv {
        /// Path, relative to the scene file.
        file: String,
        /// Multiplies every displacement [1].
        #[serde(default = "super::defaults::one")]
        scale: f64,
        /// Steps to get there [step].
        #[serde(default = "super::defaults::one_step")]
        #[schemars(range(min = 1))]
        steps: usize,
    },
    /// To where finite elements have these particles in the scene's material under its loads, reached in
    /// even parts over a number of steps. The rest of the body can then be held against the same truth.
    Reference {
        /// Steps to get there [step].
        #[serde(default = "super::defaults::one_step")]
        #[schemars(range(min = 1))]
        steps: usize,
    },
}

/// Where a leader is at a step.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawKeyframe {
    /// When it is there [step].
    #[schemars(range(min = 1))]
    pub step: usize,
    /// From where it stood when it became a leader, which is its place in the body for leaders from the start [length].
    pub displacement: [f64; 2],
}

/// How a motion goes from one keyframe to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawInterpolation {
    /// At constant velocity.
    #[default]
    Linear,
    /// At rest at each keyframe.
    Smooth,
    /// Jumps.
    Hold,
}
