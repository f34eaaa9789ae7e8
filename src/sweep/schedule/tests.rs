use super::super::{Sweep, Update};
use super::*;
use crate::flock::body::{Body, Cut};
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::law::{Flock, Weights};
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::role::Role;
use crate::flock::rules::Rule;
use crate::flock::vectors::Vectors;

struct Case {
    flock: Flock,
    roles: Vec<Role>,
    led: Vec<usize>,
}

impl Case {
    fn new(kind: LatticeKind, columns: usize, rows: usize) -> Self {
        let lattice = Lattice::new(kind, [0.0, 0.0], 0.1);
        let cut = Cut::Count { columns: columns as u32, rows: rows as u32 };
        let first = Neighbourhood::First { keep: None };
        let (body, neighbours) = Body::build(lattice, &cut, &first, None).expect("fits");
        let reference = body.reference;
        let mut roles = vec![Role::Follower; reference.len()];
        let held = rows.min(reference.len() / 4);
        roles[..held].fill(Role::Clamped);
        let led: Vec<usize> = (reference.len() - held..reference.len()).step_by(2).collect();
        led.iter().for_each(|&i| roles[i] = Role::Leader);
        let (rule, weights) = (Rule::BARYCENTRE, Weights::Equal);
        let mut flock = Flock::new(rule, reference, neighbours, weights);
        flock.keep_rest();
        Self { flock, roles, led }
    }

    /// The same with each list in another order, so that no run is made.
    fn jumbled(mut self) -> Self {
        let lists = (0..self.flock.reference.len()).map(|j| {
            let mut list = self.flock.neighbours.of(j).to_vec();
            let turn = j % list.len();
            list.rotate_left(turn);
            list
        });
        self.flock.neighbours = Neighbours::from_lists(lists);
        self.flock.rest = None;
        self.flock.keep_rest();
        self
    }

    /// Those of all that are led in each of some steps.
    fn places(&self, steps: impl IntoIterator<Item = usize>) -> Vec<[f64; 2]> {
        let of_step = |step: usize| (0..self.led.len()).map(move |which| self.place(which, step));
        steps.into_iter().flat_map(of_step).collect()
    }

    fn place(&self, which: usize, step: usize) -> [f64; 2] {
        let [x, y] = self.flock.reference.get(self.led[which]);
        [x + 0.1 * step.min(9) as f64, y + 0.003 * (which * step.min(20)) as f64]
    }

    /// Present positions, and those before the last step, after single steps of all particles.
    fn one_by_one(&self, steps: usize) -> [Vectors; 2] {
        let sweep = Sweep::compile(Update::default(), &self.flock, &self.roles);
        let mut present = Vectors::clone(&self.flock.reference);
        let mut next = present.clone();
        for step in 1..=steps {
            for which in 0..self.led.len() {
                next.set(self.led[which], self.place(which, step));
            }
            sweep.step(&self.flock, None, &present, &mut next);
            std::mem::swap(&mut present, &mut next);
        }
        [present, next]
    }

    /// The same by so many steps at once.
    fn together(&self, counts: &[usize], threads: usize) -> ([Vectors; 2], Activity) {
        let sweep = Sweep::compile(Update::default(), &self.flock, &self.roles);
        let mut present = Vectors::clone(&self.flock.reference);
        let mut next = present.clone();
        let (mut activity, mut done) = (Activity::default(), 0);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        for &count in counts {
            let led = Led { particles: &self.led, places: &self.places(done + 1..=done + count) };
            let rest = self.flock.rest.as_ref().map(Vectors::components);
            let (rows, terms) = (sweep.rows.as_ref().expect("affine"), sweep.terms.of(&self.flock));
            let force = self.flock.forces.as_ref().map(Vectors::components);
            let frame = None;
            let owned = 0..rows.band_count();
            let steps = Steps { rows, owned, terms, rest, force, frame, led, count, farther: None, threads };
            let even = present.components_mut();
            let odd = next.components_mut();
            pool.install(|| steps.take(&mut activity, even, odd));
            if count % 2 == 1 {
                std::mem::swap(&mut present, &mut next);
            }
            done += count;
        }
        ([present, next], activity)
    }
}

fn bits(places: &[Vectors; 2]) -> Vec<u64> {
    places.iter().flat_map(|p| p.x.iter().chain(&p.y)).map(|value| value.to_bits()).collect()
}

#[test]
fn steps_taken_together_have_the_bits_of_single_ones_for_any_threads() {
    for kind in LatticeKind::SAMPLES {
        // Long enough to be cut for the threads, and for one and several wedges at the cuts.
        let case = Case::new(kind, 9000, 61);
        let expected = case.one_by_one(25);
        for counts in [&[16usize, 9][..], &[1, 2, 3, 16, 3], &[1; 25]] {
            for threads in [1, 2, 4, 8] {
                let (places, _) = case.together(counts, threads);
                assert!(bits(&places) == bits(&expected), "{kind:?} {counts:?}, {threads} threads");
            }
        }
    }
}

#[test]
fn threads_beyond_one_a_coordinate_cut_the_body_in_segments() {
    let case = Case::new(LatticeKind::Square { spacing: 1.0 }, 9000, 61);
    let sweep = Sweep::compile(Update::default(), &case.flock, &case.roles);
    let rows = sweep.rows.as_ref().expect("affine");
    let segments = |threads| {
        let (led, count, farther) = (Led::NONE, 16, None);
        let (terms, rest, force, frame) = (Terms::NONE, None, None, None);
        let owned = 0..rows.band_count();
        let steps = Steps::<f64> { rows, owned, terms, rest, force, frame, led, count, farther, threads };
        steps.cuts(0..rows.band_count(), threads.div_ceil(2)).len() - 1
    };
    assert_eq!([1, 2, 4, 8].map(segments), [1, 1, 2, 4]);
}

#[test]
fn only_what_moves_is_swept_and_the_bits_are_the_same() {
    let square = LatticeKind::Square { spacing: 1.0 };
    let case = Case::new(square, 300, 61);
    let (places, activity) = case.together(&[16; 4], 1);
    assert!(bits(&places) == bits(&case.one_by_one(64)));
    // The front is 64 of 300 columns in.
    let share = activity.share_computed();
    assert!(share > 0.05 && share < 0.3, "{share}");
    // None led, and everything at rest: the first step finds that, and no other is computed.
    let resting = Case { led: Vec::new(), ..case };
    let (_, activity) = resting.together(&[1, 16, 16], 2);
    assert_eq!(activity.share_computed(), 1.0 / 33.0);
}

#[test]
fn motion_that_comes_from_either_end_is_met_in_time() {
    let mut case = Case::new(LatticeKind::Square { spacing: 1.0 }, 600, 61);
    for led in [(0..61).collect::<Vec<usize>>(), (0..61).chain(599 * 61..600 * 61).collect()] {
        case.roles.fill(Role::Follower);
        led.iter().for_each(|&i| case.roles[i] = Role::Leader);
        case.led = led;
        let (places, activity) = case.together(&[16, 16, 16, 9], 1);
        assert!(bits(&places) == bits(&case.one_by_one(57)));
        assert!(activity.share_computed() < 0.5, "{}", activity.share_computed());
    }
}

#[test]
fn a_body_in_which_some_see_far_is_stepped_all_the_same() {
    let mut case = Case::new(LatticeKind::Square { spacing: 1.0 }, 5000, 61);
    // The far end hears of the near one.
    let last = case.flock.reference.len() as u32 - 70;
    let lists: Vec<Vec<u32>> = (0..case.flock.reference.len())
        .map(|j| case.flock.neighbours.of(j).iter().copied().chain((j == 70).then_some(last)).collect())
        .collect();
    case.flock.neighbours = Neighbours::from_lists(lists);
    case.flock.rest = None;
    case.flock.keep_rest();
    let (places, activity) = case.together(&[16, 4], 3);
    assert!(bits(&places) == bits(&case.one_by_one(20)));
    assert_eq!(activity.share_computed(), 1.0);
}

#[test]
fn lists_are_swept_together_to_the_bits_of_single_steps_for_any_threads() {
    let case = Case::new(LatticeKind::Hexagonal { spacing: 1.0 }, 9000, 31).jumbled();
    let compiled = |case: &Case| {
        let sweep = Sweep::compile(Update::default(), &case.flock, &case.roles);
        sweep.rows.expect("affine").share_in_runs()
    };
    assert_eq!(compiled(&case), 0.0);
    let expected = case.one_by_one(25);
    for threads in [1, 2, 5] {
        let (places, activity) = case.together(&[16, 9], threads);
        assert!(bits(&places) == bits(&expected), "{threads} threads");
        assert!(activity.share_computed() < 0.5);
    }
}

#[test]
fn steps_report_whether_a_particle_moved_farther_than_the_limit() {
    let case = Case::new(LatticeKind::Square { spacing: 1.0 }, 12, 12);
    let sweep = Sweep::compile(Update::default(), &case.flock, &case.roles);
    let mut present = Vectors::clone(&case.flock.reference);
    let mut next = present.clone();
    let led = Led { particles: &case.led, places: &case.places([0, 0, 1, 1, 1]) };
    let places = (&mut present, &mut next);
    let farther = sweep.steps(&case.flock, None, places, (5, led, Some(0.09)), &mut Activity::default());
    // The leaders jump by 0.1 in the third; followers move by less.
    assert_eq!(farther, [false, false, true, false, false]);
}

#[test]
fn a_particle_that_moved_far_is_reported_wherever_it_is() {
    for axis in [0, 1] {
        let case = Case::new(LatticeKind::Square { spacing: 1.0 }, 300, 61);
        let sweep = Sweep::compile(Update::default(), &case.flock, &case.roles);
        let mut present = Vectors::clone(&case.flock.reference);
        let far = 61 * 5 + 30;
        let [x, y] = present.get(far);
        present.set(far, if axis == 0 { [x + 1.0, y] } else { [x, y + 1.0] });
        let (mut next, places) = (present.clone(), &mut present);
        let farther = sweep.steps(
            &case.flock,
            None,
            (places, &mut next),
            (4, Led::NONE, Some(0.3)),
            &mut Activity::default(),
        );
        assert_eq!(farther[..2], [true, false], "axis {axis}");
    }
}

#[test]
fn lists_where_one_coordinate_alone_moves_are_swept() {
    let case = Case::new(LatticeKind::Square { spacing: 1.0 }, 300, 61);
    let still = Case { led: Vec::new(), ..case.jumbled() };
    for axis in [0, 1] {
        let sweep = Sweep::compile(Update::default(), &still.flock, &still.roles);
        let mut start = Vectors::clone(&still.flock.reference);
        let displaced = 61 * 150 + 30;
        let [x, y] = start.get(displaced);
        start.set(displaced, if axis == 0 { [x + 1.0, y] } else { [x, y + 1.0] });
        let (mut one_by_one, mut next) = (start.clone(), start.clone());
        for _ in 0..8 {
            sweep.step(&still.flock, None, &one_by_one, &mut next);
            std::mem::swap(&mut one_by_one, &mut next);
        }
        let (mut together, mut activity) = (start.clone(), Activity::default());
        let mut next = start;
        for count in [1, 3, 4] {
            let places = (&mut together, &mut next);
            sweep.steps(&still.flock, None, places, (count, Led::NONE, None), &mut activity);
        }
        assert_eq!(together, one_by_one, "axis {axis}");
        assert!(activity.share_computed() < 0.5);
    }
}
