//! Bodies that cells on a lattice get wrong where nothing is done about it: what a comparison says of each, against the
//! figure that it has to have.

use flockform::study::compare::places::PlaceComparison;

use crate::support::*;

/// A lattice with cells of about this size \[length\], turned by an angle \[degree\].
fn lattice(kind: &str, h: f64, orientation: f64) -> String {
    let sizes = match kind {
        "centred-rectangular" => format!("a = {h}, b = {h}"),
        "rectangular" => format!("a = {h}, b = {}", 0.8 * h),
        "oblique" => format!("a = {h}, b = {h}, angle = 70.0"),
        "honeycomb" => format!("spacing = {}", h / 3f64.sqrt()),
        _ => format!("spacing = {h}"),
    };
    format!("lattice={{ kind = \"{kind}\", {sizes}, orientation = {orientation:?} }}")
}

/// The comparison at the first place of a bundled scene with changes, and the error of the displacements.
fn at_first_place(name: &str, overrides: &[&str]) -> (PlaceComparison, f64) {
    let found = compared(name, overrides);
    let (at, error) = (found.places[0], found.comparison.displacement_rel_l2);
    println!("{name} {overrides:?}: {:.3} %\n{at}", 100.0 * error);
    (at, error)
}

#[test]
fn a_uniform_traction_is_the_stress_in_the_middle_of_a_bar_on_any_lattice() {
    for (kind, orientation) in [
        ("hexagonal", 0.0),
        ("centred-rectangular", 0.0),
        ("oblique", 0.0),
        ("honeycomb", 0.0),
        ("square", 30.0),
        ("honeycomb", 90.0),
    ] {
        let (at, error) = at_first_place("bar", &[&lattice(kind, 1.7, orientation)]);
        for found in [at.rule, at.truth] {
            let off = [found.stress[0] / 10.0 - 1.0, found.stress[1] / 10.0, found.stress[2] / 10.0];
            assert!(off.iter().all(|part| part.abs() < 1e-7), "{kind} at {orientation}: {found:?}");
        }
        assert!(error < 1e-8, "{kind} at {orientation}: {error}");
    }
}

#[test]
fn a_slanted_bar_on_the_square_lattice_has_the_stress_of_its_traction() {
    // 3 : 4 : 5, so that corners and traction are short numbers; without contraction the clamp does not disturb.
    let (at, error) = at_first_place(
        "bar",
        &[
            &lattice("square", 1.0, 0.0),
            "body.shape={ kind = \"polygon\", vertices = [[0.0, 0.0], [16.0, 12.0], [13.0, 16.0], [-3.0, 4.0]] }",
            "material.poisson=0.0",
            "roles=[{ region = { kind = \"outline\", pieces = [4] }, role = \"clamped\" }]",
            "loads=[{ kind = \"traction\", region = { kind = \"outline\", pieces = [2] }, traction = [8.0, 6.0] }]",
            "record.places=[[6.5, 8.0]]",
        ],
    );
    for found in [at.rule, at.truth] {
        assert!((found.von_mises / 10.0 - 1.0).abs() < 1e-7, "{found:?}");
        let along = [6.4, 3.6, 4.8];
        assert!((0..3).all(|k| (found.stress[k] - along[k]).abs() < 1e-6), "{found:?}");
    }
    assert!(error < 1e-8, "{error}");
}

#[test]
fn cook_s_membrane_rises_by_the_published_figure_with_order_two() {
    for kind in ["square", "hexagonal", "oblique", "honeycomb"] {
        let sizes = [4.0, 2.0, 1.0, 0.5];
        let found = sizes.map(|h| at_first_place("cook", &[&lattice(kind, h, 0.0)]));
        let off = found.map(|(at, _)| at.rule.displacement[1] / 23.965 - 1.0);
        println!("{kind}: {off:.5?}");
        assert!(off[2].abs() < 0.003 && off[3].abs() < 0.001, "{kind}: {off:?}");
        for (at, _) in &found {
            assert!((at.truth.displacement[1] / 23.965 - 1.0).abs() < 3e-4, "{at}");
        }
        // The upper corner of the clamp is singular: what it leaves falls more slowly than the square.
        let (order, everywhere) = ((off[0] / off[3]).log2() / 3.0, (found[0].1 / found[3].1).log2() / 3.0);
        println!("{kind}: order {order:.2}, of the L2 norm {everywhere:.2}");
        assert!(order > 1.7 && order < 2.3 && everywhere > 1.5, "{kind}: {order} {everywhere}");
    }
}

#[test]
fn the_crown_of_a_hole_comes_to_its_published_stress() {
    for kind in ["square", "hexagonal", "oblique", "honeycomb"] {
        let found = [1.0, 0.5, 0.25].map(|h| at_first_place("plate-hole", &[&lattice(kind, h, 0.0)]).0);
        let off = found.map(|at| at.rule.stress[0] / 3.36 - 1.0);
        println!("{kind}: {off:.4?}");
        assert!(off[1].abs() < 0.03 && off[2].abs() < 0.02, "{kind}: {off:?}");
        assert!((found[0].truth.stress[0] / 3.36 - 1.0).abs() < 0.01, "{}", found[0]);
    }
}

const CANTILEVER: [&str; 2] = [
    "roles=[{ region = { kind = \"edge\", side = \"left\" }, role = \"clamped\" }]",
    "loads=[{ kind = \"traction\", region = { kind = \"edge\", side = \"right\" }, traction = [0.0, 1.0] }]",
];

#[test]
fn a_rectangle_that_is_no_multiple_of_the_spacing_bends_with_its_own_height() {
    // E. Reissner and S. Timoshenko: bending and shear of a beam 10 long and 1.9 high under a force of 1.9.
    let (inertia, shear) = (1.9f64.powi(3) / 12.0, 1000.0 / 2.6);
    let beam = 1.9 * 1000.0 / (3.0 * 1000.0 * inertia) + 1.2 * 1.9 * 10.0 / (shear * 1.9);
    let body = ["body.shape.max=[10.0, 1.9]", "record.places=[[10.0, 0.95]]"];
    for (h, bound) in [(0.5, 0.03), (0.25, 0.01)] {
        let (at, error) = at_first_place(
            "bar",
            &[&[&*lattice("square", h, 0.0)], body.as_slice(), CANTILEVER.as_slice()].concat(),
        );
        let off = [at.rule, at.truth].map(|at| at.displacement[1] / beam - 1.0);
        println!("{h}: {off:.4?} of the beam's");
        // A clamp that allows no contraction is not the beam's; heights of 1.5 or 2 would be off by 103 or -14 %.
        assert!(off[0].abs() < bound + 0.005 && off[1].abs() < 0.005, "{h}: {off:?}");
        assert!(error < bound, "{h}: {error}");
    }
}

fn slice(poisson: f64) -> String {
    format!("material={{ kind = \"isotropic\", young = 1000.0, poisson = {poisson:?}, plane = \"strain\" }}")
}

#[test]
fn plane_strain_near_incompressibility_costs_a_smooth_body_no_accuracy() {
    for kind in ["square", "rectangular", "hexagonal", "centred-rectangular", "oblique", "honeycomb"] {
        for orientation in [0.0, 15.0] {
            let error =
                |poisson: f64| at_first_place("ring", &[&lattice(kind, 1.0, orientation), &slice(poisson)]).1;
            let errors = [0.3, 0.4999].map(error);
            println!("{kind} at {orientation}: {errors:.5?}, {:.2} times", errors[1] / errors[0]);
            assert!(errors[1] < 1.6 * errors[0], "{kind} at {orientation}: {errors:?}");
        }
    }
}

/// In the upper corner of the clamp, 108 degrees wide, displacements go like r^k, with 4 (3 - 4 nu) sin^2(k w) =
/// (4 - 4 nu)^2 - 4 k^2 sin^2(w) (M. L. Williams, J. Appl. Mech. 19, 1952): what that leaves everywhere falls like h^2k.
fn order_of_the_clamp(poisson: f64) -> f64 {
    let (w, kappa) = (std::f64::consts::FRAC_PI_2 + (16.0f64 / 48.0).atan(), 3.0 - 4.0 * poisson);
    let off =
        |k: f64| 4.0 * kappa * (k * w).sin().powi(2) - (kappa + 1.0).powi(2) + 4.0 * (k * w.sin()).powi(2);
    let (mut low, mut high) = (0.4, 0.8);
    assert!(off(low) < 0.0 && off(high) > 0.0);
    for _ in 0..50 {
        let k = 0.5 * (low + high);
        if off(k) < 0.0 { low = k } else { high = k }
    }
    2.0 * low
}

#[test]
fn near_incompressibility_the_error_of_cook_s_membrane_is_that_of_its_clamp() {
    for (poisson, expected) in [(0.3, 1.29), (0.4999, 1.09)] {
        let least = order_of_the_clamp(poisson);
        assert!((least - expected).abs() < 0.005, "{least}");
        let errors = [1.0, 0.5, 0.25]
            .map(|h| at_first_place("cook", &[&lattice("square", h, 0.0), &slice(poisson)]).1);
        let orders = [0, 1].map(|k| (errors[k] / errors[k + 1]).log2());
        println!("nu = {poisson}: orders {orders:.3?} fall to {least:.3}");
        assert!(orders[1] < orders[0] && orders[1] > least && orders[1] < least + 0.25, "{orders:?} {least}");
    }
}

#[test]
fn plane_strain_near_incompressibility_does_not_lock_cook_s_membrane() {
    for kind in ["square", "hexagonal", "oblique", "honeycomb"] {
        let errors = [0.3, 0.49, 0.4999]
            .map(|poisson| at_first_place("cook", &[&lattice(kind, 1.0, 0.0), &slice(poisson)]).1);
        println!("{kind}: {errors:.5?}");
        // Triangles that lock are off by tens of percent there.
        assert!(
            errors.iter().all(|error| *error < 0.015) && errors[2] < 1.3 * errors[1],
            "{kind}: {errors:?}"
        );
    }
}

#[test]
fn the_elastica_is_held_against_a_truth_that_turns() {
    // K. E. Bisshopp and D. C. Drucker, 1945; digits of K. Mattiasson, 1981. Twenty times as long as high is not thin: the
    // truth itself is up to half a percent off.
    for (a, w, u) in [(1.0, 0.30172, 0.05643), (5.0, 0.71379, 0.38763), (10.0, 0.81061, 0.55500)] {
        let load = format!("loads[0].traction=[0.0, {:?}]", a * 1000.0 / 12.0 / 400.0);
        let (at, error) = at_first_place("elastica", &[&load, "lattice.spacing=0.0625"]);
        for (who, found) in [("truth", at.truth), ("rule", at.rule)] {
            let off = [found.displacement[1] / 20.0 / w - 1.0, -found.displacement[0] / 20.0 / u - 1.0];
            println!("a = {a}, {who}: {off:.5?}");
            assert!(off.iter().all(|part| part.abs() < 0.005), "a = {a}, {who}: {off:?}");
        }
        assert!(error < 0.003, "a = {a}: {error}");
    }
}

#[test]
fn a_rule_of_small_rotations_is_far_from_the_elastica() {
    let small = ["rule.mean={ kind = \"material\", rotation = \"small\" }"];
    let (at, error) = at_first_place("elastica", &small);
    // P L^3 / (3 E I) of the linear beam, by rule and truth.
    for found in [at.rule, at.truth] {
        assert!((found.displacement[1] / 20.0 / (10.0 / 3.0) - 1.0).abs() < 0.01, "{at}");
    }
    assert!(error < 0.01);
}

#[test]
fn the_bundled_hexagonal_beam_is_the_paper_s() {
    let found = compared("beam-hexagonal", &["record.places=[[21.0, 21.0]]"]);
    let (at, measures) = (found.places[0], found.comparison);
    println!("{measures}{at}");
    assert!(measures.displacement_rel_l2 < 0.005 && measures.von_mises_rel_l2 < 0.09, "{measures}");
    // The upper corner of the end, from biquadratic elements on another mesh.
    let moved = at.truth.displacement;
    assert!((moved[0] + 1.8864).abs() < 0.02 && (moved[1] - 4.08).abs() < 0.02, "{at}");
}

#[test]
fn the_crown_of_a_hole_in_an_orthotropic_plate_is_recovered_too() {
    let material =
        "material={ kind = \"orthotropic\", young = [2000.0, 1000.0], poisson_12 = 0.3, shear = 400.0 }";
    // S. G. Lekhnitskii, Anisotropic Plates (1968), section 42: in an infinite plate, pulled along its stiffer fibres.
    let infinite = 1.0 + (2.0 * (2f64.sqrt() - 0.3) + 5.0).sqrt();
    let small = "body.shape={ kind = \"path\", from = [1.0, 0.0], steps = [{ to = [20.0, 0.0] }, { to = [20.0, 20.0] }, \
                 { to = [0.0, 20.0] }, { to = [0.0, 1.0] }, { to = [1.0, 0.0], centre = [0.0, 0.0], clockwise = true }] }";
    let (at, _) = at_first_place("plate-hole", &[material, small, "record.places=[[0.0, 1.0]]"]);
    assert!((at.truth.stress[0] / infinite - 1.0).abs() < 0.015, "{at} {infinite}");
    for kind in ["square", "hexagonal", "oblique", "honeycomb"] {
        let found = [0.5, 0.25].map(|h| at_first_place("plate-hole", &[material, &lattice(kind, h, 20.0)]).0);
        let off = found.map(|at| at.rule.stress[0] / at.truth.stress[0] - 1.0);
        println!("{kind}: {off:.4?}");
        assert!(off[0].abs() < 0.05 && off[1].abs() < 0.03, "{kind}: {off:?}");
    }
}

#[test]
fn the_edge_of_a_strip_bent_far_carries_the_stress_of_its_bending() {
    for (kind, h) in [("square", 0.125), ("hexagonal", 0.125), ("honeycomb", 0.125)] {
        let found = compared(
            "elastica",
            &[&lattice(kind, h, 0.0), "record.places=[[10.0, 1.0], [10.0, 0.0], [20.0, 0.5]]"],
        );
        for at in &found.places[..2] {
            let (rule, truth) = (at.rule.stress, at.truth.stress);
            println!("{kind}: {:.4} {at}", rule[0] / truth[0] - 1.0);
            // The mean of the cells around a particle there is half a cell off: 12 %.
            assert!((rule[0] / truth[0] - 1.0).abs() < 0.03, "{kind}: {at}");
            // Nothing acts on the edge.
            assert!(rule[1].abs().max(rule[2].abs()) < 0.01 * rule[0].abs(), "{kind}: {at}");
        }
        // The end's load times its arm, 6 M / H^2 with either sign, and what pulls along.
        let tip = found.rule.iter().zip(found.outcome.engine.body().reference.iter());
        let end: Vec<f64> = tip.filter(|(_, p)| p[0] > 20.0 - 1e-9).map(|(u, p)| p[0] + u[0]).collect();
        let end = end.iter().sum::<f64>() / end.len() as f64;
        let middle = 0.5 * (found.places[0].rule.displacement[0] + found.places[1].rule.displacement[0]);
        let bending = 6.0 * 2.0833333333333335 * (end - 10.0 - middle);
        let half = 0.5 * (found.places[1].rule.stress[0] - found.places[0].rule.stress[0]);
        println!("{kind}: {half} of {bending}");
        assert!((half / bending - 1.0).abs() < 0.03, "{kind}: {half} {bending}");
        // The load keeps its direction while the end turns by some 80 degrees: in axes that turn with it, it pulls along.
        let [rule, truth] = [found.places[2].rule.stress, found.places[2].truth.stress];
        println!("{kind}: {}", found.places[2]);
        assert!(truth[0] > 1.9 && (0..3).all(|k| (rule[k] - truth[k]).abs() < 0.05), "{}", found.places[2]);
    }
}

#[test]
fn the_paper_s_beam_that_turns_is_held_against_a_truth_that_turns() {
    let found = compared("beam", &["rule.mean={ kind = \"material\", rotation = \"corotated\" }"]);
    println!("{}", found.comparison);
    println!("{:?} {:?}", found.reference.solution.levels(), found.reference.solution.error());
    assert!(found.comparison.displacement_rel_l2 < 0.005, "{}", found.comparison);
}
