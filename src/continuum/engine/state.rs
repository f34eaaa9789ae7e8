//! An engine on its way, taken out and put back to the bit.
//!
//! The contents of a plan (the body, its neighbours, weights, loads, the leaders' motions) are no part of the
//! state: they are planned again, and [`digest`] shows whether they came out the same.

use serde::{Deserialize, Serialize};

use super::{Engine, Led};
use crate::continuum::plan::Plan;
use crate::continuum::serde_impls;
use crate::flock::fracture::Break;
use crate::flock::law::Weights;
use crate::flock::role::Role;
use crate::flock::vectors::Vectors;
use crate::sweep::Activity;

/// Everything that steps have changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EngineState {
    step: usize,
    /// Positions now and before the last step \[length\], shape \[count\].
    #[serde(with = "serde_impls::points")]
    present: Vectors,
    #[serde(with = "serde_impls::points")]
    previous: Vectors,
    #[serde(with = "serde_impls::roles")]
    roles: Vec<Role>,
    leaders: Vec<Leading>,
    guided: Vec<(usize, [f64; 2])>,
    #[serde(with = "serde_impls::breaks")]
    breaks: Vec<Break>,
    /// Where something moved in the last step, and what was swept so far.
    activity: Activity,
    /// Whether each bond is broken, eight to a byte; absent where none can break.
    broken: Option<Vec<u8>>,
}

/// A particle under a leader's program, as the engine keeps it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Leading {
    particle: usize,
    change: usize,
    which: usize,
    since: usize,
    base: [f64; 2],
}

/// A state that belongs to another plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the state has {found} {what}, the plan {planned}: it belongs to another body")]
pub struct WrongState {
    pub what: &'static str,
    pub found: usize,
    pub planned: usize,
}

impl EngineState {
    pub fn of(engine: &Engine) -> Self {
        let leading = |&Led { particle, change, which, since, base }: &Led| Leading {
            particle,
            change,
            which,
            since,
            base,
        };
        let flock = &engine.flock;
        let packed = |byte: usize, bonds: &crate::flock::fracture::Bonds| {
            let all = 8 * byte..(8 * byte + 8).min(flock.neighbours.index.len());
            all.fold(0, |bits, bond| bits | u8::from(bonds.is_broken(bond)) << (bond % 8))
        };
        let bytes = flock.neighbours.index.len().div_ceil(8);
        Self {
            step: engine.step,
            present: engine.present.clone(),
            previous: engine.previous.clone(),
            roles: engine.roles.clone(),
            leaders: engine.leaders.iter().map(leading).collect(),
            guided: engine.guided.clone(),
            breaks: engine.breaks.clone(),
            activity: engine.activity.clone(),
            broken: flock.bonds.as_ref().map(|bonds| (0..bytes).map(|byte| packed(byte, bonds)).collect()),
        }
    }

    /// Steps taken.
    pub fn step(&self) -> usize {
        self.step
    }

    /// The engine of this plan, in this state.
    ///
    /// # Errors
    /// A state of another body. A plan with as many of everything is taken for the right one: hold its
    /// [`digest`] against that of the plan that was run.
    pub fn engine(self, plan: Plan) -> Result<Engine, WrongState> {
        let mut engine = Engine::new(plan);
        self.require_fits(&engine)?;
        let led =
            |Leading { particle, change, which, since, base }| Led { particle, change, which, since, base };
        engine.step = self.step;
        engine.follow_ramp();
        engine.present = self.present;
        engine.previous = self.previous;
        engine.roles = self.roles;
        engine.leaders = self.leaders.into_iter().map(led).collect();
        engine.led = engine.leaders.iter().map(|led| led.particle).collect();
        engine.guided = self.guided;
        engine.breaks = self.breaks;
        if let (Some(bonds), Some(broken)) = (&mut engine.flock.bonds, &self.broken) {
            bonds.set_broken(|bond| broken[bond / 8] >> (bond % 8) & 1 == 1);
        }
        engine.rebuild_caches();
        engine.activity = self.activity;
        Ok(engine)
    }

    fn require_fits(&self, engine: &Engine) -> Result<(), WrongState> {
        let count = engine.body.count();
        let require = |what, found, planned| {
            if found == planned { Ok(()) } else { Err(WrongState { what, found, planned }) }
        };
        require("particles", self.present.len(), count)?;
        require("former places", self.previous.len(), count)?;
        require("roles", self.roles.len(), count)?;
        let bits = engine.flock.bonds.as_ref().map(|_| engine.flock.neighbours.index.len().div_ceil(8));
        require("bytes of bonds", self.broken.as_ref().map_or(0, Vec::len), bits.unwrap_or(0))?;
        // A number from a file is an index only when it is below what it counts.
        let require_below = |what, found: usize, planned: usize| {
            if found < planned { Ok(()) } else { Err(WrongState { what, found, planned }) }
        };
        for led in &self.leaders {
            require_below("role changes", led.change, engine.changes.len())?;
            require_below(
                "particles of a role change",
                led.which,
                engine.changes[led.change].particles.len(),
            )?;
            require_below("led particles", led.particle, count)?;
            require_below("steps of a leader", led.since, self.step.saturating_add(1))?;
        }
        for (particle, _) in &self.guided {
            require_below("guided particles", *particle, count)?;
        }
        for particle in self.breaks.iter().flat_map(|one| one.pair) {
            require_below("particles of broken bonds", particle as usize, count)?;
        }
        Ok(())
    }
}

impl Engine {
    /// Finds again what follows from roles, bonds and positions that were put in from outside.
    fn rebuild_caches(&mut self) {
        if let Some(present) = &mut self.present_neighbours {
            present.members = self.roles.iter().map(|role| role.is_body()).collect();
            if self.step > 0 {
                // Those of a step are found where it begins.
                let super::PresentNeighbours { radius, grid, members } = present;
                self.flock.neighbours.rebuild_within(grid, &self.previous, members, *radius);
            }
        }
        self.compile_sweep();
    }
}

/// A fingerprint of everything in a plan that its run depends on, to distinguish plans: 64 bits,
/// FNV-1a (G. Fowler, L. C. Noll, K.-P. Vo). Not secure against forgery.
pub fn digest(plan: &Plan) -> u64 {
    let mut digest = Fnv(0xcbf2_9ce4_8422_2325);
    let Plan { body, flock, update, present_radius, roles, changes, cuts, stop, probes, ramp, .. } = plan;
    digest.points(&body.reference);
    digest.text(&format!("{update:?} {present_radius:?} {stop:?} {:?} {cuts:?}", flock.rule));
    roles.iter().for_each(|role| digest.text(role.name()));
    flock.neighbours.starts.iter().for_each(|start| digest.bytes(&start.to_le_bytes()));
    flock.neighbours.index.iter().for_each(|index| digest.bytes(&index.to_le_bytes()));
    match &flock.weights {
        Weights::Equal => {}
        Weights::Scalar(weights) => digest.numbers(weights),
        Weights::Matrix(weights) => {
            weights.class.iter().for_each(|class| digest.bytes(&class.to_le_bytes()));
            weights.blocks.iter().flatten().for_each(|row| digest.numbers(row));
        }
    }
    flock.forces.iter().chain(&flock.rest).for_each(|points| digest.points(points));
    if let Some(ramp) = ramp {
        digest.text(&format!("ramp {ramp}"));
    }
    if let Some(bonds) = &flock.bonds {
        digest.text(&format!("{:?} {:?}", bonds.threshold, bonds.ghosts));
    }
    for change in changes {
        let what = format!("{:?} {} {:?} {:?}", change.role, change.from, change.when, change.motion);
        digest.text(&what);
        change.particles.iter().for_each(|&particle| digest.bytes(&(particle as u64).to_le_bytes()));
    }
    probes.iter().for_each(|&probe| digest.bytes(&(probe as u64).to_le_bytes()));
    if body.numbering.is_some() {
        // The files written so far have these ids, in this order.
        body.rows().for_each(|i| digest.bytes(&(body.id(i) as u64).to_le_bytes()));
    }
    digest.0
}

struct Fnv(u64);

impl Fnv {
    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// With its length, so that two texts are not one.
    fn text(&mut self, text: &str) {
        self.bytes(&(text.len() as u64).to_le_bytes());
        self.bytes(text.as_bytes());
    }

    fn numbers(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.bytes(&number.to_bits().to_le_bytes()));
    }

    fn points(&mut self, points: &Vectors) {
        self.numbers(&points.x);
        self.numbers(&points.y);
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::continuum::run::{Outcome, StopReason, Watch, resume, run};
    use crate::scene::{Scene, bundled};

    fn scene(name: &str, sets: &[&str]) -> Scene {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        bundled(name).expect("bundled").load(&sets).expect("valid")
    }

    fn plan(scene: &Scene) -> Plan {
        Plan::new(scene).expect("can be laid out")
    }

    /// The state, and what depends on the neighbours: PE1 and the residual, then how the run ended.
    fn bits(outcome: &Outcome) -> (EngineState, Vec<u64>, String) {
        let engine = &outcome.engine;
        let pe1 = (0..engine.body().count()).map(|i| engine.pe1(i));
        let numbers = pe1.chain([outcome.residual]).map(f64::to_bits).collect();
        (EngineState::of(engine), numbers, format!("{:?}", outcome.reason))
    }

    /// Runs whole, and again broken off at every one of `at`, through bytes.
    fn continues_to_the_same_end(name: &str, sets: &[&str], at: &[usize]) {
        let scene = scene(name, sets);
        let whole = run(plan(&scene), &mut |_, _| ControlFlow::Continue(()));
        for &step in at {
            let mut kept = None;
            let _ = run(plan(&scene), &mut |engine, residual| {
                if engine.step() == step {
                    kept = Some((EngineState::of(engine), residual));
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(())
            });
            let (state, residual) = kept.expect("came that far");
            let mut seen = 0;
            let mut see = |_: &Engine, _: f64| {
                seen += 1;
                ControlFlow::Continue(())
            };
            let watch = Watch { next: &|step| step + 1, see: &mut see };
            let resumed = resume(plan(&scene), state, residual, watch);
            let resumed = resumed.expect("the same body");
            assert!(bits(&resumed) == bits(&whole), "{name} from step {step}");
            assert_eq!(
                seen,
                whole.engine.step() - step,
                "{name} from step {step}: every new step is shown once"
            );
        }
    }

    #[test]
    fn a_run_taken_up_again_at_any_step_ends_with_the_same_bits() {
        continues_to_the_same_end("tension", &["stop.steps=45"], &[0, 1, 19, 20, 21, 44, 45]);
        continues_to_the_same_end("tension", &["stop.steps=45", "update.order=sequential"], &[1, 20, 33]);
        continues_to_the_same_end("tension", &["stop.tolerance=1e-3"], &[20, 100]);
        // Without a frame only what moves is swept, and what is known of that comes back too.
        let free = ["frame=none", "record.probes=[]", "stop.steps=45"];
        continues_to_the_same_end("tension", &free, &[0, 1, 7, 20, 21, 45]);
    }

    #[test]
    fn a_load_that_grows_goes_on_growing() {
        let growing = [
            "frame=none",
            "neighbours={kind=\"cells\"}",
            "material={kind=\"isotropic\",young=1000.0,poisson=0.33}",
            "rule={mean={kind=\"material\"}}",
            "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]",
            "loads=[{kind=\"body\",force=[0.0,-1.0]}]",
            "record={}",
            "stop.steps=60",
            "load_steps={ramp={steps=40}}",
        ];
        continues_to_the_same_end("tension", &growing, &[0, 1, 39, 40, 60]);
    }

    #[test]
    fn broken_bonds_and_ghosts_come_back() {
        continues_to_the_same_end("fracture", &[], &[0, 60, 100, 140]);
    }

    #[test]
    fn neighbours_found_anew_at_every_step_are_found_again() {
        continues_to_the_same_end("drop", &["stop.steps=40"], &[0, 1, 20, 40]);
    }

    #[test]
    fn a_run_that_had_come_to_rest_takes_no_further_step() {
        let scene = scene("tension", &["stop.tolerance=1e-3", "stop.steps=20000"]);
        let whole = run(plan(&scene), &mut |_, _| ControlFlow::Continue(()));
        assert_eq!(whole.reason, StopReason::Equilibrium);
        let state = EngineState::of(&whole.engine);
        let watch = Watch { next: &|step| step + 1, see: &mut |_, _| ControlFlow::Continue(()) };
        let resumed = resume(plan(&scene), state, whole.residual, watch);
        assert!(bits(&resumed.expect("the same body")) == bits(&whole));
    }

    #[test]
    fn a_state_of_another_body_is_refused() {
        let state = EngineState::of(&Engine::new(plan(&scene("tension", &[]))));
        let error = state.engine(plan(&scene("fracture", &[]))).expect_err("another body");
        assert!(error.to_string().contains("144 particles"), "{error}");
    }

    #[test]
    fn the_digest_distinguishes_plans_by_what_a_run_depends_on() {
        let of = |sets: &[&str]| digest(&plan(&scene("tension", sets)));
        let plain = of(&[]);
        assert_eq!(plain, of(&["title=another", "record.figures=[3]"]));
        let others = [
            "lattice.spacing=2",
            "stop.steps=9",
            "roles[1].motion.per_step=[0.6, 1e-9]",
            "update.damping=0.9",
        ];
        for other in others {
            assert_ne!(plain, of(&[other]), "{other}");
        }
    }
}
