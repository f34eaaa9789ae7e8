//! What elasticity says of a body: held particles and loads to the displacement and stress everywhere.

use std::collections::HashMap;

use super::mesh::{MeshError, TruthMesh};
use crate::fem::{self, FemError, PointForce, Problem, Side, Solution, Stress, solve};
use crate::flock::points::Points;
use crate::material::cells::Cells;
use crate::material::elastic::{Constants, Elastic, Plane};
use crate::material::loads::{LoadError, Loads};

/// A body with what holds it and what pulls it. Arrays follow the particles, shape \[particles\].
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    pub cells: &'a Cells,
    /// Where the particles are \[length\].
    pub reference: &'a Points,
    pub elastic: &'a Elastic,
    /// Displacements \[length\] of the particles that are led or clamped.
    ///
    /// Between two held particles that share a side of a cell, the side follows them in a straight line; a
    /// cell all of whose corners are held follows them throughout. A particle held by itself is held at
    /// a point: its neighbourhood then yields the more, the finer the truth is.
    pub held: &'a [Option<[f64; 2]>],
    /// Tractions are linear along their sides. A force on a particle acts at a point: there, and only
    /// there, the truth grows with the logarithm of the refinement.
    pub loads: &'a Loads,
}

/// The displacement of a body in equilibrium.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Displacement of each particle \[length\], shape \[particles\]; zero for those in no cell, which the
    /// truth knows nothing of.
    pub displacement: Points,
    mesh: TruthMesh,
    solution: Solution,
}

/// Why there is no truth. Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TruthError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error("{given} held displacements were given for {particles} particles")]
    HeldCount { given: usize, particles: usize },
    #[error(transparent)]
    Load(#[from] LoadError),
    #[error(
        "the truth has no equilibrium: the part of the body with particle {particle} is not held and free to {motion}"
    )]
    Mechanism { particle: usize, motion: &'static str },
    #[error(
        "the truth has no equilibrium: the body is soft beyond what a double resolves, most of all at particle {particle}; parts that hang together by one particle turn about it as on a hinge"
    )]
    Singular { particle: usize },
    #[error("the truth cannot be computed: {0}")]
    Fem(FemError),
}

impl Truth {
    /// Solves on a mesh of this refinement; see [`TruthMesh::default_refinement`].
    ///
    /// # Errors
    /// Names the particle at which the body is not held, the load that has no place, or what the mesh
    /// lacks.
    pub fn solve(setting: &Setting<'_>, refine: usize) -> Result<Self, TruthError> {
        let particles = setting.reference.len();
        if setting.held.len() != particles {
            return Err(TruthError::HeldCount { given: setting.held.len(), particles });
        }
        // For its checks: a load that particles cannot take has no place on their body either.
        setting.loads.on_particles(setting.cells, setting.reference)?;
        let mesh = TruthMesh::new(setting.cells, setting.reference, refine)?;
        let material = material(setting.elastic).map_err(TruthError::Fem)?;
        let mut problem = Problem::new(mesh.mesh().clone(), material);
        hold(&mut problem, &mesh, setting.held);
        pull(&mut problem, &mesh, setting);
        let solution = solve(&problem).map_err(|error| at_particle(error, &mesh))?;
        let at_node = |node: usize| [solution.ux()[node], solution.uy()[node]];
        let displacement = (0..particles).map(|i| mesh.node_of(i).map_or([0.0; 2], at_node)).collect();
        Ok(Self { displacement, mesh, solution })
    }

    pub fn mesh(&self) -> &TruthMesh {
        &self.mesh
    }

    /// The finite-element solution itself.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// Whether the particle is a corner of a cell, so that the truth knows where it goes.
    pub fn knows(&self, particle: usize) -> bool {
        self.mesh.node_of(particle).is_some()
    }

    /// Displacement \[length\] at points \[length\] of the undeformed body, shape \[points\].
    ///
    /// # Errors
    /// Names the first point that lies in no cell.
    pub fn displacements_at(&self, points: &Points) -> Result<Points, TruthError> {
        let found = self.solution.displacements_at(&points.x, &points.y).map_err(TruthError::Fem)?;
        Ok(found.into_iter().collect())
    }

    /// Strain energy \[force length\].
    pub fn strain_energy(&self) -> f64 {
        self.solution.strain_energy()
    }

    /// Von Mises stress \[force / length^2\] of the truth itself at the centres of the body's cells, recovered
    /// from the small elements, shape \[cells\]. What a rule is measured against is coarser: the stress that
    /// the cells have if their corners go where the truth takes them ([`super::measures::von_mises`]).
    pub fn von_mises_at(&self, centres: &Points) -> Result<Vec<f64>, TruthError> {
        let stress = self.solution.recovered_at(&centres.x, &centres.y).map_err(TruthError::Fem)?;
        Ok(stress.iter().map(Stress::von_mises).collect())
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

/// Prescribes every node all of whose carriers are held.
fn hold(problem: &mut Problem, mesh: &TruthMesh, held: &[Option<[f64; 2]>]) {
    let field: Points = held.iter().map(|u| u.unwrap_or_default()).collect();
    for node in 0..mesh.mesh().node_count() {
        if mesh.carriers(node).all(|(particle, _)| held[particle as usize].is_some()) {
            let u = mesh.interpolate(node, &field);
            problem.prescribe(&[node as u32], |_, _| u);
        }
    }
}

fn pull(problem: &mut Problem, mesh: &TruthMesh, setting: &Setting<'_>) {
    // The finite elements take forces per volume and per area.
    let thickness = setting.elastic.thickness();
    problem.body_force = setting.loads.body.map(|b| b / thickness);
    let on_node = |&(particle, force): &(u32, [f64; 2])| {
        mesh.node_of(particle as usize).map(|node| PointForce { node: node as u32, force })
    };
    problem.forces.extend(setting.loads.forces.iter().filter_map(on_node));
    let parts = if setting.loads.tractions.is_empty() { HashMap::new() } else { parts_of_sides(mesh) };
    for traction in &setting.loads.tractions {
        let [a, b] = traction.side;
        let [from, to] = traction.side.map(|i| setting.reference.get(i as usize));
        let (along, [at_a, at_b]) = ([to[0] - from[0], to[1] - from[1]], traction.at_ends);
        let square = along[0] * along[0] + along[1] * along[1];
        let at = |[x, y]: [f64; 2]| {
            let t = ((x - from[0]) * along[0] + (y - from[1]) * along[1]) / square;
            [0, 1].map(|k| ((1.0 - t) * at_a[k] + t * at_b[k]) / thickness)
        };
        let sides = parts.get(&[a.min(b), a.max(b)]).map_or(&[][..], Vec::as_slice);
        problem.pull_with(sides, |point, _| at(point));
    }
}

/// The sides of small elements that make up each side of a cell on the boundary, by its end particles,
/// the lower first.
fn parts_of_sides(mesh: &TruthMesh) -> HashMap<[u32; 2], Vec<Side>> {
    let mut parts: HashMap<[u32; 2], Vec<Side>> = HashMap::new();
    for side in mesh.mesh().boundary() {
        let nodes = mesh.mesh().cell(side.cell as usize);
        // A boundary side lies on a side of a cell, so its middle has that side's ends for carriers.
        let middle = nodes[mesh.mesh().kind().corners() + side.side as usize] as usize;
        let mut ends = mesh.carriers(middle).map(|(particle, _)| particle);
        if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
            parts.entry([a.min(b), a.max(b)]).or_default().push(side);
        }
    }
    parts
}

/// Nodes mean nothing to whoever wrote the scene; the particle that counts most at the node does.
fn at_particle(error: FemError, mesh: &TruthMesh) -> TruthError {
    let nearest = |node: usize| {
        let largest = mesh.carriers(node).max_by(|a, b| a.1.total_cmp(&b.1));
        largest.map_or(0, |(particle, _)| particle as usize + 1)
    };
    match error {
        FemError::Mechanism { node, motion } => TruthError::Mechanism { particle: nearest(node), motion },
        FemError::Singular { node } => TruthError::Singular { particle: nearest(node) },
        other => TruthError::Fem(other),
    }
}
