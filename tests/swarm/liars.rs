//! Robots that are not where they say, or are lost: what the honest ones do, and that every bound among them holds.

use flockform::flock::vectors::distance;
use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::Flight;
use flockform::swarm::safety::Flags;
use flockform::swarm::watch::Pose;

use super::support::*;
use crate::swarms::load_swarm;

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
        fly_on(&mut flight, 1200);
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
        fly_on(&mut flight, 600);
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
