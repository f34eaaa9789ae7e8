//! The truth that flocking rules are compared with: plane linear elasticity by finite elements.
//!
//! This room does not use flocks. A body is given by its shape: a [`ShapeProblem`] has the outline, a [`Material`] in plane
//! stress or plane strain, and holds and pulls parts of it. [`solve_shape()`] meshes it with quadratic triangles, solves
//! for the displacement in equilibrium by a sparse direct factorisation, refines, and states its own error. The
//! [`ShapeSolution`] gives displacement and stress anywhere, energy, and the reactions of supports.
//!
//! Units are the caller's as long as they are coherent; the docs say metre, newton, N/m2. The frame is the
//! mesh's: x to the right, y up, nodes of a cell counter-clockwise, angles counter-clockwise. Voigt order
//! is xx, yy, xy with the engineering shear strain. Results do not depend on a thread count: every sum has
//! a fixed order and the factorisation runs on the calling thread.
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
//! Files: `shape_problem` and `shape_solve` (a shape, solved), `outline_mesh` with `curves`, `size` and `delaunay` (its mesh),
//! `mesh`, `element` (shape functions, quadrature), `material`, `problem` (what is asked on one mesh),
//! `strain` (small, or of bodies that turn), `assemble` and `solve` (K u = f), `newton` (the same where
//! bodies turn), `solution` and `recover` (what follows), `locate`
//! (which cell holds a point), `error`.

mod assemble;
#[cfg(test)]
mod by_hand;
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
mod size;
mod solution;
mod solve;
mod strain;

pub use error::FemError;
pub use material::{Material, Orthotropic, Plane, Stress};
pub use mesh::Mesh;
pub use shape_problem::{Field, Holding, PortionTraction, ShapeProblem, Support, TractionField, WayField};
pub use shape_solve::{Effort, EstimatedError, Level, Reaction, ShapeSolution, solve_shape};
pub use solution::Solution;
pub use strain::Strain;
