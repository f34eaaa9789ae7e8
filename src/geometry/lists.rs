//! Lists of indices: sorted, around a polygon, or many of them one after the other.

/// Many lists in compressed form.
#[derive(Clone, Debug, PartialEq)]
pub struct Lists {
    /// Where each list begins, shape \[count + 1\].
    pub(crate) starts: Vec<u32>,
    /// The members of all.
    pub(crate) members: Vec<u32>,
}

impl Lists {
    /// Sorts members into so many lists, each in the order in which `pairs` has its members. `pairs` gives each member after
    /// its list, the same each time.
    pub(crate) fn sorted<I: Iterator<Item = (u32, u32)>>(count: usize, pairs: impl Fn() -> I) -> Self {
        let mut starts = vec![0; count + 1];
        pairs().for_each(|(list, _)| starts[list as usize + 1] += 1);
        for list in 0..count {
            starts[list + 1] += starts[list];
        }
        let (mut next, mut members) = (starts.clone(), vec![0; starts[count] as usize]);
        for (list, member) in pairs() {
            members[next[list as usize] as usize] = member;
            next[list as usize] += 1;
        }
        Self { starts, members }
    }

    /// The members of one list, in its order.
    pub fn of(&self, list: usize) -> &[u32] {
        &self.members[self.starts[list] as usize..self.starts[list + 1] as usize]
    }
}

/// Each of these once, ascending.
pub(crate) fn distinct<T: Ord>(of: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all: Vec<T> = of.into_iter().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The sides of a polygon: each corner and the next.
pub(crate) fn sides<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 2]> {
    (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]])
}
