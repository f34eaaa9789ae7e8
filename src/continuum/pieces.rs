//! The pieces that a body falls into, where each rank has a part of it.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::ops::Range;

use crate::flock::body::{Body, BodyError};
use crate::flock::neighbourhood::Neighbours;
use crate::flock::part::Part;
use crate::geometry::disjoint_sets::DisjointSets;
use crate::material::cells::{Cells, Incidence};
use crate::material::mechanism::{HeldPlace, Hinge, Hold, Linkage, Mechanism, joined_cells};

use crate::ranks::Team;

/// Pieces that particles, or cells, of all ranks make up.
struct Pieces {
    /// The first of each piece, by its number in the whole body; ascending.
    firsts: Vec<u64>,
    /// Number of the piece, by label on this rank.
    of_label: BTreeMap<u32, usize>,
}

impl Pieces {
    /// `labels` are the same for those that hang together here; `number` says which each is in the whole body. Those that are
    /// `owned` belong to this rank, and those in `beyond` to others: where the pieces of two ranks meet, at least one of both must
    /// name one that the other owns.
    fn among(
        team: &Team,
        labels: &[u32],
        number: impl Fn(usize) -> usize,
        owned: impl Iterator<Item = usize>,
        beyond: impl Iterator<Item = usize>,
    ) -> Self {
        let rank = team.rank() as u64;
        let labelled: Vec<_> = beyond.map(|i| [number(i) as u64, rank, u64::from(labels[i])]).collect();
        let all = team.gather_all(&labelled);
        let named: HashSet<u64> = all.iter().map(|of| of[0]).collect();
        let (mut here, mut pieces): (HashMap<u64, u32>, BTreeMap<u32, u64>) = Default::default();
        for (number, label) in owned.map(|i| (number(i) as u64, labels[i])) {
            // The first of each piece of this rank.
            let first = pieces.entry(label).or_insert(number);
            *first = number.min(*first);
            here.extend(named.contains(&number).then_some((number, label)));
        }
        let pair = |&[number, other, label]: &[u64; 3]| {
            Some([[other, label], [rank, u64::from(*here.get(&number)?)]])
        };
        let pairs: BTreeSet<[[u64; 2]; 2]> = all.iter().filter_map(pair).collect();
        let pairs = team.gather_all(&pairs.into_iter().collect::<Vec<_>>());
        let own: Vec<_> =
            pieces.into_iter().map(|(label, number)| ([rank, u64::from(label)], number)).collect();
        let pieces = team.gather_all(&own);
        let numbers: BTreeMap<[u64; 2], u32> = {
            let nodes = pieces.iter().map(|(node, _)| *node);
            nodes
                .chain(pairs.iter().flatten().copied())
                .collect::<BTreeSet<_>>()
                .into_iter()
                .zip(0..)
                .collect()
        };
        let mut sets = DisjointSets::new(numbers.len());
        for [one, other] in &pairs {
            sets.join(numbers[one], numbers[other]);
        }
        let joined = sets.labels();
        let mut of_joined: BTreeMap<u32, u64> = BTreeMap::new();
        for (node, number) in pieces {
            let known = of_joined.entry(joined[numbers[&node] as usize]).or_insert(number);
            *known = number.min(*known);
        }
        let mut firsts: Vec<u64> = of_joined.values().copied().collect();
        firsts.sort_unstable();
        let piece = |node: u32| firsts.binary_search(of_joined.get(&joined[node as usize])?).ok();
        let own = numbers.iter().filter(|([of, _], _)| *of == rank);
        let of_label = own.filter_map(|([_, label], &node)| Some((*label as u32, piece(node)?))).collect();
        Self { firsts, of_label }
    }
}

/// Refuses a body that is in pieces, as [`Body::require_connected`] does; for all ranks together.
///
/// # Errors
/// On all ranks alike.
pub fn require_connected(body: &Body, neighbours: &Neighbours, team: &Team) -> Result<(), BodyError> {
    let Some(Part { owned, exact, .. }) = &body.part else {
        return body.require_connected(neighbours);
    };
    let mut sets = DisjointSets::new(body.count());
    for i in exact.clone() {
        let seen = neighbours.of(i).iter().filter(|&&k| !body.is_frame[k as usize]);
        seen.filter(|&&k| exact.contains(&(k as usize))).for_each(|&k| sets.join(i as u32, k));
    }
    // Those just beyond the end of this part, by which bonds lead to others: as far as the last of its own see.
    let sees = |i: usize| neighbours.of(i).iter().map(|&k| k as usize).max().unwrap_or(i);
    let end = owned.clone().map(sees).max().map_or(owned.end, |last| (last + 1).clamp(owned.end, exact.end));
    let members = |i: usize| !body.is_frame[i];
    // And those before this part that do not see its own: their rank does not name these.
    let sees = |from: u32, other: usize| neighbours.of(from as usize).contains(&(other as u32));
    let before = owned.clone().flat_map(|i| neighbours.of(i).iter().filter(move |&&k| !sees(k, i)));
    let before: BTreeSet<usize> =
        before.map(|&k| k as usize).filter(|k| (exact.start..owned.start).contains(k)).collect();
    let beyond = before.into_iter().chain(owned.end..end).filter(|&i| members(i));
    let own = owned.clone().filter(|&i| members(i));
    let pieces = Pieces::among(team, &sets.labels(), |i| body.index(i), own, beyond);
    match pieces.firsts[..] {
        [first, second, ..] => {
            let [first, second] = [first, second].map(|index| index as usize + 1);
            Err(BodyError::Disconnected { parts: pieces.firsts.len(), first, second })
        }
        _ => Ok(()),
    }
}

/// Which cells of the whole body those of a part are.
pub struct CellNumbers<'a> {
    body: &'a Body,
    /// Those that belong to this part.
    pub owned: Vec<Range<usize>>,
    /// How many of those that stand here are whole.
    whole: usize,
    /// Whole cells of the body before those that belong to this part, and in all.
    before: usize,
    total: usize,
}

impl<'a> CellNumbers<'a> {
    /// Found by all ranks that have parts of the body.
    pub fn of(body: &'a Body, cells: &Cells, team: Option<&Team>) -> Self {
        let (owned, whole) = (cells.owned(body), cells.count_whole());
        let counts = match team {
            Some(team) => team.each([owned[0].len() as u64]),
            None => Vec::from([[whole as u64]]),
        };
        let sum = |counts: &[[u64; 1]]| counts.iter().map(|[count]| *count as usize).sum::<usize>();
        let before = sum(&counts[..team.map_or(0, Team::rank)]);
        Self { body, owned, whole, before, total: sum(&counts) }
    }

    /// The number of a cell in the whole body.
    pub fn number(&self, cell: usize) -> usize {
        match self.body.cell_after_all(cell, self.whole) {
            Some(number) => self.total + number,
            None => self.before + cell - self.owned[0].start,
        }
    }
}

/// How the parts of a body in which cells are rigid together are linked, found by all ranks; and which part each cell belongs to
/// that has a corner that this rank owns, or is a neighbour of one that it owns, shape \[cells\].
pub fn linkage(body: &Body, (cells, incidence): (&Cells, &Incidence), team: &Team) -> (Vec<usize>, Linkage) {
    let labels = joined_cells(cells, incidence);
    let numbers = CellNumbers::of(body, cells, Some(team));
    let owned = || numbers.owned.iter().cloned().flatten();
    let is_owned = |cell: usize| numbers.owned.iter().any(|stretch| stretch.contains(&cell));
    let corners = owned().flat_map(|cell| cells.of(cell)).map(|&i| i as usize).chain(body.owned());
    let around = corners.collect::<BTreeSet<_>>().into_iter().flat_map(|i| incidence.of(i));
    let beyond: BTreeSet<usize> = around.map(|&cell| cell as usize).filter(|&c| !is_owned(c)).collect();
    let number = |cell: usize| numbers.number(cell);
    let Pieces { firsts, of_label } = Pieces::among(team, &labels, number, owned(), beyond.into_iter());
    let part: Vec<usize> = labels.iter().map(|l| of_label.get(l).copied().unwrap_or(usize::MAX)).collect();
    let corner = |cell: usize| (number(cell) as u64, body.index(cells.of(cell)[0] as usize));
    let is_first = |(number, _): &(u64, usize)| firsts.binary_search(number).is_ok();
    let own: Vec<_> = owned().map(corner).filter(is_first).collect();
    let corners: BTreeMap<u64, usize> = team.gather_all(&own).into_iter().collect();
    let corners: Vec<usize> = corners.into_values().collect();
    if corners.len() <= 1 {
        return (part, Linkage { corners, hinges: Vec::new() });
    }
    let hinge = |i: usize| {
        let parts = incidence.of(i).iter().map(|&cell| part[cell as usize]);
        Hinge::of((body.index(i), body.reference.get(i)), parts)
    };
    let mut hinges = team.gather_all(&body.owned().filter_map(hinge).collect::<Vec<_>>());
    hinges.sort_by_key(|hinge| hinge.particle);
    (part, Linkage { corners, hinges })
}

/// Refuses a body that the `held` components of its particles do not keep from moving, shape \[count\]\[x, y\], as
/// [`require_held`](crate::material::mechanism::require_held) does; for all ranks together, which have found how its parts are
/// linked.
///
/// # Errors
/// On all ranks alike.
pub fn require_held(
    body: &Body,
    incidence: &Incidence,
    (part, linkage): (&[usize], &Linkage),
    held: &[[bool; 2]],
    team: &Team,
) -> Result<(), Mechanism> {
    let groups = linkage.groups();
    let group_of = |i: usize| incidence.of(i).first().map(|&cell| groups[part[cell as usize]]);
    let mut holds = vec![Hold::NONE; groups.len()];
    for i in body.owned() {
        if let Some(group) = group_of(i) {
            holds[group] = holds[group].with(body.index(i), held[i]);
        }
    }
    let all = team.gather_all(&holds);
    holds.fill(Hold::NONE);
    for (k, Hold { first, held, whole }) in all.into_iter().enumerate() {
        let hold = &mut holds[k % groups.len()];
        *hold = Hold { first: hold.first.min(first), held: hold.held + held, whole: hold.whole + whole };
    }
    let places = || -> Vec<HeldPlace> {
        let places = |i: usize| {
            let place =
                move |&cell: &u32| (body.index(i), (body.reference.get(i), part[cell as usize], held[i]));
            incidence.of(i).iter().map(place)
        };
        let own = body.owned().filter(|&i| held[i] != [false; 2]);
        let mut all = team.gather_all(&own.flat_map(places).collect::<Vec<_>>());
        all.sort_by_key(|(index, _)| *index);
        all.into_iter().map(|(_, place)| place).collect()
    };
    linkage.require_held(body.bounds(), &holds, places)
}
