use super::*;
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::rules::{Mean, Rule};

/// Large enough to be swept in parallel, and of no whole number of chunks.
fn body(rule: Rule) -> Flock {
    let lattice = Lattice::new(LatticeKind::Hexagonal { spacing: 1.0 }, [0.0, 0.0], 0.1);
    let cut = Cut::Count { columns: 263, rows: 301 };
    let (body, neighbours) = Body::build(lattice, &cut, &Neighbourhood::Second, None).expect("fits");
    let reference = body.reference;
    let mut flock = Flock::new(rule, reference, neighbours, Weights::Equal);
    flock.keep_rest();
    flock
}

fn bits(points: &Vectors) -> Vec<u64> {
    points.x.iter().chain(&points.y).map(|value| value.to_bits()).collect()
}

fn after_steps(flock: &Flock, roles: &[Role], threads: usize) -> Vectors {
    let sweep = Sweep::compile(Update::default(), flock, roles);
    let mut present = Vectors::clone(&flock.reference);
    for i in (0..present.len()).step_by(101) {
        present.x[i] += 1.0 + (i % 13) as f64 / 7.0;
    }
    let mut next = present.clone();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        for _ in 0..3 {
            sweep.step(flock, None, &present, &mut next);
            std::mem::swap(&mut present, &mut next);
        }
    });
    present
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let weighted = Rule { mean: Mean::Distance { power: 1.0 }, ..Rule::BARYCENTRE };
    for rule in [Rule::BARYCENTRE, weighted] {
        let flock = body(rule);
        assert!(flock.reference.len() > PARALLEL_FROM);
        let mut roles = vec![Role::Follower; flock.reference.len()];
        roles[..301].fill(Role::Clamped);
        let one = bits(&after_steps(&flock, &roles, 1));
        for threads in [2, 4] {
            assert!(bits(&after_steps(&flock, &roles, threads)) == one, "{threads} threads");
        }
    }
}

#[test]
fn a_compiled_sweep_gives_the_bits_of_an_uncompiled_one() {
    let flock = body(Rule::BARYCENTRE);
    let mut roles = vec![Role::Follower; flock.reference.len()];
    roles.iter_mut().step_by(7919).for_each(|role| *role = Role::Leader);
    let present: Vectors = flock.reference.iter().map(|[x, y]| [x * 1.01, y - 0.02 * x]).collect();
    let compiled = Sweep::compile(Update::default(), &flock, &roles);
    assert!(compiled.share_in_runs() > 0.95, "{}", compiled.share_in_runs());
    let swept = |sweep: &Sweep| {
        let mut next = present.clone();
        sweep.step(&flock, None, &present, &mut next);
        bits(&next)
    };
    assert!(swept(&compiled) == swept(&Sweep::uncompiled(Update::default(), &flock, &roles)));
}

fn assert_as_uncompiled(compiled: &Sweep, flock: &Flock, roles: &[Role]) {
    let reference = &flock.reference;
    let present: Vectors = reference.iter().map(|[x, y]| [x * 1.01 + 0.1 * y.sin(), y - 0.02 * x]).collect();
    let swept = |sweep: &Sweep| {
        let mut next = present.clone();
        sweep.step(flock, None, &present, &mut next);
        bits(&next)
    };
    assert!(compiled.rows.is_some());
    let (found, expected) = (swept(compiled), swept(&Sweep::uncompiled(compiled.update, flock, roles)));
    let off = found.iter().zip(&expected).position(|(a, b)| a != b);
    assert_eq!(off.map(|i| (i, f64::from_bits(found[i]), f64::from_bits(expected[i]))), None);
}

#[test]
fn a_compiled_sweep_of_a_material_gives_the_bits_of_an_uncompiled_one() {
    use crate::flock::block::Block;
    use crate::flock::law::MatrixWeights;
    let mut flock = body(Rule::MATERIAL);
    let neighbours = &flock.neighbours;
    // A class for each number of neighbours, of matrices without any symmetry.
    let most = (0..neighbours.count()).map(|j| neighbours.of(j).len()).max().expect("particles");
    let starts: Vec<u32> = (0..=most as u32 + 1).map(|n| n * n.saturating_sub(1) / 2).collect();
    let blocks: Vec<Block> = (0..starts[most + 1])
        .map(f64::from)
        .map(|k| [[0.1 + 0.01 * k.sin(), 0.02 * k.cos()], [0.03 * (2.0 * k).sin(), 0.1 - 0.01 * k.cos()]])
        .collect();
    flock.weights = Weights::Matrix(MatrixWeights {
        class: (0..neighbours.count()).map(|j| neighbours.of(j).len() as u32).collect(),
        starts,
        stiffness: blocks.clone(),
        blocks,
        compliance: (0..=most).map(|n| [[0.1 * n as f64, 0.2], [0.3, 0.4]]).collect(),
        cells: None,
    });
    let mut roles = vec![Role::Follower; flock.reference.len()];
    roles.iter_mut().step_by(7919).for_each(|role| *role = Role::Leader);
    let gentle = Update { damping: 0.7, ..Update::default() };
    for update in [Update::default(), gentle] {
        flock.rest = None;
        flock.forces = None;
        assert_as_uncompiled(&Sweep::compile(update, &flock, &roles), &flock, &roles);
        flock.keep_rest();
        flock.forces = Some(flock.reference.iter().map(|[x, y]| [y.cos(), 0.1 * x]).collect());
        assert_as_uncompiled(&Sweep::compile(update, &flock, &roles), &flock, &roles);
    }
}

#[test]
fn a_cracked_body_is_swept_to_the_bits_of_one_by_one() {
    use crate::flock::fracture::{Bonds, Ghosts};
    let mut flock = body(Rule::BARYCENTRE);
    let mut roles = vec![Role::Follower; flock.reference.len()];
    roles[..301].fill(Role::Clamped);
    for ghosts in [Ghosts::Lattice, Ghosts::Mirrored, Ghosts::None] {
        flock.bonds = None;
        let mut sweep = Sweep::compile(Update::default(), &flock, &roles);
        assert!(sweep.takes_several(None));
        let (mut bonds, mut breaks) = (Bonds::new(None, ghosts, &flock.neighbours), Vec::new());
        let (reference, neighbours) = (&flock.reference, &flock.neighbours);
        bonds.cut(([100.0, -400.0], [130.0, 400.0]), neighbours, reference, &mut breaks);
        flock.bonds = Some(bonds);
        assert_as_uncompiled(&Sweep::compile(Update::default(), &flock, &roles), &flock, &roles);
        sweep.set_aside(breaks.iter().flat_map(|b| b.pair).map(|j| j as usize), &flock);
        assert_as_uncompiled(&sweep, &flock, &roles);
        assert!(sweep.torn.len() > 500 && sweep.torn.len() < 5000, "{}", sweep.torn.len());
        assert!(!sweep.takes_several(None));
    }
}

/// Every term of the paper, over every kind of coefficients.
#[test]
fn every_affine_rule_is_compiled_to_the_bits_of_one_by_one() {
    use crate::flock::rules::{Axis, Feedback, FeedbackReference, Poisson};
    let poisson = Poisson { k: 0.03, axis: Axis::X, centre: 20.0, half_width: 150.0, exponent: 1.5 };
    let across = Poisson { axis: Axis::Y, exponent: 1.0, ..poisson };
    let feedback = |factor, reference| Some(Feedback { factor, reference });
    let rules = [
        Rule { feedback: feedback(-0.3, FeedbackReference::Initial), ..Rule::BARYCENTRE },
        Rule { feedback: feedback(0.2, FeedbackReference::Previous), ..Rule::BARYCENTRE },
        Rule { poisson: Some(poisson), ..Rule::BARYCENTRE },
        Rule {
            poisson: Some(across),
            feedback: feedback(0.1, FeedbackReference::Initial),
            mean: Mean::Barycentre,
        },
    ];
    for (rule, weighs) in rules.into_iter().flat_map(|rule| [(rule, false), (rule, true)]) {
        let mut flock = body(rule);
        let mut roles = vec![Role::Follower; flock.reference.len()];
        roles.iter_mut().step_by(7919).for_each(|role| *role = Role::Leader);
        if weighs {
            // By direction, one of them negative; those of one particle are its own, those of another add up to nothing.
            let of = |j: usize| {
                let size = flock.neighbours.of(j).len();
                let own = if j == 40_000 { 0.123 } else { 0.0 };
                (0..size).map(move |k| match j {
                    50_000 => {
                        if k == 0 {
                            1.0
                        } else if k == 1 {
                            -1.0
                        } else {
                            0.0
                        }
                    }
                    _ => [1.0, 0.5, 2.0, -0.25, 1.5, 0.75][k % 6] + own,
                })
            };
            flock.weights = Weights::Scalar((0..roles.len()).flat_map(of).collect());
            flock.keep_rest();
        }
        for damping in [1.0, 0.7] {
            let update = Update { damping, ..Update::default() };
            let compiled = Sweep::compile(update, &flock, &roles);
            assert!(compiled.share_in_runs() > 0.95, "{rule:?}: {}", compiled.share_in_runs());
            assert_as_uncompiled(&compiled, &flock, &roles);
            assert_together_as_single(&compiled, &flock);
        }
    }
}

/// Several steps at once have the bits of single ones, on one thread and on more.
fn assert_together_as_single(sweep: &Sweep, flock: &Flock) {
    let start: Vectors = flock.reference.iter().map(|[x, y]| [x + 0.1 * y.sin(), y - 0.02 * x]).collect();
    let (mut single, mut next) = (start.clone(), start.clone());
    for _ in 0..7 {
        sweep.step(flock, None, &single, &mut next);
        std::mem::swap(&mut single, &mut next);
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let (mut present, mut next, mut activity) = (start.clone(), start.clone(), Activity::default());
        for count in [4, 3] {
            let places = (&mut present, &mut next);
            pool.install(|| sweep.steps(flock, None, places, (count, Led::NONE, None), &mut activity));
        }
        assert!(bits(&present) == bits(&single), "{threads} threads");
    }
}
