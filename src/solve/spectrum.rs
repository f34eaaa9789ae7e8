//! The spectral radius of a sweep: how fast a body relaxes, and when feedback makes it grow.
//!
//! For a linear rule the displacements obey d' = A d with the leaders held; A is applied by the sweep
//! itself to displacements from a reference at zero, so no matrix is built.

use super::sweep::{Sweep, Update};
use crate::flock::frame::Frame;
use crate::flock::interaction::Interaction;
use crate::flock::points::Points;
use crate::flock::role::Role;
use crate::flock::rules::Mean;

/// What power iteration found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralRadius {
    /// Largest modulus of an eigenvalue: the factor by which the slowest mode shrinks per step \[1\].
    pub radius: f64,
    pub iterations: usize,
    /// Whether the estimate had settled to 1e-9 when the iteration stopped.
    pub converged: bool,
}

/// Steps over which growth is averaged: even, since on a lattice whose sites are two-coloured the
/// spectrum is symmetric and one step swaps the two ends.
const WINDOW: usize = 64;

/// Spectral radius of the sweep with these roles, by power iteration on the followers and the frame.
///
/// `None` where the sweep is not linear (weights that depend on distance, power means) or where
/// nobody follows.
pub fn spectral_radius(
    interaction: &Interaction,
    frame: Option<&Frame>,
    roles: &[Role],
    update: Update,
    most_iterations: usize,
) -> Option<SpectralRadius> {
    if interaction.rule.mean != Mean::Barycentre || !roles.contains(&Role::Follower) {
        return None;
    }
    let count = roles.len();
    let linear = Interaction { reference: Points::zeros(count).into(), rest: None, ..interaction.clone() };
    let sweep = Sweep::compile(update, &linear, roles);
    // Any start with a share in every mode will do; this one has no symmetry to hide a mode behind.
    let moves = |role: Role| matches!(role, Role::Follower | Role::Frame);
    let start = |j: usize| if moves(roles[j]) { 1.0 + (j as f64 * 0.7391).sin() } else { 0.0 };
    let mut present: Points = (0..count).map(|j| [start(j), start(j)]).collect();
    let mut next = present.clone();
    let mut estimate = f64::NAN;
    for window in 1..=most_iterations.div_ceil(WINDOW) {
        let before = norm(&present);
        for _ in 0..WINDOW {
            next.clone_from(&present);
            sweep.step(&linear, frame, &present, &mut next);
            std::mem::swap(&mut present, &mut next);
        }
        let after = norm(&present);
        if after == 0.0 || before == 0.0 {
            return Some(SpectralRadius { radius: 0.0, iterations: window * WINDOW, converged: true });
        }
        let radius = ((after / before).ln() / WINDOW as f64).exp();
        let settled = (radius - estimate).abs() <= 1e-9 * radius;
        if settled || window * WINDOW >= most_iterations {
            return Some(SpectralRadius { radius, iterations: window * WINDOW, converged: settled });
        }
        estimate = radius;
        present.x.iter_mut().chain(&mut present.y).for_each(|v| *v /= after);
    }
    None
}

fn norm(points: &Points) -> f64 {
    points.x.iter().chain(&points.y).map(|v| v * v).sum::<f64>().sqrt()
}
