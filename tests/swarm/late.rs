//! Poses that are late: the places to which robots were sent since say where these are.

use flockform::flock::vectors::distance;
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::scope::NodeScope;
use flockform::swarm::control::{Control, Mode};
use flockform::swarm::robots::{DoubleIntegrator, Model, Robot};
use flockform::swarm::safety::Limits;
use flockform::swarm::watch::Pose;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::support::*;
use super::swarms::load_swarm;

const PERIOD: f64 = 0.1;
const ROBOTS: usize = 8;

/// Robots on a circle that all lead.
fn circle(model: &str) -> Swarm {
    circle_with(model, &[])
}

fn circle_with(model: &str, sets: &[String]) -> Swarm {
    let place = |k: usize| {
        let angle = k as f64 / ROBOTS as f64 * std::f64::consts::TAU;
        format!("{{ name = \"r{k}\", place = [{:?}, {:?}] }}", 2.5 * angle.cos(), 2.5 * angle.sin())
    };
    let names: Vec<String> = (0..ROBOTS).map(|k| format!("\"r{k}\"")).collect();
    let text = format!(
        "title = \"circle\"\nradius = 0.15\nlinks = {{ kind = \"nearest\", count = 1 }}\nrobots = [{}]\n\
         leaders = [{{ robots = [{}], program = {{ kind = \"external\" }} }}]\n\
         limits = {{ speed = 1.0, clearance = 0.1 }}\ncontrol = {{ period = {PERIOD} }}\nposes = {{ fresh = 1.0, age_limit = 1.0 }}\nflight = {{ model = {{ kind = \"{model} }} }}\n",
        (0..ROBOTS).map(place).collect::<Vec<_>>().join(", "),
        names.join(", ")
    );
    Swarm::parse("circle", "circle.toml", &text, sets, None).expect("a swarm")
}

/// One loop for all robots, or one for each.
fn loops(swarm: &Swarm, alone: bool) -> Vec<Control> {
    let control = || Control::new(swarm).expect("laid out");
    let own = |k: usize| {
        let mut control = control();
        NodeScope::take(swarm, &mut control, Some(&format!("r{k}"))).expect("can be flown alone");
        control
    };
    if alone { (0..ROBOTS).map(own).collect() } else { vec![control()] }
}

/// Poses of this time: the first robot's, and of the others their places.
fn hear(control: &mut Control, first: [f64; 2], stamp: f64, now: f64) {
    let places = control.formation().places.clone();
    for (k, place) in places.iter().enumerate() {
        let position = if k == 0 { first } else { place };
        control.receive(k, Pose { position, yaw: 0.0, stamp, frame_is_right: true }, now).expect("a pose");
    }
}

/// Whatever the pace at which robots go straight to their targets, some of them not at all for a while, and whether a command
/// is there at once or a period later.
#[test]
fn robots_of_any_pace_keep_clear_behind_late_poses_and_commands() {
    let mut met = [f64::INFINITY; 2];
    for seed in 0..48 {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let (delay, late, alone) = ([1, 3, 6][seed as usize % 3], seed as usize / 3 % 2, seed as usize / 24);
        let swarm = circle(["integrator\"", "unicycle\", turn_rate = 90.0"][seed as usize % 2]);
        let mut controls = loops(&swarm, alone == 1);
        let places = controls[0].formation().places.clone();
        for k in 0..ROBOTS {
            let [x, y] = places.get(k);
            let shaken = |x: f64, random: &mut Pcg64Mcg| -x + random.random_range(-0.5..0.5);
            let goal = [shaken(x, &mut random), shaken(y, &mut random)];
            controls.iter_mut().for_each(|control| assert!(control.place_leader(k, goal)));
        }
        let mut poses = vec![places; 1];
        let mut sent: Vec<Vec<Option<[f64; 2]>>> = Vec::new();
        for tick in 0usize..300 {
            let now = tick as f64 * PERIOD;
            if let Some(old) = tick.checked_sub(delay) {
                for k in 0..ROBOTS {
                    let stamp = old as f64 * PERIOD;
                    let pose = Pose { position: poses[old].get(k), yaw: 0.0, stamp, frame_is_right: true };
                    controls.iter_mut().for_each(|control| control.receive(k, pose, now).expect("a pose"));
                }
            }
            controls.iter_mut().for_each(|control| control.tick(now));
            sent.push((0..ROBOTS).map(|k| controls[k.min(controls.len() - 1)].target(k)).collect());
            let mut next = poses[tick].clone();
            let due = tick.checked_sub(late).map_or(vec![None; ROBOTS], |then| sent[then].clone());
            for (k, target) in due.into_iter().enumerate() {
                // Of each ten periods one stands in one, another in the next one.
                let stands = (tick / 10) % ROBOTS == k;
                let pace: f64 = if stands { 0.0 } else { random.random_range(0.3..1.0) };
                let Some(target) = target else { continue };
                let here = next.get(k);
                let way = distance(here, target);
                let share = if way > 0.0 { (pace * PERIOD / way).min(1.0) } else { 0.0 };
                next.set(k, [0, 1].map(|axis| here[axis] + share * (target[axis] - here[axis])));
            }
            for (a, b) in (0..ROBOTS).flat_map(|a| (0..a).map(move |b| (a, b))) {
                let gap = distance(next.get(a), next.get(b)) - 0.3;
                assert!(gap >= 0.1 - 1e-9, "seed {seed}, tick {tick}: r{a} and r{b} {gap} m apart");
                met[alone] = met[alone].min(gap);
            }
            poses.push(next);
        }
        let [begin, end] = [0, 300].map(|tick| poses[tick].get(0));
        // Between robots of several loops ages count, behind which they stand sooner.
        assert!(alone == 1 || distance(begin, end) > 2.0, "seed {seed}: it stays near {begin:?}");
    }
    assert!(met[0] < 0.12 && met[1] < 0.5, "they met: {met:?}");
}

/// Discs that grow with the ages of poses filled the gap, and the robots stood before it, or wandered.
#[test]
fn swarms_with_late_poses_fly_as_others_do() {
    for (swarm, delay, most) in [("square", 8, 0.1), ("gap", 3, 0.6)] {
        let model = "flight.model={ kind = \"integrator\" }";
        let (_, report) = flown(&load_swarm(swarm, &[&format!("flight.delay={delay}"), model]));
        let Some((largest, Some(last))) = report.formation_error else { panic!("measured to the end") };
        assert!(largest < most && last < 1e-6, "{swarm}: {largest} m, {last} m");
    }
}

/// A robot that moves just when its next target comes has none, one or two of them between two poses, by chance.
#[test]
fn a_robot_in_step_with_its_loop_is_led_at_its_pace() {
    for (phase, shake) in
        [(0.02, 0.0), (0.08, 0.0), (0.002, 0.006), (0.002, 0.02), (0.098, 0.006), (0.05, 0.04)]
    {
        let swarm = circle_with("integrator\"", &["limits.acceleration=1.0".to_owned()]);
        let mut control = Control::new(&swarm).expect("laid out");
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let places: Vec<[f64; 2]> = control.formation().places.iter().collect();
        let (mut here, mut moved, mut sent) = (places[0], 0.0, vec![places[0]; 3]);
        let mut steps =
            (0..).map(|k| PERIOD * (f64::from(k) - 1.0) + phase + random.random_range(-1.0..1.0) * shake);
        let mut next = steps.next().expect("endless");
        let (mut strong, mut back) = (0, 0);
        for tick in 0..150 {
            let now = f64::from(tick) * PERIOD;
            while next <= now {
                // It goes on to its last target at its own pace.
                let (goal, way) =
                    (*sent.last().expect("there"), distance(here, *sent.last().expect("there")));
                let share = if way > 0.0 { ((next - moved) / way).clamp(0.0, 1.0) } else { 0.0 };
                here = [0, 1].map(|axis| here[axis] + share * (goal[axis] - here[axis]));
                let pose = Pose { position: here, yaw: 0.0, stamp: next, frame_is_right: true };
                control.receive(0, pose, now).expect("a pose");
                (moved, next) = (next, steps.next().expect("endless"));
            }
            for (k, &position) in places.iter().enumerate().skip(1) {
                let pose = Pose { position, yaw: 0.0, stamp: now, frame_is_right: true };
                control.receive(k, pose, now).expect("a pose");
            }
            // Half as fast as it may go, after it was heard.
            let lead = [2.5, (0.5 * (now - 1.0)).clamp(0.0, 6.0)];
            assert!(control.place_leader(0, lead));
            control.tick(now);
            sent.push(control.target(0).unwrap_or(here));
            let [c, b, a] = [1, 2, 3].map(|k| sent[sent.len() - k]);
            strong += usize::from((c[1] - 2.0 * b[1] + a[1]).abs() > 1.5 * PERIOD * PERIOD);
            back += usize::from(c[1] < b[1] - 1e-3);
        }
        assert!(strong < 5 && back == 0, "{phase}, {shake}: {strong} too strong, {back} back");
        assert!(distance(here, [2.5, 6.0]) < 0.1, "{phase}, {shake}: {here:?}");
    }
}

#[test]
fn robots_that_turn_or_were_stuck_arrive_whatever_the_age_of_their_poses() {
    let text = |model: &str, more: &str| {
        format!(
            "title = \"three\"\nradius = 0.2\nlinks = {{ kind = \"nearest\", count = 2 }}\n\
             robots = [{{ name = \"a\", place = [0.0, 0.0] }}, {{ name = \"b\", place = [2.0, 0.0] }}, {{ name = \"c\", place = [1.0, 1.0] }}]\n\
             leaders = [{{ robots = [\"a\", \"b\", \"c\"], program = {{ kind = \"path\", points = [{{ at = 2.0, displacement = [0.0, 0.0] }}, \
             {{ at = 12.0, displacement = [-3.0, 4.0] }}] }} }}]\n\
             limits = {{ speed = 1.0, acceleration = 1.0, clearance = 0.2 }}\nflight = {{ duration = 40.0, model = {{ {model} }}, {more} }}\n"
        )
    };
    let flown = |model: &str, more: &str| {
        let (record, _) = flown(&parse(&text(model, more)).expect("a swarm"));
        let places = record.tracks.last().expect("recorded");
        let starts = [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]];
        let off = |k: usize| distance(places.get(k), [starts[k][0] - 3.0, starts[k][1] + 4.0]);
        assert!((0..3).all(|k| off(k) < 0.01), "{model}, {more}: {places:?}");
        record
    };
    for delay in 0..4 {
        for turn_rate in [45.0, 90.0] {
            let model = format!("kind = \"unicycle\", turn_rate = {turn_rate:?}");
            flown(&model, &format!("delay = {delay}"));
        }
        let stuck = "faults = [{ robot = \"a\", at = 4.0, until = 5.9, what = { kind = \"stuck\" } }]";
        let record = flown("kind = \"integrator\"", &format!("delay = {delay}, {stuck}"));
        let heights: Vec<f64> = record.tracks.iter().map(|places| places.get(0)[1]).collect();
        let falls = heights.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f64::max);
        assert!(falls < 1e-3, "{delay}: it went back by {falls} m in a period");
    }
}

/// While it is seen where it stood, a robot that was sent on already does not start over again and again, and leap then.
#[test]
fn a_robot_that_starts_behind_late_poses_gathers_speed_as_its_limit_lets_it() {
    for (delay, period) in [(2, 0.1), (3, 0.1), (6, 0.05)] {
        let text = format!(
            "title = \"one\"\nradius = 0.2\nlinks = {{ kind = \"listed\" }}\nrobots = [{{ name = \"a\", place = [0.0, 0.0] }}]\n\
             leaders = [{{ robots = [\"a\"], program = {{ kind = \"path\", interpolation = \"hold\", points = [{{ at = 0.01, displacement = [3.0, 0.0] }}] }} }}]\n\
             limits = {{ speed = 2.0, acceleration = 0.5 }}\ncontrol = {{ period = {period} }}\n\
             flight = {{ duration = 12.0, model = {{ kind = \"integrator\" }}, delay = {delay} }}\n"
        );
        let (record, _) = flown(&parse(&text).expect("a swarm"));
        let along: Vec<f64> = record.tracks.iter().map(|places| places.get(0)[0]).collect();
        let change = along.windows(3).map(|at| (at[2] - 2.0 * at[1] + at[0]).abs()).fold(0.0, f64::max);
        assert!(
            change <= 0.5 * period * period * (1.0 + 1e-9),
            "{delay}, {period}: {}",
            change / period / period
        );
        assert!((along[along.len() - 1] - 3.0).abs() < 1e-6, "{delay}, {period}: {along:?}");
    }
}

#[test]
fn a_robot_that_was_carried_away_is_led_from_where_it_is() {
    const AGE: f64 = 0.03;
    let mut control = loops(&circle("ideal\""), false).remove(0);
    let mut places: Vec<[f64; 2]> = control.formation().places.iter().collect();
    assert!(control.place_leader(0, [0.0, 0.0]));
    for tick in 0..20 {
        let now = f64::from(tick) * PERIOD;
        if tick == 15 {
            places[0][1] += 0.45;
        }
        for (k, &position) in places.iter().enumerate() {
            let pose = Pose { position, yaw: 0.0, stamp: now - AGE, frame_is_right: true };
            control.receive(k, pose, now).expect("a pose");
        }
        control.tick(now);
        let target = control.target(0).expect("it is heard");
        assert!(
            distance(target, places[0]) < PERIOD + AGE + 1e-9,
            "period {tick}: {target:?} from {places:?}"
        );
        // At its target after a period.
        places[0] = target;
    }
    assert!(places[0][0] < 1.0, "it went on: {places:?}");
}

/// The place that a robot reached with the last pose, and left, is none where it may still be.
#[test]
fn robots_keep_clear_when_poses_become_late_on_the_way() {
    let mut met = f64::INFINITY;
    for seed in 0..60 {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut control = Control::new(&circle("integrator\"")).expect("laid out");
        let mut poses = vec![control.formation().places.clone()];
        let mut heard = -1;
        for tick in 0..160 {
            if tick % 20 == 0 {
                for k in 0..ROBOTS {
                    let goal = [0, 1].map(|_| random.random_range(-1.5..1.5));
                    assert!(control.place_leader(k, goal));
                }
            }
            let late = [0, 2, 0, 1, 3][(tick / 5 + seed as usize) % 5];
            let old = tick as i64 - late;
            if old > heard {
                heard = old;
                let (stamp, now) = (old as f64 * PERIOD, tick as f64 * PERIOD);
                for k in 0..ROBOTS {
                    let position = poses[old as usize].get(k);
                    let pose = Pose { position, yaw: 0.0, stamp, frame_is_right: true };
                    control.receive(k, pose, now).expect("a pose");
                }
            }
            control.tick(tick as f64 * PERIOD);
            let mut next = poses[tick].clone();
            (0..ROBOTS).for_each(|k| next.set(k, control.target(k).unwrap_or(next.get(k))));
            for (a, b) in (0..ROBOTS).flat_map(|a| (0..a).map(move |b| (a, b))) {
                let gap = distance(next.get(a), next.get(b)) - 0.3;
                assert!(gap >= 0.1 - 1e-9, "seed {seed}, tick {tick}: r{a} and r{b} {gap} m apart");
                met = met.min(gap);
            }
            poses.push(next);
        }
    }
    assert!(met < 0.101, "they met: {met}");
}

/// The place of a late pose, or that of a robot that has yet to brake, lies behind it.
#[test]
fn robots_come_to_rest_in_an_emergency_stop_and_do_not_go_back() {
    let acceleration = 0.5;
    let limited = [format!("limits.acceleration={acceleration}")];
    for (model, sets, late) in [
        ("integrator", &[][..], 0),
        ("integrator", &[], 4),
        ("integrator", &limited, 0),
        ("integrator", &limited, 4),
        ("double-integrator", &limited, 0),
        ("double-integrator", &limited, 4),
    ] {
        let mut control = Control::new(&circle_with(&format!("{model}\""), sets)).expect("laid out");
        assert!(control.place_leader(0, [40.0, 0.0]));
        let dynamics = Model::DoubleIntegrator(DoubleIntegrator { speed: 1.0, acceleration });
        let mut robot = Robot::at(control.formation().places.get(0), 0.0);
        let mut poses = vec![robot.position];
        let (mut stopped_at, mut farthest) = (f64::NAN, f64::NEG_INFINITY);
        for tick in 0..200 {
            let now = tick as f64 * PERIOD;
            if let Some(old) = (tick as usize).checked_sub(late) {
                hear(&mut control, poses[old], old as f64 * PERIOD, now);
            }
            if tick == 80 {
                stopped_at = robot.position[0];
                control.emergency_stop();
            }
            control.tick(now);
            let target = control.target(0).unwrap_or(robot.position);
            match model {
                "integrator" => robot.position = target,
                _ => robot.step(&dynamics, target, PERIOD),
            }
            if tick >= 80 {
                let back = farthest - robot.position[0];
                assert!(back < 0.01, "{model} {sets:?}, {late} late: {back} m back in tick {tick}");
                farthest = farthest.max(robot.position[0]);
            }
            poses.push(robot.position);
        }
        let (way, rest) = (farthest - stopped_at, distance(poses[199], poses[200]));
        let most = if sets.is_empty() { 1e-9 } else { 1.0 / (2.0 * acceleration) + 2.0 * PERIOD };
        assert!(
            stopped_at > 5.0 && way <= most && rest < 1e-6,
            "{model} {sets:?}, {late} late: {way} m, {rest} m"
        );
    }
}

/// Without limits the last target may be anywhere.
#[test]
fn a_robot_without_a_speed_limit_is_not_sent_on_in_an_emergency_stop() {
    let mut control =
        Control::new(&circle_with("ideal\"", &["limits={clearance=0.1}".to_owned()])).expect("laid out");
    assert!(control.place_leader(0, [40.0, 0.0]));
    let start = control.formation().places.get(0);
    for tick in 0..20 {
        let (now, stamp) = (tick as f64 * PERIOD, (tick as f64 - 4.0) * PERIOD);
        for k in 0..ROBOTS {
            // It goes at a metre a second, whatever it is asked for.
            let way = if k == 0 { stamp.max(0.0) } else { 0.0 };
            let [x, y] = control.formation().places.get(k);
            let pose = Pose { position: [x + way, y], yaw: 0.0, stamp, frame_is_right: true };
            control.receive(k, pose, now).expect("a pose");
        }
        if tick == 15 {
            control.emergency_stop();
        }
        control.tick(now);
    }
    let target = control.target(0).expect("known");
    assert!(target[0] <= start[0] + 1.5, "{target:?}");
}

/// The poses of the time before the change are of a faster robot.
#[test]
fn a_lower_speed_limit_sends_no_robot_back() {
    for late in [0, 2, 5] {
        let mut control = Control::new(&circle("integrator\"")).expect("laid out");
        assert!(control.place_leader(0, [40.0, 0.0]));
        let mut poses = vec![control.formation().places.get(0)];
        for tick in 0..100_usize {
            let now = tick as f64 * PERIOD;
            if let Some(old) = tick.checked_sub(late) {
                hear(&mut control, poses[old], old as f64 * PERIOD, now);
            }
            if tick == 50 {
                let limits = Limits { speed: 0.2, ..control.limits().clone() };
                control.set_limits(limits).expect("limits");
            }
            control.tick(now);
            let (last, next) = (poses[tick], control.target(0).unwrap_or(poses[tick]));
            let step = next[0] - last[0];
            let most = if tick < 50 { 1.0 } else { 0.2 } * PERIOD;
            let least = if tick < 50 { 0.0 } else { 0.99 * most };
            assert!((least..=most + 1e-9).contains(&step), "{late} late: {step} m in tick {tick}");
            poses.push(next);
        }
    }
}

/// It would leap there when it comes free.
#[test]
fn a_stuck_robot_s_target_comes_nearer_where_the_speed_limit_is_lowered() {
    for late in [1, 5, 9] {
        let mut control = Control::new(&circle("integrator\"")).expect("laid out");
        assert!(control.place_leader(0, [40.0, 0.0]));
        let stuck = control.formation().places.get(0);
        for tick in 0..60_usize {
            let now = tick as f64 * PERIOD;
            if let Some(old) = tick.checked_sub(late) {
                hear(&mut control, stuck, old as f64 * PERIOD, now);
            }
            for speed in if tick == 40 { &[0.6, 0.1][..] } else { &[] } {
                control.set_limits(Limits { speed: *speed, ..control.limits().clone() }).expect("limits");
            }
            control.tick(now);
            let Some(target) = control.target(0) else { continue };
            // A period after that of its pose it can have gone on by the new limit alone.
            let (ahead, time) = (target[0] - stuck[0], (late + 1) as f64 * PERIOD);
            let since = (tick as f64 - 40.0) * PERIOD;
            let most = 0.1 * since.clamp(0.0, time) + (time - since.max(0.0)).max(0.0);
            let next = PERIOD * if since < 0.0 { 1.0 } else { 0.1 };
            assert!(ahead <= most + next + 1e-9, "{late} late: {ahead} m ahead in tick {tick}, {most} m");
        }
    }
}

/// While a loop is off others move its robots, in a stop as well.
#[test]
fn a_loop_that_is_switched_on_in_a_stop_holds_robots_where_they_are_by_then() {
    let mut control = Control::new(&circle("integrator\"")).expect("laid out");
    let places = control.formation().places.clone();
    let mut tick = 0;
    let mut run = |control: &mut Control, by: f64| {
        let now = f64::from(tick) * PERIOD;
        for k in 0..ROBOTS {
            let [x, y] = places.get(k);
            let pose = Pose { position: [x + by, y], yaw: 0.0, stamp: now, frame_is_right: true };
            control.receive(k, pose, now).expect("a pose");
        }
        control.tick(now);
        tick += 1;
        control.target(0).map(|target| target[0] - places.get(0)[0])
    };
    assert_eq!(run(&mut control, 0.0), Some(0.0));
    control.emergency_stop();
    assert_eq!(run(&mut control, 0.0), Some(0.0));
    control.set_active(false);
    for k in 0..40 {
        assert_eq!(run(&mut control, 0.05 * f64::from(k)), None, "it is off");
    }
    control.set_active(true);
    assert_eq!(control.mode(), Mode::EmergencyStopped);
    for _ in 0..20 {
        let held = run(&mut control, 2.0).expect("it is on");
        assert!((held - 2.0).abs() < 1e-12, "{held}");
    }
    control.set_active(false);
    assert!(
        control.resume() && control.mode() == Mode::Inactive,
        "a stop that is lifted switches nothing on"
    );
}

/// It went as it was sent at the time.
#[test]
fn a_lost_robot_is_kept_clear_of_though_the_speed_limit_is_lowered_by_then() {
    for late in [0, 2] {
        let sets = ["limits.acceleration=1.0", "poses={ fresh=0.5, age_limit=0.6, stop_after=1.0 }"]
            .map(str::to_owned);
        let mut control = Control::new(&circle_with("double-integrator\"", &sets)).expect("laid out");
        let model = Model::DoubleIntegrator(DoubleIntegrator { speed: 1.0, acceleration: 1.0 });
        let places: Vec<[f64; 2]> = (0..ROBOTS).map(|k| [10.0 * k as f64, 0.0]).collect();
        let mut robots: Vec<Robot> = places.iter().map(|&place| Robot::at(place, 0.0)).collect();
        robots[1] = Robot::at([2.0, 3.0], 0.0);
        let mut poses = vec![];
        let mut gap = f64::INFINITY;
        for tick in 0..160_usize {
            let now = tick as f64 * PERIOD;
            poses.push(robots.iter().map(|robot| robot.position).collect::<Vec<_>>());
            if let Some(old) = tick.checked_sub(late) {
                for k in (0..ROBOTS).filter(|&k| k > 0 || tick < 17) {
                    let (position, stamp) = (poses[old][k], old as f64 * PERIOD);
                    let pose = Pose { position, yaw: 0.0, stamp, frame_is_right: true };
                    control.receive(k, pose, now).expect("a pose");
                }
            }
            if tick == 0 {
                assert!(control.place_leader(0, [8.0, 0.0]) && control.place_leader(1, [2.0, 3.0]));
                (2..ROBOTS).for_each(|k| assert!(control.place_leader(k, places[k])));
            }
            if tick == 42 {
                control.set_limits(Limits { speed: 0.25, ..control.limits().clone() }).expect("limits");
                assert!(control.place_leader(1, [2.0, -1.0]));
            }
            control.tick(now);
            for (k, robot) in robots.iter_mut().enumerate() {
                robot.step(&model, control.target(k).unwrap_or(robot.position), PERIOD);
            }
            gap = gap.min(distance(robots[0].position, robots[1].position) - 0.3);
        }
        let stood = robots[0].position[0];
        assert!(robots[1].position[1] < 1.5 && (1.5..2.5).contains(&stood), "they meet: {robots:?}");
        assert!(gap >= 0.1 - 1e-9, "{late} late: {gap} m");
    }
}

/// As it was in the loop before: what is lost on the way holds up nothing.
#[test]
fn a_loop_that_goes_on_from_an_earlier_one_waits_some_seconds_for_a_leader_that_is_lost() {
    let text = "title = \"two\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 1 }\n\
                robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [0.0, 5.0] }]\n\
                leaders = [{ robots = [\"a\", \"b\"], program = { kind = \"path\", points = [{ at = 4.0, displacement = [2.0, 0.0] }] } }]\n\
                limits = { speed = 1.0, clearance = 0.1 }\ncontrol = { period = 0.1 }\n";
    let swarm = Swarm::parse("two", "two.toml", text, &[], None).expect("a swarm");
    let run = |control: &mut Control, from: usize, ticks: usize, lost: usize| {
        for tick in from..from + ticks {
            let now = tick as f64 * PERIOD;
            for k in lost..2 {
                let position = control.target(k).unwrap_or([0.0, 5.0 * k as f64]);
                control
                    .receive(k, Pose { position, yaw: 0.0, stamp: now, frame_is_right: true }, now)
                    .expect("a pose");
            }
            control.tick(now);
        }
    };
    let mut first = Control::new(&swarm).expect("laid out");
    run(&mut first, 0, 10, 0);
    let time = first.program_time();
    let mut next = Control::new(&swarm).expect("laid out");
    next.restore(first.kept());
    run(&mut next, 10, 40, 1);
    assert_eq!(next.program_time(), time, "it waits");
    run(&mut next, 50, 60, 1);
    assert!(next.program_time() > time + 3.0 && (next.target(1).expect("heard")[0] - 2.0).abs() < 1e-9);
    let mut fresh = Control::new(&swarm).expect("laid out");
    run(&mut fresh, 0, 100, 1);
    assert_eq!(fresh.program_time(), 0.0, "before the beginning it waits for its leaders");
}
