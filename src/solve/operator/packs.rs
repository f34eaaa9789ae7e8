//! Particles with rows of their own, as those along an outline and beside it have: so many at a time, each in a lane.
//!
//! On a coarse grid every node of a body with holes has a row of its own, but those one above the other lead to others that are
//! so too: what all lanes of a term read then lies in a row, and is loaded at once.

use std::ops::Range;

use super::matrix::{Matrix, Run};
use crate::solve::field::Real;

/// Particles of a pack: one AVX2 vector of single precision, two of double.
pub const PACK: usize = 8;

/// Lanes that must read from a row of particles for the others to do so too, which then add nothing: the first one and the
/// last, so that all of the row is there, and one more.
const ALIKE: u32 = 3;
const ENDS: u8 = 1 | 1 << (PACK - 1);

/// Fewest particles, one after the other, for which a pack is filled up with those beside them.
const STRETCH: usize = 5;

/// Particles among which those of a pack are chosen: their rows lie close to each other.
const CLOSE: usize = 16 * PACK;

/// Particles that are gone over together.
#[derive(Clone, Debug)]
pub struct Pack {
    /// The particle of each lane; in the last pack of a group one may be there more than once.
    pub particles: [u32; PACK],
    /// Whether they follow each other.
    pub is_in_a_row: bool,
    classes: [u32; PACK],
    /// Its terms that read particles in a row, among those of all packs, ...
    rows: Range<u32>,
    /// ... and the others, which come after them.
    gathers: Range<u32>,
}

impl Pack {
    /// Where its terms lie in what [`Packs::interleaved`] gives.
    #[inline(always)]
    pub fn terms(&self) -> Range<usize> {
        (self.rows.start + self.gathers.start) as usize..(self.rows.end + self.gathers.end) as usize
    }
}

/// The packs of a matrix.
#[derive(Clone, Debug, Default)]
pub struct Packs {
    packs: Vec<Pack>,
    /// First pack of each group, shape \[groups + 1\].
    groups: Vec<usize>,
    /// The first particle that each term in a row reads.
    rows: Vec<u32>,
    /// The particles that each other term reads, shape \[terms\]\[lanes\].
    gathers: Vec<[u32; PACK]>,
    /// The term of its pack that each entry of each lane is in, lane by lane, pack by pack.
    slots: Vec<u16>,
}

/// A particle with its run.
type Lane<'a> = (u32, &'a Run);

impl Packs {
    pub fn new(matrix: &Matrix) -> Self {
        let mut packs = Self { groups: vec![0], ..Self::default() };
        let mut terms = Terms::default();
        // What leads to particles along an outline leads everywhere.
        let is_even = matrix.outliers.is_empty();
        for group in 0..matrix.groups() {
            let mut scattered = Vec::new();
            for stretch in stretches(matrix.runs_of(group), is_even) {
                let (in_packs, left) = stretch.as_chunks::<PACK>();
                let (in_packs, left) = if is_even { (in_packs, left) } else { (&[][..], &stretch[..]) };
                for lanes in in_packs {
                    terms.in_rows(matrix, lanes);
                    packs.push(lanes, &terms);
                }
                scattered.extend(left);
            }
            for close in scattered.chunks_mut(CLOSE) {
                // Rows about as long as each other have the fewest terms that only some of them need.
                close.sort_by_key(|(_, run)| run.terms);
            }
            for of_pack in scattered.chunks(PACK) {
                let lanes: [_; PACK] = std::array::from_fn(|lane| of_pack[lane.min(of_pack.len() - 1)]);
                terms.gathered(matrix, &lanes);
                packs.push(&lanes, &terms);
            }
            packs.groups.push(packs.packs.len());
        }
        packs
    }

    fn push(&mut self, lanes: &[Lane<'_>; PACK], terms: &Terms) {
        let [rows, gathers] = [self.rows.len() as u32, self.gathers.len() as u32];
        self.rows.extend(&terms.rows);
        self.gathers.extend(&terms.gathers);
        self.slots.extend(&terms.slots);
        self.packs.push(Pack {
            particles: lanes.map(|(particle, _)| particle),
            is_in_a_row: lanes.iter().zip(lanes[0].0..).all(|((particle, _), in_row)| *particle == in_row),
            classes: lanes.map(|(_, run)| run.class),
            rows: rows..self.rows.len() as u32,
            gathers: gathers..self.gathers.len() as u32,
        });
    }

    pub fn all(&self) -> &[Pack] {
        &self.packs
    }

    /// Numbers of the packs of a group.
    #[inline(always)]
    pub fn of_group(&self, group: usize) -> Range<usize> {
        self.groups[group]..self.groups[group + 1]
    }

    /// The first particles that the terms of a pack in a row read, and the particles that the terms after them do.
    #[inline(always)]
    pub fn read_by(&self, pack: &Pack) -> (&[u32], &[[u32; PACK]]) {
        let [rows, gathers] =
            [&pack.rows, &pack.gathers].map(|range| range.start as usize..range.end as usize);
        (&self.rows[rows], &self.gathers[gathers])
    }

    /// The blocks of the particles of all packs, lane by lane; nothing where a row has no more.
    pub fn interleaved<T: Real, B: Iterator<Item = [T; 4]>>(
        &self,
        blocks: impl Fn(u32) -> B,
    ) -> Vec<[[T; PACK]; 4]> {
        let mut all = vec![[[T::default(); PACK]; 4]; self.rows.len() + self.gathers.len()];
        let mut begin = 0;
        for pack in &self.packs {
            let of_pack = &mut all[pack.terms()];
            for (lane, &class) in pack.classes.iter().enumerate() {
                let slots = &self.slots[begin..];
                for (block, &slot) in blocks(class).zip(slots) {
                    let term = &mut of_pack[slot as usize];
                    (0..4).for_each(|entry| term[entry][lane] = block[entry]);
                    begin += 1;
                }
            }
        }
        all
    }

    /// Four numbers of the particles of each pack, lane by lane.
    pub fn of_each<T: Real>(&self, numbers: impl Fn(u32) -> [T; 4]) -> Vec<[[T; PACK]; 4]> {
        let of_pack = |pack: &Pack| {
            let of_lane = pack.classes.map(&numbers);
            std::array::from_fn(|entry| of_lane.map(|numbers| numbers[entry]))
        };
        self.packs.iter().map(of_pack).collect()
    }
}

/// The particles of short runs that follow each other; what is missing to whole packs is filled up from the long runs after
/// and before them, whose particles are then computed twice.
fn stretches(runs: &[Run], is_filled_up: bool) -> impl Iterator<Item = Vec<Lane<'_>>> {
    let follow = |a: &Run, b: &Run| a.start + a.len == b.start && a.is_packed() == b.is_packed();
    let chunks = runs.chunk_by(follow).scan(0, |begin, chunk| {
        let before = *begin;
        *begin += chunk.len();
        Some((before, chunk))
    });
    chunks.filter(|(_, chunk)| chunk[0].is_packed()).map(move |(begin, chunk)| {
        let mut lanes: Vec<_> = lanes_of(chunk).collect();
        let missing = lanes.len().next_multiple_of(PACK) - lanes.len();
        let [first, end] = [lanes[0].0, lanes[lanes.len() - 1].0 + 1];
        let after = runs.get(begin + chunk.len()).filter(|run| run.start == end);
        let before = begin.checked_sub(1).map(|at| &runs[at]).filter(|run| run.start + run.len == first);
        let beside = [before, after].map(|run| run.map_or(0, |run| run.len as usize));
        if is_filled_up && missing <= PACK - STRETCH && missing <= beside[0] + beside[1] {
            lanes.extend(lanes_of(after).take(missing));
            let missing = missing - missing.min(beside[1]);
            lanes.splice(0..0, lanes_of(before).skip(beside[0] - missing));
        }
        lanes
    })
}

/// The particles of some runs.
fn lanes_of<'a>(runs: impl IntoIterator<Item = &'a Run>) -> impl Iterator<Item = Lane<'a>> {
    let of_run = |run: &'a Run| (run.start..run.start + run.len).map(move |particle| (particle, run));
    runs.into_iter().flat_map(of_run)
}

/// The terms of a pack while it is made.
#[derive(Default)]
struct Terms {
    rows: Vec<u32>,
    gathers: Vec<[u32; PACK]>,
    slots: Vec<u16>,
    /// Distances that lanes read at, and a bit for each that does.
    known: Vec<(i32, u8)>,
    /// Of each known one, its place among the rows.
    places: Vec<Option<u16>>,
}

impl Terms {
    fn clear(&mut self) {
        self.rows.clear();
        self.gathers.clear();
        self.slots.clear();
        self.known.clear();
        self.places.clear();
    }

    /// Of these lanes, each of which reads by itself.
    fn gathered(&mut self, matrix: &Matrix, lanes: &[Lane<'_>; PACK]) {
        self.clear();
        for (lane, (particle, run)) in lanes.iter().enumerate() {
            for (term, &distance) in matrix.distances(run).iter().enumerate() {
                if term == self.gathers.len() {
                    self.gathers.push(lanes.map(|(particle, _)| particle));
                }
                self.gathers[term][lane] = particle.wrapping_add_signed(distance);
                self.slots.push(term as u16);
            }
        }
    }

    /// Of these lanes; what enough of them read at one distance is a term in a row.
    fn in_rows(&mut self, matrix: &Matrix, lanes: &[Lane<'_>; PACK]) {
        self.clear();
        let Self { rows, gathers, slots, known, places } = self;
        for (lane, (_, run)) in lanes.iter().enumerate() {
            let distances = matrix.distances(run);
            if lane > 0 && distances == matrix.distances(lanes[lane - 1].1) {
                let begin = slots.len() - distances.len();
                slots.extend_from_within(begin..);
                slots[begin..begin + distances.len()]
                    .iter()
                    .for_each(|&at| known[at as usize].1 |= 1 << lane);
                continue;
            }
            let mut next = 0;
            for &distance in distances {
                // A row may lead to one particle more than once.
                let is_free = |&(at, read_by): &(i32, u8)| at == distance && read_by & 1 << lane == 0;
                // Neighbours lead to others in the same order, but for those at which something ends.
                let is_next = known.get(next).is_some_and(is_free);
                let at = if is_next { Some(next) } else { known.iter().position(is_free) };
                let at = at.unwrap_or_else(|| {
                    known.push((distance, 0));
                    known.len() - 1
                });
                known[at].1 |= 1 << lane;
                slots.push(at as u16);
                next = at + 1;
            }
        }
        for &(distance, read_by) in &*known {
            let has_ends = read_by & ENDS == ENDS;
            places.push((has_ends && read_by.count_ones() >= ALIKE).then(|| {
                rows.push(lanes[0].0.wrapping_add_signed(distance));
                rows.len() as u16 - 1
            }));
        }
        let mut left = slots.iter_mut();
        for (lane, (particle, run)) in lanes.iter().enumerate() {
            let mut gathered = 0;
            for (&distance, slot) in matrix.distances(run).iter().zip(left.by_ref()) {
                *slot = places[*slot as usize].unwrap_or_else(|| {
                    if gathered == gathers.len() {
                        gathers.push(lanes.map(|(particle, _)| particle));
                    }
                    gathers[gathered][lane] = particle.wrapping_add_signed(distance);
                    gathered += 1;
                    (rows.len() + gathered - 1) as u16
                });
            }
        }
    }
}
