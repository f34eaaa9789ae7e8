//! The clearance of robots between two ticks, from each other and from solids: the least ever, by the way that each has gone.

use super::Filter;
use super::cell::{foot, length};
use crate::flock::vectors::Vectors;
use crate::geometry::point::minus;

/// Chords that stand for the way of a member that changes its velocity evenly: between them it is off by less than `a T^2 / 2048`.
const CHORDS: u32 = 16;

impl Filter {
    /// Least free space around each member \[m\], shapes \[count\], while all went evenly from `before` to `after`: straight, or, with
    /// `bends`, by `way s + bend s (1 - s)` at each part `s` of the time, as those do that change their velocity evenly.
    pub(crate) fn clearance_on_the_way(
        &self,
        [before, after]: [&Vectors; 2],
        bends: Option<&Vectors>,
        nearest: &mut Vec<f64>,
    ) {
        nearest.clear();
        nearest.resize(after.len(), f64::INFINITY);
        let from_solids = |places: &Vectors| -> Vec<f64> {
            places.iter().map(|place| self.obstacles.distance(place)).collect()
        };
        let Some(bends) = bends else {
            let ends = [&from_solids(before)[..], &from_solids(after)];
            return self.clearance_on_chords([before, after], ends, nearest);
        };
        let places = |k: u32| -> Vectors {
            let part = f64::from(k) / f64::from(CHORDS);
            let place = |m: usize| {
                let (from, to, bend) = (before.get(m), after.get(m), bends.get(m));
                [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis] + (1.0 - part) * bend[axis]))
            };
            (0..after.len()).map(place).collect()
        };
        let mut from = places(0);
        let mut from_there = from_solids(&from);
        for k in 1..=CHORDS {
            let to = places(k);
            let to_there = from_solids(&to);
            self.clearance_on_chords([&from, &to], [&from_there, &to_there], nearest);
            (from, from_there) = (to, to_there);
        }
    }

    /// `ends` has the distances of both from solids \[m\], shapes \[count\].
    fn clearance_on_chords(&self, [before, after]: [&Vectors; 2], ends: [&[f64]; 2], nearest: &mut [f64]) {
        for (m, nearest) in nearest.iter_mut().enumerate() {
            let of_ends = f64::min(ends[0][m], ends[1][m]);
            let along = self.obstacles.distance_along([before.get(m), after.get(m)], of_ends);
            *nearest = nearest.min(along - self.radii[m]);
        }
        for a in 0..after.len() {
            for b in 0..a {
                let apart = |points: &Vectors| minus(points.get(a), points.get(b));
                let gap =
                    length(foot([apart(before), apart(after)], [0.0; 2])) - self.radii[a] - self.radii[b];
                nearest[a] = nearest[a].min(gap);
                nearest[b] = nearest[b].min(gap);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Limits, Obstacle, Obstacles};
    use super::*;

    #[test]
    fn two_that_pass_each_other_are_seen_to_come_close_in_between() {
        let wall = Obstacle::Disc { centre: [2.0, 5.0], radius: 1.0 };
        let filter = Filter::new(Limits::default(), vec![0.25; 2], Obstacles::new(&[wall]).expect("solid"))
            .expect("filter");
        let before: Vectors = [[0.0, 0.0], [4.0, 1.0]].into_iter().collect();
        let after: Vectors = [[4.0, 0.0], [0.0, 1.0]].into_iter().collect();
        let mut nearest = Vec::new();
        filter.clearance_on_the_way([&before, &after], None, &mut nearest);
        assert_eq!(nearest, [0.5, 0.5]);
        // Alone, the disc is nearest half way.
        let far: Vectors = [[4.0, 0.0], [0.0, -99.0]].into_iter().collect();
        let gone: Vectors = [[0.0, -99.0]; 2].into_iter().collect();
        let from: Vectors = [[0.0, 0.0], gone.get(1)].into_iter().collect();
        filter.clearance_on_the_way([&from, &far], None, &mut nearest);
        assert!((nearest[0] - 3.75).abs() < 1e-12, "{nearest:?}");
    }

    #[test]
    fn obstacles_are_seen_between_any_two_places_and_along_a_bend() {
        let solids = [
            Obstacle::Disc { centre: [0.37, 2.0], radius: 0.5 },
            Obstacle::Polygon(vec![[5.0, 1.0], [5.1, 1.0], [5.05, 4.0]]),
        ];
        let filter = Filter::new(Limits::default(), vec![0.25; 2], Obstacles::new(&solids).expect("solid"))
            .expect("filter");
        let vectors = |of: [[f64; 2]; 2]| of.into_iter().collect::<Vectors>();
        let (before, after) = (vectors([[0.0, 0.0], [4.0, 0.0]]), vectors([[1.0, 0.0], [6.0, 0.0]]));
        let mut nearest = Vec::new();
        filter.clearance_on_the_way([&before, &after], None, &mut nearest);
        let wanted = [1.5 - 0.25, 1.0 - 0.25];
        assert!(
            nearest.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-12),
            "{nearest:?}"
        );
        // The first bends to a height of a quarter of its bend half way, the other away.
        let bends = vectors([[0.0, 1.6], [0.0, -1.6]]);
        filter.clearance_on_the_way([&before, &after], Some(&bends), &mut nearest);
        let fine = |k: u32| {
            let s = f64::from(k) / 1e5;
            f64::hypot(s - 0.37, 1.6 * s * (1.0 - s) - 2.0) - 0.75
        };
        let least = (0..=100_000).map(fine).fold(f64::INFINITY, f64::min);
        assert!((nearest[0] - least).abs() < 3.2 / 2048.0, "{nearest:?} for {least}");
        assert!(nearest[0] < 0.88 && nearest[1] > 1.0, "{nearest:?}");
        // Moved by rounding alone, beside a slanted side.
        let (still, moved) = (vectors([[5.008, 3.0], [0.0; 2]]), vectors([[5.008, 3.0 + 5e-16], [0.0; 2]]));
        filter.clearance_on_the_way([&still, &moved], None, &mut nearest);
        assert!((nearest[0] + 0.2246).abs() < 1e-3, "{nearest:?}");
        // Through a solid, and out of one.
        let (before, after) = (vectors([[0.37, 0.0], [5.05, 2.0]]), vectors([[0.37, 9.0], [9.0, 2.0]]));
        filter.clearance_on_the_way([&before, &after], None, &mut nearest);
        assert!(nearest.iter().all(|&nearest| nearest < -0.25), "{nearest:?}");
    }

    #[test]
    fn of_solids_that_lie_in_each_other_the_deepest_counts() {
        let square =
            |half: f64| Obstacle::Polygon(vec![[-half, -half], [half, -half], [half, half], [-half, half]]);
        let disc = |radius| Obstacle::Disc { centre: [0.0; 2], radius };
        let at = |solids: &[Obstacle]| Obstacles::new(solids).expect("solids").distance([0.1, 0.0]);
        for (solids, depth) in [
            ([disc(2.0), square(0.5)], 1.9),
            ([square(2.0), square(0.5)], 1.9),
            ([square(2.0), disc(0.5)], 1.9),
            ([disc(0.5), disc(2.0)], 1.9),
            ([disc(0.05), square(0.5)], 0.4),
        ] {
            assert!((at(&solids) + depth).abs() < 1e-12, "{solids:?}");
        }
    }
}
