//! Equilibria of corotated materials of a body in parts are those of one that is laid out as a whole.

use flockform::continuum::parts::laid_out_whole_for;
use flockform::continuum::plan::Plan;

use super::parts::{PLATE, assert_scene_parted_the_same, plate};
use super::written::{SEVERAL, assert_tables_the_same};
use super::{on_ranks, solved_on};

const TURNS: &str = "rule.mean={kind=\"material\",rotation=\"corotated\"}";
const SOFT: &str = "material={kind=\"isotropic\",young=1000.0,poisson=0.49,plane=\"strain\"}";
const FITTED: &str = "body.outline=\"fitted\"";
const GRID: &str = "body={shape={kind=\"grid\",columns=24,rows=9}}";

fn asked(solver: &str) -> String {
    format!("equilibrium={{solver=\"{solver}\",tolerance=1e-7}}")
}

/// The right end goes round by so much.
fn bent(by: [f64; 2]) -> String {
    format!("roles[1].motion={{kind=\"keyframes\",frames=[{{step=40,displacement={by:?}}}]}}")
}

#[test]
fn equilibria_of_corotated_materials_in_parts_have_the_bits_of_those_of_a_whole() {
    let lattice = |kind: &str| format!("lattice={{kind=\"{kind}\",spacing=1.0}}");
    let [hexagonal, honeycomb] = ["hexagonal", "honeycomb"].map(lattice);
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[14.0,6.0],radius=3.1},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let held = |side: &str, axis: &str| {
        format!("{{region={{kind=\"edge\",side=\"{side}\",depth=1.5}},role=\"clamped\",axis=\"{axis}\"}}")
    };
    let rollers = format!("roles=[{},{}]", held("left", "x"), held("bottom", "y"));
    let whole_cells = "body={outline=\"fitted\",shape={kind=\"rectangle\",max=[22,9]}}";
    let far = bent([-4.0, 9.0]);
    let record = "record={probes=[],places=[[16.3,5.8],[2.1,5.5],[20.9,5.0]]}";
    let cases = [
        &[][..],
        &[SEVERAL],
        &[&far],
        &[&far, GRID],
        &[&hexagonal, SEVERAL],
        &[&honeycomb],
        &["lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}", SEVERAL],
        &[inclusion, SEVERAL],
        &[SOFT, SEVERAL],
        &[&rollers, SEVERAL],
        &[whole_cells, &far],
        &[FITTED],
        &[FITTED, &far, SEVERAL],
        &[FITTED, &hexagonal, &far],
        &[FITTED, SOFT, SEVERAL],
        &[FITTED, &rollers, SEVERAL],
    ];
    for (solver, sets) in ["multigrid", "auto"].into_iter().cycle().zip(cases) {
        let asked = asked(solver);
        let sets = [&[TURNS, &asked, record], sets].concat();
        assert_scene_parted_the_same(&plate(PLATE, &sets), &format!("{sets:?}"), 60);
    }
    for outline in ["body.outline=\"lattice\"", FITTED] {
        let sets = [TURNS, &asked("conjugate-gradients"), record, SEVERAL, outline];
        assert_scene_parted_the_same(&plate(PLATE, &sets), &format!("{sets:?}"), 60);
    }
}

/// Large enough for several ranks to share two levels.
#[test]
fn a_large_equilibrium_of_a_corotated_material_too() {
    let fine = "lattice={kind=\"square\",spacing=0.16}";
    for outline in ["body.outline=\"lattice\"", FITTED] {
        let sets = [TURNS, &asked("multigrid"), fine, "record.probes=[]", &bent([-0.5, 1.5]), outline];
        assert_scene_parted_the_same(&plate(PLATE, &sets), outline, 60);
    }
}

#[test]
fn increments_of_a_corotated_material_in_parts_are_those_of_one_alone() {
    let far = bent([-4.0, 9.0]);
    for load_steps in ["load_steps={increments=5}", "load_steps={schedule=[0.2,0.7,1.0,0.5,0.0]}"] {
        for outline in ["body.outline=\"lattice\"", FITTED] {
            let sets = [TURNS, &asked("auto"), &far, SEVERAL, load_steps, outline];
            assert_scene_parted_the_same(&plate(PLATE, &sets), load_steps, 60);
            assert_tables_the_same(&plate(PLATE, &[&sets[..], &["record.probes=[]"]].concat()));
        }
    }
}

/// The last of which is lost on the way.
#[test]
fn a_way_that_is_lost_ends_in_parts_where_it_ends_alone() {
    let crushed = "loads=[{kind=\"body\",force=[-300.0,0.0]}]";
    let sets = [TURNS, &asked("auto"), "roles[1]={region={kind=\"edge\",side=\"left\"},role=\"clamped\"}"];
    let scene = plate(PLATE, &[&sets[..], &[crushed, "load_steps={schedule=[0.001,1.0]}"]].concat());
    assert_scene_parted_the_same(&scene, "crushed", 60);
    let at_once = plate(PLATE, &[&sets[..], &[crushed, "record.probes=[]"]].concat());
    assert_eq!(laid_out_whole_for(&at_once), None);
    let words = |ranks: usize| {
        on_ranks(ranks, |team| {
            let plan = Plan::of_part(&at_once, &team).unwrap_or_else(|error| panic!("{error}"));
            solved_on(&at_once, &plan, &team).expect_err("no equilibrium").to_string()
        })
    };
    let alone = words(1).remove(0);
    assert!(alone.contains("do not settle"), "{alone}");
    for ranks in [2, 3, 5] {
        assert!(words(ranks).iter().all(|one| *one == alone), "{ranks} ranks: {alone}");
    }
}
