//! Equilibrium: every solver finds the same one, multigrid as fast on large bodies as on small ones.

#[cfg(feature = "bench")]
mod agreement;
#[cfg(feature = "bench")]
mod growth;
#[cfg(feature = "bench")]
mod refusals;
#[cfg(feature = "bench")]
mod reports;
#[path = "../common/scenes.rs"]
mod scenes;
mod scenes_at_rest;
mod slender;
#[cfg(feature = "bench")]
mod support;
