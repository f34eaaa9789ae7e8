//! The rule as written: whose positions count, how a target comes from them, how it becomes a position.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The neighbours whose positions enter the rule of a particle.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawNeighbours {
    /// The first neighbours: as many as the lattice's coordination number (square and rectangular 4,
    /// centred rectangular, hexagonal and oblique 6, honeycomb 3).
    First {
        /// Keeps only this many, dropping from the end of: nearest first; equally near ones in
        /// opposite pairs by angle (east, west, north, south of the lattice as it is before it is turned) [1].
        #[schemars(range(min = 1))]
        keep: Option<usize>,
    },
    /// All sites within `radius` cells each way: 8 or 24.
    Chebyshev {
        /// Cells each way [1].
        #[schemars(range(min = 1, max = 8))]
        radius: i32,
    },
    /// All particles that share a cell of the lattice, as a material needs: 8 on square and rectangular
    /// lattices, 6 on the triangular ones, 12 on the honeycomb.
    Cells {},
    /// The neighbours of the neighbours too: the paper's second gradient.
    Second {},
    /// The first neighbours and the sites behind them, twice as far in the same directions: what
    /// `rule.weights.kind = "gradient"` needs. The honeycomb has no such sites.
    Collinear {},
    /// The sites at these offsets in columns and rows of the lattice.
    Offsets {
        /// Pairs of whole numbers, none twice, in the order of summation.
        #[schemars(length(min = 1), inner(inner(range(min = -1000, max = 1000))))]
        offsets: Vec<[i32; 2]>,
    },
    /// All particles within a radius in the reference configuration.
    Within {
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// All particles within a radius now, found anew at every step: the paper's liquid and gas.
    Dynamic {
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
}

/// How a follower's position comes from its neighbours'; what is not named is not evaluated.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawRule {
    /// The centre of gravity unless given.
    pub mean: Option<RawMean>,
    /// Fixed weights of the neighbours, on top of the mean's own.
    pub weights: Option<RawWeights>,
    /// The correction that keeps a particle with unbalanced neighbours in place.
    pub rest: RawRest,
    /// The Poisson term (Eq. 2).
    pub poisson: Option<RawPoisson>,
    /// Feedback (Eq. 4).
    pub feedback: Option<RawFeedback>,
}

/// Which mean of the neighbours' positions is the target.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawMean {
    /// The centre of gravity (Eq. 1).
    Barycentre,
    /// Weighted by a power of the present distance (Eq. 3).
    Distance {
        /// The power; the paper's is 1 [1].
        #[serde(default = "super::defaults::one")]
        power: f64,
    },
    /// The geometric mean of each coordinate.
    Geometric {
        /// The origin of the coordinates; moves with the neighbours unless given.
        #[serde(default)]
        origin: RawOrigin,
    },
    /// The power mean of each coordinate.
    Power {
        /// Exponent: 1 is the barycentre, 2 the quadratic mean, -1 the harmonic mean [1].
        exponent: f64,
        /// The origin of the coordinates; moves with the neighbours unless given.
        #[serde(default)]
        origin: RawOrigin,
    },
    /// The median of each coordinate: outliers among the neighbours do not move it, and one leader among followers is an
    /// outlier too (ours).
    Median,
    /// The mean of the places at a distance from each neighbour: cohesion with separation (ours).
    Spaced {
        /// The distance [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        spacing: f64,
        /// Power of the present distance that weighs the neighbours; well below 0 the nearest have the
        /// say and particles do not crowd [1].
        #[serde(default)]
        power: f64,
    },
    /// Weighted by 2x2 matrices that make the body the scene's `[material]`. Free edges need no frame.
    Material {
        /// Which turns of the body cost nothing; small ones unless given.
        #[serde(default)]
        rotation: RawRotation,
    },
}

/// Which turns of the body cost a material nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawRotation {
    /// Small ones, to first order.
    #[default]
    Small,
    /// All: each particle works in axes that turn with its neighbours.
    Corotated,
}

/// The origin of the coordinates in geometric and power means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawOrigin {
    /// One spacing below the lowest neighbour: invariant under translation.
    #[default]
    Moving,
    /// The axes' zero: the literal formula, which depends on where the body is. A particle does not move along an axis on
    /// which a neighbour has a negative coordinate.
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
    /// Such that each particle's neighbours reproduce its place (ours): where leaders are stretched, sheared,
    /// turned or moved as a whole, the followers are exactly so too, at the edge as inside. As near to
    /// equal ones as that allows; negative only where it has to be.
    Solved {},
    /// A second gradient of prescribed length (ours): the weights of the sites behind the first
    /// neighbours are negative. Needs `neighbours.kind = "collinear"`.
    Gradient {
        /// Decay length of a boundary layer along a row of bonds: what is clamped or loaded at an edge
        /// dies off as `exp(-distance / length)`. At least 0.38 of the spacing on a square lattice; on
        /// others a refusal names the least [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        length: f64,
    },
}

/// Whether the reference configuration is one of rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawRest {
    /// Each particle adds the offset that keeps it in place while its neighbours are in theirs. Zero
    /// for a complete neighbourhood; neighbours that are found anew at every step have none.
    #[default]
    Balanced,
    /// The formula alone: a body with missing or unbalanced neighbours draws together.
    Literal,
}

/// A coordinate axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawAxis {
    /// The x axis.
    #[default]
    X,
    /// The y axis.
    Y,
}

/// The Poisson term (Eq. 2): `across += K (along - along at rest) da`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPoisson {
    /// Response `K`; negative draws the sides together where particles move along the axis, and apart where they move
    /// against it [1].
    pub k: f64,
    /// The axis whose displacement acts.
    #[serde(default)]
    pub axis: RawAxis,
    /// Coordinate of the central axis [length]; the middle of the body unless given.
    pub centre: Option<f64>,
    /// `da = sign(s) |s / half width|^exponent`, `s` being the distance from the axis: 1 is linear, 0 the
    /// sign alone [1].
    #[serde(default = "super::defaults::one")]
    #[schemars(range(min = 0))]
    pub exponent: f64,
}

/// Feedback (Eq. 4): the target is overshot.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawFeedback {
    /// Feedback factor `fd` [1].
    pub factor: f64,
    /// The position `MT` in Eq. 4.
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
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawUpdate {
    /// The order of updates within one step; all at once unless given.
    pub order: RawOrder,
    /// Part of the way to the target that is gone in one step [1]. Unless given, 1; swept synchronously, for the rule `material`, weights of
    /// kind `gradient` and negative ones of kind `solved` nine tenths of the most at which nothing overshoots and grows, for means by a power of the
    /// distance above 0 half or 1 / (1 + power), and half for `spaced` ones with a power.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 2))]
    pub damping: Option<f64>,
}

/// The order of updates within one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawOrder {
    /// All particles use the old positions (the paper).
    #[default]
    Synchronous,
    /// Each uses the new positions of the particles numbered before it, and of all leaders, which move first. A body of points is
    /// numbered anew for this, by place: in columns along the shorter side of its bounds, each from its lower end.
    Sequential,
}
