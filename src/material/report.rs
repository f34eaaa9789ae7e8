//! The material that a rule is, and the weights that a material takes, in words and numbers.
//!
//! A scalar rule has no force, so its stiffness has no scale: it is given in units of its shear
//! modulus. The Poisson's ratio of an isotropic sheet is read in two ways, as that of a thin sheet
//! (plane stress) and as that of a slice of a long body (plane strain), since the plane does not determine
//! which it is.

mod table;

use nalgebra::Matrix3;
use serde::Serialize;

use super::Block;
use super::elastic::{Constants, Elastic, Plane, Voigt, turned};
use super::homogenise::{Bond, Crystal, Effective, GradientLength, HomogeniseError};
use super::zone::Zone;
use crate::flock::lattice::Lattice;

/// Relative size below which anisotropy, misfit and what is left of a modulus are rounding.
const ROUNDING: f64 = 1e-9;

/// The material of a rule on an infinite lattice.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialReport {
    /// The lattice that the rule lives on.
    pub lattice: LatticeFacts,
    /// The name of the rule.
    pub rule: String,
    /// The material that was asked for; none where the question was what a rule is.
    pub asked: Option<Request>,
    /// Neighbours of an interior particle of each sublattice with their weights, nearest first.
    pub weights: Vec<Weight>,
    /// `D = sum_j K_j` of each sublattice \[force / length\], or the sum of the weights \[1\] of a scalar
    /// rule.
    pub diagonal: Vec<Block>,
    /// The continuum that the rule is for long waves.
    pub material: Material,
    /// How waves differ from that continuum as they get shorter.
    pub gradient: Gradient,
    /// Stability over all waves.
    pub waves: Waves,
    /// Further notes for the reader.
    pub notes: Vec<String>,
}

/// A lattice in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LatticeFacts {
    /// Name of the lattice.
    pub kind: &'static str,
    /// Smallest distance between two sites \[length\].
    pub spacing: f64,
    /// Area of the plane that belongs to a particle \[length^2\].
    pub cell_area: f64,
}

/// The constants that were given.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Request {
    /// A sheet alike in all directions.
    Isotropic {
        /// Young's modulus \[force / length^2\].
        young: f64,
        /// Poisson's ratio \[1\].
        poisson: f64,
        /// "stress" or "strain".
        plane: &'static str,
        /// Thickness of the sheet \[length\].
        thickness: f64,
    },
    /// Moduli along and across the fibres, whose angle from x is in degrees.
    Orthotropic {
        /// Moduli along the fibres and across them \[force / length^2\].
        young: [f64; 2],
        /// Contraction across the fibres under tension along them \[1\].
        poisson_12: f64,
        /// Shear modulus \[force / length^2\].
        shear: f64,
        /// Angle of the fibres from x \[degree\].
        fibres: f64,
        /// Thickness of the sheet \[length\].
        thickness: f64,
    },
}

/// A neighbour of an interior particle and its weight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Weight {
    /// Sublattice of the particle that sees the neighbour.
    pub sublattice: usize,
    /// Columns and rows from the particle to the neighbour.
    pub offset: [i32; 2],
    /// From the particle to the neighbour \[length\].
    pub vector: [f64; 2],
    /// Length of that vector \[length\].
    pub distance: f64,
    /// Direction from x \[degree\].
    pub direction: f64,
    /// `W = D^-1 K` \[1\]; those of one particle sum to the identity.
    pub weight: Block,
}

/// The continuum that the rule is for long waves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Material {
    /// Whether the stiffness is in units of the shear modulus, the rule having no force.
    pub up_to_scale: bool,
    /// Stiffness of the whole thickness, Voigt order (xx, yy, engineering xy) \[force / length\], shape
    /// \[3, 3\].
    pub stiffness: [[f64; 3]; 3],
    /// Lame's constants of the nearest isotropic stiffness, two-dimensional \[force / length\].
    pub lambda: f64,
    /// The second of them, the stiffness against shear \[force / length\].
    pub mu: f64,
    /// Whether the stiffness is isotropic, to rounding.
    pub isotropic: bool,
    /// Relative distance from the nearest isotropic stiffness \[1\].
    pub anisotropy: f64,
    /// How far the acoustic tensor is from that of any symmetric stress, relative \[1\].
    pub misfit: f64,
    /// Poisson's ratio of the nearest isotropic sheet, read as plane stress \[1\].
    pub poisson_plane_stress: f64,
    /// The same read as plane strain; no solid has it where the sheet resists no equal stretch.
    pub poisson_plane_strain: Option<f64>,
    /// Young's modulus \[force / length^2\], read as plane stress.
    pub young_plane_stress: f64,
    /// The same read as plane strain; none where there is no such Poisson's ratio.
    pub young_plane_strain: Option<f64>,
    /// Engineering constants along x and y, or along and across the fibres where there are any; none
    /// where a strain costs nothing.
    pub engineering: Option<Engineering>,
}

/// Engineering constants of a sheet in plane stress along two axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Engineering {
    /// Angle of the first axis from x \[degree\].
    pub angle: f64,
    /// Along the first and the second axis \[force / length^2\].
    pub young: [f64; 2],
    /// Contraction along the second axis under tension along the first \[1\].
    pub poisson_12: f64,
    /// \[force / length^2\].
    pub shear: f64,
}

/// Gradient length squared `l^2` \[length^2\]: a wave of length `L` costs `1 + l^2 (2 pi / L)^2` of what
/// it would in the plain continuum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gradient {
    /// By direction and polarisation.
    #[serde(flatten)]
    pub length: GradientLength,
    /// The effect of the sign on short waves.
    pub effect: Effect,
}

/// The effect of the sign of `l^2` on short waves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Effect {
    /// Positive in all directions: a second-gradient material.
    Stiffens,
    /// Negative in all directions.
    Softens,
    /// The sign depends on the direction.
    Mixed,
}

/// All waves of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Waves {
    /// Whether every wave but a translation costs energy.
    pub stable: bool,
    /// Least cost of a wave, relative to that of springs along the two translations of the lattice that resist a particle's motion as
    /// much \[1\].
    pub least: f64,
    /// The wave of that cost \[1/length\], and its length \[length\].
    pub worst: [f64; 2],
    /// Length of that wave \[length\].
    pub worst_length: f64,
    /// Largest eigenvalue of `D^-1 S(k)`, `D` being what the rule's update divides by \[1\].
    pub largest: f64,
    /// A synchronous update must be damped below this \[1\]; none where no damping helps.
    pub damping_limit: Option<f64>,
}

impl MaterialReport {
    /// The material that a rule without forces is; `rule` is its name.
    pub fn of_rule(lattice: &Lattice, rule: String, crystal: &Crystal) -> Result<Self, HomogeniseError> {
        Self::of_rule_over(lattice, rule, crystal, &crystal.diagonals())
    }

    /// The weights that a material takes on a lattice, and what material those weights are.
    pub fn of_material(lattice: &Lattice, elastic: &Elastic) -> Result<Self, HomogeniseError> {
        let crystal = Crystal::material(lattice, elastic)?;
        let (zone, effective) = (crystal.zone()?, crystal.effective()?);
        let material = Material::of_sheet(&effective, elastic);
        let rule = "2x2 weights from the material".to_owned();
        let report = Self::gather(lattice, rule, &crystal, &effective, material, &zone);
        Ok(Self { asked: Some(Request::of(elastic)), ..report })
    }

    fn gather(
        lattice: &Lattice,
        rule: String,
        crystal: &Crystal,
        effective: &Effective,
        material: Material,
        zone: &Zone,
    ) -> Self {
        let of_sublattice = |s: usize| {
            let weight = move |(k, bond): (usize, &Bond)| Weight::of(lattice, crystal, s, k, bond);
            crystal.bonds[s].iter().enumerate().map(weight)
        };
        Self {
            lattice: LatticeFacts {
                kind: lattice.name(),
                spacing: lattice.spacing(),
                cell_area: lattice.cell_area(),
            },
            rule,
            asked: None,
            weights: (0..crystal.bonds.len()).flat_map(of_sublattice).collect(),
            diagonal: crystal.diagonals(),
            material,
            gradient: Gradient::of(effective),
            waves: Waves::of(zone),
            notes: Vec::new(),
        }
    }

    /// The material of a rule whose update divides by other blocks than the sums of its own; shape \[sublattices\].
    pub fn of_rule_over(
        lattice: &Lattice,
        rule: String,
        crystal: &Crystal,
        divisors: &[Block],
    ) -> Result<Self, HomogeniseError> {
        let zone = crystal.zone_over(divisors)?;
        let effective = crystal.effective()?;
        let material = Material::up_to_scale(&effective);
        Ok(Self::gather(lattice, rule, crystal, &effective, material, &zone))
    }

    /// Whether every weight is a number times the identity.
    pub fn is_scalar(&self) -> bool {
        self.weights.iter().all(|w| w.weight[0][1] == 0.0 && w.weight[1][0] == 0.0)
            && self.weights.iter().all(|w| w.weight[0][0] == w.weight[1][1])
    }
}

impl Weight {
    fn of(lattice: &Lattice, crystal: &Crystal, sublattice: usize, k: usize, bond: &Bond) -> Self {
        let [x, y] = bond.vector;
        let origin = lattice.position([0, 0]);
        let steps = lattice.grid_coordinates([origin[0] + x, origin[1] + y]);
        Self {
            sublattice,
            offset: steps.map(|step| step.round() as i32),
            vector: bond.vector,
            distance: x.hypot(y),
            direction: y.atan2(x).to_degrees(),
            // The zone has refused a sublattice whose D has no inverse.
            weight: crystal.weight(sublattice, k).unwrap_or_default(),
        }
    }
}

impl Request {
    fn of(elastic: &Elastic) -> Self {
        let thickness = elastic.thickness();
        match elastic.constants() {
            Constants::Isotropic { young, poisson, plane } => {
                let plane = if plane == Plane::Stress { "stress" } else { "strain" };
                Request::Isotropic { young, poisson, plane, thickness }
            }
            Constants::Orthotropic { young, poisson_12, shear, angle } => {
                Request::Orthotropic { young, poisson_12, shear, fibres: angle.to_degrees(), thickness }
            }
        }
    }
}

impl Material {
    fn up_to_scale(effective: &Effective) -> Self {
        let norm = effective.stiffness.norm();
        // A rule without shear stiffness is scaled by its largest.
        let scale = if effective.mu.abs() > ROUNDING * norm { effective.mu.abs() } else { norm };
        Self::scaled(effective, if scale > 0.0 { scale } else { 1.0 }, 1.0, 0.0, true)
    }

    fn of_sheet(effective: &Effective, elastic: &Elastic) -> Self {
        let angle = elastic.fibres().unwrap_or(0.0);
        Self::scaled(effective, 1.0, elastic.thickness(), angle, false)
    }

    fn scaled(effective: &Effective, scale: f64, thickness: f64, angle: f64, up_to_scale: bool) -> Self {
        let stiffness = effective.stiffness / scale;
        let per_thickness = 1.0 / (scale * thickness);
        Self {
            up_to_scale,
            stiffness: std::array::from_fn(|i| std::array::from_fn(|j| stiffness[(i, j)])),
            lambda: effective.lambda / scale,
            mu: effective.mu / scale,
            isotropic: effective.anisotropy < ROUNDING && effective.misfit < ROUNDING,
            anisotropy: effective.anisotropy,
            misfit: effective.misfit,
            poisson_plane_stress: effective.poisson_plane_stress(),
            poisson_plane_strain: effective.poisson_plane_strain(),
            young_plane_stress: effective.young_plane_stress() * per_thickness,
            young_plane_strain: effective.young_plane_strain().map(|young| young * per_thickness),
            engineering: Engineering::of(&(stiffness / thickness), angle),
        }
    }
}

impl Engineering {
    /// From the compliance in axes turned by `angle` \[rad\] against the plane's; none where a strain costs
    /// nothing or less.
    fn of(stiffness: &Voigt, angle: f64) -> Option<Self> {
        let own = turned(stiffness, -angle);
        let norm = own.norm();
        let scaled: Matrix3<f64> = own / norm;
        let positive = scaled.symmetric_eigenvalues().min() > ROUNDING;
        let compliance = positive.then(|| scaled.try_inverse()).flatten()? / norm;
        Some(Self {
            angle: angle.to_degrees(),
            young: [1.0 / compliance[(0, 0)], 1.0 / compliance[(1, 1)]],
            poisson_12: -compliance[(0, 1)] / compliance[(0, 0)],
            shear: 1.0 / compliance[(2, 2)],
        })
    }
}

impl Gradient {
    fn of(effective: &Effective) -> Self {
        let length = effective.gradient;
        let effect = match (length.least > 0.0, length.greatest < 0.0) {
            (true, _) => Effect::Stiffens,
            (_, true) => Effect::Softens,
            _ => Effect::Mixed,
        };
        Self { length, effect }
    }
}

impl Waves {
    fn of(zone: &Zone) -> Self {
        Self {
            stable: zone.stable,
            least: zone.least,
            worst: zone.worst,
            worst_length: std::f64::consts::TAU / zone.worst[0].hypot(zone.worst[1]),
            largest: zone.largest,
            damping_limit: zone.stable.then_some(zone.damping_limit),
        }
    }
}
