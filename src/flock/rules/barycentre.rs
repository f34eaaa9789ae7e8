//! The centre of gravity, the paper's Eq. 1: `x_j = sum_k w_k x_k / sum_k w_k`.

use super::Neighbour;

/// Weighted centre of gravity; `None` without neighbours or where the weights add up to nothing.
///
/// The sum runs in the neighbours' order and is divided once: sweeps that keep to this order give
/// the same bits.
#[inline]
pub fn mean(neighbours: impl Iterator<Item = Neighbour>) -> Option<[f64; 2]> {
    // -0.0 is the neutral element of addition: adding the first neighbour to it changes no bit.
    let (mut x, mut y, mut total) = (-0.0, -0.0, 0.0);
    for Neighbour { position, weight, .. } in neighbours {
        x += weight * position[0];
        y += weight * position[1];
        total += weight;
    }
    (total != 0.0).then(|| [x / total, y / total])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_pull_the_centre_of_gravity() {
        let pair =
            [(0.0, 3.0), (4.0, 1.0)].map(|(x, weight)| Neighbour { weight, ..Neighbour::at([x, 1.0]) });
        assert_eq!(mean(pair.into_iter()), Some([1.0, 1.0]));
    }
}
