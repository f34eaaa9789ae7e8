//! Material, loads and equilibrium solver, as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::RawRegion;

/// The material of the body. The rule `material` takes its weights from it, loads need it, and
/// `flockform compare` gives it to the finite elements; the paper's rules do without.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawMaterial {
    /// The same in every direction.
    Isotropic {
        /// Young's modulus [force / length^2].
        young: f64,
        /// Poisson's ratio: between -1 and 1 in plane stress, between -1 and 1/2 in plane strain [1].
        poisson: f64,
        /// The assumption across the thickness; plane stress unless given.
        #[serde(default)]
        plane: RawPlane,
        /// Thickness [length].
        #[serde(default = "super::defaults::one")]
        thickness: f64,
    },
    /// Plane stress with fibres.
    Orthotropic {
        /// Young's moduli along the fibres and across them [force / length^2].
        young: [f64; 2],
        /// Contraction across the fibres under tension along them [1].
        poisson_12: f64,
        /// Shear modulus [force / length^2].
        shear: f64,
        /// Direction of the fibres, from x [degree].
        #[serde(default)]
        angle: f64,
        /// Thickness [length].
        #[serde(default = "super::defaults::one")]
        thickness: f64,
    },
}

/// The assumption across the thickness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawPlane {
    /// The faces are free: a thin sheet.
    #[default]
    Stress,
    /// The faces cannot part: a slice of a long body.
    Strain,
}

/// Something that pushes the body, from the first step on.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RawLoad {
    /// On the part of the outline that lies in the region, along fixed directions.
    Traction {
        /// The place where the load acts.
        region: RawRegion,
        /// Along x and y [force / length^2].
        traction: [f64; 2],
        /// How it varies along the outline; not at all unless given.
        profile: Option<RawProfile>,
    },
    /// On the part of the outline that lies in the region, along the normal of the undeformed outline and on its
    /// undeformed length: in a corotated body too, where it does not turn with the outline.
    Pressure {
        /// The place where the load acts.
        region: RawRegion,
        /// Positive pushes into the body [force / length^2].
        pressure: f64,
        /// How it varies along the outline; not at all unless given.
        profile: Option<RawProfile>,
    },
    /// On each particle of the region.
    Force {
        /// The particles that are pushed.
        region: RawRegion,
        /// Along x and y [force].
        force: [f64; 2],
    },
    /// On all of the body, like weight.
    Body {
        /// Along x and y [force / length^3].
        force: [f64; 2],
    },
}

/// Multiplies a load by a factor that is linear along a line, from one point to another and beyond.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawProfile {
    /// Where the first factor holds [length].
    pub from: [f64; 2],
    /// Where the second factor holds [length].
    pub to: [f64; 2],
    /// At `from` and at `to` [1].
    pub factors: [f64; 2],
}

/// Finds where the followers come to rest under the leaders' places at step `stop.steps`, instead of
/// stepping there.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawEquilibrium {
    /// The method; chosen by size, shape and rule unless given.
    #[serde(default)]
    pub solver: RawSolver,
    /// How near to elasticity the followers should come: the relative error of their displacements, as
    /// "1%" or 0.01. The rule (unless written), the spacing (the written one is the widest), tolerance and
    /// precision are then chosen, by what `flockform trade` has shown.
    pub accuracy: Option<RawAccuracy>,
    /// Largest residual force over the load's at which the solver stops, up to twice that once it is found again from the places; 1e-8 unless an accuracy is given [1].
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: Option<f64>,
    /// Iterations after which the solver stops short of its tolerance [1].
    #[serde(default = "super::defaults::iterations")]
    #[schemars(range(min = 1))]
    pub most_iterations: usize,
    /// Doubles unless an accuracy is given that singles reach.
    pub precision: Option<RawPrecision>,
}

/// A part of 1, or a percentage.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum RawAccuracy {
    /// A part of 1 [1].
    Part(f64),
    /// Such as "1%".
    Text(String),
}

/// How the equilibrium is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawSolver {
    /// Chosen by size, shape and rule; `flockform plan` says which and why.
    #[default]
    Auto,
    /// The paper's sweep, damped by its estimated spectrum.
    Jacobi,
    /// Sweeps of one colour of particles after the other, each seeing those before it.
    GaussSeidel,
    /// Sweeps whose damping varies so as to use the whole spectrum.
    Chebyshev,
    /// Sweeps that remember the direction of the last one; their number grows with the body.
    ConjugateGradients,
    /// Conjugate gradients with a multigrid cycle before each step.
    Multigrid,
    /// A sparse factorisation.
    Direct,
}

/// Digits of the numbers that a solver works with.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawPrecision {
    /// Doubles.
    F64,
    /// Singles: half the memory traffic, five to six digits at best.
    F32,
}
