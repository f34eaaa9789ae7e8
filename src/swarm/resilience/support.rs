//! The number of liars that a graph of neighbours tolerates.
//!
//! Resilience of consensus in general needs (r, s)-robustness, which is hard to decide (co-NP-complete).
//! Followers of leaders need less, which one walk decides: strong `2 f + 1`-
//! robustness with respect to the leaders (Usevitch & Panagou, "Resilient leader-follower consensus to
//! arbitrary reference values", ACC 2018; equal to bootstrap percolation from the leaders). Then, with at
//! most `f` liars among the neighbours of any member, leaders included, the honest leaders' values reach
//! every follower: a follower with `2 f + 1` correct neighbours keeps at least one after trimming.

use super::Trim;
use crate::flock::neighbourhood::Neighbours;

/// The reason for which so many liars are not tolerated. The text describes the member without naming it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "has {neighbours} neighbours{}, and {needed} are needed to tolerate F = {f} liars (on a lattice 8 each \
     tolerate 1, 24 tolerate 3)",
    reached.map_or(String::new(), |reached| format!(
        " of which only {reached} are sure to receive the leaders' values"
    ))
)]
pub struct Unsupported {
    /// Number of the follower.
    pub member: usize,
    /// Neighbours that it has.
    pub neighbours: usize,
    /// Those of them that are sure to be reached from the leaders; `None` where all would be too few.
    pub reached: Option<usize>,
    /// Sure neighbours that it needs.
    pub needed: usize,
    /// Liars to be tolerated.
    pub f: usize,
}

/// Whether the leaders' values reach all followers (all members but the `leaders`), whichever `f` neighbours of
/// each member lie. Without liars (`f` = 0) that is whether every follower is linked to a leader.
///
/// [`Trim::PerAxis`] needs `2 f + 1` neighbours that are sure, [`Trim::Whole`] `4 f + 1`; with fewer the
/// followers are as safe, but one that is left with no neighbour stays where it is.
pub fn supported(neighbours: &Neighbours, leaders: &[bool], f: usize, trim: Trim) -> Result<(), Unsupported> {
    let needed = match trim {
        Trim::PerAxis => f.saturating_mul(2).saturating_add(1),
        Trim::Whole => f.saturating_mul(4).saturating_add(1),
    };
    let is_follower = |member: &usize| !leaders[*member];
    let members = || (0..neighbours.count()).filter(is_follower);
    let heard = |member: usize| neighbours.of(member).len();
    let unsupported =
        |member, reached| Err(Unsupported { member, neighbours: heard(member), reached, needed, f });
    if let Some(member) = members().find(|&member| heard(member) < needed) {
        return unsupported(member, None);
    }
    let (sure, reached) = percolate(neighbours, leaders, needed);
    // The member with the fewest neighbours missing: there the remedy is smallest.
    let missed = members().filter(|&member| !sure[member]);
    let nearest = missed.max_by_key(|&member| (reached[member], usize::MAX - member));
    nearest.map_or(Ok(()), |member| unsupported(member, Some(reached[member])))
}

/// Starts from the leaders and adds members with enough neighbours in the set until none is left to add. Returns
/// the set, and the number of each member's neighbours in it.
fn percolate(neighbours: &Neighbours, leaders: &[bool], needed: usize) -> (Vec<bool>, Vec<usize>) {
    let count = neighbours.count();
    let mut heard_by: Vec<Vec<u32>> = vec![Vec::new(); count];
    for member in 0..count {
        neighbours.of(member).iter().for_each(|&k| heard_by[k as usize].push(member as u32));
    }
    let mut sure = leaders.to_vec();
    let mut reached = vec![0; count];
    let mut added: Vec<usize> = (0..count).filter(|&member| leaders[member]).collect();
    // Each member is added once.
    while let Some(member) = added.pop() {
        for &listener in &heard_by[member] {
            let listener = listener as usize;
            reached[listener] += 1;
            if reached[listener] >= needed && !sure[listener] {
                sure[listener] = true;
                added.push(listener);
            }
        }
    }
    (sure, reached)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::{Body, Cut};
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::flock::neighbourhood::Neighbourhood;

    fn square(neighbourhood: Neighbourhood) -> Neighbours {
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0, 0.0], 0.0);
        Body::build(lattice, &Cut::Count { columns: 10, rows: 10 }, &neighbourhood, None).expect("fits").1
    }

    /// The first columns lead.
    fn columns(count: usize) -> Vec<bool> {
        (0..100).map(|member| member < 10 * count).collect()
    }

    /// The leaders are the members at the edge.
    fn ring() -> Vec<bool> {
        (0..100).map(|m| [m / 10, m % 10].iter().any(|&k| k == 0 || k == 9)).collect()
    }

    #[test]
    fn lattices_tolerate_what_they_are_known_to() {
        let (four, eight, twenty_four) = (
            square(Neighbourhood::First { keep: None }),
            square(Neighbourhood::Chebyshev { radius: 1 }),
            square(Neighbourhood::Chebyshev { radius: 2 }),
        );
        for (neighbours, leaders, trim, most) in [
            (&four, ring(), Trim::PerAxis, 0),
            (&eight, ring(), Trim::PerAxis, 1),
            (&eight, columns(1), Trim::PerAxis, 1),
            (&twenty_four, columns(2), Trim::PerAxis, 3),
            (&eight, ring(), Trim::Whole, 0),
            (&twenty_four, columns(2), Trim::Whole, 1),
        ] {
            let is_supported = |f| supported(neighbours, &leaders, f, trim).is_ok();
            assert!((0..=most).all(is_supported) && !is_supported(most + 1), "{trim:?} {most}");
        }
    }

    #[test]
    fn a_refusal_names_the_member_and_what_it_lacks() {
        let four = square(Neighbourhood::First { keep: None });
        let refusal = supported(&four, &ring(), 1, Trim::PerAxis).expect_err("two of four lead at best");
        let expected = Unsupported { member: 11, neighbours: 4, reached: Some(2), needed: 3, f: 1 };
        assert_eq!(refusal, expected);
        assert!(refusal.to_string().contains("4 neighbours of which only 2"), "{refusal}");
        let refusal = supported(&four, &columns(1), 2, Trim::PerAxis).expect_err("four at most");
        let expected = Unsupported { member: 10, neighbours: 3, reached: None, needed: 5, f: 2 };
        assert_eq!(refusal, expected);
    }

    #[test]
    fn without_liars_it_is_whether_a_leader_is_heard() {
        let chain = Neighbours::from_lists([vec![], vec![0], vec![1], vec![4], vec![3]]);
        let leaders = [true, false, false, false, false];
        let refusal = supported(&chain, &leaders, 0, Trim::PerAxis).expect_err("two hear each other only");
        assert!(matches!(refusal, Unsupported { member: 3, reached: Some(0), .. }), "{refusal:?}");
        assert_eq!(supported(&chain, &[true, false, false, true, false], 0, Trim::PerAxis), Ok(()));
    }

    #[test]
    fn a_neighbour_is_the_sender_not_the_receiver() {
        // 0 leads and receives from 1; 1 receives from no member.
        let deaf = Neighbours::from_lists([vec![1], vec![]]);
        assert!(supported(&deaf, &[true, false], 0, Trim::PerAxis).is_err());
    }
}
