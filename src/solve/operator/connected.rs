//! Whether a chain of neighbours connects every follower to a held particle.

use super::Operator;
use super::matrix::{HELD, Matrix};

/// Sweeps to and fro before single particles are followed: almost every body is done after one.
const SWEEPS: usize = 8;

impl Operator {
    /// The first follower, counted from 0, that no chain of neighbours connects to a held particle;
    /// `matrix` is what [`Matrix::of_followers`] made of this operator.
    pub(crate) fn adrift(&self, matrix: &Matrix) -> Option<usize> {
        // Rows that owe something to held particles were made after all others.
        let beside_held = |&class: &u32| class != HELD && class as usize >= self.rows.len();
        let mut reached: Vec<bool> = matrix.class.iter().map(beside_held).collect();
        let unreached = |reached: &[bool]| (0..reached.len()).find(|&i| self.follows[i] && !reached[i]);
        for _ in 0..SWEEPS {
            sweep(matrix, &mut reached);
            unreached(&reached)?;
        }
        self.spread(matrix, &mut reached);
        unreached(&reached)
    }

    /// Follows every connection from those already reached.
    fn spread(&self, matrix: &Matrix, reached: &mut [bool]) {
        let connections = || {
            matrix.runs().iter().flat_map(|run| {
                let of = |k: u32| {
                    let i = (run.start + k) as usize;
                    let others = matrix.distances(run)[1..].iter();
                    others.map(move |&distance| (i as u32, i.wrapping_add_signed(distance as isize)))
                };
                (0..run.len).flat_map(of)
            })
        };
        // For each particle those that feel it, in compressed form.
        let mut starts = vec![0u32; reached.len() + 1];
        connections().for_each(|(_, felt)| starts[felt + 1] += 1);
        for i in 0..reached.len() {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut feels = vec![0u32; starts[reached.len()] as usize];
        for (i, felt) in connections() {
            feels[next[felt] as usize] = i;
            next[felt] += 1;
        }
        let mut fresh: Vec<u32> = (0..reached.len() as u32).filter(|&i| reached[i as usize]).collect();
        while let Some(felt) = fresh.pop() {
            let those = starts[felt as usize] as usize..starts[felt as usize + 1] as usize;
            for &i in &feels[those] {
                if !std::mem::replace(&mut reached[i as usize], true) {
                    fresh.push(i);
                }
            }
        }
    }
}

/// Marks each particle that sees a reached one as reached: once up and once down the numbering.
fn sweep(matrix: &Matrix, reached: &mut [bool]) {
    for up in [true, false] {
        for run in 0..matrix.runs().len() {
            let run = &matrix.runs()[if up { run } else { matrix.runs().len() - 1 - run }];
            let (start, len) = (run.start as usize, run.len as usize);
            if reached[start..start + len].iter().all(|&reached| reached) {
                continue;
            }
            let distances = &matrix.distances(run)[1..];
            for k in 0..len {
                let i = start + if up { k } else { len - 1 - k };
                reached[i] |= distances.iter().any(|&d| reached[i.wrapping_add_signed(d as isize)]);
            }
        }
    }
}
