//! Finite elements against exact solutions, and the term that makes a rule's error fall as they do.

#[cfg(feature = "fem")]
mod convergence;
#[cfg(feature = "fem")]
#[path = "../common/reference.rs"]
mod reference;
#[path = "../common/scenes.rs"]
mod scenes;
mod second_gradient;
#[cfg(feature = "fem")]
mod shapes;
