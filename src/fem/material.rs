//! Linear elasticity in the plane: stress = D strain, both in Voigt order xx, yy, xy with the
//! engineering shear strain gamma_xy = 2 epsilon_xy.
//!
//! Sources: S. P. Timoshenko and J. N. Goodier, "Theory of Elasticity", 3rd ed. (1970), articles 16 and
//! 17 (plane stress, plane strain); R. M. Jones, "Mechanics of Composite Materials", 2nd ed. (1999),
//! sections 2.5 (plane stress of an orthotropic ply) and 2.6 (rotation).

use super::error::FemError;

/// The assumption about the direction out of the plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// A thin sheet, free to change its thickness: sigma_zz = 0.
    Stress,
    /// A long prism, held between rigid walls: epsilon_zz = 0.
    Strain,
}

/// The four constants of an orthotropic sheet in its own axes 1, 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orthotropic {
    /// Young's modulus along 1 [N/m2], above 0.
    pub e1: f64,
    /// Young's modulus along 2 [N/m2], above 0.
    pub e2: f64,
    /// Contraction along 2 under tension along 1 [-]; nu21 = nu12 e2 / e1. Between
    /// -sqrt(e1/e2) and sqrt(e1/e2), exclusive.
    pub nu12: f64,
    /// Shear modulus [N/m2], above 0.
    pub g12: f64,
}

/// A homogeneous elastic sheet or slice. Always admissible: the constructors refuse the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    stiffness: [[f64; 3]; 3],
    out_of_plane: [f64; 3],
    thickness: f64,
}

/// Parts of a body that are of other materials.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inclusions {
    pub(super) materials: Vec<Material>,
    /// By cell of the mesh: 0 is none, others count from 1; empty where there are no inclusions.
    pub(super) of_cell: Vec<u32>,
}

impl Inclusions {
    /// The material of a cell; `body` is the one outside inclusions.
    pub fn material<'a>(&'a self, cell: usize, body: &'a Material) -> &'a Material {
        let number = self.of_cell.get(cell).copied().unwrap_or(0);
        number.checked_sub(1).map_or(body, |k| &self.materials[k as usize])
    }

    /// The number that a cell shares with all cells of the same material.
    pub(super) fn kind(&self, cell: usize, body: &Material) -> u32 {
        let own = self.material(cell, body);
        if own == body {
            return 0;
        }
        self.materials.iter().position(|material| material == own).map_or(0, |k| k as u32 + 1)
    }
}

/// Stress at a point, components along the axes of the mesh [N/m2].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stress {
    /// Normal stress along x.
    pub xx: f64,
    /// Normal stress along y.
    pub yy: f64,
    /// Shear stress.
    pub xy: f64,
    /// Normal stress out of the plane: 0 in plane stress.
    pub zz: f64,
}

impl Stress {
    /// Von Mises equivalent stress [N/m2]:
    /// sqrt(((xx-yy)^2 + (yy-zz)^2 + (zz-xx)^2) / 2 + 3 xy^2) (R. von Mises, 1913).
    pub fn von_mises(&self) -> f64 {
        let (a, b, c) = (self.xx - self.yy, self.yy - self.zz, self.zz - self.xx);
        (0.5 * (a * a + b * b + c * c) + 3.0 * self.xy * self.xy).sqrt()
    }
}

impl Material {
    /// Isotropic: Young's modulus `young` [N/m2], Poisson's ratio `poisson` [-], `thickness` \[m\].
    ///
    /// Admissible is what keeps the strain energy of a plane deformation positive: in plane stress
    /// -1 < nu < 1 (a sheet cut from an isotropic solid has nu <= 0.5; a two-dimensional lattice may have
    /// more), in plane strain -1 < nu < 0.5.
    ///
    /// # Errors
    /// [`FemError::Inadmissible`] names the constant that is out of range or not finite.
    pub fn isotropic(young: f64, poisson: f64, plane: Plane, thickness: f64) -> Result<Material, FemError> {
        let (highest, range) = match plane {
            Plane::Stress => (1.0, "-1 < nu < 1 (plane stress)"),
            Plane::Strain => (0.5, "-1 < nu < 0.5 (plane strain)"),
        };
        positive("Young's modulus", young)?;
        if !(poisson > -1.0 && poisson < highest) {
            return Err(FemError::Inadmissible {
                quantity: "Poisson's ratio nu",
                value: poisson,
                range: range.into(),
            });
        }
        let shear = young / (2.0 * (1.0 + poisson));
        // First Lame constant, and its plane-stress counterpart 2 lambda mu / (lambda + 2 mu).
        let (lambda, out_of_plane) = match plane {
            Plane::Stress => (young * poisson / (1.0 - poisson * poisson), [0.0; 3]),
            Plane::Strain => {
                let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
                (lambda, [lambda, lambda, 0.0])
            }
        };
        let direct = lambda + 2.0 * shear;
        let stiffness = [[direct, lambda, 0.0], [lambda, direct, 0.0], [0.0, 0.0, shear]];
        Ok(Material { out_of_plane, ..Material::from_stiffness(stiffness, thickness)? })
    }

    /// Orthotropic in plane stress, its axis 1 at `angle` \[rad\] counter-clockwise from x.
    ///
    /// # Errors
    /// [`FemError::Inadmissible`] names the constant that is out of range or not finite.
    pub fn orthotropic(sheet: Orthotropic, angle: f64, thickness: f64) -> Result<Material, FemError> {
        let Orthotropic { e1, e2, nu12, g12 } = sheet;
        positive("E1", e1)?;
        positive("E2", e2)?;
        positive("G12", g12)?;
        let bound = (e1 / e2).sqrt();
        if nu12.abs() >= bound || !nu12.is_finite() {
            let range = format!("|nu12| < sqrt(E1/E2) = {bound}");
            return Err(FemError::Inadmissible { quantity: "nu12", value: nu12, range });
        }
        let nu21 = nu12 * e2 / e1;
        let d = 1.0 / (1.0 - nu12 * nu21);
        let own = [[e1 * d, nu12 * e2 * d, 0.0], [nu12 * e2 * d, e2 * d, 0.0], [0.0, 0.0, g12]];
        Material::from_stiffness(rotated(own, angle), thickness)
    }

    /// Any anisotropic sheet in plane stress from its `stiffness` D [N/m2] (Voigt xx, yy, xy, engineering
    /// shear) and `thickness` \[m\].
    ///
    /// # Errors
    /// [`FemError::BadStiffness`] unless D is finite, symmetric to 1e-12 of its largest entry and positive
    /// definite; [`FemError::Inadmissible`] unless the thickness is above 0.
    pub(crate) fn from_stiffness(stiffness: [[f64; 3]; 3], thickness: f64) -> Result<Material, FemError> {
        positive("thickness", thickness)?;
        let d = &stiffness;
        let largest = d.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        if !d.iter().flatten().all(|v| v.is_finite()) {
            return Err(FemError::BadStiffness { lacking: "finite" });
        }
        if (0..3).any(|i| (0..i).any(|j| (d[i][j] - d[j][i]).abs() > 1e-12 * largest)) {
            return Err(FemError::BadStiffness { lacking: "symmetric" });
        }
        if !positive_definite(d) {
            return Err(FemError::BadStiffness { lacking: "positive definite" });
        }
        Ok(Material { stiffness, out_of_plane: [0.0; 3], thickness })
    }

    /// The matrix D [N/m2].
    pub fn stiffness(&self) -> &[[f64; 3]; 3] {
        &self.stiffness
    }

    /// Thickness out of the plane \[m\].
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Stress for a strain [exx, eyy, gxy] [-].
    pub fn stress(&self, strain: [f64; 3]) -> Stress {
        let along = |row: &[f64; 3]| row[0] * strain[0] + row[1] * strain[1] + row[2] * strain[2];
        let [xx, yy, xy] = [0, 1, 2].map(|i| along(&self.stiffness[i]));
        Stress { xx, yy, xy, zz: along(&self.out_of_plane) }
    }
}

fn positive(quantity: &'static str, value: f64) -> Result<(), FemError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(FemError::Inadmissible { quantity, value, range: "above 0, finite".into() })
}

/// Sylvester's criterion.
fn positive_definite(d: &[[f64; 3]; 3]) -> bool {
    let minor = |i: usize, j: usize| d[1][i] * d[2][j] - d[1][j] * d[2][i];
    let det = d[0][0] * minor(1, 2) - d[0][1] * minor(0, 2) + d[0][2] * minor(0, 1);
    d[0][0] > 0.0 && d[0][0] * d[1][1] - d[0][1] * d[1][0] > 0.0 && det > 0.0
}

/// D in the frame of the mesh when the material's axes are turned by `angle` \[rad\]: T' D T, with T the
/// transformation of engineering strains from the mesh's axes to the material's.
fn rotated(d: [[f64; 3]; 3], angle: f64) -> [[f64; 3]; 3] {
    let (s, c) = angle.sin_cos();
    let t = [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]];
    let mut out = [[0.0; 3]; 3];
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        out[i][j] = (0..9).map(|k| t[k / 3][i] * d[k / 3][k % 3] * t[k % 3][j]).sum();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniaxial_tension_in_plane_stress_returns_young_and_poisson() {
        let m = Material::isotropic(1000.0, 0.33, Plane::Stress, 1.0).unwrap();
        let s = m.stress([1e-3, -0.33e-3, 0.0]);
        assert!((s.xx - 1.0).abs() < 1e-12 && s.yy.abs() < 1e-12 && s.zz == 0.0);
        assert!((s.von_mises() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn von_mises_is_root_three_times_a_pure_shear_and_zero_for_equal_pressure_all_around() {
        let shear = Stress { xy: -2.0, ..Stress::default() };
        assert!((shear.von_mises() - 12.0_f64.sqrt()).abs() < 1e-15);
        assert_eq!(Stress { xx: -5.0, yy: -5.0, zz: -5.0, xy: 0.0 }.von_mises(), 0.0);
        let bent = Stress { xx: 3.0, yy: -1.0, zz: 2.0, xy: 1.0 };
        assert!((bent.von_mises() - 16.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn plane_strain_carries_poisson_times_the_sum_out_of_the_plane() {
        let m = Material::isotropic(210e9, 0.3, Plane::Strain, 1.0).unwrap();
        let s = m.stress([1e-4, 3e-4, 2e-4]);
        assert!((s.zz / (0.3 * (s.xx + s.yy)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn poisson_ratios_outside_the_bounds_of_each_assumption_are_refused() {
        for (plane, bad) in
            [(Plane::Stress, [-1.0, 1.0, f64::NAN]), (Plane::Strain, [-1.0, 0.5, f64::INFINITY])]
        {
            for nu in bad {
                let refused = Material::isotropic(1.0, nu, plane, 1.0);
                assert!(
                    matches!(refused, Err(FemError::Inadmissible { quantity: "Poisson's ratio nu", .. })),
                    "{nu}"
                );
            }
        }
        assert!(Material::isotropic(1.0, 0.7, Plane::Stress, 1.0).is_ok());
        assert!(Material::isotropic(0.0, 0.3, Plane::Stress, 1.0).is_err());
        assert!(Material::isotropic(1.0, 0.3, Plane::Stress, -1.0).is_err());
    }

    #[test]
    fn an_orthotropic_sheet_with_equal_constants_is_isotropic_at_any_angle() {
        let (e, nu) = (70.0, 0.25);
        let sheet = Orthotropic { e1: e, e2: e, nu12: nu, g12: e / (2.0 * (1.0 + nu)) };
        let turned = Material::orthotropic(sheet, 0.7, 2.0).unwrap();
        let plain = Material::isotropic(e, nu, Plane::Stress, 2.0).unwrap();
        for i in 0..9 {
            assert!((turned.stiffness[i / 3][i % 3] - plain.stiffness[i / 3][i % 3]).abs() < 1e-12);
        }
    }

    #[test]
    fn a_quarter_turn_swaps_the_two_stiff_directions_and_a_fibre_at_45_degrees_couples_shear() {
        let sheet = Orthotropic { e1: 140e9, e2: 10e9, nu12: 0.3, g12: 5e9 };
        let at = |angle: f64| *Material::orthotropic(sheet, angle, 1.0).unwrap().stiffness();
        let (zero, quarter, eighth) =
            (at(0.0), at(std::f64::consts::FRAC_PI_2), at(std::f64::consts::FRAC_PI_4));
        assert!((zero[0][0] - quarter[1][1]).abs() < 1e-3 && (zero[1][1] - quarter[0][0]).abs() < 1e-3);
        assert!(eighth[0][2] > 1e9, "extension along x must call for shear of the fibre's sign");
    }

    #[test]
    fn an_orthotropic_ratio_past_the_energy_bound_and_a_bad_matrix_are_refused() {
        let sheet = Orthotropic { e1: 4.0, e2: 1.0, nu12: 2.0, g12: 1.0 };
        assert!(matches!(Material::orthotropic(sheet, 0.0, 1.0), Err(FemError::Inadmissible { .. })));
        let lacking = |d| match Material::from_stiffness(d, 1.0) {
            Err(FemError::BadStiffness { lacking }) => lacking,
            other => panic!("{other:?}"),
        };
        assert_eq!(lacking([[1.0, 0.2, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]]), "symmetric");
        assert_eq!(lacking([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "positive definite");
        assert_eq!(lacking([[f64::NAN; 3]; 3]), "finite");
    }
}
