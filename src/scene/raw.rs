//! A scene file as written: what serde reads and the JSON Schema describes.
//!
//! Lengths are in one unit of the user's choice (`[length]`), the same throughout a scene; times are
//! in steps; angles in degrees. The doc comments here are the documentation of the scene format:
//! `flockform schema` prints them.

// Units stand in brackets as they are: the schema prints these comments, which escapes would spoil.
#![allow(rustdoc::broken_intra_doc_links)]

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A continuum scene: a body, who leads it, by which rule it follows, when it stops and what to keep.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawScene {
    /// One line that says what the scene shows.
    pub title: String,
    /// Where the values come from, and why those the paper does not give were chosen.
    #[serde(default)]
    pub notes: String,
    /// Name of the unit of length, for axes and tables.
    #[serde(default = "defaults::unit")]
    pub unit: String,
    pub lattice: RawLattice,
    pub body: RawBody,
    /// The shell around the body that gives edge particles their full neighbourhood.
    #[serde(default)]
    pub frame: RawFrame,
    #[serde(default)]
    pub neighbours: RawNeighbours,
    #[serde(default)]
    pub rule: RawRule,
    #[serde(default)]
    pub update: RawUpdate,
    /// Who is what, from when; later entries win. Particles that no entry names are followers.
    #[serde(default)]
    pub roles: Vec<RawRoles>,
    /// Bonds break where this is given.
    #[serde(default)]
    pub fracture: Option<RawFracture>,
    /// Cuts made before the first step: every bond that crosses one is broken.
    #[serde(default)]
    pub cuts: Vec<RawCut>,
    #[serde(default)]
    pub stop: RawStop,
    #[serde(default)]
    pub record: RawRecord,
}

/// The five plane Bravais lattices and the honeycomb.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawLattice {
    Square {
        /// Distance between neighbours [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        spacing: f64,
        /// Turns the lattice against the body [degree].
        #[serde(default)]
        orientation: f64,
    },
    Rectangular {
        /// Edge of the cell along x [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        a: f64,
        /// Edge of the cell along y [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        b: f64,
        /// Turns the lattice against the body [degree].
        #[serde(default)]
        orientation: f64,
    },
    /// A site at each corner of the cell and one at its centre.
    CentredRectangular {
        /// Edge of the conventional cell along x [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        a: f64,
        /// Edge of the conventional cell along y [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        b: f64,
        /// Turns the lattice against the body [degree].
        #[serde(default)]
        orientation: f64,
    },
    /// Triangles; one bond direction lies along x.
    Hexagonal {
        /// Distance between neighbours [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        spacing: f64,
        /// Turns the lattice against the body [degree].
        #[serde(default)]
        orientation: f64,
    },
    Oblique {
        /// Edge of the cell along x [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        a: f64,
        /// The other edge of the cell [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        b: f64,
        /// Angle between the edges [degree].
        #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 180))]
        angle: f64,
        /// Turns the lattice against the body [degree].
        #[serde(default)]
        orientation: f64,
    },
    /// Hexagons; three neighbours each.
    Honeycomb {
        /// Distance between neighbours [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        spacing: f64,
        /// Turns the lattice against the body [degree].
        #[serde(default)]
        orientation: f64,
    },
}

/// The body that is cut from the lattice.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawBody {
    pub shape: RawShape,
    /// Shapes taken out of the body; particles on their rims stay.
    #[serde(default)]
    pub holes: Vec<RawShape>,
    /// Where the lattice has a site [length]. Unless given: the lower left corner of the shape's
    /// bounds, or the centre of a disc.
    #[serde(default)]
    pub anchor: Option<[f64; 2]>,
}

/// A region of the plane; its boundary belongs to it.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawShape {
    /// A rectangle by count, from the anchor (which is then [0, 0] unless given).
    Grid {
        /// Sites in a row [1].
        #[schemars(range(min = 1, max = 65535))]
        columns: u32,
        /// Rows of sites [1].
        #[schemars(range(min = 1, max = 65535))]
        rows: u32,
    },
    Rectangle {
        /// Lower left corner [length].
        #[serde(default)]
        min: [f64; 2],
        /// Upper right corner [length].
        max: [f64; 2],
    },
    Disc {
        /// Centre [length].
        #[serde(default)]
        centre: [f64; 2],
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    Polygon {
        /// Corners in order, either way round; the last joins the first [length].
        #[schemars(length(min = 3))]
        vertices: Vec<[f64; 2]>,
    },
    /// The sheet-type tensile specimen of ASTM E8/E8M (200 x 20 mm, gauge 57 x 12.5 mm, fillet 12.5 mm),
    /// its axis along y from y = 0, centred on x = 0.
    E8Sheet {
        /// Multiplies every length of the standard [1].
        #[serde(default = "defaults::one")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        scale: f64,
        /// Lays the axis along x instead.
        #[serde(default)]
        lying: bool,
    },
    /// The Type I tensile specimen of ASTM D638 (165 x 19 mm, gauge 57 x 13 mm, fillet 76 mm), its axis
    /// along y from y = 0, centred on x = 0.
    D638TypeI {
        /// Multiplies every length of the standard [1].
        #[serde(default = "defaults::one")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        scale: f64,
        /// Lays the axis along x instead.
        #[serde(default)]
        lying: bool,
    },
}

/// How frame points follow the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawFrame {
    /// No frame: edge particles have fewer neighbours.
    #[default]
    None,
    /// A frame point copies the displacement its particle had before the sweep (the paper's delay).
    Lagged,
    /// A frame point copies the displacement its particle has after the sweep.
    Immediate,
    /// A frame point copies the particle opposite across its nearest one, as if the body went on.
    Mirror,
}

/// Whose positions a particle sees.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawNeighbours {
    /// The first neighbours: as many as the lattice's coordination number (square and rectangular 4,
    /// centred rectangular, hexagonal and oblique 6, honeycomb 3).
    First {
        /// Keeps only this many, dropping from the end of: nearest first; equally near ones in
        /// opposite pairs by angle (east, west, north, south) [1].
        #[serde(default)]
        #[schemars(range(min = 1))]
        keep: Option<usize>,
    },
    /// All sites within `radius` cells each way: 8 or 24.
    Ring {
        /// Cells each way [1].
        #[schemars(range(min = 1, max = 8))]
        radius: i32,
    },
    /// The neighbours of the neighbours too: the paper's second gradient.
    Second {},
    /// The sites at these offsets in columns and rows of the lattice.
    Offsets {
        /// Pairs of whole numbers, in the order of summation.
        #[schemars(length(min = 1))]
        offsets: Vec<[i32; 2]>,
    },
    /// Whoever is within a radius in the reference configuration.
    Within {
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// Whoever is within a radius now, found anew at every step: the paper's liquid and gas.
    Present {
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
}

impl Default for RawNeighbours {
    fn default() -> Self {
        RawNeighbours::First { keep: None }
    }
}

/// How a follower's position comes from its neighbours'; what is not named is not evaluated.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawRule {
    #[serde(default)]
    pub mean: RawMean,
    /// Fixed weights of the neighbours, on top of the mean's own.
    #[serde(default)]
    pub weights: Option<RawWeights>,
    /// What keeps a particle in place whose neighbours are not balanced around it.
    #[serde(default)]
    pub rest: RawRest,
    /// The Poisson term (Eq. 2).
    #[serde(default)]
    pub poisson: Option<RawPoisson>,
    /// Feedback (Eq. 4).
    #[serde(default)]
    pub feedback: Option<RawFeedback>,
}

/// Which mean of the neighbours' positions is the target.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawMean {
    /// The centre of gravity (Eq. 1).
    #[default]
    Barycentre,
    /// Weighted by a power of the present distance (Eq. 3).
    Distance {
        /// The power; the paper's is 1 [1].
        #[serde(default = "defaults::one")]
        power: f64,
    },
    /// The geometric mean of each coordinate.
    Geometric {
        #[serde(default)]
        origin: RawOrigin,
    },
    /// The power mean of each coordinate.
    Power {
        /// Exponent: 1 is the barycentre, 2 the quadratic mean, -1 the harmonic mean [1].
        exponent: f64,
        #[serde(default)]
        origin: RawOrigin,
    },
    /// The mean of the places at a distance from each neighbour: cohesion with separation (ours).
    Spaced {
        /// The distance [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        spacing: f64,
    },
}

/// What the coordinates of geometric and power means are measured from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawOrigin {
    /// One spacing below the lowest neighbour: invariant under translation.
    #[default]
    Moving,
    /// The axes' zero: the literal formula, which depends on where the body is and needs positive
    /// coordinates.
    World,
}

/// Fixed weights of neighbours.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawWeights {
    /// A weight for each neighbour in the neighbourhood's order.
    List {
        /// As many as there are neighbours [1].
        #[schemars(length(min = 1))]
        values: Vec<f64>,
    },
    /// A power of the distance in the reference configuration.
    Distance {
        /// The power [1].
        power: f64,
    },
}

/// Whether the reference configuration is one of rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawRest {
    /// Each particle adds the offset that keeps it in place while its neighbours are in theirs. Zero
    /// for a complete neighbourhood.
    #[default]
    Kept,
    /// The formula alone: a body with missing or unbalanced neighbours draws together.
    Literal,
}

/// A coordinate axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawAxis {
    #[default]
    X,
    Y,
}

/// The Poisson term (Eq. 2): `across += K (along - along at rest) da`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPoisson {
    /// Response `K`; negative draws the sides together when pulled [1].
    pub k: f64,
    /// The axis whose displacement acts.
    #[serde(default)]
    pub pull: RawAxis,
    /// Coordinate of the central axis [length]; the middle of the body unless given.
    #[serde(default)]
    pub centre: Option<f64>,
    /// `da = sign(s) |s / half width|^exponent`, `s` being the distance from the axis: 1 is linear, 0 the
    /// sign alone [1].
    #[serde(default = "defaults::one")]
    #[schemars(range(min = 0))]
    pub exponent: f64,
}

/// Feedback (Eq. 4): the target is overshot.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawFeedback {
    /// Feedback factor `fd` [1].
    pub factor: f64,
    /// What `MT` is.
    #[serde(default)]
    pub reference: RawFeedbackReference,
}

/// The position that feedback overshoots from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawFeedbackReference {
    /// The position in the reference configuration (the paper's).
    #[default]
    Initial,
    /// The position before the step: over-relaxation.
    Previous,
}

/// How targets become positions.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawUpdate {
    #[serde(default)]
    pub order: RawOrder,
    /// Part of the way to the target that is gone in one step [1].
    #[serde(default = "defaults::one")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 2))]
    pub damping: f64,
}

impl Default for RawUpdate {
    fn default() -> Self {
        Self { order: RawOrder::default(), damping: defaults::one() }
    }
}

/// Who sees whose new position within one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawOrder {
    /// Everybody sees the old ones (the paper).
    #[default]
    Synchronous,
    /// Each sees the new ones of the particles numbered before it.
    Sequential,
}

/// A role for the particles of a region.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawRoles {
    pub region: RawRegion,
    pub role: RawRole,
    /// First step at which the role holds [step]; 0 and 1 both mean from the start.
    #[serde(default)]
    pub from: usize,
    /// The role is taken, particle by particle, when this first holds (from step `from` on).
    #[serde(default)]
    pub when: Option<RawWhen>,
    /// How leaders move; only they do.
    #[serde(default)]
    pub motion: Option<RawMotion>,
}

/// What a particle does.
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
        side: RawSide,
        /// How far in from the outermost coordinate [length]; half a spacing unless given.
        #[serde(default)]
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
    Disc {
        /// Centre [length].
        centre: [f64; 2],
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// The particles with these ids.
    Ids {
        /// Counted from 1, column by column from the bottom, the frame included [1].
        #[schemars(length(min = 1))]
        ids: Vec<usize>,
    },
    /// Every particle that lacks a neighbour: the outline, rims of holes included.
    Boundary {},
}

/// A side of the body.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawSide {
    Left,
    Right,
    Bottom,
    Top,
}

/// A condition on one particle.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawWhen {
    pub quantity: RawQuantity,
    /// Holds above this value [unit of the quantity].
    #[serde(default)]
    pub above: Option<f64>,
    /// Holds below this value [unit of the quantity].
    #[serde(default)]
    pub below: Option<f64>,
}

/// What a condition looks at.
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

/// How leaders move; steps are counted from when they became leaders.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawMotion {
    /// The same displacement every step.
    Velocity {
        /// [length per step]
        per_step: [f64; 2],
    },
    /// Displacements at given steps; the last one is held.
    Keyframes {
        #[schemars(length(min = 1))]
        frames: Vec<RawKeyframe>,
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
        #[serde(default = "defaults::ones")]
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
        /// [length]
        amplitude: [f64; 2],
        /// [step]
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
        #[serde(default = "defaults::one")]
        scale: f64,
        /// Steps to get there [step].
        #[serde(default = "defaults::one_step")]
        #[schemars(range(min = 1))]
        steps: usize,
    },
}

/// Where a leader is at a step.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawKeyframe {
    /// [step]
    #[schemars(range(min = 1))]
    pub step: usize,
    /// [length]
    pub displacement: [f64; 2],
}

/// How a motion goes from one keyframe to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawInterpolation {
    #[default]
    Linear,
    /// At rest at each keyframe.
    Smooth,
    /// Jumps.
    Hold,
}

/// When bonds break, and what stands in for them.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawFracture {
    /// A bond longer than this breaks: the paper's `df` [length].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub distance: Option<f64>,
    /// A bond longer than this multiple of its reference length breaks [1].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 1))]
    pub stretch: Option<f64>,
    #[serde(default)]
    pub ghosts: RawGhosts,
}

/// What a particle sees in the place of a lost neighbour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawGhosts {
    /// A point at the original lattice offset: fragments recover the lattice's shape.
    #[default]
    Lattice,
    /// The mirror image of the opposite neighbour.
    Mirrored,
    /// Nothing: the mean runs over those left.
    None,
}

/// A straight cut.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawCut {
    /// One end [length].
    pub from: [f64; 2],
    /// The other end [length].
    pub to: [f64; 2],
}

/// When the run ends.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawStop {
    /// At the latest after this many steps [step].
    #[serde(default = "defaults::steps")]
    #[schemars(range(min = 1))]
    pub steps: usize,
    /// As soon as no particle moves farther in a step than this part of the spacing, every scheduled
    /// motion and role change being over [1].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: Option<f64>,
    /// The run has diverged once a particle is farther from its reference place than this many times
    /// the body's diagonal [1].
    #[serde(default = "defaults::growth")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub growth: f64,
}

impl Default for RawStop {
    fn default() -> Self {
        Self { steps: defaults::steps(), tolerance: None, growth: defaults::growth() }
    }
}

/// What is kept of the run.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawRecord {
    /// Ids of the particles whose coordinates and pseudo-energies are kept at every step.
    #[serde(default)]
    pub probes: Vec<usize>,
    /// Steps at which the configuration is drawn (the last step always is) [step].
    #[serde(default)]
    pub figures: Vec<usize>,
    /// Every so many steps the configuration is written for ParaView; 0 writes none [step].
    #[serde(default)]
    pub vtk_every: usize,
}

mod defaults {
    pub fn unit() -> String {
        "length".into()
    }
    pub fn one() -> f64 {
        1.0
    }
    pub fn ones() -> [f64; 2] {
        [1.0, 1.0]
    }
    pub fn one_step() -> usize {
        1
    }
    pub fn steps() -> usize {
        1000
    }
    pub fn growth() -> f64 {
        1000.0
    }
}
