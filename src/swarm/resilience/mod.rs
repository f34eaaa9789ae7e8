//! Followers that a liar among their neighbours cannot lead astray (W-MSR).
//!
//! Each follower leaves out the most extreme of what it hears: of the values above its own the `f` highest,
//! of those below the `f` lowest (LeBlanc, Zhang, Koutsoukos & Sundaram, "Resilient asymptotic consensus in
//! robust networks", IEEE JSAC 31(4), 2013). With at most `f` liars among the neighbours of any member, the
//! values left lie between those of honest members, so no follower leaves the box of the honest
//! leaders' displacements. This applies to *displacements*, present less reference: in raw coordinates the
//! honest neighbours themselves are the extremes.
//!
//! The cost: the extremes of an honest shape are left out too. A common displacement of the leaders is
//! still followed exactly; a stretch or a turn is not.

mod support;

pub use support::{Unsupported, supported};

/// The coordinates that are left out together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trim {
    /// Each coordinate by itself, as in the paper: up to `2 f` neighbours less on each axis, not the same
    /// ones on both. For rules that treat the axes apart.
    #[default]
    PerAxis,
    /// A neighbour that is extreme on either axis is left out on both: up to `4 f` less. The rest is
    /// a subset of what [`Trim::PerAxis`] leaves, so it is as safe; it suits matrix weights, which mix the axes, and
    /// asks for more neighbours.
    Whole,
}

/// Determines the axes on which each neighbour counts, given its displacement and the follower's own \[length\].
/// `keep` is overwritten, parallel to `displacements`; all may be left out, and then the follower stays.
/// A displacement that is not finite never counts, and is no one of the `f`.
///
/// Leave out what is not kept and apply the rule to the displacements of the rest (or to their positions
/// with the rest offset of just those).
pub fn trim(trim: Trim, own: [f64; 2], displacements: &[[f64; 2]], f: usize, keep: &mut Vec<[bool; 2]>) {
    keep.clear();
    keep.extend(displacements.iter().map(|d| [d.iter().all(|d| d.is_finite()); 2]));
    for (axis, own) in own.into_iter().enumerate() {
        for _ in 0..f {
            drop_farthest(axis, |d| d - own, displacements, keep);
        }
        for _ in 0..f {
            drop_farthest(axis, |d| own - d, displacements, keep);
        }
    }
    if trim == Trim::Whole {
        keep.iter_mut().for_each(|kept| *kept = [kept[0] && kept[1]; 2]);
    }
}

/// Drops the kept one that lies farthest on one side, if any lies there; of equal ones the first.
fn drop_farthest(
    axis: usize,
    beyond: impl Fn(f64) -> f64,
    displacements: &[[f64; 2]],
    keep: &mut [[bool; 2]],
) {
    let mut farthest: Option<(usize, f64)> = None;
    for (k, d) in displacements.iter().enumerate().filter(|(k, _)| keep[*k][axis]) {
        let far = beyond(d[axis]);
        if far > farthest.map_or(0.0, |(_, most)| most) {
            farthest = Some((k, far));
        }
    }
    if let Some((k, _)) = farthest {
        keep[k][axis] = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(how: Trim, own: [f64; 2], displacements: &[[f64; 2]], f: usize) -> [Vec<usize>; 2] {
        let mut keep = vec![[false; 2]; 99];
        trim(how, own, displacements, f, &mut keep);
        assert_eq!(keep.len(), displacements.len());
        [0, 1].map(|axis| (0..keep.len()).filter(|&k| keep[k][axis]).collect())
    }

    const FIVE: [[f64; 2]; 5] = [[9.0, 0.1], [0.2, -7.0], [0.3, 0.2], [-5.0, 0.3], [0.1, 8.0]];

    #[test]
    fn each_axis_loses_its_own_extremes() {
        assert_eq!(kept(Trim::PerAxis, [0.0; 2], &FIVE, 1), [vec![1, 2, 4], vec![0, 2, 3]]);
        assert_eq!(kept(Trim::PerAxis, [0.0; 2], &FIVE, 0), [vec![0, 1, 2, 3, 4], vec![0, 1, 2, 3, 4]]);
        assert_eq!(kept(Trim::PerAxis, [0.0; 2], &FIVE, 2), [vec![1, 4], vec![0, 2]]);
    }

    #[test]
    fn a_neighbour_stays_whole_or_goes() {
        assert_eq!(kept(Trim::Whole, [0.0; 2], &FIVE, 1), [vec![2], vec![2]]);
    }

    #[test]
    fn no_value_is_left_out_on_an_empty_side() {
        // Own value at the lower end: only the highest goes, and equal values are no extremes.
        let row = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 0.0]];
        assert_eq!(kept(Trim::PerAxis, [0.0; 2], &row, 1), [vec![0, 1, 3], vec![0, 1, 2, 3]]);
        assert_eq!(kept(Trim::PerAxis, [0.0; 2], &row, 9), [vec![0, 3], vec![0, 1, 2, 3]]);
    }

    #[test]
    fn a_displacement_that_is_not_finite_never_counts_and_shields_no_liar() {
        let row = [[f64::NAN, 0.0], [0.0, f64::INFINITY], [50.0, 50.0], [1.0, 1.0], [-1.0, -1.0]];
        assert_eq!(kept(Trim::PerAxis, [0.0; 2], &row, 1), [vec![3], vec![3]]);
    }
}
