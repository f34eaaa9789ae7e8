//! The bonds that may still break, in a form that a step looks over quickly.
//!
//! Consecutive particles mostly have bonds of the same index distance and of nearly the same limit. Such a *span* of
//! bonds is measured by squares, many at a time and without lists, against the least of their limits; a bond near it
//! is named, to be measured exactly. A pair that sees each other is watched once. Broken bonds are no longer watched,
//! so that a cracked body costs no more than a whole one.

use std::ops::Range;

use super::super::lanes::{InLanes, in_lanes};
use super::super::neighbourhood::Neighbours;
use super::super::vectors::{Vectors, distance};
use super::Threshold;

/// Particles per block: a bond that breaks is looked for in one block alone.
const BLOCK: usize = 1 << 10;

/// Bonds of a span that are measured before asking whether one of them is near its limit.
const PIECE: usize = 64;

/// Part of a threshold within which a bond is measured exactly: far more than the rounding of a square.
const NEAR_THRESHOLD: f64 = 1e-9;

/// Limits within this ratio share a span \[1\]: those of one direction of a lattice differ by rounding.
const ALIKE: f64 = 1.0 + 1e-6;

/// Live bonds by block of the lower particle's number.
#[derive(Clone, Debug)]
pub struct Watch {
    threshold: Threshold,
    blocks: Vec<Vec<Span>>,
}

/// Bonds of consecutive particles to consecutive others.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// The first particle, counted from the block's first.
    first: u16,
    len: u16,
    /// The particle that the first one is bound to.
    other: u32,
    /// Square below which a bond is surely within its limit \[length^2\].
    bound: f64,
}

impl Span {
    /// Its particles in the block that begins with number `begin`, and those they are bound to.
    #[inline(always)]
    fn ends(&self, begin: usize) -> [Range<usize>; 2] {
        [begin + self.first as usize, self.other as usize].map(|first| first..first + self.len as usize)
    }
}

impl Watch {
    /// Of bonds that hold where `is_live` says so, with the limits that the reference configuration gives them.
    pub fn compile(
        threshold: Threshold,
        neighbours: &Neighbours,
        reference: &Vectors,
        is_live: impl Fn(usize) -> bool,
    ) -> Self {
        let bound = |j, k| square_within(threshold.limit(distance(reference.get(j), reference.get(k))));
        let is_watched = |j: usize, bond: &usize| {
            let k = neighbours.index[*bond] as usize;
            is_live(*bond)
                && (j < k
                    || !neighbours.bonds(k).any(|back| is_bond_to(neighbours, back, j) && is_live(back)))
        };
        let block = |begin: usize| {
            let mut block = Block::default();
            for j in begin..(begin + BLOCK).min(neighbours.count()) {
                for bond in neighbours.bonds(j).filter(|bond| is_watched(j, bond)) {
                    let k = neighbours.index[bond];
                    block.push((j - begin) as u16, k, bound(j, k as usize));
                }
                block.close_particle();
            }
            block.spans
        };
        Self { threshold, blocks: (0..neighbours.count()).step_by(BLOCK).map(block).collect() }
    }

    pub fn threshold(&self) -> Threshold {
        self.threshold
    }

    /// Watches the bond of this pair no more.
    pub fn forget(&mut self, pair: [usize; 2]) {
        for [j, k] in [pair, [pair[1], pair[0]]] {
            let spans = &mut self.blocks[j / BLOCK];
            let at = j % BLOCK;
            let holds = |span: &Span| {
                let first = span.first as usize;
                (first..first + span.len as usize).contains(&at) && span.other as usize + at - first == k
            };
            let Some(which) = spans.iter().position(holds) else { continue };
            let span = spans[which];
            let before = at as u16 - span.first;
            let after =
                Span { first: at as u16 + 1, len: span.len - before - 1, other: k as u32 + 1, ..span };
            match (before, after.len) {
                (0, 0) => _ = spans.swap_remove(which),
                (0, _) => spans[which] = after,
                (_, 0) => spans[which].len = before,
                _ => {
                    spans[which].len = before;
                    spans.push(after);
                }
            }
        }
    }

    /// The particles of all bonds that may have passed their limits, ascending.
    pub fn suspects(&self, present: &Vectors) -> Vec<usize> {
        let mut suspects = Vec::new();
        self.look(present, &mut suspects);
        suspects.sort_unstable();
        suspects.dedup();
        suspects
    }

    fn look(&self, present: &Vectors, suspects: &mut Vec<usize>) {
        in_lanes(Looks { blocks: &self.blocks, present, suspects });
    }
}

/// Spans to look over, in pieces of a width of their own.
struct Looks<'a> {
    blocks: &'a [Vec<Span>],
    present: &'a Vectors,
    suspects: &'a mut Vec<usize>,
}

impl InLanes for Looks<'_> {
    const BYTES: usize = 8;
    const MULTIPLIES: bool = true;

    #[inline(always)]
    fn run<const W: usize>(self) {
        look_over(self.blocks, self.present, self.suspects);
    }
}

fn is_bond_to(neighbours: &Neighbours, bond: usize, particle: usize) -> bool {
    neighbours.index[bond] as usize == particle
}

/// Square that a bond within its limit may have for sure \[length^2\]; none where squares overflow or vanish, so that
/// all those bonds are measured exactly.
fn square_within(limit: f64) -> f64 {
    let square = limit * limit;
    let is_usable = limit > 0.0 && square > f64::MIN_POSITIVE / NEAR_THRESHOLD;
    if is_usable { square.min(f64::MAX) * (1.0 - NEAR_THRESHOLD) } else { 0.0 }
}

/// Spans in the making.
#[derive(Default)]
struct Block {
    spans: Vec<Span>,
    /// Those that the last particle and the present one are in.
    open: [Vec<usize>; 2],
}

impl Block {
    fn push(&mut self, j: u16, other: u32, bound: f64) {
        let goes_on = |&&which: &&usize| {
            let span = &self.spans[which];
            span.first + span.len == j
                && span.other + u32::from(span.len) == other
                && span.bound <= bound * ALIKE
                && bound <= span.bound * ALIKE
        };
        let which = match self.open[0].iter().find(goes_on) {
            Some(&which) => {
                let span = &mut self.spans[which];
                span.len += 1;
                span.bound = span.bound.min(bound);
                which
            }
            None => {
                self.spans.push(Span { first: j, len: 1, other, bound });
                self.spans.len() - 1
            }
        };
        self.open[1].push(which);
    }

    fn close_particle(&mut self) {
        self.open.swap(0, 1);
        self.open[1].clear();
    }
}

#[inline(always)]
fn look_over(blocks: &[Vec<Span>], present: &Vectors, suspects: &mut Vec<usize>) {
    for (block, begin) in blocks.iter().zip((0..).step_by(BLOCK)) {
        for span in block {
            let [near, far] = span.ends(begin);
            let ends = [
                &present.x[near.clone()],
                &present.y[near.clone()],
                &present.x[far.clone()],
                &present.y[far.clone()],
            ];
            for at in (0..near.len()).step_by(PIECE) {
                let to = (at + PIECE).min(near.len());
                if any_near(ends.map(|end| &end[at..to]), span.bound) {
                    suspects.extend(
                        near_ones(ends, at..to, span.bound).flat_map(|i| [near.start + i, far.start + i]),
                    );
                }
            }
        }
    }
}

#[inline(always)]
fn is_near([ax, ay, bx, by]: [f64; 4], bound: f64) -> bool {
    let (x, y) = (ax - bx, ay - by);
    let is_within = x * x + y * y < bound;
    !is_within
}

/// Whether some bond is not surely within its limit: what is no number never is. All slices are of one length.
#[inline(always)]
fn any_near([ax, ay, bx, by]: [&[f64]; 4], bound: f64) -> bool {
    let len = ax.len();
    let (ay, bx, by) = (&ay[..len], &bx[..len], &by[..len]);
    // As numbers of 64 bits, which a vector of doubles compares to: a sum of truth values is not vectorised as well.
    let mut near = 0;
    for i in 0..len {
        near |= u64::from(is_near([ax[i], ay[i], bx[i], by[i]], bound));
    }
    near != 0
}

#[cold]
fn near_ones(ends: [&[f64]; 4], among: Range<usize>, bound: f64) -> impl Iterator<Item = usize> {
    among.filter(move |&i| is_near(ends.map(|end| end[i]), bound))
}
