//! Micro-benchmarks of the loops that runs and flights spend their time in: `cargo bench --bench kernels [FILTER]`.
//!
//! They are for whoever changes a loop and wants to see at once what it does. For numbers beside the machine's own, and
//! beside other programs', use `flockform bench`.

use divan::Bencher;
use divan::counter::ItemsCount;
use flockform::flock::body::{Body, Cut};
use flockform::flock::fracture::{Bonds, Ghosts, Threshold};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::law::{Flock, Weights};
use flockform::flock::neighbourhood::Neighbourhood;
use flockform::flock::numbering::order_in_columns;
use flockform::flock::role::Role;
use flockform::flock::rules::{Mean, Rule};
use flockform::flock::vectors::Vectors;
use flockform::sweep::{Activity, Led, Sweep, Update};

const SIDES: [u32; 3] = [12, 128, 512];

fn main() {
    divan::main();
}

/// A square body led all around, and where its particles are.
fn body(side: u32, rule: Rule, neighbourhood: &Neighbourhood) -> (Flock, Vec<Role>, Vectors) {
    let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
    let cut = Cut::Count { columns: side, rows: side };
    let (body, neighbours) = Body::build(lattice, &cut, neighbourhood, None).expect("fits");
    let edge = |site: &[i32; 2]| site.iter().any(|&at| at == 0 || at == side as i32 - 1);
    let roles =
        body.sites.iter().map(|site| if edge(site) { Role::Clamped } else { Role::Follower }).collect();
    let present = body.reference.iter().map(|[x, y]| [x + 0.01 * y.sin(), y + 0.01 * x.sin()]).collect();
    let (reference, weights) = (body.reference, Weights::Equal);
    let flock = Flock::new(rule, reference, neighbours, weights);
    (flock, roles, present)
}

fn bench_steps(bencher: Bencher, side: u32, rule: Rule, neighbourhood: &Neighbourhood) {
    let (flock, roles, mut present) = body(side, rule, neighbourhood);
    let sweep = Sweep::compile(Update::default(), &flock, &roles);
    let mut next = present.clone();
    bencher.counter(ItemsCount::new(sweep.followers())).bench_local(|| {
        sweep.step(&flock, None, &present, &mut next);
        std::mem::swap(&mut present, &mut next);
    });
}

#[divan::bench(args = SIDES)]
fn barycentre_of_4(bencher: Bencher, side: u32) {
    bench_steps(bencher, side, Rule::BARYCENTRE, &Neighbourhood::First { keep: None });
}

#[divan::bench(args = SIDES)]
fn barycentre_of_8(bencher: Bencher, side: u32) {
    bench_steps(bencher, side, Rule::BARYCENTRE, &Neighbourhood::Chebyshev { radius: 1 });
}

/// A rule that no loop is compiled for.
#[divan::bench(args = SIDES)]
fn distance_weights(bencher: Bencher, side: u32) {
    let rule = Rule { mean: Mean::Distance { power: 1.0 }, ..Rule::BARYCENTRE };
    bench_steps(bencher, side, rule, &Neighbourhood::First { keep: None });
}

#[divan::bench(args = SIDES)]
fn sixteen_steps_together(bencher: Bencher, side: u32) {
    let (flock, roles, mut present) = body(side, Rule::BARYCENTRE, &Neighbourhood::First { keep: None });
    let sweep = Sweep::compile(Update::default(), &flock, &roles);
    let (mut next, mut activity) = (present.clone(), Activity::default());
    bencher.counter(ItemsCount::new(16 * sweep.followers())).bench_local(|| {
        let places = (&mut present, &mut next);
        sweep.steps(&flock, None, places, (16, Led::NONE, None), &mut activity)
    });
}

#[divan::bench(args = SIDES)]
fn bonds_that_do_not_break(bencher: Bencher, side: u32) {
    let (flock, roles, present) = body(side, Rule::BARYCENTRE, &Neighbourhood::First { keep: None });
    let Flock { neighbours, reference, .. } = &flock;
    let mut bonds = Bonds::new(Some(Threshold::Stretch(2.0)), Ghosts::Lattice, neighbours);
    bencher.counter(ItemsCount::new(neighbours.index.len() / 2)).bench_local(|| {
        bonds.break_stretched(1, neighbours, (&**reference, &present), &roles, &mut Vec::new());
    });
}

#[divan::bench(args = SIDES)]
fn order_in_columns_of_cells(bencher: Bencher, side: u32) {
    let (_, _, present) = body(side, Rule::BARYCENTRE, &Neighbourhood::First { keep: None });
    bencher.counter(ItemsCount::new(present.len())).bench_local(|| order_in_columns(&present, 1.0));
}
