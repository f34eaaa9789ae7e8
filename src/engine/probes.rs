//! Probes: the history of a few particles, step by step.
//!
//! Where the body is laid out in parts the engine records it: the rank that owns a probed particle takes the steps between two
//! exchanges one at a time, with as many bands around its own as its particles will have seen by then, and sees each.

use serde::{Deserialize, Serialize};

use super::{Engine, serde_impls};
use crate::flock::vectors::Vectors;

/// The history of one particle: entry `t` is step `t`, the start included.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeSeries {
    /// Index of the particle in the whole body.
    pub particle: usize,
    /// Present positions \[length, world frame\].
    #[serde(with = "serde_impls::points")]
    pub positions: Vectors,
    /// First pseudo-energy \[length^2\].
    pub pe1: Vec<f64>,
    /// Second pseudo-energy \[length\].
    pub pe2: Vec<f64>,
}

impl ProbeSeries {
    /// A history without entries.
    pub fn new(particle: usize) -> Self {
        Self { particle, ..Self::default() }
    }

    /// Appends the present state of the particle, which must stand here; to be called once at the start and once after every
    /// step.
    pub fn record(&mut self, engine: &Engine) {
        let particle = engine.body.exact_particle(self.particle).expect("it stands here");
        self.positions.push(engine.present().get(particle));
        self.pe1.push(engine.pe1(particle));
        self.pe2.push(engine.pe2(particle));
    }

    fn truncate(&mut self, entries: usize) {
        let Self { positions: Vectors { x, y }, pe1, pe2, .. } = self;
        [x, y, pe1, pe2].into_iter().for_each(|of| of.truncate(entries));
    }
}

impl Engine {
    /// The histories that the engine records itself: of the particles of this part alone, and none of a whole body. There the
    /// recorder of a run has those that the scene asks for; of a body that is stepped by hand [`ProbeSeries::record`] makes them.
    pub fn probes(&self) -> &[ProbeSeries] {
        self.probes.as_deref().unwrap_or_default()
    }

    /// Begins the histories of those of these particles that belong to this part with the state that the body is in, or goes on
    /// with them.
    pub(crate) fn begin_probes(&mut self, all: Option<Vec<ProbeSeries>>) {
        let (body, owned) = (&self.body, self.body.owned());
        let own =
            |probe: &ProbeSeries| body.exact_particle(probe.particle).is_some_and(|i| owned.contains(&i));
        self.probes = all.map(|all| all.into_iter().filter(own).collect());
        self.record_probes();
    }

    /// Appends the step that the body is at, unless an earlier run has.
    pub(crate) fn record_probes(&mut self) {
        let Some(mut probes) = self.probes.take() else { return };
        let is_new = |probe: &&mut ProbeSeries| probe.positions.len() == self.step;
        probes.iter_mut().filter(is_new).for_each(|probe| probe.record(self));
        self.probes = Some(probes);
    }

    /// Forgets what came after a step.
    pub(super) fn forget_probes_after(&mut self, step: usize) {
        self.probes.iter_mut().flatten().for_each(|probe| probe.truncate(step + 1));
    }
}
