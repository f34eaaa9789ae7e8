//! A body given as points: the same whatever order they come in, and a lattice's where they are one.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use flockform::continuum::digest::digest;
use flockform::continuum::plan::Plan;
use flockform::continuum::run::{Outcome, run};
use flockform::scene::{Scene, SceneError};
use flockform::sweep::Sweep;

use cloud::{shuffled, table};

#[path = "common/cloud.rs"]
mod cloud;

/// An id and a place.
type Row = (u32, [f64; 2]);

/// A patch of 12 by 9 spacings whose particles stand where no lattice has them, with ids that are no row numbers.
fn patch() -> Vec<Row> {
    let shift = |seed: f64| 0.35 * ((12.9898 * seed).sin() * 43_758.545_3).fract();
    (0..12 * 9)
        .map(|i| {
            let (column, row, seed) = (i / 9, i % 9, f64::from(i));
            let place = [
                f64::from(column) + shift(seed),
                f64::from(row) + shift(seed + 0.5) + 0.5 * f64::from(column % 2),
            ];
            (7 * i as u32 + 1001, place)
        })
        .collect()
}

/// Torn until bonds break; the leaders by table, by side and by id.
const TORN: &str = r#"
title = "A torn cloud"
neighbours = { kind = "within", radius = 1.5 }
fracture = { stretch = 1.25 }
record = { probes = [1015, 1358] }

[body]
shape = { kind = "points", file = "cloud.csv" }

[[roles]]
region = { kind = "edge", side = "left", depth = 0.8 }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right", depth = 0.8 }
role = "leader"
motion = { kind = "velocity", per_step = [0.05, 0.0] }

[[roles]]
region = { kind = "ids", ids = [1337, 1344] }
role = "leader"
motion = { kind = "csv", file = "led.csv", steps = 50 }

[stop]
steps = 150
"#;

fn load(folder: &Path, text: &str, cloud: &str) -> Result<Scene, SceneError> {
    std::fs::write(folder.join("cloud.csv"), cloud).expect("written");
    std::fs::write(folder.join("led.csv"), "id,ux,uy\n1344,0.3,0.2\n1337,-0.1,0.6\n").expect("written");
    Scene::parse("cloud", "cloud.toml", text, &[], Some(folder))
}

fn plan(text: &str, cloud: &str) -> Plan {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = load(folder.path(), text, cloud).unwrap_or_else(|error| panic!("{error}"));
    Plan::new(&scene).unwrap_or_else(|error| panic!("{error}"))
}

fn ended(plan: Plan) -> Outcome {
    run(plan, &mut |_, _| ControlFlow::Continue(()))
}

/// By id: role, and to the bit place, PE1 and PE2.
fn by_id(outcome: &Outcome) -> BTreeMap<usize, (&'static str, [u64; 4])> {
    let engine = &outcome.engine;
    let of = |i: usize| {
        let [x, y] = engine.present().get(i);
        (engine.roles()[i].name(), [x, y, engine.pe1(i), engine.pe2(i)].map(f64::to_bits))
    };
    (0..engine.body().count()).map(|i| (engine.body().id(i), of(i))).collect()
}

/// Step, ids and length of each break, in their order.
fn breaks(outcome: &Outcome) -> Vec<(usize, [usize; 2], u64)> {
    let engine = &outcome.engine;
    let told = engine.breaks().iter();
    told.map(|one| (one.step, engine.body().ids(one.pair), one.length.to_bits())).collect()
}

#[test]
fn the_same_points_in_any_order_do_the_same_to_the_bit() {
    let first = ended(plan(TORN, &table(&patch())));
    let broken = breaks(&first);
    assert!(broken.len() > 10, "something has to happen: {} breaks", broken.len());
    for seed in [3, 4] {
        let other = ended(plan(TORN, &table(&shuffled(&patch(), seed))));
        assert_eq!(by_id(&other), by_id(&first), "{seed}");
        assert_eq!(breaks(&other), broken, "{seed}");
    }
}

#[test]
fn ids_mean_the_particles_that_the_file_names_so() {
    let rows = shuffled(&patch(), 8);
    let plan = plan(TORN, &table(&rows));
    for (row, (id, place)) in rows.iter().enumerate() {
        let i = plan.setup.body.in_row(row);
        assert_eq!((plan.setup.body.id(i), plan.setup.body.reference.get(i)), (*id as usize, *place));
        assert_eq!(plan.setup.body.particle(*id as usize), Some(i));
    }
    let at = |id: usize| plan.setup.body.particle(id).expect("named");
    assert_eq!(plan.probes, [at(1015), at(1358)]);
    let mut led = [at(1337), at(1344)];
    led.sort_unstable();
    assert_eq!(plan.setup.changes[2].particles, led);
    let outcome = ended(plan);
    let moved = |id: usize| {
        let (engine, i) = (&outcome.engine, outcome.engine.body().particle(id).expect("named"));
        engine.displacement(i)
    };
    for (id, by) in [(1344, [0.3, 0.2]), (1337, [-0.1, 0.6])] {
        assert!((0..2).all(|k| (moved(id)[k] - by[k]).abs() < 1e-12), "{id}: {:?}", moved(id));
    }
}

#[test]
fn who_finds_neighbours_anew_does_not_hang_on_the_order_either() {
    let text = TORN
        .replace("\"within\"", "\"dynamic\"")
        .replace("fracture = { stretch = 1.25 }", "rule = { mean = { kind = \"spaced\", spacing = 1.0 } }");
    let first = ended(plan(&text, &table(&patch())));
    assert!(first.engine.lasting_neighbours().is_none());
    assert_eq!(by_id(&ended(plan(&text, &table(&shuffled(&patch(), 5))))), by_id(&first));
}

#[test]
fn neighbours_last_however_far_they_go() {
    let outcome = ended(plan(&TORN.replace("stretch = 1.25", "stretch = 100.0"), &table(&patch())));
    let neighbours = &outcome.engine.flock().neighbours;
    assert_eq!(*neighbours, plan(TORN, &table(&patch())).setup.flock.neighbours);
}

/// A square lattice whose neighbours come in the order of their numbers, pulled.
const LATTICE: &str = r#"
title = "A lattice"
lattice = { kind = "square", spacing = 0.1 }
neighbours = { kind = "offsets", offsets = [[-1, 0], [0, -1], [0, 1], [1, 0]] }
body = { shape = { kind = "rectangle", max = [4.0, 2.0] }, holes = [{ kind = "disc", centre = [2.3, 1.0], radius = 0.45 }] }

[[roles]]
region = { kind = "edge", side = "left" }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right" }
role = "leader"
motion = { kind = "velocity", per_step = [0.01, 0.003] }

[stop]
steps = 80
"#;

#[test]
fn a_lattice_written_out_as_points_is_that_lattice() {
    let lattice = plan(LATTICE, "");
    let rows: Vec<Row> =
        lattice.setup.body.reference.iter().zip(1..).map(|(place, id)| (id, place)).collect();
    let body = LATTICE.lines().find(|line| line.starts_with("body")).expect("there");
    let mut text = LATTICE.replace(body, "body = { shape = { kind = \"points\", file = \"cloud.csv\" } }");
    for (key, with) in
        [("lattice =", ""), ("neighbours =", "neighbours = { kind = \"within\", radius = 0.1 }")]
    {
        let line = LATTICE.lines().find(|line| line.starts_with(key)).expect("there");
        text = text.replace(line, with);
    }
    let points = plan(&text, &table(&shuffled(&rows, 11)));
    assert_eq!(points.setup.body.reference, lattice.setup.body.reference, "the order is the lattice's own");
    assert_eq!(points.setup.flock.neighbours, lattice.setup.flock.neighbours);
    let share =
        |plan: &Plan| Sweep::compile(plan.setup.update, &plan.setup.flock, &plan.setup.roles).share_in_runs();
    assert_eq!(share(&points), share(&lattice));
    assert!(share(&points) > 0.5, "swept without lists again: {}", share(&points));
    let [points, lattice] = [points, lattice].map(ended);
    assert_eq!(by_id(&points), by_id(&lattice));
    // The lattice's own order of summation is another: to rounding.
    let offsets = LATTICE.lines().find(|line| line.starts_with("neighbours")).expect("there");
    let first = ended(plan(&LATTICE.replace(offsets, ""), ""));
    let (here, there) = (first.engine.present(), points.engine.present());
    for (p, q) in here.iter().zip(there.iter()) {
        assert!((0..2).all(|k| (p[k] - q[k]).abs() < 1e-12), "{p:?} {q:?}");
    }
}

#[test]
fn a_checkpoint_belongs_to_the_order_that_the_outputs_have() {
    let rows = patch();
    let [here, there] = [rows.clone(), shuffled(&rows, 3)].map(|rows| plan(TORN, &table(&rows)));
    assert_eq!(here.setup.body.reference, there.setup.body.reference);
    assert_ne!(digest(&here), digest(&there));
    assert_eq!(digest(&here), digest(&plan(TORN, &table(&rows))));
}

#[test]
fn a_cloud_in_other_units_has_their_spacing() {
    let spacing = |text: &str| plan(text, &table(&patch())).setup.body.lattice.spacing();
    let scaled = TORN
        .replace("file = \"cloud.csv\"", "file = \"cloud.csv\", scale = 2.0")
        .replace("radius = 1.5", "radius = 3.0");
    assert_eq!(spacing(&scaled), 2.0 * spacing(TORN));
}

#[test]
fn one_particle_is_a_body() {
    let text = "title = \"one\"\nneighbours = { kind = \"within\", radius = 1.0 }\n\
                body = { shape = { kind = \"points\", file = \"cloud.csv\" } }\nstop = { steps = 3 }\n";
    let outcome = ended(plan(text, "x,y\n2,3\n"));
    assert_eq!(outcome.engine.present().get(0), [2.0, 3.0]);
}
