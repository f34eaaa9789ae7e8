//! When a scene's body grows instead of coming to rest, predicted and measured, and extreme input.
//!
//! [`thresholds`] predicts the feedback factors and the damping beyond which the sweep grows, from its
//! spectrum; [`bisection`] finds them by running the body; [`extremes`] runs it, and small bodies made for
//! the purpose, where numbers and shapes are as bad as they come. [`study::run`] does all of it.
//!
//! Delay has no threshold: a swarm's targets are places, so with poses `d` periods late the sweep `M` becomes
//! `x(k+1) = M x(k-d)`, whose growth per step is that of `M` to the power `1/(d+1)` (`tests/swarm` measures it).

pub mod bisection;
pub mod extremes;
mod scaling;
pub mod study;
pub mod subject;
pub mod thresholds;
