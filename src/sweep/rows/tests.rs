use super::*;
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::rules::Rule;
use crate::geometry::shape::Shape;

/// Numbers that look random, of very different sizes and both signs, with zeros of both signs.
fn rough(count: usize, seed: u64) -> Vectors {
    let mut state = seed;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let fraction = (state >> 12) as f64 / (1u64 << 52) as f64 - 0.5;
        match (state >> 58) % 8 {
            0 => -0.0,
            1 => 1e6 * fraction,
            2 => -5e-324,
            _ => fraction,
        }
    };
    (0..count).map(|_| [draw(), draw()]).collect()
}

fn lay(lattice: LatticeKind, cut: &Cut, neighbourhood: &Neighbourhood) -> Flock {
    let lattice = Lattice::new(lattice, [0.0, 0.0], 0.3);
    let (body, neighbours) = Body::build(lattice, cut, neighbourhood, None).expect("fits");
    Flock::new(Rule::BARYCENTRE, body.reference, neighbours, Weights::Equal)
}

fn disc_with_hole() -> Cut {
    let disc = |radius| Shape::Disc { centre: [0.0, 0.0], radius };
    Cut::Shape(Shape::WithHoles { body: Box::new(disc(23.0)), holes: vec![disc(6.0)] })
}

/// Sweeps all bands, in two pieces.
fn sweep(rows: &Rows, flock: &Flock, present: &Vectors, next: &mut Vectors) {
    let (bands, rest) = (rows.band_count(), flock.rest.as_ref());
    for piece in [0..bands / 2, bands / 2..bands] {
        let of = |axis, present, rest, next| Component {
            axis,
            seen_from: 0,
            present,
            rest,
            force: None,
            begin: 0,
            next,
        };
        let mut components = [
            of(0, &present.x, rest.map(|r| &r.x[..]), &mut next.x[..]),
            of(1, &present.y, rest.map(|r| &r.y[..]), &mut next.y[..]),
        ];
        rows.sweep(piece, 64, &mut components, &Terms::NONE);
    }
}

/// Sweeps with the rows and compares every bit with the rule; a particle that does not follow keeps
/// its mark. Returns the share in runs.
fn compare(flock: &Flock, held: impl Fn(usize) -> bool, what: &str) -> f64 {
    const MARK: f64 = 12345.0;
    let count = flock.reference.len();
    let follows: Vec<bool> = (0..count).map(|j| !held(j)).collect();
    let rows = Rows::compile(flock, &follows, Share::whole()).expect("a barycentre");
    let present = rough(count, 1);
    let mut next = Vectors { x: vec![MARK; count], y: vec![MARK; count] };
    sweep(&rows, flock, &present, &mut next);
    for (j, &follows) in follows.iter().enumerate() {
        let expected = if follows { flock.target(j, &present) } else { [MARK; 2] };
        let bits = |point: [f64; 2]| point.map(f64::to_bits);
        assert_eq!(bits(next.get(j)), bits(expected), "particle {j} of {count}, {what}: {expected:?}");
    }
    rows.share_in_runs()
}

#[test]
fn every_lattice_and_neighbourhood_gives_the_bits_of_the_rule() {
    use Neighbourhood::{Chebyshev, First, Second, Within};
    let everywhere = [
        First { keep: None },
        First { keep: Some(3) },
        Second,
        Within { radius: 1.9 },
        Within { radius: 3.1 },
    ];
    let rings = [Chebyshev { radius: 1 }, Chebyshev { radius: 2 }];
    for kind in LatticeKind::SAMPLES {
        let ringed = !matches!(kind, LatticeKind::Honeycomb { .. });
        for neighbourhood in everywhere.iter().chain(rings.iter().filter(|_| ringed)) {
            for cut in [disc_with_hole(), Cut::Count { columns: 9, rows: 300 }] {
                let mut flock = lay(kind, &cut, neighbourhood);
                let what = format!("{kind:?} {neighbourhood:?}");
                compare(&flock, |j| j % 97 == 5, &what);
                flock.rest = Some(rough(flock.reference.len(), 2));
                compare(&flock, |j| j % 97 == 5, &format!("{what} with rest offsets"));
            }
        }
    }
}

#[test]
fn the_rest_offset_of_a_single_particle_is_added() {
    let square = LatticeKind::Square { spacing: 1.0 };
    let mut flock = lay(square, &Cut::Count { columns: 20, rows: 20 }, &Neighbourhood::First { keep: None });
    for column in [1, 9, 18] {
        let mut rest = Vectors::zeros(400);
        rest.set(20 * column + 7, [0.5, -0.25]);
        flock.rest = Some(rest);
        let share = compare(&flock, |_| false, "one with an offset");
        assert!(share > 0.8, "{share}");
    }
}

#[test]
fn numbers_of_neighbours_without_loops_of_their_own_give_the_bits_of_the_rule() {
    for kind in LatticeKind::SAMPLES.into_iter().filter(|kind| !matches!(kind, LatticeKind::Honeycomb { .. }))
    {
        let near = Lattice::new(kind, [0.0, 0.0], 0.0).offsets_within(0, 3.0);
        for count in [1, 2, 7, 9, 10] {
            let neighbourhood = Neighbourhood::Offsets(near[..count].to_vec());
            let mut flock = lay(kind, &disc_with_hole(), &neighbourhood);
            compare(&flock, |_| false, &format!("{kind:?}, {count} neighbours"));
            flock.rest = Some(rough(flock.reference.len(), 3));
            compare(&flock, |_| false, &format!("{kind:?}, {count} neighbours with rest offsets"));
        }
    }
}

#[test]
fn a_body_larger_than_the_caches_gives_the_bits_of_the_rule_and_is_nearly_all_runs() {
    let square = LatticeKind::Square { spacing: 1.0 };
    let cut = Cut::Count { columns: 521, rows: 601 };
    let flock = lay(square, &cut, &Neighbourhood::First { keep: None });
    for (held, what) in [(usize::MAX, "all follow"), (300, "a row is held")] {
        let share = compare(&flock, |j| j % 601 == held, what);
        assert!(share > 0.99, "{share}, {what}");
    }
}

#[test]
fn a_mean_of_negative_zeros_and_a_particle_without_neighbours_give_the_bits_of_the_rule() {
    // Particles 1 to 20 see the one before them, the others none.
    let lists = (0..22u32).map(|j| (1..21).contains(&j).then(|| j - 1));
    let flock = Flock::new(
        Rule::BARYCENTRE,
        Vectors::zeros(22).into(),
        Neighbours::from_lists(lists),
        Weights::Equal,
    );
    let all_rest = Flock { rest: Some(Vectors { x: vec![1.0; 22], y: vec![1.0; 22] }), ..flock.clone() };
    let rows = Rows::compile(&all_rest, &[true; 22], Share::whole()).expect("a barycentre");
    assert!(rows.share_in_runs() > 0.9);
    let negative = || vec![-0.0; 22];
    let present = Vectors { x: negative(), y: negative() };
    let positive = Some(Vectors::zeros(22));
    for rest in [None, Some(present.clone()), positive] {
        let flock = Flock { rest, ..flock.clone() };
        let mut next = Vectors { x: vec![7.0; 22], y: vec![7.0; 22] };
        sweep(&rows, &flock, &present, &mut next);
        for j in 0..22 {
            let bits = |point: [f64; 2]| point.map(f64::to_bits);
            assert_eq!(bits(next.get(j)), bits(flock.target(j, &present)), "particle {j}");
        }
    }
}
