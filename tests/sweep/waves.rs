//! How a body reacts and relaxes, held against what its lattice and its operator say.

use std::ops::ControlFlow;

use flockform::continuum::plan::Plan;
use flockform::continuum::run::{StopReason, run};
use flockform::engine::Engine;
use flockform::flock::role::Role;
use flockform::flock::rules::{Feedback, FeedbackReference, Rule};
use flockform::solve::spectrum::{LinearSweep, SpectralRadius};

use crate::scenes::{load, planned};

fn plan(name: &str, overrides: &[&str]) -> Plan {
    planned(&load(name, overrides))
}

/// Hops from each particle to the nearest leader, along neighbour relations; `None` where no chain
/// of followers leads there.
fn hops_from_leaders(plan: &Plan) -> Vec<Option<usize>> {
    let mut hops: Vec<Option<usize>> =
        plan.setup.roles.iter().map(|&role| (role == Role::Leader).then_some(0)).collect();
    for distance in 1..=plan.count() {
        let reached: Vec<usize> = (0..plan.count())
            .filter(|&i| plan.setup.roles[i] == Role::Follower && hops[i].is_none())
            .filter(|&i| {
                let neighbours = plan.setup.flock.neighbours.of(i);
                neighbours.iter().any(|&k| hops[k as usize] == Some(distance - 1))
            })
            .collect();
        if reached.is_empty() {
            break;
        }
        reached.into_iter().for_each(|i| hops[i] = Some(distance));
    }
    hops
}

#[test]
fn a_particle_first_moves_at_the_step_after_its_hop_distance_on_every_lattice() {
    let lattices = ["square", "rectangular", "centred-rectangular", "hexagonal", "oblique", "honeycomb"];
    for lattice in lattices {
        // One leader moves in a direction that no lattice vector has; the others would move too.
        let name = format!("lattice-{lattice}");
        let overrides = [
            r#"roles=[{region={kind="edge",side="left"},role="leader",motion={kind="velocity",per_step=[0.37,0.11]}}]"#,
            "stop.steps=14",
        ];
        let plan = plan(&name, &overrides);
        let hops = hops_from_leaders(&plan);
        assert!(hops.iter().flatten().max() > Some(&8), "{name} is deep enough to tell");
        let mut first_moves = vec![None; plan.count()];
        run(plan, &mut |engine: &Engine, _| {
            for (i, first) in first_moves.iter_mut().enumerate() {
                if first.is_none() && engine.present().get(i) != engine.body().reference.get(i) {
                    *first = Some(engine.step());
                }
            }
            ControlFlow::Continue(())
        });
        for (i, (first, hops)) in first_moves.iter().zip(&hops).enumerate() {
            // Leaders, at distance 0, move at step 1.
            let expected = hops.map(|hops| hops + 1).filter(|&step| step <= 14);
            assert_eq!(*first, expected, "{name}, particle {}", i + 1);
        }
    }
}

/// The tension sample after its release: the former leaders follow.
fn released(overrides: &[&str]) -> (Plan, Vec<Role>) {
    let plan = plan("tension", overrides);
    let roles = plan
        .setup
        .roles
        .iter()
        .map(|&role| if role == Role::Leader { Role::Follower } else { role })
        .collect();
    (plan, roles)
}

fn radius_of(plan: &Plan, roles: &[Role]) -> SpectralRadius {
    let frame = plan.setup.body.frame.as_ref();
    LinearSweep::new(&plan.setup.flock, frame, roles, plan.setup.update, 200_000).expect("linear").radius()
}

#[test]
fn the_released_body_relaxes_at_the_spectral_radius_of_its_sweep() {
    for frame in ["frame=lagged", "frame=immediate", "frame=mirror"] {
        let (plan, roles) = released(&[frame, "stop.steps=1200"]);
        let spectrum = radius_of(&plan, &roles);
        assert!(spectrum.converged && spectrum.radius < 1.0, "{frame}: {spectrum:?}");
        let mut sizes = Vec::new();
        run(plan, &mut |engine, _| {
            let reference = &engine.body().reference;
            sizes.push(
                (0..reference.len())
                    .map(|i| (engine.present().x[i] - reference.x[i]).powi(2))
                    .sum::<f64>()
                    .sqrt(),
            );
            ControlFlow::Continue(())
        });
        // What is left of 1 is the rate; 1 % of that, over a stretch where one mode is left.
        let observed = (sizes[1000] / sizes[700]).powf(1.0 / 300.0);
        let error = ((1.0 - observed) / (1.0 - spectrum.radius) - 1.0).abs();
        assert!(error < 0.01, "{frame}: observed {observed}, spectrum {}", spectrum.radius);
    }
}

#[test]
fn a_square_led_all_around_relaxes_at_the_cosine_of_its_size() {
    let overrides = [
        r#"roles=[{region={kind="boundary"},role="clamped"}]"#,
        "body.shape={kind=\"grid\",columns=14,rows=14}",
    ];
    let plan = plan("lattice-square", &overrides);
    let roles = plan.setup.roles.clone();
    // 12 x 12 followers.
    let expected = (std::f64::consts::PI / 13.0).cos();
    assert!((radius_of(&plan, &roles).radius - expected).abs() < 1e-6);
}

/// Whether the released body's displacement grows with feedback `factor`.
fn grows(frame: &str, factor: f64) -> bool {
    let feedback = format!("rule.feedback={{factor={factor},reference=\"initial\"}}");
    let overrides = [frame, &feedback, "stop.steps=4000"];
    let mut sizes = Vec::new();
    let outcome = run(plan("tension", &overrides), &mut |engine, _| {
        let reference = &engine.body().reference;
        sizes.push((0..reference.len()).map(|i| (engine.present().x[i] - reference.x[i]).abs()).sum::<f64>());
        ControlFlow::Continue(())
    });
    matches!(outcome.reason, StopReason::Diverged(_)) || sizes[sizes.len() - 1] > sizes[sizes.len() - 401]
}

/// The feedback factor between `low` and `high` at which the sweep's spectral radius passes 1.
fn threshold(frame: &str, mut low: f64, mut high: f64) -> f64 {
    let (mut plan, roles) = released(&[frame]);
    for _ in 0..20 {
        let factor = (low + high) / 2.0;
        plan.setup.flock.rule.feedback = Some(Feedback { factor, reference: FeedbackReference::Initial });
        *if radius_of(&plan, &roles).radius < 1.0 { &mut low } else { &mut high } = factor;
    }
    (low + high) / 2.0
}

#[test]
fn feedback_grows_exactly_past_the_threshold_that_the_spectrum_gives() {
    for frame in ["frame=lagged", "frame=immediate"] {
        let upper = threshold(frame, 0.0, 0.05);
        assert!(
            !grows(frame, upper - 1e-4) && grows(frame, upper + 1e-4),
            "{frame}: the runs disagree with {upper}"
        );
        // On the other side 1 + fd passes -1 / rho; a frame that lags moves that threshold.
        let lower = threshold(frame, -1.9, -3.0);
        assert!(lower < -2.0, "{frame}: {lower}");
        assert!(
            !grows(frame, lower + 1e-4) && grows(frame, lower - 1e-4),
            "{frame}: the runs disagree with {lower}"
        );
    }
}

#[test]
fn the_feedback_threshold_is_that_of_a_clamped_chain_with_a_free_end() {
    // The slowest mode is uniform along the columns: m of them between a clamp and a free end relax
    // by (1 + cos(pi / (2m + 1))) / 2 a step. The sample has 9 that follow once it is released.
    let expected = 2.0 / (1.0 + (std::f64::consts::PI / 19.0).cos()) - 1.0;
    for frame in ["frame=lagged", "frame=immediate"] {
        let found = threshold(frame, 0.0, 0.05);
        assert!((found - expected).abs() < 1e-6, "{frame}: {found}, not {expected}");
    }
}

#[test]
fn the_spectrum_of_the_sweep_with_feedback_is_that_without_scaled() {
    let (mut plan, roles) = released(&["frame=none", "record.probes=[]"]);
    let bare = radius_of(&plan, &roles).radius;
    plan.setup.flock.rule = Rule {
        feedback: Some(Feedback { factor: -0.4, reference: FeedbackReference::Initial }),
        ..Rule::BARYCENTRE
    };
    assert!((radius_of(&plan, &roles).radius - 0.6 * bare).abs() < 1e-6);
}
