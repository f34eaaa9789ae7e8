//! Disjoint sets of indices: the connected parts of a graph that is given edge by edge.

/// Indices in sets that only grow together (union by lowest member, with path halving).
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// So many indices, each in a set of its own.
    pub(crate) fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    fn lowest(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins the sets of two indices.
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.lowest(a), self.lowest(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Lowest index of each index's set, shape \[count\].
    pub(crate) fn labels(mut self) -> Vec<u32> {
        (0..self.parent.len() as u32).map(|i| self.lowest(i)).collect()
    }

    /// Number of each index's set, counted in the order of lowest indices, shape \[count\]; and how many sets.
    pub(crate) fn numbered(self) -> (Vec<usize>, usize) {
        let (lowest, mut sets) = (self.labels(), 0);
        let mut numbers = vec![0; lowest.len()];
        for (i, &first) in lowest.iter().enumerate() {
            if first as usize == i {
                numbers[i] = sets;
                sets += 1;
            } else {
                numbers[i] = numbers[first as usize];
            }
        }
        (numbers, sets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_that_are_joined_by_any_chain_share_the_lowest_of_them() {
        let sets = || {
            let mut sets = DisjointSets::new(7);
            [[6, 4], [2, 5], [4, 2], [1, 3]].iter().for_each(|&[a, b]| sets.join(a, b));
            sets
        };
        assert_eq!(sets().labels(), [0, 1, 2, 1, 2, 2, 2]);
        assert_eq!(sets().numbered(), (vec![0, 1, 2, 1, 2, 2, 2], 3));
        let mut far = DisjointSets::new(5);
        far.join(4, 1);
        assert_eq!(far.numbered(), (vec![0, 1, 2, 3, 1], 4));
    }
}
