//! Rule and truth side by side: how far a flocking rule is from the elasticity of the same body.
//!
//! The truth is plane linear elasticity on exactly the body's geometry, the union of its cells, by finite
//! elements fine enough that what is left of their own error does not show in the measures.
//!
//! * [`mesh`]: the cells of a body to a mesh many times finer, which knows where the particles are in it.
//! * [`truth`]: what is held and what pulls on the particles, to the truth's displacement and stress.
//! * [`measures`]: two displacements of one body to the numbers that tell them apart.
//!
//! Shapes follow the particles and the cells of the body. Units are the scene's; a stress is in
//! \[force / length^2\].

pub mod measures;
pub mod mesh;
pub mod truth;
