//! Robots that measure each other: who lies is found, and nobody else is.

use flockform::flock::vectors::distance;
use flockform::swarm::flight::Flight;
use flockform::swarm::watch::Health;

use crate::swarms::load_swarm;

const MIDDLE: usize = 12;
const RANGES: &str = "ranges={ reach = 3.5, noise = 0.02, tolerance = 0.25 }";

/// The bundled square, with one sweep a period.
fn square(more: &[&str]) -> Flight {
    let overrides = [&["control.sweeps=1"], more].concat();
    Flight::new(&load_swarm("square", &overrides)).unwrap_or_else(|error| panic!("{error}"))
}

fn contradicted(flight: &Flight) -> Vec<u64> {
    (0..25).map(|m| flight.control().watch().counts(m).contradicted).collect()
}

/// Part of a flight that is enough where nobody lies.
const BEGINNING: &str = "flight.duration=20.0";

/// Flies a period; the nearest that any two truly are to each other after it, hull to hull \[m\].
fn step(flight: &mut Flight) -> f64 {
    flight.step();
    let places = flight.fleet().places();
    let pairs = (0..25).flat_map(|a| (0..a).map(move |b| (a, b)));
    let gaps = pairs.map(|(a, b)| distance(places.get(a), places.get(b)) - 0.4);
    gaps.fold(f64::INFINITY, f64::min)
}

/// Flies to the end; the nearest that any two truly came to each other.
fn fly(flight: &mut Flight) -> f64 {
    (0..flight.periods()).map(|_| step(flight)).fold(f64::INFINITY, f64::min)
}

/// The formation leaves its liar behind, out of all others' reach, and comes back past it after a minute.
#[test]
fn a_liar_is_kept_clear_of_to_the_end_of_the_flight() {
    let ranges = RANGES.replace("3.5", "3.0");
    // One that sends its place again and again stays there: a lie within the tolerance, by which the clearance is less.
    for (what, is_found) in
        [("{ kind = \"offset\", by = [1.2, 0.0] }", true), ("{ kind = \"frozen\" }", false)]
    {
        for seed in ["flight.seed=0", "flight.seed=1"] {
            let fault = format!("flight.faults=[{{ robot = \"robot_13\", at = 3.0, what = {what} }}]");
            let mut flight = square(&[&fault, &ranges, seed]);
            let (mut nearest, mut hidden) = (f64::INFINITY, 0.0_f64);
            while flight.fleet().period() < flight.periods() {
                nearest = nearest.min(step(&mut flight));
                let (known, truly) =
                    (flight.control().position(MIDDLE), flight.fleet().robots()[MIDDLE].position);
                hidden = hidden.max(distance(known.expect("it is somewhere"), truly));
            }
            let counts = flight.control().watch().counts(MIDDLE);
            if is_found {
                assert!(nearest > 0.3 - 1e-9, "{what} {seed}: {nearest}");
                assert!(counts.unconfirmed > 100, "out of reach it is not believed: {counts:?}");
            } else {
                assert!(nearest > 0.3 - hidden, "{what} {seed}: {nearest} at {hidden}");
                assert_eq!(counts.rejected(), 0, "{counts:?}");
            }
            assert!(hidden < 0.25, "{what} {seed}: {hidden}");
        }
    }
}

#[test]
fn a_robot_that_says_it_is_elsewhere_runs_into_another_unless_ranges_find_it() {
    for lie in ["[1.2, 0.0]", "[2.0, 0.0]", "[1.0, -1.0]"] {
        let fault = format!(
            "flight.faults=[{{ robot = \"robot_13\", at = 3.0, what = {{ kind = \"offset\", by = {lie} }} }}]"
        );
        let mut blind = square(&[&fault]);
        let struck = fly(&mut blind);
        assert_eq!(blind.control().health(MIDDLE), Health::Fresh, "after a while its speed is possible");
        assert!(struck < 0.0, "{lie}: unfound it runs into another: {struck}");
        for network in [&[][..], &["flight.noise=0.02", "flight.delay=2", "flight.loss=0.2"]] {
            let mut flight = square(&[&[&fault, RANGES][..], network].concat());
            let nearest = fly(&mut flight);
            assert!(nearest > 0.2, "{lie} {network:?}: {nearest}");
            assert!(!flight.control().health(MIDDLE).is_usable());
            let counts = contradicted(&flight);
            assert!(counts[MIDDLE] > 100, "{counts:?}");
            assert_eq!(counts.iter().sum::<u64>(), counts[MIDDLE], "nobody else is contradicted: {counts:?}");
        }
    }
}

#[test]
fn honest_robots_are_never_contradicted_whatever_the_network_does() {
    for seed in 0..20 {
        let seed = format!("flight.seed={seed}");
        let rough = [
            "flight.noise=0.03",
            "flight.delay=3",
            "flight.jitter=3",
            "flight.loss=0.3",
            "flight.duplicates=0.1",
        ];
        let mut flight = square(
            &[&rough[..], &[BEGINNING, RANGES, &seed, "ranges.max_faulty=0", "ranges.tolerance=0.3"]]
                .concat(),
        );
        fly(&mut flight);
        assert_eq!(contradicted(&flight), [0; 25], "{seed}");
    }
}

#[test]
fn ranges_among_honest_robots_change_no_bit_of_their_flight() {
    let (mut without, mut with) = (square(&[BEGINNING]), square(&[BEGINNING, RANGES]));
    fly(&mut without);
    fly(&mut with);
    assert_eq!(without.fleet().places(), with.fleet().places());
}

#[test]
fn ranges_of_robots_that_may_be_anywhere_are_refused() {
    let overrides = ["ranges={ reach = 3.0 }".to_owned(), "limits={}".to_owned()];
    let text = flockform::scene::bundled::bundled_swarm("square").expect("bundled").text;
    let refused = flockform::scene::swarm::Swarm::parse("square", "square.toml", text, &overrides, None);
    let words = refused.map(drop).expect_err("refused").to_string();
    assert!(words.contains("ranges") && words.contains("limits.speed"), "{words}");
}
