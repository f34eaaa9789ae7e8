//! The equilibrium of a body of which each rank lays out a part has the bits of one that is laid out as a whole.

use std::ops::ControlFlow;

use flockform::continuum::equilibrium::{run_to_equilibrium, run_to_equilibrium_shared};
use flockform::continuum::parts::laid_out_whole_for;
use flockform::continuum::plan::Plan;

use super::parts::{PLATE, assert_scene_parted_the_same, plate};
use super::scenes::{load, planned};
use super::written::{SEVERAL, assert_tables_the_same};
use super::{Looks, on_ranks, solved_on};

/// Loads of every kind.
const LOADS: &str = "loads=[{kind=\"pressure\",region={kind=\"outline\",hole=1},pressure=9.0},\
     {kind=\"traction\",region={kind=\"edge\",side=\"top\",depth=4.0},traction=[2.0,7.0],\
     profile={from=[0.0,0.0],to=[20.0,1.0],factors=[0.5,1.5]}},\
     {kind=\"force\",region={kind=\"disc\",centre=[17.0,6.0],radius=2.0},force=[0.5,-1.5]},\
     {kind=\"body\",force=[0.1,-0.7]}]";

/// A side that is kept from moving along an axis.
fn held(side: &str, axis: &str) -> String {
    format!("{{region={{kind=\"edge\",side=\"{side}\",depth=1.5}},role=\"clamped\",axis=\"{axis}\"}}")
}

/// A quarter of a body that is pulled.
fn pulled() -> String {
    let led = "{region={kind=\"edge\",side=\"right\",depth=1.5},role=\"leader\",axis=\"x\",\
         motion={kind=\"keyframes\",frames=[{step=20,displacement=[0.8,0.0]}]}}";
    format!("roles=[{},{},{led}]", held("left", "x"), held("bottom", "y"))
}

/// A scene of the plate whose equilibrium a solver finds.
fn assert_at_rest_the_same(solver: &str, sets: &[&str]) {
    let asked = format!("equilibrium={{solver=\"{solver}\",tolerance=1e-7}}");
    // A body that is put to rest has no history.
    let sets = [&[&asked[..]], sets, &["record.probes=[]"]].concat();
    assert_scene_parted_the_same(&plate(PLATE, &sets), &format!("{sets:?}"), 60);
}

#[test]
fn the_equilibrium_of_a_body_in_parts_has_the_bits_of_one_laid_out_as_a_whole() {
    let grid = "body={shape={kind=\"grid\",columns=24,rows=9}}";
    let lattice = |kind: &str| format!("lattice={{kind=\"{kind}\",spacing=1.0}}");
    let [hexagonal, honeycomb] = ["hexagonal", "honeycomb"].map(lattice);
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[14.0,6.0],radius=3.1},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let places = "record={places=[[16.3,5.8],[2.1,5.5],[20.9,5.0],[12.0,6.0]]}";
    let rollers = format!("roles=[{},{}]", held("left", "x"), held("bottom", "y"));
    let pulled = pulled();
    let whole_cells = "body={outline=\"fitted\",shape={kind=\"rectangle\",max=[22,9]}}";
    for sets in [
        &[][..],
        &[LOADS, places],
        &[grid],
        &[&hexagonal, LOADS],
        &[&honeycomb],
        &[&honeycomb, grid],
        &["lattice={kind=\"rectangular\",a=1.0,b=0.7}"],
        &["lattice={kind=\"centred-rectangular\",a=1.5,b=1.1}", LOADS],
        &["lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}"],
        &[inclusion, LOADS],
        &["material.poisson=0.49", LOADS],
        &[&rollers, LOADS],
        &[&pulled, places],
        &[grid, &pulled],
        &[whole_cells, places],
    ] {
        assert_at_rest_the_same("multigrid", sets);
        assert_at_rest_the_same("auto", sets);
    }
    for solver in ["conjugate-gradients", "direct", "jacobi", "gauss-seidel", "chebyshev"] {
        assert_at_rest_the_same(solver, &[LOADS, &pulled]);
    }
}

#[test]
fn so_has_that_of_a_body_whose_outline_cuts_cells() {
    let lattice = |kind: &str| format!("lattice={{kind=\"{kind}\",spacing=1.0}}");
    let [hexagonal, honeycomb] = ["hexagonal", "honeycomb"].map(lattice);
    let oblique = "lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}";
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[15.6,5.4],radius=2.6},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let turned =
        "body={shape={kind=\"polygon\",vertices=[[0.2,0.1],[21.3,-0.4],[23.1,7.7],[12.0,9.9],[1.1,8.3]]}}";
    let long = "body={shape={kind=\"polygon\",vertices=[[0.2,0.1],[60.3,-0.4],[120.1,3.7],[90.0,10.9],[1.1,8.3]]},\
         holes=[{kind=\"disc\",centre=[30.4,4.3],radius=2.1},{kind=\"disc\",centre=[70.1,5.3],radius=2.6},\
         {kind=\"disc\",centre=[100.2,5.9],radius=1.3}]}";
    // Sides along columns that stand at no site.
    let beside = "body={shape={kind=\"rectangle\",min=[-0.3,0.4],max=[22.4,9.3]}}";
    let places = "record={places=[[16.3,5.8],[2.1,5.5],[20.9,5.0],[12.0,8.0]]}";
    let pulled = pulled();
    let at_rest = |solver: &str, sets: &[&str]| {
        assert_at_rest_the_same(solver, &[&["body.outline=\"fitted\""], sets].concat());
    };
    for sets in [
        &[][..],
        &[LOADS, places],
        &[inclusion, LOADS],
        &[&hexagonal, inclusion, LOADS, places],
        &["material={kind=\"isotropic\",young=1000.0,poisson=0.49,plane=\"strain\"}", LOADS],
        &[&honeycomb],
        &["lattice={kind=\"centred-rectangular\",a=1.5,b=1.1}", LOADS],
        &["lattice={kind=\"rectangular\",a=1.0,b=0.7}"],
        &[oblique, LOADS],
        &[turned],
        &[turned, &hexagonal],
        &[long, LOADS],
        &[long, LOADS, oblique],
        &[long, &honeycomb],
        &[beside, &pulled],
        &[&pulled, LOADS, places],
    ] {
        at_rest("multigrid", sets);
        at_rest("auto", sets);
    }
    for solver in ["conjugate-gradients", "direct", "jacobi", "gauss-seidel", "chebyshev"] {
        at_rest(solver, &[LOADS, &pulled]);
    }
}

/// Rules of the paper are linear too, with their frames.
#[test]
fn rules_of_the_paper_too() {
    let paper = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}"];
    let grid = "body={shape={kind=\"grid\",columns=24,rows=9}}";
    for more in [&[][..], &[grid], &["frame=\"lagged\""], &[grid, "frame=\"immediate\""]] {
        assert_at_rest_the_same("auto", &[&paper[..], more].concat());
    }
    assert_at_rest_the_same("multigrid", &paper);
}

/// Large enough for several ranks to share two levels and more.
#[test]
fn a_large_equilibrium_too() {
    assert_at_rest_the_same("multigrid", &["lattice={kind=\"square\",spacing=0.05}"]);
}

/// The same of a body with particles along its outline, most of which another rank iterates with than lays them out.
#[test]
fn a_large_equilibrium_along_an_outline_too() {
    let fine = "lattice={kind=\"square\",spacing=0.06}";
    let single = "equilibrium.precision=\"f32\"";
    let fitted = "body.outline=\"fitted\"";
    assert_at_rest_the_same("multigrid", &[fitted, fine]);
    assert_at_rest_the_same("multigrid", &[fitted, fine, single, "equilibrium.tolerance=1e-4"]);
    let coarser = "lattice={kind=\"square\",spacing=0.1}";
    assert_at_rest_the_same("conjugate-gradients", &[fitted, coarser, "equilibrium.tolerance=1e-3"]);
}

/// Beside a stiff inclusion rounding ends the first solve, and what it leaves is solved for again.
#[test]
fn what_rounding_leaves_is_solved_for_again_alike() {
    let stiff = "body.inclusions=[{shape={kind=\"disc\",centre=[15.5,6.0],radius=2.6},\
         material={kind=\"isotropic\",young=1e12,poisson=0.2}}]";
    for solver in ["multigrid", "conjugate-gradients"] {
        for more in [&[][..], &["body.outline=\"fitted\""]] {
            let sets = [&[stiff, LOADS], more].concat();
            assert_at_rest_the_same(solver, &sets);
            let asked = format!("equilibrium={{solver=\"{solver}\",tolerance=1e-7}}");
            let scene = plate(PLATE, &[&[&asked[..]], &sets[..], &["record.probes=[]"]].concat());
            let outcome = run_to_equilibrium(&scene, planned(&scene), &mut |_, _| ControlFlow::Continue(()));
            let solved = outcome.expect("solvable").solved.expect("solved");
            assert!(
                !solved.converged && solved.known_to.is_some_and(|error| error < 1e-3),
                "{solver} {more:?}: {:?}",
                solved.known_to
            );
        }
    }
}

#[test]
fn what_a_body_at_rest_leaves_is_written_in_parts_as_it_is_alone() {
    for outline in ["lattice", "fitted"] {
        for solver in ["multigrid", "auto", "conjugate-gradients"] {
            let asked = format!("equilibrium={{solver=\"{solver}\",tolerance=1e-7}}");
            let outline = format!("body.outline=\"{outline}\"");
            let sets = [&asked, &outline, SEVERAL, "record={probes=[],places=[[16.3,5.8],[2.1,5.5]]}"];
            assert_tables_the_same(&plate(PLATE, &sets));
        }
    }
}

#[test]
fn what_has_no_equilibrium_is_refused_by_all_ranks_with_the_same_words() {
    let asked = "equilibrium={solver=\"multigrid\",tolerance=1e-7}";
    let fitted = "body.outline=\"fitted\"";
    // The first column of some has a particle at no site alone, which comes after all others in the whole.
    let tips: Vec<String> = (0..6).map(|k| -0.15 * f64::from(k)).map(|x| format!(
        "body={{outline=\"fitted\",shape={{kind=\"polygon\",vertices=[[{x:?},4.9],[6.0,-1.0],[22.3,4.0],[6.0,10.9]]}}}}"
    )).collect();
    let hexagonal = "lattice={kind=\"hexagonal\",spacing=1.0}";
    let mut cases = vec![
        ("no particle follows", vec!["roles=[{region={kind=\"all\"},role=\"clamped\"}]"]),
        ("connected to no held particle", vec!["roles=[]"]),
        ("connected to no held particle", vec![fitted, "roles=[]"]),
        ("connected to no held particle", vec![fitted, hexagonal, "roles=[]"]),
        ("not linear", vec!["rule.mean={kind=\"power\",exponent=2.0}", "neighbours={kind=\"second\"}"]),
    ];
    cases.extend(tips.iter().map(|tip| ("connected to no held particle", vec![&tip[..], "roles=[]"])));
    let mut named_last = 0;
    for (what, sets) in cases {
        let scene = plate(PLATE, &[&[asked, "record.probes=[]"], &sets[..]].concat());
        let alone = run_to_equilibrium_shared(&scene, planned(&scene), None, None, &mut Looks::every(1));
        let alone = alone.expect_err("no equilibrium").to_string();
        assert!(alone.contains(what), "{what}: {alone}");
        named_last += usize::from(what.starts_with("connected") && !alone.contains("particle 1 is"));
        for ranks in [1, 2, 3, 5] {
            let words = on_ranks(ranks, |team| {
                let plan = Plan::of_part(&scene, &team).unwrap_or_else(|error| panic!("{error}"));
                solved_on(&scene, &plan, &team).expect_err("no equilibrium").to_string()
            });
            assert!(words.iter().all(|one| *one == alone), "{ranks} ranks: {alone}\n{words:?}");
        }
    }
    assert!(named_last > 0);
}

#[test]
fn what_cannot_be_solved_in_parts_is_laid_out_whole_by_name() {
    let whole_for = |name: &str, sets: &[&str]| laid_out_whole_for(&load(name, sets));
    assert_eq!(whole_for("beam-loaded", &[]), None);
    assert_eq!(whole_for("elastica", &[]), None);
    assert_eq!(whole_for("ring", &[]), None);
    assert_eq!(whole_for("beam-loaded", &["load_steps={increments=3}"]), None);
    let accurate = "equilibrium={accuracy=0.05}";
    assert_eq!(whole_for("beam-loaded", &[accurate]).as_deref(), Some("equilibrium"));
}
