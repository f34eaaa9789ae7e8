//! The particles that a report and a film show of a body of which each rank has a part: as many as a page and the first rank can
//! hold.

use rayon::prelude::*;

use crate::engine::Engine;
use crate::flock::body::Body;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;

/// Most particles of a sample, but for some along an outline: of a page, and of a film, whose pixels are as many.
const MOST: [usize; 2] = [20_000, 240_000];

/// Particles spread evenly over a body in parts; which they are does not depend on the number of ranks. The first rank receives
/// their values.
#[derive(Debug)]
pub(in crate::export) struct Sample {
    team: Team,
    /// Those of this part.
    own: Vec<usize>,
    /// How many each rank has, shape \[ranks\].
    counts: Vec<usize>,
    /// How many times as coarse as the body's the lattice is whose sites it takes.
    pub stride: usize,
    /// Where they stand before they move \[length\]; of the first rank.
    pub reference: Vectors,
    /// Their ids; of the first rank.
    pub ids: Vec<u32>,
}

/// How many times as coarse as the body's the lattice is whose sites a sample takes.
fn stride_of(total: usize, films: bool) -> usize {
    let most = MOST[usize::from(films)];
    let least = total.div_ceil(most).isqrt().max(1);
    if least * least * most < total { least + 1 } else { least }
}

/// Particles of a sample, at most or nearly so.
pub(super) fn size_of(total: usize, films: bool) -> usize {
    total.div_ceil(stride_of(total, films).pow(2))
}

impl Sample {
    /// The sample of a body in parts, for a film or a page alone; `None` of a whole one.
    pub fn of(engine: &Engine, films: bool) -> Option<Self> {
        let (body, team) = (engine.body(), engine.parted()?.clone());
        let stride = stride_of(body.total(), films);
        let own = every(body, stride);
        let counts = team.each([own.len() as u64]).into_iter().map(|[count]| count as usize).collect();
        let sample = Self { team, own, counts, stride, reference: Vectors::default(), ids: Vec::new() };
        let (x, y) = (sample.numbers(|i| body.reference.x[i]), sample.numbers(|i| body.reference.y[i]));
        let ids = sample.words(|i| body.id(i) as u64).into_iter().map(|id| id as u32).collect();
        Some(Self { reference: Vectors { x, y }, ids, ..sample })
    }

    /// Particles of all ranks.
    pub fn count(&self) -> usize {
        self.counts.iter().sum()
    }

    /// The particles as a body, as many times as far apart as those of one with this `spacing` \[length\].
    pub fn body(&self, spacing: f64) -> Body {
        Body::of_places(self.reference.clone(), self.stride as f64 * spacing)
    }

    /// Whether this rank receives what all have.
    pub fn is_received(&self) -> bool {
        self.team.is_first()
    }

    /// A word of each particle, for the first rank; nothing for the others.
    pub fn words(&self, of: impl Fn(usize) -> u64 + Sync) -> Vec<u64> {
        let own: Vec<u64> = self.own.par_iter().map(|&i| of(i)).collect();
        let all = self.team.gather(&own, &self.counts);
        if self.is_received() { all } else { Vec::new() }
    }

    /// A number of each particle, for the first rank.
    pub fn numbers(&self, of: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        self.words(|i| of(i).to_bits()).into_iter().map(f64::from_bits).collect()
    }
}

/// The particles of a part that stand at the sites of a lattice as many times as coarse, and of those that an outline has moved
/// off their sites one of so many.
fn every(body: &Body, stride: usize) -> Vec<usize> {
    let coarser = stride as i32;
    let is_taken = |&i: &usize| match body.index_after_all(i) {
        Some(index) => index.is_multiple_of(stride),
        None => {
            let site = body.sites[i];
            site.iter().all(|k| k.rem_euclid(coarser) == 0) && body.lattice.is_site(site.map(|k| k / coarser))
        }
    };
    body.owned().filter(is_taken).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;
    use std::ops::ControlFlow;

    use super::super::frames::Frame;
    use super::super::recorder::{AnimationState, LOAD_FRAMES, RunRecorder, von_mises};
    use super::*;
    use crate::continuum::equilibrium::{run_to_equilibrium_shared, run_to_equilibrium_watched};
    use crate::continuum::mechanics::Stresses;
    use crate::continuum::plan::Plan;
    use crate::engine::observer::EachStep;
    use crate::ranks::in_process;
    use crate::scene::Scene;
    use crate::scene::bundled::bundled;

    fn scene(name: &str, sets: &[&str]) -> Scene {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        bundled(name).expect("bundled").load(&sets).unwrap_or_else(|error| panic!("{error}"))
    }

    /// A plate whose outline cuts cells, pulled at its right end.
    fn plate() -> Scene {
        let text = r#"
            title = "A plate"
            lattice = { kind = "hexagonal", spacing = 1.0 }
            rule = { mean = { kind = "material" } }
            material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
            body.shape = { kind = "polygon", vertices = [[0, 0], [200, -3.4], [205, 95.7], [1, 93]] }
            body.holes = [{ kind = "disc", centre = [90, 50], radius = 20.3 }]
            stop.steps = 4

            [[roles]]
            region = { kind = "edge", side = "left", depth = 2.0 }
            role = "clamped"

            [[roles]]
            region = { kind = "edge", side = "right", depth = 2.0 }
            role = "leader"
            motion = { kind = "velocity", per_step = [0.1, 0.0] }
            "#;
        Scene::parse("plate", "plate", text, &[], None).unwrap_or_else(|error| panic!("{error}"))
    }

    /// What the first of so many ranks keeps: its recorder, and what it would leave in a checkpoint.
    fn recorded(scene: &Scene, ranks: usize, left: Option<&AnimationState<'static>>) -> RunRecorder {
        let of_rank = |team: Team| {
            let plan = Plan::of_part(scene, &team).unwrap_or_else(|error| panic!("{error}"));
            let (mut recorder, mut left) = (None, left.cloned());
            let mut see = |engine: &Engine, _: f64| {
                RunRecorder::open(&mut recorder, &mut left, (scene, engine, false)).watch(engine);
                ControlFlow::Continue(())
            };
            let mut observer = EachStep(&mut see);
            let outcome = run_to_equilibrium_shared(scene, plan, None, &team, &mut observer).expect("an end");
            let mut recorder = recorder.expect("it has looked");
            recorder.close(scene, &outcome);
            recorder
        };
        std::thread::scope(|scope| {
            let ranks: Vec<_> =
                in_process(ranks).into_iter().map(|team| scope.spawn(|| of_rank(team))).collect();
            let mut kept = ranks.into_iter().map(|rank| rank.join().expect("no panic"));
            let first = kept.next().expect("there is one");
            // The others have let go of what they sent.
            let is_empty = |frame: &Frame| frame.tracks.iter().all(|track| track.values().is_empty());
            assert!(kept.all(|other| other.frames.kept.iter().all(is_empty)));
            first
        })
    }

    /// In place of a step.
    const END: usize = usize::MAX;

    /// Displacements and von Mises stresses of a run alone, in each step and at the end; stresses are recovered at the end.
    fn alone(scene: &Scene) -> HashMap<usize, (Vectors, Vec<f64>)> {
        let mut seen = HashMap::new();
        let mut see = |engine: &Engine, _: f64| {
            seen.insert(engine.step(), (engine.displacements(), Stresses::von_mises_of_cells(engine)));
            ControlFlow::Continue(())
        };
        let plan = Plan::new(scene).expect("can be laid out");
        let end = run_to_equilibrium_watched(scene, plan, &mut EachStep(&mut see)).expect("an end").engine;
        seen.insert(END, (end.displacements(), von_mises(Stresses::at_present(&end))));
        seen
    }

    #[test]
    fn a_sample_has_the_values_of_a_run_alone_on_any_number_of_ranks() {
        let grid = "body.shape={kind=\"grid\",columns=200,rows=102}";
        let few = "stop.steps=4";
        for (scene, stride) in [
            (scene("tension", &[grid, few]), 2),
            (scene("lattice-honeycomb", &[few]), 1),
            (plate(), 2),
            (scene("beam-loaded", &[]), 1),
        ] {
            let expected = alone(&scene);
            let first = recorded(&scene, 1, None);
            let sample = first.sample.as_ref().expect("a part");
            assert_eq!(sample.stride, stride, "{}", scene.name);
            let has_stresses = expected.values().all(|(_, stresses)| !stresses.is_empty());
            let last = first.frames.kept.len() - 1;
            for (k, frame) in first.frames.kept.iter().enumerate() {
                // One that was solved for at once is shown on its way there, in proportion to the load.
                let (is_solved, part) = (scene.is_solved_at_once(), frame.step as f64 / LOAD_FRAMES as f64);
                let part = if is_solved { part } else { 1.0 };
                let at = if is_solved || k == last { END } else { frame.step };
                let (displaced, stresses) = &expected[&at];
                let of = |channel: usize, all: &dyn Fn(usize) -> f64| {
                    let found = frame.tracks[channel].values();
                    assert_eq!(found.len(), sample.ids.len());
                    let quantum = f64::from(frame.tracks[channel].exponent).exp2();
                    for (&id, found) in sample.ids.iter().zip(found) {
                        let expected = part * all(id as usize - 1);
                        let is_near = (found - expected).abs() <= 0.51 * quantum;
                        assert!(
                            is_near || (found.is_nan() && expected.is_nan()),
                            "{id}: {found} for {expected}"
                        );
                    }
                };
                of(0, &|i| displaced.x[i]);
                of(1, &|i| displaced.y[i]);
                assert_eq!(frame.tracks.len(), if has_stresses { 6 } else { 5 });
                if has_stresses {
                    of(5, &|i| stresses[i]);
                }
            }
            let other = recorded(&scene, 3, None);
            assert!(other.animation_state() == first.animation_state(), "{}", scene.name);
            assert_eq!(other.sample.as_ref().map(|sample| &sample.ids), Some(&sample.ids));
        }
    }

    #[test]
    fn a_sample_is_spread_evenly_and_of_few_particles_there_are_all() {
        for (films, most) in [(false, MOST[0]), (true, MOST[1])] {
            for total in [0, 1, most - 1, most, most + 1, 4 * most, 4 * most + 1, 1_000_000_000] {
                let stride = stride_of(total, films);
                assert!(stride == 1 || (stride - 1).pow(2) * most < total, "{total}: {stride}");
                assert!(size_of(total, films) <= most && stride >= 1, "{total}: {stride}");
            }
        }
        let grid = "body.shape={kind=\"grid\",columns=200,rows=102}";
        let first = recorded(&scene("tension", &[grid, "stop.steps=1", "frame=none"]), 3, None);
        let sample = first.sample.as_ref().expect("a part");
        assert_eq!((sample.count(), sample.ids.len()), (100 * 51, 100 * 51));
        let apart =
            |of: &[f64]| of.windows(2).map(|two| two[1] - two[0]).filter(|d| *d > 0.0).collect::<Vec<_>>();
        let spacing = 2.0 * (sample.reference.y[1] - sample.reference.y[0]) / 2.0;
        assert!(apart(&sample.reference.x).iter().all(|d| (d - spacing).abs() < 1e-9 * spacing));
    }

    #[test]
    fn frames_of_the_same_sample_are_gone_on_with_and_those_of_a_whole_body_are_not() {
        let scene = scene("tension", &["stop.steps=6"]);
        let state = |recorder: &RunRecorder| {
            let text = serde_json::to_string(&recorder.animation_state()).expect("written");
            serde_json::from_str::<AnimationState<'static>>(&text).expect("read")
        };
        let first = recorded(&scene, 2, None);
        let steps =
            |recorder: &RunRecorder| recorder.frames.kept.iter().map(|frame| frame.step).collect::<Vec<_>>();
        let again = recorded(&scene, 3, Some(&state(&first)));
        // Their last steps are the same.
        assert_eq!(steps(&again).len(), 2 * steps(&first).len() - 1, "those of before, and its own");
        let mut whole = None;
        let plan = Plan::new(&scene).expect("can be laid out");
        let mut see = |engine: &Engine, _: f64| {
            RunRecorder::open(&mut whole, &mut None, (&scene, engine, false)).watch(engine);
            ControlFlow::Continue(())
        };
        run_to_equilibrium_watched(&scene, plan, &mut EachStep(&mut see)).expect("an end");
        let other = recorded(&scene, 3, Some(&state(&whole.expect("it has looked"))));
        assert_eq!(steps(&other), steps(&first));
    }
}
