//! What a plan and a run warn of.

use flockform::continuum::report::PlanReport;
use flockform::scene::Scene;

use crate::support::*;

#[test]
fn a_plan_and_a_run_caution_against_what_does_not_suit_the_body() {
    let cautions =
        |scene: &Scene| PlanReport::new(scene, &planned(scene)).expect("planned").cautions.join("\n");
    let short = cautions(&pulled([6, 4], 0.1, "[fracture]; distance = 0.9"));
    assert!(short.contains("fracture.distance = 0.9") && short.contains("38 bonds"), "{short}");
    assert!(!cautions(&pulled([6, 4], 0.1, "[fracture]; distance = 1.1")).contains("fracture.distance"));
    let framed = cautions(&load("tension", &["record.probes=[67,12,1]"]));
    assert!(framed.contains("record.probes has points of the frame, 2 in all, the first 12:"), "{framed}");
    assert!(!cautions(&load("second-gradient", &[])).contains("record.probes"));
    let mirrored = |kind: &str| cautions(&load(kind, &["fracture={distance=3.0,ghosts=\"mirrored\"}"]));
    assert!(mirrored("lattice-honeycomb").contains("do not lie opposite each other: fracture.ghosts"));
    assert!(!mirrored("lattice-square").contains("fracture.ghosts"));
    // The lattice ends 0.9 before the shape does, along both axes.
    let short = "body={shape={kind='rectangle',max=[6.9,6.9]},outline='lattice'}";
    let short = cautions(&load("bar", &["lattice={kind='square',spacing=1.0}", short, "record={}"]));
    assert!(short.contains("its boundary lies up to 1.273 "), "{short}");
    let world = "[rule]; mean = { kind = 'geometric', origin = 'world' };";
    let unmoved = cautions(&pulled([4, 3], 0.1, world));
    assert!(!unmoved.contains("followers"), "{unmoved}");
    let negative = parsed(&negative(world));
    let unmoved = cautions(&negative);
    assert!(unmoved.contains("4 of 6 followers"), "{unmoved}");
    // Along the other axis they do.
    let moved = run_out(&negative);
    let [dx, dy] = displacement(&moved.engine, 4);
    assert!(dx > 0.0 && dy == 0.0, "{dx} {dy}");
}

#[test]
fn a_material_whose_cells_lock_in_shear_is_a_caution() {
    let is_cautioned = |more: &str| {
        let more = format!(
            "[rule]; mean.kind = 'material'; [material]; kind = 'isotropic'; young = 1.0; poisson = {more}"
        );
        let scene = pulled([6, 4], 0.1, &more);
        PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n").contains("cells lock")
    };
    assert!(is_cautioned("-0.9"));
    assert!(!is_cautioned("-0.7") && !is_cautioned("-0.9; plane = 'strain'"));
}

/// Off their axis a cantilever of whole cells bends by three quarters of what it should with fibres 14 times as stiff, by the truth of
/// `compare`; along it by all of it.
#[test]
fn fibres_across_the_sides_of_cells_are_a_caution() {
    let is_cautioned = |fibres: &str, lattice: &str| {
        let text = format!(
            "title = 'ply'\nlattice = {{ {lattice} }}\nbody.shape = {{ kind = 'rectangle', max = [8.0, 4.0] }}\n\
             rule.mean.kind = 'material'\nmaterial = {{ kind = 'orthotropic', poisson_12 = 0.3, {fibres} }}\n\
             roles = [{{ region = {{ kind = 'edge', side = 'left' }}, role = 'clamped' }}]\n\
             loads = [{{ kind = 'traction', region = {{ kind = 'edge', side = 'right' }}, traction = [0.0, 0.001] }}]\n\
             equilibrium = {{}}\nstop.steps = 1"
        );
        let scene =
            Scene::parse("ply", "ply.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n").contains("fibres")
    };
    let ply = |angle: f64| format!("young = [140.0, 10.0], shear = 5.0, angle = {angle:?}");
    let square = |turn: f64| format!("kind = 'square', spacing = 1.0, orientation = {turn:?}");
    assert!(is_cautioned(&ply(30.0), &square(0.0)) && is_cautioned(&ply(0.0), &square(30.0)));
    assert!(is_cautioned(&ply(0.0), "kind = 'hexagonal', spacing = 1.0"));
    for angle in [0.0, 90.0, -90.0] {
        assert!(!is_cautioned(&ply(angle), &square(0.0)), "{angle}");
    }
    assert!(!is_cautioned(&ply(30.0), &square(30.0)) && !is_cautioned(&ply(30.0), &square(-60.0)));
    assert!(!is_cautioned("young = [9.0, 5.0], shear = 2.0, angle = 30.0", &square(0.0)));
}

/// Squares are right with stresses that are assumed, and what is resisted far more than all else is averaged on every lattice; triangles
/// of a laminate at 45 degrees are 4 % too stiff with 10 cells across.
#[test]
fn an_orthotropic_material_is_a_caution_where_it_locks_alone() {
    let caution = |kind: &str, constants: &str| {
        let text = format!(
            "title = 'sheet'\nlattice = {{ kind = '{kind}', spacing = 0.5 }}\n\
             body.shape = {{ kind = 'rectangle', max = [20.0, 5.0] }}\n\
             rule.mean.kind = 'material'\nmaterial = {{ kind = 'orthotropic', {constants} }}\nequilibrium = {{}}\nstop.steps = 1\n\
             roles = [{{ region = {{ kind = 'edge', side = 'left' }}, role = 'clamped' }}]\n\
             loads = [{{ kind = 'traction', region = {{ kind = 'edge', side = 'right' }}, traction = [0.0, 1.0] }}]"
        );
        let scene =
            Scene::parse("sheet", "sheet.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions.join("\n")
    };
    let area = "young = [1000.0, 1000.0], poisson_12 = 0.98, shear = 252.525";
    let shear = "young = [1000.0, 1000.0], poisson_12 = 0.0, shear = 5e4";
    let laminate = "young = [18e3, 18e3], poisson_12 = 0.78, shear = 36e3";
    for constants in [area, shear, laminate] {
        let said = caution("square", constants);
        assert!(!said.contains("resists"), "{constants}: {said}");
    }
    for constants in [area, shear] {
        let said = caution("hexagonal", constants);
        assert!(!said.contains("resists"), "{constants}: {said}");
    }
    let said = caution("hexagonal", laminate);
    assert!(
        said.contains("resists a change of area 8 times") && said.contains("use a square lattice"),
        "{said}"
    );
}

#[test]
fn whole_cells_of_a_grid_are_cautioned_as_those_of_a_rectangle() {
    let cautions = |shape: &str| {
        let text = format!(
            "title = 'grid'\nlattice = {{ kind = 'square', spacing = 1.0 }}\nbody = {{ {shape} }}\nrule.mean.kind = 'material'\n\
             material = {{ kind = 'isotropic', young = 1.0, poisson = 0.3 }}\nequilibrium = {{}}\nstop.steps = 1\n\
             roles = [{{ region = {{ kind = 'edge', side = 'left' }}, role = 'clamped' }},\n{{ region = {{ kind = 'edge', side = 'right' }}, \
             role = 'leader', motion = {{ kind = 'keyframes', frames = [{{ step = 1, displacement = [0.1, 0.0] }}] }} }}]"
        );
        let scene =
            Scene::parse("grid", "grid.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        let cautions = PlanReport::new(&scene, &planned(&scene)).expect("planned").cautions;
        ["along the edges", "one or two cells thick"]
            .map(|words| cautions.iter().any(|one| one.contains(words)))
    };
    assert_eq!(cautions("shape = { kind = 'grid', columns = 21, rows = 3 }"), [true, true]);
    assert_eq!(cautions("shape = { kind = 'grid', columns = 21, rows = 5 }"), [true, false]);
    let rectangle = |height: f64| {
        format!("outline = 'lattice', shape = {{ kind = 'rectangle', max = [20.0, {height:?}] }}")
    };
    assert_eq!(cautions(&rectangle(2.0)), [true, true]);
    assert_eq!(cautions(&rectangle(4.0)), [true, false]);
}
