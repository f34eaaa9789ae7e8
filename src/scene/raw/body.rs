//! The body as written: its lattice and its shape, or its points.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::RawMaterial;

/// The five plane Bravais lattices and the honeycomb.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawLattice {
    /// Bonds of one length at right angles.
    Square {
        /// Distance between neighbours [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        spacing: f64,
        /// Turns the lattice against the body [degree].
        #[serde(default)]
        orientation: f64,
    },
    /// Bonds of two lengths at right angles.
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
    /// Bonds of two lengths at any angle.
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

/// The body that is cut from the lattice, or given as points.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawBody {
    /// The outline of the body, or its particles one by one.
    pub shape: RawShape,
    /// Shapes taken out of the body; particles on their rims stay.
    #[serde(default)]
    pub holes: Vec<RawShape>,
    /// Parts of another material, for the rule `material`. They may overlap (the later one counts), touch the outline of the
    /// body and leave it. With the outline `fitted`, particles stand on their edges.
    #[serde(default)]
    pub inclusions: Vec<RawInclusion>,
    /// Whether the body keeps the outline of its shape; `fitted` for the rule `material`, `lattice` for others.
    pub outline: Option<RawOutline>,
    /// Where the lattice has a site [length]. Unless given: the lower left corner of the shape's
    /// bounds, the centre of a disc, or the end of a specimen's axis.
    pub anchor: Option<[f64; 2]>,
}

/// A part of the body that is of another material.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawInclusion {
    /// The place of the part; what of it lies outside the body does not count.
    pub shape: RawShape,
    /// Its constants, with a `plane` of their own: plane stress unless given, and it must be that of the body. Its
    /// thickness must be the body's too.
    pub material: RawMaterial,
}

/// How a body follows the outline of its shape.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawOutline {
    /// Particles stand on the outline, arcs become chords between them, and the cells along it are what the shape
    /// leaves of them. For the rule `material` alone.
    Fitted,
    /// The body is made of whole cells of the lattice, and its outline is a staircase.
    Lattice,
}

/// An edge or an arc of a path.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawStep {
    /// Where it ends [length].
    pub to: [f64; 2],
    /// The centre of an arc, as far from its beginning as from its end; an edge has none [length].
    pub centre: Option<[f64; 2]>,
    /// Whether the arc runs clockwise.
    #[serde(default)]
    pub clockwise: bool,
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
    /// A rectangle with its sides along the axes.
    Rectangle {
        /// Lower left corner [length].
        #[serde(default)]
        min: [f64; 2],
        /// Upper right corner [length].
        max: [f64; 2],
    },
    /// A full disc.
    Disc {
        /// Centre [length].
        #[serde(default)]
        centre: [f64; 2],
        /// Radius [length].
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: f64,
    },
    /// A polygon, convex or not.
    Polygon {
        /// Corners in order, either way round; the last joins the first [length].
        #[schemars(length(min = 3))]
        vertices: Vec<[f64; 2]>,
    },
    /// Edges and arcs in order, either way round; an edge joins the end of the last to the beginning.
    Path {
        /// Where the first one begins [length].
        from: [f64; 2],
        /// Edges and arcs, each beginning where the one before ends.
        #[schemars(length(min = 1))]
        steps: Vec<RawStep>,
    },
    /// No shape but the particles themselves, in any order. The body has no lattice, `neighbours` have to be of the kind
    /// `within` or `dynamic`, and what is measured in spacings takes the median distance to the nearest particle.
    Points {
        /// Path, relative to the scene file, of a CSV file with the columns `x`, `y` and, if the particles have ids of
        /// their own, `id` (otherwise the numbers of the rows, from 1); outputs have the same ids and the same order.
        file: String,
        /// Multiplies every coordinate [1].
        #[serde(default = "super::defaults::one")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        scale: f64,
    },
    /// The sheet-type tensile specimen of ASTM E8/E8M (200 x 20 mm, gauge 57 x 12.5 mm, fillet 12.5 mm),
    /// its axis along y from y = 0, centred on x = 0.
    E8Sheet {
        /// Multiplies every length of the standard [1].
        #[serde(default = "super::defaults::one")]
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
        #[serde(default = "super::defaults::one")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        scale: f64,
        /// Lays the axis along x instead.
        #[serde(default)]
        lying: bool,
    },
}

impl RawShape {
    /// Whether it has an outline of its own: what is given by count or by points has none.
    pub(crate) fn has_outline(&self) -> bool {
        !matches!(self, Self::Grid { .. } | Self::Points { .. })
    }
}
