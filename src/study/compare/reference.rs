//! The elasticity of a shape: from supports and loads to displacement and stress everywhere.
//!
//! The truth is solved on a mesh of the shape, which knows nothing of the lattice; the particles are asked for
//! afterwards.

use std::collections::BTreeMap;

use crate::continuum::layout::Layout;
pub use crate::fem::Effort;
use crate::fem::{
    self, EstimatedError, FemError, Level, ShapeProblem, ShapeSolution, Strain, Stress, Support, solve_shape,
};
use crate::flock::rules::Rotation;
use crate::flock::vectors::Vectors;
use crate::geometry::Point;
use crate::geometry::outline::Outline;
use crate::geometry::portion::Portion;
use crate::material::elastic::{Constants, Elastic, Plane};
use crate::material::outline_loads::Load;
use crate::scene::Scene;

/// Particles this part of the spacing outside the outline are still on it: they stand on it but for rounding.
const OUTSIDE: f64 = 1e-3;

/// A shape of a scene's materials with what holds it and what pulls it.
pub struct Setting<'a> {
    /// The scene of the shape.
    pub scene: &'a Scene,
    /// The body whose particles are asked for, with the edges of inclusions where there are any.
    pub layout: &'a Layout,
    /// The material of the shape without its inclusions.
    pub elastic: &'a Elastic,
    /// The outline of the shape.
    pub outline: &'a Outline,
    /// Its supports and where they hold it; where supports overlap the later one holds.
    pub supports: Vec<Support<'a>>,
    /// On the outline, over the thickness of the sheet. A force on a particle acts at a point: there, and only there, the
    /// truth grows with the logarithm of the refinement.
    pub loads: &'a [Load],
}

/// The displacement of a shape in equilibrium.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Displacement of each particle \[length\], shape \[particles\]; zero for those more than a spacing outside the shape.
    pub displacement: Vectors,
    is_known: Vec<bool>,
    solution: ShapeSolution,
    spacing: f64,
}

impl Reference {
    /// Solves until the truth's own error is what `effort` asks for.
    ///
    /// # Errors
    /// Names the place at which the shape is not held, or what keeps it from being meshed.
    pub fn solve(setting: Setting<'_>, effort: &Effort) -> Result<Self, FemError> {
        Self::solve_with(setting, Vec::<(_, fn(Point, Point) -> Point)>::new(), effort)
    }

    /// The same with more that pushes portions of the outline \[force / length\], as a function of place and normal.
    pub(super) fn solve_with<'a>(
        setting: Setting<'a>,
        more: Vec<(Vec<Portion>, impl Fn(Point, Point) -> Point + 'a)>,
        effort: &Effort,
    ) -> Result<Self, FemError> {
        let Setting { scene, layout, elastic, outline, supports, loads } = setting;
        let (reference, spacing) = (&layout.body.reference, layout.body.lattice.spacing());
        let mut problem = ShapeProblem::new(outline, material(elastic)?);
        if let Some(partition) = &layout.partition {
            let parts = partition.regions().iter().zip(&scene.inclusions);
            let all = parts.map(|(region, part)| Ok((region, material(&part.material)?)));
            problem.inclusions = all.collect::<Result<_, FemError>>()?;
            problem.interfaces = partition.lines().copied().collect();
        }
        problem.strain = match scene.rotation() {
            Rotation::Small => Strain::Small,
            Rotation::Corotated => Strain::Stretch,
        };
        problem.reach = OUTSIDE * spacing;
        problem.supports = supports;
        let thickness = elastic.thickness();
        pull(&mut problem, loads, reference, thickness);
        for (portions, push) in more {
            problem.pull(portions, move |p, n| push(p, n).map(|f| f / thickness));
        }
        let solution = solve_shape(&problem, effort)?;
        let is_within = |p: Point| outline.contains(p) || outline.nearest(p).1 <= OUTSIDE * spacing;
        let is_known: Vec<bool> = reference.iter().map(is_within).collect();
        let places: Vec<Point> =
            reference.iter().zip(&is_known).filter(|(_, known)| **known).map(|(p, _)| p).collect();
        let mut found = solution.displacements_within(&places, spacing)?.into_iter();
        // Beside the shape, but at corners of cells that are compared: as the nearest part of it goes on.
        let beside = |p: Point| solution.displacements_within(&[p], spacing).map_or([0.0; 2], |at| at[0]);
        let of =
            |(p, &known): (Point, &bool)| if known { found.next().unwrap_or_default() } else { beside(p) };
        let displacement = reference.iter().zip(&is_known).map(of).collect();
        Ok(Self { displacement, is_known, solution, spacing })
    }

    /// The error that the truth states of itself.
    pub fn error(&self) -> EstimatedError {
        self.solution.error()
    }

    /// The meshes that it was solved on, the coarsest first.
    pub fn levels(&self) -> &[Level] {
        self.solution.levels()
    }

    /// Nodes of the finest mesh.
    pub fn nodes(&self) -> usize {
        self.solution.solution().mesh().node_count()
    }

    /// Whether the particle is in the shape, so that the truth knows where it goes.
    pub fn knows(&self, particle: usize) -> bool {
        self.is_known[particle]
    }

    /// Displacement \[length\] at points \[length\] of the undeformed shape, or less than a spacing outside it, shape
    /// \[points\].
    ///
    /// # Errors
    /// Names the first point further outside.
    pub fn displacements_at(&self, points: &Vectors) -> Result<Vectors, FemError> {
        let places: Vec<Point> = points.iter().collect();
        Ok(self.solution.displacements_within(&places, self.spacing)?.into_iter().collect())
    }

    /// Strain energy \[force length\].
    pub fn strain_energy(&self) -> f64 {
        self.solution.strain_energy()
    }

    /// Stress \[force / length^2\] of the truth itself at places of the shape or less than a spacing outside
    /// it, shape \[places\]; of a body that turns, in axes that turn with it.
    ///
    /// # Errors
    /// Names the first place further outside.
    pub fn stress_at(&self, places: &Vectors) -> Result<Vec<Stress>, FemError> {
        let places: Vec<Point> = places.iter().collect();
        self.solution.stress_within(&places, self.spacing)
    }
}

fn material(elastic: &Elastic) -> Result<fem::Material, FemError> {
    match elastic.constants() {
        Constants::Isotropic { young, poisson, plane } => {
            let plane = match plane {
                Plane::Stress => fem::Plane::Stress,
                Plane::Strain => fem::Plane::Strain,
            };
            fem::Material::isotropic(young, poisson, plane, elastic.thickness())
        }
        Constants::Orthotropic { young: [e1, e2], poisson_12, shear, angle } => {
            let sheet = fem::Orthotropic { e1, e2, nu12: poisson_12, g12: shear };
            fem::Material::orthotropic(sheet, angle, elastic.thickness())
        }
    }
}

/// Finite elements take forces per area and per volume.
fn pull<'a>(problem: &mut ShapeProblem<'a>, loads: &'a [Load], reference: &Vectors, thickness: f64) {
    // However many loads push a particle, it is one point of the mesh.
    let mut forces: BTreeMap<u32, Point> = BTreeMap::new();
    for load in loads {
        match load {
            Load::Outline(load) => {
                problem.pull(load.portions.clone(), move |p, n| load.at(p, n).map(|t| t / thickness));
            }
            Load::Particles { particles, force } => {
                for &i in particles {
                    let pushed = forces.entry(i).or_insert([0.0; 2]);
                    *pushed = [0, 1].map(|axis| pushed[axis] + force[axis]);
                }
            }
            Load::Body(force) => {
                problem.body_force = [0, 1].map(|axis| problem.body_force[axis] + force[axis] / thickness);
            }
        }
    }
    problem.point_forces.extend(forces.into_iter().map(|(i, force)| (reference.get(i as usize), force)));
}
