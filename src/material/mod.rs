//! Rules that carry a material: Young's modulus and Poisson's ratio to weights, and back.
//!
//! The barycentre rule (Eq. 1) moves a particle to the mean of its neighbours. As a continuum that
//! is a Laplace equation for each coordinate, a material of Poisson's ratio -1, and no choice of
//! positive scalar weights is any other. This room replaces the scalar weights by 2x2 matrices taken
//! from a material, and the rule stays what it was, neighbours in and target position out:
//!
//! ```text
//! x_i <- sum_j W_ij x_j + rest_i      W_ij = D_i^-1 K_ij      D_i = sum_j K_ij      sum_j W_ij = 1
//! rest_i = X_i - sum_j W_ij X_j + D_i^-1 f_i
//! ```
//!
//! `X` are the reference positions, `f_i` is the load on the particle, and `K_ij` is minus the
//! off-diagonal 2x2 block of the stiffness that the cells between the particles would have as finite
//! elements. A fixed point of the rule is then exactly the equilibrium of those elements; the rule is
//! one relaxation of it that needs only the neighbours. Where the body ends the cells are simply
//! missing, and the missing cells *are* the free edge: no frame is needed.
//!
//! The way through the room, one file each:
//!
//! * [`elastic`]: engineering constants, refused where no stable material has them, to the 3x3
//!   stiffness of the sheet.
//! * [`cells`]: the cells of a body: rectangles, triangles or hexagons between its particles.
//! * [`boundary`]: the sides along the edge of the cells, and the outline that they make.
//! * [`fit`]: bodies whose outline is kept: cells that the shape cuts, along it.
//! * [`stiffness`]: what one cell resists: bilinear rectangle, parallelogram of assumed stress, constant-strain triangle, and the
//!   lowest-order virtual element for any polygon.
//! * [`dilatation`]: near nu = 1/2, the mean over the cells around a particle in place of each cell's own.
//! * [`mechanism`]: whether the cells hold the body together, or a hinge lets it fold.
//! * [`weights`]: cells and neighbours to `K_ij`, `D_i` and `W_ij`, kept by class of particles.
//! * [`outline_loads`]: what acts on the outline, on particles or on all of the body to the forces `f_i`.
//! * [`homogenise`]: the way back, from the weights of an interior particle, matrices or scalars, to
//!   the material that they are.
//! * [`place`]: any place of a body, from the particles around it.
//! * [`recovery`]: stress at the outline from the stress of the cells.
//! * [`zone`]: over all waves on the lattice: is the rule stable, and how much must a synchronous
//!   update be damped?
//!
//! Displacements are small: a rotation of the whole body by a finite angle strains it, unless the rule that
//! applies the weights is corotated ([`Rotation`](crate::flock::rules::Rotation)). The shapes of arrays follow
//! the particles of the body they belong to; a stiffness is that of the whole thickness of the sheet
//! \[force / length\].
//!
//! ```
//! use flockform::flock::{body::{Body, Cut}, lattice::{Lattice, LatticeKind}, rules::Rotation};
//! use flockform::material::{cells::Cells, elastic::{Constants, Elastic, Plane}, weights};
//!
//! let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0, 0.0], 0.0);
//! let cut = Cut::Count { columns: 5, rows: 5 };
//! let neighbourhood = flockform::material::cells::neighbourhood(&lattice);
//! let (body, neighbours) = Body::build(lattice, &cut, &neighbourhood, None)?;
//! let steel = Constants::Isotropic { young: 210e9, poisson: 0.3, plane: Plane::Stress };
//! let cells = Cells::of_body(&body);
//! let steel = Elastic::new(steel, 1e-3)?;
//! let weights = weights::assemble(&cells, &body, &neighbours, &steel, Rotation::Small)?;
//! assert_eq!(weights.of(12).len(), 8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod boundary;
pub mod cells;
pub mod dilatation;
pub mod elastic;
pub mod fit;
pub mod free_edge;
pub mod gradient;
pub mod homogenise;
pub mod mechanism;
pub mod outline_loads;
pub mod place;
pub mod recovery;
pub mod report;
pub mod stiffness;
pub mod stress;
pub mod weights;
pub mod zone;

pub use crate::flock::block::Block;
