//! What goes wrong with robots in flight, row by row: what the rest of the formation does.

use flockform::flock::vectors::distance;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::Control;
use flockform::swarm::flight::Flight;
use flockform::swarm::safety::Flags;
use flockform::swarm::watch::{Health, Pose};

use super::support::*;
use crate::swarms::load_swarm;

/// The square of the bundled file, flown with a fault from 2 s on; robot_13 is its middle.
fn with_fault(what: &str, more: &[&str]) -> Flight {
    let fault = format!("flight.faults=[{{ robot = \"robot_13\", at = 2.0, what = {what} }}]");
    // A robot that stands where others have to pass is an obstacle; here it is the formation that matters.
    let limits = "limits={ speed = 1.0 }";
    let mut overrides = vec!["control.sweeps=1", limits, fault.as_str()];
    overrides.extend(more);
    Flight::new(&load_swarm("square", &overrides)).unwrap_or_else(|error| panic!("{error}"))
}

const MIDDLE: usize = 12;

fn fly(flight: &mut Flight, periods: usize) {
    (0..periods).for_each(|_| flight.step());
}

/// Flies on for as long as the bundled file does, by when the formation is at rest.
fn fly_to_end(flight: &mut Flight) {
    let end = load_swarm("square", &[]).raw.flight.duration.expect("a duration");
    while flight.fleet().time() < end {
        flight.step();
    }
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
        fly(&mut flight, 60);
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

/// Every sweep of a period leaves it out, not the last alone.
#[test]
fn a_liar_or_a_lost_robot_moves_no_other_however_many_sweeps_a_period_has() {
    let lie = "flight.faults=[{ robot = \"robot_13\", at = 1.0, what = { kind = \"offset\", by = [100.0, -100.0] } }]";
    let silent = "flight.faults=[{ robot = \"robot_13\", at = 1.0, what = { kind = \"silent\" } }]";
    for sweeps in [1, 2, 5] {
        let sweeps = format!("control.sweeps={sweeps}");
        let (_, report) = flown(&load_swarm("faulty-robot", &[&sweeps, lie]));
        assert!(report.holds(), "{sweeps}: {:?}", report.bounds);
        let all = bundled_swarm("faulty-robot").expect("bundled").text;
        let believing = all.replace("[resilience]\nmax_faulty_neighbours = 1\n", "");
        assert!(believing.len() < all.len());
        let alone = [sweeps.clone(), silent.to_owned(), "flight.bounds={}".to_owned()];
        let swarm = Swarm::parse("alone", "alone.toml", &believing, &alone, None)
            .unwrap_or_else(|error| panic!("{error}"));
        let mut flight = Flight::new(&swarm).unwrap_or_else(|error| panic!("{error}"));
        fly_to_end(&mut flight);
        let places = flight.fleet().places();
        let formation = flight.control().formation();
        let apart = |m: usize| {
            let [x, y] = formation.places.get(m);
            distance(places.get(m), [x + 4.0, y + 2.0])
        };
        let worst = (0..formation.count()).filter(|&m| m != MIDDLE).map(apart).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{sweeps}: {worst}");
    }
}

/// Points of a frame copy robots beside them: a liar would have a vote more with each of them, and one that is lost would go on
/// through them.
#[test]
fn what_a_frame_copies_of_a_liar_or_of_a_lost_robot_moves_no_other() {
    let framed = |frame: &str, radius: u32, shape: &str, leaders: &str, more: &str| {
        let text = format!(
            "title = \"framed\"\nradius = 0.1\nlattice = {{ kind = \"square\", spacing = 1.0 }}\nframe = \"{frame}\"\n\
             body = {{ shape = {{ kind = \"grid\", {shape} }} }}\nneighbours = {{ kind = \"chebyshev\", radius = {radius} }}\n\
             leaders = [{{ region = {{ kind = \"ids\", ids = [{leaders}] }}, program = {{ kind = \"path\", points = \
             [{{ at = 5.0, displacement = [0.0, 4.0] }}] }} }}]\nlimits = {{ speed = 3.0 }}\n{more}"
        );
        let mut flight =
            Flight::new(&parse(&text).expect("a swarm")).unwrap_or_else(|error| panic!("{error}"));
        fly(&mut flight, 1200);
        let (places, formation) = (flight.fleet().places(), flight.control().formation());
        let faulty = formation.number("robot_3").expect("there");
        let apart = |m: usize| {
            let [x, y] = formation.places.get(m);
            distance(places.get(m), [x, y + 4.0])
        };
        let worst = (0..formation.count()).filter(|&m| m != faulty).map(apart).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{frame}, {more}: {worst}");
    };
    for frame in ["lagged", "immediate", "mirror"] {
        let silent = "flight.faults = [{ robot = \"robot_3\", at = 1.0, what = { kind = \"silent\" } }]";
        framed(frame, 1, "columns = 5, rows = 5", "9, 13, 37, 41", silent);
        for what in ["{ kind = \"offset\", by = [0.0, -3.0] }", "{ kind = \"stuck\" }"] {
            let lie = format!(
                "resilience = {{ max_faulty_neighbours = 1 }}\nflight.faults = [{{ robot = \"robot_3\", at = 1.0, what = {what} }}]"
            );
            framed(frame, 2, "columns = 7, rows = 7", "25, 26, 31, 36, 91, 92, 97, 96, 58, 64, 61", &lie);
        }
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

#[test]
fn weights_below_zero_cannot_leave_out_liars() {
    let overrides = [
        "neighbours.radius=2",
        "leaders[0].region={ kind = \"ids\", ids = [1, 2, 3, 4, 5, 6, 10, 11, 15, 16, 21] }",
        "rule={ weights = { kind = \"solved\" } }",
    ];
    let refused = Flight::new(&load_swarm("faulty-robot", &overrides)).err().expect("refused").to_string();
    assert!(refused.contains("some of `rule.weights` are below 0"), "{refused}");
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
        let trimmed = (0..25).any(|m| flight.control().flags(m) & Flags::TRIMMED != 0);
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

/// The worst of a flight for all robots but the middle.
struct Worst {
    /// Between two hulls \[m\].
    apart: f64,
    /// From the post \[m\].
    to_post: f64,
    /// Farthest towards the fence \[m\].
    east: f64,
    /// \[m/s\]
    speed: f64,
}

const MODELS: [&str; 3] = [
    "flight.model={ kind = \"ideal\" }",
    "flight.model={ kind = \"integrator\" }",
    "flight.model={ kind = \"double-integrator\" }",
];

/// Flies past a post and up to a fence, with a fault of the middle, whose poses are believed at once, at any speed: the
/// worst for those around it. `lie` is called before each period.
fn worst_of_the_others(fault: &str, model: &str, mut lie: impl FnMut(&mut Flight, u32)) -> Worst {
    let limits = "limits={ speed = 1.0, acceleration = 2.0, clearance = 0.3, geofence = [[-2, -3], [11, -3], [11, 11], [-2, 11]] }";
    let post = "obstacles=[{ kind = \"disc\", centre = [8.5, 3.0], radius = 0.4 }]";
    let mut flight = with_fault(fault, &[limits, post, model, "poses.recover=1", "poses.jump_speed=1e6"]);
    let mut worst =
        Worst { apart: f64::INFINITY, to_post: f64::INFINITY, east: f64::NEG_INFINITY, speed: 0.0 };
    for period in 0..800 {
        let before = flight.fleet().places().clone();
        lie(&mut flight, period);
        flight.step();
        let (places, radii) = (flight.fleet().places(), &flight.control().formation().radii);
        let others = || (0..25).filter(|&m| m != MIDDLE);
        for (a, b) in others().flat_map(|a| others().take_while(move |&b| b < a).map(move |b| (a, b))) {
            worst.apart = worst.apart.min(distance(places.get(a), places.get(b)) - radii[a] - radii[b]);
        }
        for m in others() {
            worst.to_post = worst.to_post.min(distance(places.get(m), [8.5, 3.0]) - 0.4 - radii[m]);
            worst.east = worst.east.max(places.x[m]);
            worst.speed = worst.speed.max(distance(places.get(m), before.get(m)) / 0.05);
        }
    }
    worst
}

impl Worst {
    /// Every bound holds; whether the post and the fence were reached.
    fn within_bounds(&self, what: &str) -> [bool; 2] {
        let Self { apart, to_post, east, speed } = *self;
        assert!(apart >= 0.3 - 1e-9, "{what}: {apart} m");
        assert!(to_post >= 0.3 - 1e-9, "{what}: {to_post} m from the post");
        assert!(east <= 11.0 - 0.2 + 1e-9, "{what}: {east} m");
        assert!(speed <= 1.0 + 1e-9, "{what}: {speed} m/s");
        [to_post < 0.31, east > 10.7]
    }
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
    let mut were_reached = [0; 2];
    for (lie, model) in lies.into_iter().flat_map(|lie| MODELS.map(|model| (lie, model))) {
        let worst = worst_of_the_others(lie, model, |_, _| {});
        let reached = worst.within_bounds(&format!("{lie} {model}"));
        were_reached
            .iter_mut()
            .zip(reached)
            .for_each(|(flights, is_reached)| *flights += i32::from(is_reached));
    }
    // Post and fence are in the way.
    assert!(were_reached.iter().all(|&flights| flights > 5), "{were_reached:?}");
}

/// Ages and velocities are taken from stamps, which a liar can choose as it can its place.
#[test]
fn a_liar_that_forges_its_stamps_too_brings_no_two_others_near_each_other() {
    type Stamps = fn(f64, u32) -> [f64; 2];
    // Two poses a period: as far ahead and back as is admitted, to and fro, and no time apart.
    let stamps: [(&str, Stamps); 4] = [
        ("ahead", |now, _| [now + 0.098, now + 0.099]),
        ("back", |now, _| [now - 0.49, now - 0.48]),
        (
            "to and fro",
            |now, period| if period % 20 < 10 { [now - 0.4, now - 0.39] } else { [now, now + 0.09] },
        ),
        ("at once", |now, _| [now, now + 1e-12]),
    ];
    // Beside its true place: none, on top of a neighbour and back, round it faster than anything flies, and far away.
    type Lie = fn(u32) -> [[f64; 2]; 2];
    let lies: [(&str, Lie); 4] = [
        ("its own place", |_| [[0.0; 2]; 2]),
        ("two neighbours", |_| [[1.5, 0.0], [0.0, 1.5]]),
        ("round it", |period| {
            let (sin, cos) = f64::from(period).sin_cos();
            [[1.2 * cos, 1.2 * sin], [-1.2 * cos, -1.2 * sin]]
        }),
        ("far away", |_| [[-40.0, 3.0], [0.2, 0.0]]),
    ];
    let mut were_believed = 0;
    for (k, (stamps, lie)) in stamps.iter().flat_map(|stamps| lies.map(|lie| (stamps, lie))).enumerate() {
        let model = MODELS[k % MODELS.len()];
        let what = format!("{} stamps, {}, {model}", stamps.0, lie.0);
        let worst = worst_of_the_others("{ kind = \"silent\" }", model, |flight, period| {
            let (now, place) = (flight.fleet().time(), flight.fleet().places().get(MIDDLE));
            if now < 2.0 {
                return;
            }
            for (by, stamp) in lie.1(period).into_iter().zip(stamps.1(now, period)) {
                let position = [0, 1].map(|axis| place[axis] + by[axis]);
                let pose = Pose { position, yaw: 0.0, stamp, frame_is_right: true };
                were_believed += u32::from(flight.control_mut().receive(MIDDLE, pose, now).is_ok());
            }
        });
        worst.within_bounds(&what);
    }
    // Of 24,320: those dated behind the last one are not.
    assert!(were_believed > 20_000, "{were_believed}");
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
    fly(&mut flight, 100);
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
        fly(&mut flight, 900);
        let before = flight.fleet().places();
        for _ in 0..40 {
            fly(&mut flight, 1);
            let now = flight.fleet().places();
            let farthest = (0..25).map(|m| distance(before.get(m), now.get(m))).fold(0.0, f64::max);
            assert!(farthest < 0.05, "{dead} is dead: {farthest} m, 45 s after the beginning");
        }
    }
}
