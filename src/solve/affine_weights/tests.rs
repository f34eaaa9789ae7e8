use nalgebra::{DMatrix, DVector};

use super::*;
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::vectors::distance;
use crate::solve::spectrum::scatter;

/// A patch of the lattice whose sites have at least 8 neighbours inside it.
fn patch(kind: LatticeKind, origin: [f64; 2], orientation: f64) -> (Vectors, Neighbours) {
    let neighbourhood = match kind {
        LatticeKind::Hexagonal { .. } | LatticeKind::Honeycomb { .. } => Neighbourhood::Second,
        _ => Neighbourhood::Chebyshev { radius: 1 },
    };
    let lattice = Lattice::new(kind, origin, orientation);
    let cut = Cut::Count { columns: 10, rows: 10 };
    let (body, neighbours) = Body::build(lattice, &cut, &neighbourhood, None).expect("fits");
    (Vectors::clone(&body.reference), neighbours)
}

/// How badly sum and place are missed, relative to the farthest neighbour.
fn residual(member: usize, reference: &Vectors, neighbours: &Neighbours, weights: &[f64]) -> f64 {
    let own = reference.get(member);
    let (mut sum, mut place, mut spread) = (0.0, [0.0; 2], 0.0f64);
    for bond in neighbours.bonds(member) {
        let other = reference.get(neighbours.index[bond] as usize);
        sum += weights[bond];
        place = [0, 1].map(|k| place[k] + weights[bond] * (other[k] - own[k]));
        spread = spread.max(distance(own, other));
    }
    f64::max(sum - 1.0, 1.0 - sum).max(place[0].hypot(place[1]) / spread)
}

fn nearest_of(places: &Vectors, count: usize) -> Neighbours {
    Neighbours::from_lists((0..places.len()).map(|j| {
        let mut others: Vec<u32> = (0..places.len() as u32).filter(|&k| k as usize != j).collect();
        let far = |k: &u32| distance(places.get(j), places.get(*k as usize));
        others.sort_by(|a, b| far(a).total_cmp(&far(b)));
        others.truncate(count);
        others
    }))
}

/// In a unit square at `origin`, in no order.
fn scattered(count: u64, seed: u64, origin: [f64; 2]) -> Vectors {
    let at = |k: u64| scatter(seed * 1000 + k);
    (0..count).map(|k| [origin[0] + at(2 * k), origin[1] + at(2 * k + 1)]).collect()
}

#[test]
fn those_left_around_a_particle_have_its_place_and_those_beside_it_alone_have_none() {
    let around = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]];
    let places: Vectors = [[0.0; 2]].into_iter().chain(around).collect();
    let neighbours = Neighbours::from_lists([vec![1, 2, 3, 4, 5], vec![], vec![], vec![], vec![], vec![]]);
    let mut solved = weights_of(0, &places, neighbours.of(0)).expect("solved");
    let flock = |weights: &[f64]| {
        let weights = Weights::Scalar(weights.to_vec());
        Flock::new(Rule::BARYCENTRE, places.clone().into(), neighbours.clone(), weights)
    };
    let left = |lost: &[usize]| of_those_left(&flock(&solved), 0, |k| !lost.contains(&k));
    for lost in [&[5][..], &[2, 4, 5], &[1]] {
        let weights = left(lost).expect("around it");
        let are_gone = lost.iter().all(|&k| weights[k - 1] == 0.0);
        assert!(are_gone && weights.iter().all(|&w| w >= 0.0), "{weights:?}");
        let sum =
            |of: &dyn Fn([f64; 2]) -> f64| weights.iter().zip(around).map(|(w, at)| w * of(at)).sum::<f64>();
        let off = [sum(&|_| 1.0) - 1.0, sum(&|[x, _]| x), sum(&|[_, y]| y)];
        assert!(off.iter().all(|x| x.abs() < 1e-12), "{lost:?}: {off:?}");
    }
    assert_eq!(left(&[2, 3]), None, "it lies beside them");
    assert_eq!(left(&[1, 2, 3, 4, 5]), None);
    // Weights that do not reproduce its place need not.
    solved.fill(1.0);
    assert_eq!(of_those_left(&flock(&solved), 0, |k| k != 1), None);
}

#[test]
fn every_member_of_every_lattice_s_patch_reproduces_its_place() {
    for kind in LatticeKind::SAMPLES {
        for origin in [[0.0, 0.0], [1e6, -1e6]] {
            for orientation in [0.0, 0.3] {
                let (reference, neighbours) = patch(kind, origin, orientation);
                let solved = solve(&reference, &neighbours, &vec![true; reference.len()]).expect("solved");
                // A few units in the last place of the coordinates, where those are coarser.
                let most = if origin == [0.0, 0.0] { 1e-12 } else { 4e-9 };
                for member in 0..reference.len() {
                    let missed = residual(member, &reference, &neighbours, &solved.weights);
                    assert!(missed <= most, "{kind:?} at {origin:?}: {missed} at {member}");
                }
            }
        }
    }
}

#[test]
fn far_from_the_origin_places_are_met_as_well_as_near_it() {
    // No neighbours on a line here, so nothing hangs on the last place of a coordinate.
    for seed in 0..20 {
        let places = scattered(60, seed, [1e6, 1e6]);
        let neighbours = nearest_of(&places, 8);
        let solved = solve(&places, &neighbours, &[true; 60]).expect("solved");
        for member in 0..60 {
            let missed = residual(member, &places, &neighbours, &solved.weights);
            let most = if solved.negative.contains(&member) { 1e-11 } else { 1e-12 };
            assert!(missed <= most, "{missed} at {member}");
        }
    }
}

#[test]
fn the_interior_of_a_square_lattice_has_equal_weights_to_the_bit() {
    let (reference, neighbours) = patch(LatticeKind::Square { spacing: 1.0 }, [0.0, 0.0], 0.0);
    let solved = solve(&reference, &neighbours, &[true; 100]).expect("solved");
    let mut interior = 0;
    for member in (0..100).filter(|&j| neighbours.of(j).len() == 8) {
        interior += 1;
        assert!(neighbours.bonds(member).all(|bond| solved.weights[bond] == 0.125));
    }
    assert_eq!(interior, 64);
    // Edges lie on the hull of their neighbours, corners outside.
    assert_eq!(solved.negative, [0, 9, 90, 99]);
    for bond in neighbours.bonds(5) {
        let along = [4, 6].contains(&neighbours.index[bond]);
        assert!((solved.weights[bond] - if along { 0.5 } else { 0.0 }).abs() < 1e-15);
        assert!(along || solved.weights[bond] == 0.0);
    }
}

#[test]
fn a_particle_among_its_neighbours_has_no_negative_weight_and_the_nearest_to_equal() {
    let (mut among, mut outside) = (0, 0);
    for seed in 0..400 {
        let count = 3 + seed % 6;
        // Uneven and off the middle, where weights set to zero must be let go again.
        let middle = [7, 11].map(|k| 0.9 * scatter(k * seed + 1));
        let power = 1 + 2 * (seed % 3) as i32;
        let places = scattered(count, seed, middle);
        let offsets: Vec<[f64; 2]> = places.iter().map(|[x, y]| [x.powi(power), y]).collect();
        let found = nearest(&offsets, 1.0).expect("no line");
        match best_of_all_supports(&offsets) {
            Some(best) => {
                among += 1;
                let off = found.iter().zip(&best).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
                assert!(off < 1e-9, "{found:?} instead of {best:?}");
                assert!(found.iter().all(|&w| w >= 0.0));
            }
            None => {
                outside += 1;
                assert!(found.iter().any(|&w| w < 0.0), "{found:?}");
            }
        }
    }
    assert!(among > 100 && outside > 100, "{among} among, {outside} outside");
}

/// The same by trying every set of weights that may be other than zero.
fn best_of_all_supports(offsets: &[[f64; 2]]) -> Option<Vec<f64>> {
    let count = offsets.len();
    let equal = 1.0 / count as f64;
    let mut best: Option<(f64, Vec<f64>)> = None;
    for support in 1u32..1 << count {
        let free: Vec<usize> = (0..count).filter(|k| support >> k & 1 == 1).collect();
        let rows = DMatrix::from_fn(3, free.len(), |i, k| if i == 0 { 1.0 } else { offsets[free[k]][i - 1] });
        let start = DVector::from_element(free.len(), equal);
        let missing = DVector::from_vec(vec![1.0, 0.0, 0.0]) - &rows * &start;
        let solution = &start + rows.clone().pseudo_inverse(1e-12).expect("finite") * missing;
        let met = (&rows * &solution - DVector::from_vec(vec![1.0, 0.0, 0.0])).norm() < 1e-9;
        if !met || solution.iter().any(|&w| w < -1e-12) {
            continue;
        }
        let mut weights = vec![0.0; count];
        free.iter().zip(solution.iter()).for_each(|(&k, &w)| weights[k] = w);
        let cost = weights.iter().map(|w| (w - equal).powi(2)).sum::<f64>();
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, weights));
        }
    }
    best.map(|(_, weights)| weights)
}

/// Sweeps until nothing moves, leaders where the map puts them.
fn at_rest(
    reference: &Vectors,
    neighbours: &Neighbours,
    weights: Vec<f64>,
    follows: &[bool],
    map: impl Fn([f64; 2]) -> [f64; 2],
) -> Vectors {
    let flock =
        Flock::new(Rule::BARYCENTRE, reference.clone().into(), neighbours.clone(), Weights::Scalar(weights));
    let mut present = reference.clone();
    for j in (0..follows.len()).filter(|&j| !follows[j]) {
        present.set(j, map(reference.get(j)));
    }
    for _ in 0..3000 {
        let mut next = present.clone();
        for j in (0..follows.len()).filter(|&j| follows[j]) {
            next.set(j, flock.target(j, &present));
        }
        present = next;
    }
    present
}

#[test]
fn an_affine_motion_of_the_leaders_is_followed_exactly_edges_included() {
    let map = |p: [f64; 2]| [0.4 * p[0] - 0.9 * p[1] + 3.0, 0.7 * p[0] + 1.1 * p[1] - 8.0];
    for kind in LatticeKind::SAMPLES {
        let (reference, neighbours) = patch(kind, [0.0, 0.0], 0.1);
        let count = reference.len();
        let alone = solve(&reference, &neighbours, &vec![true; count]).expect("solved");
        // A particle outside its neighbours leads.
        let follows: Vec<bool> = (0..count).map(|j| !alone.negative.contains(&j)).collect();
        let solved = solve(&reference, &neighbours, &follows).expect("solved");
        let followers = follows.iter().filter(|&&f| f).count();
        assert!(solved.negative.is_empty() && 4 * followers > 3 * count, "{followers} of {count}");
        let speed = settles(&solved.weights, &neighbours, &follows).expect("settles");
        assert!(speed.converged && speed.radius < 0.99, "{speed:?}");
        let rest = at_rest(&reference, &neighbours, solved.weights, &follows, map);
        for j in 0..count {
            let off = distance(rest.get(j), map(reference.get(j)));
            assert!(off < 1e-12 * 20.0, "{kind:?}: {off} at {j}");
        }
    }
}

#[test]
fn a_member_that_cannot_be_placed_is_named() {
    let reference: Vectors = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1.0]].into_iter().collect();
    let refused = |lists: [Vec<u32>; 4]| {
        let neighbours = Neighbours::from_lists(lists);
        solve(&reference, &neighbours, &[false, false, false, true]).expect_err("refused")
    };
    let error = refused([vec![], vec![], vec![], vec![0, 1, 2]]);
    assert!(matches!(error, WeightsError::Unreachable { member: 3, neighbours: 3, .. }), "{error}");
    let error = refused([vec![], vec![], vec![], vec![1]]);
    assert!(matches!(error, WeightsError::Unreachable { member: 3, neighbours: 1, .. }), "{error}");
    assert_eq!(refused([vec![], vec![], vec![], vec![]]), WeightsError::NoNeighbours { member: 3 });
}

#[test]
fn neighbours_nearly_on_a_line_are_refused_for_what_they_would_amplify() {
    let reference: Vectors = [[0.0, 0.0], [1.0, 1e-5], [2.0, 0.0], [1.0, 1.0]].into_iter().collect();
    let neighbours = Neighbours::from_lists([vec![], vec![], vec![], vec![0, 1, 2]]);
    let error = solve(&reference, &neighbours, &[false, false, false, true]).expect_err("refused");
    assert!(matches!(error, WeightsError::Amplifies { member: 3, .. }), "{error}");
    let mut reference = reference;
    reference.x[0] = f64::NAN;
    let error = solve(&reference, &neighbours, &[false, false, false, true]).expect_err("refused");
    assert_eq!(error, WeightsError::NotFinite { member: 3 });
}

#[test]
fn a_chain_on_a_line_is_placed_along_it() {
    let reference: Vectors = (0..5).map(|k| [0.3 * f64::from(k), 0.1 * f64::from(k)]).collect();
    let neighbours = Neighbours::from_lists([vec![], vec![0, 2], vec![1, 4], vec![2, 4], vec![]]);
    let solved = solve(&reference, &neighbours, &[false, true, true, true, false]).expect("solved");
    assert!((solved.weights[2] - 2.0 / 3.0).abs() < 1e-12, "{:?}", solved.weights);
}

#[test]
fn followers_that_no_leader_reaches_do_not_settle() {
    let neighbours = Neighbours::from_lists([vec![1, 3], vec![0], vec![3], vec![]]);
    let settled = |weights: &[f64]| settles(weights, &neighbours, &[true, true, true, false]);
    let half = settled(&[0.5, 0.5, 1.0, 1.0]).expect("the leader is seen");
    assert!((half.radius - 0.5f64.sqrt()).abs() < 1e-9, "{half:?}");
    let error = settled(&[1.0, 0.0, 1.0, 1.0]).expect_err("no follower sees the leader");
    assert!(
        matches!(error, WeightsError::DoesNotSettle { radius } if (radius - 1.0).abs() < 1e-9),
        "{error}"
    );
}
