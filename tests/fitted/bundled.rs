//! Figures that the notes of bundled scenes quote: each is in the notes, is that of its formula, and is what the scene gives.

use flockform::continuum::mechanics::{Mechanics, Stresses};
use flockform::continuum::plan::Plan;
use flockform::continuum::run::Outcome;
use flockform::flock::vectors::distance;
use flockform::scene::Scene;

use crate::scenes::load;
use crate::support::solved;

struct Run {
    scene: Scene,
    plan: Plan,
    outcome: Outcome,
}

impl Run {
    fn of(name: &str, overrides: &[&str]) -> Self {
        let scene = load(name, overrides);
        let (plan, outcome) = solved(&scene);
        Self { scene, plan, outcome }
    }

    fn quotes(&self, figure: &str) {
        assert!(self.scene.raw.notes.contains(figure), "{figure} is not in {}", self.scene.raw.notes);
    }

    fn particle(&self, place: [f64; 2]) -> usize {
        let reference = &self.plan.setup.body.reference;
        let apart = |i: &usize| distance(reference.get(*i), place);
        (0..self.plan.count()).min_by(|a, b| apart(a).total_cmp(&apart(b))).expect("has particles")
    }

    fn mechanics(&self) -> Mechanics {
        Mechanics::of(&self.outcome.engine).expect("has cells")
    }
}

fn is_within(part: f64, found: f64, expected: f64) {
    println!("{found} of {expected}: {:+.3} %", 100.0 * (found / expected - 1.0));
    assert!((found / expected - 1.0).abs() < part, "{found}, not {expected}");
}

#[test]
fn the_ring_widens_as_its_notes_say() {
    let run = Run::of("ring", &[]);
    let (young, nu, a, b, p) = (1000.0, 0.3, 4.0f64, 10.0f64, 10.0);
    for (r, figure) in [(a, "0.0658667"), (b, "0.0346667")] {
        let u = (1.0 + nu) * p * a * a / (young * (b * b - a * a)) * ((1.0 - 2.0 * nu) * r + b * b / r);
        assert_eq!(format!("{u:.7}"), figure);
        run.quotes(figure);
        is_within(0.01, run.outcome.engine.displacement(run.particle([r, 0.0]))[0], u);
    }
}

#[test]
fn the_rubber_block_pushes_back_as_its_notes_say() {
    let run = Run::of("rubber-block", &[]);
    let shape: f64 = 20.0 / (2.0 * 5.0);
    let modulus = 4.0 / 3.0 * (1.0 + shape * shape);
    let reaction = modulus * 0.01 / 5.0 * 10.0;
    assert_eq!([format!("{modulus:.2}"), format!("{reaction:.3}")], ["6.67", "0.133"]);
    run.quotes("6.67 E");
    run.quotes("0.133");
    let led = run.mechanics().reactions.into_iter().find(|one| one.role == "leader").expect("is led");
    is_within(0.05, -led.force[1], reaction);
}

#[test]
fn the_inclusion_carries_the_stress_that_its_notes_say() {
    let run = Run::of("inclusion", &[]);
    let stresses = Stresses::at_present(&run.outcome.engine).expect("has cells");
    let found = stresses.particles[run.particle([1.5, 1.5])].expect("in cells").components;
    for figure in ["1.370", "0.019"] {
        run.quotes(figure);
    }
    // The plate is ten radii wide.
    is_within(0.03, found[0], 1.370);
    assert!((found[1] - 0.019).abs() < 0.03 && found[2].abs() < 0.02, "{found:?}");
}

#[test]
fn the_peak_of_the_bracket_grows_as_its_notes_say() {
    Run::of("l-bracket", &["lattice.spacing=4.0"]).quotes("r^-0.4555");
    // M. L. Williams: sin(3 pi / 2 k) = k at the free corner, the stress grows like r^(k - 1).
    let (mut low, mut high) = (0.4, 0.7);
    for _ in 0..60 {
        let k: f64 = 0.5 * (low + high);
        if (1.5 * std::f64::consts::PI * k).sin() > k { low = k } else { high = k }
    }
    assert_eq!(format!("{:.4}", low - 1.0), "-0.4555");
    let peaks = [4.0, 2.0, 1.0].map(|h| {
        let run = Run::of("l-bracket", &[&format!("lattice.spacing={h:?}")]);
        let peak = run.mechanics().largest_von_mises.expect("is stressed");
        assert!(distance(peak.place, [40.0, 40.0]) < 2.0 * h, "{peak:?}");
        peak.von_mises
    });
    println!("{peaks:?}");
    for pair in peaks.windows(2) {
        is_within(0.1, pair[1] / pair[0], 2f64.powf(0.4555));
    }
}
