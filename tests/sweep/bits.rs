//! The same bits over threads, kernels and blockings, and those that are written down here.

use flockform::continuum::digest::fnv1a;
use flockform::flock::body::{Body, Cut};
use flockform::flock::frame::{Frame, FrameRule};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::law::{Flock, Weights};
use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::role::Role;
use flockform::flock::rules::Rule;
use flockform::flock::vectors::Vectors;
use flockform::sweep::{Activity, Led, MOST_STEPS, Sweep, Update};

const STEPS: usize = 50;

/// Columns of the body, of so many rows each: enough for threads to share it, and for a front to run through it.
const SIDES: [usize; 2] = [4003, 67];

/// A body held on the left and pulled on the right.
struct Pulled {
    flock: Flock,
    frame: Option<Frame>,
    roles: Vec<Role>,
    led: Vec<usize>,
}

impl Pulled {
    fn new(kind: LatticeKind, frame: Option<FrameRule>) -> Self {
        let cut = Cut::Count { columns: SIDES[0] as u32, rows: SIDES[1] as u32 };
        let lattice = Lattice::new(kind, [0.0; 2], 0.0);
        let (body, neighbours) =
            Body::build(lattice, &cut, &Neighbourhood::First { keep: None }, frame).expect("fits");
        let (reference, frame) = (body.reference, body.frame);
        let mut roles = vec![Role::Follower; reference.len()];
        frame.iter().flat_map(|frame| &frame.points).for_each(|&point| roles[point as usize] = Role::Frame);
        let mut matter: Vec<usize> = (0..reference.len()).filter(|&i| roles[i] == Role::Follower).collect();
        let led = matter.split_off(matter.len() - SIDES[1]);
        matter[..SIDES[1]].iter().for_each(|&i| roles[i] = Role::Clamped);
        led.iter().for_each(|&i| roles[i] = Role::Leader);
        let (rule, weights) = (Rule::BARYCENTRE, Weights::Equal);
        let mut flock = Flock::new(rule, reference, neighbours, weights);
        flock.keep_rest();
        Self { flock, frame, roles, led }
    }

    /// Where a leader stands; nothing but sums and products, which every machine rounds alike.
    fn place(&self, which: usize, step: usize) -> [f64; 2] {
        let [x, y] = self.flock.reference.get(self.led[which]);
        [x + 0.25 * step.min(9) as f64, y + 0.001 * (which * step.min(30)) as f64]
    }

    /// Everybody displaced, so that every particle moves in every step.
    fn start(&self) -> Vectors {
        let far = |i: usize| f64::from((i * 7919 % 1013) as u32) / 1024.0;
        self.flock.reference.iter().enumerate().map(|(i, [x, y])| [x + far(i), y - far(i + 5)]).collect()
    }

    /// By one step at a time, which `step` takes.
    fn singly(&self, mut step: impl FnMut(&Vectors, &mut Vectors)) -> u64 {
        let mut present = self.start();
        let mut next = present.clone();
        for number in 1..=STEPS {
            (0..self.led.len()).for_each(|which| next.set(self.led[which], self.place(which, number)));
            step(&present, &mut next);
            std::mem::swap(&mut present, &mut next);
        }
        hash(&present)
    }

    /// By at most so many steps together.
    fn together(&self, most: usize) -> u64 {
        let sweep = Sweep::compile(Update::default(), &self.flock, &self.roles);
        let (mut present, mut activity, mut done) = (self.start(), Activity::default(), 0);
        let mut next = present.clone();
        while done < STEPS {
            let count = most.min(STEPS - done);
            let place = |step: usize| (0..self.led.len()).map(move |which| self.place(which, step));
            let places: Vec<[f64; 2]> = (done + 1..=done + count).flat_map(place).collect();
            let led = Led { particles: &self.led, places: &places };
            let (frame, places) = (self.frame.as_ref(), (&mut present, &mut next));
            sweep.steps(&self.flock, frame, places, (count, led, None), &mut activity);
            done += count;
        }
        hash(&present)
    }

    /// The rule, written down once more with nothing but its formula.
    fn by_the_formula(&self, present: &Vectors, next: &mut Vectors) {
        let Flock { neighbours, rest, .. } = &self.flock;
        for j in (0..present.len()).filter(|&j| self.roles[j] == Role::Follower) {
            let list = neighbours.of(j);
            let sum = list.iter().fold([-0.0; 2], |[x, y], &k| {
                let [kx, ky] = present.get(k as usize);
                [x + kx, y + ky]
            });
            let [rx, ry] = rest.as_ref().map_or([0.0; 2], |rest| rest.get(j));
            next.set(j, [sum[0] / list.len() as f64 + rx, sum[1] / list.len() as f64 + ry]);
        }
        // A point of the frame is displaced as those it serves were.
        let reference = &self.flock.reference;
        let Some(frame) = &self.frame else { return };
        for (k, &point) in frame.points.iter().enumerate() {
            let served = frame.served_by(k);
            let sum = served.iter().fold([0.0; 2], |[x, y], &s| {
                let ([sx, sy], [rx, ry]) = (present.get(s as usize), reference.get(s as usize));
                [x + (sx - rx), y + (sy - ry)]
            });
            let [rx, ry] = reference.get(point as usize);
            let count = served.len() as f64;
            next.set(point as usize, [rx + sum[0] / count, ry + sum[1] / count]);
        }
    }
}

/// A hash of the bits of all coordinates.
fn hash(points: &Vectors) -> u64 {
    let bytes = points.x.iter().chain(&points.y).flat_map(|value| value.to_bits().to_le_bytes());
    fnv1a(&bytes.collect::<Vec<u8>>())
}

fn assert_golden(body: &Pulled, golden: u64) {
    let uncompiled = Sweep::uncompiled(Update::default(), &body.flock, &body.roles);
    let compiled = Sweep::compile(Update::default(), &body.flock, &body.roles);
    let mut all =
        vec![("the formula".to_owned(), body.singly(|present, next| body.by_the_formula(present, next)))];
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let by = |sweep: &Sweep| {
                body.singly(|present, next| sweep.step(&body.flock, body.frame.as_ref(), present, next))
            };
            all.push((format!("one by one, {threads} threads"), by(&uncompiled)));
            all.push((format!("compiled, {threads} threads"), by(&compiled)));
            for most in [1, 2, 7, MOST_STEPS] {
                all.push((format!("{most} steps together, {threads} threads"), body.together(most)));
            }
        });
    }
    for (how, hash) in all {
        assert_eq!(format!("{hash:016x}"), format!("{golden:016x}"), "{how}");
    }
}

#[test]
fn a_square_lattice_has_the_golden_bits_over_threads_kernels_and_blockings() {
    assert_golden(&Pulled::new(LatticeKind::Square { spacing: 1.0 }, None), 0x5078_b4e9_416c_7a8d);
}

#[test]
fn a_hexagonal_lattice_has_the_golden_bits_over_threads_kernels_and_blockings() {
    assert_golden(&Pulled::new(LatticeKind::Hexagonal { spacing: 1.0 }, None), 0x79ec_950d_d986_0e8f);
}

#[test]
fn a_body_in_a_frame_has_the_golden_bits_over_threads_kernels_and_blockings() {
    assert_golden(
        &Pulled::new(LatticeKind::Square { spacing: 1.0 }, Some(FrameRule::Lagged)),
        0xc9f0_8167_a1f0_fe3d,
    );
}

#[test]
fn a_body_of_lists_has_the_golden_bits_over_threads_kernels_and_blockings() {
    // Jumbled lists, of which no run is made, and which are summed in another order.
    let mut body = Pulled::new(LatticeKind::Hexagonal { spacing: 1.0 }, None);
    let lists = (0..body.flock.reference.len()).map(|j| {
        let mut list = body.flock.neighbours.of(j).to_vec();
        let turn = j % list.len();
        list.rotate_left(turn);
        list
    });
    body.flock.neighbours = Neighbours::from_lists(lists);
    assert_golden(&body, 0x6cd8_abab_582a_a092);
}
