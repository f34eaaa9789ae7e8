//! A continuum scene as a formation.

use flockform::continuum::record::ProbeSeries;
use flockform::engine::Engine;
use flockform::export::OutputFolder;
use flockform::export::csv::write_probes;
use flockform::flock::vectors::Vectors;
use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::Flight;

use super::support::*;
use crate::folders::temporary;
use crate::scenes::{load, planned};

fn bits(points: &Vectors) -> Vec<[u64; 2]> {
    points.iter().map(|place| place.map(f64::to_bits)).collect()
}

#[test]
fn ideal_robots_fly_the_bits_of_the_continuum_run() {
    // Frames of all kinds, a material, feedback, weights by distance.
    for name in [
        "tension",
        "tension-immediate",
        "feedback-overrelax",
        "shear",
        "lattice-hexagonal",
        "second-gradient",
    ] {
        let text = format!("title = \"{name}\"\nradius = 0.01\n[scene]\nname = \"{name}\"\n");
        let swarm = parse(&text).unwrap_or_else(|error| panic!("{error}"));
        let mut flight = Flight::new(&swarm).unwrap_or_else(|error| panic!("{error}"));
        let scene = load(name, &[]);
        let mut engine = Engine::new(planned(&scene).setup);
        for _ in 0..60 {
            flight.step();
            engine.advance();
        }
        let body: Vectors = (0..engine.body().count())
            .filter(|&i| !engine.body().is_frame[i])
            .map(|i| engine.present().get(i))
            .collect();
        assert!(bits(&flight.fleet().places()) == bits(&body), "{name}");
        assert_eq!(flight.continuum_error(), Some(0.0), "{name}");
    }
}

#[test]
fn node_swarm_and_continuum_give_one_target_for_the_same_positions() {
    // Robots that were seen anywhere, not where they were sent: the targets are the flock's own.
    let swarm = parse("title = \"t\"\n[scene]\nname = \"shear\"\n").expect("valid");
    let mut flight = Flight::new(&swarm).expect("flies");
    let places = flight.fleet().places();
    for m in 0..places.len() {
        let [x, y] = places.get(m);
        let seen = [x + 0.01 * (7.0 * y).sin(), y - 0.02 * (3.0 * x).cos()];
        let pose =
            flockform::swarm::watch::Pose { position: seen, yaw: 0.0, stamp: 0.0, frame_is_right: true };
        flight.control_mut().receive(m, pose, 0.0).expect("believed");
    }
    flight.control_mut().tick(0.0);
    let control = flight.control();
    let engine = control.formation().engine().expect("a body");
    let seen = engine.previous();
    let mut followers = 0;
    for m in 0..places.len() {
        if !control.formation().leads(m) {
            let particle = (0..seen.len())
                .find(|&i| seen.get(i) == control.position(m).expect("seen"))
                .expect("a particle");
            let target = engine.flock().target(particle, seen);
            assert_eq!(control.target(m).expect("heard").map(f64::to_bits), target.map(f64::to_bits));
            followers += 1;
        }
    }
    assert!(followers > 50);
}

#[test]
fn robots_inside_a_body_are_carried_along() {
    let text = "title = \"inside\"\n[scene]\nname = \"lattice-square\"\n[[robots]]\nname = \"a\"\nplace = [2.5, 3.25]\n\
                [[robots]]\nname = \"b\"\nplace = [4.0, 4.0]\n";
    let swarm = parse(text).unwrap_or_else(|error| panic!("{error}"));
    let mut flight = Flight::new(&swarm).unwrap_or_else(|error| panic!("{error}"));
    let before = flight.fleet().places();
    for _ in 0..40 {
        flight.step();
    }
    let engine = flight.control().formation().engine().expect("a body");
    let at = |place: [f64; 2]| {
        (0..engine.body().count()).find(|&i| engine.body().reference.get(i) == place).expect("a particle")
    };
    let places = flight.fleet().places();
    assert_ne!(places, before, "the body moved");
    // On a particle, and a quarter of the way up between two columns of four.
    assert_eq!(places.get(1), engine.present().get(at([4.0, 4.0])));
    let corner = |x: f64, y: f64| engine.present().get(at([x, y]));
    let four = [corner(2.0, 3.0), corner(3.0, 3.0), corner(2.0, 4.0), corner(3.0, 4.0)];
    let inside = |k: usize| {
        let low = four.iter().map(|c| c[k]).fold(f64::INFINITY, f64::min);
        let high = four.iter().map(|c| c[k]).fold(f64::NEG_INFINITY, f64::max);
        (low..=high).contains(&places.get(0)[k])
    };
    assert!(inside(0) && inside(1));
}

#[test]
fn a_recorded_run_is_flown_step_by_step() {
    let scene = load("tension", &["record.probes=[67, 68, 115]"]);
    let mut engine = Engine::new(planned(&scene).setup);
    let mut probes: Vec<ProbeSeries> = [66, 67, 114].map(ProbeSeries::new).into();
    probes.iter_mut().for_each(|probe| probe.record(&engine));
    for _ in 0..30 {
        engine.advance();
        probes.iter_mut().for_each(|probe| probe.record(&engine));
    }
    let folder = temporary();
    let output = OutputFolder::create(&folder.path().join("run"), false).expect("a folder");
    write_probes(&output, engine.body(), &probes).expect("written");
    let kept = output.commit().expect("kept");
    let file = folder.path().join("flown.toml");
    std::fs::write(&file, "title = \"flown\"\n[scene]\nname = \"tension\"\nrecording = \"run/probes.csv\"\n")
        .expect("written");
    assert!(kept.join("probes.csv").exists());
    let swarm = Swarm::from_file(&file, &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut flight = Flight::new(&swarm).expect("flies");
    assert_eq!(flight.periods(), 30);
    for step in 1..=30 {
        flight.step();
        for (m, probe) in probes.iter().enumerate() {
            assert_eq!(flight.fleet().places().get(m), probe.positions.get(step), "robot {m} at step {step}");
        }
    }
}
