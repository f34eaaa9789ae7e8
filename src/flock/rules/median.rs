//! The median of each coordinate. Not in the paper: a mean that a few outliers among the neighbours do not move, such as a robot
//! whose poses are wrong or a particle that was torn away.
//!
//! A leader that moves away alone is an outlier too: a body on a lattice, whose particles have one neighbour in the direction of a pull, is
//! not led by this rule. It is for many neighbours, as in swarms.
//!
//! With weights it is the value with half of the weight on either side; where a whole interval has that, its middle.

use super::Neighbour;

/// Median of each coordinate; `None` without neighbours or without a positive sum of weights.
pub fn mean(neighbours: impl Iterator<Item = Neighbour> + Clone) -> Option<[f64; 2]> {
    let total: f64 = neighbours.clone().map(|n| n.weight).sum();
    // What has half of the weight but for rounding has half of it.
    let half = total * (1.0 - 1e-12);
    let axis = |k: usize| {
        let values = || neighbours.clone().map(|n| n.position[k]);
        let weight = |counts: &dyn Fn(f64) -> bool| {
            neighbours.clone().filter(|n| counts(n.position[k])).map(|n| n.weight).sum::<f64>()
        };
        // Neighbours are few: counting for each of them needs no memory.
        let low =
            values().filter(|&v| 2.0 * weight(&|other| other <= v) >= half).fold(f64::INFINITY, f64::min);
        let high =
            values().filter(|&v| 2.0 * weight(&|other| other >= v) >= half).fold(f64::NEG_INFINITY, f64::max);
        0.5 * low + 0.5 * high
    };
    (total > 0.0).then(|| [axis(0), axis(1)])
}

#[cfg(test)]
mod tests {
    use super::super::tests::at;
    use super::*;

    #[test]
    fn an_odd_number_has_a_middle_one_and_an_even_number_the_middle_of_two() {
        assert_eq!(mean(at(&[[3.0, 0.0], [1.0, 5.0], [2.0, 9.0]])), Some([2.0, 5.0]));
        assert_eq!(mean(at(&[[3.0, 0.0], [1.0, 5.0], [2.0, 9.0], [7.0, 6.0]])), Some([2.5, 5.5]));
    }

    #[test]
    fn an_outlier_moves_the_barycentre_and_not_the_median() {
        let around = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [0.0, 0.0]];
        let mut torn = around;
        torn[0] = [1e9, -1e9];
        assert_eq!(mean(at(&around)), Some([0.0; 2]));
        assert_eq!(mean(at(&torn)), Some([0.0; 2]));
    }

    #[test]
    fn half_of_the_weight_is_on_either_side() {
        let weighted = |weights: [f64; 3]| {
            mean(
                [1.0, 2.0, 4.0]
                    .into_iter()
                    .zip(weights)
                    .map(|(x, weight)| Neighbour { weight, ..Neighbour::at([x, -x]) }),
            )
        };
        assert_eq!(weighted([1.0, 1.0, 5.0]), Some([4.0, -4.0]));
        assert_eq!(weighted([2.0, 1.0, 1.0]), Some([1.5, -1.5]));
        assert_eq!(weighted([0.0, 1.0, 0.0]), Some([2.0, -2.0]));
        assert_eq!(weighted([0.0; 3]), None);
    }

    #[test]
    fn rounding_decides_no_tie_of_weights() {
        let weighted = |unit: f64| {
            let all = [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0), (4.0, 6.0)].into_iter();
            mean(all.map(move |(x, weight)| Neighbour { weight: unit * weight, ..Neighbour::at([x, x]) }))
        };
        for unit in [1.0, 0.1, 0.3, 0.7] {
            assert_eq!(weighted(unit), Some([3.5, 3.5]), "{unit}");
        }
    }

    #[test]
    fn the_ends_of_the_range_of_doubles_have_a_middle() {
        assert_eq!(mean(at(&[[f64::MAX, f64::MIN], [f64::MAX, f64::MAX]])), Some([f64::MAX, 0.0]));
    }
}
