//! The truth that flocking rules are compared with: plane linear elasticity by finite elements.
//!
//! This room knows nothing of flocks. It takes a [`Mesh`] of triangles or quadrilaterals, linear or
//! quadratic, a [`Material`] in plane stress or plane strain, what is held and what pulls (a [`Problem`]),
//! and [`solve()`]s for the displacement in equilibrium at small strain by a sparse direct factorisation.
//! The [`Solution`] gives stress at cells and points, energy, forces, and the displacement anywhere.
//!
//! Units are the caller's as long as they are coherent; the docs say metre, newton, N/m2. The frame is the
//! mesh's: x to the right, y up, nodes of a cell counter-clockwise, angles counter-clockwise. Voigt order
//! is xx, yy, xy with the engineering shear strain. Results do not depend on a thread count: every sum has
//! a fixed order and the factorisation runs on the calling thread.
//!
//! ```
//! use flockform::fem::{CellKind, Material, Mesh, Plane, Problem, solve};
//!
//! let mesh = Mesh::rectangle(CellKind::Quad9, [22, 22], [10.0, 10.0], [21.0, 21.0])?;
//! let material = Material::isotropic(1000.0, 0.33, Plane::Stress, 1.0)?;
//! let (clamped, pulled) = (mesh.nodes_where(|x, _| x == 10.0), mesh.boundary_where(|x, _| x == 21.0));
//! let mut beam = Problem::new(mesh, material);
//! beam.prescribe(&clamped, |_, _| [0.0, 0.0]);
//! beam.pull(&pulled, [0.0, 50.0]);
//! let truth = solve(&beam)?;
//! let tip = truth.displacements_at(&[21.0], &[15.5])?[0];
//! assert!(tip[1] > 0.0);
//! # Ok::<(), flockform::fem::FemError>(())
//! ```
//!
//! Files: `mesh` and `shapes` (the body), `element` (shape functions, quadrature), `material`, `problem`
//! (what is asked), `assemble` and `solve` (K u = f), `solution` and `recover` (what follows), `locate`
//! (which cell holds a point), `error`.

mod assemble;
mod curves;
mod delaunay;
mod element;
mod error;
mod locate;
mod material;
mod mesh;
mod outline_mesh;
mod problem;
mod recover;
mod shape_problem;
mod shape_solve;
mod shapes;
mod size;
mod solution;
mod solve;

pub use element::CellKind;
pub use error::FemError;
pub use material::{Material, Orthotropic, Plane, Stress};
pub use mesh::{Mesh, Side};
pub use outline_mesh::{MeshRequest, OutlineMesh, OutlineSide};
pub use problem::{Axis, Fixed, PointForce, Problem, Traction};
pub use shape_problem::{
    Field, Holding, PlaneRegion, PortionTraction, ShapeProblem, Support, TractionField,
};
pub use shape_solve::{Effort, EstimatedError, Level, Reaction, ShapeSolution, solve_shape};
pub use solution::Solution;
pub use solve::solve;
