//! Loops that serve one robot each, beside one that serves all.

use flockform::flock::vectors::distance;
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::Control;
use flockform::swarm::control::scope::NodeScope;
use flockform::swarm::flight::Fleet;
use flockform::swarm::transport::Received;

use super::support::*;

/// Two pairs that know only themselves and are led through each other.
const CROSSING: &str = r#"
title = "crossing pairs"
radius = 0.2
robots = [
    { name = "a", place = [0.0, 0.0] }, { name = "b", place = [-2.0, 0.3] },
    { name = "c", place = [6.0, 0.0] }, { name = "d", place = [8.0, 0.3] },
]
links = { kind = "within", radius = 3.0 }
leaders = [
    { robots = ["a"], program = { kind = "path", points = [{ at = 6.0, displacement = [6.0, 0.0] }] } },
    { robots = ["c"], program = { kind = "path", points = [{ at = 6.0, displacement = [-6.0, 0.0] }] } },
]
limits = { speed = 1.0, clearance = 0.2 }
flight = { model = { kind = "integrator" } }
"#;

fn scoped(swarm: &Swarm, member: &str) -> (Control, NodeScope) {
    let mut control = Control::new(swarm).expect("laid out");
    let scope = NodeScope::take(swarm, &mut control, Some(member)).expect("can be flown alone");
    (control, scope)
}

#[test]
fn a_loop_for_one_robot_hears_all_that_measure_where_it_keeps_no_distance() {
    let apart = CROSSING.replace(", clearance = 0.2", "");
    let heard = |more: &str| scoped(&parse(&format!("{apart}{more}")).expect("a swarm"), "b").1.heard;
    assert_eq!(heard(""), [0, 1]);
    assert_eq!(heard("ranges = { tolerance = 0.2, max_faulty = 1 }\n"), [0, 1, 2, 3]);
}

#[test]
fn a_loop_for_one_robot_sends_what_a_loop_for_all_sends_and_robots_that_are_no_neighbours_pass_clear() {
    let swarm = parse(CROSSING).expect("a swarm");
    let mut whole = Control::new(&swarm).expect("laid out");
    let names = whole.formation().names.clone();
    let mut alone: Vec<_> = names.iter().map(|name| scoped(&swarm, name)).collect();
    let mut fleet = Fleet::new(&swarm, whole.formation()).expect("robots");
    let mut least = f64::INFINITY;
    for period in 0..400 {
        let now = fleet.time();
        fleet.send(now, &mut |received| {
            whole.take(received, now).expect("a pose");
            let Received::Pose(member, _) = received else { return };
            for (control, scope) in &mut alone {
                if scope.heard.contains(&member) {
                    control.take(received, now).expect("a pose");
                }
            }
        });
        whole.tick(now);
        for (member, (control, _)) in alone.iter_mut().enumerate() {
            control.tick(now);
            assert_eq!(control.target(member), whole.target(member), "{} in period {period}", names[member]);
        }
        fleet.go(|member| alone[member].0.target(member));
        let places = fleet.places();
        for a in 0..names.len() {
            for b in 0..a {
                least = least.min(distance(places.get(a), places.get(b)) - 0.4);
            }
        }
    }
    assert!(least >= 0.2 - 1e-9, "{least} m between two rims");
    assert!(least < 0.3, "they met: {least} m");
}

#[test]
fn a_loop_for_one_robot_hears_all_unless_nothing_is_kept_apart_or_the_file_says_otherwise() {
    let heard = |text: &str| scoped(&parse(text).expect("a swarm"), "a").1.heard;
    assert_eq!(heard(CROSSING), [0, 1, 2, 3]);
    assert_eq!(heard(&format!("{CROSSING}[node]\nhears = \"neighbours\"\n")), [0, 1]);
    assert_eq!(heard(&CROSSING.replace(", clearance = 0.2", "")), [0, 1]);
    let present = CROSSING.replace("kind = \"within\"", "kind = \"present\"");
    assert_eq!(heard(&present.replace(", clearance = 0.2", "")), [0, 1, 2, 3], "neighbours of later");
}
