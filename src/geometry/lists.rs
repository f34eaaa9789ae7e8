//! Lists of indices in compressed form: one after the other, with the places where they begin.

/// Sorts members into so many lists, each in the order in which `pairs` has its members: where each list begins, shape
/// \[count + 1\], and the members of all. `pairs` gives each member after its list, the same each time.
pub(crate) fn lists_of<I: Iterator<Item = (u32, u32)>>(
    count: usize,
    pairs: impl Fn() -> I,
) -> (Vec<u32>, Vec<u32>) {
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
    (starts, members)
}
