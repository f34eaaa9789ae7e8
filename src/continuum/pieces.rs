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
        let labelled: Vec<u64> =
            beyond.flat_map(|i| [number(i) as u64, rank, u64::from(labels[i])]).collect();
        let all = team.gather_all(&labelled);
        let named: HashSet<u64> = all.chunks_exact(3).map(|of| of[0]).collect();
        let (mut here, mut pieces): (HashMap<u64, u32>, BTreeMap<u32, u64>) = Default::default();
        for (number, label) in owned.map(|i| (number(i) as u64, labels[i])) {
            // The first of each piece of this rank.
            let first = pieces.entry(label).or_insert(number);
            *first = number.min(*first);
            here.extend(named.contains(&number).then_some((number, label)));
        }
        let pairs: BTreeSet<[u64; 4]> = all
            .chunks_exact(3)
            .filter_map(|of| Some([of[1], of[2], rank, u64::from(*here.get(&of[0])?)]))
            .collect();
        let pairs = team.gather_all(&pairs.into_iter().flatten().collect::<Vec<_>>());
        let own: Vec<u64> =
            pieces.into_iter().flat_map(|(label, number)| [rank, u64::from(label), number]).collect();
        let pieces = team.gather_all(&own);
        let numbers: BTreeMap<[u64; 2], u32> = {
            let nodes = pieces.chunks_exact(3).map(|of| [of[0], of[1]]);
            let ends = pairs.chunks_exact(2).map(|of| [of[0], of[1]]);
            nodes.chain(ends).collect::<BTreeSet<_>>().into_iter().zip(0..).collect()
        };
        let mut sets = DisjointSets::new(numbers.len());
        for pair in pairs.chunks_exact(4) {
            sets.join(numbers[&[pair[0], pair[1]]], numbers[&[pair[2], pair[3]]]);
        }
        let joined = sets.labels();
        let mut of_joined: BTreeMap<u32, u64> = BTreeMap::new();
        for of in pieces.chunks_exact(3) {
            let known = of_joined.entry(joined[numbers[&[of[0], of[1]]] as usize]).or_insert(of[2]);
            *known = of[2].min(*known);
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
    let corner = |cell: usize| [number(cell) as u64, body.index(cells.of(cell)[0] as usize) as u64];
    let is_first = |&[number, _]: &[u64; 2]| firsts.binary_search(&number).is_ok();
    let own: Vec<u64> = owned().map(corner).filter(is_first).flatten().collect();
    let corners: BTreeMap<u64, usize> =
        team.gather_all(&own).chunks_exact(2).map(|of| (of[0], of[1] as usize)).collect();
    let corners: Vec<usize> = corners.into_values().collect();
    if corners.len() <= 1 {
        return (part, Linkage { corners, hinges: Vec::new() });
    }
    let hinge = |i: usize| {
        let parts = incidence.of(i).iter().map(|&cell| part[cell as usize]);
        Hinge::of((body.index(i), body.reference.get(i)), parts)
    };
    let words = |Hinge { particle, place: [x, y], parts }: Hinge| {
        let head = [particle as u64, x.to_bits(), y.to_bits(), parts.len() as u64];
        head.into_iter().chain(parts.into_iter().map(|part| part as u64))
    };
    let own: Vec<u64> = body.owned().filter_map(hinge).flat_map(words).collect();
    let (all, mut hinges) = (team.gather_all(&own), Vec::new());
    let mut rest = &all[..];
    while let [particle, x, y, count, more @ ..] = rest {
        let (parts, after) = more.split_at(*count as usize);
        let place = [x, y].map(|&bits| f64::from_bits(bits));
        let parts = parts.iter().map(|&part| part as usize).collect();
        hinges.push(Hinge { particle: *particle as usize, place, parts });
        rest = after;
    }
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
    let words: Vec<u64> =
        holds.iter().flat_map(|hold| [hold.first, hold.held, hold.whole]).map(|n| n as u64).collect();
    let all = team.gather_all(&words);
    let mut holds = vec![Hold::NONE; groups.len()];
    for (k, of) in all.chunks_exact(3).enumerate() {
        let hold = &mut holds[k % groups.len()];
        let [first, held, whole] = [of[0], of[1], of[2]].map(|n| n as usize);
        *hold = Hold { first: hold.first.min(first), held: hold.held + held, whole: hold.whole + whole };
    }
    let places = || -> Vec<HeldPlace> {
        let words = |i: usize| {
            let ([x, y], axes) = (body.reference.get(i).map(f64::to_bits), held[i].map(u64::from));
            let of = |&cell: &u32| [x, y, part[cell as usize] as u64, axes[0], axes[1], body.index(i) as u64];
            incidence.of(i).iter().flat_map(of).collect::<Vec<_>>()
        };
        let own = body.owned().filter(|&i| held[i] != [false; 2]);
        let all = team.gather_all(&own.flat_map(words).collect::<Vec<_>>());
        let mut all: Vec<_> = all.chunks_exact(6).collect();
        all.sort_by_key(|of| of[5]);
        let place = |of: &[u64]| [0, 1].map(|k| f64::from_bits(of[k]));
        all.into_iter().map(|of| (place(of), of[2] as usize, [of[3] == 1, of[4] == 1])).collect()
    };
    linkage.require_held(body.bounds(), &holds, places)
}
