//! Loss: holding what was last heard leads to the same place, a mean over whoever was heard does not.

use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::vectors::Vectors;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::support::{COUNT, barycentre, error, followers, square, stretched};

/// Whether each bond's pose arrives in this period.
fn heard(rng: &mut Pcg64Mcg, neighbours: &Neighbours, loss: f64) -> Vec<bool> {
    neighbours.index.iter().map(|_| rng.random::<f64>() >= loss).collect()
}

#[test]
fn holding_the_last_pose_leads_to_the_place_without_loss() {
    let (reference, neighbours) = square(Neighbourhood::First { keep: None });
    let flock = barycentre(&reference, neighbours.clone());
    for (loss, steps) in [(0.3, 1200), (0.8, 4800)] {
        let (mut present, image) = stretched(&reference);
        // What each one holds of the others.
        let mut held: Vec<Vectors> = vec![present.clone(); COUNT];
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        for _ in 0..steps {
            let heard = heard(&mut rng, &neighbours, loss);
            for j in followers() {
                for bond in neighbours.bonds(j).filter(|&bond| heard[bond]) {
                    let k = neighbours.index[bond] as usize;
                    held[j].set(k, present.get(k));
                }
            }
            followers().for_each(|j| present.set(j, flock.target(j, &held[j])));
        }
        assert!(error(&present, &image) < 1e-12 * 20.0, "{} at loss {loss}", error(&present, &image));
    }
}

#[test]
fn a_mean_over_whoever_was_heard_ends_cells_away() {
    let (reference, neighbours) = square(Neighbourhood::First { keep: None });
    for loss in [0.3, 0.8] {
        let (mut present, image) = stretched(&reference);
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        let mut least = f64::INFINITY;
        for step in 0..2000 {
            let heard = heard(&mut rng, &neighbours, loss);
            let left = (0..COUNT).map(|j| {
                let bonds = neighbours.bonds(j).filter(|&bond| heard[bond]);
                bonds.map(|bond| neighbours.index[bond]).collect::<Vec<u32>>()
            });
            let flock = barycentre(&reference, Neighbours::from_lists(left));
            let seen = present.clone();
            followers().for_each(|j| present.set(j, flock.target(j, &seen)));
            if step >= 1000 {
                least = least.min(error(&present, &image));
            }
        }
        assert!(least > 0.5, "{least} at loss {loss}");
    }
}
