//! Flights of the bundled swarms, and what they promise.

use std::ops::ControlFlow;

use flockform::flock::vectors::{Vectors, distance};
use flockform::scene::bundled::SWARMS;
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::Control;
use flockform::swarm::flight::{Flight, FlightReport, fly};
use flockform::swarm::plan::SwarmPlan;

use super::support::*;
use crate::folders::temporary;
use crate::swarms::load_swarm;

#[test]
fn every_bundled_swarm_keeps_the_bounds_that_it_declares() {
    for swarm in SWARMS {
        let swarm = load_swarm(swarm.name, &[]);
        let (_, report) = flown(&swarm);
        assert!(!report.bounds.is_empty(), "{} declares something", swarm.name);
        assert!(report.holds(), "{}: {:#?}", swarm.name, report.bounds);
    }
}

#[test]
fn an_affine_manoeuvre_is_followed_exactly_through_the_gap_at_every_moment() {
    for name in ["gap", "patch"] {
        let (record, report) = flown(&load_swarm(name, &[]));
        let (largest, _) = report.affine_error.expect("an affine manoeuvre");
        assert!(largest <= 1e-9, "{name}: {largest:e}");
        // It did go: the formation's middle is where the manoeuvre ends.
        let ends = [&record.tracks[0], record.tracks.last().expect("recorded")];
        let middle = |places: &Vectors| places.x.iter().sum::<f64>() / places.len() as f64;
        assert!((middle(ends[1]) - middle(ends[0]) - 24.0).abs() < 1e-9, "{name}");
        assert!(report.clearance.expect("others") >= 0.1);
    }
}

#[test]
fn without_solved_weights_the_edge_does_not_follow() {
    // The barycentre reproduces places in the interior alone: what the solved weights are for.
    let plain = load_swarm("gap", &["rule={}", "flight.duration=8.0"]);
    let (_, report) = flown(&plain);
    assert!(report.affine_error.is_some_and(|(most, _)| most > 0.1), "{:?}", report.affine_error);
    assert!(!report.holds());
}

#[test]
fn a_frame_makes_up_for_the_missing_neighbours_of_a_formation_that_is_moved_as_a_whole() {
    let overrides = [
        "rule={}",
        "frame=immediate",
        "leaders=[{ robots = [\"robot_1\", \"robot_10\", \"robot_91\", \"robot_100\"], program = { kind = \"manoeuvre\", name = \"through\" } }]",
        "obstacles=[]",
        "flight.duration=20.0",
        "flight.bounds={ final_error = 1e-6 }",
        "manoeuvres[0].legs=[{ seconds = 5.0, translate = [3.0, 1.0] }]",
    ];
    let (_, report) = flown(&load_swarm("gap", &overrides));
    assert!(report.holds(), "{:?}", report.bounds);
}

#[test]
fn a_hundred_robots_swap_places_across_a_circle_and_all_arrive() {
    let swarm = load_swarm("antipodal", &["flight.bounds={ clearance = 0.1, final_error = 0.01 }"]);
    let (_, report) = flown(&swarm);
    assert!(report.holds(), "{:?}", report.bounds);
}

#[test]
fn a_clearance_that_is_kept_holds_in_the_coordinates_of_a_map() {
    for angle in [0.3_f64, 0.81, 1.4] {
        let (x, y) = (2.0 * angle.cos(), 2.0 * angle.sin());
        let place = |sign: f64| [356_000.0 + sign * x, 9_150_000.0 + sign * y];
        let led = |sign: f64| {
            format!(
                "program = {{ kind = \"path\", points = [{{ at = 5.0, displacement = [{}, {}] }}] }}",
                -sign * x,
                -sign * y
            )
        };
        let text = format!(
            "title = \"Two robots sent to one place\"\nradius = 0.3\n\
             robots = [{{ name = \"a\", place = {:?} }}, {{ name = \"b\", place = {:?} }}]\n\
             links = {{ kind = \"nearest\", count = 1 }}\n\
             leaders = [{{ robots = [\"a\"], {} }}, {{ robots = [\"b\"], {} }}]\n\
             limits = {{ speed = 1.0, clearance = 0.3, acceleration = 1.0 }}\n\
             flight = {{ duration = 12.0, model = {{ kind = \"double-integrator\" }}, bounds = {{ clearance = 0.3 }} }}",
            place(-1.0),
            place(1.0),
            led(-1.0),
            led(1.0)
        );
        let swarm =
            Swarm::parse("map", "map.toml", &text, &[], None).unwrap_or_else(|error| panic!("{error}"));
        let (_, report) = flown(&swarm);
        assert!(report.holds(), "{angle}: {:?}", report.bounds);
        assert!(report.clearance.expect("two") < 0.31, "they meet");
    }
}

#[test]
fn the_same_seed_gives_the_same_flight_and_another_does_not() {
    let noisy = ["flight.noise=0.01", "flight.loss=0.2", "flight.delay=2", "flight.duration=5.0"];
    let places = |seed: &str| {
        let swarm = load_swarm("square", &[&noisy[..], &[seed]].concat());
        let (record, _) = flown(&swarm);
        record.tracks.last().expect("recorded").clone()
    };
    assert_eq!(places("flight.seed=3"), places("flight.seed=3"));
    assert_ne!(places("flight.seed=3"), places("flight.seed=4"));
}

#[test]
fn every_model_of_a_robot_brings_the_formation_home() {
    let models = [
        "{ kind = \"ideal\" }",
        "{ kind = \"integrator\" }",
        "{ kind = \"unicycle\", turn_rate = 180.0 }",
        "{ kind = \"double-integrator\" }",
    ];
    for model in models {
        let overrides = ["limits.acceleration=4.0".to_owned(), format!("flight.model={model}")];
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        let (_, report) = flown(&load_swarm("square", &overrides));
        let Some((_, Some(last))) = report.affine_error else { panic!("affine to the end") };
        assert!(last < 0.01, "{model}: {last}");
        assert!(report.clearance.expect("others") >= 0.3 - 1e-9, "{model}: {:?}", report.clearance);
    }
}

#[test]
fn unicycles_start_however_short_the_first_step_is_that_their_acceleration_allows() {
    // 0.1 mm in a period.
    let overrides = [
        "limits.acceleration=1.0",
        "control.period=0.01",
        "flight.model={ kind = \"unicycle\", turn_rate = 90.0 }",
        "flight.bounds={}",
        "flight.duration=14.0",
    ];
    let (_, report) = flown(&load_swarm("square", &overrides));
    assert!(report.way[0] > 2.0, "{:?}", report.way);
    let (largest, _) = report.affine_error.expect("affine");
    assert!(largest < 0.5, "{largest}");
}

#[test]
fn robots_whose_acceleration_is_limited_get_around_each_other() {
    // Detours begin at rest, where the straight way has no room at all.
    let angle = |k: u32| std::f64::consts::TAU * (f64::from(k) / 16.0 + 0.01);
    let robot = |k: u32| {
        let [x, y] = [4.0 * angle(k).cos(), 4.0 * angle(k).sin()];
        format!("{{ name = \"r{k}\", place = [{x:.6}, {y:.6}] }}")
    };
    let list = |one: &dyn Fn(u32) -> String| (0..16).map(one).collect::<Vec<_>>().join(", ");
    let crossing = |model: &str| {
        format!(
            "title = \"crossing\"\nradius = 0.2\nlinks = {{ kind = \"nearest\", count = 2 }}\nrobots = [{}]\n\
             control = {{ period = 0.1 }}\nlimits = {{ speed = 1.0, acceleration = 1.0, clearance = 0.1 }}\n\
             [[leaders]]\nrobots = [{}]\nprogram = {{ kind = \"manoeuvre\", name = \"swap\" }}\n\
             [[manoeuvres]]\nname = \"swap\"\nabout = [0.0, 0.0]\n\
             legs = [{{ seconds = 0.001, stretch = [-1.0, -1.0] }}]\n\
             [flight]\nduration = 120.0\nmodel = {{ kind = \"{model} }}\n",
            list(&robot),
            list(&|k| format!("\"r{k}\""))
        )
    };
    for model in ["integrator\"", "unicycle\", turn_rate = 90.0"] {
        let (_, report) = flown(&parse(&crossing(model)).unwrap_or_else(|error| panic!("{error}")));
        let Some((_, Some(last))) = report.affine_error else { panic!("affine to the end") };
        assert!(last < 0.01, "{model}: {last}");
        assert!(report.clearance.expect("others") >= 0.1 - 1e-9, "{model}: {:?}", report.clearance);
    }
}

/// Two robots in a row, the first led over 10 m in 20 s.
const ROW: &str = "title = \"row\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 1 }\n\
    robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [-1.5, 0.0] }]\n\
    limits = { speed = 1.0, acceleration = 1.0, clearance = 0.2 }\n[[leaders]]\nrobots = [\"a\"]\n\
    program = { kind = \"path\", points = [{ at = 20.0, displacement = [10.0, 0.0] }] }\n[flight]\nduration = 30.0\n";

/// Two late or noisy poses give no velocity: a limit of acceleration that took it from them held all robots in place.
#[test]
fn robots_whose_acceleration_is_limited_arrive_however_late_or_noisy_their_poses_are() {
    let models = ["ideal\"", "integrator\"", "unicycle\", turn_rate = 90.0"];
    for fault in ["delay = 1", "noise = 0.005", "jitter = 1", "loss = 0.3"] {
        for model in models {
            let text = format!("{ROW}{fault}\nmodel = {{ kind = \"{model} }}\n");
            let swarm = parse(&text).unwrap_or_else(|error| panic!("{text}: {error}"));
            let period = swarm.raw.control.period;
            let mut targets: Vec<f64> = Vec::new();
            let (record, report) = fly(&swarm, &mut |flight, _| {
                targets.extend(flight.control().target(0).map(|[x, _]| x));
                ControlFlow::Continue(())
            })
            .expect("flies");
            let end = record.tracks.last().expect("recorded").get(0);
            assert!(distance(end, [10.0, 0.0]) < 0.05, "{fault}, {model}: {end:?}");
            assert!(report.way[1] < 11.0, "{fault}, {model}: to and fro, {:?}", report.way);
            if fault.starts_with("delay") {
                let change = |three: &[f64]| ((three[2] - three[1]) - (three[1] - three[0])).abs();
                let most = targets.windows(3).map(change).fold(0.0, f64::max) / (period * period);
                assert!(most < 1.0 + 1e-6, "{fault}, {model}: targets that change by {most} m/s^2");
            }
        }
    }
}

#[test]
fn a_flight_whose_leader_or_whose_poses_never_arrive_has_no_final_error_that_holds() {
    let bound = "[flight.bounds]\nfinal_error = 0.05\n";
    // Too fast to follow; poses that are all lost, or too old when they come.
    let cases = [
        ("speed = 0.2", "", true),
        ("speed = 1.0", "loss = 1.0", false),
        ("speed = 1.0", "delay = 30", false),
    ];
    for (limit, fault, found) in cases {
        let text = format!("{ROW}{fault}\n{bound}").replace("speed = 1.0", limit);
        let swarm = parse(&text).unwrap_or_else(|error| panic!("{error}"));
        let (_, report) = flown(&swarm);
        let [verdict] = &report.bounds[..] else { panic!("{:?}", report.bounds) };
        assert!(!verdict.holds, "{fault}: {verdict:?}");
        assert_eq!(verdict.found.is_some(), found, "{fault}: {verdict:?}");
    }
}

#[test]
fn a_flight_that_ends_before_its_programs_neither_settles_nor_has_a_final_error() {
    let bounds = "[flight.bounds]\nfinal_error = 100.0\nsettling_time = 100.0\n";
    for (seconds, ended) in [(10.0, false), (19.9, false), (20.0, true), (30.0, true)] {
        let text = format!("{ROW}{bounds}").replace("duration = 30.0", &format!("duration = {seconds:?}"));
        let (_, report) = flown(&parse(&text).unwrap_or_else(|error| panic!("{error}")));
        let facts = report.facts(|number| number.to_string());
        let (_, settled) = facts.iter().find(|(name, _)| *name == "Settling time").expect("said");
        assert_eq!(settled.starts_with("not measured"), !ended, "{seconds} s: {settled}");
        assert_eq!(report.bounds.len(), 2);
        for verdict in &report.bounds {
            let is_measured = ended && (verdict.bound == "final_error" || report.settling_time.is_some());
            assert_eq!((verdict.holds, verdict.found.is_some()), (is_measured, is_measured), "{verdict:?}");
        }
    }
}

/// The end of programs that begin late, that a command ends, and of the program of a scene.
#[test]
fn a_formation_settles_from_when_the_programs_really_end() {
    let report = |text: &str, overrides: &[&str]| {
        let overrides: Vec<String> = overrides.iter().map(|&one| one.to_owned()).collect();
        flown(&Swarm::parse("late", "late.toml", text, &overrides, None).expect("a swarm")).1
    };
    let text = "title = \"late\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 2 }\nlimits = { speed = 2.0 }\n\
                robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [2.0, 0.0] }, \
                { name = \"c\", place = [4.0, 0.0] }, { name = \"x\", place = [9.0, 9.0] }]\n\
                leaders = [{ robots = [\"a\", \"c\"], program = { kind = \"manoeuvre\", name = \"m\" } }]\n\
                manoeuvres = [{ name = \"m\", legs = [{ seconds = 4.0, translate = [5.0, 0.0] }] }]\n\
                poses = { age_limit = 3.0, stop_after = 4.0 }\n[flight]\nduration = 30.0\nmodel = { kind = \"integrator\" }";
    let late = report(text, &["flight.faults=[{ robot = \"x\", at = 0.0, what = { kind = \"silent\" } }]"]);
    let heard = report(text, &[]);
    assert_eq!(late.programs_end.map(|end| end - heard.programs_end.expect("ends")), Some(5.0));
    // Everything else happens five seconds later.
    let settling = |report: &FlightReport| report.settling_time.expect("settles");
    assert!((settling(&late) - settling(&heard)).abs() < 1e-9, "{} {}", settling(&late), settling(&heard));

    let sent =
        "flight.commands=[{ after = 200, what = { kind = \"lead\", robot = \"a\", to = [7.0, 1.0] } }]";
    let sent = report(text, &[sent]);
    assert!((sent.programs_end.expect("ends") - 10.0).abs() < 1e-9 && settling(&sent) < 10.0, "{sent:?}");

    // The leaders of the scene pull until step 20, and follow from step 21 on.
    let scene = "title = \"bridge\"\nradius = 0.2\n[scene]\nname = \"tension\"\n[control]\nperiod = 0.1\n[flight]\nduration = ";
    let bounds = ["flight.bounds={ final_error = 50.0, settling_time = 30.0, settled_within = 50.0 }"];
    let pulling = report(&format!("{scene}1.0"), &bounds);
    assert!(!pulling.programs_ended && pulling.bounds.iter().all(|bound| !bound.holds), "{pulling:?}");
    let whole = report(&format!("{scene}4.0"), &bounds);
    assert!((whole.programs_end.expect("ends") - 2.1).abs() < 1e-9 && whole.holds(), "{whole:?}");

    // Leaders alone are where they are led to; behind a median no place is known.
    let alone = text.replace("\"a\", \"c\"]", "\"a\", \"b\", \"c\", \"x\"]");
    let alone = report(
        &alone,
        &["leaders[0].program={ kind = \"path\", points = [{ at = 1.0, displacement = [1.0, 0.0] }] }"],
    );
    assert_eq!(alone.formation_error.and_then(|(_, end)| end), Some(0.0), "{alone:?}");
    let path = "leaders[0].program={ kind = \"path\", points = [{ at = 1.0, displacement = [1.0, 0.0] }] }";
    let median = report(text, &[path, "rule.mean.kind=\"median\""]);
    let facts = median.facts(|number| number.to_string());
    let settled = facts.iter().find(|(name, _)| *name == "Settling time").expect("there");
    assert!(median.formation_error.is_none() && settled.1.starts_with("not measured"), "{settled:?}");
}

#[test]
fn robots_with_late_poses_go_as_fast_as_others() {
    for (delay, model) in [1, 4, 9].into_iter().flat_map(|delay| ["ideal", "integrator"].map(|m| (delay, m)))
    {
        let text = format!("{ROW}delay = {delay}\nmodel = {{ kind = \"{model}\" }}\n");
        let swarm = parse(&text).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(SwarmPlan::new(&swarm).expect("laid out").speed.reachable, Some(1.0));
        let (_, report) = flown(&swarm);
        // The leader's program goes at 0.5 m/s, the follower behind it.
        assert!((report.way[1] / 10.0 - 1.0).abs() < 0.03, "{delay} late: {:?}", report.way);
    }
}

#[test]
fn a_square_led_all_around_settles_at_its_rate_and_late_poses_only_slow_it() {
    // DESIGN: rho = cos(pi / (n + 1)) for n x n followers; x(k+1) = M x(k-d) takes it to the power 1/(d+1).
    let rate = (std::f64::consts::PI / 6.0).cos();
    for delay in [0, 1, 4] {
        let text = format!(
            "title = \"rate\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n\
             [body]\nshape = {{ kind = \"grid\", columns = 7, rows = 7 }}\n\
             [[leaders]]\nregion = {{ kind = \"boundary\" }}\nprogram = {{ kind = \"external\" }}\n\
             [control]\nperiod = 0.1\n[poses]\nfresh = 2.0\nage_limit = 2.0\nstop_after = 3.0\n\
             [flight]\ndelay = {delay}\n[[flight.start]]\nrobot = \"robot_25\"\nplace = [3.2, 2.9]\n"
        );
        let mut flight = Flight::new(&parse(&text).expect("valid")).expect("flies");
        let places = flight.fleet().places();
        let error = |flight: &Flight| {
            let now = flight.fleet().places();
            let home = flight.control().formation().places.clone();
            (0..places.len()).map(|m| distance(now.get(m), home.get(m)).powi(2)).sum::<f64>().sqrt()
        };
        let cycle = 2 * (delay + 1);
        (0..30 * cycle).for_each(|_| flight.step());
        let before = error(&flight);
        (0..10 * cycle).for_each(|_| flight.step());
        // Ten cycles of two sweeps each.
        let found = (error(&flight) / before).powf(1.0 / 20.0);
        assert!((found - rate).abs() < 1e-6, "delay {delay}: {found}, not {rate}");
    }
}

/// Two robots that nothing keeps apart change places head on, half a metre beside each other.
const HEAD_ON: &str = "title = \"head on\"\nradius = 0.1\n\
    [[robots]]\nname = \"left\"\nplace = [-2.0, 0.0]\n[[robots]]\nname = \"right\"\nplace = [2.0, 0.5]\n\
    [[robots]]\nname = \"far\"\nplace = [0.0, 9.0]\n[links]\nkind = \"nearest\"\ncount = 1\n\
    [[leaders]]\nrobots = [\"left\"]\nprogram = { kind = \"path\", points = [{ at = 4.0, displacement = [4.0, 0.0] }] }\n\
    [[leaders]]\nrobots = [\"right\"]\nprogram = { kind = \"path\", points = [{ at = 4.0, displacement = [-4.0, 0.0] }] }\n\
    [[leaders]]\nrobots = [\"far\"]\nprogram = { kind = \"path\", points = [{ at = 4.0, displacement = [0.0, 1.0] }] }\n\
    [flight]\nduration = 5.0\n[flight.bounds]\nclearance = 0.4\n";

/// Of which a period's way is less than what is called noise otherwise.
#[test]
fn unicycles_move_however_little_they_go_in_a_period() {
    for (speed, period) in [(0.02, 0.05), (0.45, 0.002)] {
        let text = format!(
            "title = \"slow\"\nradius = 0.2\nlinks = {{ kind = \"nearest\", count = 1 }}\n\
             robots = [{{ name = \"a\", place = [0.0, 0.0] }}, {{ name = \"b\", place = [0.0, 2.0] }}]\n\
             leaders = [{{ robots = [\"a\"], program = {{ kind = \"path\", points = [{{ at = 1.0, displacement = [3.0, 0.0] }}] }} }}]\n\
             limits = {{ speed = {speed:?}, clearance = 0.3 }}\ncontrol = {{ period = {period:?} }}\n\
             flight = {{ duration = 4.0, model = {{ kind = \"unicycle\", turn_rate = 90.0 }}, record_every = 50 }}\n"
        );
        let (_, report) = flown(&parse(&text).expect("valid"));
        assert!(report.per_robot[0].x > 0.8 * 4.0 * speed - 1.0 * speed, "{:?}", report.per_robot[0]);
    }
}

/// What is declared as it was reported would else be broken by its last digit.
#[test]
fn rounding_breaks_no_bound() {
    let bounds = |settling: f64| {
        let declared = format!("flight.bounds={{ settled_within = 0.001, settling_time = {settling:?} }}");
        let led = "manoeuvres=[{ name = \"turn\", legs = [{ seconds = 2.0, translate = [1.0, 0.5] }] }]";
        let more = [declared.as_str(), led, "control.sweeps=1", "flight.duration=6.0"];
        flown(&load_swarm("square", &more)).1.bounds
    };
    let found = bounds(9.0)[0].found.expect("it settles");
    assert!(found > 0.0, "{found}");
    assert!(bounds(found * (1.0 - 1e-12))[0].holds);
    assert!(!bounds(found * (1.0 - 1e-6))[0].holds);
}

#[test]
fn a_flight_that_is_broken_off_has_the_places_of_its_end() {
    let swarm = load_swarm("square", &["flight.record_every=5"]);
    let mut places = None;
    let (record, report) = fly(&swarm, &mut |flight, _| {
        places = Some(flight.fleet().places());
        if flight.fleet().period() == 7 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
    .expect("flies");
    assert_eq!((record.times.len(), record.times.last()), (3, Some(&report.seconds)));
    assert_eq!(record.tracks.last(), places.as_ref());
}

/// Each is as near to its own disc as the other to the other's.
#[test]
fn robots_far_from_each_other_are_not_named_as_close() {
    let text = "title = \"t\"\nradius = 0.2\nlinks = { kind = \"listed\" }\nlimits = { speed = 1.0, clearance = 0.2 }\n\
         robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [100.0, 0.0] }]\n\
         leaders = [{ robots = [\"a\", \"b\"], program = { kind = \"external\" } }]\n\
         obstacles = [{ kind = \"disc\", centre = [1.0, 0.0], radius = 0.3 }, { kind = \"disc\", centre = [101.0, 0.0], radius = 0.3 }]\n\
         flight = { duration = 1.0 }\n";
    let (_, report) = flown(&parse(text).expect("valid"));
    let closest = report.closest.expect("near discs");
    assert_eq!((closest.robots, closest.x), (vec!["a".to_owned()], 0.0));
}

#[test]
fn a_broken_bound_names_the_robots_the_time_and_the_place() {
    let swarm = parse(HEAD_ON).expect("valid");
    let (record, report) = flown(&swarm);
    assert!(!report.holds());
    let [verdict] = &report.bounds[..] else { panic!("{:?}", report.bounds) };
    let moment = verdict.worst.as_ref().expect("it was measured");
    assert_eq!(report.closest.as_ref(), Some(moment));
    assert_eq!(moment.robots, ["left", "right"]);
    // They pass each other half way, at half time, within the period.
    assert!((moment.time - 2.0).abs() <= 0.051, "{moment:?}");
    assert!(moment.x.abs() < 0.1 && (moment.y - 0.25).abs() < 1e-9, "{moment:?}");
    assert!((report.clearance.expect("others") - 0.3).abs() < 1e-9, "{:?}", report.clearance);
    let words = verdict.complaint().expect("broken");
    assert!(words.contains("left and right at 2.") && words.contains("near ("), "{words}");
    let json = serde_json::json!(report);
    assert_eq!(json["bounds"][0]["worst"]["robots"][1], "right");
    assert_eq!(json["closest"]["time"], moment.time);

    let folder = temporary();
    let out = flockform::export::OutputFolder::create(&folder.path().join("out"), false).expect("new");
    flockform::export::flight::write_flight(&out, &swarm, &record, &report).expect("written");
    let figure = std::fs::read_to_string(out.path("errors.svg")).expect("the figure");
    assert!(figure.contains("declared clearance"), "the bound has a line in the chart");
    let mut recorder = flockform::export::report::FlightRecorder::new(&Flight::new(&swarm).expect("flies"));
    let stage = recorder.stage(&swarm, &report);
    let page =
        flockform::export::report::flight::write(&out, &swarm, &record, &report, stage).expect("written");
    let html = std::fs::read_to_string(page).expect("the page");
    let button = format!("<button type=\"button\" data-seek=\"{}\">", moment.time);
    assert!(html.contains(&button), "a click leads to the moment");
}

/// A step that is too long for its waves makes a material diverge.
#[test]
fn a_lattice_of_robots_takes_the_steps_that_its_rule_can_bear() {
    for (rule, most) in [("barycentre", 1.0), ("distance", 0.5), ("material", 0.95)] {
        let mean = format!("rule={{mean={{kind=\"{rule}\"}}}}");
        let elastic = "material={kind=\"isotropic\",young=1.0,poisson=0.3}";
        let sets = if rule == "material" { vec![&mean[..], elastic] } else { vec![&mean[..]] };
        let damping = Control::new(&load_swarm("square", &sets)).expect("laid out").damping();
        assert!(damping <= most && damping > 0.4, "{rule}: {damping}");
    }
}

/// Each step from a noisy pose lost what noise put that back by, and a unicycle turned after it: with 5 mm it went at a sixth of its speed.
#[test]
fn declared_noise_slows_no_robot_and_leads_none_aside() {
    for (model, noise, least, most_aside) in [
        ("{ kind = \"integrator\" }", 0.02, 7.3, 0.05),
        ("{ kind = \"integrator\" }", 0.05, 7.3, 0.12),
        ("{ kind = \"unicycle\", turn_rate = 90.0 }", 0.005, 7.2, 0.02),
        ("{ kind = \"unicycle\", turn_rate = 90.0 }", 0.02, 7.2, 0.05),
    ] {
        for (delay, limit) in
            [0, 3].into_iter().flat_map(|delay| ["", "acceleration = 1.0, "].map(|limit| (delay, limit)))
        {
            let text = format!(
                "title = \"One goes 10 m\"
                radius = 0.2
                robots = [{{ name = \"a\", place = [0.0, 0.0] }}, {{ name = \"b\", place = [0.0, 50.0] }}]
                links = {{ kind = \"nearest\", count = 1 }}
                leaders = [{{ robots = [\"a\", \"b\"], program = {{ kind = \"path\", points = [{{ at = 1.0, displacement = [10.0, 0.0] }}] }} }}]
                limits = {{ speed = 0.5, {limit}clearance = 0.1 }}
                control = {{ period = 0.05 }}
                flight = {{ model = {model}, noise = {noise}, delay = {delay} }}"
            );
            let mut flight =
                Flight::new(&parse(&text).unwrap_or_else(|error| panic!("{error}"))).expect("laid out");
            let mut aside = 0.0_f64;
            while flight.fleet().time() < 15.0 {
                flight.step();
                aside = aside.max(flight.fleet().places().get(0)[1].abs());
            }
            let [along, _] = flight.fleet().places().get(0);
            let flight = format!("{model}, {noise} m, {delay}, {limit}");
            let least = if limit.is_empty() { least } else { least - 0.15 };
            assert!(along > least && along < 7.6, "{flight}: {along} m in 15 s");
            assert!(aside < most_aside, "{flight}: {aside} m aside");
        }
    }
}

/// A follower is where the rule has it while the leaders are heard, and nowhere in particular once one is lost for good.
#[test]
fn where_a_lost_leader_leaves_no_place_none_is_blamed_for_not_being_there() {
    let swarm = parse(
        r#"
title = "a leader dies"
radius = 0.1
links = { kind = "nearest", count = 3 }
robots = [
    { name = "a", place = [0.0, 0.0] }, { name = "b", place = [2.0, 0.0] },
    { name = "c", place = [1.0, 1.0] }, { name = "d", place = [1.0, 2.0] },
]
leaders = [
    { robots = ["a"], program = { kind = "path", points = [{ at = 5.0, displacement = [2.0, 0.0] }] } },
    { robots = ["b"], program = { kind = "path", points = [{ at = 5.0, displacement = [3.0, 1.0] }] } },
]
limits = { speed = 1.0, clearance = 0.2 }
flight = { duration = 12.0, model = { kind = "integrator" }, bounds = { settling_time = 4.0 }, faults = [{ robot = "b", at = 7.0, what = { kind = "dead" } }] }
"#,
    )
    .expect("a swarm");
    let (_, report) = flown(&swarm);
    let facts = report.facts(|number| number.to_string());
    let of = |name: &str| facts.iter().find(|(known, _)| *known == name).expect("said").1.clone();
    assert!(
        of("Settling time").starts_with("not measured: where the robots belong is not known"),
        "{facts:?}"
    );
    assert!(of("From where the rule comes to rest").ends_with("which it is not at the end"), "{facts:?}");
    let complaint = report.bounds.iter().find_map(|verdict| verdict.complaint()).expect("not kept");
    assert!(complaint.ends_with("found not measured"), "{complaint}");
}
