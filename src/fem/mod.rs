//! The truth that flocking rules are compared with: plane linear elasticity by finite elements.
//!
//! This room does not use flocks. It takes a [`Mesh`] of triangles or quadrilaterals, linear or
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
//! A body can also be given by its shape alone: a [`ShapeProblem`] has the outline, holds and pulls parts of it, and
//! [`solve_shape()`] meshes it, refines, and states its own error.
//!
//! ```
//! use flockform::fem::{Effort, Material, Plane, ShapeProblem, solve_shape};
//! use flockform::geometry::outline::Outline;
//! use flockform::geometry::portion::Portion;
//!
//! // Cook's membrane: the left edge clamped, the right edge under shear of resultant 1.
//! let outline = Outline::of_polygons(&[vec![[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]]]).expect("an outline");
//! let material = Material::isotropic(1.0, 1.0 / 3.0, Plane::Stress, 1.0)?;
//! let mut membrane = ShapeProblem::new(&outline, material);
//! membrane.hold(vec![Portion::whole(0, 3)], |_| [0.0, 0.0]);
//! membrane.pull(vec![Portion::whole(0, 1)], |_, _| [0.0, 1.0 / 16.0]);
//! let solved = solve_shape(&membrane, &Effort::default())?;
//! assert!((solved.displacements_at(&[[48.0, 52.0]])?[0][1] / 23.965 - 1.0).abs() < 1e-3);
//! assert!(solved.error().displacement < 1e-4);
//! # Ok::<(), flockform::fem::FemError>(())
//! ```
//!
//! Files: `mesh` and `shapes` (the body), `outline_mesh` with `curves`, `size` and `delaunay` (a mesh of a shape),
//! `shape_problem` and `shape_solve` (a shape, solved), `element` (shape functions, quadrature), `material`, `problem`
//! (what is asked), `strain` (small, or of bodies that turn), `assemble` and `solve` (K u = f), `newton` (the same where
//! bodies turn), `solution` and `recover` (what follows), `locate`
//! (which cell holds a point), `error`.

mod assemble;
mod curves;
mod delaunay;
mod element;
mod error;
mod locate;
mod material;
mod mesh;
mod newton;
mod outline_mesh;
mod problem;
mod recover;
mod shape_problem;
mod shape_solve;
mod shapes;
mod size;
mod solution;
mod solve;
mod strain;

pub use element::CellKind;
pub use error::FemError;
pub use material::{Inclusions, Material, Orthotropic, Plane, Stress};
pub use mesh::{Mesh, Side};
pub use outline_mesh::{MeshRequest, OutlineMesh, OutlineSide};
pub use problem::{Axis, Fixed, PointForce, Problem, Traction};
pub use shape_problem::{
    Field, Holding, PlaneRegion, PortionTraction, ShapeProblem, Support, TractionField, WayField,
};
pub use shape_solve::{Effort, EstimatedError, Level, Reaction, ShapeSolution, solve_shape};
pub use solution::Solution;
pub use solve::solve;
pub use strain::Strain;
