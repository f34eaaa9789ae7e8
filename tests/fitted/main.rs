//! Bodies that keep their outline: what they promise, against closed forms, published figures and exact resultants.

mod benchmarks;
mod convergence;
mod inclusions;
mod iterations;
mod outlines;
mod speed;
mod support;
