//! Rule and truth side by side: how far a flocking rule is from the elasticity of the same body.
//!
//! The truth is plane elasticity on the shape itself, linear or, where the rule is corotated, of the stretches of a body that
//! turns, by finite elements on a mesh that does not use the lattice, so fine that its stated
//! error does not show in the measures.
//!
//! * [`supports`]: the roles of particles to what holds the shape.
//! * [`mod@reference`]: what holds and what pulls the shape, to its displacement and stress.
//! * [`run`]: both of a scene, measured; [`run::plan()`] plans a scene whose leaders follow the truth.
//! * [`measures`]: the differences of two displacements of one body.
//! * [`places`]: both at the places that a scene names.
//! * [`split`]: which part of an error is the solver's, the outline's and the cells'.
//!
//! ```
//! use std::ops::ControlFlow;
//! use flockform::study::compare::run::compare;
//! use flockform::fem::Effort;
//! use flockform::scene::bundled;
//!
//! let scene = bundled("beam").expect("bundled").load(&[])?;
//! let compared = compare(&scene, &Effort::default(), &mut |_engine, _residual| ControlFlow::Continue(()))?;
//! assert!(compared.comparison.displacement_rel_l2 < 0.005);
//! # Ok::<(), flockform::scene::SceneError>(())
//! ```
//!
//! Shapes follow the particles and the cells of the body. Units are the scene's; a stress is in
//! \[force / length^2\].

pub mod measures;
pub mod places;
pub mod reference;
pub mod run;
pub mod split;
pub mod supports;
