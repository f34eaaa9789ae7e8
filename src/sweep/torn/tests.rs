use super::super::kernel::Component;
use super::*;
use crate::flock::fracture::Ghosts;
use crate::flock::fracture::tests::{Draws, bodies};
use crate::flock::law::Flock;
use crate::geometry::shape::Segment;

/// Sweeps the torn in two pieces and compares every bit with the rule; no other is touched. Returns how many are torn.
fn compare_targets(
    torn: &DamagedRows,
    body: &Flock,
    follows: &[bool],
    draws: &mut Draws,
    what: &str,
) -> usize {
    const MARK: f64 = 12345.0;
    let Flock { neighbours, reference, .. } = body;
    let bonds = body.bonds.as_ref().expect("has bonds");
    let count = reference.len();
    let mut present = draws.points(reference, 0.7);
    (0..count).step_by(9).for_each(|j| present.x[j] = -0.0);
    let rests = body.rest.as_ref().map(Vectors::components);
    let mut next = Vectors { x: vec![MARK; count], y: vec![MARK; count] };
    let middle = BANDS / 2 * count / BANDS;
    let (low, high) = (next.x.split_at_mut(middle), next.y.split_at_mut(middle));
    // The second piece sees no more than the second half of the first.
    let reach = (0..count).flat_map(|j| neighbours.of(j).iter().map(move |&k| j.abs_diff(k as usize))).max();
    let from = middle - reach.expect("has neighbours").min(middle);
    for (bands, begin, seen_from, x, y) in
        [(0..BANDS / 2, 0, 0, low.0, high.0), (BANDS / 2..BANDS, middle, from, low.1, high.1)]
    {
        let [rest_x, rest_y] = [0, 1].map(|axis| rests.map(|rests| rests[axis]));
        let mut components = [
            Component {
                axis: 0,
                seen_from,
                present: &present.x[seen_from..],
                rest: rest_x,
                force: None,
                begin,
                next: x,
            },
            Component {
                axis: 1,
                seen_from,
                present: &present.y[seen_from..],
                rest: rest_y,
                force: None,
                begin,
                next: y,
            },
        ];
        torn.sweep(bands, reference, &mut components);
    }
    let is_torn = |j: usize| follows[j] && bonds.is_torn(j, neighbours);
    for j in 0..count {
        let expected = if is_torn(j) { body.target(j, &present) } else { [MARK; 2] };
        assert_eq!(
            next.get(j).map(f64::to_bits),
            expected.map(f64::to_bits),
            "{what}, particle {j}: {expected:?}"
        );
    }
    let torn_ones = (0..count).filter(|&j| is_torn(j)).count();
    assert_eq!(torn.len(), torn_ones, "{what}");
    torn_ones
}

const BANDS: usize = 7;

#[test]
fn torn_particles_are_swept_to_the_bits_of_the_rule_as_cracks_spread() {
    let mut draws = Draws(5);
    for (what, mut body) in bodies() {
        for ghosts in [Ghosts::Lattice, Ghosts::Mirrored, Ghosts::None] {
            let what = format!("{what}, {ghosts:?}");
            let count = body.reference.len();
            let follows: Vec<bool> = (0..count).map(|j| j % 43 != 11).collect();
            body.rest = (ghosts != Ghosts::Mirrored).then(|| draws.points(&Vectors::zeros(count), 0.1));
            let mut bonds = Bonds::new(None, ghosts, &body.neighbours);
            let mut torn =
                DamagedRows::new((0..BANDS).map(|band| band * count / BANDS..(band + 1) * count / BANDS));
            assert!(torn.is_empty());
            let cuts: [Segment; 3] =
                [([-3.3, -90.0], [-3.3, 90.0]), ([-90.0, 1.2], [90.0, 1.4]), ([0.0, 0.0], [90.0, 80.0])];
            for cut in cuts {
                let mut breaks = Vec::new();
                bonds.cut(cut, &body.neighbours, &body.reference, &mut breaks);
                let particles: Vec<usize> = breaks.iter().flat_map(|b| b.pair).map(|j| j as usize).collect();
                let places = (&bonds, &body.neighbours, &*body.reference);
                torn.renew(particles, &follows, places);
                body.bonds = Some(bonds.clone());
                let torn_ones = compare_targets(&torn, &body, &follows, &mut draws, &what);
                assert!(torn_ones > 20 && !torn.is_empty(), "{what}: {torn_ones}");
            }
            // Here and there, half of all, and all.
            for share in [0.05, 0.5, 1.0] {
                let draw: Vec<bool> =
                    (0..body.neighbours.index.len()).map(|_| draws.next() < share).collect();
                bonds.set_broken(|bond| draw[bond]);
                let places = (&bonds, &body.neighbours, &*body.reference);
                torn.renew(0..count, &follows, places);
                body.bonds = Some(bonds.clone());
                compare_targets(&torn, &body, &follows, &mut draws, &what);
            }
        }
    }
}
