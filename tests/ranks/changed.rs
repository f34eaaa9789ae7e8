//! Keys that change on the way of a body in parts, and weights that are found from its places.

use flockform::continuum::parts::laid_out_whole_for;

use super::parts::{
    PLATE, assert_parted_the_same, assert_refused_the_same, assert_scene_parted_the_same, plate,
};
use super::scenes::{load, planned};

fn set(at: usize, keys: &[&str]) -> String {
    let keys: Vec<String> = keys.iter().map(|key| format!("{key:?}")).collect();
    format!("{{at={at},what={{kind=\"set\",keys=[{}]}}}}", keys.join(","))
}

fn actions(all: &[&str]) -> String {
    format!("actions=[{}]", all.join(","))
}

#[test]
fn keys_that_change_on_the_way_of_a_body_in_parts_change_it_as_they_change_one_alone() {
    let damped = set(9, &["update.damping=0.5"]);
    let feedback = set(14, &["rule.feedback={factor=-0.2,reference=\"previous\"}"]);
    let cut = "{at=20,what={kind=\"cut\",from=[6.5,-5.0],to=[6.5,6.2]}}";
    let tears = set(30, &["fracture={stretch=1.2,ghosts=\"mirrored\"}"]);
    let weighted = set(12, &["rule.weights={kind=\"distance\",power=-1.0}"]);
    let small = ["record.probes=[1,30,60,61,100]", "stop.steps=60"];
    for all in [
        &[&damped[..]][..],
        &[&damped, &feedback],
        &[&weighted],
        &[&tears],
        &[&damped, &feedback, cut, &tears],
    ] {
        let all = actions(all);
        assert_parted_the_same("tension", &[&small[..], &[&all]].concat(), 25);
        assert_parted_the_same("tension", &[&small[..], &[&all, "frame=\"none\""]].concat(), 25);
    }
}

#[test]
fn loads_and_constants_that_change_on_the_way_of_a_material_in_parts_too() {
    let fitted = "body.outline=\"fitted\"";
    let grid = "body={shape={kind=\"grid\",columns=24,rows=9}}";
    let stiffer = set(12, &["material.young=2500.0", "material.poisson=0.2"]);
    let pulled =
        set(20, &["loads=[{kind=\"traction\",region={kind=\"edge\",side=\"top\"},traction=[2.0,7.0]}]"]);
    let turned = set(26, &["rule.mean={kind=\"material\",rotation=\"corotated\"}"]);
    let weight = set(31, &["loads=[{kind=\"body\",force=[0.1,-0.7]}]"]);
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[15.6,5.4],radius=2.6},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let ramp = "load_steps={ramp={steps=40},every=7}";
    let heavy = "loads=[{kind=\"body\",force=[0.1,-0.7]}]";
    let all = actions(&[&stiffer, &pulled, &turned, &weight]);
    for sets in [
        &[&actions(&[&stiffer])[..]][..],
        &[&all],
        &[&all, fitted],
        &[&actions(&[&set(9, &["material.poisson=0.49"])])],
        &[&all, grid],
        &[&all, inclusion, fitted],
        &[&all, heavy, ramp],
    ] {
        assert_scene_parted_the_same(&plate(PLATE, sets), &format!("{sets:?}"), 25);
    }
}

#[test]
fn a_body_in_parts_becomes_a_material_or_ceases_to_be_one_as_one_alone_does() {
    let grid = "body={shape={kind=\"grid\",columns=24,rows=9}}";
    let second = "neighbours={kind=\"second\"}";
    // Dilatations are averaged over cells two columns away.
    let soft = "material={kind=\"isotropic\",young=1000.0,poisson=0.49,plane=\"strain\"}";
    let wide = "neighbours={kind=\"chebyshev\",radius=2}";
    let long = "body={shape={kind=\"grid\",columns=160,rows=9}}";
    let [rigid, loose] = ["material", "barycentre"].map(|kind| format!("rule.mean={{kind={kind:?}}}"));
    let both = actions(&[
        &set(12, &[&rigid, "update.damping=0.5"]),
        &set(30, &[&loose, "rule.feedback={factor=-0.2,reference=\"previous\"}"]),
    ]);
    let becomes = actions(&[&set(12, &[&rigid])]);
    let ceases = actions(&[&set(12, &[&loose])]);
    for sets in [
        &[&loose[..], &becomes][..],
        &[&loose, &both],
        &[&loose, &becomes, "lattice={kind=\"hexagonal\",spacing=1.0}"],
        &[&loose, &becomes, soft, wide, long],
        &[&rigid, &ceases],
        &[&rigid, &ceases, "lattice={kind=\"hexagonal\",spacing=1.0}"],
    ] {
        let sets = [&[grid, second], sets].concat();
        assert_scene_parted_the_same(&plate(PLATE, &sets), &format!("{sets:?}"), 25);
    }
}

#[test]
fn keys_that_change_on_the_way_are_refused_in_parts_as_they_are_as_a_whole() {
    let nowhere = "loads=[{kind=\"force\",region={kind=\"box\",min=[90,0],max=[95,9]},force=[1,0]}]";
    let loaded = "loads=[{kind=\"body\",force=[0.1,-0.7]}]";
    for (what, sets) in [
        ("no particle of the body lies", &[&actions(&[&set(9, &[nowhere])])[..]][..]),
        ("no leader holds", &[&actions(&[&set(9, &[loaded])]), "roles=[]"]),
    ] {
        assert_refused_the_same(&plate(PLATE, &[&["record.probes=[]"], sets].concat()), what);
    }
    // Some particles of a disc are at the corner of no cell.
    let rigid = actions(&[&set(9, &["rule.mean={kind=\"material\"}"])]);
    let loose = "body={outline=\"lattice\",shape={kind=\"disc\",centre=[10.0,5.0],radius=9.0}}";
    let barycentre = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}", loose];
    let sets = [&barycentre[..], &[&rigid, "record.probes=[]"]].concat();
    assert_refused_the_same(&plate(PLATE, &sets), "other particles or neighbours");
    // Another outline.
    let loose = "body={shape={kind=\"disc\",centre=[10.0,5.0],radius=9.0}}";
    let sets = [&barycentre[..2], &[&rigid, loose]].concat();
    assert_eq!(laid_out_whole_for(&plate(PLATE, &sets)).as_deref(), Some("actions"));
}

#[test]
fn weights_that_are_solved_for_and_second_gradients_in_parts_have_the_bits_of_those_of_a_whole() {
    let solved = ["rule.weights={kind=\"solved\"}", "neighbours={kind=\"second\"}"];
    let gradient = [
        "rule.weights={kind=\"gradient\",length=1.5}",
        "neighbours={kind=\"collinear\"}",
        "update.damping=0.6",
    ];
    let fine = "body.shape={kind=\"grid\",columns=60,rows=14}";
    let small = ["record.probes=[1,30,60,61,100]", "stop.steps=60", "frame=\"none\""];
    for more in [&solved[..], &gradient[..]] {
        assert_parted_the_same("tension", &[&small[..], more].concat(), 25);
        assert_parted_the_same("tension", &[&small[..], more, &[fine]].concat(), 25);
    }
    // Those along a disc extrapolate, so that the update is damped.
    let disc = "body.shape={kind=\"disc\",radius=9.0}";
    let hexagonal =
        ["lattice={kind=\"hexagonal\",spacing=1.0}", "neighbours={kind=\"first\"}", disc, "record.probes=[]"];
    let roles = "roles=[{region={kind=\"edge\",side=\"left\",depth=0.6},role=\"clamped\"},\
                 {region={kind=\"edge\",side=\"right\",depth=0.6},role=\"leader\",motion={kind=\"velocity\",per_step=[0.02,0.01]}}]";
    let extrapolating = [&small[1..], &solved[..1], &hexagonal, &[roles]].concat();
    let damping = planned(&load("tension", &extrapolating)).setup.update.damping;
    assert!((0.8..0.9).contains(&damping), "{damping}");
    assert_parted_the_same("tension", &extrapolating, 25);
    let apart = "body={shape={kind=\"rectangle\",max=[40,9]},holes=[{kind=\"rectangle\",min=[19.5,-1],max=[20.5,10]}]}";
    let scene = load("tension", &[&["record.probes=[]", "frame=\"none\"", apart], &gradient[..]].concat());
    assert_refused_the_same(&scene, "are not connected");
}
