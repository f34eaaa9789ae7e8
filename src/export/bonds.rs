//! Pairs of neighbours, each once, for lines between particles.

use crate::flock::neighbourhood::Neighbours;

/// Index pairs of which at least one sees the other, each once, the one that lists it first.
pub(super) fn pairs(neighbours: &Neighbours) -> impl Iterator<Item = [u32; 2]> + '_ {
    listed_once(neighbours).map(|(_, pair)| pair)
}

/// As [`pairs`], with the place of the bond in the neighbours' index list.
pub(super) fn listed_once(neighbours: &Neighbours) -> impl Iterator<Item = (usize, [u32; 2])> + '_ {
    (0..neighbours.count()).flat_map(move |j| {
        neighbours.bonds(j).filter_map(move |bond| {
            let k = neighbours.index[bond];
            // Seen from the higher end only where the lower one does not see it.
            let once = (j as u32) < k || !neighbours.of(k as usize).contains(&(j as u32));
            once.then_some((bond, [j as u32, k]))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_is_listed_once_whether_one_end_sees_it_or_both() {
        let neighbours = Neighbours::from_lists([vec![1], vec![0], vec![0, 1]]);
        assert_eq!(pairs(&neighbours).collect::<Vec<_>>(), [[0, 1], [2, 0], [2, 1]]);
    }
}
