//! The lag and the reachable speed against flights.

use super::*;
use crate::swarm::flight::Record;

/// 180 followers and more, too many for a map.
const MANY: [&str; 2] = [
    "body.shape={ kind = \"grid\", columns = 15, rows = 15 }",
    "leaders[0].region={ kind = \"edge\", side = \"left\" }",
];

/// The largest error of a flight by the leaders' program whose steepest speed is this \[m/s\], over its bound of 0.2 m.
fn error_at(speed: f64, set: &[&str]) -> f64 {
    let seconds = 40.0;
    let way = speed * seconds / 1.5;
    let legs = format!(
        "manoeuvres=[{{ name = \"on\", legs = [{{ seconds = {seconds:?}, translate = [{way:?}, 0.0] }}] }}]"
    );
    let swarm = led_on(&[set, &[&legs]].concat());
    let mut flight = Flight::new(&swarm).expect("flies");
    let mut record = Record::new(&swarm, &flight);
    while flight.fleet().time() < 0.6 * seconds {
        let before = flight.fleet().places();
        flight.step();
        record.take(&flight, &before);
    }
    let errors = record.samples.iter().filter_map(|sample| sample.affine_error);
    errors.fold(0.0, f64::max) / 0.2
}

/// The formation of `faulty-robot` without faults, all of whose leaders fly one manoeuvre.
fn led_on(set: &[&str]) -> Swarm {
    let text = bundled_swarm("faulty-robot").expect("bundled").text;
    let text = text.replace("[resilience]\nmax_faulty_neighbours = 1\n", "");
    let first = [
        "leaders[0].program={ kind = \"manoeuvre\", name = \"on\" }",
        "manoeuvres=[{ name = \"on\", legs = [{ seconds = 40.0, translate = [1.0, 0.0] }] }]",
        "flight.faults=[]",
        "flight.bounds={ affine_error = 0.2 }",
    ];
    parsed(&text, &[&first[..], set].concat())
}

#[test]
fn at_the_reachable_speed_a_formation_is_as_far_from_its_places_as_the_bound_lets_it() {
    let [integrator, double] =
        ["integrator", "double-integrator"].map(|kind| format!("flight.model={{ kind = \"{kind}\" }}"));
    let late = "flight.delay=3";
    let limits = |most: f64| format!("limits={{ speed = 3.0, acceleration = {most:?} }}");
    // The last is so strong that robots at the speed are at rest in a period.
    let [weak, firm, strong] = [0.3, 2.0, 20.0].map(limits);
    let cases: [&[&str]; 7] = [
        &[],
        &[late],
        &[&integrator, &weak],
        &[&integrator, &firm, "control.sweeps=400"],
        &[&double, &weak],
        &[&double, &firm, "control.sweeps=400"],
        &[&double, &strong],
    ];
    for set in cases {
        let plan = SwarmPlan::new(&led_on(set)).expect("laid out");
        let reachable = plan.speed.reachable.expect("bounded");
        let error = error_at(reachable, set);
        assert!((0.97..1.005).contains(&error), "{set:?}: {error} of the bound at {reachable} m/s");
        if set.contains(&&strong[..]) {
            let lag = plan.speed.lag_s.expect("linear") + plan.speed.least_braking_lag_s.expect("brakes");
            let behind = (lag + 0.5 * plan.period_s) * reachable;
            assert!((behind / 0.2 - 1.0).abs() < 1e-9, "{behind} m at {reachable} m/s");
        }
    }
}

#[test]
fn a_lag_that_is_steady_when_led_is_that_of_the_map_and_one_of_many_robots_is_known() {
    for set in [&["control.sweeps=1"][..], &["control.sweeps=7"]] {
        let swarm = led_on(set);
        let plan = SwarmPlan::new(&swarm).expect("laid out");
        let flight = Flight::new(&swarm).expect("laid out");
        let factor = plan.convergence.expect("linear").factor;
        let led =
            lag_when_led((flight.control().formation(), plan.sweeps), [true; 2], factor, 0).expect("short");
        let lag = plan.speed.lag_s.expect("linear") / plan.period_s;
        assert!((led / lag - 1.0).abs() < 1e-5, "{led} {lag}");
    }
    // And 9 followers in a frame.
    let many = [&MANY[..], &["control.sweeps=10"]].concat();
    for set in [&many[..], &["frame=\"immediate\""]] {
        let speed = SwarmPlan::new(&led_on(set)).expect("laid out").speed;
        let (lag, reachable) = (speed.lag_s.expect("linear"), speed.reachable.expect("bounded"));
        assert!((lag * reachable - 0.2).abs() < 1e-6, "{speed:?}");
        let error = error_at(reachable, set);
        assert!((0.9..1.005).contains(&error), "{set:?}: {error} of the bound at {reachable} m/s");
    }
}

#[test]
fn followers_whose_disturbances_grow_have_no_lag_however_few_they_are() {
    let grows = "rule={ feedback = { factor = 0.5 } }";
    // 132 followers.
    let few = ["body.shape={ kind = \"grid\", columns = 12, rows = 12 }", MANY[1]];
    for set in [few, MANY].map(|set| [&[grows], &set[..]].concat()) {
        let plan = SwarmPlan::new(&led_on(&set)).expect("laid out");
        assert!(plan.convergence.expect("linear").factor > 1.0, "{plan}");
        let SpeedMargin { lag_s, lag_not_known, reachable, .. } = plan.speed;
        assert_eq!((lag_s, lag_not_known, reachable), (None, Some(NEVER_STEADY), None), "{set:?}");
    }
}

#[test]
fn followers_that_do_not_keep_to_a_shift_have_neither_lag_nor_reachable_speed() {
    let initial = "rule.feedback={ factor = -0.3, reference = \"initial\" }";
    let poisson = |axis: &str| format!("rule.poisson={{ k = 0.3, axis = \"{axis}\" }}");
    let [x, y] = ["x", "y"].map(poisson);
    let legs = |way: &str| format!("manoeuvres=[{{ name = \"on\", legs = [{{ seconds = 40.0, {way} }}] }}]");
    let [across, turned] = ["translate = [0.0, 1.0]", "rotate = 5.0"].map(legs);
    let path = "leaders[0].program={ kind = \"path\", points = [{ at = 40.0, displacement = [1.0, 0.0] }] }";
    let many = [&MANY[..], &[initial]].concat();
    let led = [&*y, path, "flight.bounds={}"];
    let cases: [&[&str]; 6] = [&[initial], &many, &[&x], &[&y, &across], &[&y, &turned], &led];
    for set in cases {
        let plan = SwarmPlan::new(&led_on(set)).expect("laid out");
        let SpeedMargin { lag_s, lag_not_known, reachable, bound, .. } = plan.speed;
        assert_eq!((lag_s, lag_not_known), (None, Some(NOT_KEPT)), "{set:?}");
        assert!(bound.is_none() || reachable.is_none(), "{set:?}");
        let words = plan.to_string();
        assert!(
            words.contains("lag               not computed: followers do not keep to a shift of"),
            "{words}"
        );
    }
    // Behind leaders that go the way that the term does not look at they keep to it.
    for set in [&[&*y][..], &[&x, &across]] {
        let speed = SwarmPlan::new(&led_on(set)).expect("laid out").speed;
        let without = SwarmPlan::new(&led_on(&[])).expect("laid out").speed;
        assert!(
            (speed.lag_s.expect("known") / without.lag_s.expect("known") - 1.0).abs() < 1e-9,
            "{speed:?}"
        );
    }
    // However far from the origin.
    let [min, max] = [0.0, 6.0].map(|by| format!("[{:?}, {:?}]", 5e6 + by, 1e6 + by));
    let far = format!("body.shape={{ kind = \"rectangle\", min = {min}, max = {max} }}");
    let far = [&far[..], "poses.range=1e8"];
    assert!(SwarmPlan::new(&led_on(&far)).expect("laid out").speed.lag_s.is_some());
}

#[test]
fn the_memory_of_a_frame_is_not_delayed_with_the_poses() {
    let set = ["frame=\"lagged\"", "flight.delay=2", MANY[1], "control.sweeps=10"];
    let reachable = SwarmPlan::new(&led_on(&set)).expect("laid out").speed.reachable.expect("bounded");
    let error = error_at(reachable, &set);
    assert!((0.98..1.005).contains(&error), "{error} of the bound at {reachable} m/s");
}

#[test]
fn a_lag_that_would_take_long_to_compute_is_left_out() {
    let long = [&MANY[..], &["control.sweeps=100000"]].concat();
    let plan = SwarmPlan::new(&led_on(&long)).expect("laid out");
    assert_eq!((plan.speed.lag_s, plan.speed.reachable), (None, None), "{plan}");
    let words = "lag               not computed: it would take long to compute for so many robots";
    assert!(plan.to_string().contains(words), "{plan}");
}

#[test]
fn where_no_lag_is_known_a_bound_has_no_reachable_speed_and_the_plan_says_why() {
    let liars = ["resilience={ max_faulty_neighbours = 1 }", "limits={ speed = 3.0 }"];
    let plan = SwarmPlan::new(&led_on(&liars)).expect("laid out");
    assert_eq!(plan.speed.reachable, None, "{plan}");
    let words = plan.to_string();
    for line in ["lag               not computed: robots leave", "reachable speed   not computed, as the lag"]
    {
        assert!(words.contains(line), "{words}");
    }
    // Leaders alone are behind their program by the way in which they brake.
    let text = "title = \"two\"\nlinks = { kind = \"nearest\", count = 1 }\nleaders = [\
                { robots = [\"a\", \"b\"], program = { kind = \"manoeuvre\", name = \"m\" } }]\n\
                robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [1.0, 0.0] }]\n\
                manoeuvres = [{ name = \"m\", legs = [{ seconds = 9.0, translate = [9.0, 0.0] }] }]\n\
                limits = { speed = 3.0, acceleration = 0.5 }\nflight = { bounds = { affine_error = 0.09 } }\n";
    let plan = planned(text, &[]);
    assert!((plan.speed.reachable.expect("bounded") - 0.3).abs() < 1e-9, "{plan}");
    let words = "manoeuvre `m` moves a robot's place at up to 1.500 m/s, and steadily led robots are within \
                 flight.bounds.affine_error = 0.09 m of their places up to 0.300 m/s";
    assert!(plan.cautions.iter().any(|one| one.contains(words)), "{plan}");
    let is_beyond = |legs: &str| {
        let plan = planned(text, &[&format!("manoeuvres=[{{ name = \"m\", legs = [{legs}] }}]")]);
        plan.cautions.iter().any(|one| one.contains("affine_error"))
    };
    // A way that is over before they are that far behind, alone and before a slow one.
    let brief = "{ seconds = 0.1, translate = [0.05, 0.0] }";
    assert!(!is_beyond(brief));
    assert!(!is_beyond(&format!("{brief}, {{ seconds = 100.0, translate = [1.0, 0.0] }}")));
    let long = "{ seconds = 100.0, translate = [200.0, 0.0] }";
    assert!(is_beyond(&format!("{long}, {{ seconds = 0.01, translate = [200.0, 0.0] }}")));
    // Of legs that end in one place the second begins where the first ends.
    assert!(!is_beyond(&format!("{brief}, {{ seconds = 0.3, hold = 9.0, translate = [0.05, 0.0] }}")));
    // 6 * 9 / 9^2 m/s^2 as the leg begins.
    assert!((plan.speed.manoeuvres[0].acceleration - 6.0 / 9.0).abs() < 1e-9, "{plan}");
    let words =
        "manoeuvre `m` accelerates a robot's place at up to 0.667 m/s^2, above limits.acceleration: robots";
    assert!(plan.cautions.iter().any(|one| one.contains(words)), "{plan}");
    assert!(plan.to_string().contains("1.500 m/s, accelerating at up to 0.667 m/s^2"), "{plan}");
}
