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
    let half = 0.5 * total * (1.0 - 1e-12);
    let mut values: Vec<[f64; 2]> = Vec::new();
    let mut axis = |k: usize| {
        values.clear();
        values.extend(
            neighbours.clone().map(|n| [n.position[k], n.weight]).filter(|[value, _]| !value.is_nan()),
        );
        values.sort_unstable_by(|[a, _], [b, _]| a.total_cmp(b));
        let alike = || values.chunk_by(|[a, _], [b, _]| a == b);
        let [low, high] = [half_way(alike(), half), half_way(alike().rev(), half)];
        0.5 * low.unwrap_or(f64::INFINITY) + 0.5 * high.unwrap_or(f64::NEG_INFINITY)
    };
    (total > 0.0).then(|| [axis(0), axis(1)])
}

/// The first of these values, each given as often as there are weights of it, up to which there is half of the weight.
fn half_way<'a>(mut alike: impl Iterator<Item = &'a [[f64; 2]]>, half: f64) -> Option<f64> {
    let mut weight = 0.0;
    alike.find_map(|values| {
        weight += values.iter().map(|[_, weight]| weight).sum::<f64>();
        (weight >= half).then_some(values[0][0])
    })
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

    /// Of many neighbours too, some of them alike: at least half of the weight is not above it, and not below.
    #[test]
    fn half_of_the_weight_of_many_is_on_either_side() {
        let number = |seed: usize| (7919 * seed + 13) % 41;
        for count in 1..120 {
            let values: Vec<(f64, f64)> =
                (0..count).map(|i| (number(i) as f64, (number(i * i) % 5 + 1) as f64)).collect();
            let all = values.iter().map(|&(x, weight)| Neighbour { weight, ..Neighbour::at([x, -x]) });
            let [middle, mirrored] = mean(all).expect("weights");
            let weight = |counts: &dyn Fn(f64) -> bool| {
                values.iter().filter(|(x, _)| counts(*x)).map(|(_, weight)| weight).sum::<f64>()
            };
            let half = 0.5 * weight(&|_| true);
            assert!(
                weight(&|x| x <= middle) >= half && weight(&|x| x >= middle) >= half,
                "{count}: {middle}"
            );
            assert_eq!(mirrored, -middle, "{count}");
        }
    }

    /// Whatever their order.
    #[test]
    fn values_that_are_alike_count_together() {
        for weights in [[2.0, -2.0], [-2.0, 2.0]] {
            let all = [(0.0, weights[0]), (0.0, weights[1]), (-1.0, 1.0), (1.0, 2.0)].into_iter();
            let all = all.map(|(x, weight)| Neighbour { weight, ..Neighbour::at([x, x]) });
            assert_eq!(mean(all), Some([1.0; 2]), "{weights:?}");
        }
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
