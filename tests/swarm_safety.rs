//! The safety filter on whole scenes: nobody comes nearer than declared, and who can arrive does.

use flockform::flock::points::{Points, distance};
use flockform::swarm::safety::{Filter, Flags, Limits, Obstacle, Obstacles, Seen};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// A swarm in which every member wants to be at its goal at once.
struct World {
    filter: Filter,
    radii: Vec<f64>,
    present: Points,
    goals: Points,
    period: f64,
    safe: Points,
    flags: Vec<Flags>,
}

impl World {
    fn new(limits: Limits, radius: f64, obstacles: &[Obstacle], ways: &[[[f64; 2]; 2]]) -> Self {
        let obstacles = Obstacles::new(obstacles).expect("solids");
        let radii = vec![radius; ways.len()];
        Self {
            filter: Filter::new(limits, radii.clone(), obstacles).expect("limits"),
            radii,
            present: ways.iter().map(|way| way[0]).collect(),
            goals: ways.iter().map(|way| way[1]).collect(),
            period: 0.1,
            safe: Points::default(),
            flags: vec![Flags::default(); ways.len()],
        }
    }

    fn tick(&mut self) {
        let count = self.radii.len();
        let (known, ages) = (vec![true; count], vec![0.0; count]);
        let seen = Seen { present: &self.present, known: &known, ages: &ages, velocity: None };
        self.filter.apply(&seen, &self.goals, self.period, &mut self.safe, &mut self.flags);
        self.present.clone_from(&self.safe);
    }

    fn smallest_clearance(&self) -> f64 {
        let mut clearance = Vec::new();
        self.filter.clearance(&self.present, &mut clearance);
        clearance.into_iter().fold(f64::INFINITY, f64::min)
    }

    fn furthest_from_goal(&self) -> f64 {
        self.present.iter().zip(self.goals.iter()).map(|(a, b)| distance(a, b)).fold(0.0, f64::max)
    }

    /// Ticks until all are within `tolerance` of their goals; panics where someone comes too near.
    fn ticks_to_arrive(&mut self, tolerance: f64, most: usize) -> Option<usize> {
        let declared = self.filter.limits().clearance;
        (1..=most).find(|tick| {
            self.tick();
            let clearance = self.smallest_clearance();
            assert!(clearance >= declared - 1e-9, "tick {tick}: {clearance} of {declared}");
            self.furthest_from_goal() <= tolerance
        })
    }
}

fn limits(speed: f64, clearance: f64) -> Limits {
    Limits { speed, clearance, ..Limits::default() }
}

#[test]
fn a_hundred_robots_swap_antipodal_places_on_a_circle() {
    let on_circle = |k: usize| {
        let angle = k as f64 / 100.0 * std::f64::consts::TAU;
        [10.0 * angle.cos(), 10.0 * angle.sin()]
    };
    let ways: Vec<_> = (0..100).map(|k| [on_circle(k), on_circle((k + 50) % 100)]).collect();
    for speed in [1.0, f64::INFINITY] {
        let mut world = World::new(limits(speed, 0.1), 0.15, &[], &ways);
        let ticks = world.ticks_to_arrive(1e-3, 6000);
        println!("speed {speed}: {ticks:?}, furthest {}", world.furthest_from_goal());
        assert!(ticks.is_some());
    }
}

#[test]
fn a_pair_head_on_swaps() {
    for speed in [1.0, f64::INFINITY] {
        let ways = [[[-5.0, 0.0], [5.0, 0.0]], [[5.0, 0.0], [-5.0, 0.0]]];
        let mut world = World::new(limits(speed, 0.1), 0.2, &[], &ways);
        let ticks = world.ticks_to_arrive(1e-6, 2000);
        println!("speed {speed}: {ticks:?}");
        assert!(ticks.is_some());
    }
}

#[test]
fn four_robots_cross() {
    for speed in [1.0, f64::INFINITY] {
        let ends = [[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0], [0.0, -5.0]];
        let ways: Vec<_> = (0..4).map(|k| [ends[k], ends[(k + 2) % 4]]).collect();
        let mut world = World::new(limits(speed, 0.1), 0.2, &[], &ways);
        let ticks = world.ticks_to_arrive(1e-6, 2000);
        println!("speed {speed}: {ticks:?}");
        assert!(ticks.is_some());
    }
}

fn rectangle(low: [f64; 2], high: [f64; 2]) -> Obstacle {
    Obstacle::Polygon(vec![low, [high[0], low[1]], high, [low[0], high[1]]])
}

#[test]
fn two_robots_pass_each_other_in_a_corridor() {
    for speed in [1.0, f64::INFINITY] {
        let walls = [rectangle([-4.0, 1.0], [4.0, 1.5]), rectangle([-4.0, -1.5], [4.0, -1.0])];
        let ways = [[[-6.0, 0.0], [6.0, 0.0]], [[6.0, 0.0], [-6.0, 0.0]]];
        let mut world = World::new(limits(speed, 0.1), 0.3, &walls, &ways);
        let ticks = world.ticks_to_arrive(1e-6, 2000);
        println!("speed {speed}: {ticks:?}");
        assert!(ticks.is_some());
    }
}

#[test]
fn a_robot_goes_around_a_wall() {
    for speed in [1.0, f64::INFINITY] {
        for offset in [0.0, 1.0, -1.0] {
            let wall = [rectangle([-0.2, -2.0], [0.2, 2.0])];
            let ways = [[[-4.0, offset], [4.0, offset]]];
            let mut world = World::new(limits(speed, 0.1), 0.3, &wall, &ways);
            let ticks = world.ticks_to_arrive(1e-6, 2000);
            println!("speed {speed}, {offset}: {ticks:?}");
            assert!(ticks.is_some());
        }
    }
}

#[test]
fn nobody_comes_too_near_in_ten_thousand_random_scenes() {
    let mut random = Pcg64Mcg::seed_from_u64(4);
    for scene in 0..10_000 {
        let mut world = random_world(&mut random, if scene % 2 == 0 { 1.0 } else { f64::INFINITY });
        for tick in 0..20 {
            world.tick();
            let (clearance, declared) = (world.smallest_clearance(), world.filter.limits().clearance);
            assert!(clearance >= declared - 1e-9, "scene {scene}, tick {tick}: {clearance} of {declared}");
        }
    }
}

/// 3 to 12 robots of unlike sizes in legal places among 0 to 3 solids, with goals anywhere.
fn random_world(random: &mut Pcg64Mcg, speed: f64) -> World {
    let side = 6.0;
    let mut anywhere = |low: f64, high: f64| random.random_range(low..high);
    let solids: Vec<Obstacle> = (0..anywhere(0.0, 4.0) as usize)
        .map(|_| {
            let [x, y] = [anywhere(0.0, side), anywhere(0.0, side)];
            match anywhere(0.0, 3.0) as usize {
                0 => Obstacle::Disc { centre: [x, y], radius: anywhere(0.1, 1.0) },
                1 => rectangle([x, y], [x + anywhere(0.05, 2.0), y + anywhere(0.05, 2.0)]),
                _ => {
                    let (w, h) = (anywhere(0.4, 2.0), anywhere(0.4, 2.0));
                    // An L.
                    Obstacle::Polygon(vec![
                        [x, y],
                        [x + w, y],
                        [x + w, y + 0.3 * h],
                        [x + 0.3 * w, y + 0.3 * h],
                        [x + 0.3 * w, y + h],
                        [x, y + h],
                    ])
                }
            }
        })
        .collect();
    let obstacles = Obstacles::new(&solids).expect("solids");
    let clearance = anywhere(0.0, 0.2);
    let wanted = anywhere(3.0, 13.0) as usize;
    let (mut radii, mut present) = (Vec::<f64>::new(), Points::default());
    for _ in 0..50 * wanted {
        let (place, radius) = ([anywhere(0.0, side), anywhere(0.0, side)], anywhere(0.0, 0.3));
        let apart = |k: usize| distance(present.get(k), place) >= radii[k] + radius + clearance;
        if radii.len() < wanted
            && obstacles.distance(place) >= radius + clearance
            && (0..radii.len()).all(apart)
        {
            present.push(place);
            radii.push(radius);
        }
    }
    let goals = (0..radii.len()).map(|_| [anywhere(0.0, side), anywhere(0.0, side)]).collect();
    let count = radii.len();
    World {
        filter: Filter::new(limits(speed, clearance), radii.clone(), obstacles).expect("limits"),
        radii,
        present,
        goals,
        period: 0.3,
        safe: Points::default(),
        flags: vec![Flags::default(); count],
    }
}
