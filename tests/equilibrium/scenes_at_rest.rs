//! Scenes that go straight to rest get where sweeping them gets.

use std::ops::ControlFlow;

use flockform::continuum::equilibrium::run_to_equilibrium;
use flockform::continuum::memory::fallback;
use flockform::continuum::plan::Plan;
use flockform::continuum::run::{Outcome, StopReason};
#[cfg(feature = "export")]
use flockform::export::Measured;
use flockform::flock::vectors::distance;
use flockform::scene::Scene;
use flockform::solve::equilibrium::Precision;

use crate::scenes::{load, planned, try_load};

fn ended(scene: &Scene) -> Outcome {
    run_to_equilibrium(scene, planned(scene), &mut |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(name: &str, overrides: &[&str]) -> String {
    let end = try_load(name, overrides).and_then(|scene| {
        let plan = Plan::new(&scene)?;
        run_to_equilibrium(&scene, plan, &mut |_, _| ControlFlow::Continue(()))
    });
    end.expect_err("refused").to_string()
}

fn farthest_apart(a: &Outcome, b: &Outcome) -> f64 {
    let pairs = a.engine.present().iter().zip(b.engine.present().iter());
    pairs.map(|(a, b)| distance(a, b)).fold(0.0, f64::max)
}

const MATERIAL: &str = "material={kind=\"isotropic\",young=1000.0,poisson=0.3}";
const BY_MATERIAL: &str = "rule.mean={kind=\"material\"}";
const COROTATED: &str = "rule.mean={kind=\"material\",rotation=\"corotated\"}";
const CELLS: &str = "neighbours={kind=\"cells\"}";
/// Sweeps of a corotated material are costly.
const SMALLER: &str = "body.shape.radius=5.5";
const SWEPT: [&str; 2] = ["stop.tolerance=1e-13", "stop.steps=200000"];

/// Lattices of the bundled scenes `lattice-*`, stretched, sheared and turned by their boundary.
const LATTICES: [&str; 6] =
    ["square", "rectangular", "centred-rectangular", "hexagonal", "oblique", "honeycomb"];

fn assert_alike(name: &str, overrides: &[&str], within: f64) {
    let stepped = ended(&load(name, &[overrides, &SWEPT].concat()));
    assert_eq!(stepped.reason, StopReason::Equilibrium, "{name}: {}", stepped.residual);
    let asked = ["equilibrium={solver=\"auto\",tolerance=1e-12}", "stop.steps=200000"];
    let solved = ended(&load(name, &[overrides, &asked].concat()));
    assert_eq!(solved.reason, StopReason::Equilibrium, "{name}");
    let apart = farthest_apart(&stepped, &solved);
    assert!(apart < within, "{name} {overrides:?}: {apart}");
    let moved = stepped.engine.present().iter().zip(stepped.engine.body().reference.iter());
    assert!(moved.map(|(x, p)| distance(x, p)).fold(0.0, f64::max) > 0.1, "{name} moves at all");
}

#[test]
fn a_material_is_solved_to_where_it_is_swept_on_every_lattice() {
    for lattice in LATTICES {
        let pushed = "loads=[{kind=\"body\",force=[3.0,-5.0]}]";
        assert_alike(&format!("lattice-{lattice}"), &[MATERIAL, BY_MATERIAL, CELLS, pushed], 1e-8);
    }
}

#[test]
fn the_barycentre_is_solved_to_where_it_is_swept_with_any_frame_and_neighbourhood() {
    let pulled = ["roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"},\
         {region={kind=\"edge\",side=\"right\"},role=\"leader\",\
          motion={kind=\"affine\",about=[0.0,0.0],stretch=[1.3,1.1],steps=2}}]"];
    for frame in ["none", "lagged", "immediate", "mirror"] {
        for neighbours in ["{kind=\"first\"}", "{kind=\"chebyshev\",radius=1}", "{kind=\"second\"}"] {
            let overrides = [format!("frame={frame}"), format!("neighbours={neighbours}")];
            let overrides: Vec<&str> =
                overrides.iter().map(String::as_str).chain(pulled).chain(["record.probes=[]"]).collect();
            assert_alike("tension", &overrides, 1e-8);
        }
    }
    // Between two rows of a hexagonal edge a frame point copies the mean of two.
    for frame in ["frame=lagged", "frame=immediate"] {
        assert_alike("lattice-hexagonal", &[&[frame][..], &pulled].concat(), 1e-8);
    }
    for more in [
        "rule.weights={kind=\"list\",values=[1.0,2.0,1.0,3.0]}",
        "rule.poisson={k=-0.01}",
        "rule.feedback={factor=-0.2}",
        "rule.feedback={factor=-0.2,reference=\"previous\"}",
        "neighbours={kind=\"first\",keep=3}",
        "rule.rest=literal",
    ] {
        assert_alike("tension", &[&["frame=none", "record.probes=[]", more][..], &pulled].concat(), 1e-8);
    }
}

#[test]
fn a_body_turned_by_a_right_angle_is_not_strained_by_the_corotated_rule() {
    let turned = |side: &str| {
        format!(
            "{{region={{kind=\"edge\",side=\"{side}\"}},role=\"leader\",\
             motion={{kind=\"affine\",about=[2.0,1.0],rotate=90.0,steps=60}}}}"
        )
    };
    let roles = format!("roles=[{},{}]", turned("left"), turned("right"));
    // Cells of four, three and six corners.
    for lattice in ["square", "hexagonal", "honeycomb"] {
        let name = format!("lattice-{lattice}");
        for how in ["stop.tolerance=1e-14", "equilibrium={tolerance=1e-13}"] {
            let overrides = [MATERIAL, COROTATED, CELLS, SMALLER, &roles, how, "stop.steps=100000"];
            let outcome = ended(&load(&name, &overrides));
            let engine = &outcome.engine;
            for i in 0..engine.body().count() {
                let [x, y] = engine.body().reference.get(i);
                let apart = distance(engine.present().get(i), [2.0 - (y - 1.0), 1.0 + (x - 2.0)]);
                assert!(apart < 1e-10, "{lattice}, {how}: particle {} is {apart} away", i + 1);
                assert!(engine.pe1(i) < 1e-20, "{lattice}, {how}");
            }
        }
    }
}

#[test]
fn a_corotated_material_is_solved_to_where_it_is_swept_on_every_lattice() {
    // The right end is carried around and turned, so that axes differ all along the body.
    let bent = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"},{region={kind=\"edge\",side=\"right\"},\
                role=\"leader\",motion={kind=\"affine\",about=[0.0,4.0],rotate=50.0,stretch=[1.02,1.01],steps=60}}]";
    let pushed = "loads=[{kind=\"body\",force=[1.0,-2.0]}]";
    for lattice in LATTICES {
        assert_alike(
            &format!("lattice-{lattice}"),
            &[MATERIAL, COROTATED, CELLS, SMALLER, bent, pushed],
            1e-8,
        );
    }
}

#[test]
fn a_nearly_incompressible_material_is_solved_by_every_solver_to_where_it_is_swept() {
    let rubber = "material={kind=\"isotropic\",young=1000.0,poisson=0.49,plane=\"strain\"}";
    let pushed = "loads=[{kind=\"body\",force=[3.0,-5.0]}]";
    for lattice in LATTICES {
        let name = format!("lattice-{lattice}");
        for mean in [BY_MATERIAL, COROTATED] {
            let overrides = [rubber, mean, CELLS, pushed];
            if lattice == "square" || lattice == "hexagonal" {
                assert_alike(&name, &overrides, 1e-7);
            }
            let by = |solver: &str| {
                let asked = format!("equilibrium={{solver=\"{solver}\",tolerance=1e-11}}");
                ended(&load(&name, &[&overrides[..], &[&asked]].concat()))
            };
            let swept = by("gauss-seidel");
            for solver in ["multigrid", "conjugate-gradients", "direct"] {
                let other = by(solver);
                let solved = other.solved.as_ref().expect("solved");
                assert!(solved.converged, "{name} {mean} {solver}: {:?}", solved.residuals.last());
                let apart = farthest_apart(&swept, &other);
                assert!(apart < 1e-7, "{name} {mean} {solver}: {apart}");
            }
        }
    }
}

#[test]
fn multigrid_smooths_the_particles_along_an_outline_as_well_as_those_within() {
    // Its smoother is unstable where an eigenvalue exceeds its estimate by a quarter, here in a corner between sites.
    let asked = ["lattice.spacing=0.03", "equilibrium={solver=\"multigrid\",tolerance=1e-8}"];
    let solved = ended(&load("rubber-block", &asked)).solved.expect("a solve");
    assert!(solved.is_at_rest() && solved.iterations < 170, "{} iterations", solved.iterations);
}

#[test]
fn a_corotated_cantilever_bends_as_far_as_it_is_swept_and_newton_s_steps_are_few() {
    let roles = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
    let load = "loads=[{kind=\"traction\",region={kind=\"edge\",side=\"right\"},traction=[0.0,-20.0]}]";
    let shape = "body.shape={kind=\"grid\",columns=9,rows=3}";
    let overrides = [MATERIAL, COROTATED, CELLS, roles, load, shape];
    assert_alike("lattice-square", &overrides, 1e-8);
    let solved = ended(&load_with("lattice-square", &overrides, &["equilibrium={}"])).solved.expect("solved");
    assert!(solved.converged && solved.iterations < 25, "{:?}", solved.residuals);
    // Near the end each step squares the residual, as only the true derivative makes it.
    let [.., before, last] = solved.residuals[..] else { panic!("{:?}", solved.residuals) };
    assert!(before > 1e-8 && last < 1e-10, "{:?}", solved.residuals);
}

#[test]
fn a_body_turned_all_the_way_round_is_solved_along_its_way() {
    let turned = |side: &str| {
        format!(
            "{{region={{kind=\"edge\",side=\"{side}\"}},role=\"leader\",\
             motion={{kind=\"affine\",about=[2.0,1.0],rotate=200.0,steps=60}}}}"
        )
    };
    let roles = format!("roles=[{},{}]", turned("left"), turned("right"));
    let asked = "equilibrium={tolerance=1e-13}";
    let outcome =
        ended(&load("lattice-hexagonal", &[MATERIAL, COROTATED, CELLS, &roles, asked, "stop.steps=60"]));
    let (sin, cos) = 200f64.to_radians().sin_cos();
    for (p, x) in outcome.engine.body().reference.iter().zip(outcome.engine.present().iter()) {
        let [a, b] = [p[0] - 2.0, p[1] - 1.0];
        let apart = distance(x, [2.0 + cos * a - sin * b, 1.0 + sin * a + cos * b]);
        assert!(apart < 1e-9, "{apart}");
    }
}

#[test]
fn loads_turn_a_corotated_cantilever_less_than_they_stretch_the_small_strain_one() {
    // A beam bent far: small rotations let it grow longer, the corotated rule keeps its length.
    let scene = |rotation: &str| {
        let mean = format!("rule.mean={{kind=\"material\",rotation=\"{rotation}\"}}");
        let roles = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
        let load = "loads=[{kind=\"traction\",region={kind=\"edge\",side=\"right\"},traction=[0.0,-6.0]}]";
        let shape = "body.shape={kind=\"grid\",columns=21,rows=3}";
        load_with(
            "lattice-square",
            &[MATERIAL, &mean, CELLS, roles, load, shape],
            &["stop.tolerance=1e-9", SWEPT[1]],
        )
    };
    let length = |outcome: &Outcome| {
        let present = outcome.engine.present();
        (0..20).map(|c| distance(present.get(3 * c + 1), present.get(3 * c + 4))).sum::<f64>()
    };
    let [small, corotated] = ["small", "corotated"].map(|rotation| length(&ended(&scene(rotation))));
    let rest = 20.0 * load("lattice-square", &[]).lattice.spacing();
    assert!(corotated / rest - 1.0 < 0.01 && small / rest - 1.0 > 0.05, "{small} {corotated} {rest}");
}

#[test]
fn an_accuracy_of_a_corotated_material_is_computed_in_doubles() {
    let scene = load("grips", &["equilibrium={accuracy=\"1%\"}"]);
    let rotated = load("grips", &[COROTATED, "equilibrium={accuracy=\"1%\"}"]);
    let [single, double] =
        [&scene, &rotated].map(|s| s.equilibrium.as_ref().expect("asked for").request.precision);
    assert_eq!((single, double), (Precision::F32, Precision::F64));
    assert!(ended(&rotated).solved.expect("solved").converged);
}

fn load_with(name: &str, overrides: &[&str], more: &[&str]) -> Scene {
    load(name, &[overrides, more].concat())
}

#[test]
fn what_has_no_equilibrium_to_solve_for_is_refused_with_its_place() {
    let asked = "equilibrium={}";
    for (overrides, words) in [
        (vec![asked, "rule.mean={kind=\"distance\"}"], "rule.mean = { kind = \"distance\" }"),
        (
            vec!["equilibrium={solver=\"multigrid\",precision=\"f32\"}", MATERIAL, CELLS, COROTATED],
            "in double precision",
        ),
        (
            vec![asked, MATERIAL, CELLS, COROTATED, "rule.feedback={factor=-0.1}"],
            "leave [equilibrium] out to step there",
        ),
        (
            vec![asked, MATERIAL, CELLS, COROTATED, "rule.feedback={factor=-0.1,reference=\"previous\"}"],
            "leave it out: it does not move",
        ),
        (
            vec![asked, MATERIAL, CELLS, BY_MATERIAL, "roles=[{region={kind=\"all\"},role=\"clamped\"}]"],
            "let particles follow, or leave [equilibrium] out",
        ),
        (
            vec!["equilibrium={solver=\"direct\"}", "roles=[{region={kind=\"all\"},role=\"clamped\"}]"],
            "let particles follow, or leave [equilibrium] out",
        ),
        (vec!["neighbours={kind=\"offsets\",offsets=[[1,0],[0,1],[1,0]]}"], "neighbours.offsets[2]"),
        (vec![asked, "roles[0].from=7"], "roles[0].from"),
        (vec![asked, "fracture={stretch=2.0}"], "fracture"),
        (vec![asked, "roles=[]"], "held"),
        (vec!["equilibrium={tolerance=0.0}"], "equilibrium.tolerance = 0.0"),
        (vec!["equilibrium={solver=\"multgrid\"}"], "multigrid"),
    ] {
        let message = refusal("lattice-square", &overrides);
        assert!(message.contains(words), "{overrides:?}: {message}");
    }
}

#[test]
fn what_cannot_carry_a_material_is_refused_with_the_reason() {
    let with = |more: &[&str]| refusal("lattice-square", &[&[MATERIAL, BY_MATERIAL, CELLS], more].concat());
    for (more, words) in [
        ("neighbours={kind=\"first\"}", "4 neighbours cannot carry shear coupling"),
        ("material.poisson=1.0", "Poisson's ratio"),
        ("material.young=-1.0", "Young's modulus must be positive"),
        ("material.thickness=0.0", "thickness"),
        ("frame=lagged", "needs no frame"),
        ("fracture={stretch=2.0}", "in cells, not in bonds"),
        ("rule.rest=literal", "at rest where nothing pulls it"),
        ("body.shape={kind=\"grid\",columns=5,rows=1}", "no cell"),
        (
            "loads=[{kind=\"traction\",region={kind=\"disc\",centre=[4.0,4.0],radius=0.1},traction=[1.0,0.0]}]",
            "no part of the outline",
        ),
    ] {
        let message = with(&[more]);
        assert!(message.contains(words) && message.contains("help: "), "{more}: {message}");
    }
    let message = refusal("lattice-square", &[BY_MATERIAL]);
    assert!(message.contains("no material to take its weights from"), "{message}");
    let message = refusal("lattice-square", &["loads=[{kind=\"body\",force=[1.0,0.0]}]"]);
    assert!(message.contains("a load needs a material"), "{message}");
    let message = refusal("lattice-square", &[MATERIAL, "loads=[{kind=\"body\",force=[1.0,0.0]}]"]);
    assert!(message.contains("without a stiffness"), "{message}");
}

#[test]
fn a_loaded_body_that_its_leaders_do_not_hold_is_refused() {
    let load = "loads=[{kind=\"body\",force=[1.0,0.0]}]";
    let at_one_point = "roles=[{region={kind=\"ids\",ids=[1]},role=\"clamped\"}]";
    let message = refusal("lattice-square", &[MATERIAL, BY_MATERIAL, CELLS, load, at_one_point]);
    assert!(message.contains("held at one particle only and turns about it"), "{message}");
}

#[test]
fn tractions_and_weight_act_on_the_thickness_and_forces_on_the_whole_of_it() {
    let held = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"}]";
    let largest = |load: &str, thickness: &str| {
        let thickness = format!("material.thickness={thickness}");
        let load = format!("loads=[{load}]");
        let shape = "body.shape={kind=\"grid\",columns=9,rows=5}";
        let overrides = [MATERIAL, BY_MATERIAL, CELLS, held, shape, &thickness, &load, "equilibrium={}"];
        let outcome = ended(&load_with("lattice-square", &overrides, &[]));
        let engine = &outcome.engine;
        let moved = engine.present().iter().zip(engine.body().reference.iter());
        moved.map(|(x, p)| distance(x, p)).fold(0.0, f64::max)
    };
    let right = "region={kind=\"edge\",side=\"right\"}";
    for (load, thin_over_thick) in [
        (format!("{{kind=\"traction\",{right},traction=[3.0,1.0]}}"), 1.0),
        ("{kind=\"body\",force=[0.5,-1.0]}".to_owned(), 1.0),
        (format!("{{kind=\"force\",{right},force=[3.0,1.0]}}"), 4.0),
    ] {
        let ratio = largest(&load, "0.5") / largest(&load, "2.0");
        assert!((ratio / thin_over_thick - 1.0).abs() < 1e-9, "{load}: {ratio}");
    }
}

/// A cantilever one cell high, loaded across at its end.
fn slender(length: f64, solver: &str) -> Scene {
    let text = format!(
        "title = \"slender\"\nstop = {{ steps = 1 }}\n\
         equilibrium = {{ solver = \"{solver}\", tolerance = 1e-12 }}\n\
         rule = {{ mean = {{ kind = \"material\" }} }}\n\
         lattice = {{ kind = \"square\", spacing = 1.0 }}\n\
         material = {{ kind = \"isotropic\", young = 1000.0, poisson = 0.3 }}\n\
         body = {{ shape = {{ kind = \"rectangle\", max = [{length:?}, 1.0] }} }}\n\
         roles = [{{ region = {{ kind = \"edge\", side = \"left\" }}, role = \"clamped\" }}]\n\
         loads = [{{ kind = \"traction\", region = {{ kind = \"edge\", side = \"right\" }}, traction = [0.0, 1e-6] }}]\n"
    );
    Scene::parse("slender", "slender.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"))
}

#[cfg(feature = "export")]
#[test]
fn a_body_solved_as_far_as_rounding_goes_is_not_said_to_move() {
    let scene = slender(2000.0, "direct");
    let outcome = ended(&scene);
    assert_eq!(outcome.reason, StopReason::Equilibrium);
    let solved = outcome.solved.as_ref().expect("solved");
    assert!(!solved.converged && solved.known_to.is_some(), "{:?}", solved.residuals.last());
    let (measured, _) = Measured::of(&scene, &outcome).expect("a material");
    let words = measured.to_string();
    assert!(words.contains("what tolerance and rounding leave: an unbalanced force of"), "{words}");
    assert!(!words.contains("not at rest"), "{words}");
    // The same body ended short of any equilibrium.
    let mut short = outcome;
    let solved = short.solved.as_mut().expect("solved");
    solved.known_to = None;
    let (measured, _) = Measured::of(&scene, &short).expect("a material");
    assert!(measured.to_string().contains("not at rest"), "{measured}");
}

#[test]
fn a_factorisation_is_foreseen_where_an_iteration_may_fall_back_on_it() {
    let fallback = |length: f64, solver: &str| {
        let scene = slender(length, solver);
        fallback(&scene, &planned(&scene))
    };
    assert!(fallback(2000.0, "auto").is_some_and(|bytes| bytes > 1 << 20));
    // Factorised before any iteration, or asked for by name.
    assert_eq!(
        [fallback(100.0, "auto"), fallback(2000.0, "direct"), fallback(2000.0, "multigrid")],
        [None; 3]
    );
}
