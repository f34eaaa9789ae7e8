//! Elastic constants of a sheet and the 3x3 stiffness they stand for.
//!
//! Voigt order (xx, yy, xy) with the engineering shear strain `gamma = u_y + v_x`. Sources: the
//! textbook relations, e.g. O. C. Zienkiewicz and R. L. Taylor, *The Finite Element Method*, vol. 1;
//! for the orthotropic sheet R. M. Jones, *Mechanics of Composite Materials*, ch. 2.

use std::f64::consts::SQRT_2;

use nalgebra::{Matrix3, Vector3};

/// Strain to membrane force, Voigt order (xx, yy, xy) \[force / length\], shape \[3, 3\].
pub type Voigt = Matrix3<f64>;

/// The assumption across the thickness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Plane {
    /// A thin sheet with free faces
    Stress,
    /// A slice of a long body
    Strain,
}

/// Elastic constants as an engineer names them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constants {
    /// Young's modulus \[force / length^2\] and Poisson's ratio \[1\].
    ///
    /// Plane stress takes -1 < nu < 1, the range in which a two-dimensional sheet has positive
    /// energy; a sheet cut from a three-dimensional isotropic solid has nu < 1/2. Plane strain takes
    /// -1 < nu < 1/2: at 1/2 the material is incompressible.
    Isotropic {
        /// Young's modulus \[force / length^2\].
        young: f64,
        /// Poisson's ratio \[1\].
        poisson: f64,
        /// The assumption across the thickness.
        plane: Plane,
    },
    /// Plane stress: moduli along the fibres and across them and for shear \[force / length^2\],
    /// contraction across the fibres under tension along them \[1\], and the angle of the fibres from
    /// x \[rad\]. Positive energy needs `poisson_12^2 < young[0] / young[1]`.
    Orthotropic {
        /// Moduli along the fibres and across them \[force / length^2\].
        young: [f64; 2],
        /// Contraction across the fibres under tension along them \[1\].
        poisson_12: f64,
        /// Shear modulus \[force / length^2\].
        shear: f64,
        /// Angle of the fibres from x, counter-clockwise \[rad\].
        angle: f64,
    },
}

/// Poisson's ratio in plane strain above which dilatations are averaged: see [`Elastic::averaged`]. In plane stress
/// 2/3 is as much: Lame's lambda over the shear modulus is the same.
const LOCKS_ABOVE: f64 = 0.4;

/// Stiffness against the strain that is resisted most over that against the next, beyond which it is averaged, over the square of the
/// determinant of its weights (1 for a dilatation, -1 for a shear, 0 for a stretch along fibres): that of an isotropic material at
/// `LOCKS_ABOVE`.
const AVERAGED_BEYOND: f64 = 5.0;

/// Energy of a bent square of bilinear displacement over that in the continuum, beyond which it locks: with 10 cells across a beam is 3 % too stiff.
const BENDS_BEYOND: f64 = 4.0;

/// Stiffness of rectangles against one strain over that against another beyond which they are cautioned against: see
/// [`Elastic::locks`]. At nu = -0.8 in plane stress it is as much.
const LOCKS_BEYOND: f64 = 9.0 * (1.0 + 1e-9);

/// The same of other cells, whose stress is not assumed: with 10 triangles across a cantilever is 3 % too stiff with fibres at 30 degrees that are 6 times as stiff.
const LOCKS_BEYOND_ELSEWHERE: f64 = 5.0 * (1.0 + 1e-9);

/// What fibres resist.
pub const STRETCH: &str = "a stretch along fibres";

/// Poisson's ratio in plane strain above which iterations are many.
const NEAR_A_HALF: f64 = 0.49;

/// Why constants make no stable material.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ElasticError {
    /// A modulus or a thickness that is not positive and finite.
    #[error("{name} must be positive and finite, but it is {value}")]
    NotPositive {
        /// Its name in messages.
        name: &'static str,
        /// The given value.
        value: f64,
    },
    /// A Poisson's ratio with which an isotropic sheet is not stable.
    #[error(
        "Poisson's ratio in plane {} must lie between {low} and {high}, ends excluded, but it is {value}: {}",
        if *.plane == Plane::Stress { "stress" } else { "strain" },
        if *.value <= -1.0 { "at -1 and below, stretching in all directions would cost no energy" }
        else if *.plane == Plane::Stress { "at 1 and above, stretching in all directions has no finite, positive stiffness" }
        else { "at 1/2 the material is incompressible, and above it compression would give energy" }
    )]
    Poisson {
        /// The assumption across the thickness.
        plane: Plane,
        /// The given value \[1\].
        value: f64,
        /// Lower bound, excluded \[1\].
        low: f64,
        /// Upper bound, excluded \[1\].
        high: f64,
    },
    /// A Poisson's ratio with which an orthotropic sheet is not stable.
    #[error(
        "the orthotropic Poisson's ratio must be smaller in size than sqrt(E1/E2) = {bound}, but it is {value}: straining the sheet would give energy"
    )]
    PoissonOrthotropic {
        /// The given value \[1\].
        value: f64,
        /// The size that it must stay below \[1\].
        bound: f64,
    },
    /// An angle of the fibres that is not finite.
    #[error("the angle of the fibres must be finite, but it is {value}")]
    Angle {
        /// The given value \[rad\].
        value: f64,
    },
    /// The entries of the stiffness over- or underflow.
    #[error("the stiffness of the sheet does not fit a double: the constants are too large or too small")]
    Range,
}

/// The components of a stiffness that change with the axes as those of a tensor do: shear by the root of two.
pub(super) fn mandel(stiffness: &Voigt) -> Matrix3<f64> {
    let weight = |i: usize| if i == 2 { 2f64.sqrt() } else { 1.0 };
    Matrix3::from_fn(|i, j| stiffness[(i, j)] * weight(i) * weight(j))
}

/// A strain that is resisted by its mean over the cells around a particle: see [`Elastic::averaged`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Averaged {
    /// The weights of the strain's components (xx, yy, engineering xy) \[1\]: 1, 1, 0 of a dilatation. As a tensor their square is 2.
    pub weights: [f64; 3],
    /// What resists it \[force / length\]: of a dilatation Lame's lambda times the thickness.
    pub stiffness: f64,
}

impl Averaged {
    /// The strain of these components \[1\].
    pub fn of(&self, strain: [f64; 3]) -> f64 {
        let [xx, yy, xy] = self.weights;
        xx * strain[0] + yy * strain[1] + xy * strain[2]
    }

    /// The strain that is resisted far more than all others, if it is no stretch along fibres.
    fn of_stiffness(stiffness: &Voigt) -> Option<Self> {
        let ([_, next, most], weights) = stiffest_strain(stiffness);
        // The harder it is to invert, the more it takes: at nu_12 = 1.2, with E_1 = 10 E_2, squares are nearer to the truth without.
        let is_alone = most * determinant(weights).powi(2) > AVERAGED_BEYOND * next;
        is_alone.then_some(Self { weights, stiffness: 0.5 * (most - next) })
    }
}

/// Stiffnesses against strains of size 1, ascending \[force / length\], and the weights of the strain that is resisted most, as those of [`Averaged`].
fn stiffest_strain(stiffness: &Voigt) -> ([f64; 3], [f64; 3]) {
    let eigen = mandel(stiffness).symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let [xx, yy, xy]: [f64; 3] = eigen.eigenvectors.column(order[2]).into_owned().into();
    let weights = [SQRT_2 * xx, SQRT_2 * yy, xy].map(|weight| if xx + yy < 0.0 { -weight } else { weight });
    (order.map(|k| eigen.eigenvalues[k]), weights)
}

/// Of the tensor of these weights: 1 of a dilatation, -1 of a shear.
fn determinant([xx, yy, xy]: [f64; 3]) -> f64 {
    xx * yy - xy * xy
}

/// A sheet: admissible constants and a thickness \[length\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    constants: Constants,
    thickness: f64,
    stiffness: Voigt,
    averaged: Option<Averaged>,
}

impl Elastic {
    /// Refuses constants of no stable material, naming the bound, and a thickness that is not positive.
    pub fn new(constants: Constants, thickness: f64) -> Result<Self, ElasticError> {
        positive("the thickness", thickness)?;
        let per_thickness = match constants {
            Constants::Isotropic { young, poisson, plane } => isotropic(young, poisson, plane)?,
            Constants::Orthotropic { young, poisson_12, shear, angle } => {
                orthotropic(young, poisson_12, shear, angle)?
            }
        };
        let stiffness = per_thickness * thickness;
        let fits = stiffness.iter().all(|c| c.is_finite()) && (0..3).all(|k| stiffness[(k, k)].is_normal());
        if !fits {
            return Err(ElasticError::Range);
        }
        let averaged = match constants {
            Constants::Isotropic { poisson, plane, .. } => (in_plane_strain(poisson, plane) > LOCKS_ABOVE)
                .then(|| Averaged { weights: [1.0, 1.0, 0.0], stiffness: stiffness[(0, 1)] }),
            Constants::Orthotropic { .. } => Averaged::of_stiffness(&stiffness),
        };
        Ok(Self { constants, thickness, stiffness, averaged })
    }

    /// The constants that the stiffness was made from.
    pub fn constants(&self) -> Constants {
        self.constants
    }

    /// Thickness \[length\].
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Stiffness of the whole thickness \[force / length\].
    pub fn stiffness(&self) -> &Voigt {
        &self.stiffness
    }

    /// How fast stress falls off beside the crown of a hole in a sheet that is pulled along its fibres or across them, whichever is
    /// faster, over how fast it does so in an isotropic one \[1\]; by the polynomial of H. J. Konish and J. M. Whitney, *Approximate
    /// stresses in an orthotropic plate containing a circular hole*, J. Composite Materials 9, 1975.
    pub fn steepness(&self) -> f64 {
        let Constants::Orthotropic { young: [along, across], poisson_12, shear, .. } = self.constants else {
            return 1.0;
        };
        let peak = |one: f64, other: f64, poisson: f64| {
            1.0 + (2.0 * ((one / other).sqrt() - poisson) + one / shear).max(0.0).sqrt()
        };
        let highest = peak(along, across, poisson_12).max(peak(across, along, poisson_12 * across / along));
        let slope = |peak: f64| (7.0 + 13.0 * (peak - 3.0)) / peak;
        (slope(highest) / slope(3.0)).max(1.0)
    }

    /// How soft it is in shear along its fibres: `sqrt(E_1 E_2) (1 / G - 2 nu_12 / E_1) / 2`, which is 1 in an isotropic material \[1\].
    /// The parts of a stress field that fall off fastest and slowest from an edge do so over lengths of about twice this ratio.
    pub fn softness_in_shear(&self) -> f64 {
        let Constants::Orthotropic { young: [along, across], poisson_12, shear, .. } = self.constants else {
            return 1.0;
        };
        0.5 * (along * across).sqrt() * (1.0 / shear - 2.0 * poisson_12 / along)
    }

    /// The strain that is resisted by its mean over the cells around a particle, instead of that of each cell: a dilatation in
    /// isotropic materials. `None` where each cell resists its own.
    ///
    /// Towards nu = 1/2 in plane strain lambda grows without bound, and cells that each keep their area have too few
    /// ways left to deform: they lock. One condition for each particle leaves enough, on triangles, quadrilaterals and
    /// polygons alike (J. Bonet and A. J. Burton, *A simple average nodal pressure tetrahedral element for incompressible
    /// and nearly incompressible dynamic explicit applications*, Comm. Numer. Meth. Eng. 14, 1998; the patches of E. A. de
    /// Souza Neto, F. M. Andrade Pires and D. R. J. Owen, IJNME 62, 2005, are groups of cells instead). It takes neighbours
    /// two cells away, so it is used above nu = 0.4 alone in plane strain, and above 2/3 in plane stress.
    ///
    /// The stiffness of an orthotropic material is split by its eigenvectors (S. C. Cowin and M. M. Mehrabadi, *The structure of the
    /// linear anisotropic elastic symmetries*, J. Mech. Phys. Solids 40, 1992): it is `mu_1 n n'` of the strain `n` that is resisted most, of which all
    /// beyond that of the next strain, `mu_1 - mu_2`, is averaged; 2 lambda of an isotropic one. The rest is positive definite.
    /// To keep `N : grad u = div (N u)` at zero is as hard for cells as it is to keep `div u`, since `N u` is continuous as `u` is,
    /// as long as `N` can be inverted: a dilatation in stretched axes, or a shear. A stretch along fibres has an `N` of rank one, and each cell resists its own.
    pub fn averaged(&self) -> Option<Averaged> {
        self.averaged
    }

    /// Whether it resists one strain more than 50 times as much as all others, but by its mean: iterations are many. At nu = 0.49 in plane
    /// strain it is as much.
    pub fn is_nearly_incompressible(&self) -> bool {
        match self.constants {
            Constants::Isotropic { poisson, plane, .. } => in_plane_strain(poisson, plane) > NEAR_A_HALF,
            Constants::Orthotropic { .. } => {
                let next = mandel(&self.stiffness_of_cells()).symmetric_eigenvalues().max();
                self.averaged.is_some_and(|averaged| 2.0 * averaged.stiffness > 49.0 * next)
            }
        }
    }

    /// How many times as much its cells resist one strain as another \[1\], and which, if that is so much that they lock; `are_rectangles`
    /// says that they have sides along `angle` from x \[rad\]. That happens near nu = -1 in plane stress, and with fibres, beside
    /// rectangles along them.
    pub fn locks(&self, (are_rectangles, angle): (bool, f64)) -> Option<(f64, &'static str)> {
        let ([least, _, most], weights) = stiffest_strain(&self.stiffness_of_cells());
        let beyond = if are_rectangles { LOCKS_BEYOND } else { LOCKS_BEYOND_ELSEWHERE };
        let locks = most > beyond * least && (!are_rectangles || self.locks_bilinear(angle));
        let strain = match determinant(weights) {
            // Averaged, the stiffest is resisted as much as the next one, and either may be found.
            _ if self.averaged.is_some() => "two strains",
            size if size > 0.5 => "a change of area",
            size if size < -0.5 => "a shear",
            _ => STRETCH,
        };
        locks.then(|| (most / least, strain))
    }

    /// The angle of its fibres from x, counter-clockwise \[rad\].
    pub fn fibres(&self) -> Option<f64> {
        match self.constants {
            Constants::Orthotropic { angle, .. } => Some(angle),
            Constants::Isotropic { .. } => None,
        }
    }

    /// The stiffness less what resists a strain by its mean, [`Elastic::averaged`] \[force / length\]: all of it where
    /// there is none.
    pub fn stiffness_of_cells(&self) -> Voigt {
        match (self.averaged, self.constants) {
            (None, _) => self.stiffness,
            (Some(_), Constants::Isotropic { .. }) => {
                let shear = self.stiffness[(2, 2)];
                Matrix3::from_diagonal(&Vector3::new(2.0 * shear, 2.0 * shear, shear))
            }
            (Some(Averaged { weights, stiffness }), Constants::Orthotropic { .. }) => {
                let weights = Vector3::from(weights);
                self.stiffness - weights * weights.transpose() * stiffness
            }
        }
    }

    /// Whether squares of bilinear displacement with sides along this angle from x \[rad\] are too stiff in bending: `u = x y` about the
    /// side along x has the strain `y` along it and the shear `x`, where there should be tension alone.
    pub fn locks_bilinear(&self, angle: f64) -> bool {
        let own = turned(&self.stiffness, -angle);
        // An admissible stiffness is positive definite.
        let Some(compliance) = own.try_inverse() else { return false };
        [0, 1].into_iter().any(|k| (own[(k, k)] + own[(2, 2)]) * compliance[(k, k)] > BENDS_BEYOND)
    }

    /// In-plane stress (xx, yy, xy) \[force / length^2\] under a strain (xx, yy, engineering xy) \[1\].
    pub fn stress(&self, strain: [f64; 3]) -> [f64; 3] {
        (self.stiffness * Vector3::from(strain) / self.thickness).into()
    }

    /// The strain (xx, yy, engineering xy) \[1\] under an in-plane stress (xx, yy, xy) \[force / length^2\].
    pub fn strain(&self, stress: [f64; 3]) -> [f64; 3] {
        let forces = Vector3::from(stress) * self.thickness;
        // An admissible stiffness is positive definite.
        self.stiffness.cholesky().map_or([f64::NAN; 3], |factor| factor.solve(&forces).into())
    }

    /// Von Mises stress \[force / length^2\] under a strain (xx, yy, engineering xy) \[1\].
    pub fn von_mises(&self, strain: [f64; 3]) -> f64 {
        von_mises(self.stress(strain), self.stress_across(strain))
    }

    /// Stress across the sheet \[force / length^2\] under a strain (xx, yy, engineering xy) \[1\]: in plane strain what keeps the
    /// faces from parting.
    pub fn stress_across(&self, strain: [f64; 3]) -> f64 {
        let [xx, yy, _] = self.stress(strain);
        match self.constants {
            Constants::Isotropic { poisson, plane: Plane::Strain, .. } => poisson * (xx + yy),
            _ => 0.0,
        }
    }
}

/// Von Mises stress \[force / length^2\] of xx, yy, xy and of zz.
pub fn von_mises([xx, yy, xy]: [f64; 3], zz: f64) -> f64 {
    let (a, b, c) = (xx - yy, yy - zz, zz - xx);
    let of = |a: f64, b: f64, c: f64, xy: f64| (0.5 * (a * a + b * b + c * c) + 3.0 * xy * xy).sqrt();
    let largest = [a, b, c, xy].into_iter().fold(0.0, |most: f64, part| most.max(part.abs()));
    // Squares of others vanish or overflow.
    if largest == 0.0 || !largest.is_finite() || (1e-140..1e140).contains(&largest) {
        return of(a, b, c, xy);
    }
    largest * of(a / largest, b / largest, c / largest, xy / largest)
}

/// Poisson's ratio of the isotropic material that behaves so in plane strain \[1\].
fn in_plane_strain(poisson: f64, plane: Plane) -> f64 {
    if plane == Plane::Strain { poisson } else { poisson / (1.0 + poisson) }
}

fn positive(name: &'static str, value: f64) -> Result<(), ElasticError> {
    let fits = value > 0.0 && value.is_finite();
    if fits { Ok(()) } else { Err(ElasticError::NotPositive { name, value }) }
}

fn isotropic(young: f64, poisson: f64, plane: Plane) -> Result<Voigt, ElasticError> {
    positive("Young's modulus", young)?;
    let high = if plane == Plane::Stress { 1.0 } else { 0.5 };
    if !(poisson > -1.0 && poisson < high) {
        return Err(ElasticError::Poisson { plane, value: poisson, low: -1.0, high });
    }
    let (direct, cross) = match plane {
        Plane::Stress => {
            let c = young / ((1.0 - poisson) * (1.0 + poisson));
            (c, c * poisson)
        }
        Plane::Strain => {
            let c = young / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
            (c * (1.0 - poisson), c * poisson)
        }
    };
    let shear = young / (2.0 * (1.0 + poisson));
    Ok(Matrix3::new(direct, cross, 0.0, cross, direct, 0.0, 0.0, 0.0, shear))
}

fn orthotropic(young: [f64; 2], poisson_12: f64, shear: f64, angle: f64) -> Result<Voigt, ElasticError> {
    positive("Young's modulus along the fibres", young[0])?;
    positive("Young's modulus across the fibres", young[1])?;
    positive("the shear modulus", shear)?;
    let bound = (young[0] / young[1]).sqrt();
    let gives_energy = poisson_12.is_nan() || poisson_12.abs() >= bound;
    if gives_energy {
        return Err(ElasticError::PoissonOrthotropic { value: poisson_12, bound });
    }
    if !angle.is_finite() {
        return Err(ElasticError::Angle { value: angle });
    }
    let rest = 1.0 - poisson_12 * (poisson_12 * young[1] / young[0]);
    let along = young[0] / rest;
    let (across, cross) = (young[1] / rest, poisson_12 * young[1] / rest);
    Ok(turned(&Matrix3::new(along, cross, 0.0, cross, across, 0.0, 0.0, 0.0, shear), angle))
}

/// The stiffness of a material turned by `angle` \[rad\] against the axes.
pub fn turned(stiffness: &Voigt, angle: f64) -> Voigt {
    let (s, c) = angle.sin_cos();
    // Strain in the axes of the material from strain in the axes of the plane.
    let t = Matrix3::new(c * c, s * s, s * c, s * s, c * c, -s * c, -2.0 * s * c, 2.0 * s * c, c * c - s * s);
    let product = t.transpose() * stiffness * t;
    (product + product.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn isotropic_sheet(poisson: f64, plane: Plane) -> Result<Elastic, ElasticError> {
        Elastic::new(Constants::Isotropic { young: 1000.0, poisson, plane }, 0.5)
    }

    fn fibres(poisson_12: f64, angle: f64) -> Result<Elastic, ElasticError> {
        Elastic::new(Constants::Orthotropic { young: [9.0, 1.0], poisson_12, shear: 0.7, angle }, 1.0)
    }

    #[test]
    fn stress_beside_a_hole_is_as_steep_as_the_fibres_make_it() {
        let sheet = |young: [f64; 2], poisson_12: f64, shear: f64| {
            let constants = Constants::Orthotropic { young, poisson_12, shear, angle: 0.4 };
            Elastic::new(constants, 1.0).expect("stable").steepness()
        };
        // Equal constants are those of an isotropic sheet.
        assert!((sheet([130.0, 130.0], 0.3, 50.0) - 1.0).abs() < 1e-12);
        // S. G. Lekhnitskii's stress at the crown is 6.543 times the pull: (7 + 13 * 3.543) / 6.543 over 7 / 3.
        assert!((sheet([200.0, 20.0], 0.3, 8.0) - 3.475).abs() < 1e-3);
        assert_eq!(sheet([20.0, 200.0], 0.03, 8.0), sheet([200.0, 20.0], 0.3, 8.0));
    }

    #[test]
    fn von_mises_stress_has_the_scale_of_its_components() {
        let expected = von_mises([3.0, -1.0, 0.5], 0.25);
        for scale in [1e-300, 1e-170, 1e170, 1e300] {
            let found = von_mises([3.0 * scale, -scale, 0.5 * scale], 0.25 * scale);
            assert!((found / scale / expected - 1.0).abs() < 1e-12, "{scale:e}: {found:e}");
        }
        assert!(von_mises([f64::NAN, 1.0, 1.0], 0.0).is_nan() && von_mises([0.0; 3], 0.0) == 0.0);
    }

    #[test]
    fn uniaxial_stress_gives_back_young_and_poisson() {
        let c = *isotropic_sheet(0.33, Plane::Stress).expect("admissible").stiffness();
        let strain = c.try_inverse().expect("regular") * Vector3::new(1.0, 0.0, 0.0);
        assert!((1.0 / strain[0] - 500.0).abs() < 1e-10);
        assert!((strain[1] / strain[0] + 0.33).abs() < 1e-14);
        let c = *fibres(0.3, 0.0).expect("admissible").stiffness();
        let strain = c.try_inverse().expect("regular") * Vector3::new(1.0, 0.0, 0.0);
        assert!((1.0 / strain[0] - 9.0).abs() < 1e-12);
        assert!((strain[1] / strain[0] + 0.3).abs() < 1e-14);
    }

    #[test]
    fn fibres_turned_by_a_right_angle_swap_their_moduli() {
        let (along, across) = (fibres(0.3, 0.0).expect("fits"), fibres(0.3, std::f64::consts::FRAC_PI_2));
        let (a, b) = (along.stiffness(), *across.expect("fits").stiffness());
        assert!((a[(0, 0)] - b[(1, 1)]).abs() < 1e-14 && (a[(1, 1)] - b[(0, 0)]).abs() < 1e-14);
        assert!(fibres(0.3, 0.5).expect("fits").stiffness()[(0, 2)] > 0.1, "fibres to the upper right");
    }

    #[test]
    fn an_isotropic_sheet_does_not_change_when_turned() {
        let sheet = isotropic_sheet(0.2, Plane::Strain).expect("admissible");
        assert!(
            (turned(sheet.stiffness(), 0.7) - sheet.stiffness()).norm() < 1e-12 * sheet.stiffness().norm()
        );
    }

    #[test]
    fn inadmissible_constants_are_refused_and_the_bound_is_named() {
        for (poisson, plane) in
            [(-1.0, Plane::Stress), (1.0, Plane::Stress), (0.5, Plane::Strain), (f64::NAN, Plane::Strain)]
        {
            let refused = isotropic_sheet(poisson, plane).expect_err("refused");
            assert!(matches!(refused, ElasticError::Poisson { .. }), "{refused}");
        }
        let refused = isotropic_sheet(0.5, Plane::Strain).expect_err("refused");
        assert!(refused.to_string().contains("incompressible"), "{refused}");
        assert!(isotropic_sheet(0.5, Plane::Stress).is_ok() && isotropic_sheet(0.499, Plane::Strain).is_ok());
        assert_eq!(
            fibres(3.0, 0.0).expect_err("refused"),
            ElasticError::PoissonOrthotropic { value: 3.0, bound: 3.0 }
        );
        assert!(fibres(2.9, 0.0).is_ok());
        let constants = Constants::Isotropic { young: 1e308, poisson: 0.0, plane: Plane::Stress };
        assert_eq!(Elastic::new(constants, 1e10), Err(ElasticError::Range));
        assert!(matches!(Elastic::new(constants, 0.0), Err(ElasticError::NotPositive { .. })));
    }

    #[test]
    fn von_mises_of_uniaxial_tension_is_the_tension() {
        let sheet = isotropic_sheet(0.33, Plane::Stress).expect("admissible");
        assert!((sheet.von_mises([1e-3, -0.33e-3, 0.0]) - 1.0).abs() < 1e-13);
        // Equal strains in all directions of the plane, none across: 2 nu - 1 of the in-plane stress.
        let slice = isotropic_sheet(0.25, Plane::Strain).expect("admissible");
        let pressure = slice.stress([1e-3, 1e-3, 0.0])[0];
        assert!((slice.von_mises([1e-3, 1e-3, 0.0]) - 0.5 * pressure).abs() < 1e-13);
    }
}
