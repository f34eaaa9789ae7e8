//! What cannot be compared is refused by the key of the scene.

use flockform::study::compare::run::plan;

use crate::scenes::load;
use crate::support::compare_scene;

fn refused(name: &str, overrides: &[&str], words: &[&str]) {
    let outcome = compare_scene(&load(name, overrides));
    let said = outcome.err().unwrap_or_else(|| panic!("{name} {overrides:?} is compared")).to_string();
    for word in words {
        assert!(said.contains(word), "{name} {overrides:?} does not say `{word}`:\n{said}");
    }
}

#[test]
fn scenes_without_a_material_or_without_one_state_of_rest_are_refused() {
    let isotropic = "material={ kind = \"isotropic\", young = 1.0, poisson = 0.3 }";
    refused("shear", &[], &["material", "the scene has none", "add [material]"]);
    refused("tension", &[isotropic], &["roles[2].from", "comes later"]);
    refused("fracture", &[isotropic], &["fracture", "bonds that break have no part in it"]);
    let cut = "cuts=[{ from = [5.5, 4.0], to = [5.5, 6.0] }]";
    refused("shear", &[isotropic, cut], &["cuts", "a whole body"]);
    let damped = "actions=[{at=2,what={kind=\"set\",keys=[\"update.damping=0.5\"]}}]";
    refused("shear", &[isotropic, damped], &["actions", "changed on its way"]);
}

#[test]
fn a_schedule_that_ends_with_a_part_of_the_load_is_refused() {
    let of = |parts: &str| format!("load_steps={{ schedule = {parts} }}");
    let asked = ["equilibrium={}", &of("[0.5, 1.0, 0.5]")];
    refused("beam-loaded", &asked, &["load_steps.schedule", "the last part is 0.5", "end with 1"]);
    let whole = compare_scene(&load("beam-loaded", &["equilibrium={}", &of("[0.5, 1.0]")]));
    assert!(whole.is_ok());
}

#[test]
fn a_body_that_the_truth_cannot_hold_is_refused_where_the_roles_stand() {
    let free = "roles=[{ region = { kind = \"edge\", side = \"right\" }, role = \"leader\", motion = { kind = \"reference\" } }]";
    refused(
        "beam-paper",
        &[free],
        &["roles", "is not held and free to translate along x", "clamp at least two"],
    );
}

#[test]
fn four_neighbours_cannot_carry_a_material_and_the_reason_is_given() {
    for neighbours in ["neighbours={ kind = \"first\" }", "neighbours={ kind = \"first\", keep = 3 }"] {
        refused("beam", &[neighbours], &["neighbours", "cannot carry shear coupling"]);
    }
    let reduced = "neighbours={ kind = \"first\", keep = 4 }";
    refused(
        "beam-hexagonal",
        &[reduced, "body.outline=\"lattice\""],
        &["neighbours", "cannot carry shear coupling", "stiffness is cut"],
    );
}

#[test]
fn a_run_plans_leaders_led_by_the_truth() {
    let plan = plan(&load("beam", &[])).unwrap_or_else(|e| panic!("{e}"));
    let led = &plan.setup.changes[1];
    let motion = led.motion.as_ref().expect("led");
    let tip = motion.displacement(1.0, 0, [0.0; 2]);
    // Of the lower right corner, in the reference data.
    assert!((tip[0] - 1.8864).abs() < 0.02 && (tip[1] - 4.08).abs() < 0.02, "{tip:?}");
}
