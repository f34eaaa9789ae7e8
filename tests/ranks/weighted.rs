//! Equilibria of weights that are solved for, and of second gradients, of a body in parts.

use super::parts::assert_scene_parted_the_same;
use super::scenes::load;

const SOLVED: [&str; 2] = ["rule.weights={kind=\"solved\"}", "neighbours={kind=\"second\"}"];
const GRADIENT: [&str; 2] =
    ["rule.weights={kind=\"gradient\",length=1.5}", "neighbours={kind=\"collinear\"}"];

const PULLED: &str = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"},\
     {region={kind=\"edge\",side=\"right\"},role=\"leader\",motion={kind=\"velocity\",per_step=[0.02,0.01]}}]";

fn assert_at_rest_the_same(solver: &str, sets: &[&str]) {
    let asked = format!("equilibrium={{solver=\"{solver}\",tolerance=1e-7}}");
    let always = [&asked[..], "record.probes=[]", "update.damping=0.6", PULLED];
    let sets = [&always[..], sets].concat();
    assert_scene_parted_the_same(&load("tension", &sets), &format!("{sets:?}"), 60);
}

#[test]
fn equilibria_of_weights_that_are_found_from_places_have_the_same_bits_in_parts() {
    let fine = "body.shape={kind=\"grid\",columns=60,rows=14}";
    for more in [&["frame=\"none\""][..], &["frame=\"none\"", fine]] {
        assert_at_rest_the_same("auto", &[&SOLVED[..], more].concat());
        assert_at_rest_the_same("auto", &[&GRADIENT[..], more].concat());
        assert_at_rest_the_same("multigrid", &[&GRADIENT[..], more].concat());
    }
    for solver in ["direct", "gauss-seidel"] {
        assert_at_rest_the_same(solver, &[&SOLVED[..], &["frame=\"none\""]].concat());
        assert_at_rest_the_same(solver, &[&GRADIENT[..], &["frame=\"none\""]].concat());
    }
    for solver in ["conjugate-gradients", "chebyshev"] {
        assert_at_rest_the_same(solver, &[&GRADIENT[..], &["frame=\"none\""]].concat());
    }
    let framed = [&SOLVED[..], &["frame=\"lagged\""]].concat();
    assert_at_rest_the_same("auto", &framed);
}

/// Large enough for several ranks to share two levels.
#[test]
fn a_large_equilibrium_of_a_second_gradient_too() {
    let large = ["frame=\"none\"", "body.shape={kind=\"grid\",columns=500,rows=120}"];
    assert_at_rest_the_same("multigrid", &[&GRADIENT[..], &large].concat());
}
