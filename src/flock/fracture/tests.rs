use super::super::body::{Body, Cut};
use super::super::lattice::{Lattice, LatticeKind};
use super::super::law::{Flock, Weights};
use super::super::neighbourhood::Neighbourhood;
use super::super::rules::Rule;
use super::*;
use crate::geometry::shape::Shape;

/// Numbers in 0..1 that look random.
pub(crate) struct Draws(pub u64);

impl Draws {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn points(&mut self, around: &Vectors, by: f64) -> Vectors {
        around.iter().map(|[x, y]| [x + by * (self.next() - 0.5), y + by * (self.next() - 0.5)]).collect()
    }
}

fn lay(kind: LatticeKind, neighbourhood: &Neighbourhood, origin: [f64; 2]) -> Flock {
    let disc = |radius| Shape::Disc { centre: [0.0, 0.0], radius };
    let cut = Cut::Shape(Shape::WithHoles { body: Box::new(disc(21.0)), holes: vec![disc(5.0)] });
    let (body, neighbours) =
        Body::build(Lattice::new(kind, origin, 0.3), &cut, neighbourhood, None).expect("fits");
    Flock::new(Rule::BARYCENTRE, body.reference, neighbours, Weights::Equal)
}

/// The bodies that the tests go over: lattices, and lattices a bit out of place where some are seen without seeing.
pub(crate) fn bodies() -> impl Iterator<Item = (String, Flock)> {
    let neighbourhoods = [
        Neighbourhood::First { keep: None },
        Neighbourhood::First { keep: Some(3) },
        Neighbourhood::Within { radius: 2.1 },
    ];
    LatticeKind::SAMPLES.into_iter().flat_map(move |kind| {
        neighbourhoods.clone().into_iter().flat_map(move |neighbourhood| {
            [false, true].map(|one_sided| {
                let mut body = lay(kind, &neighbourhood, [0.0, 0.0]);
                if one_sided {
                    body.reference = Draws(3).points(&body.reference, 0.1).into();
                    let lists = (0..body.neighbours.count())
                        .map(|j| if j % 31 == 7 { Vec::new() } else { body.neighbours.of(j).to_vec() });
                    body.neighbours = Neighbours::from_lists(lists);
                }
                (format!("{kind:?} {neighbourhood:?}, one-sided: {one_sided}"), body)
            })
        })
    })
}

/// The same as [`Bonds::break_stretched`], each bond measured for itself.
fn break_one_by_one(
    broken: &mut [bool],
    (step, threshold): (usize, Threshold),
    neighbours: &Neighbours,
    (reference, present): (&Vectors, &Vectors),
    roles: &[Role],
) -> Vec<Break> {
    let back = |j: usize, k: usize| neighbours.bonds(k).find(|&bond| neighbours.index[bond] as usize == j);
    let all_mutual =
        (0..neighbours.count()).all(|j| neighbours.of(j).iter().all(|&k| back(j, k as usize).is_some()));
    let mut breaks = Vec::new();
    for j in 0..neighbours.count() {
        for bond in neighbours.bonds(j) {
            let k = neighbours.index[bond] as usize;
            let between = |at: &Vectors| distance(at.get(j), at.get(k));
            let length = between(present);
            let is_looked_after = (j < k || !all_mutual) && roles[k].is_body();
            if broken[bond] || !is_looked_after || !threshold.is_passed(length, between(reference)) {
                continue;
            }
            broken[bond] = true;
            if let Some(back) = back(j, k).filter(|_| all_mutual) {
                broken[back] = true;
            }
            if j < k || back(j, k).is_none() {
                let pair = [j.min(k) as u32, j.max(k) as u32];
                let [a, b] = [reference.get(j), reference.get(k)];
                let place = [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
                breaks.push(Break { step, pair, place, length });
            }
        }
    }
    breaks
}

/// Takes some steps of random stretching, some of which no number survives, and compares with one by one. Gives how
/// many bonds broke.
fn compare_breaks(body: &Flock, threshold: Threshold, scale: f64, what: &str) -> usize {
    let Flock { neighbours, reference, .. } = body;
    let mut draws = Draws(11);
    let mut roles = vec![Role::Follower; neighbours.count()];
    roles.iter_mut().skip(3).step_by(17).for_each(|role| *role = Role::Frame);
    let mut bonds = Bonds::new(Some(threshold), Ghosts::Lattice, neighbours);
    let mut cuts = Vec::new();
    bonds.cut(([-3.2 * scale, -90.0 * scale], [9.1 * scale, 90.0 * scale]), neighbours, reference, &mut cuts);
    let mut broken: Vec<bool> = (0..neighbours.index.len()).map(|bond| bonds.is_broken(bond)).collect();
    for step in 0..8 {
        let mut present = draws.points(reference, scale * [0.0, 0.02, 0.1, 0.3, 0.5, 0.6, 0.8, 1.1][step]);
        match step {
            4 => present.set(50, [f64::NAN, 0.0]),
            5 => present.set(70, [f64::INFINITY, 1.0]),
            // A frame point becomes matter.
            6 => roles[3] = Role::Follower,
            // As after a restart: some are mended, others broken.
            7 => {
                broken.iter_mut().step_by(5).for_each(|broken| *broken = !*broken);
                bonds.set_broken(|bond| broken[bond]);
            }
            _ => {}
        }
        let places = (&**reference, &present);
        let expected = break_one_by_one(&mut broken, (step, threshold), neighbours, places, &roles);
        let mut breaks = Vec::new();
        bonds.break_stretched(step, neighbours, places, &roles, &mut breaks);
        assert_eq!(breaks, expected, "{what}, {threshold:?}, step {step}");
        let differ = (0..broken.len()).find(|&bond| bonds.is_broken(bond) != broken[bond]);
        assert_eq!(differ, None, "{what}, {threshold:?}, step {step}");
    }
    broken.iter().filter(|&&broken| broken).count()
}

#[test]
fn every_body_breaks_like_one_measured_bond_by_bond() {
    for (what, body) in bodies() {
        for threshold in [Threshold::Distance(1.4), Threshold::Stretch(1.25)] {
            let count = compare_breaks(&body, threshold, 1.0, &what);
            assert!(count > 100 && count < body.neighbours.index.len(), "{what}: {count} broke");
        }
    }
}

#[test]
fn a_body_whose_squares_overflow_or_vanish_breaks_like_one_measured_bond_by_bond() {
    let body = lay(LatticeKind::Hexagonal { spacing: 1.0 }, &Neighbourhood::First { keep: None }, [0.1, 0.7]);
    for scale in [1e-300, 1e-160, 1e-153, 1e153, 1e154, 1e200] {
        let reference: Vectors = body.reference.iter().map(|[x, y]| [scale * x, scale * y]).collect();
        let body = Flock { reference: reference.into(), ..body.clone() };
        for threshold in [Threshold::Distance(1.3 * scale), Threshold::Stretch(1.25)] {
            let count = compare_breaks(&body, threshold, scale, &format!("scaled by {scale:e}"));
            assert!(count > 100 && count < body.neighbours.index.len(), "{scale:e}: {count} broke");
        }
    }
}

#[test]
fn a_bond_at_its_limit_to_the_bit_holds_and_beyond_it_breaks_wherever_it_lies_in_a_row() {
    // Rows of 150 bonds of one distance, of which one is stretched.
    let lists = (0..300u32).map(|j| if j % 2 == 0 { vec![j + 1] } else { vec![j - 1] });
    let neighbours = Neighbours::from_lists(lists);
    let long = Neighbours::from_lists((0..300u32).map(|j| vec![(j + 150) % 300]));
    let reference: Vectors = (0..300).map(|j| [0.0, f64::from(j % 2)]).collect();
    let apart: Vectors = (0..300).map(|j| [0.0, f64::from(j / 150)]).collect();
    for (neighbours, reference) in [(neighbours, reference), (long, apart)] {
        for which in [0, 63, 64, 127, 128, 149] {
            let upper = (0..300).filter(|&j| reference.y[j] == 1.0).nth(which).expect("150 of them");
            let lower = neighbours.of(upper)[0];
            for (length, breaks) in [(1.3, false), (1.3f64.next_up(), true), (f64::NAN, false)] {
                let mut present = reference.clone();
                present.y[upper] = length;
                for threshold in [Threshold::Distance(1.3), Threshold::Stretch(1.3)] {
                    let mut bonds = Bonds::new(Some(threshold), Ghosts::None, &neighbours);
                    let mut broken = Vec::new();
                    let roles = [Role::Follower; 300];
                    bonds.break_stretched(1, &neighbours, (&reference, &present), &roles, &mut broken);
                    let pairs: Vec<[u32; 2]> = broken.iter().map(|b| b.pair).collect();
                    let [low, high] = [lower.min(upper as u32), lower.max(upper as u32)];
                    assert_eq!(pairs, if breaks { vec![[low, high]] } else { vec![] }, "{which} {length}");
                }
            }
        }
    }
}

/// Three particles in a row; the outer two see the middle one, which sees both.
fn row() -> (Neighbours, Vectors) {
    let neighbours = Neighbours::from_lists([vec![1], vec![0, 2], vec![1]]);
    (neighbours, [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]].into_iter().collect())
}

#[test]
fn a_bond_past_the_distance_breaks_once_and_for_both() {
    let (neighbours, reference) = row();
    let mut bonds = Bonds::new(Some(Threshold::Distance(1.5)), Ghosts::None, &neighbours);
    let mut present = reference.clone();
    present.x[2] = 3.0;
    let mut breaks = Vec::new();
    let roles = [Role::Follower; 3];
    bonds.break_stretched(4, &neighbours, (&reference, &present), &roles, &mut breaks);
    bonds.break_stretched(5, &neighbours, (&reference, &reference), &roles, &mut breaks);
    assert_eq!(breaks, [Break { step: 4, pair: [1, 2], place: [1.5, 0.0], length: 2.0 }]);
    assert_eq!((0..4).map(|b| bonds.is_broken(b)).collect::<Vec<_>>(), [false, false, true, true]);
}

#[test]
fn a_stretch_threshold_is_relative_to_the_bond() {
    assert!(Threshold::Stretch(1.5).is_passed(3.1, 2.0));
    assert!(!Threshold::Stretch(1.5).is_passed(2.9, 2.0));
}

#[test]
fn each_kind_of_ghost_stands_in_its_own_place() {
    let (neighbours, reference) = row();
    let mut present = reference.clone();
    present.x[0] = -0.5;
    present.x[1] = 1.25;
    let ghost = |ghosts| {
        let mut bonds = Bonds::new(None, ghosts, &neighbours);
        bonds.cut(([1.5, -1.0], [1.5, 1.0]), &neighbours, &reference, &mut Vec::new());
        bonds.ghost(1, 2, &neighbours, &reference, &present)
    };
    assert_eq!(ghost(Ghosts::Lattice), Some([2.25, 0.0]));
    assert_eq!(ghost(Ghosts::Mirrored), Some([3.0, 0.0]));
    assert_eq!(ghost(Ghosts::None), None);
}

#[test]
fn a_ghost_loses_all_its_bonds() {
    let (neighbours, reference) = row();
    let mut bonds = Bonds::new(None, Ghosts::Lattice, &neighbours);
    let roles = [Role::Follower, Role::Ghost, Role::Follower];
    let mut breaks = Vec::new();
    bonds.release_ghosts(2, &neighbours, (&reference, &reference), &roles, &mut breaks);
    assert_eq!(breaks.len(), 2);
    assert!((0..4).all(|b| bonds.is_broken(b)));
}

#[test]
fn a_bond_is_measured_exactly_where_its_square_is_too_coarse() {
    // At the threshold to the last bit, just beyond it, and where squares overflow or vanish.
    for scale in [1e-200, 1.0, 1e200] {
        let neighbours = Neighbours::from_lists([vec![1], vec![0]]);
        let reference: Vectors = [[0.0, 0.0], [scale, 0.0]].into_iter().collect();
        for threshold in [Threshold::Distance(1.3 * scale), Threshold::Stretch(1.3)] {
            let limit = 1.3 * scale;
            for (length, breaks) in [(limit, false), (limit.next_up(), true), (0.99 * limit, false)] {
                let present: Vectors = [[0.0, 0.0], [0.0, length]].into_iter().collect();
                let mut bonds = Bonds::new(Some(threshold), Ghosts::None, &neighbours);
                let (roles, mut broken) = ([Role::Follower; 2], Vec::new());
                bonds.break_stretched(1, &neighbours, (&reference, &present), &roles, &mut broken);
                assert_eq!(broken.len(), usize::from(breaks), "{threshold:?} {length:e}");
                assert!(bonds.is_broken(0) == breaks && bonds.is_broken(1) == breaks);
            }
        }
    }
}

#[test]
fn a_bond_is_held_to_its_own_limit_among_others_whose_limits_are_nearly_the_same() {
    // Each bond of the row is shorter than the one before by less than what parts two spans.
    let mut at = 0.0;
    let row: Vectors = (0..400)
        .map(|i| {
            at += 1.0 - 4e-7 * f64::from(i);
            [at, 0.0]
        })
        .collect();
    let count = row.len() as u32;
    let lists = (0..count).map(|j| (j.saturating_sub(1)..(j + 2).min(count)).filter(move |&k| k != j));
    let neighbours = Neighbours::from_lists(lists);
    for last in 380..399 {
        let mut present = row.clone();
        // Longer than this bond may be, and shorter than the one before.
        let longer = (1.5 * (1.0 + 1e-7) - 1.0) * (row.x[last + 1] - row.x[last]);
        (last + 1..400).for_each(|i| present.x[i] += longer);
        let mut breaks = Vec::new();
        let mut bonds = Bonds::new(Some(Threshold::Stretch(1.5)), Ghosts::None, &neighbours);
        bonds.break_stretched(1, &neighbours, (&row, &present), &[Role::Follower; 400], &mut breaks);
        assert_eq!(breaks.iter().map(|b| b.pair).collect::<Vec<_>>(), [[last as u32, last as u32 + 1]]);
    }
}

#[test]
fn a_bond_whose_square_is_hardly_a_number_any_more_is_measured_exactly() {
    let neighbours = Neighbours::from_lists([vec![1], vec![0]]);
    // The square of such a length has a few bits only.
    for scale in [1e-160, 3e-162, 1.1e-161] {
        let reference: Vectors = [[0.0, 0.0], [scale, 0.0]].into_iter().collect();
        for parts in 1..2000 {
            let (length, angle) = (1.3 * scale * (1.0 + 1e-6 * f64::from(parts)), 0.01 * f64::from(parts));
            let present: Vectors =
                [[0.0, 0.0], [length * angle.cos(), length * angle.sin()]].into_iter().collect();
            let mut bonds = Bonds::new(Some(Threshold::Stretch(1.3)), Ghosts::None, &neighbours);
            let (roles, mut breaks) = ([Role::Follower; 2], Vec::new());
            bonds.break_stretched(1, &neighbours, (&reference, &present), &roles, &mut breaks);
            let is_passed = distance(present.get(0), present.get(1)) > 1.3 * scale;
            assert_eq!(breaks.len(), usize::from(is_passed), "{length:e} at {angle}");
        }
    }
}
