//! Robots whose way, or goal, another one is in.

use flockform::flock::vectors::distance;
use flockform::swarm::flight::Flight;

use super::support::*;
use crate::swarms::load_swarm;

/// A robot with these limits, of this model, after it was sent for so long where another, with a fault, stands, or `off` behind that \[m\]:
/// its distance from the other in the end, the least on the way, and how far it went in the last five seconds.
fn sent_to_one_that_stands(fault: &str, (limits, model): (&str, &str), off: f64, seconds: f64) -> [f64; 3] {
    let text = format!(
        "title = \"To one that stands\"
        radius = 0.2
        robots = [{{ name = \"a\", place = [0.0, 0.0] }}, {{ name = \"b\", place = [3.0, 0.0] }}]
        leaders = [{{ robots = [\"a\", \"b\"], program = {{ kind = \"manoeuvre\", name = \"on\" }} }}]
        manoeuvres = [{{ name = \"on\", legs = [{{ seconds = 0.2 }}, {{ seconds = 2.0, translate = [{}, 0.0] }}] }}]
        links = {{ kind = \"nearest\", count = 1 }}
        control.period = 0.05
        flight.model.kind = \"{model}\"
        flight.faults = [{{ robot = \"b\", at = 0.1, what = {{ kind = \"{fault}\" }} }}]
        [limits]
        clearance = 0.1
        {limits}",
        3.0 + off
    );
    let mut flight = Flight::new(&parse(&text).unwrap_or_else(|error| panic!("{error}"))).expect("laid out");
    let apart = |flight: &Flight| {
        let places = flight.fleet().places();
        distance(places.get(0), places.get(1))
    };
    let mut least = f64::INFINITY;
    while flight.fleet().time() < seconds {
        flight.step();
        least = least.min(apart(&flight));
    }
    let place = flight.fleet().places().get(0);
    fly_on(&mut flight, 100);
    [apart(&flight), least, distance(flight.fleet().places().get(0), place)]
}

/// It went round the disc for ever, in search of a way to where there is none.
#[test]
fn a_robot_whose_goal_the_age_of_a_dead_one_hides_rests_as_near_as_it_may() {
    // Limits and model, and the distance from the dead one at which each comes to rest: that to be kept, with half a metre by age, or
    // from the place where one that brakes is known to stand.
    let cases = [
        (("speed = 1.0", "integrator"), 1.0..1.2),
        (("speed = 0.5", "integrator"), 0.75..0.85),
        (("speed = 1.0\nacceleration = 0.5", "integrator"), 1.0..1.2),
        (("speed = 1.0\nacceleration = 0.5", "double-integrator"), 0.5..0.6),
    ];
    for ((robots, rests), off) in cases.into_iter().flat_map(|case| [0.0, 0.3].map(|off| (case.clone(), off)))
    {
        let [apart, least, moved] = sent_to_one_that_stands("dead", robots, off, 50.0);
        assert!(moved < 1e-6, "{robots:?}, {off}: {moved} in five seconds");
        assert!(rests.contains(&apart) && least > 0.5 - 1e-9, "{robots:?}, {off}: {apart}, {least}");
    }
}

/// The other may leave, and robots that swap places have to go round: so it goes round once, and again after minutes.
#[test]
fn a_robot_whose_goal_another_stands_on_goes_round_it_once_and_waits() {
    for limits in ["speed = 1.0", "speed = 0.5", "speed = 1.0\nacceleration = 0.5"] {
        let [apart, least, moved] = sent_to_one_that_stands("stuck", (limits, "integrator"), 0.0, 50.0);
        assert!(moved < 1e-6 && apart < 0.51 && least > 0.5 - 1e-9, "{limits}: {moved}, {apart}, {least}");
    }
}

/// Where goals are what neighbours make of them, a robot went to and fro beside the one in its way for ever, and those around it with it.
#[test]
fn a_robot_that_comes_no_nearer_on_its_detours_waits() {
    for dead in ["robot_6", "robot_17"] {
        let sets = [
            "control.sweeps=1",
            "manoeuvres[0].legs=[{ seconds = 10.0, translate = [6.0, 2.0], rotate = 90.0 }]",
            &format!("flight.faults=[{{ robot = \"{dead}\", at = 1.5, what = {{ kind = \"dead\" }} }}]"),
        ];
        let mut flight = Flight::new(&load_swarm("square", &sets)).expect("a flight");
        fly_on(&mut flight, 900);
        let before = flight.fleet().places();
        for _ in 0..40 {
            fly_on(&mut flight, 1);
            let now = flight.fleet().places();
            let farthest = (0..25).map(|m| distance(before.get(m), now.get(m))).fold(0.0, f64::max);
            assert!(farthest < 0.05, "{dead} is dead: {farthest} m, 45 s after the beginning");
        }
    }
}
