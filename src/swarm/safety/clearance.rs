//! The clearance of robots between two ticks, from each other and from solids.

use super::Filter;
use crate::flock::vectors::Vectors;

/// Places on a robot's way at which its distance from obstacles is taken.
const PLACES_ON_THE_WAY: u32 = 4;

impl Filter {
    /// Least free space around each member while all went straight and evenly from `before` to `after` \[m\]:
    /// between members the least ever, to obstacles at several places on the way. Shapes \[count\].
    pub(crate) fn clearance_on_the_way(&self, before: &Vectors, after: &Vectors, nearest: &mut Vec<f64>) {
        nearest.clear();
        nearest.extend(
            (0..after.len()).map(|m| self.obstacle_distance(before.get(m), after.get(m)) - self.radii[m]),
        );
        for a in 0..after.len() {
            for b in 0..a {
                let apart = |points: &Vectors| {
                    let (a, b) = (points.get(a), points.get(b));
                    [a[0] - b[0], a[1] - b[1]]
                };
                let gap = least_length(apart(before), apart(after)) - self.radii[a] - self.radii[b];
                nearest[a] = nearest[a].min(gap);
                nearest[b] = nearest[b].min(gap);
            }
        }
    }

    fn obstacle_distance(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        if self.obstacles.is_empty() {
            return f64::INFINITY;
        }
        let place = |k: u32| {
            let part = f64::from(k) / f64::from(PLACES_ON_THE_WAY);
            [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]))
        };
        (0..=PLACES_ON_THE_WAY).map(|k| self.obstacles.distance(place(k))).fold(f64::INFINITY, f64::min)
    }
}

/// Least length of a vector that goes straight from one to another.
fn least_length(from: [f64; 2], to: [f64; 2]) -> f64 {
    let way = [to[0] - from[0], to[1] - from[1]];
    let square = way[0] * way[0] + way[1] * way[1];
    let part =
        if square > 0.0 { (-(from[0] * way[0] + from[1] * way[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    f64::hypot(from[0] + part * way[0], from[1] + part * way[1])
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
        filter.clearance_on_the_way(&before, &after, &mut nearest);
        assert_eq!(nearest, [0.5, 0.5]);
        // Alone, the disc is nearest half way.
        let far: Vectors = [[4.0, 0.0], [0.0, -99.0]].into_iter().collect();
        let gone: Vectors = [[0.0, -99.0]; 2].into_iter().collect();
        let from: Vectors = [[0.0, 0.0], gone.get(1)].into_iter().collect();
        filter.clearance_on_the_way(&from, &far, &mut nearest);
        assert!((nearest[0] - 3.75).abs() < 1e-12, "{nearest:?}");
    }
}
