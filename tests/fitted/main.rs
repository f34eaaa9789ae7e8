//! Bodies that keep their outline: what they promise, against closed forms, published figures and exact resultants.

mod benchmarks;
mod bundled;
mod convergence;
#[path = "../common/folders.rs"]
mod folders;
mod inclusions;
mod invariance;
mod iterations;
mod locking;
mod outlines;
mod pushed;
mod rollers;
#[path = "../common/scenes.rs"]
mod scenes;
mod speed;
mod support;
