//! What goes wrong with robots in flight, row by row: what the rest of the formation does.

use flockform::flock::vectors::distance;
use flockform::swarm::control::{Control, NEIGHBOUR_LOST, TRIMMED};
use flockform::swarm::flight::Flight;
use flockform::swarm::watch::{Health, Pose};

use super::support::*;
use crate::swarms::load_swarm;

/// The square of the bundled file, flown with a fault from 2 s on; robot_13 is its middle.
fn with_fault(what: &str, more: &[&str]) -> Flight {
    let fault = format!("flight.faults=[{{ robot = \"robot_13\", at = 2.0, what = {what} }}]");
    // A robot that stands where others have to pass is an obstacle; here it is the formation that matters.
    let limits = "limits={ speed = 1.0 }";
    let mut overrides = vec!["control.sweeps=1", "flight.duration=40.0", limits, fault.as_str()];
    overrides.extend(more);
    Flight::new(&load_swarm("square", &overrides)).unwrap_or_else(|error| panic!("{error}"))
}

const MIDDLE: usize = 12;

fn fly(flight: &mut Flight, periods: usize) {
    (0..periods).for_each(|_| flight.step());
}

fn worst_but(flight: &Flight, without: usize) -> f64 {
    let control = flight.control();
    let formation = control.formation();
    let map = formation.affine(control.program_time()).expect("a manoeuvre");
    let places = flight.fleet().places();
    let apart = |m: usize| distance(places.get(m), map.apply(formation.places.get(m)));
    (0..formation.count()).filter(|&m| m != without).map(apart).fold(0.0, f64::max)
}

/// Periods from the fault until the middle has this health, at most 100.
fn until_health(flight: &mut Flight, health: Health) -> usize {
    fly(flight, 40);
    (0..100)
        .find(|_| {
            flight.step();
            flight.control().health(MIDDLE) == health
        })
        .unwrap_or(100)
        + 1
}

#[test]
fn a_silent_member_is_held_then_dropped_then_stopped_and_the_others_come_home() {
    let mut flight = with_fault("{ kind = \"dead\" }", &[]);
    // Fresh for 3 periods of 0.05 s, held for 0.5 s, stopped after 2 s.
    assert!((3..=5).contains(&until_health(&mut flight, Health::Held)));
    let mut flight = with_fault("{ kind = \"dead\" }", &[]);
    assert!((10..=12).contains(&until_health(&mut flight, Health::Degraded)));
    assert!(flight.control().target(MIDDLE).is_none(), "nobody is sent anywhere from nothing");
    fly(&mut flight, 1);
    let lost: Vec<usize> = (0..25).filter(|&m| flight.control().flags(m) & NEIGHBOUR_LOST != 0).collect();
    assert_eq!(lost, [6, 7, 8, 11, 13, 16, 17, 18], "its neighbours say so, and nobody else");
    fly(&mut flight, 800);
    assert_eq!(flight.control().health(MIDDLE), Health::Stopped);
    let worst = worst_but(&flight, MIDDLE);
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn a_member_that_comes_back_is_believed_again_and_the_formation_is_whole() {
    let fault =
        "flight.faults=[{ robot = \"robot_13\", at = 2.0, until = 6.0, what = { kind = \"silent\" } }]";
    let overrides = ["control.sweeps=1", "flight.duration=60.0", fault];
    let (_, report) = flown(&load_swarm("square", &overrides));
    assert_eq!(report.most_lost, 1);
    assert!(report.affine_error.expect("affine")[1] < 1e-3, "{:?}", report.affine_error);
}

/// What has not arrived yet is not lost; what never arrives is.
#[test]
fn a_robot_is_lost_from_its_first_pose_on_or_if_none_comes() {
    let lost = |more: &[&str]| {
        let overrides = [&["control.sweeps=1", "flight.duration=5.0"], more].concat();
        flown(&load_swarm("square", &overrides)).1.most_lost
    };
    let dead = "flight.faults=[{ robot = \"robot_13\", at = 0.0, what = { kind = \"dead\" } }]";
    assert_eq!(lost(&["flight.delay=3", "flight.jitter=2"]), 0);
    assert_eq!(lost(&["flight.delay=3", dead]), 1);
    assert_eq!(lost(&["flight.loss=1.0"]), 25);
}

#[test]
fn nonsense_poses_are_turned_away_and_leave_the_others_where_they_belong() {
    for what in ["{ kind = \"not-a-number\" }", "{ kind = \"wrong-frame\" }"] {
        let mut flight = with_fault(what, &[]);
        fly(&mut flight, 60);
        assert!(!flight.control().health(MIDDLE).is_usable(), "{what}");
        assert!(flight.control().watch().counts(MIDDLE).rejected() > 10, "{what}");
        fly(&mut flight, 740);
        for m in 0..25 {
            assert!(flight.fleet().robots()[m].position.iter().all(|value| value.is_finite()), "{what}");
        }
        assert!(worst_but(&flight, MIDDLE) < 0.01, "{what}: {}", worst_but(&flight, MIDDLE));
    }
}

#[test]
fn lost_late_and_doubled_poses_change_the_way_and_not_the_end() {
    let cases: [&[&str]; 4] = [
        &["flight.loss=0.3"],
        &["flight.loss=0.8", "poses.age_limit=3.0", "poses.stop_after=5.0"],
        &[
            "flight.delay=20",
            "poses.fresh=1.5",
            "poses.age_limit=2.0",
            "poses.stop_after=4.0",
            "limits={ speed = 0.2 }",
        ],
        &["flight.duplicates=0.5", "flight.jitter=3"],
    ];
    for more in cases {
        let mut overrides = vec!["control.sweeps=1", "flight.duration=150.0", "flight.bounds={}"];
        overrides.extend(more);
        let (_, report) = flown(&load_swarm("square", &overrides));
        let [_, last] = report.affine_error.expect("affine");
        assert!(last < 0.02, "{more:?}: {last}");
    }
}

#[test]
fn one_liar_is_trimmed_on_eight_neighbours_and_leads_them_astray_without() {
    // All the rim leads, so that every follower has eight neighbours of whom one may lie.
    let rim = "leaders=[{ region = { kind = \"boundary\" }, program = { kind = \"path\", points = [{ at = 3.0, displacement = [2.0, 1.0] }] } }]";
    let end = |resilient: bool| {
        let fault = "flight.faults=[{ robot = \"robot_13\", at = 0.5, what = { kind = \"offset\", by = [3.0, -4.0] } }]";
        let mut overrides = vec![
            "control.sweeps=1",
            "rule={}",
            rim,
            fault,
            "limits={}",
            "flight.duration=30.0",
            "flight.model={ kind = \"ideal\" }",
            "flight.bounds={}",
            // Let the lie pass for a pose.
            "poses.recover=1",
        ];
        if resilient {
            overrides.push("resilience={ max_faulty_neighbours = 1 }");
        }
        let mut flight =
            Flight::new(&load_swarm("square", &overrides)).unwrap_or_else(|error| panic!("{error}"));
        fly(&mut flight, 600);
        let trimmed = (0..25).any(|m| flight.control().flags(m) & TRIMMED != 0);
        let formation = flight.control().formation();
        let places = flight.fleet().places();
        let apart = |m: usize| {
            let [x, y] = formation.places.get(m);
            distance(places.get(m), [x + 2.0, y + 1.0])
        };
        let honest = (0..25).filter(|&m| m != MIDDLE && !formation.leads(m));
        (honest.map(apart).fold(0.0, f64::max), trimmed)
    };
    let (with, trimmed) = end(true);
    assert!(with < 1e-9 && trimmed, "{with}");
    let (without, _) = end(false);
    assert!(without > 0.2, "{without}");
}

/// Between any two of the others, and of what stands still, the filter asks for their own poses alone: a third one may hold
/// them, and not push them.
#[test]
fn robots_that_say_where_they_are_keep_every_bound_among_themselves_whatever_one_says() {
    let lies = [
        // On top of a neighbour, between two of them, far away, anywhere, and where it was once.
        "{ kind = \"offset\", by = [1.5, 0.0] }",
        "{ kind = \"offset\", by = [0.75, 0.75] }",
        "{ kind = \"offset\", by = [-40.0, 3.0] }",
        "{ kind = \"random\", within = 3.0 }",
        "{ kind = \"frozen\" }",
    ];
    let models = [
        "flight.model={ kind = \"ideal\" }",
        "flight.model={ kind = \"integrator\" }",
        "flight.model={ kind = \"double-integrator\" }",
    ];
    let mut were_reached = [0; 2];
    for (lie, model) in lies.into_iter().flat_map(|lie| models.map(|model| (lie, model))) {
        // The way of the formation leads past a post and up to a fence.
        let limits = "limits={ speed = 1.0, acceleration = 2.0, clearance = 0.3, geofence = [[-2, -3], [11, -3], [11, 11], [-2, 11]] }";
        let post = "obstacles=[{ kind = \"disc\", centre = [8.5, 3.0], radius = 0.4 }]";
        // Believed at once, at any speed: the worst for those around.
        let all = [limits, post, model, "poses.recover=1", "poses.jump_speed=1e6"];
        let mut flight = with_fault(lie, &all);
        let (mut nearest, mut to_post, mut east, mut fastest) =
            (f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        for _ in 0..800 {
            let before = flight.fleet().places().clone();
            flight.step();
            let (places, radii) = (flight.fleet().places(), &flight.control().formation().radii);
            let honest = || (0..25).filter(|&m| m != MIDDLE);
            for (a, b) in honest().flat_map(|a| honest().take_while(move |&b| b < a).map(move |b| (a, b))) {
                nearest = nearest.min(distance(places.get(a), places.get(b)) - radii[a] - radii[b]);
            }
            for m in honest() {
                to_post = to_post.min(distance(places.get(m), [8.5, 3.0]) - 0.4 - radii[m]);
                east = east.max(places.x[m]);
                fastest = fastest.max(distance(places.get(m), before.get(m)) / 0.05);
            }
        }
        assert!(nearest >= 0.3 - 1e-9, "{lie} {model}: {nearest} m");
        assert!(to_post >= 0.3 - 1e-9, "{lie} {model}: {to_post} m from the post");
        assert!(east <= 11.0 - 0.2 + 1e-9, "{lie} {model}: {east} m");
        were_reached[0] += usize::from(to_post < 0.31);
        were_reached[1] += usize::from(east > 10.7);
        assert!(fastest <= 1.0 + 1e-9, "{lie} {model}: {fastest} m/s");
    }
    // Post and fence are in the way.
    assert!(were_reached.iter().all(|&flights| flights > 5), "{were_reached:?}");
}

#[test]
fn nobody_gets_a_target_before_it_is_heard() {
    let mut control = Control::new(&load_swarm("square", &[])).expect("laid out");
    control.tick(0.0);
    assert!((0..25).all(|m| control.target(m).is_none()));
    let pose = |stamp: f64| Pose { position: control_place(7), yaw: 0.0, stamp, frame_is_right: true };
    control.receive(7, pose(0.05), 0.05).expect("believed");
    control.tick(0.05);
    let told: Vec<usize> = (0..25).filter(|&m| control.target(m).is_some()).collect();
    assert_eq!(told, [7]);
    assert_eq!(control.target(7), Some(control_place(7)), "alone it has nobody to follow");
}

fn control_place(m: usize) -> [f64; 2] {
    Control::new(&load_swarm("square", &[])).expect("laid out").formation().places.get(m)
}

#[test]
fn the_programs_wait_until_every_leader_has_been_heard() {
    let mut control = Control::new(&load_swarm("square", &[])).expect("laid out");
    let places = control.formation().places.clone();
    let pose = |m: usize, stamp: f64| Pose { position: places.get(m), yaw: 0.0, stamp, frame_is_right: true };
    // robot_25 leads too, and comes last.
    for tick in 1..=10 {
        let now = 0.05 * f64::from(tick);
        (0..24).for_each(|m| control.receive(m, pose(m, now), now).expect("believed"));
        control.tick(now);
        assert_eq!(control.program_time(), 0.0);
        assert_eq!(control.target(7), Some(places.get(7)), "everybody stays meanwhile");
    }
    (0..25).for_each(|m| control.receive(m, pose(m, 0.55), 0.55).expect("believed"));
    control.tick(0.55);
    assert_eq!(control.program_time(), 0.05);
}

#[test]
fn an_emergency_stop_latches_and_the_programs_wait() {
    let mut flight = with_fault("{ kind = \"stuck\" }", &["limits={ speed = 1.0, clearance = 0.3 }"]);
    fly(&mut flight, 30);
    let time = flight.control().program_time();
    flight.control_mut().emergency_stop();
    fly(&mut flight, 5);
    let before = flight.fleet().places();
    fly(&mut flight, 50);
    assert_eq!(flight.fleet().places(), before);
    assert_eq!(flight.control().program_time(), time);
    flight.control_mut().set_active(true);
    fly(&mut flight, 5);
    assert_eq!(flight.fleet().places(), before, "only resume lifts it");
    assert!(flight.control_mut().resume());
    fly(&mut flight, 50);
    assert_ne!(flight.fleet().places(), before);
}
