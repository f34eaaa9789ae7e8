//! Whether every follower feels somebody who is held, through whatever chain of neighbours.

use super::matrix::{HELD, Matrix};
use super::{Operator, Site};

/// Sweeps to and fro before single particles are followed: almost every body is done after one.
const SWEEPS: usize = 8;

impl Operator {
    /// The first follower, counted from 0, that no chain of neighbours connects to a held particle;
    /// `matrix` is what [`Matrix::of_followers`] made of this operator.
    pub fn adrift(&self, matrix: &Matrix) -> Option<usize> {
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
        let mut offsets: Vec<Site> = matrix.rows.iter().flat_map(|r| &r.entries).map(|&(o, _)| o).collect();
        offsets.sort_unstable();
        offsets.dedup();
        let sites: Vec<(Site, usize)> = matrix
            .columns
            .sites()
            .filter_map(|site| matrix.columns.find(site).map(|(index, _)| (site, index)))
            .collect();
        let mut fresh: Vec<Site> =
            sites.iter().filter(|&&(_, i)| reached[i]).map(|&(site, _)| site).collect();
        while let Some([column, row]) = fresh.pop() {
            for &offset in &offsets {
                let back = [column - offset[0], row - offset[1]];
                let Some((there, _)) = matrix.columns.find(back) else { continue };
                let sees =
                    matrix.rows[matrix.class[there] as usize].entries.iter().any(|(o, _)| *o == offset);
                if sees && !reached[there] {
                    reached[there] = true;
                    fresh.push(back);
                }
            }
        }
    }
}

/// Whoever sees a reached particle is reached: once up and once down the numbering.
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
