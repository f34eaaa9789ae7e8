//! Particles with rows of their own, as those along an outline and beside it have: so many at a time, each in a lane.

use std::ops::Range;

use super::matrix::Matrix;
use crate::solve::field::Real;

/// Particles of a pack: one AVX2 vector of single precision, two of double.
pub const PACK: usize = 8;

/// Particles that are gone over together.
#[derive(Clone, Debug)]
pub struct Pack {
    /// Particle and class of each lane; the last of a group may have fewer.
    lanes: [(u32, u32); PACK],
    len: u32,
    /// Where its terms lie, as many as the longest of its rows has.
    pub terms: Range<u32>,
}

impl Pack {
    /// Particles and their classes.
    #[inline(always)]
    pub fn particles(&self) -> &[(u32, u32)] {
        &self.lanes[..self.len as usize]
    }
}

/// The packs of a matrix.
#[derive(Clone, Debug, Default)]
pub struct Packs {
    packs: Vec<Pack>,
    /// First pack of each group, shape \[groups + 1\].
    groups: Vec<usize>,
    /// The particles that each term reads, shape \[terms\]\[lanes\].
    read: Vec<[u32; PACK]>,
}

impl Packs {
    pub fn new(matrix: &Matrix) -> Self {
        let mut packs = Self { groups: vec![0], ..Self::default() };
        for group in 0..matrix.groups() {
            let short = matrix.runs_of(group).iter().filter(|run| run.is_packed());
            let mut particles: Vec<_> =
                short.flat_map(|run| (run.start..run.start + run.len).map(move |i| (i, run))).collect();
            // Rows about as long as each other have the fewest terms that only some of them need.
            particles.sort_by_key(|(_, run)| run.terms);
            for of_pack in particles.chunks(PACK) {
                let begin = packs.read.len();
                let terms = of_pack.iter().map(|(_, run)| run.terms).max().unwrap_or_default() as usize;
                packs.read.resize(begin + terms, [of_pack[0].0; PACK]);
                let mut lanes = [(0, 0); PACK];
                for (lane, (particle, run)) in of_pack.iter().enumerate() {
                    lanes[lane] = (*particle, run.class);
                    for (read, &distance) in packs.read[begin..].iter_mut().zip(matrix.distances(run)) {
                        read[lane] = particle.wrapping_add_signed(distance);
                    }
                }
                let terms = begin as u32..packs.read.len() as u32;
                packs.packs.push(Pack { lanes, len: of_pack.len() as u32, terms });
            }
            packs.groups.push(packs.packs.len());
        }
        packs
    }

    #[inline(always)]
    pub fn of_group(&self, group: usize) -> &[Pack] {
        &self.packs[self.groups[group]..self.groups[group + 1]]
    }

    /// The particles that these terms read.
    #[inline(always)]
    pub fn read_by(&self, terms: Range<usize>) -> &[[u32; PACK]] {
        &self.read[terms]
    }

    /// The blocks of the particles of all packs, lane by lane; nothing where a row has no more.
    pub fn interleaved<T: Real, B: Iterator<Item = [T; 4]>>(
        &self,
        blocks: impl Fn(u32) -> B,
    ) -> Vec<[[T; PACK]; 4]> {
        let mut all = vec![[[T::default(); PACK]; 4]; self.read.len()];
        for pack in &self.packs {
            let of_pack = &mut all[pack.terms.start as usize..pack.terms.end as usize];
            for (lane, &(_, class)) in pack.particles().iter().enumerate() {
                for (to, block) in of_pack.iter_mut().zip(blocks(class)) {
                    (0..4).for_each(|entry| to[entry][lane] = block[entry]);
                }
            }
        }
        all
    }
}
