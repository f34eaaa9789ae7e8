//! One liar: trimmed, the followers of the others keep to what honest leaders say.

use flockform::flock::neighbourhood::{Neighbourhood, Neighbours};
use flockform::flock::vectors::Vectors;
use flockform::solve::spectrum::scatter;
use flockform::swarm::resilience::{Trim, Unsupported, supported, trim};

use super::support::{COUNT, leads, square};

/// What the liar says of its displacement in this step \[m\].
type Story = fn(usize) -> [f64; 2];

const FAR: Story = |_| [50.0, -20.0];
const OSCILLATING: Story = |step| [30.0 * (0.3 * step as f64).sin(), 30.0 * (0.17 * step as f64).cos()];
/// Not far: what a test for outliers lets pass.
const NEAR: Story = |_| [1.3, 0.2];

struct Flight {
    neighbours: Neighbours,
    liar: usize,
    story: Story,
    f: usize,
    leads: fn(usize) -> bool,
}

impl Flight {
    /// Displacements after so many steps; the followers start scattered. Hands each step to `see`.
    fn fly(
        &self,
        lead: impl Fn(usize) -> [f64; 2],
        steps: usize,
        mut see: impl FnMut(usize, &Vectors),
    ) -> Vectors {
        let start = |j: usize| [scatter(2 * j as u64), scatter(2 * j as u64 + 1)];
        let mut present: Vectors =
            (0..COUNT).map(|j| if (self.leads)(j) { lead(j) } else { start(j) }).collect();
        for step in 0..steps {
            present.set(self.liar, (self.story)(step));
            let seen = present.clone();
            (0..COUNT).filter(|&j| self.follows(j)).for_each(|j| present.set(j, self.next(j, &seen)));
            see(step, &present);
        }
        present
    }

    fn follows(&self, member: usize) -> bool {
        !(self.leads)(member) && member != self.liar
    }

    /// The mean of the displacements kept, on each axis; the own one where none is.
    fn next(&self, member: usize, seen: &Vectors) -> [f64; 2] {
        let heard: Vec<[f64; 2]> = self.neighbours.of(member).iter().map(|&k| seen.get(k as usize)).collect();
        let (own, mut keep) = (seen.get(member), Vec::new());
        trim(Trim::PerAxis, own, &heard, self.f, &mut keep);
        [0, 1].map(|axis| {
            let kept = (0..heard.len()).filter(|&k| keep[k][axis]);
            let (sum, count) = kept.fold((0.0, 0), |(sum, count), k| (sum + heard[k][axis], count + 1));
            if count == 0 { own[axis] } else { sum / f64::from(count) }
        })
    }

    fn error(&self, present: &Vectors, wanted: [f64; 2]) -> f64 {
        let off = |j: usize| {
            let [x, y] = present.get(j);
            (x - wanted[0]).abs().max((y - wanted[1]).abs())
        };
        (0..COUNT).filter(|&j| self.follows(j)).map(off).fold(0.0, f64::max)
    }
}

fn eight() -> Neighbours {
    square(Neighbourhood::Chebyshev { radius: 1 }).1
}

fn leaders() -> Vec<bool> {
    (0..COUNT).map(leads).collect()
}

/// In the middle, beside the corner of the leaders, and a leader itself.
const LIARS: [usize; 3] = [55, 11, 40];

#[test]
fn eight_neighbours_trimmed_by_one_follow_the_honest_leaders_exactly() {
    let wanted = [0.8, -0.3];
    for story in [FAR, OSCILLATING, NEAR] {
        for liar in LIARS {
            let flight = Flight { neighbours: eight(), liar, story, f: 1, leads };
            supported(&flight.neighbours, &leaders(), 1, Trim::PerAxis).expect("eight tolerate one");
            let error = flight.error(&flight.fly(|_| wanted, 400, |_, _| {}), wanted);
            assert!(error < 1e-9, "trimmed, the liar {liar} moves them by {error}");
        }
    }
}

#[test]
fn untrimmed_the_same_liars_lead_them_astray() {
    let wanted = [0.8, -0.3];
    for story in [FAR, OSCILLATING, NEAR] {
        for liar in LIARS {
            let flight = Flight { neighbours: eight(), liar, story, f: 0, leads };
            let error = flight.error(&flight.fly(|_| wanted, 400, |_, _| {}), wanted);
            assert!(error > 0.05, "untrimmed, the liar {liar} moves them by {error} only");
        }
    }
}

#[test]
fn a_deforming_formation_stays_in_the_box_of_its_honest_leaders() {
    // A stretch in x and a shear: displacements from -0.9 to 0.9 and from 0 to 0.45.
    let lead = |j: usize| [0.2 * ((j / 10) as f64 - 4.5), 0.05 * (j / 10) as f64];
    let (low, high) = ([-0.9, 0.0], [0.9, 0.45]);
    for story in [FAR, OSCILLATING, NEAR] {
        for liar in LIARS {
            let flight = Flight { neighbours: eight(), liar, story, f: 1, leads };
            let mut outside = 0.0f64;
            let out = |present: &Vectors| {
                let beyond = |j: usize| {
                    let d = present.get(j);
                    [0, 1].map(|k| (d[k] - high[k]).max(low[k] - d[k])).into_iter().fold(0.0, f64::max)
                };
                (0..COUNT).filter(|&j| flight.follows(j)).map(beyond).fold(0.0, f64::max)
            };
            // From the scatter they start in they come into the box and stay there.
            let rest = flight.fly(lead, 400, |step, present| {
                if step >= 200 {
                    outside = outside.max(out(present));
                }
            });
            assert!(outside < 1e-9, "{outside} outside by the liar {liar}");
            // Trimming costs shape, not more than a cell of it here.
            let off = (0..COUNT).filter(|&j| flight.follows(j)).map(|j| {
                let (d, wanted) = (rest.get(j), lead(j));
                (d[0] - wanted[0]).hypot(d[1] - wanted[1])
            });
            let off = off.fold(0.0, f64::max);
            assert!(off < 0.5, "{off} from the affine place by the liar {liar}");
        }
    }
}

#[test]
fn four_neighbours_are_refused_with_the_reason() {
    let four = square(Neighbourhood::First { keep: None }).1;
    let refusal = supported(&four, &leaders(), 1, Trim::PerAxis).expect_err("four tolerate none");
    assert!(matches!(refusal, Unsupported { reached: Some(2), needed: 3, f: 1, .. }));
    let words = refusal.to_string();
    assert!(
        words.contains("3 are needed to tolerate F = 1") && words.contains("8 each tolerate 1"),
        "{words}"
    );
}

#[test]
fn four_neighbours_trimmed_all_the_same_do_not_follow_a_column_and_eight_do() {
    // Even where nobody lies: a lone leader among four is what trimming leaves out.
    let wanted: Story = |_| [3.0, -2.0];
    let column: fn(usize) -> bool = |member| member < 10;
    let leaders: Vec<bool> = (0..COUNT).map(column).collect();
    for (neighbourhood, follow) in
        [(Neighbourhood::First { keep: None }, false), (Neighbourhood::Chebyshev { radius: 1 }, true)]
    {
        let neighbours = square(neighbourhood).1;
        assert_eq!(supported(&neighbours, &leaders, 1, Trim::PerAxis).is_ok(), follow);
        let flight = Flight { neighbours, liar: 4, story: wanted, f: 1, leads: column };
        let error = flight.error(&flight.fly(|_| [3.0, -2.0], 3000, |_, _| {}), [3.0, -2.0]);
        assert!(if follow { error < 1e-9 } else { error > 1.0 }, "{follow}: {error}");
    }
}
