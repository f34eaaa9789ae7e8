//! Rule and truth side by side: how far a flocking rule is from the elasticity of the same body.
//!
//! The truth is plane linear elasticity on exactly the body's geometry, the union of its cells, by finite
//! elements fine enough that what is left of their own error does not show in the measures.
//!
//! * [`mesh`]: the cells of a body to a mesh many times finer, which knows where the particles are in it.
//! * [`truth`]: what is held and what pulls on the particles, to the truth's displacement and stress.
//! * [`run`]: both of a scene, measured; [`run::plan()`] is how a scene is planned whose leaders the truth leads.
//! * [`measures`]: two displacements of one body to the numbers that tell them apart.
//!
//! ```
//! use std::ops::ControlFlow;
//! use flockform::compare::run::compare;
//! use flockform::scene::bundled;
//!
//! let scene = bundled("beam").expect("bundled").load(&[])?;
//! let compared = compare(&scene, Some(2), &mut |_engine, _residual| ControlFlow::Continue(()))?;
//! assert!(compared.comparison.displacement_rel_l2 < 0.005);
//! # Ok::<(), flockform::scene::SceneError>(())
//! ```
//!
//! Shapes follow the particles and the cells of the body. Units are the scene's; a stress is in
//! \[force / length^2\].

pub mod measures;
pub mod mesh;
pub mod run;
pub mod truth;
