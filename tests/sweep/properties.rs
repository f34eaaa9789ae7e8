//! What must hold for any input: invariances, hulls, finiteness, determinism, and no panic.

use std::ops::ControlFlow;
use std::sync::Arc;

use flockform::continuum::plan::Plan;
use flockform::continuum::run::run;
use flockform::flock::motion::Motion;
use flockform::flock::rules::{
    Axis, CellAround, Corner, Element, Feedback, FeedbackReference, Load, Mean, Neighbour, OWN, Origin,
    ParticleState, PatchCell, Poisson, Rotation, Rule, pull,
};
use flockform::flock::vectors::Vectors;
use flockform::material::elastic::{Constants, Elastic};
use flockform::material::stiffness::{mean_gradients, triangle};
use flockform::scene::Scene;
use flockform::scene::bundled::SCENES;
use proptest::prelude::*;

use crate::scenes::{load, planned};

const LATTICES: [&str; 6] = [
    "lattice-square",
    "lattice-rectangular",
    "lattice-centred-rectangular",
    "lattice-hexagonal",
    "lattice-oblique",
    "lattice-honeycomb",
];

/// Rules whose result turns with the scene.
const ROTATE: [&str; 6] = [
    r#"rule={}"#,
    r#"rule.mean={kind="distance",power=1.5}"#,
    r#"rule={weights={kind="distance",power=-1.0}}"#,
    r#"rule.feedback={factor=-0.3}"#,
    r#"rule={mean={kind="spaced",spacing=0.9,power=-2.0},feedback={factor=-0.5,reference="previous"}}"#,
    r#"rule={rest="literal"}"#,
];

/// Rules that act on each coordinate by itself, so that the axes' direction matters: they move with
/// the scene and do not turn with it.
const MOVE_ONLY: [&str; 3] = [
    r#"rule.mean={kind="geometric"}"#,
    r#"rule.mean={kind="power",exponent=2.0}"#,
    r#"rule.poisson={k=-0.01}"#,
];

/// The literal mean is measured from the axes' zero: it does neither.
const NEITHER: &str = r#"rule={mean={kind="power",exponent=2.0,origin="world"},rest="literal"}"#;

fn plan(name: &str, overrides: &[&str]) -> Plan {
    planned(&load(name, overrides))
}

/// A body off its outline's symmetry, pulled obliquely at one side.
fn pulled(lattice: &str, rule: &str) -> Plan {
    plan(
        lattice,
        &[
            r#"body={shape={kind="rectangle",min=[3.0,4.0],max=[11.0,10.0]}}"#,
            r#"roles=[{region={kind="edge",side="left"},role="clamped"},{region={kind="edge",side="right"},role="leader",motion={kind="velocity",per_step=[0.1,0.04]}}]"#,
            "stop={steps=25}",
            "record={}",
            rule,
        ],
    )
}

#[derive(Clone, Copy, Debug)]
struct Rigid {
    angle: f64,
    shift: [f64; 2],
}

impl Rigid {
    fn turn(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [cos * x - sin * y, sin * x + cos * y]
    }

    fn apply(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.turn(point);
        [x + self.shift[0], y + self.shift[1]]
    }

    /// The same scene, drawn elsewhere and turned.
    fn of_plan(&self, mut plan: Plan) -> Plan {
        let reference: Vectors = plan.setup.body.reference.iter().map(|point| self.apply(point)).collect();
        plan.setup.body.reference = Arc::new(reference);
        plan.setup.flock.reference = plan.setup.body.reference.clone();
        if plan.setup.flock.rest.is_some() {
            plan.setup.flock.keep_rest();
        }
        if let Some(poisson) = &mut plan.setup.flock.rule.poisson {
            poisson.centre += self.shift[1];
        }
        for change in &mut plan.setup.changes {
            if let Some(Motion::Velocity { per_step }) = &mut change.motion {
                *per_step = self.turn(*per_step);
            }
        }
        plan
    }
}

fn end(plan: Plan) -> Vectors {
    run(plan, &mut |_, _| ControlFlow::Continue(())).engine.present().clone()
}

/// Largest distance between the moved result and the result of the moved scene.
fn disagreement(lattice: &str, rule: &str, rigid: Rigid) -> f64 {
    let there = end(rigid.of_plan(pulled(lattice, rule)));
    let here = end(pulled(lattice, rule));
    let apart = |(a, b): ([f64; 2], [f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
    here.iter().map(|point| rigid.apply(point)).zip(there.iter()).map(apart).fold(0.0, f64::max)
}

fn settings(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(settings(48))]

    #[test]
    fn results_move_and_turn_with_the_scene(
        lattice in 0..6usize, rule in 0..6usize, angle in -3.0..3.0f64, x in -50.0..50.0f64, y in -50.0..50.0f64,
    ) {
        let error = disagreement(LATTICES[lattice], ROTATE[rule], Rigid { angle, shift: [x, y] });
        prop_assert!(error < 1e-9, "{} {}: {error}", LATTICES[lattice], ROTATE[rule]);
    }

    #[test]
    fn results_of_coordinatewise_rules_move_with_the_scene(
        lattice in 0..6usize, rule in 0..3usize, x in -50.0..50.0f64, y in -50.0..50.0f64,
    ) {
        let error = disagreement(LATTICES[lattice], MOVE_ONLY[rule], Rigid { angle: 0.0, shift: [x, y] });
        prop_assert!(error < 1e-9, "{} {}: {error}", LATTICES[lattice], MOVE_ONLY[rule]);
    }

    #[test]
    fn an_affine_motion_of_the_boundary_is_reproduced_inside(
        lattice in 0..6usize,
        rotate in -180.0..180.0f64,
        stretch in prop::array::uniform2(0.5..2.0f64),
        shear in prop::array::uniform2(-0.5..0.5f64),
    ) {
        let motion = format!(
            "roles[0].motion={{kind=\"affine\",rotate={rotate},stretch={stretch:?},shear={shear:?},steps=10}}"
        );
        let plan = plan(LATTICES[lattice], &[&motion, "stop={steps=4000,tolerance=1e-16}"]);
        let program = plan.setup.changes[0].motion.clone().expect("led");
        let reference = plan.setup.body.reference.clone();
        let present = end(plan);
        for (i, (place, start)) in present.iter().zip(reference.iter()).enumerate() {
            let [dx, dy] = program.displacement(10.0, 0, start);
            let error = (place[0] - start[0] - dx).hypot(place[1] - start[1] - dy);
            // Coordinates of order 10.
            prop_assert!(error < 1e-12 * 10.0, "{}, particle {}: {error}", LATTICES[lattice], i + 1);
        }
    }
}

#[test]
fn the_rules_that_do_not_turn_or_move_with_the_scene_are_those_listed() {
    let turn = Rigid { angle: 0.7, shift: [0.0, 0.0] };
    let shift = Rigid { angle: 0.0, shift: [20.0, 30.0] };
    for rule in MOVE_ONLY {
        assert!(disagreement("lattice-square", rule, turn) > 1e-6, "{rule} turns after all");
    }
    assert!(disagreement("lattice-square", NEITHER, turn) > 1e-6);
    assert!(disagreement("lattice-square", NEITHER, shift) > 1e-6);
}

fn any_mean() -> impl Strategy<Value = Mean> {
    let margin = 0.5;
    prop_oneof![
        Just(Mean::Barycentre),
        (-6.0..6.0f64).prop_map(|power| Mean::Distance { power }),
        (-6.0..6.0f64).prop_map(move |exponent| Mean::Power { exponent, origin: Origin::Moving { margin } }),
        Just(Mean::Power { exponent: 0.0, origin: Origin::Moving { margin } }),
        Just(Mean::Power { exponent: 0.0, origin: Origin::World }),
        (-6.0..6.0f64).prop_map(|exponent| Mean::Power { exponent, origin: Origin::World }),
        (0.01..5.0f64, -6.0..2.0f64).prop_map(|(spacing, power)| Mean::Spaced { spacing, power }),
    ]
}

fn neighbours(coordinate: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = Vec<Neighbour>> {
    let one = (prop::array::uniform2(coordinate), 0.0..3.0f64)
        .prop_map(|(position, weight)| Neighbour { weight, ..Neighbour::at(position) });
    // Coincident points are as likely as not.
    (prop::collection::vec(one, 1..9), any::<bool>()).prop_map(|(mut all, coincide)| {
        if coincide {
            let first = all[0].position;
            all.iter_mut().for_each(|n| n.position = first);
        }
        all
    })
}

fn own(present: [f64; 2]) -> ParticleState {
    ParticleState { present, reference: present, rest: [0.0; 2], load: None }
}

proptest! {
    #![proptest_config(settings(2000))]

    #[test]
    fn targets_stay_in_the_hull_of_the_neighbours(
        seen in neighbours(-10.0..10.0f64),
        present in prop::array::uniform2(-10.0..10.0f64),
        power in -6.0..6.0f64,
        plain in any::<bool>(),
        direction in 0.0..6.3f64,
    ) {
        let mean = if plain { Mean::Barycentre } else { Mean::Distance { power } };
        let rule = Rule { mean, ..Rule::BARYCENTRE };
        prop_assume!(seen.iter().any(|n| n.weight > 0.0));
        let target = rule.target(&own(present), seen.iter().copied());
        // A point is in the hull if no direction separates it from all points.
        let (sin, cos) = direction.sin_cos();
        let along = |p: [f64; 2]| cos * p[0] + sin * p[1];
        let low = seen.iter().map(|n| along(n.position)).fold(f64::INFINITY, f64::min);
        let high = seen.iter().map(|n| along(n.position)).fold(f64::NEG_INFINITY, f64::max);
        prop_assert!(along(target) >= low - 1e-12 && along(target) <= high + 1e-12, "{rule:?}: {target:?}");
    }

    #[test]
    fn coordinatewise_means_stay_between_the_neighbours_coordinates(
        seen in neighbours(0.1..10.0f64), exponent in -6.0..6.0f64, world in any::<bool>(),
    ) {
        prop_assume!(seen.iter().any(|n| n.weight > 0.0));
        let origin = if world { Origin::World } else { Origin::Moving { margin: 1.0 } };
        let rule = Rule { mean: Mean::Power { exponent, origin }, ..Rule::BARYCENTRE };
        let target = rule.target(&own([5.0, 5.0]), seen.iter().copied());
        for k in 0..2 {
            let low = seen.iter().map(|n| n.position[k]).fold(f64::INFINITY, f64::min);
            let high = seen.iter().map(|n| n.position[k]).fold(f64::NEG_INFINITY, f64::max);
            prop_assert!(target[k] >= low - 1e-9 && target[k] <= high + 1e-9, "{rule:?}: {target:?}");
        }
    }

    #[test]
    fn finite_input_never_gives_nan(
        mean in any_mean(),
        seen in neighbours(prop_oneof![
            -10.0..10.0f64,
            Just(0.0), Just(-0.0), Just(1e-310), Just(f64::MIN_POSITIVE),
            -1e150..1e150f64, -1e-150..1e-150f64,
        ]),
        present in prop::array::uniform2(prop_oneof![-10.0..10.0f64, Just(0.0), -1e150..1e150f64, Just(1e-310)]),
        at_neighbour in any::<bool>(),
        factor in -2.0..2.0f64,
        k in -1.0..1.0f64,
        exponent in 0.0..3.0f64,
    ) {
        let present = if at_neighbour { seen[0].position } else { present };
        let rule = Rule {
            mean,
            poisson: Some(Poisson { k, axis: Axis::X, centre: 0.0, half_width: 2.0, exponent }),
            feedback: Some(Feedback { factor, reference: FeedbackReference::Initial }),
        };
        let target = rule.target(&ParticleState { present, reference: [0.0, 1.0], rest: [0.1, 0.0], load: None }, seen.iter().copied());
        prop_assert!(!target[0].is_nan() && !target[1].is_nan(), "{rule:?}: {target:?}");
    }

    #[test]
    fn a_material_moves_with_its_neighbours(
        places in prop::collection::vec(prop::array::uniform2(-1.0..1.0f64), 3..8),
        blocks in prop::collection::vec(prop::array::uniform4(-1.0..1.0f64), 8),
        here in prop::array::uniform2(-0.5..0.5f64),
        shift in prop::array::uniform2(-5.0..5.0f64),
        push in prop::array::uniform2(-1.0..1.0f64),
    ) {
        // Any weights that sum to the identity.
        let count = places.len();
        let mut matrices: Vec<[[f64; 2]; 2]> = blocks[..count].iter().map(|&[a, b, c, d]| [[a, b], [c, d]]).collect();
        let sum = |k: usize, l: usize, of: &[[[f64; 2]; 2]]| of.iter().map(|m| m[k][l]).sum::<f64>();
        let rest = &matrices[..count - 1];
        let last = [[1.0 - sum(0, 0, rest), -sum(0, 1, rest)], [-sum(1, 0, rest), 1.0 - sum(1, 1, rest)]];
        matrices[count - 1] = last;
        let load = Some(Load { force: push, compliance: [[0.3, 0.1], [0.1, 0.2]] });
        let target = |by: [f64; 2]| {
            let moved = |[x, y]: [f64; 2]| [x + by[0], y + by[1]];
            let one = |k: usize| Neighbour { matrix: matrices[k], ..Neighbour::at(moved(places[k])) };
            let seen: Vec<Neighbour> = (0..count).map(one).collect();
            let own = ParticleState { present: moved(here), reference: here, rest: [0.02, -0.01], load };
            Rule::MATERIAL.target(&own, seen.into_iter())
        };
        let (before, after) = (target([0.0; 2]), target(shift));
        let apart = (after[0] - before[0] - shift[0]).hypot(after[1] - before[1] - shift[1]);
        prop_assert!(apart < 1e-11, "{after:?}");
    }

    #[test]
    fn a_corotated_material_turns_with_its_neighbours(
        around in prop::collection::vec((0.5..1.5f64, prop::array::uniform2(-0.1..0.1f64)), 4..8),
        shift in prop::array::uniform2(-5.0..5.0f64),
        angle in -3.1..3.1f64,
        push in prop::array::uniform2(-1.0..1.0f64),
    ) {
        // Triangles of an orthotropic material all around a particle at the origin.
        let count = around.len();
        let place = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            [around[k].0 * cos, around[k].0 * sin]
        };
        let fibres = Constants::Orthotropic { young: [9.0, 1.0], poisson_12: 0.4, shear: 0.6, angle: 0.5 };
        let elastic = Elastic::new(fibres, 1.0).expect("admissible");
        let elements: Vec<Element> = (0..count).map(|k| {
            let corners = [[0.0, 0.0], place(k), place((k + 1) % count)];
            let stiffness = triangle(&corners, elastic.stiffness()).expect("a cell");
            let block = |n: usize| [0, 1].map(|a| [0, 1].map(|b| stiffness[(2 * (n / 3) + a, 2 * (n % 3) + b)]));
            Element { stiffness: (0..9).map(block).collect(), gradients: mean_gradients(&corners) }
        }).collect();
        let slots: Vec<[u32; 3]> = (0..count).map(|k| [OWN, k as u32, ((k + 1) % count) as u32]).collect();
        let (sin, cos) = angle.sin_cos();
        let turned = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
        let target = |go: &dyn Fn([f64; 2]) -> [f64; 2], force: [f64; 2]| {
            let present = go([0.0; 2]);
            let corner = |k: usize| {
                let (reference, off) = (place(k), around[k].1);
                let now = go([reference[0] + off[0], reference[1] + off[1]]);
                Corner { reference, displacement: [0, 1].map(|d| now[d] - present[d] - reference[d]) }
            };
            let rule = Rule { mean: Mean::Material { rotation: Rotation::Corotated }, ..Rule::BARYCENTRE };
            let load = Some(Load { force, compliance: [[0.0; 2]; 2] });
            let cells = elements.iter().zip(&slots).map(|(element, slots)| CellAround { element, own: 0, slots });
            let patches = std::iter::empty::<(f64, std::iter::Empty<PatchCell>)>();
            let own = ParticleState { present, reference: [0.0; 2], rest: [0.0; 2], load };
            rule.target_by_cells(&own, pull(cells, patches, corner), [false; 2])
        };
        let go = |p: [f64; 2]| { let [x, y] = turned(p); [x + shift[0], y + shift[1]] };
        let (before, after) = (target(&|p| p, push), target(&go, turned(push)));
        let expected = go(before);
        let apart = (after[0] - expected[0]).hypot(after[1] - expected[1]);
        prop_assert!(before[0].hypot(before[1]) > 0.0 && apart < 1e-11, "{after:?}, not {expected:?}");
    }

    #[test]
    fn no_bytes_make_the_scene_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let text = String::from_utf8_lossy(&bytes);
        let _ = Scene::parse("fuzz", "fuzz.toml", &text, &[], None);
    }

    #[test]
    fn a_damaged_scene_is_read_or_refused_with_a_place(
        scene in 0..SCENES.len(), at in any::<prop::sample::Index>(), with in "[ -~\n]{0,12}", cut in 0..20usize,
    ) {
        let text = SCENES[scene].text;
        let boundary = |mut i: usize| { while !text.is_char_boundary(i) { i -= 1 } i };
        let from = boundary(at.index(text.len()));
        let to = boundary((from + cut).min(text.len()));
        let damaged = format!("{}{with}{}", &text[..from], &text[to..]);
        if let Err(error) = Scene::parse("fuzz", "fuzz.toml", &damaged, &[], None) {
            prop_assert!(error.to_string().contains("fuzz.toml"), "{error}");
        }
    }
}

#[test]
fn a_run_gives_the_same_bits_for_one_two_and_four_threads_and_every_time() {
    let rules = [
        "rule={}",
        r#"rule.mean={kind="distance"}"#,
        r#"neighbours={kind="first",keep=3}"#,
        "fracture={stretch=1.2}",
        "frame=lagged",
    ];
    for rule in rules {
        // Large enough to be shared out.
        let overrides = [
            r#"body.shape={kind="grid",columns=320,rows=300}"#,
            r#"roles=[{region={kind="edge",side="right"},role="leader",motion={kind="velocity",per_step=[0.3,0.1]}}]"#,
            "stop={steps=12}",
            "record={}",
            rule,
        ];
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let present = pool.install(|| end(plan("lattice-square", &overrides)));
            present.iter().flat_map(|[x, y]| [x.to_bits(), y.to_bits()]).collect::<Vec<_>>()
        };
        let one = with(1);
        assert_eq!(one, with(1), "{rule}: again");
        assert_eq!(one, with(2), "{rule}: two threads");
        assert_eq!(one, with(4), "{rule}: four threads");
    }
}
