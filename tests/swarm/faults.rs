//! What goes wrong with robots in flight, row by row: what the rest of the formation does.

use flockform::flock::vectors::distance;
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::Control;
use flockform::swarm::flight::Flight;
use flockform::swarm::safety::Flags;
use flockform::swarm::watch::{Health, Pose};

use super::support::*;
use crate::swarms::load_swarm;

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
    fly_on(flight, 40);
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
    fly_on(&mut flight, 1);
    let lost: Vec<usize> =
        (0..25).filter(|&m| flight.control().flags(m) & Flags::NEIGHBOUR_LOST != 0).collect();
    assert_eq!(lost, [6, 7, 8, 11, 13, 16, 17, 18], "its neighbours say so, and nobody else");
    fly_to_end(&mut flight);
    assert_eq!(flight.control().health(MIDDLE), Health::Stopped);
    let worst = worst_but(&flight, MIDDLE);
    assert!(worst < 0.01, "{worst}");
}

/// The third period of 0.3 s begins at 0.8999999999999999 s.
#[test]
fn a_fault_holds_from_the_period_that_begins_with_it_to_the_one_that_begins_with_its_end() {
    let fault =
        "flight.faults=[{ robot = \"robot_13\", at = 0.9, until = 1.2, what = { kind = \"silent\" } }]";
    let mut flight = Flight::new(&load_swarm("square", &["control.period=0.3", fault])).expect("flies");
    let mut faulty = Vec::new();
    for period in 0..6 {
        faulty.extend((!flight.fleet().is_sound(MIDDLE)).then_some(period));
        flight.step();
    }
    assert_eq!(faulty, [3]);
    assert_eq!(flight.control().watch().counts(MIDDLE).accepted, 5);
}

#[test]
fn a_member_that_comes_back_is_believed_again_and_the_formation_is_whole() {
    let fault =
        "flight.faults=[{ robot = \"robot_13\", at = 2.0, until = 6.0, what = { kind = \"silent\" } }]";
    let overrides = ["control.sweeps=1", fault];
    let (_, report) = flown(&load_swarm("square", &overrides));
    assert_eq!(report.most_lost, 1);
    assert!(
        report.affine_error.is_some_and(|(_, end)| end.is_some_and(|end| end < 1e-3)),
        "{:?}",
        report.affine_error
    );
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

/// A robot that is never heard stands where it starts, as far as is known: the others pass it.
#[test]
fn a_robot_that_is_never_heard_is_kept_clear_of() {
    let four = "title = \"four\"\nradius = 0.2\nlinks = { kind = \"within\", radius = 5.0 }\n\
                robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [0.0, 1.5] }, \
                { name = \"c\", place = [0.75, 0.75] }, { name = \"d\", place = [0.75, 6.0] }]\n\
                leaders = [{ robots = [\"a\", \"b\"], program = { kind = \"manoeuvre\", name = \"go\" } }]\n\
                manoeuvres = [{ name = \"go\", legs = [{ seconds = 5.0, translate = [3.0, 0.0] }] }]\n\
                limits = { speed = 1.5, acceleration = 1.0, clearance = 0.2 }\n\
                flight = { start = [{ robot = \"d\", place = [2.0, 0.75] }] }\n";
    for model in ["integrator", "double-integrator"] {
        for what in ["dead", "silent", "not-a-number", "wrong-frame"] {
            let fault =
                format!("flight.faults=[{{ robot = \"d\", at = 0.0, what = {{ kind = \"{what}\" }} }}]");
            let set = [fault, format!("flight.model={{ kind = \"{model}\" }}")];
            let swarm = Swarm::parse("four", "four.toml", four, &set, None).unwrap_or_else(|e| panic!("{e}"));
            let report = flown(&swarm).1;
            let clearance = report.clearance.expect("four robots");
            assert!((0.2 - 1e-9..0.5).contains(&clearance), "{model}, {what}: {clearance}");
            assert_eq!((report.never_heard.as_slice(), report.most_lost), (&["d".to_owned()][..], 1));
            assert!(report.programs_ended && report.per_robot[2].x > 3.0, "{model}, {what}: {report:?}");
        }
    }
}

#[test]
fn programs_whose_leaders_are_never_heard_keep_no_bound() {
    let fault = "flight.faults=[{ robot = \"robot_5\", at = 0.0, what = { kind = \"silent\" } }]";
    let (_, report) = flown(&load_swarm("square", &[fault, "flight.bounds.affine_error=1.0"]));
    let settled = report.facts(|x| x.to_string()).into_iter().find(|(name, _)| *name == "Settling time");
    assert!(settled.is_some_and(|(_, words)| words.contains("never began")), "{report:?}");
    let held: Vec<_> = report.bounds.iter().map(|one| (one.bound, one.found.is_some(), one.holds)).collect();
    assert_eq!(
        held,
        [("affine_error", false, false), ("final_error", false, false), ("clearance", true, true)]
    );
}

#[test]
fn nonsense_poses_are_turned_away_and_leave_the_others_where_they_belong() {
    for what in ["{ kind = \"not-a-number\" }", "{ kind = \"wrong-frame\" }"] {
        let mut flight = with_fault(what, &[]);
        fly_on(&mut flight, 60);
        assert!(!flight.control().health(MIDDLE).is_usable(), "{what}");
        assert!(flight.control().watch().counts(MIDDLE).rejected() > 10, "{what}");
        fly_to_end(&mut flight);
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
        let Some((_, Some(last))) = report.affine_error else { panic!("affine to the end") };
        assert!(last < 0.02, "{more:?}: {last}");
    }
}

/// What is left of weights of both signs when a robot is gone may add up to nothing.
#[test]
fn a_dead_robot_sends_no_other_away_where_weights_are_below_zero() {
    let hexagon = |dead: usize, links: &str| {
        let place = |k: usize| {
            let (y, x) = (std::f64::consts::TAU * k as f64 / 6.0).sin_cos();
            if k == 6 { [0.0; 2] } else { [2.0 * x, 2.0 * y] }
        };
        let robots: Vec<String> =
            (0..7).map(|k| format!("{{ name = \"r{k}\", place = {:?} }}", place(k))).collect();
        format!(
            "title = \"hexagon\"\nradius = 0.2\nlinks = {{ {links} }}\nrule = {{ weights = {{ kind = \"solved\" }} }}\nrobots = [{}]\n\
             leaders = [{{ robots = [\"r0\", \"r2\", \"r4\"], program = {{ kind = \"manoeuvre\", name = \"wide\" }} }}]\n\
             manoeuvres = [{{ name = \"wide\", legs = [{{ seconds = 5.0, hold = 4.0 }}, {{ seconds = 5.0, stretch = [1.3, 0.8] }}] }}]\n\
             limits = {{ speed = 1.0, clearance = 0.1 }}\nflight = {{ duration = 60.0, model = {{ kind = \"integrator\" }}, \
             faults = [{{ robot = \"r{dead}\", at = 2.0, what = {{ kind = \"dead\" }} }}] }}",
            robots.join(", ")
        )
    };
    for (dead, links) in (0..7).flat_map(|dead| {
        ["kind = \"nearest\", count = 3", "kind = \"nearest\", count = 6"].map(|links| (dead, links))
    }) {
        let swarm = Swarm::parse("hexagon", "hexagon.toml", &hexagon(dead, links), &[], None);
        let mut flight = Flight::new(&swarm.unwrap_or_else(|error| panic!("{error}"))).expect("flies");
        while flight.fleet().time() < 60.0 {
            flight.step();
        }
        let places = flight.fleet().places();
        let farthest = places.iter().map(|place| place[0].hypot(place[1])).fold(0.0, f64::max);
        assert!(farthest < 4.0, "{dead}, {links}: {farthest} m from the middle");
    }
}

/// The formation turns by 90 degrees while a robot lies behind: those that stood beside it have their places by the ones that are left.
#[test]
fn neighbours_that_are_left_keep_the_places_of_an_affine_formation() {
    for dead in [6, 12, 13] {
        let fault = format!(
            "flight.faults=[{{ robot = \"robot_{}\", at = 2.0, what = {{ kind = \"dead\" }} }}]",
            dead + 1
        );
        // Those that pass the dead one may touch it.
        let set = ["limits={ speed = 1.0 }", "flight.bounds={}", &fault];
        let mut flight = Flight::new(&load_swarm("square", &set)).unwrap_or_else(|error| panic!("{error}"));
        let mut worst = 0.0_f64;
        while flight.fleet().time() < 40.0 {
            flight.step();
            worst = worst.max(worst_but(&flight, dead));
        }
        assert!(worst < 1e-9, "{dead}: {worst} m");
    }
}

/// The places that the errors are measured from, to the end: those by the leaders' motion only while it is affine.
#[test]
fn a_leader_that_is_sent_away_after_a_manoeuvre_breaks_the_bound_on_the_end() {
    let text = "title = \"away\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 4 }\n\
                robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [2.0, 0.0] }, { name = \"c\", place = [0.0, 2.0] }, \
                { name = \"d\", place = [2.0, 2.0] }, { name = \"e\", place = [1.0, 1.0] }]\n\
                leaders = [{ robots = [\"a\", \"b\", \"c\"], program = { kind = \"manoeuvre\", name = \"m\" } }]\n\
                manoeuvres = [{ name = \"m\", legs = [{ seconds = 1.0, translate = [0.1, 0.0] }] }]\n\
                limits = { speed = 0.2, clearance = 0.1 }\ncontrol = { sweeps = 200 }\n\
                [flight]\nduration = 6.0\nmodel = { kind = \"integrator\" }\nbounds = { final_error = 0.01 }\n\
                commands = [{ after = 60, what = { kind = \"lead\", robot = \"a\", to = [-8.0, -8.0] } }]\n";
    let (_, report) = flown(&Swarm::parse("away", "away.toml", text, &[], None).expect("a swarm"));
    assert!(report.affine_error.is_some_and(|(_, end)| end.is_none()), "{:?}", report.affine_error);
    let bound = &report.bounds[0];
    assert!(!bound.holds && bound.found.is_some_and(|found| found > 10.0), "{bound:?}");
    assert_eq!(bound.worst.as_ref().map(|worst| worst.time), Some(6.0), "{bound:?}");
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
fn the_programs_wait_some_seconds_for_a_robot_that_is_not_heard() {
    let mut control = Control::new(&load_swarm("square", &[])).expect("laid out");
    let places = control.formation().places.clone();
    let pose = |m: usize, stamp: f64| Pose { position: places.get(m), yaw: 0.0, stamp, frame_is_right: true };
    for tick in 1..=110 {
        let now = 0.05 * f64::from(tick);
        (0..25)
            .filter(|&m| m != MIDDLE)
            .for_each(|m| control.receive(m, pose(m, now), now).expect("believed"));
        control.tick(now);
        assert_eq!(
            control.program_time() > 0.0,
            now - 0.05 >= 5.0 - 1e-9,
            "at {now} s: {}",
            control.program_time()
        );
    }
}

#[test]
fn an_emergency_stop_latches_and_the_programs_wait() {
    let mut flight = with_fault("{ kind = \"stuck\" }", &["limits={ speed = 1.0, clearance = 0.3 }"]);
    fly_on(&mut flight, 30);
    let time = flight.control().program_time();
    flight.control_mut().emergency_stop();
    fly_on(&mut flight, 5);
    let before = flight.fleet().places();
    fly_on(&mut flight, 50);
    assert_eq!(flight.fleet().places(), before);
    assert_eq!(flight.control().program_time(), time);
    flight.control_mut().set_active(true);
    fly_on(&mut flight, 5);
    assert_eq!(flight.fleet().places(), before, "only resume lifts it");
    assert!(flight.control_mut().resume());
    fly_on(&mut flight, 50);
    assert_ne!(flight.fleet().places(), before);
}

/// A pose that is corrected, a robot that is carried, a simulation that begins anew: it did not drive there.
#[test]
fn a_robot_that_is_found_elsewhere_in_an_emergency_stop_is_held_there() {
    let mut control = Control::new(&load_swarm("square", &[])).expect("laid out");
    let (period, places) = (control.period(), control.formation().places.clone());
    let fly = |control: &mut Control, ticks: std::ops::Range<u32>, by: f64| {
        let mut target = None;
        for now in ticks.map(|tick| f64::from(tick) * period) {
            for (m, [x, y]) in places.iter().enumerate() {
                let away = if m == 6 { by } else { 0.0 };
                let pose = Pose { position: [x, y + away], yaw: 0.0, stamp: now, frame_is_right: true };
                // Some are not believed at once.
                control.receive(m, pose, now).ok();
            }
            control.tick(now);
            target = control.target(6);
        }
        target.expect("heard")
    };
    let at = |by: f64| [places.get(6)[0], places.get(6)[1] + by];
    fly(&mut control, 0..20, 0.0);
    control.emergency_stop();
    assert!(distance(fly(&mut control, 20..40, 0.0), at(0.0)) < 1e-9);
    for (ticks, by) in [(40..46, -8.0), (46..100, -8.0), (0..1, -12.0), (1..40, -12.0)] {
        let target = fly(&mut control, ticks, by);
        assert!(distance(target, at(by)) < 1e-9, "{target:?}, not {:?}", at(by));
    }
}

#[test]
fn a_robot_that_is_found_elsewhere_has_not_gone_there_at_the_speed_of_light() {
    let limits = ["limits={ speed = 1.0, acceleration = 0.1, clearance = 0.1 }"];
    let mut control = Control::new(&load_swarm("square", &limits)).expect("laid out");
    let (period, places) = (control.period(), control.formation().places.clone());
    for tick in 0..60 {
        let now = f64::from(tick) * period;
        for (m, [x, y]) in places.iter().enumerate() {
            let away = if m == 6 && tick >= 30 { 8.0 } else { 0.0 };
            let pose = Pose { position: [x, y + away], yaw: 0.0, stamp: now, frame_is_right: true };
            let believed = control.receive(m, pose, now).is_ok();
            if m == 6 && away > 0.0 && believed {
                control.tick(now);
                let target = control.target(6).expect("heard");
                // From rest in a period.
                assert!(distance(target, [x, y + away]) < 0.11 * period * period, "{target:?}");
                assert!(target[1] < y + away, "towards where it belongs: {target:?}");
                return;
            }
        }
        control.tick(now);
    }
    panic!("it was never believed");
}
