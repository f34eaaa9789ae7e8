//! The costs of capabilities that a scene does not name, and of those that it names.

use std::time::Instant;

use serde::Serialize;

use super::super::grid::{plan, stirred};
use super::super::machine::seconds_each;
use crate::continuum::plan::Plan;
use crate::continuum::record::{ProbeSeries, Snapshot};
use crate::engine::Engine;
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::solve::stopwatch::median;
use crate::sweep::domain::Share;
use crate::sweep::kernel::Component;
use crate::sweep::rows::Rows;
use crate::sweep::terms::Terms;

/// A step of the engine beside the bare loops over the same body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Capability {
    /// The capability, in words.
    pub name: &'static str,
    /// Median over the repetitions \[s\].
    pub seconds_per_step: f64,
    /// The same over that of the loops alone, which know of no capability: the median of the ratios of pairs taken in
    /// turn \[1\].
    pub over_bare_loops: f64,
}

/// The record taken in each step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Recorded {
    Nothing,
    Probes(usize),
    Everything,
}

use Recorded::{Everything, Nothing, Probes};

/// Each capability, the keys that name it, and what is recorded.
const NAMED: [(&str, &[&str], Recorded); 14] = [
    ("nothing named", &[], Nothing),
    ("fracture", &["fracture={stretch=3.0}"], Nothing),
    ("feedback, to the step before", &["rule.feedback={factor=-0.1,reference=\"previous\"}"], Nothing),
    ("feedback, to the start", &["rule.feedback={factor=-0.1,reference=\"initial\"}"], Nothing),
    ("Poisson term", &["rule.poisson={k=1e-6,axis=\"x\"}"], Nothing),
    ("damping", &["update.damping=0.9"], Nothing),
    ("weights", &["rule.weights={kind=\"list\",values=[1.0,2.0,1.5,0.5]}"], Nothing),
    ("lagged frame", &["frame=\"lagged\""], Nothing),
    ("immediate frame", &["frame=\"immediate\""], Nothing),
    ("mirrored frame", &["frame=\"mirror\""], Nothing),
    ("ghosts", &["roles=[{region={kind=\"edge\",side=\"left\"},role=\"ghost\"}]"], Nothing),
    ("100 probes in each step", &[], Probes(100)),
    ("recording each step", &[], Everything),
    ("neighbours by radius", &["neighbours={kind=\"within\",radius=1.5}"], Nothing),
];

/// Times steps of a square body of so many particles along each side, with each capability.
pub fn measure(side: usize, repetitions: usize, seconds: f64) -> Vec<Capability> {
    let mut bare = Bare::new(&plan([side; 2], &[]));
    let steps = bare.steps_in(seconds);
    NAMED
        .iter()
        .map(|&(name, keys, recorded)| {
            let mut engine = Engine::new(plan([side; 2], keys).setup);
            let mut time = || time(&mut engine, steps, recorded);
            time();
            let (mut times, mut ratios): (Vec<f64>, Vec<f64>) = (0..repetitions)
                .map(|_| (bare.time(steps), time()))
                .map(|(bare, engine)| (engine, engine / bare))
                .unzip();
            Capability { name, seconds_per_step: median(&mut times), over_bare_loops: median(&mut ratios) }
        })
        .collect()
}

fn time(engine: &mut Engine, steps: usize, recorded: Recorded) -> f64 {
    let reference = engine.body().reference.clone();
    engine.observe(stirred(&reference).enumerate());
    let count = if let Probes(count) = recorded { count.min(reference.len()) } else { 0 };
    let apart = reference.len() / count.max(1);
    let mut probes: Vec<ProbeSeries> = (0..count).map(|k| ProbeSeries::new(k * apart)).collect();
    let (begin, mut kept) = (Instant::now(), None);
    for _ in 0..steps {
        engine.advance();
        probes.iter_mut().for_each(|probe| probe.record(engine));
        if recorded == Everything {
            kept = Some(Snapshot::of(engine));
        }
    }
    std::hint::black_box((kept, probes));
    begin.elapsed().as_secs_f64() / steps as f64
}

/// The loops and nothing else.
struct Bare {
    rows: Rows,
    present: Vectors,
    next: Vectors,
}

impl Bare {
    fn new(plan: &Plan) -> Self {
        let follows: Vec<bool> = plan.setup.roles.iter().map(|&role| role == Role::Follower).collect();
        let present: Vectors = stirred(&plan.setup.body.reference).collect();
        Self {
            rows: Rows::compile(&plan.setup.flock, &follows, Share::whole()).expect("a barycentre"),
            next: present.clone(),
            present,
        }
    }

    fn steps_in(&mut self, seconds: f64) -> usize {
        self.time(1);
        (seconds / self.time(2)).clamp(1.0, 1e6) as usize
    }

    fn time(&mut self, steps: usize) -> f64 {
        seconds_each(steps, || (0..steps).for_each(|_| self.step()))
    }

    fn step(&mut self) {
        let bands = 0..self.rows.band_count();
        let Self { rows, present, next } = self;
        for (axis, present, next) in [(0, &present.x, &mut next.x), (1, &present.y, &mut next.y)] {
            let component =
                Component { axis, seen_from: 0, present, rest: None, force: None, begin: 0, next };
            rows.sweep(bands.clone(), 64, &mut [component], &Terms::NONE);
        }
        std::mem::swap(present, next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_capability_s_scene_is_accepted_and_steps() {
        let measured = measure(12, 1, 1e-5);
        assert_eq!(measured.len(), NAMED.len());
        assert!(measured.iter().all(|c| c.seconds_per_step > 0.0 && c.over_bare_loops > 0.0));
    }
}
