//! Plans against what is computed by hand, and against flights.

mod frames;
mod present;
mod programs;
mod speed;

use super::*;
use crate::flock::vectors::Vectors;
use crate::scene::bundled::bundled_swarm;
use crate::swarm::examples::{bundled, parsed};

fn plan(name: &str, set: &[&str]) -> SwarmPlan {
    SwarmPlan::new(&bundled(name, set)).expect("laid out")
}

fn planned(text: &str, set: &[&str]) -> SwarmPlan {
    SwarmPlan::new(&parsed(text, set)).expect("laid out")
}

#[test]
fn a_row_between_two_leaders_has_the_gain_and_the_lag_that_are_computed_by_hand() {
    // One follower in the middle of two leaders, whose place is theirs in the mean: A = 0, B = (1/2, 1/2).
    let text = "title = \"three\"\nlinks = { kind = \"nearest\", count = 2 }\nleaders = [\
                { robots = [\"a\", \"c\"], program = { kind = \"external\" } }]\n\
                robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [1.0, 0.0] }, \
                { name = \"c\", place = [2.0, 0.0] }]\nlimits = { clearance = 0.1 }\n";
    let plan = planned(text, &[]);
    assert!((plan.noise.gain.expect("linear") - 0.5_f64.sqrt()).abs() < 1e-9, "{plan}");
    // Places as they were seen a period ago.
    assert!((plan.speed.lag_s.expect("linear") - plan.period_s).abs() < 1e-9, "{plan}");
    // 1 m between places, two radii of 0.15 m and the clearance leave 0.6 m for twice three deviations.
    assert!((plan.noise.largest.expect("kept apart") - 0.1).abs() < 1e-9, "{plan}");
    assert_eq!((plan.robots, plan.leaders, plan.delay.largest_periods), (3, 2, 10));
}

#[test]
fn more_sweeps_shorten_the_lag_and_delay_lengthens_the_half_life() {
    let (one, many) = (plan("square", &["control.sweeps=1"]), plan("square", &[]));
    let lag = |plan: &SwarmPlan| plan.speed.lag_s.expect("linear");
    assert!(lag(&many) < 0.1 * lag(&one), "{many}\n{one}");
    let delayed = plan("square", &["control.sweeps=1", "flight.delay=3"]);
    let half = |plan: &SwarmPlan| plan.delay.half_life_s.expect("comes to rest");
    assert!((half(&delayed) / half(&one) - 4.0).abs() < 1e-9);
}

#[test]
fn what_the_file_cannot_hold_is_warned_of() {
    let noisy = plan("square", &["flight.noise=0.5"]);
    assert!(noisy.cautions.iter().any(|caution| caution.contains("flight.noise")), "{noisy}");
    let late = plan("square", &["flight.delay=100"]);
    assert!(late.cautions.iter().any(|caution| caution.contains("no robot will get a target")), "{late}");
    let jittery = plan("square", &["flight.jitter=100"]);
    assert!(jittery.cautions.iter().any(|caution| caution.contains("lost for periods")), "{jittery}");
    let after = plan(
        "square",
        &[
            "flight.faults=[{ robot = \"robot_1\", at = 74.0, what = { kind = \"dead\" } }, \
         { robot = \"robot_2\", at = 500.0, what = { kind = \"dead\" } }]",
            "flight.commands=[{ after = 9999999, what = { kind = \"lead\", robot = \"robot_1\", to = [0.0, 0.0] } }]",
        ],
    );
    for key in
        ["at 75 s, and without effect: flight.faults[1].at = 500;", ": flight.commands[0].after = 9999999;"]
    {
        assert!(after.cautions.iter().any(|caution| caution.contains(key)), "{after}");
    }
    assert!(!jittery.to_string().contains("no robot will get a target"), "{jittery}");
}

/// The cautions of two robots that lead, with these leaders' programs and more.
fn cautions_of_two(programs: &str, more: &str) -> Vec<String> {
    let text = format!(
        "title = \"two\"\nradius = 0.2\nlinks = {{ kind = \"nearest\", count = 1 }}\n\
         robots = [{{ name = \"a\", place = [-1.0, 0.0] }}, {{ name = \"b\", place = [1.0, 0.0] }}]\n\
         leaders = [{{ robots = [\"a\", \"b\"], program = {{ {programs} }} }}]\nlimits = {{ speed = 20.0, clearance = 0.3 }}\n{more}"
    );
    planned(&text, &[]).cautions
}

#[test]
fn a_manoeuvre_is_warned_of_for_the_least_space_that_it_leaves_at_any_moment() {
    let cautions = |leg: &str| {
        cautions_of_two(
            "kind = \"manoeuvre\", name = \"m\"",
            &format!("manoeuvres = [{{ name = \"m\", legs = [{{ seconds = 60.0, {leg} }}] }}]\n"),
        )
    };
    // Through each other between two of a few looks, and past each other.
    for (leg, space) in [
        ("stretch = [-12.0, 1.0]", "-0.400"),
        ("stretch = [-0.83, 1.0], rotate = 90.0", "-0.400"),
        ("stretch = [-1.0, 1.0], shear = [0.0, 0.5]", "0.085"),
    ] {
        let found = cautions(leg);
        let words = format!("manoeuvre `m` leaves {space} m between `a` and `b`");
        assert!(matches!(&found[..], [one] if one.contains(&words)), "{leg}: {found:?}");
    }
    assert_eq!(cautions("rotate = 170.0"), [""; 0]);
}

#[test]
fn a_program_that_leaps_is_warned_of_whenever_it_does() {
    for at in [2.0, 100.0] {
        let path = |kind: &str| {
            format!(
                "kind = \"path\", interpolation = \"{kind}\", points = [{{ at = {at:?}, displacement = [5.0, 0.0] }}]"
            )
        };
        let found = cautions_of_two(&path("hold"), "");
        let words =
            "the program of leaders[0] leaps by up to 5.000 m, farther than limits.speed leads in a period";
        assert!(
            matches!(&found[..], [one] if one.contains(words) && one.contains("\"linear\"")),
            "{found:?}"
        );
        assert_eq!(cautions_of_two(&path("linear"), ""), [""; 0]);
    }
}

#[test]
fn a_robot_that_starts_where_no_pose_is_believed_is_warned_of() {
    let start = |x: f64| {
        let more = format!(
            "poses = {{ range = 20.0 }}\nflight = {{ start = [{{ robot = \"a\", place = [{x:?}, 0.0] }}] }}\n"
        );
        cautions_of_two("kind = \"external\"", &more)
    };
    let found = start(30.0);
    let words =
        "start farther than poses.range = 20 m from the formation's middle, where no pose is believed: `a`";
    assert!(matches!(&found[..], [one] if one.contains(words)), "{found:?}");
    assert_eq!(start(-19.0), [""; 0]);
}

#[test]
fn what_a_network_that_changes_and_commands_do_is_warned_of() {
    let channel = |noise: f64, delay: u32, loss: f64| {
        let what = format!("{{ kind = \"channel\", noise = {noise}, delay = {delay}, loss = {loss} }}");
        format!("flight.commands=[{{ after = 5, what = {what} }}]")
    };
    let lead = |to: &str| {
        format!(
            "flight.commands=[{{ after = 5, what = {{ kind = \"lead\", robot = \"robot_1\", to = {to} }} }}]"
        )
    };
    let fence = "limits.geofence=[[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]";
    let solid = |at: &str| format!("obstacles=[{{ kind = \"disc\", centre = {at}, radius = 1.0 }}]");
    let ranges = "ranges={ noise = 0.1, tolerance = 0.5 }";
    let fault = |until: &str| {
        format!("flight.faults=[{{ robot = \"robot_5\", at = 0.0, {until}what = {{ kind = \"silent\" }} }}]")
    };
    let two = "flight.faults=[{ robot = \"robot_1\", at = 2.0, until = 9.0, what = { kind = \"stuck\" } }, \
               { robot = \"robot_1\", at = 5.0, what = { kind = \"dead\" } }]";
    let cases: [(&[&str], &str); 10] = [
        (
            &[two],
            "`robot_1` has one fault at a time: flight.faults[1] hides flight.faults[0] while both last",
        ),
        (&[&channel(0.5, 0, 0.0)], "lower flight.commands[0].what.noise"),
        (&[&channel(0.0, 100, 0.0)], "lower flight.commands[0].what.delay"),
        (&[&channel(0.0, 0, 1.0)], "lower flight.commands[0].what.loss"),
        (
            &[ranges, "flight.noise=0.2"],
            "ranges.noise and flight.noise together, at three deviations 0.900 m",
        ),
        (&[&lead("[8.9, 0.0]"), fence], "flight.commands[0] leads `robot_1` out of limits.geofence"),
        (
            &[&lead("[-7.0, 0.0]"), &solid("[-7.0, 0.5]")],
            "flight.commands[0] leads `robot_1` into an obstacle",
        ),
        (&[&fault("")], "the leaders' programs will not begin, for these leaders are never heard: `robot_5`"),
        (
            &[
                &solid("[26.0, 6.0]"),
                "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 30.0, translate = [20.0, 0.0] }] }]",
            ],
            "programs end with these robots' places in an obstacle, before which they will stop: `robot_25`",
        ),
        (
            &[
                "poses.range=100.0",
                "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 500.0, translate = [120.0, 0.0] }] }]",
            ],
            "farther than poses.range = 100 m from the formation's middle, where no pose is believed: `robot_1`, ",
        ),
    ];
    for (set, words) in cases {
        let plan = plan("square", set);
        assert!(plan.cautions.iter().any(|caution| caution.contains(words)), "{words}: {plan}");
    }
    let late = &["flight.delay=4"];
    for quiet in [
        &[fault("until = 3.0, ").as_str()][..],
        &[ranges, "flight.noise=0.05"],
        &[&channel(0.01, 2, 0.5)],
        late,
    ] {
        assert_eq!(plan("square", quiet).cautions, Vec::<String>::new(), "{quiet:?}");
    }
}

/// The formation of `faulty-robot` in which every robot believes every other and none lies, led at 1 m/s.
fn steadily_led(delay: u32, limits: &str) -> Swarm {
    let text = bundled_swarm("faulty-robot").expect("bundled").text;
    let text = text.replace("[resilience]\nmax_faulty_neighbours = 1\n", "");
    let path = "leaders[0].program={ kind = \"path\", points = [{ at = 40.0, displacement = [40.0, 0.0] }] }";
    let delay = format!("flight.delay={delay}");
    parsed(&text, &[path, "flight.faults=[]", &delay, limits])
}

#[test]
fn a_steadily_led_formation_lags_as_its_plan_says_under_delay_too() {
    let slow = "limits={ speed = 2.0, acceleration = 2.0 }";
    for (delay, limits) in [(0, "limits={}"), (3, "limits={}"), (0, slow)] {
        let swarm = steadily_led(delay, limits);
        let margin = SwarmPlan::new(&swarm).expect("laid out").speed;
        let lag = margin.lag_s.expect("linear") + margin.lag_per_speed.unwrap_or(0.0);
        let mut flight = Flight::new(&swarm).expect("flies");
        let periods = (30.0 / swarm.raw.control.period) as usize;
        (0..periods).for_each(|_| flight.step());
        let (formation, places) = (flight.control().formation(), flight.fleet().places());
        let ways = (0..formation.count()).map(|m| places.get(m)[0] - formation.places.get(m)[0]);
        let (least, most) =
            ways.fold((f64::INFINITY, 0.0_f64), |(least, most), way| (least.min(way), most.max(way)));
        // At 1 m/s the way by which the last is behind, in metres, is the time in seconds.
        assert!(((most - least) / lag - 1.0).abs() < 1e-3, "delay {delay}: {} {lag}", most - least);
    }
}

#[test]
fn followers_and_short_ways_are_looked_at_for_where_programs_lead_too() {
    let set = |more: &str| {
        plan(
            "square",
            &[
                "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 20.0, translate = [10.0, 0.0] }] }]",
                "limits={ speed = 1.0, clearance = 0.1 }",
                more,
            ],
        )
        .cautions
    };
    // The middle of the square comes to (13, 3).
    let disc =
        |x: f64| set(&format!("obstacles=[{{ kind = \"disc\", centre = [{x:?}, 3.0], radius = 0.5 }}]"));
    let words =
        "programs end with these robots' places in an obstacle, before which they will stop: `robot_13`;";
    assert!(matches!(&disc(13.0)[..], [one] if one.contains(words)), "{:?}", disc(13.0));
    assert_eq!(disc(13.75), [""; 0]);
    let fence = |notch: f64| {
        let corners = format!(
            "[-9.0, -9.0], [29.0, -9.0], [29.0, 2.5], [{notch:?}, 2.5], [{notch:?}, 3.5], [29.0, 3.5], [29.0, 9.0], [-9.0, 9.0]"
        );
        set(&format!("limits.geofence=[{corners}]"))
    };
    let words = "programs lead these robots out of limits.geofence: `robot_23`;";
    assert!(matches!(&fence(16.1)[..], [one] if one.contains(words)), "{:?}", fence(16.1));
    assert_eq!(fence(16.3), [""; 0]);
    // Beyond the fence for some seconds of six thousand.
    let excursion = |x: f64| {
        let points = format!(
            "points = [{{ at = 26.0, displacement = [{x:?}, 0.0] }}, {{ at = 52.0, displacement = [0.0, 0.0] }}, \
             {{ at = 6000.0, displacement = [0.0, 0.0] }}]"
        );
        let path = format!("leaders[0].program={{ kind = \"path\", {points} }}");
        let fence = "limits.geofence=[[-9.0, -9.0], [12.0, -9.0], [12.0, 9.0], [-9.0, 9.0]]";
        plan("square", &[&path, fence]).cautions
    };
    let words = "programs lead these robots out of limits.geofence: `robot_21`, `robot_22`, ";
    assert!(matches!(&excursion(6.0)[..], [one] if one.contains(words)), "{:?}", excursion(6.0));
    assert_eq!(excursion(5.7), [""; 0]);
}

#[test]
fn a_program_that_begins_elsewhere_than_its_robot_is_warned_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("ways.csv");
    std::fs::write(&file, "t,dx,dy\n0,5,0\n9,6,0\n").expect("written");
    let begun = |start: &str| cautions_of_two(&format!("kind = \"file\", path = {file:?}"), start);
    let words = "the program of leaders[0] begins 5.000 m from where its robot starts, farther than limits.speed leads in a period: \
                 the robot will be on its way for a while; let it begin there";
    assert_eq!(begun(""), [words]);
    let start = "flight = { start = [{ robot = \"a\", place = [4.0, 0.0] }, { robot = \"b\", place = [6.0, 0.0] }] }\n";
    assert_eq!(begun(start), [""; 0]);
}

#[test]
fn nothing_is_predicted_of_a_loop_that_is_not_linear_and_the_plan_says_why() {
    let reason = |plan: &SwarmPlan| {
        let numbers = (plan.convergence, plan.noise.gain, plan.speed.lag_s, plan.delay.half_life_s);
        assert_eq!(numbers, (None, None, None, None), "{plan}");
        plan.not_predicted.expect("a reason")
    };
    let liar = plan("faulty-robot", &[]);
    assert!(reason(&liar).contains("straying"), "{liar}");
    assert!(liar.to_string().contains("straying"), "{liar}");
    let present = "title = \"two\"\nlinks = { kind = \"present\", radius = 3.0 }\nleaders = [\
                   { robots = [\"a\"], program = { kind = \"external\" } }]\n\
                   robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [1.0, 0.0] }]\n";
    assert!(reason(&planned(present, &[])).contains("anew"));
    let led = SwarmPlan::new(&steadily_led(0, "limits={}")).expect("laid out");
    assert_eq!((led.convergence.is_some(), led.not_predicted), (true, None));
}

#[test]
fn numbers_that_are_next_to_nothing_are_said_in_words() {
    let mut plan = plan("square", &[]);
    plan.convergence = Some(Convergence { factor: 7.9e-31, half_life_s: Some(0.1) });
    plan.noise.gain = Some(1e-9);
    let words = plan.to_string();
    assert!(words.contains("less than 0.001 is left") && words.contains("does not reach"), "{words}");
    assert!(!words.contains("e-31") && !words.contains("0.000 of"), "{words}");
}

#[test]
fn a_manoeuvre_needs_half_again_the_mean_speed_of_its_fastest_leg() {
    // The legs go by 3s^2 - 2s^3, whose steepest slope is 1.5.
    let straight = "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 4.0, translate = [8.0, 0.0] }] }]";
    let plan = plan("square", &[straight]);
    assert!((plan.speed.manoeuvres[0].needed - 3.0).abs() < 1e-3, "{plan}");
}

#[test]
fn solved_weights_follow_every_affine_motion_and_equal_ones_shifts_alone() {
    let exactness = |set: &[&str]| plan("square", set).exactness.expect("linear");
    let solved = exactness(&[]);
    assert_eq!(solved.exact, ["shift", "turn", "stretch", "shear"]);
    assert_eq!(solved.manoeuvres, [ManoeuvreError { name: "turn".into(), largest: 0.0 }]);
    // Along the rim each has its place by the two beside it alone, of five.
    let needed = solved.needed.as_ref().expect("exact");
    assert_eq!(needed.len(), 16, "{needed:?}");
    let by_first = &needed.iter().find(|one| one.name == "robot_1").expect("a corner").by;
    assert_eq!(by_first, &["robot_2", "robot_6"]);
    assert!(needed.iter().flat_map(|one| &one.by).all(|name| name != "robot_13"));
    let words = solved.in_words().join("; ");
    assert!(words.contains("but robot_10, robot_11, robot_15 and 9 more need one of robot_1, "), "{words}");
    let equal = exactness(&["rule={ rest = \"balanced\" }"]);
    assert_eq!((&equal.exact[..], &equal.needed), (&["shift"][..], &None));
    // By the flight itself, which is slow and swept to rest in every period.
    let slow = [
        "rule={ rest = \"balanced\" }",
        "limits={}",
        "flight.model={ kind = \"ideal\" }",
        "flight.bounds={}",
        "control.sweeps=20000",
    ];
    let swarm = bundled("square", &slow);
    let mut flight = Flight::new(&swarm).expect("laid out");
    let end = swarm.raw.flight.duration.expect("a duration");
    let mut flown: f64 = 0.0;
    while flight.fleet().time() < end {
        flight.step();
        let affine = flight.control().formation().affine(flight.fleet().time()).expect("a manoeuvre");
        let formation = flight.control().formation();
        let places = flight.fleet().places();
        let apart = |m: usize| distance(places.get(m), affine.apply(formation.places.get(m)));
        flown = (0..formation.count()).map(apart).fold(flown, f64::max);
    }
    let predicted = equal.manoeuvres[0].largest;
    assert!(predicted > 0.1 && (flown / predicted - 1.0).abs() < 0.02, "{flown} beside {predicted}");
}

#[test]
fn where_nothing_follows_nothing_is_said_of_followers() {
    let text = "title = \"one\"\nrobots = [{ name = \"a\", place = [0.0, 0.0] }]\n\
                links = { kind = \"nearest\", count = 1 }\n\
                leaders = [{ robots = [\"a\"], program = { kind = \"external\" } }]\n";
    let plan = planned(text, &[]);
    assert_eq!(plan.exactness, None);
    let words = plan.to_string();
    assert!(!words.contains("exact") && !words.contains("lost"), "{words}");
}

#[test]
fn followers_are_nowhere_on_the_way_farther_off_than_the_plan_says() {
    let turn = "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 70.0, rotate = 250.0 }] }]";
    let set = ["rule={ rest = \"balanced\" }", turn];
    let flight = Flight::new(&bundled("square", &set)).expect("laid out");
    let formation = flight.control().formation();
    let manoeuvre = formation.manoeuvre("turn", 0.0).expect("there");
    let off = |time: f64| {
        let affine = manoeuvre.affine(time);
        let places: Vectors = formation.places.iter().map(|place| affine.apply(place)).collect();
        let rest = formation.settled(&places).expect("linear");
        (0..places.len()).map(|m| distance(places.get(m), rest.get(m))).fold(0.0, f64::max)
    };
    // Half a turn from where they were.
    let farthest = (0..=40_000).map(|k| off(70.0 * f64::from(k) / 40_000.0)).fold(0.0, f64::max);
    let found = plan("square", &set).exactness.expect("linear").manoeuvres[0].largest;
    assert!((found / farthest - 1.0).abs() < 1e-7, "{found} beside {farthest}");
}
