//! Bodies so slender, or so uneven, that rounded rows hold them: against closed forms and limits.

use std::ops::ControlFlow;

use flockform::continuum::equilibrium::run_to_equilibrium;
use flockform::continuum::mechanics::Mechanics;
use flockform::scene::Scene;

use crate::scenes::planned;

const YOUNG: f64 = 1000.0;

/// The deflection that ends a beam of height 1 with so many square cells over it, of a material without Poisson's ratio. Such a
/// cell with straight sides is `1 + 1 / 2` times as stiff in bending as what it stands for (R. D. Cook et al., *Concepts and
/// Applications of Finite Element Analysis*, parasitic shear); the share of `n` of them over the height is `1 + 1 / (2 n n)`.
fn deflection([shear, moment]: [f64; 2], length: f64, cells: f64) -> f64 {
    let stiffness = YOUNG / 12.0 * (1.0 + 0.5 / (cells * cells));
    let of_shear = 2.0 * shear * length / YOUNG;
    length * length * (shear * length / 3.0 + moment / 2.0) / stiffness + of_shear
}

/// A strip that is clamped on the left, with these lines besides.
fn strip(length: f64, cells: f64, solver: &str, more: &str) -> String {
    format!(
        "title = \"strip\"\n\
         lattice = {{ kind = \"square\", spacing = {} }}\n\
         body = {{ shape = {{ kind = \"rectangle\", max = [{length:?}, 1.0] }} }}\n\
         material = {{ kind = \"isotropic\", young = {YOUNG:?}, poisson = 0.0 }}\n\
         rule = {{ mean = {{ kind = \"material\" }} }}\n\
         equilibrium = {{ solver = \"{solver}\" }}\n\
         {more}[[roles]]\nregion = {{ kind = \"edge\", side = \"left\" }}\nrole = \"clamped\"\n",
        1.0 / cells
    )
}

fn found(length: f64, cells: f64, solver: &str, load: &str) -> f64 {
    let load = format!(
        "loads = [{{ kind = \"traction\", region = {{ kind = \"edge\", side = \"right\" }}, {load} }}]\n"
    );
    let [free, _] = of_the_end(&strip(length, cells, solver, &load), length);
    free
}

/// The mean displacement along y of the particles at this x, and what it is known to be off by \[1\].
fn of_the_end(text: &str, x: f64) -> [f64; 2] {
    let scene = Scene::parse("bent", "bent.toml", text, &[], None).unwrap_or_else(|error| panic!("{error}"));
    let outcome = run_to_equilibrium(&scene, planned(&scene), &mut |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|error| panic!("{error}"));
    let solved = outcome.solved.expect("solved");
    assert!(solved.is_at_rest(), "{text}: {:?}", solved.known_to);
    let ends = outcome.engine.body().reference.iter().zip(solved.displacement.iter());
    let ends: Vec<f64> = ends.filter(|(place, _)| place[0] > x - 1e-6).map(|(_, u)| u[1]).collect();
    [
        ends.iter().sum::<f64>() / ends.len() as f64,
        solved.known_to.unwrap_or(solved.residuals[solved.iterations]),
    ]
}

#[test]
fn a_beam_thousands_of_times_as_long_as_high_bends_as_its_closed_form() {
    for (length, cells, solver) in
        [(1000.0, 2.0, "multigrid"), (2000.0, 2.0, "direct"), (4000.0, 1.0, "direct")]
    {
        // About as far as the beam is high.
        let shear = 250.0 / (length * length * length);
        let across = format!("traction = [0.0, {shear:e}]");
        let moment = 1e3 / 6.0 / (length * length);
        let turning = format!(
            "traction = [{:e}, 0.0], profile = {{ from = [{length:?}, 0.0], to = [{length:?}, 1.0], factors = [1.0, -1.0] }}",
            6.0 * moment
        );
        for (load, [shear, moment]) in [(across, [shear, 0.0]), (turning, [0.0, moment])] {
            let (exact, found) =
                (deflection([shear, moment], length, cells), found(length, cells, solver, &load));
            let off = found / exact - 1.0;
            assert!(off.abs() < 1e-6, "{length} {cells} {solver} {load}: {off:e}");
        }
    }
}

#[test]
fn a_disc_of_a_hundred_thousand_million_times_the_stiffness_is_rigid() {
    let bent = |young: &str| {
        let text = format!(
            "title = \"rigid\"\nlattice = {{ kind = \"square\", spacing = 0.25 }}\n\
             material = {{ kind = \"isotropic\", young = 1.0, poisson = 0.3 }}\nrule = {{ mean = {{ kind = \"material\" }} }}\n\
             roles = [{{ region = {{ kind = \"edge\", side = \"left\" }}, role = \"clamped\" }}]\n\
             loads = [{{ kind = \"traction\", region = {{ kind = \"edge\", side = \"right\" }}, traction = [0.0, 1e-3] }}]\n\
             equilibrium = {{ }}\n\
             [body]\nshape = {{ kind = \"rectangle\", max = [20.0, 5.0] }}\n\
             [[body.inclusions]]\nshape = {{ kind = \"disc\", centre = [10.0, 2.5], radius = 1.5 }}\n\
             material = {{ kind = \"isotropic\", young = {young}, poisson = 0.3 }}\n"
        );
        of_the_end(&text, 20.0)
    };
    // What the disc itself gives is a millionth of what the body around it does.
    let [rigid, _] = bent("1e6");
    for young in ["1e9", "1e11"] {
        let [found, known_to] = bent(young);
        let off = (found / rigid - 1.0).abs();
        // Known on the average of the body, and its end moves most.
        assert!(off < 1e-5 + 2.0 * known_to && known_to < 1e-4, "{young}: {off:e}, said to be {known_to:e}");
    }
}

/// With all followers at zero the leaders would need thousands of times the force that they do need, of which the tolerance is a part.
#[test]
fn a_beam_whose_end_is_led_takes_the_force_of_its_closed_form() {
    let led = "stop = { steps = 1 }\n[[roles]]\nregion = { kind = \"edge\", side = \"right\" }\nrole = \"leader\"\naxis = \"y\"\n\
               motion = { kind = \"velocity\", per_step = [0.0, 0.01] }\n";
    let end = |length: f64, cells: f64, solver: &str, rotation: &str| {
        let rotation = format!("kind = \"material\", rotation = \"{rotation}\"");
        let text = strip(length, cells, solver, led).replace("kind = \"material\"", &rotation);
        let scene =
            Scene::parse("led", "led.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        let outcome = run_to_equilibrium(&scene, planned(&scene), &mut |_, _| ControlFlow::Continue(()))
            .unwrap_or_else(|error| panic!("{error}"));
        let solved = outcome.solved.as_ref().expect("solved");
        let forces = Mechanics::of(&outcome.engine).expect("a material");
        let leader = forces.reactions.iter().find(|one| one.role == "leader").expect("a leader");
        (solved.is_at_rest(), leader.force[1])
    };
    for (length, cells, solver, rotation) in [
        (200.0, 2.0, "conjugate-gradients", "small"),
        (1000.0, 2.0, "multigrid", "small"),
        (4000.0, 1.0, "multigrid", "small"),
        (4000.0, 1.0, "direct", "small"),
        (1000.0, 2.0, "multigrid", "corotated"),
        (4000.0, 2.0, "direct", "corotated"),
    ] {
        let (is_at_rest, found) = end(length, cells, solver, rotation);
        let exact = 0.01 / deflection([1.0, 0.0], length, cells);
        let off = found / exact - 1.0;
        assert!(is_at_rest && off.abs() < 1e-4, "{length} {cells} {solver} {rotation}: {off:e}");
    }
    // Its iterations do not find so slow a mode: then it says so.
    assert!(!end(1000.0, 1.0, "conjugate-gradients", "small").0);
}

/// Supports that move turn it about, and reactions are rounding.
#[test]
fn a_body_that_is_only_carried_about_is_at_rest() {
    for solver in ["direct", "multigrid", "conjugate-gradients"] {
        let text = format!(
            "title = \"settlement\"\nlattice = {{ kind = \"square\", spacing = 0.05 }}\n\
             body = {{ shape = {{ kind = \"rectangle\", max = [2.0, 0.5] }} }}\n\
             material = {{ kind = \"isotropic\", young = 210e9, poisson = 0.3 }}\nrule = {{ mean = {{ kind = \"material\" }} }}\n\
             equilibrium = {{ solver = \"{solver}\" }}\nstop = {{ steps = 1 }}\n\
             [[roles]]\nregion = {{ kind = \"disc\", centre = [0.0, 0.0], radius = 0.01 }}\nrole = \"clamped\"\n\
             [[roles]]\nregion = {{ kind = \"disc\", centre = [2.0, 0.0], radius = 0.01 }}\nrole = \"leader\"\naxis = \"y\"\n\
             motion = {{ kind = \"velocity\", per_step = [0.0, -0.01] }}\n"
        );
        let [end, _] = of_the_end(&text, 2.0);
        assert!((end + 0.01).abs() < 1e-9, "{solver}: {end}");
    }
}

/// What iterations have no time for is not sought by more of them.
#[test]
fn a_solve_that_runs_out_of_iterations_is_not_refined() {
    let shear = "loads = [{ kind = \"traction\", region = { kind = \"edge\", side = \"right\" }, traction = [0.0, 1e-3] }]\n";
    let text = strip(20.0, 4.0, "conjugate-gradients\", most_iterations = 50, precision = \"f64", shear);
    let scene = Scene::parse("cut", "cut.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
    let outcome = run_to_equilibrium(&scene, planned(&scene), &mut |_, _| ControlFlow::Continue(()));
    let solved = outcome.unwrap_or_else(|error| panic!("{error}")).solved.expect("solved");
    assert_eq!((solved.iterations, solved.converged, solved.known_to), (50, false, None));
}
