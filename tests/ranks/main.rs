//! A body that ranks share ends with the bits that it has alone, for any number of ranks.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;
use std::thread;

use flockform::continuum::equilibrium::{run_to_equilibrium_shared, run_to_equilibrium_watched};
use flockform::continuum::plan::Plan;
use flockform::continuum::run::{Outcome, SharedError, run_shared};
use flockform::continuum::shares::{Exchanged, Shares};
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::engine::probes::ProbeSeries;
use flockform::engine::state::EngineState;
use flockform::flock::vectors::Vectors;
use flockform::ranks::{Exchange, Team, in_process};
use flockform::scene::{Scene, bundled};
use flockform::solve::interrupt::Interrupt;

use scenes::{load, planned};

#[cfg(feature = "export")]
mod averaged;
mod changed;
#[cfg(feature = "cli")]
mod drawn;
#[cfg(feature = "export")]
mod increments;
mod parts;
#[cfg(feature = "export")]
mod rest;
#[path = "../common/scenes.rs"]
mod scenes;
#[cfg(feature = "export")]
mod turned;
mod weighted;
#[cfg(feature = "export")]
mod written;

/// Everything that a run leaves, to the bit.
#[derive(Clone, Debug, PartialEq)]
struct End {
    step: usize,
    reason: String,
    places: Vec<u64>,
    residual: u64,
    breaks: String,
    roles: String,
    /// Steps that were looked at, and a hash of all places at each.
    seen: Vec<(usize, u64)>,
    /// Of a body in parts, and what is measured on a material.
    probes: Vec<ProbeSeries>,
    readings: String,
}

impl End {
    fn of(outcome: &Outcome, seen: Vec<(usize, u64)>) -> Self {
        let engine = &outcome.engine;
        let energies = (0..engine.body().count()).flat_map(|i| [engine.pe1(i), engine.pe2(i)]);
        let places = bits(engine.present()).chain(bits(engine.previous()));
        Self {
            step: engine.step(),
            reason: format!("{:?}", outcome.reason),
            places: places.chain(energies.map(f64::to_bits)).collect(),
            residual: outcome.residual.to_bits(),
            breaks: format!("{:?}", engine.breaks()),
            roles: format!("{:?}", engine.roles()),
            seen,
            probes: Vec::new(),
            readings: String::new(),
        }
    }
}

fn bits(points: &Vectors) -> impl Iterator<Item = u64> + '_ {
    points.x.iter().chain(&points.y).map(|value| value.to_bits())
}

/// Looks every so many steps, and keeps the state at one of them.
struct Looks {
    every: usize,
    keep_at: Option<usize>,
    seen: Vec<(usize, u64)>,
    kept: Option<(EngineState<'static>, f64)>,
}

impl Looks {
    fn every(every: usize) -> Self {
        Self { every, keep_at: None, seen: Vec::new(), kept: None }
    }
}

impl Observer for Looks {
    fn next(&mut self, step: usize) -> usize {
        (step / self.every + 1) * self.every
    }

    fn see(&mut self, engine: &Engine, residual: f64) -> ControlFlow<()> {
        let hash = bits(engine.present()).fold(0, |hash: u64, bits| hash.rotate_left(7) ^ bits);
        self.seen.push((engine.step(), hash));
        if self.keep_at == Some(engine.step()) {
            // As a file brings it back.
            let bytes = postcard::to_stdvec(&EngineState::of(engine)).expect("writable");
            self.kept = Some((postcard::from_bytes(&bytes).expect("readable"), residual));
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}

/// The results of `work` on each of so many ranks, in order.
fn on_ranks<T: Send>(count: usize, work: impl Fn(Team) -> T + Sync) -> Vec<T> {
    thread::scope(|scope| {
        let ranks: Vec<_> = in_process(count).into_iter().map(|team| scope.spawn(|| work(team))).collect();
        ranks.into_iter().map(|rank| rank.join().expect("no rank panics")).collect()
    })
}

fn alone(scene: &Scene, every: usize) -> End {
    let mut looks = Looks::every(every);
    let outcome = run_to_equilibrium_watched(scene, planned(scene), &mut looks).expect("an end");
    End::of(&outcome, looks.seen)
}

fn shared(plan: &Plan, every: usize, ranks: usize) -> Vec<End> {
    on_ranks(ranks, |team| {
        // Only the first rank's looks count.
        let mut looks = Looks::every(if team.is_first() { every } else { 1 });
        let outcome = run_shared(plan.clone(), None, &team, &mut looks).expect("can be shared");
        End::of(&outcome, looks.seen)
    })
}

fn assert_same(name: &str, sets: &[&str], every: usize) {
    assert_scene_the_same(&load(name, sets), &format!("{name} {sets:?}"), every);
}

fn assert_scene_the_same(scene: &Scene, name: &str, every: usize) {
    let (plan, expected) = (planned(scene), alone(scene, every));
    assert!(expected.step > 5, "{name}: something happens");
    for ranks in [1, 2, 3, 7] {
        for (rank, end) in shared(&plan, every, ranks).into_iter().enumerate() {
            let what = format!("{name}, rank {rank} of {ranks}");
            assert_eq!((end.step, &end.reason), (expected.step, &expected.reason), "{what}");
            assert_eq!(end.seen, expected.seen, "{what}");
            assert!(end == expected, "{what}");
        }
    }
}

#[test]
fn sweeps_of_a_barycentre_with_leaders_that_let_go_have_the_same_bits_on_any_number_of_ranks() {
    assert_same("tension", &["stop.steps=60", "frame=\"none\"", "record.probes=[]"], 25);
    assert_same("tension", &["stop.steps=60"], 7);
}

#[test]
fn frames_that_look_after_the_sweep_feedback_and_the_poisson_term_too() {
    assert_same("tension-immediate", &["stop.steps=45"], 20);
    assert_same("feedback-oscillate", &["stop.steps=45"], 20);
    assert_same("poisson-term", &["stop.steps=45"], 20);
}

#[test]
fn means_without_rows_and_weights_of_distance_too() {
    assert_same("power-mean", &["stop.steps=30"], 10);
    assert_same("distance-weights", &["stop.steps=30"], 10);
}

#[test]
fn materials_and_neighbours_found_anew_too() {
    assert_same("shear", &["stop.steps=40"], 15);
    assert_same("notched-plate", &["stop.steps=40"], 15);
    assert_same("drop", &["stop.steps=12"], 5);
}

/// The bundled scene that is stepped where the file asks for its equilibrium.
fn stepped(name: &str, sets: &[&str]) -> Scene {
    let text = bundled(name).expect("bundled").text;
    let text = text.replace("[equilibrium]\nsolver = \"auto\"\n", "");
    assert!(!text.contains("[equilibrium]"));
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::parse(name, name, &text, &sets, None).unwrap_or_else(|error| panic!("{name} {sets:?}: {error}"))
}

fn assert_steps_the_same(name: &str, sets: &[&str], every: usize) {
    assert_scene_the_same(&stepped(name, sets), name, every);
}

/// Material, loads from the start and growing, thick outlines and other materials within; all by cells.
#[test]
fn loaded_materials_and_fitted_outlines_too() {
    assert_steps_the_same("beam-loaded", &["stop.steps=60"], 25);
    assert_steps_the_same("beam-loaded", &["stop.steps=60", "load_steps.ramp.steps=40"], 25);
    assert_steps_the_same("l-bracket", &["stop.steps=40"], 15);
    assert_steps_the_same("plate-hole", &["stop.steps=40"], 15);
    assert_steps_the_same("ring", &["stop.steps=40", "load_steps={ramp={steps=30},every=7}"], 15);
    assert_steps_the_same("inclusion", &["stop.steps=30"], 15);
    assert_steps_the_same("elastica", &["stop.steps=30"], 15);
    assert_steps_the_same("cook", &["stop.steps=30"], 15);
}

/// Large enough for several steps together.
#[test]
fn halos_of_a_loaded_material_and_of_a_fitted_outline_have_the_same_bits() {
    let large = ["lattice.spacing=0.25", "body.shape.max=[60.0,25.0]", "stop.steps=70"];
    assert_steps_the_same("beam-loaded", &large, 64);
    assert_steps_the_same("plate-hole", &["lattice.spacing=0.2", "stop.steps=70"], 64);
}

#[test]
fn roles_on_a_condition_and_what_is_done_on_the_way_too() {
    let when = "roles[2]={region={kind=\"all\"},role=\"clamped\",when={quantity=\"displacement\",above=1.5}}";
    assert_same("tension", &[when, "stop.steps=60"], 25);
    let damped = "{at=9,what={kind=\"set\",keys=[\"update.damping=0.5\"]}}";
    let cut = "{at=12,what={kind=\"cut\",from=[6.5,-5.0],to=[6.5,6.2]}}";
    let actions = format!("actions=[{damped},{cut}]");
    assert_same("tension", &["frame=none", "record.probes=[]", &actions, "stop.steps=40"], 7);
    let heavier = "actions=[{at=9,what={kind=\"set\",keys=[\"loads[0].traction=[0.0,80.0]\"]}}]";
    assert_steps_the_same("beam-loaded", &[heavier, "stop.steps=40"], 25);
}

/// Particles at no sites, torn until bonds break.
#[test]
fn bodies_of_points_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut cloud = "id,x,y\n".to_owned();
    for i in 0..30 * 12 {
        let (column, row) = (f64::from(i / 12), f64::from(i % 12));
        let shift = 0.3 * (12.9898 * f64::from(i)).sin();
        cloud.push_str(&format!("{},{:?},{:?}\n", 7 * i + 1, column + shift, row - shift));
    }
    std::fs::write(folder.path().join("cloud.csv"), cloud).expect("written");
    let text = r#"
title = "A torn cloud"
neighbours = { kind = "within", radius = 1.7 }
fracture = { stretch = 1.25 }
body.shape = { kind = "points", file = "cloud.csv" }
stop.steps = 80

[[roles]]
region = { kind = "edge", side = "left", depth = 0.8 }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right", depth = 0.8 }
role = "leader"
motion = { kind = "velocity", per_step = [0.1, 0.0] }
"#;
    let of = |text: &str| {
        let scene = Scene::parse("cloud", "cloud.toml", text, &[], Some(folder.path()));
        scene.unwrap_or_else(|error| panic!("{error}"))
    };
    assert_scene_the_same(&of(text), "torn points", 25);
    assert_scene_the_same(&of(&text.replace("fracture = { stretch = 1.25 }\n", "")), "points", 25);
}

#[test]
fn cracks_run_the_same_way_on_any_number_of_ranks() {
    assert_same("fracture", &["stop.steps=60"], 20);
    assert_same("fracture-hexagonal", &["stop.steps=60"], 20);
}

#[test]
fn every_lattice_settles_at_the_same_step() {
    for lattice in ["square", "rectangular", "centred-rectangular", "hexagonal", "oblique", "honeycomb"] {
        assert_same(&format!("lattice-{lattice}"), &[], 1 << 20);
    }
}

/// Leaders that tear bonds at step 6, and are out of bounds there.
const THROWN: &str = "roles[1].motion={kind=\"keyframes\",interpolation=\"linear\",frames=[\
         {step=4,displacement=[0.4,0.0]},{step=5,displacement=[0.8,0.0]},{step=6,displacement=[5.0,0.0]}]}";

#[test]
fn a_divergence_is_seen_at_the_same_step_and_taken_back() {
    // Bonds break in the step of the second.
    let torn = "fracture={stretch=1.5,ghosts=\"none\"}";
    for (name, sets) in [
        ("feedback-grow", &["stop.divergence_ratio=1.01"][..]),
        ("tension", &["frame=none", "record={}", torn, "stop.divergence_ratio=0.2", THROWN]),
    ] {
        let scene = load(name, sets);
        let expected = alone(&scene, 1 << 20);
        assert!(expected.reason.starts_with("Diverged") && expected.breaks == "[]", "{expected:?}");
        for ranks in [2, 5] {
            let ends = shared(&planned(&scene), 1 << 20, ranks);
            assert!(ends.iter().all(|end| *end == expected), "{name}, {ranks} ranks");
        }
    }
}

/// Large enough for several steps together: halos of several bands, over several bands of each rank.
#[test]
fn many_steps_together_with_halos_of_many_bands_have_the_same_bits() {
    let body = [
        "body.shape.columns=220",
        "body.shape.rows=40",
        "record.probes=[]",
        "record.figures=[]",
        "stop.steps=150",
    ];
    for frame in ["frame=\"none\"", "frame=\"lagged\""] {
        let sets: Vec<&str> = body.into_iter().chain([frame]).collect();
        let scene = load("tension", &sets);
        let expected = alone(&scene, 64);
        for ranks in [2, 3, 5] {
            let ends = shared(&planned(&scene), 64, ranks);
            assert!(ends.iter().all(|end| *end == expected), "{frame}, {ranks} ranks");
        }
    }
}

#[test]
fn a_run_goes_on_with_another_number_of_ranks() {
    let cases = [("tension", 23, &[][..]), ("fracture", 40, &[]), ("tension", 23, &[SEQUENTIAL_FROM_10])];
    for (name, at, sets) in cases {
        let scene = load(name, &[&["stop.steps=60"], sets].concat());
        let (plan, expected) = (planned(&scene), alone(&scene, 1));
        let kept = on_ranks(3, |team| {
            let mut looks = Looks { keep_at: Some(at).filter(|_| team.is_first()), ..Looks::every(1) };
            let outcome = run_shared(plan.clone(), None, &team, &mut looks).expect("can be shared");
            assert_eq!((outcome.engine.step(), outcome.reason.name()), (at, "interrupted"));
            looks.kept
        });
        let from = kept.into_iter().flatten().next().expect("came that far");
        for ranks in [1, 2, 4] {
            let ends = on_ranks(ranks, |team| {
                let mut looks = Looks::every(1);
                let outcome = run_shared(plan.clone(), Some(from.clone()), &team, &mut looks);
                End::of(&outcome.expect("can be shared"), Vec::new())
            });
            let expected = End { seen: Vec::new(), ..expected.clone() };
            assert!(ends.iter().all(|end| *end == expected), "{name} on {ranks} ranks");
        }
    }
}

#[test]
fn any_rank_can_break_the_run_off_and_all_end_at_the_same_step() {
    struct Impatient(bool);
    impl Observer for Impatient {
        fn next(&mut self, step: usize) -> usize {
            step + 4
        }

        fn see(&mut self, engine: &Engine, _: f64) -> ControlFlow<()> {
            if self.0 && engine.step() >= 10 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
    let plan = planned(&load("tension", &[]));
    let ends = on_ranks(4, |team| {
        let outcome = run_shared(plan.clone(), None, &team, &mut Impatient(team.rank() == 2));
        let outcome = outcome.expect("can be shared");
        (outcome.engine.step(), outcome.reason.name())
    });
    assert_eq!(ends, [(12, "interrupted"); 4]);
}

/// An order in which each particle waits for the one before it, from a step on.
const SEQUENTIAL_FROM_10: &str =
    "actions=[{ at = 10, what = { kind = \"set\", keys = [\"update.order='sequential'\"] } }]";

#[test]
fn sequential_sweeps_have_the_same_bits_on_every_rank_which_each_move_all_particles() {
    let sequential = ["update.order=sequential", "stop.steps=40"];
    assert_same("tension", &sequential, 7);
    assert_same("tension", &["stop.steps=40", SEQUENTIAL_FROM_10], 7);
    let scene = load("tension", &sequential);
    let (plan, count) = (planned(&scene), planned(&scene).count());
    let shares = Shares::new(&scene, &plan, 3).expect("can be shared");
    assert_eq!((shares.exchanged, shares.particles), (Exchanged::Interrupts, vec![count; 3]));
}

#[test]
fn a_plan_foretells_who_moves_what_and_what_is_exchanged() {
    let body = ["body.shape.columns=220", "body.shape.rows=40", "record.probes=[]", "frame=\"none\""];
    let scene = load("tension", &body);
    let shares = Shares::new(&scene, &planned(&scene), 4).expect("can be shared");
    assert_eq!((shares.particles.len(), shares.particles.iter().sum::<usize>()), (4, 220 * 40));
    let most = shares.particles.iter().max().copied().unwrap_or_default();
    assert!(most < 220 * 40 / 3, "{:?}", shares.particles);
    let Exchanged::Halos { steps, bytes } = shares.exchanged else { panic!("{:?}", shares.exchanged) };
    // A neighbour is at most 40 places away: so many on both sides for each step, or the bands that hold them.
    assert!(steps > 1 && bytes >= 16 * 2 * 40 * steps && bytes < 16 * 8 * 40 * steps, "{steps} {bytes}");
    let torn = load("fracture", &[]);
    let shares = Shares::new(&torn, &planned(&torn), 3).expect("can be shared");
    assert!(matches!(shares.exchanged, Exchanged::Everything { .. }), "{:?}", shares.exchanged);
}

#[test]
fn a_plan_foretells_which_solvers_ranks_share() {
    let exchanged = |name: &str, sets: &[&str]| {
        let scene = load(name, sets);
        let plan = planned(&scene);
        let shares = Shares::new(&scene, &plan, 3).expect("can be shared");
        // Positions, forces, and what solves for them.
        assert!(shares.bytes > 150 * plan.count(), "{}", shares.bytes);
        (shares.particles, shares.exchanged)
    };
    let (particles, of_direct) = exchanged("beam-loaded", &["equilibrium.solver=direct"]);
    assert_eq!(of_direct, Exchanged::Interrupts);
    assert!(particles[0] > 0 && particles == [particles[0]; 3], "{particles:?}");
    assert_eq!(exchanged("elastica", &[]).1, Exchanged::Interrupts);
    let (particles, of_multigrid) = exchanged("beam-loaded", LARGE_BEAM);
    let Exchanged::Iterations { bytes } = of_multigrid else { panic!("{of_multigrid:?}") };
    // A column on either side.
    let column = 16 * 2 * 121;
    assert_eq!(bytes, column);
    let [least, most] = [particles.iter().min(), particles.iter().max()].map(|of| of.copied().unwrap_or(0));
    assert!(least > 0 && most - least <= 2 * 8192, "{particles:?}");
    let (particles, _) = exchanged("beam-loaded", &["equilibrium.solver=multigrid"]);
    assert_eq!(particles[1..], [0, 0], "too small for more than one");
}

/// What a solved run leaves, to the bit: the end, the residual after each iteration, the displacements, and the rest in words.
#[derive(Clone, Debug, PartialEq)]
struct Rest {
    end: End,
    residuals: Vec<u64>,
    displacement: Vec<u64>,
    words: String,
}

impl Rest {
    fn of(outcome: &Outcome, seen: Vec<(usize, u64)>) -> Self {
        let solved = outcome.solved.as_ref().expect("solved");
        Self {
            end: End::of(outcome, seen),
            residuals: solved.residuals.iter().map(|residual| residual.to_bits()).collect(),
            displacement: bits(&solved.displacement).collect(),
            words: format!("{} {} {:?}", solved.solver, solved.converged, solved.known_to),
        }
    }
}

fn solved_alone(scene: &Scene, plan: &Plan) -> Rest {
    let mut looks = Looks::every(1);
    let outcome = run_to_equilibrium_watched(scene, plan.clone(), &mut looks).expect("an equilibrium");
    Rest::of(&outcome, looks.seen)
}

/// The same shared, or why it failed.
fn solved_on(scene: &Scene, plan: &Plan, team: &Team) -> Result<Rest, SharedError> {
    let mut looks = Looks::every(1);
    let outcome = run_to_equilibrium_shared(scene, plan.clone(), None, team, &mut looks)?;
    Ok(Rest::of(&outcome, looks.seen))
}

fn assert_rests_the_same(name: &str, sets: &[&str], solver: &str, ranks: &[usize]) {
    let scene = load(name, sets);
    let plan = planned(&scene);
    let expected = solved_alone(&scene, &plan);
    assert!(expected.words.starts_with(solver), "{name} {sets:?}: {}", expected.words);
    assert!(expected.residuals.len() > 1, "{name} {sets:?}");
    for &count in ranks {
        let found = on_ranks(count, |team| solved_on(&scene, &plan, &team).expect("an equilibrium"));
        for (rank, rest) in found.into_iter().enumerate() {
            let what = format!("{name} {sets:?}, rank {rank} of {count}");
            assert_eq!(rest.residuals.len(), expected.residuals.len(), "iterations: {what}");
            assert!(rest.residuals == expected.residuals, "residuals: {what}");
            assert!(rest.displacement == expected.displacement, "displacement: {what}");
            assert!(rest == expected, "{what}");
        }
    }
}

/// A beam of 1201 x 121 particles: 17 groups of columns, enough for eight ranks.
const LARGE_BEAM: &[&str] =
    &["lattice.spacing=0.1", "body.shape.max=[130.0,22.0]", "equilibrium.solver=multigrid"];

#[test]
fn every_solver_finds_the_same_equilibrium_on_any_number_of_ranks() {
    let solver = |name: &str| format!("equilibrium.solver={name}");
    for name in ["direct", "jacobi", "gauss-seidel", "chebyshev", "conjugate-gradients", "multigrid"] {
        assert_rests_the_same("beam-loaded", &[&solver(name)], name, &[1, 2, 3]);
    }
}

#[test]
fn multigrid_that_ranks_share_has_the_same_bits() {
    assert_rests_the_same("beam-loaded", LARGE_BEAM, "multigrid", &[2, 3, 4, 5, 6, 7]);
    let single = [LARGE_BEAM, &["equilibrium.precision=f32", "equilibrium.tolerance=1e-5"]].concat();
    assert_rests_the_same("beam-loaded", &single, "multigrid", &[4]);
}

#[test]
fn conjugate_gradients_that_ranks_share_have_the_same_bits() {
    let of_solver = ["equilibrium.solver=conjugate-gradients", "equilibrium.most_iterations=150"];
    let sets = [&LARGE_BEAM[..2], &of_solver].concat();
    assert_rests_the_same("beam-loaded", &sets, "conjugate-gradients", &[3]);
}

#[test]
fn bodies_fitted_to_their_outline_and_every_lattice_too() {
    let fine = ["lattice.spacing=0.08", "equilibrium.solver=multigrid"];
    assert_rests_the_same("plate-hole", &fine, "multigrid", &[2, 3]);
    let fine = ["lattice.spacing=0.035", "equilibrium.solver=multigrid"];
    assert_rests_the_same("ring", &fine, "multigrid", &[2, 3]);
}

#[test]
fn equilibria_on_the_way_and_rotations_too() {
    assert_rests_the_same("beam-loaded", &["load_steps={increments=3}"], "direct", &[2, 3]);
    assert_rests_the_same(
        "elastica",
        &["lattice.spacing=0.25", "load_steps={increments=3}"],
        "direct",
        &[2, 3],
    );
}

/// Large enough for the threads of a rank to share its groups.
#[test]
fn threads_within_ranks_change_no_bit_of_an_equilibrium() {
    let scene = load("beam-loaded", LARGE_BEAM);
    let plan = planned(&scene);
    let expected = solved_alone(&scene, &plan);
    let found = on_ranks(2, |team| {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("threads");
        threads.install(|| solved_on(&scene, &plan, &team).expect("an equilibrium"))
    });
    assert!(found.iter().all(|rest| *rest == expected));
}

#[test]
fn an_interrupt_of_one_rank_ends_the_solve_on_all() {
    static RAISED: AtomicBool = AtomicBool::new(true);
    let of = |solver: &str| (vec![format!("equilibrium.solver={solver}")], "beam-loaded");
    let mut cases: Vec<_> =
        ["jacobi", "gauss-seidel", "chebyshev", "conjugate-gradients"].into_iter().map(of).collect();
    cases.push((LARGE_BEAM.iter().map(|&set| set.to_owned()).collect(), "beam-loaded"));
    cases.push((
        vec!["lattice.spacing=0.25".to_owned(), "equilibrium.solver=multigrid".to_owned()],
        "elastica",
    ));
    for (sets, name) in cases {
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let scene = load(name, &sets);
        let plan = planned(&scene);
        let found = on_ranks(3, |team| {
            let mut scene = scene.clone();
            let asked = scene.equilibrium.as_mut().expect("asked for");
            if team.rank() == 1 {
                asked.request.interrupt = Interrupt::new(&RAISED);
            }
            solved_on(&scene, &plan, &team).err().map(|error| error.to_string())
        });
        let is_interrupted =
            |error: &Option<String>| error.as_ref().is_some_and(|error| error.contains("interrupted"));
        assert!(found.iter().all(is_interrupted), "{name} {sets:?}: {found:?}");
    }
}

/// Large enough for the threads of a rank to cut its part once more.
#[test]
fn threads_within_ranks_change_no_bit() {
    let body = ["body.shape.columns=300", "body.shape.rows=250", "record.probes=[]", "record.figures=[]"];
    let sets: Vec<&str> = body.into_iter().chain(["frame=\"none\"", "stop.steps=24"]).collect();
    let scene = load("tension", &sets);
    let (plan, expected) = (planned(&scene), alone(&scene, 4));
    let ends = on_ranks(2, |team| {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(4).build().expect("threads");
        threads.install(|| {
            let mut looks = Looks::every(4);
            let outcome = run_shared(plan.clone(), None, &team, &mut looks).expect("can be shared");
            End::of(&outcome, looks.seen)
        })
    });
    assert!(ends.iter().all(|end| *end == expected));
}

/// Receives halos with an error in one coordinate; lengths of messages are right.
struct Noisy(Team);

impl Exchange for Noisy {
    fn rank(&self) -> usize {
        self.0.rank()
    }

    fn count(&self) -> usize {
        self.0.count()
    }

    fn swap(
        &mut self,
        messages: &[(usize, Vec<u64>)],
        from: &[(usize, usize)],
        meanwhile: &mut dyn FnMut(),
    ) -> Vec<Vec<u64>> {
        let mut received = self.0.swap_while(messages, from, meanwhile);
        let coordinates = received.iter_mut().filter(|words| words.len() > 1);
        coordinates.filter_map(|words| words.last_mut()).for_each(|word| *word ^= 1 << 20);
        received
    }

    fn gather(&mut self, own: &[u64], counts: &[usize]) -> Vec<u64> {
        self.0.gather(own, counts)
    }
}

/// That the others can fail: ranks depend on every bit of what they receive.
#[test]
fn an_error_in_a_halo_is_seen_in_the_bits() {
    let body = ["body.shape.columns=60", "body.shape.rows=20", "record.probes=[]", "frame=\"none\""];
    let sets: Vec<&str> = body.into_iter().chain(["record.figures=[]", "stop.steps=80"]).collect();
    let scene = load("tension", &sets);
    let (plan, expected) = (planned(&scene), alone(&scene, 1 << 20));
    let ends = |is_noisy: bool| {
        on_ranks(2, |team| {
            let team = if is_noisy { Team::new(Noisy(team)) } else { team };
            let mut looks = Looks::every(1 << 20);
            let outcome = run_shared(plan.clone(), None, &team, &mut looks).expect("can be shared");
            End::of(&outcome, looks.seen)
        })
    };
    assert!(ends(false).iter().all(|end| *end == expected));
    assert!(ends(true).iter().all(|end| *end != expected));
}

#[test]
fn an_error_in_a_halo_of_a_solver_is_seen_in_the_bits() {
    let scene = load("beam-loaded", LARGE_BEAM);
    let plan = planned(&scene);
    let expected = solved_alone(&scene, &plan);
    let found = on_ranks(2, |team| solved_on(&scene, &plan, &Team::new(Noisy(team))));
    // It may find no equilibrium at all.
    assert!(found.into_iter().all(|rest| rest.map_or(true, |rest| rest != expected)));
}
