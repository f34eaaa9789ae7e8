//! How fast a disturbance dies out, behind prompt poses and behind late ones.

use super::{Convergence, longest_delay};
use crate::scene::swarm::Swarm;
use crate::solve::spectrum::LinearSweep;
use crate::swarm::formation::Formation;

/// Sweeps made to find the spectral radius.
const MOST_SWEEPS: usize = 5000;

fn linear_sweep(formation: &Formation) -> Option<LinearSweep<'_>> {
    let engine = formation.engine()?;
    let frame = engine.body().frame.as_ref();
    LinearSweep::new(engine.flock(), frame, engine.roles(), engine.update(), MOST_SWEEPS)
}

pub(super) fn convergence(formation: &Formation, swarm: &Swarm) -> Option<Convergence> {
    let found = linear_sweep(formation)?.radius();
    let factor = found.radius.powf(swarm.raw.control.sweeps as f64);
    let halves = factor < 1.0;
    let half_life_s = halves.then(|| swarm.raw.control.period * half_life(factor));
    Some(Convergence { factor, half_life_s })
}

/// Part of a disturbance that is left after a period under the simulated delay, where `prompt` is left without one; `None` where
/// finding it would take long.
pub(super) fn delayed_factor(formation: &Formation, swarm: &Swarm, prompt: f64) -> Option<f64> {
    let delay = longest_delay(swarm);
    if delay == 0 || !remembers(formation) {
        return Some(prompt.powf(1.0 / (f64::from(delay) + 1.0)));
    }
    linear_sweep(formation)?.delayed_radius(swarm.raw.control.sweeps, delay as usize)
}

/// Whether a frame of the formation remembers the last sweep: the others follow where robots are seen.
pub(super) fn remembers(formation: &Formation) -> bool {
    let frame = formation.engine().and_then(|engine| engine.body().frame.as_ref());
    frame.is_some_and(|frame| frame.rule.looks_before_the_sweep())
}

/// Periods in which what is left by this factor a period is a half; none is shorter than one.
pub(super) fn half_life(factor: f64) -> f64 {
    (0.5_f64.ln() / factor.max(f64::MIN_POSITIVE).ln()).max(1.0)
}
