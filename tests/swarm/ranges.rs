//! Robots that measure each other: who lies is found, and nobody else is.

use flockform::flock::vectors::distance;
use flockform::swarm::flight::Flight;
use flockform::swarm::watch::Health;

use crate::swarms::load_swarm;

const MIDDLE: usize = 12;
const RANGES: &str = "ranges={ reach = 3.5, noise = 0.02, tolerance = 0.25 }";

/// The bundled square, with one sweep a period.
fn square(more: &[&str]) -> Flight {
    let overrides = [&["control.sweeps=1", "flight.duration=20.0"], more].concat();
    Flight::new(&load_swarm("square", &overrides)).unwrap_or_else(|error| panic!("{error}"))
}

fn contradicted(flight: &Flight) -> Vec<u64> {
    (0..25).map(|m| flight.control().watch().counts(m).contradicted).collect()
}

/// Flies to the end; the nearest that the middle truly came to any other, hull to hull \[m\].
fn fly(flight: &mut Flight) -> f64 {
    let mut nearest = f64::INFINITY;
    for _ in 0..flight.periods() {
        flight.step();
        let places = flight.fleet().places();
        let others = (0..25).filter(|&m| m != MIDDLE);
        let gaps = others.map(|m| distance(places.get(m), places.get(MIDDLE)) - 0.4);
        nearest = gaps.fold(nearest, f64::min);
    }
    nearest
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
        let mut flight =
            square(&[&rough[..], &[RANGES, &seed, "ranges.max_faulty=0", "ranges.tolerance=0.3"]].concat());
        fly(&mut flight);
        assert_eq!(contradicted(&flight), [0; 25], "{seed}");
    }
}

#[test]
fn ranges_among_honest_robots_change_no_bit_of_their_flight() {
    let (mut without, mut with) = (square(&[]), square(&[RANGES]));
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
